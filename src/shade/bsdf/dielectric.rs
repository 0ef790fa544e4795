//! Smooth glass and thin panes: discrete reflection and transmission by Fresnel's equations.

use super::lobe::{DeltaSample, choose};
use crate::math::fresnel::{dielectric, normal_incidence, schlick_average};
use crate::math::{Rgb, Vec3};

/// Probability of reflection where `reflect` and `transmit` are what the two events carry on; `None` if neither carries any.
/// By reversibility it is the same for the reversed events.
fn reflection_probability(reflect: Rgb, transmit: Rgb) -> Option<f32> {
    let (r, t) = (reflect.max_component(), transmit.max_component());
    (r + t > 0.0).then(|| r / (r + t))
}

/// Smooth glass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dielectric {
    pub eta: f32,
    pub reflectance: Rgb,
    pub transmittance: Rgb,
}

impl Dielectric {
    pub fn sample(&self, a: Vec3, u: f32) -> Option<DeltaSample> {
        if a.z == 0.0 {
            return None;
        }
        let interface = dielectric(a.z, self.eta);
        let reflect = self.reflectance * interface.reflectance;
        let transmit = self.transmittance * (1.0 - interface.reflectance);
        let p = reflection_probability(reflect, transmit)?;
        if choose(u, p).0 {
            Some(mirror(a, reflect, p))
        } else {
            let inv = 1.0 / interface.eta;
            let b = Vec3::new(-a.x * inv, -a.y * inv, interface.cos_t).normalize_or(-a);
            let value = transmit * (inv * inv);
            let pdf = 1.0 - p;
            Some(DeltaSample { b, value, pdf, pdf_reverse: pdf, eta: interface.eta, passes_through: false })
        }
    }

    pub fn albedo(&self) -> Rgb {
        let f = schlick_average(normal_incidence(self.eta));
        self.reflectance * f + self.transmittance * (1.0 - f)
    }
}

/// A pane so thin that light goes straight on, all internal reflections summed: R' = R + T² R / (1 − R²) = 2R / (1 + R).
#[derive(Clone, Copy, Debug)]
pub(super) struct ThinDielectric {
    pub eta: f32,
    pub reflectance: Rgb,
    pub transmittance: Rgb,
}

impl ThinDielectric {
    fn total_reflectance(&self, cos: f32) -> f32 {
        let r = dielectric(cos.abs(), self.eta).reflectance;
        2.0 * r / (1.0 + r)
    }

    pub fn sample(&self, a: Vec3, u: f32) -> Option<DeltaSample> {
        let r = self.total_reflectance(a.z);
        let (reflect, transmit) = (self.reflectance * r, self.transmittance * (1.0 - r));
        let p = reflection_probability(reflect, transmit)?;
        if choose(u, p).0 {
            Some(mirror(a, reflect, p))
        } else {
            let pdf = 1.0 - p;
            Some(DeltaSample { b: -a, value: transmit, pdf, pdf_reverse: pdf, eta: 1.0, passes_through: false })
        }
    }

    pub fn albedo(&self) -> Rgb {
        let r = schlick_average(normal_incidence(self.eta));
        let r = 2.0 * r / (1.0 + r);
        self.reflectance * r + self.transmittance * (1.0 - r)
    }
}

/// Mirror reflection with the same probability in both directions.
pub(super) fn mirror(a: Vec3, value: Rgb, pdf: f32) -> DeltaSample {
    DeltaSample { b: Vec3::new(-a.x, -a.y, a.z), value, pdf, pdf_reverse: pdf, eta: 1.0, passes_through: false }
}
