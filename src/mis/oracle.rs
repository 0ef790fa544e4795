//! The weights of a path by their definition: all densities of all its vertices from both ends, multiplied up in double
//! precision logarithms (Veach 1997, §10.2). It is the oracle of [`MisContext::weight`], and explains single samples.

use super::factor::{ConnectionFactor, IncidentSubpath, ResamplingTarget};
use super::{Heuristic, MisContext};
use crate::emit::EmitterVertex;
use crate::math::measure::area_jacobian;
use crate::math::{Rgb, Vec3};
use crate::path::{DirectionSampler, FreeFlight, FullPath, Interior, segment_flight};
use crate::prepared::PreparedScene;
use crate::ray::Segment;
use crate::ray::offset::{SegmentEnd, segment};
use crate::shade::Transport;

/// Densities of the vertices v_0 … v_k of a path.
#[derive(Clone, Debug)]
pub struct PathPdfs {
    /// p_L(v_i), from the light's end, survival of roulette included, for i < k, without the masks and media on the way,
    /// but with κ of v_i.
    pub light: Vec<f64>,
    /// p_E(v_i), from the lens's end; as `light`.
    pub eye: Vec<f64>,
    /// Whether the edge v_{i−1} v_i can be a connection, for i = 1 … k; and for i = 0, whether a ray can meet the light
    /// by chance.
    pub connectable: Vec<bool>,
    /// c_1, see `mis::weight`.
    pub next_event: f64,
    /// c_s of connections with s ≥ 2 and t ≥ 2, see `mis::factor`; 1 elsewhere.
    pub connection_factors: Vec<f64>,
    /// τ of masks times E of media of the edge v_{i−1} v_i, for i = 1 … k, and 1 for i = 0; 1 also where no light passes, since no technique makes
    /// such a path.
    pub transmittances: Vec<f64>,
}

/// Two neighbouring vertices of a path, of which the first could have been the last of a resampled light sub-path, and
/// the second the eye vertex that it was connected to.
#[derive(Clone, Copy, Debug)]
pub struct AdjacentVertices<'a> {
    /// The one nearer to the light, y_{s−1}.
    pub y: &'a Interior,
    /// Unit direction from `y` to the vertex before it.
    pub wo: Vec3,
    /// The one nearer to the lens.
    pub z: &'a Interior,
    /// Unit direction from `y` to `z`.
    pub wi: Vec3,
    /// The light sub-path that ends at `y`, as `z` sees it.
    pub light: IncidentSubpath,
}

/// The connection factor of two adjacent vertices, as the method knows it.
pub type FactorOf<'a> = &'a dyn Fn(&AdjacentVertices) -> f32;

/// The flight along an edge.
#[derive(Clone, Copy, Debug)]
struct EdgeFlight {
    /// The probability to pass media and masks, from either end.
    share: f64,
    /// Flight through media.
    free: FreeFlight,
}

impl EdgeFlight {
    const NONE: EdgeFlight = EdgeFlight { share: 1.0, free: FreeFlight::NONE };
}

/// A path with the rules that its sub-paths follow.
struct PathView<'a, F> {
    scene: &'a PreparedScene,
    mis: &'a MisContext<F>,
    path: &'a FullPath,
}

impl<F: ConnectionFactor> PathView<'_, F> {
    /// Turns a density per steradian at a neighbour of v_i into v_i's own measure, along the edge `e`.
    fn area_jacobian(&self, i: usize, e: usize) -> f64 {
        let (d, distance) = self.path.edge(e);
        match i {
            0 => match self.path.origin.end {
                EmitterVertex::Surface { ng, .. } => f64::from(area_jacobian(ng.dot(d), distance * distance)),
                EmitterVertex::Point { .. } => f64::from(distance).powi(-2),
                EmitterVertex::Infinite => 1.0,
            },
            _ => f64::from(self.path.interior[i - 1].place.area_jacobian(d, distance * distance)),
        }
    }

    /// Density per steradian at the interior vertex v_i of the direction `to`, coming from `from`; survival included.
    fn scatter_pdf(&self, i: usize, from: Vec3, to: Vec3, mode: Transport) -> f64 {
        let v = &self.path.interior[i - 1];
        let (number, limits, delta) = match mode {
            Transport::Importance => (i, &self.mis.light_limits, 0),
            Transport::Radiance => (self.path.edges() - i, &self.mis.eye_limits, 1),
        };
        let survival = limits.survival(number as u32, &v.scatter());
        let pdf = match v.delta {
            Some((pdfs, _)) => pdfs[delta],
            None => self.mis.directions.pdf(v.position(), &v.bsdf, from, to, mode),
        };
        f64::from(pdf.0) * f64::from(survival)
    }

    /// p_L(v_i), i = 0 … k − 1.
    fn light_pdfs(&self) -> Vec<f64> {
        let (path, flights) = (self.path, self.flights());
        let (lights, emission, origin) = (&self.scene.lights, &self.mis.emission, &path.origin);
        let light = lights.get(origin.light);
        let chosen = f64::from(emission.pmf_light(lights, origin.light).0);
        let (position, direction) = emission.pdf_ray_at_vertex(
            lights,
            origin.light,
            origin.end.normal(),
            origin.direction,
            path.interior.first().map_or(Vec3::ZERO, Interior::position),
        );
        let (position, direction) = (f64::from(position.0), f64::from(direction.0));
        let infinite = light.is_infinite();
        let mut pdfs = vec![chosen * if infinite { direction } else { position }];
        for i in 1..path.edges() {
            pdfs.push(match i {
                1 if infinite => position * f64::from(path.interior[0].place.cosine(path.origin.direction).abs()),
                1 => direction * self.area_jacobian(1, 0),
                _ => {
                    let (from, to) = (-path.edge(i - 2).0, path.edge(i - 1).0);
                    self.scatter_pdf(i - 1, from, to, Transport::Importance) * self.area_jacobian(i, i - 1)
                }
            });
            pdfs[i] *= f64::from(flights[i].free.rate);
        }
        pdfs
    }

    /// p_E(v_i), i = 0 … k.
    fn eye_pdfs(&self) -> Vec<f64> {
        let (path, k, flights) = (self.path, self.path.edges(), self.flights());
        let (lens, direction) = self.scene.camera.pdf_sampled_ray(-path.edge(k - 1).0);
        let mut pdfs = vec![0.0; k + 1];
        pdfs[k] = f64::from(lens.0);
        pdfs[k - 1] = f64::from(direction.0) * self.area_jacobian(k - 1, k - 1);
        for i in (0..k - 1).rev() {
            let (from, to) = (path.edge(i + 1).0, -path.edge(i).0);
            pdfs[i] = self.scatter_pdf(i + 1, from, to, Transport::Radiance) * self.area_jacobian(i, i);
        }
        pdfs[..k].iter_mut().zip(&flights[1..]).for_each(|(pdf, flight)| *pdf *= f64::from(flight.free.rate_back));
        pdfs
    }

    /// c_1; `origin` is p_L(v_0).
    fn next_event(&self, origin: f64) -> f64 {
        let path = self.path;
        let light = self.scene.lights.get(path.origin.light);
        path.interior.first().map_or(1.0, |v| {
            let chosen = self.scene.lights.pmf_light_from(v.position(), v.light_choice_normal, path.origin.light);
            if light.is_delta() {
                let emitted = self.mis.emission.pmf_light(&self.scene.lights, path.origin.light);
                return f64::from(chosen.0) / f64::from(emitted.0);
            }
            let (d, distance) = path.edge(0);
            let direct = f64::from(light.pdf_direct(v.position(), path.origin.end.normal(), -d, distance).0);
            f64::from(chosen.0) * direct * self.area_jacobian(0, 0) / origin
        })
    }

    /// The flight along every edge v_{i−1} v_i, as an edge to v_i, by the number i; none for i = 0, and where no light
    /// passes, since no technique makes such a path.
    fn flights(&self) -> Vec<EdgeFlight> {
        let (path, k, mut tracer) = (self.path, self.path.edges(), self.scene.tracer());
        let mut flight = |i: usize| {
            // From the vertex nearer to the lens, which is never at infinity.
            let from = path.interior.get(i - 1);
            let before = match i {
                1 => path.origin.end.segment_end(),
                _ => Some(path.interior[i - 2].place.segment_end()),
            };
            let (d, medium) = (-path.edge(i - 1).0, self.scene.surroundings.camera);
            // Nothing nearer than the near clipping plane is seen.
            let near = || SegmentEnd::Free(self.scene.camera.near_point(path.lens, d));
            let end = from.map_or_else(near, |v| v.place.segment_end());
            let edge = before.map_or_else(|| Segment::to_infinity(end.leaving(d), d), |before| segment(&end, &before));
            let medium = from.map_or(medium, |v| v.medium_towards(d));
            let flight = segment_flight(self.scene, &edge, medium, &mut tracer)?;
            // The light's and the lens's end are on no medium.
            let place = |i: usize| i.checked_sub(1).and_then(|i| path.interior.get(i)).map(|v| v.place);
            let share = f64::from(flight.transmittance.share()) * f64::from(tracer.transmittance(&edge).share());
            let free = flight.edge(place(i - 1).as_ref(), place(i).as_ref());
            (share > 0.0).then_some(EdgeFlight { share, free })
        };
        std::iter::once(EdgeFlight::NONE).chain((1..=k).map(|i| flight(i).unwrap_or(EdgeFlight::NONE))).collect()
    }

    /// c_s of every connection.
    fn connection_factors(&self, factor_of: FactorOf) -> Vec<f64> {
        let (path, k) = (self.path, self.path.edges());
        let mut factors = vec![1.0; k + 1];
        if F::IS_ONE {
            return factors;
        }
        let flights = self.flights();
        let fly = |throughput: [f64; 3], edge: usize| {
            let factor = flights[edge].free.throughput().to_array();
            std::array::from_fn(|c| throughput[c] * f64::from(factor[c]))
        };
        // β_L as a light sub-path has it on arriving at v_{i−1}.
        let mut throughput: [f64; 3] = fly(path.origin.throughput.to_array().map(f64::from), 1);
        for (i, factor) in factors.iter_mut().enumerate().take(k).skip(2) {
            let v = &path.interior[i - 2];
            let (wo, wi) = (-path.edge(i - 2).0, path.edge(i - 1).0);
            let value = v.delta.map_or_else(|| v.bsdf.eval(wo, wi, Transport::Importance), |(_, value)| value);
            let scattered: [f64; 3] = std::array::from_fn(|c| throughput[c] * f64::from(value[c]));
            let jacobian = self.area_jacobian(i, i - 1);
            let luminance = |light: [f64; 3]| Rgb::from(light.map(|v| (v * jacobian) as f32)).luminance();
            let target_over_pdf = ResamplingTarget {
                full: luminance(scattered),
                first_stage: luminance(throughput) * v.place.cosine(wi).abs(),
            };
            let light = IncidentSubpath {
                s: i,
                throughput: Rgb::from(throughput.map(|v| v as f32)),
                target_over_pdf,
                distance2: path.edge(i - 1).1.powi(2),
            };
            *factor = f64::from(factor_of(&AdjacentVertices { y: v, wo, z: &path.interior[i - 1], wi, light }));
            throughput = fly(scattered.map(|v| v / self.scatter_pdf(i - 1, wo, wi, Transport::Importance)), i);
        }
        factors
    }
}

impl PathPdfs {
    /// Densities of `path` where sub-paths follow the rules of `mis`; `factor_of` is c of connections.
    pub fn new<F: ConnectionFactor>(
        scene: &PreparedScene,
        mis: &MisContext<F>,
        factor_of: FactorOf,
        path: &FullPath,
    ) -> PathPdfs {
        let view = PathView { scene, mis, path };
        let k = path.edges();
        let smooth = |i: usize| i == 0 || i == k || path.interior[i - 1].delta.is_none();
        let can_be_hit = !scene.lights.get(path.origin.light).is_delta();
        let light = view.light_pdfs();
        PathPdfs {
            next_event: view.next_event(light[0]),
            light,
            eye: view.eye_pdfs(),
            connectable: (0..=k).map(|i| if i == 0 { can_be_hit } else { smooth(i - 1) && smooth(i) }).collect(),
            connection_factors: view.connection_factors(factor_of),
            transmittances: view.flights().iter().map(|flight| flight.share).collect(),
        }
    }

    /// ln of n_s c_s p_s for every technique (s, k + 1 − s), s = 0 … k, over the transmittance of the whole path; −∞ for those that cannot make the path.
    pub fn log_effective_pdfs<F>(&self, mis: &MisContext<F>) -> Vec<f64> {
        let k = self.eye.len() - 1;
        (0..=k)
            .map(|s| {
                let n = f64::from(mis.techniques.count(s, k + 1 - s));
                // Every technique walks the edges but its own connection.
                let connected = if s == 0 { 1.0 } else { 1.0 / self.transmittances[s] };
                let c = if s == 1 && k >= 2 { self.next_event } else { self.connection_factors[s] } * connected;
                let possible = if self.connectable[s] { 1.0 } else { 0.0 };
                let light: f64 = self.light[..s].iter().map(|p| p.ln()).sum();
                // p_E(v_0) of a light that cannot be hit belongs to an impossible technique alone.
                let eye: f64 = if possible > 0.0 { self.eye[s..].iter().map(|p| p.ln()).sum() } else { 0.0 };
                (n * c * possible).ln() + light + eye
            })
            .collect()
    }

    /// The weight of every technique (s, k + 1 − s), s = 0 … k.
    pub fn weights<F>(&self, mis: &MisContext<F>) -> Vec<f64> {
        let logs = self.log_effective_pdfs(mis);
        let beta = match mis.heuristic {
            Heuristic::Balance => 1.0,
            Heuristic::Power => 2.0,
        };
        let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let terms: Vec<f64> = logs.iter().map(|l| (beta * (l - top)).exp()).collect();
        let sum: f64 = terms.iter().sum();
        terms.iter().map(|x| if *x > 0.0 { x / sum } else { 0.0 }).collect() // [Veach eq. 9.8]
    }
}
