//! The weights of a path by their definition: all densities of all its vertices from both ends, multiplied up in double
//! precision logarithms (Veach 1997, §10.2). The oracle of [`Weigher`], and what explains a single sample.

use super::{Resampled, Targets, Weigher, spread};
use crate::emit::LightEnd;
use crate::math::{Rgb, Vec3};
use crate::path::{FullPath, Interior};
use crate::prepared::PreparedScene;
use crate::shade::Transport;

/// Densities of a path's vertices v_0 … v_k.
#[derive(Clone, Debug)]
pub struct Densities {
    /// p_L(v_i), from the light's end, survival of roulette included, for i < k.
    pub light: Vec<f64>,
    /// p_E(v_i), from the lens's end.
    pub eye: Vec<f64>,
    /// Whether the edge v_{i−1} v_i can be a connection, for i = 1 … k; and for i = 0, whether a ray can meet the light by chance.
    pub joinable: Vec<bool>,
    /// c_1, see `mis::weigh`.
    pub next_event: f64,
    /// c_s of connections with s ≥ 2 and t ≥ 2, see `mis::resampled`; 1 elsewhere.
    pub factors: Vec<f64>,
}

/// Two neighbouring vertices of a path, of which the first could have been the last of a light sub-path that was resampled for the other.
#[derive(Clone, Copy, Debug)]
pub struct Joined<'a> {
    /// Number of vertices of that light sub-path.
    pub s: usize,
    /// The one nearer to the light.
    pub y: &'a Interior,
    /// Unit direction from `y` to the vertex before it.
    pub from: Vec3,
    /// The one nearer to the lens.
    pub z: &'a Interior,
    /// Unit direction from `y` to `z`.
    pub to: Vec3,
    /// Square of their distance.
    pub distance2: f32,
    /// β_L at `y`.
    pub arriving: Rgb,
    /// What the light sub-path brings to `z`.
    pub brings: Targets,
}

/// Densities of `path` where sub-paths play roulette as `weigher` says. `factor_of` is c of a connection between two of its vertices; only
/// weights that know of resampling ask for it.
pub fn densities(
    scene: &PreparedScene,
    weigher: &Weigher,
    factor_of: &dyn Fn(&Resampled, &Joined) -> f32,
    path: &FullPath,
) -> Densities {
    let k = path.edges();
    let light = scene.lights.get(path.origin.light);
    let infinite = light.is_infinite();
    let chosen = f64::from(scene.lights.pmf(path.origin.light).0);
    let (position, direction) = light.pdf_emission_given_vertex(path.origin.leaving);
    // From a density per steradian at v_i's neighbour to v_i's own measure along edge e, whose direction is d.
    let to_area = |i: usize, e: usize| -> f64 {
        let (d, distance) = path.edge(e);
        match i {
            0 => match path.origin.end {
                LightEnd::Surface { ng, .. } => f64::from(spread(ng.dot(d), distance * distance)),
                LightEnd::Point { .. } => f64::from(distance).powi(-2),
                LightEnd::Infinite => 1.0,
            },
            _ => f64::from(spread(path.interior[i - 1].point.ng.dot(d), distance * distance)),
        }
    };
    // Density per steradian at the interior vertex v_i of the direction `to`, coming from `from`; survival included.
    let scatter = |i: usize, from: Vec3, to: Vec3, towards_lens: bool| -> f64 {
        let v = &path.interior[i - 1];
        let number = if towards_lens { i } else { k - i };
        let limits = if towards_lens { &weigher.light_limits } else { &weigher.eye_limits };
        let survives = limits.survival(number as u32, &v.bsdf);
        let pdf = match v.delta {
            Some((pdfs, _)) => pdfs[usize::from(!towards_lens)],
            None => v.bsdf.pdf(from, to, Transport::Radiance),
        };
        f64::from(pdf.0) * f64::from(survives)
    };

    let mut from_light = vec![chosen * f64::from(if infinite { direction.0 } else { position.0 })];
    for i in 1..k {
        let density = if i == 1 {
            let cos = f64::from(path.interior[0].point.ng.dot(path.origin.leaving).abs());
            if infinite { f64::from(position.0) * cos } else { f64::from(direction.0) * to_area(1, 0) }
        } else {
            scatter(i - 1, -path.edge(i - 2).0, path.edge(i - 1).0, true) * to_area(i, i - 1)
        };
        from_light.push(density);
    }

    let last = path.edge(k - 1).0;
    let (lens, view) = scene.camera.pdf_sampled_ray(-last);
    let mut from_eye = vec![0.0; k + 1];
    from_eye[k] = f64::from(lens.0);
    from_eye[k - 1] = f64::from(view.0) * to_area(k - 1, k - 1);
    for i in (0..k - 1).rev() {
        from_eye[i] = scatter(i + 1, path.edge(i + 1).0, -path.edge(i).0, false) * to_area(i, i);
    }

    let smooth = |i: usize| i == 0 || i == k || path.interior[i - 1].delta.is_none();
    let joinable = (0..=k).map(|i| if i == 0 { !light.is_delta() } else { smooth(i - 1) && smooth(i) }).collect();
    let next_event = path.interior.first().map_or(1.0, |v| {
        let picked = f64::from(scene.lights.pmf_from(v.point.p, v.light_normal, path.origin.light).0);
        if light.is_delta() {
            return picked / chosen;
        }
        let (d, distance) = path.edge(0);
        picked * f64::from(light.pdf_direct(v.point.p, -d, distance).0) * to_area(0, 0) / from_light[0]
    });
    let mut factors = vec![1.0; k + 1];
    if let Some(resampled) = &weigher.resampled {
        // β_L as a light's walk has it on arriving at v_{i−1}.
        let mut arriving = path.origin.flux.to_array().map(f64::from);
        for (i, factor) in factors.iter_mut().enumerate().take(k).skip(2) {
            let v = &path.interior[i - 2];
            let (from, to) = (-path.edge(i - 2).0, path.edge(i - 1).0);
            let value = v.delta.map_or_else(|| v.bsdf.eval(from, to, Transport::Importance), |(_, value)| value);
            let scattered: [f64; 3] = std::array::from_fn(|c| arriving[c] * f64::from(value[c]));
            let luminance = |light: [f64; 3]| Rgb::from(light.map(|v| (v * to_area(i, i - 1)) as f32)).luminance();
            let brings = Targets {
                scattered: luminance(scattered),
                unscattered: luminance(arriving) * v.point.ng.dot(to).abs(),
            };
            let joined = Joined {
                s: i,
                y: v,
                from,
                z: &path.interior[i - 1],
                to,
                distance2: path.edge(i - 1).1.powi(2),
                arriving: Rgb::from(arriving.map(|v| v as f32)),
                brings,
            };
            *factor = f64::from(factor_of(resampled, &joined));
            arriving = scattered.map(|v| v / scatter(i - 1, from, to, true));
        }
    }
    Densities { light: from_light, eye: from_eye, joinable, next_event, factors }
}

impl Densities {
    /// ln of n_s c_s p_s for every technique (s, k + 1 − s), s = 0 … k; −∞ for those that cannot make the path.
    pub fn log_shares(&self, weigher: &Weigher) -> Vec<f64> {
        let k = self.eye.len() - 1;
        (0..=k)
            .map(|s| {
                let n = f64::from(weigher.techniques.count(s, k + 1 - s));
                let c = if s == 1 && k >= 2 { self.next_event } else { self.factors[s] };
                let possible = if self.joinable[s] { 1.0 } else { 0.0 };
                let light: f64 = self.light[..s].iter().map(|p| p.ln()).sum();
                // p_E(v_0) is asked of a light that cannot be hit only where the technique is impossible anyway.
                let eye: f64 = if possible > 0.0 { self.eye[s..].iter().map(|p| p.ln()).sum() } else { 0.0 };
                (n * c * possible).ln() + light + eye
            })
            .collect()
    }

    /// The weight of every technique (s, k + 1 − s), s = 0 … k.
    pub fn weights(&self, weigher: &Weigher) -> Vec<f64> {
        let logs = self.log_shares(weigher);
        let beta = match weigher.heuristic {
            super::Heuristic::Balance => 1.0,
            super::Heuristic::Power => 2.0,
        };
        let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let shares: Vec<f64> = logs.iter().map(|l| (beta * (l - top)).exp()).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter().map(|x| if *x > 0.0 { x / sum } else { 0.0 }).collect()
    }
}
