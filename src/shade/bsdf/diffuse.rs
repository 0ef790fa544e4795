//! Lambert's law: f = ρ/π on the front.

use super::model::{AtPoint, LobeSample, Model, PointLookup, TextureBinder, Textured};
use crate::math::warp::{cosine_hemisphere_pdf, square_to_cosine_hemisphere};
use crate::math::{Frame, Rgb, Vec3};
use crate::scene::{ColorDesc, DiffuseParams};
use crate::shade::SurfacePoint;
use std::f32::consts::FRAC_1_PI;

/// A Lambertian reflector.
pub(super) type Diffuse = DiffuseParams<AtPoint>;

/// A BSDF that is a single Lambertian lobe, in world coordinates. Only its normal is stored; a frame is made when a
/// direction is drawn.
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

impl Model for Diffuse {
    type Params = DiffuseParams;
    type Textured = DiffuseParams<Textured>;

    fn bind(params: &DiffuseParams, binder: &mut TextureBinder) -> Result<DiffuseParams<Textured>, String> {
        Ok(params.convert(binder))
    }

    fn at(textured: &DiffuseParams<Textured>, point: &SurfacePoint) -> Diffuse {
        textured.convert(&mut PointLookup(point))
    }

    fn is_black(params: &DiffuseParams) -> bool {
        matches!(params.reflectance, ColorDesc::Constant(c) if c.is_black())
    }

    #[inline]
    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        let pdf = self.pdf(a, b);
        (self.reflectance * pdf, pdf)
    }

    #[inline]
    fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        if a.z > 0.0 && b.z > 0.0 { b.z * FRAC_1_PI } else { 0.0 }
    }

    #[inline]
    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        cosine_above(a, u).map(LobeSample::Smooth)
    }

    fn albedo(&self) -> Rgb {
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
