//! One scattering model at one point, every texture looked up, in local coordinates (z = shading normal).
//!
//! Arguments: `a` is the direction the walk came from (the eye's side when radiance is carried), `b` the one it goes on in. Values
//! are f · |cos θ_b| for [`Transport::Radiance`](crate::shade::Transport), so refraction is scaled by (1/η)². Every model here is
//! reciprocal in the sense of Veach 1997, eq. 5.14: f(a, b) η(b)² = f(b, a) η(a)² with η(·) the index of a direction's side. So the
//! adjoint is a factor, which [`Bsdf`](super::Bsdf) applies.

use super::conductor::{Conductor, RoughConductor};
use super::dielectric::{Dielectric, ThinDielectric};
use super::diffuse::Diffuse;
use super::phong::Phong;
use super::plastic::Plastic;
use super::principled::Principled;
use super::rough_dielectric::RoughDielectric;
use super::rough_plastic::RoughPlastic;
use super::ward::Ward;
use crate::math::{Rgb, Vec3};

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
    /// Where to.
    pub b: Vec3,
    /// What is carried on (radiance).
    pub value: Rgb,
    /// Probability of the event.
    pub pdf: f32,
    /// Probability of the reverse event.
    pub pdf_reverse: f32,
    /// Index of the side of `b` / index of the side of `a`.
    pub eta: f32,
    /// As if nothing were there.
    pub passes_through: bool,
}

/// A scattering model with its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lobe {
    Diffuse(Diffuse),
    Dielectric(Dielectric),
    ThinDielectric(ThinDielectric),
    RoughDielectric(RoughDielectric),
    Conductor(Conductor),
    RoughConductor(RoughConductor),
    Plastic(Plastic),
    RoughPlastic(RoughPlastic),
    Principled(Principled),
    Phong(Phong),
    Ward(Ward),
    /// Light goes straight on.
    Null,
}

/// Runs `$body` with `$lobe` bound to the model, `$otherwise` for the models without a density.
macro_rules! smooth {
    ($self:expr, $lobe:ident => $body:expr, $otherwise:expr) => {
        match $self {
            Lobe::Diffuse($lobe) => $body,
            Lobe::RoughDielectric($lobe) => $body,
            Lobe::RoughConductor($lobe) => $body,
            Lobe::Plastic($lobe) => $body,
            Lobe::RoughPlastic($lobe) => $body,
            Lobe::Principled($lobe) => $body,
            Lobe::Phong($lobe) => $body,
            Lobe::Ward($lobe) => $body,
            Lobe::Dielectric(_) | Lobe::ThinDielectric(_) | Lobe::Conductor(_) | Lobe::Null => $otherwise,
        }
    };
}

impl Lobe {
    /// Value (radiance, cosine weighted) and density of `b` given `a`, discrete events excluded.
    #[inline]
    pub fn eval_pdf(&self, a: Vec3, b: Vec3) -> (Rgb, f32) {
        smooth!(self, lobe => lobe.eval_pdf(a, b), (Rgb::BLACK, 0.0))
    }

    /// Density of `b` given `a`, discrete events excluded.
    #[inline]
    pub fn pdf(&self, a: Vec3, b: Vec3) -> f32 {
        smooth!(self, lobe => lobe.pdf(a, b), 0.0)
    }

    /// Draws a direction.
    pub fn sample(&self, a: Vec3, u: [f32; 3]) -> Option<LobeSample> {
        match self {
            Lobe::Dielectric(lobe) => lobe.sample(a, u[0]).map(LobeSample::Delta),
            Lobe::ThinDielectric(lobe) => lobe.sample(a, u[0]).map(LobeSample::Delta),
            Lobe::Conductor(lobe) => lobe.sample(a).map(LobeSample::Delta),
            Lobe::Plastic(lobe) => lobe.sample(a, u),
            Lobe::Null => Some(LobeSample::Delta(DeltaSample {
                b: -a,
                value: Rgb::WHITE,
                pdf: 1.0,
                pdf_reverse: 1.0,
                eta: 1.0,
                passes_through: true,
            })),
            Lobe::Diffuse(lobe) => lobe.sample_direction(a, u).map(LobeSample::Smooth),
            Lobe::RoughDielectric(lobe) => lobe.sample_direction(a, u).map(LobeSample::Smooth),
            Lobe::RoughConductor(lobe) => lobe.sample_direction(a, u).map(LobeSample::Smooth),
            Lobe::RoughPlastic(lobe) => lobe.sample_direction(a, u).map(LobeSample::Smooth),
            Lobe::Principled(lobe) => lobe.sample_direction(a, u).map(LobeSample::Smooth),
            Lobe::Phong(lobe) => lobe.sample_direction(a, u).map(LobeSample::Smooth),
            Lobe::Ward(lobe) => lobe.sample_direction(a, u).map(LobeSample::Smooth),
        }
    }

    /// Approximate albedo, the same for every direction and side.
    pub fn albedo(&self) -> Rgb {
        let albedo = match self {
            Lobe::Dielectric(lobe) => lobe.albedo(),
            Lobe::ThinDielectric(lobe) => lobe.albedo(),
            Lobe::Conductor(lobe) => lobe.albedo(),
            Lobe::Null => Rgb::WHITE,
            _ => smooth!(self, lobe => lobe.albedo(), Rgb::BLACK),
        };
        albedo.map(|c| c.clamp(0.0, 1.0))
    }

    /// True if it has a density, and so can be connected to.
    pub fn is_smooth(&self) -> bool {
        smooth!(self, _lobe => true, false)
    }

    /// Interior / exterior refractive index, for the (1/η)² of refracted radiance; 1 where nothing is refracted.
    #[inline]
    pub fn eta(&self) -> f32 {
        match self {
            Lobe::Dielectric(lobe) => lobe.eta,
            Lobe::RoughDielectric(lobe) => lobe.eta,
            Lobe::Principled(lobe) => lobe.eta,
            _ => 1.0,
        }
    }

    /// True if there is nothing to be seen from behind.
    pub fn is_one_sided(&self) -> bool {
        match self {
            Lobe::Dielectric(_) | Lobe::ThinDielectric(_) | Lobe::RoughDielectric(_) | Lobe::Null => false,
            Lobe::Principled(lobe) => !lobe.transmits(),
            _ => true,
        }
    }
}

/// Splits off the choice of one of two events: true with probability `p`, and what remains of `u` to draw from again.
#[inline]
pub(super) fn choose(u: f32, p: f32) -> (bool, f32) {
    let (first, rest) = if u < p { (true, u / p) } else { (false, (u - p) / (1.0 - p)) };
    (first, rest.min(crate::math::float::ONE_MINUS_EPSILON))
}
