//! A smooth coat over a diffuse base (the `plastic` of Mitsuba): a discrete reflection by the coat, and light that
//! enters the coat, scatters inside any number of times and leaves it.

use super::dielectric::mirror;
use super::diffuse::{cosine_above, cosine_pdf};
use super::model::{LobeSample, Model, PointLookup, TextureBinder, Textured, checked_ior, choose};
use crate::math::fresnel::{dielectric, diffuse_reflectance, normal_incidence, schlick_average};
use crate::math::{Rgb, Vec3};
use crate::scene::PlasticParams;
use crate::shade::SurfacePoint;

/// A smooth coat over a diffuse base.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plastic {
    eta: f32,
    /// Albedo of the base over η², all internal reflections summed.
    base: Rgb,
    specular: Rgb,
    /// Probability of the specular lobe, before the Fresnel factor.
    specular_weight: f32,
}

/// ρ / (1 − R) or, coloured by the repeated bounces, ρ / (1 − ρ R), where R is the diffuse internal reflectance.
pub(super) fn internal_scattering(diffuse: Rgb, internal_reflectance: f32, nonlinear: bool) -> Rgb {
    if nonlinear {
        diffuse.map(|c| c / (1.0 - c * internal_reflectance).max(1e-6))
    } else {
        diffuse / (1.0 - internal_reflectance).max(1e-6)
    }
}

/// Probability of the specular lobe in the choice between a coat and a base of these colours.
pub(super) fn specular_weight(diffuse: Rgb, specular: Rgb) -> f32 {
    let (d, s) = (diffuse.mean(), specular.mean());
    if s > 0.0 { s / (d + s) } else { 0.0 }
}

impl Plastic {
    fn fresnel(&self, cos: f32) -> f32 {
        dielectric(cos, self.eta).reflectance
    }

    /// Probability of the specular lobe at a Fresnel reflectance of `f`.
    fn specular_probability(&self, f: f32) -> f32 {
        let (s, d) = (f * self.specular_weight, (1.0 - f) * (1.0 - self.specular_weight));
        if s + d > 0.0 { s / (s + d) } else { 0.0 }
    }
}

impl Model for Plastic {
    type Params = PlasticParams;
    type Textured = PlasticParams<Textured>;
    const DELTA: bool = true;

    fn bind(params: &PlasticParams, binder: &mut TextureBinder) -> Result<PlasticParams<Textured>, String> {
        Ok(PlasticParams { eta: checked_ior(params.eta)?, ..params.convert(binder) })
    }

    fn at(textured: &PlasticParams<Textured>, point: &SurfacePoint) -> Plastic {
        let params = textured.convert(&mut PointLookup(point));
        let (eta, diffuse, specular) = (params.eta, params.diffuse_reflectance, params.specular_reflectance);
        let base = internal_scattering(diffuse, diffuse_reflectance(1.0 / eta), params.nonlinear) / (eta * eta);
        Plastic { eta, base, specular, specular_weight: specular_weight(diffuse, specular) }
    }

    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        if a.z <= 0.0 || b.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let (f_a, f_b) = (self.fresnel(a.z), self.fresnel(b.z));
        let cosine = cosine_pdf(b);
        (self.base * ((1.0 - f_a) * (1.0 - f_b) * cosine), (1.0 - self.specular_probability(f_a)) * cosine)
    }

    fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        if a.z <= 0.0 || b.z <= 0.0 {
            return 0.0;
        }
        (1.0 - self.specular_probability(self.fresnel(a.z))) * cosine_pdf(b)
    }

    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        if a.z <= 0.0 {
            return None;
        }
        let f = self.fresnel(a.z);
        let p = self.specular_probability(f);
        if choose(u[0], p).0 {
            Some(LobeSample::Delta(mirror(a, self.specular * f, p)))
        } else {
            cosine_above(a, u).map(LobeSample::Smooth)
        }
    }

    fn albedo(&self) -> Rgb {
        let f = schlick_average(normal_incidence(self.eta));
        self.specular * f + self.base * ((1.0 - f) * (1.0 - f))
    }
}
