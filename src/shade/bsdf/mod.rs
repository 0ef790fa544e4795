//! Bidirectional scattering distribution functions.

use super::{SurfacePoint, Transport};
use crate::math::{Rgb, SolidAnglePdf, Vec3};

/// A material with its textures, shared by many points.
pub struct Material;

/// The BSDF at one point: every texture looked up, seen from `wo`.
pub struct Bsdf;

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Where the walk goes on; world space, unit length.
    pub wi: Vec3,
    /// Cosine weighted value, f · |cos θ_i| (for a delta event: the value whose ratio to `pdf` is the throughput).
    pub value: Rgb,
    /// Density per steradian of `wi` given `wo`; of a delta event the discrete probability.
    pub pdf: SolidAnglePdf,
    /// Of a delta event: the discrete probability of the reverse event (`wo` given `wi`); otherwise unused.
    pub pdf_reverse_delta: SolidAnglePdf,
    /// The direction is one of finitely many.
    pub delta: bool,
    /// The ray goes straight through as if nothing were there (mask, null).
    pub passes_through: bool,
    /// Relative refractive index crossed: transmitted side / incident side; 1 for reflection.
    pub eta: f32,
}

impl Material {
    /// Looks up every texture at `point` for a walk that arrived from `wo`.
    pub fn resolve(&self, _point: &SurfacePoint, _wo: Vec3) -> Bsdf {
        Bsdf
    }
}

impl Bsdf {
    /// Cosine weighted value f(wo, wi) · |cos θ_i|, delta lobes excluded.
    pub fn eval(&self, _wo: Vec3, _wi: Vec3, _mode: Transport) -> Rgb {
        Rgb::BLACK
    }

    /// Density per steradian with which [`Bsdf::sample`] draws `wi` given `wo`, delta lobes excluded (their share of the
    /// probability is missing from the integral).
    pub fn pdf(&self, _wo: Vec3, _wi: Vec3, _mode: Transport) -> SolidAnglePdf {
        SolidAnglePdf(0.0)
    }

    /// Draws a direction; `u` = [lobe, u, v].
    pub fn sample(&self, _wo: Vec3, _u: [f32; 3], _mode: Transport) -> Option<BsdfSample> {
        None
    }

    /// Approximate albedo per channel, independent of direction: Russian roulette uses it, and it must be the same from
    /// whichever side the point is reached.
    pub fn albedo(&self) -> Rgb {
        Rgb::BLACK
    }

    /// True if a connection to this point can carry light: some lobe is not a delta.
    pub fn connectable(&self) -> bool {
        false
    }
}
