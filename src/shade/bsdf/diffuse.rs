//! Lambert's law: f = ρ/π on the front.

use crate::math::warp::{cosine_hemisphere_pdf, square_to_cosine_hemisphere};
use crate::math::{Frame, Rgb, Vec3};
use std::f32::consts::FRAC_1_PI;

/// A Lambertian reflector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diffuse {
    pub reflectance: Rgb,
}

/// A Lambertian lobe that is all of a BSDF, in world coordinates. It needs the normal only: a frame is made when a direction is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lambert {
    /// Shading normal on the side that reflects.
    pub n: Vec3,
    pub reflectance: Rgb,
}

impl Lambert {
    /// Cosines of both directions, if both are on the side that reflects.
    #[inline]
    pub fn cosines(&self, wo: Vec3, wi: Vec3) -> Option<(f32, f32)> {
        let (cos_o, cos_i) = (wo.dot(self.n), wi.dot(self.n));
        (cos_o > 0.0 && cos_i > 0.0).then_some((cos_o, cos_i))
    }

    #[inline]
    pub fn sample_direction(&self, u: [f32; 3]) -> Vec3 {
        Frame::from_normal(self.n).to_world(square_to_cosine_hemisphere([u[1], u[2]]))
    }
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
