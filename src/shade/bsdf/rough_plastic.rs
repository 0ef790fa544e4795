//! A rough coat over a diffuse base (the `roughplastic` of Mitsuba): microfacet reflection, and a base that is lit and
//! seen through the rough interface, whose transmittance is tabulated over the cosine.

use super::diffuse::{cosine_above, cosine_pdf};
use super::microfacet::{Microfacets, half_vector};
use super::model::{LobeSample, Model, TextureBinder, away_from_one, checked_ior, choose};
use super::plastic::{internal_scattering, specular_weight};
use crate::math::fresnel::{dielectric, reflect, refract};
use crate::math::{Rgb, Vec3};
use crate::scene::{Convert, Distribution, RoughPlasticParams};
use crate::shade::SurfacePoint;
use crate::shade::texture::ColorTexture;
use std::sync::{Mutex, PoisonError};

/// A rough coat over a diffuse base.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughPlastic {
    facets: Microfacets,
    eta: f32,
    /// Albedo of the base over η², all internal reflections summed.
    base: Rgb,
    specular: Rgb,
    specular_weight: f32,
    coat: &'static Coat,
}

/// Samples of the tabulated transmittance, at cosines 0, 1/63, … 1.
const TABLE: usize = 64;

/// Transmittance of a rough interface.
#[derive(Debug)]
struct Coat {
    key: (Distribution, u32, u32),
    transmittance: [f32; TABLE],
    /// Fraction of diffuse light from below that is reflected back.
    internal_reflectance: f32,
}

static COATS: Mutex<Vec<&'static Coat>> = Mutex::new(Vec::new());

impl Coat {
    /// The table of an interface. Tables are shared by the whole process and never freed: a point's BSDF refers to its
    /// table without counting references, and there are as many (300 bytes each) as there are different coats.
    fn get(distribution: Distribution, alpha: f32, eta: f32) -> &'static Coat {
        let key = (distribution, alpha.to_bits(), eta.to_bits());
        let mut coats = COATS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(coat) = coats.iter().find(|c| c.key == key) {
            return coat;
        }
        let facets = Microfacets::new(distribution, alpha, alpha, true);
        let cosine = |i: usize| (i as f32 / (TABLE - 1) as f32).max(1e-6);
        let transmittance = std::array::from_fn(|i| directional(&facets, cosine(i), eta, 32, false));
        // The mean of the samples, ends included, as Mitsuba takes it: not quite the integral.
        let reflected: f32 = (0..TABLE).map(|i| directional(&facets, cosine(i), 1.0 / eta, 48, true) * cosine(i)).sum();
        let coat: &'static Coat =
            Box::leak(Box::new(Coat { key, transmittance, internal_reflectance: 2.0 * reflected / TABLE as f32 }));
        coats.push(coat);
        coat
    }

    fn transmittance(&self, cos: f32) -> f32 {
        let x = cos * (TABLE - 1) as f32;
        let i = (x as usize).min(TABLE - 2);
        let f = x - i as f32;
        self.transmittance[i] * (1.0 - f) + self.transmittance[i + 1] * f
    }
}

/// Fraction of light from the direction of cosine `cos` that facets of relative index `eta` reflect (or transmit): the
/// mean over visible normals of G1(b) F (or G1(b) (1 − F)), by a product Gauss–Legendre rule of `n`² nodes.
fn directional(facets: &Microfacets, cos: f32, eta: f32, n: usize, reflects: bool) -> f32 {
    let a = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    let nodes = gauss_legendre(n);
    let mut sum = 0.0f64;
    for &(x, wx) in &nodes {
        for &(y, wy) in &nodes {
            let m = facets.sample(a, [x, y]);
            let interface = dielectric(a.dot(m), eta);
            let (b, share, valid) = if reflects {
                let b = reflect(a, m);
                (b, interface.reflectance, b.z > 0.0)
            } else {
                let b = refract(a, m, &interface);
                (b, 1.0 - interface.reflectance, b.z < 0.0)
            };
            if valid {
                sum += f64::from(wx * wy) * f64::from(facets.g1(b, m) * share);
            }
        }
    }
    sum as f32
}

/// Nodes and weights of the Gauss–Legendre rule on [0, 1] (Newton's method on the recurrence of Legendre polynomials).
fn gauss_legendre(n: usize) -> Vec<(f32, f32)> {
    (0..n)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut derivative = 1.0;
            for _ in 0..50 {
                let (mut p, mut before) = (1.0, 0.0);
                for k in 1..=n {
                    let k = k as f64;
                    (p, before) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k, p);
                }
                derivative = n as f64 * (x * p - before) / (x * x - 1.0);
                let step = p / derivative;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            let weight = 2.0 / ((1.0 - x * x) * derivative * derivative);
            ((0.5 * (x + 1.0)) as f32, (0.5 * weight) as f32)
        })
        .collect()
}

/// A rough coat over a diffuse base, with its textures and the table of its interface.
#[derive(Debug)]
pub(super) struct TexturedRoughPlastic {
    facets: Microfacets,
    coat: &'static Coat,
    eta: f32,
    diffuse: ColorTexture,
    specular: ColorTexture,
    nonlinear: bool,
}

impl RoughPlastic {
    fn specular_probability(&self, transmittance: f32) -> f32 {
        let s = (1.0 - transmittance) * self.specular_weight;
        let d = transmittance * (1.0 - self.specular_weight);
        if s + d > 0.0 { s / (s + d) } else { 0.0 }
    }
}

impl Model for RoughPlastic {
    type Params = RoughPlasticParams;
    type Textured = TexturedRoughPlastic;

    fn bind(params: &RoughPlasticParams, binder: &mut TextureBinder) -> Result<TexturedRoughPlastic, String> {
        let eta = away_from_one(checked_ior(params.eta)?);
        let roughness = params.roughness;
        // The coat's table is for one roughness; a texture counts by its mean (Mitsuba takes numbers only).
        let alpha = binder.textures.scalar(roughness.alpha_u).mean();
        Ok(TexturedRoughPlastic {
            facets: Microfacets::new(roughness.distribution, alpha, alpha, roughness.sample_visible),
            coat: Coat::get(roughness.distribution, alpha, eta),
            eta,
            diffuse: binder.color(&params.diffuse_reflectance),
            specular: binder.color(&params.specular_reflectance),
            nonlinear: params.nonlinear,
        })
    }

    fn at(textured: &TexturedRoughPlastic, point: &SurfacePoint) -> RoughPlastic {
        let &TexturedRoughPlastic { facets, coat, eta, nonlinear, .. } = textured;
        let (diffuse, specular) = (textured.diffuse.eval(point), textured.specular.eval(point));
        let base = internal_scattering(diffuse, coat.internal_reflectance, nonlinear) / (eta * eta);
        RoughPlastic { facets, eta, base, specular, specular_weight: specular_weight(diffuse, specular), coat }
    }

    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        if a.z <= 0.0 || b.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let (t_a, t_b) = (self.coat.transmittance(a.z), self.coat.transmittance(b.z));
        let p = self.specular_probability(t_a);
        let cosine = cosine_pdf(b);
        let (mut value, mut pdf) = (self.base * (t_a * t_b * cosine), (1.0 - p) * cosine);
        if let Some(facet) = half_vector(&self.facets, a, b) {
            let f = dielectric(a.dot(facet.m), self.eta).reflectance;
            value += self.specular * (f * facet.value(&self.facets, a, b));
            pdf += p * facet.pdf(&self.facets, a);
        }
        (value, pdf)
    }

    fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        if a.z <= 0.0 || b.z <= 0.0 {
            return 0.0;
        }
        let p = self.specular_probability(self.coat.transmittance(a.z));
        let facet = half_vector(&self.facets, a, b).map_or(0.0, |facet| facet.pdf(&self.facets, a));
        p * facet + (1.0 - p) * cosine_pdf(b)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        if a.z <= 0.0 {
            return None;
        }
        let p = self.specular_probability(self.coat.transmittance(a.z));
        if choose(u[0], p).0 {
            let b = reflect(a, self.facets.sample(a, [u[1], u[2]]));
            (b.z > 0.0).then_some(LobeSample::Smooth(b))
        } else {
            cosine_above(a, u).map(LobeSample::Smooth)
        }
    }

    fn albedo(&self) -> Rgb {
        // The middle of the table stands for the mean over the hemisphere.
        let t = self.coat.transmittance(2.0 / 3.0);
        self.specular * (1.0 - t) + self.base * (t * t)
    }
}
