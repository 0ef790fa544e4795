//! How long a sub-path may be: a limit on its edges, and Russian roulette.
//!
//! Roulette starts at a vertex index counted from the sub-path's own origin and survives with a probability that
//! depends on the vertex alone (its albedo, not the throughput), so that the density of a path is known from either of
//! its ends.

use super::vertex::Scatter;
use crate::math::Rgb;

/// Survival probability never exceeds this, so that walks between white mirrors end.
const MAX_SURVIVAL: f32 = 0.95;

/// Probability to go on after a vertex of that albedo where roulette is played.
#[inline]
pub fn survival(albedo: Rgb) -> f32 {
    albedo.max_component().min(MAX_SURVIVAL)
}

/// Limits of a sub-path's length.
#[derive(Clone, Copy, Debug)]
pub struct PathLimits {
    /// Largest number of edges of the sub-path.
    pub max_edges: u32,
    /// Vertex index from which Russian roulette is played; the first vertex after the origin is 1.
    pub rr_depth: u32,
    /// Factor on the survival probability at Lambertian vertices; 1: none.
    pub rr_scale: f32,
}

impl PathLimits {
    /// Probability to go on after vertex `index` with the scattering function `scatter`.
    #[inline(always)]
    pub fn survival(&self, index: u32, scatter: &Scatter) -> f32 {
        if index < self.rr_depth { 1.0 } else { self.roulette_survival(scatter) }
    }

    /// Probability to go on after a vertex with the scattering function `scatter` where roulette is played.
    #[inline(always)]
    pub fn roulette_survival(&self, scatter: &Scatter) -> f32 {
        let survival = survival(scatter.albedo());
        if self.rr_scale < 1.0 && scatter.is_lambertian() { survival * self.rr_scale } else { survival }
    }
}
