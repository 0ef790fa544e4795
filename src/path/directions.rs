//! Where a walk goes on: the one source of scattered directions and of their densities.
//!
//! A density of directions enters the walk, the densities of the walk from the other end, and the weights of
//! connections. All three ask the same [`DirectionSampler`], so that a sampler that mixes the scattering function with
//! a guide changes one place.

use super::vertex::{Scatter, Scattering};
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::shade::{BsdfSample, Transport};

/// Draws the directions in which walks go on.
pub trait DirectionSampler: Sync {
    /// Draws a direction at the vertex at `p`, seen from `wo`; `u` are three numbers in [0, 1).
    fn sample(&self, p: Vec3, scatter: &Scatter, wo: Vec3, u: [f32; 3], mode: Transport) -> Option<BsdfSample>;

    /// Density per steradian with which `sample` draws `wi` in a walk of that transport mode; delta events have none.
    fn pdf(&self, p: Vec3, scatter: &impl Scattering, wo: Vec3, wi: Vec3, mode: Transport) -> SolidAnglePdf;

    /// Value of the scattering function and [`DirectionSampler::pdf`].
    fn eval_and_pdf(
        &self,
        p: Vec3,
        scatter: &impl Scattering,
        wo: Vec3,
        wi: Vec3,
        mode: Transport,
    ) -> (Rgb, SolidAnglePdf);
}

/// Draws from the scattering function itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScatterSampler;

impl DirectionSampler for ScatterSampler {
    #[inline(always)]
    fn sample(&self, _p: Vec3, scatter: &Scatter, wo: Vec3, u: [f32; 3], mode: Transport) -> Option<BsdfSample> {
        scatter.sample(wo, u, mode)
    }

    #[inline(always)]
    fn pdf(&self, _p: Vec3, scatter: &impl Scattering, wo: Vec3, wi: Vec3, mode: Transport) -> SolidAnglePdf {
        scatter.pdf(wo, wi, mode)
    }

    #[inline(always)]
    fn eval_and_pdf(
        &self,
        _p: Vec3,
        scatter: &impl Scattering,
        wo: Vec3,
        wi: Vec3,
        mode: Transport,
    ) -> (Rgb, SolidAnglePdf) {
        scatter.eval_and_pdf(wo, wi, mode)
    }
}
