//! How resampling changes the effective density of a connection: the factor c_{s,t}.
//!
//! A technique's weight counts n_{s,t} p_s p_t c_{s,t}. Without resampling c = 1. If the light sub-path of a connection
//! is resampled from M candidates with a target q̂, its density lies between p (M = 1) and the normalised target q =
//! q̂/Q (M → ∞), and
//!
//! c = [ 1/M + (1 − 1/M) · p(ȳ)/q(ȳ | z) ]⁻¹      (RISBPT: Nabata et al. 2020, "Resampling-aware weighting functions",
//! eq. 14).
//!
//! A factor is a function of the path and of state that is independent of the light sub-paths of the current iteration:
//! Q comes from earlier iterations. A factor need not be good for the result to be right; the ratio p/q is bounded from
//! below so that a bad one costs a bounded variance.

use crate::math::Rgb;

/// Two targets of resampling, each over the density p of the light sub-path (q̂/p), or integrated over all light
/// sub-paths (Q). Luminance per unit area.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ResamplingTarget {
    /// q̂₂ = f_y ρ G V: light that is scattered at y_{s−1} towards the eye vertex.
    pub full: f32,
    /// q̂₁ = f_y G: the BSDF at y_{s−1} and the visibility left out.
    pub first_stage: f32,
}

/// The light sub-path of a connection, as its eye vertex z sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IncidentSubpath {
    /// s, the number of its vertices.
    pub s: usize,
    /// β_L at its last vertex y_{s−1}.
    pub throughput: Rgb,
    /// q̂/p at z, visibility taken for granted.
    pub target_over_pdf: ResamplingTarget,
    /// Square of the distance between y_{s−1} and z.
    pub distance2: f32,
}

/// c of connections with s ≥ 2 and t ≥ 2.
pub trait ConnectionFactor: Clone + Send + Sync {
    /// The argument of c of the connection of y_{s−1} and an eye vertex z besides the light sub-path: knowledge from
    /// earlier iterations at and around z.
    type Edge: Copy + Default + Send + Sync;

    /// c = 1 for every connection; nothing else is asked.
    const IS_ONE: bool = false;

    /// c.
    fn c(&self, light: &IncidentSubpath, edge: &Self::Edge) -> f32;

    /// c, and the share of it that belongs to the cache point numbered `selected`, of methods in which each cache point
    /// is a technique of its own.
    #[inline]
    fn c_and_share(&self, light: &IncidentSubpath, edge: &Self::Edge, _selected: usize) -> (f32, f32) {
        (self.c(light, edge), 1.0)
    }
}

/// p/q from q/p, bounded from below by `epsilon`.
#[inline]
pub fn bounded_p_over_q(q_over_p: f32, epsilon: f32) -> f32 {
    (1.0 / q_over_p).clamp(epsilon, f32::MAX)
}

/// c of a sub-path that is resampled from `m` candidates.
#[inline]
pub fn ris_factor(m: f32, p_over_q: f32) -> f32 {
    let inv_m = 1.0 / m;
    1.0 / (inv_m + (1.0 - inv_m) * p_over_q) // [RISBPT eq. 14]
}
