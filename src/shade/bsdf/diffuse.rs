//! Lambert's law: f = ρ/π on the front.

use crate::math::warp::{cosine_hemisphere_pdf, square_to_cosine_hemisphere};
use crate::math::{Rgb, Vec3};
use std::f32::consts::FRAC_1_PI;

/// A Lambertian reflector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diffuse {
    pub reflectance: Rgb,
}

impl Diffuse {
    #[inline]
    pub fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        let pdf = self.pdf(a, b);
        (self.reflectance * pdf, pdf)
    }

    #[inline]
    pub fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        if a.z > 0.0 && b.z > 0.0 { b.z * FRAC_1_PI } else { 0.0 }
    }

    #[inline]
    pub fn sample_direction(&self, a: Vec3, u: [f32; 3]) -> Option<Vec3> {
        cosine_above(a, u)
    }

    pub fn albedo(&self) -> Rgb {
        self.reflectance
    }
}

/// A cosine-distributed direction on the front, for `a` on the front.
#[inline]
pub(super) fn cosine_above(a: Vec3, u: [f32; 3]) -> Option<Vec3> {
    (a.z > 0.0).then(|| square_to_cosine_hemisphere([u[1], u[2]]))
}

/// Density of [`cosine_above`] for `a` and `b` on the front.
#[inline]
pub(super) fn cosine_pdf(b: Vec3) -> f32 {
    cosine_hemisphere_pdf(b.z)
}
