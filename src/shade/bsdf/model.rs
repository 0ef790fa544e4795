//! Scattering models: the trait that every row of the table `scene::bsdf_models!` implements.
//!
//! The parameters of a model pass through three stages. A description ([`Described`]) is bound to its textures once per
//! scene ([`Textured`]) and evaluated at every shading point ([`AtPoint`]). The type that implements [`Model`] is the
//! model at a point, called a lobe: the parameters themselves, or values derived from them.
//!
//! Lobes work in local coordinates (z = shading normal). Arguments: `a` is the direction the walk came from (the eye's
//! side when radiance is carried), `b` the direction in which it continues. Values are f · |cos θ_b| for
//! [`Transport::Radiance`](crate::shade::Transport), so refraction is scaled by (1/η)². Every model is reciprocal in
//! the sense of Veach 1997, eq. 5.14: f(a, b) η(b)² = f(b, a) η(a)² with η(·) the index of a direction's side. The
//! adjoint is therefore a factor, which [`Bsdf`](super::Bsdf) applies.

use super::features::Features;
use crate::math::{Rgb, Vec3};
use crate::scene::{ColorDesc, Convert, Described, ScalarDesc, Stage};
use crate::shade::SurfacePoint;
use crate::shade::texture::{ColorTexture, ScalarTexture, TextureSet};
use std::fmt::Debug;

/// A scattering model at a point.
pub(super) trait Model: Copy {
    /// Parameters in a scene description.
    type Params;
    /// Parameters with their textures, and values that are computed once per material.
    type Textured: Debug;

    /// The model has a density: it scatters into more than finitely many directions.
    const SMOOTH: bool = true;
    /// The model has discrete directions.
    const DELTA: bool = false;

    /// Binds the textures of a description. The error completes "material: …".
    fn bind(params: &Self::Params, binder: &mut TextureBinder) -> Result<Self::Textured, String>;

    /// Evaluates the parameters at a point.
    fn at(textured: &Self::Textured, point: &SurfacePoint) -> Self;

    /// Light crosses the surface; both sides scatter.
    fn transmits(_params: &Self::Params) -> bool {
        false
    }

    /// The direction of ∂p/∂u matters.
    fn is_oriented(_params: &Self::Params) -> bool {
        false
    }

    /// Some lobe is so narrow that connections hardly ever meet it.
    fn is_nearly_specular(_params: &Self::Params) -> bool {
        false
    }

    /// Scatters nothing at any point.
    fn is_black(_params: &Self::Params) -> bool {
        false
    }

    /// Value (radiance, cosine weighted) and density per steradian of `b` given `a`, discrete events excluded.
    fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32);

    /// Density per steradian of `b` given `a`, discrete events excluded.
    fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        self.eval_pdf(a, b).1
    }

    /// Draws a direction; `None` if the light is absorbed.
    fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample>;

    /// Approximate albedo, equal for all directions and both sides.
    fn albedo(&self) -> Rgb;

    /// Interior / exterior refractive index, for the (1/η)² of refracted radiance; 1 where nothing is refracted.
    #[inline]
    fn eta(&self) -> f32 {
        1.0
    }

    /// The back scatters nothing.
    #[inline]
    fn is_one_sided(&self) -> bool {
        true
    }
}

/// Features of a model with the given parameters, textures aside.
pub(super) fn features_of<M: Model>(params: &M::Params) -> Features {
    let transmissive = M::transmits(params);
    Features {
        delta: M::DELTA,
        nearly_specular: M::is_nearly_specular(params),
        smooth: M::SMOOTH,
        scatters: true,
        transmissive,
        two_sided: transmissive,
        oriented: M::is_oriented(params),
        ..Features::default()
    }
}

/// The stage of a prepared material.
#[derive(Clone, Copy, Debug)]
pub(super) struct Textured;

impl Stage for Textured {
    type Color = ColorTexture;
    type Scalar = ScalarTexture;
}

/// The stage of a shading point.
#[derive(Clone, Copy, Debug)]
pub(super) struct AtPoint;

impl Stage for AtPoint {
    type Color = Rgb;
    type Scalar = f32;
}

/// Binds descriptions to the textures of a scene.
pub(super) struct TextureBinder<'a> {
    pub textures: &'a TextureSet,
    /// Some parameter that was converted is a texture.
    pub textured: bool,
}

impl Convert<Described, Textured> for TextureBinder<'_> {
    fn color(&mut self, color: &ColorDesc) -> ColorTexture {
        self.textured |= matches!(color, ColorDesc::Texture(_));
        self.textures.color(*color)
    }

    fn scalar(&mut self, scalar: &ScalarDesc) -> ScalarTexture {
        self.textured |= matches!(scalar, ScalarDesc::Texture(_));
        self.textures.scalar(*scalar)
    }
}

/// Evaluates textures at a point.
pub(super) struct PointLookup<'a>(pub &'a SurfacePoint);

impl Convert<Textured, AtPoint> for PointLookup<'_> {
    #[inline]
    fn color(&mut self, color: &ColorTexture) -> Rgb {
        color.eval(self.0)
    }

    #[inline]
    fn scalar(&mut self, scalar: &ScalarTexture) -> f32 {
        scalar.eval(self.0)
    }
}

/// A direction drawn from a lobe.
#[derive(Clone, Copy, Debug)]
pub(super) enum LobeSample {
    /// Drawn from a density; value and density follow from the direction.
    Smooth(Vec3),
    /// One of finitely many.
    Delta(DeltaSample),
}

/// A discrete event.
#[derive(Clone, Copy, Debug)]
pub(super) struct DeltaSample {
    /// Direction in which the walk continues.
    pub b: Vec3,
    /// Fraction of radiance that is carried on.
    pub value: Rgb,
    /// Probability of the event.
    pub pdf: f32,
    /// Probability of the reverse event.
    pub pdf_reverse: f32,
    /// Index of the side of `b` / index of the side of `a`.
    pub eta: f32,
}

/// Splits off the choice of one of two events: true with probability `p`, and what remains of `u` to draw from again.
#[inline]
pub(super) fn choose(u: f32, p: f32) -> (bool, f32) {
    let (first, rest) = if u < p { (true, u / p) } else { (false, (u - p) / (1.0 - p)) };
    (first, rest.min(crate::math::float::ONE_MINUS_EPSILON))
}

/// Relative indices nearer to one than this make half vectors meaningless.
const MIN_ETA_DIFFERENCE: f32 = 1e-3;

/// Checks a relative refractive index.
pub(super) fn checked_ior(eta: f32) -> Result<f32, String> {
    if eta.is_finite() && eta > 0.0 { Ok(eta) } else { Err(format!("a refractive index of {eta} is not positive")) }
}

/// The index of a rough interface, at least [`MIN_ETA_DIFFERENCE`] away from one.
pub(super) fn away_from_one(eta: f32) -> f32 {
    if (eta - 1.0).abs() < MIN_ETA_DIFFERENCE { 1.0 + MIN_ETA_DIFFERENCE.copysign(eta - 1.0) } else { eta }
}
