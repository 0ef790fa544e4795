//! Densities and weights of every technique; nothing else computes a weight.
//!
//! A technique i takes n_i samples of density p_i; the heuristic weighs a path found by technique i with
//! (n_i p_i)^β / Σ_j (n_j p_j)^β (Veach 1997, §9.2; β = 1 balance, β = 2 power). Ratios only: densities along a path
//! are never multiplied up, and squares are taken of ratios so that they do not overflow.
//!
//! Next event and hits of a path tracer are two techniques, weighed by [`Heuristic::weight`]. Bidirectional ones are
//! many: each sub-path keeps its densities in a [`SubpathPdfs`], and a [`MisContext`] weighs a path that connects two
//! of them. [`oracle`] computes the same weights by their definition, slowly and in double precision, for tests and for
//! explaining single paths. [`allocation`] tells from weights how many samples of each group of techniques a scene is
//! worth.
//!
//! # Glossary
//!
//! | symbol | name | measure | where |
//! | --- | --- | --- | --- |
//! | x̄ = v_0 … v_k | path of k edges, v_0 on a light, v_k on the lens | | Veach 1997, eq. 8.7 |
//! | (s, t) | technique: s light vertices, t eye vertices, s + t = k + 1 | | Veach 1997, §10.2 |
//! | y_i, z_i | vertices of the light and of the eye sub-path | | |
//! | p_L(v), p_E(v) | density of a vertex made from the light, from the lens, roulette included | area (at infinity: solid angle) | Veach 1997, §10.2 |
//! | [`VertexPdfs::pdf_fwd`] | p of the walk that made the vertex | area | |
//! | [`VertexPdfs::rev_over_fwd`] | p of the walk from the other end over `pdf_fwd` | ratio | Veach 1997, eq. 10.9 |
//! | [`VertexPdfs::area_jacobian`] | \|cos\| / d² | 1 / area | Veach 1997, eq. 8.8 |
//! | n_{s,t} | samples of a technique: [`Techniques::count`] | count | |
//! | c_{s,t} | [`ConnectionFactor`]: effect of resampling on the density of a connection | ratio | RISBPT, eq. 14 |
//! | n c p | effective density | area product | |
//! | w | [`MisWeight`] | ratio | Veach 1997, eq. 9.8 |
//! | β_L, β_E | throughput of a light and of an eye sub-path, f / p of its own vertices | | |
//! | q̂, q̂₁, q̂₂ | target of resampling, of the first and the second stage: [`ResamplingTarget`] | luminance / area | RISBPT, eq. 15; two-stage, §5.1 |
//! | Q | integral of q̂ over all light sub-paths: [`NormalizationEstimate`](factors::NormalizationEstimate) | luminance / area | RISBPT, eq. 11 |
//! | q = q̂ / Q | normalised target | area product | RISBPT, eq. 16 |
//! | M, M₂ | light sub-paths of an iteration; representatives of the second stage | count | |
//! | L | connectable vertices per light sub-path | count | |
//! | ε | lower bound of p/q | ratio | RISBPT, §5.1 |
//! | u | share of the uniform pmf in a mixture | probability | |
//! | π | fraction of light that cache points do not see | ratio | |
//!
//! RISBPT: Nabata, Iwasaki & Dobashi 2020, "Resampling-aware weighting functions for bidirectional path tracing using
//! multiple light sub-paths". Two-stage: Nabata, Iwasaki & Dobashi 2020, "Two-stage resampling for bidirectional path
//! tracing with multiple light sub-paths".

pub mod allocation;
pub mod factor;
pub mod factors;
pub mod oracle;
pub mod pdfs;
pub mod technique;
pub mod weight;

pub use allocation::{
    AllocationCosts, EfficiencyEstimator, LightSharing, ProbedErrors, RegionVariance, SampleAllocation,
};
pub use factor::{ConnectionFactor, IncidentSubpath, ResamplingTarget};
pub use oracle::{AdjacentVertices, PathPdfs};
pub use pdfs::{EyeSubpathPdfs, ReverseTransport, SubpathPdfs, VertexPdfs};
pub use technique::{Techniques, TechniquesError};
pub use weight::{
    ConnectedPath, EmitterFactors, EndpointPdfs, MisContext, MisWeight, PathEnd, ReversePath, next_event_factor,
};

use crate::math::SolidAnglePdf;
use crate::ray::Transmittance;

/// The exponent of the heuristic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heuristic {
    /// β = 1.
    Balance,
    /// β = 2.
    Power,
}

impl Heuristic {
    /// x^β.
    #[inline]
    pub fn power(self, x: f32) -> f32 {
        match self {
            Heuristic::Balance => x,
            Heuristic::Power => x * x,
        }
    }

    /// Weight of the technique with density `own` against one with density `other`, both per steradian at the same
    /// point. A density that is zero cannot have found the path; an infinite one outweighs all others.
    #[inline]
    pub fn weight(self, own: SolidAnglePdf, other: SolidAnglePdf) -> f32 {
        1.0 / (1.0 + self.power(other.0 / own.0)) // [Veach eq. 9.8]
    }

    /// Weight of a technique that connects two vertices by an edge of this transmittance, from its weight `open` where
    /// the transmittance is one. All other techniques make the edge by a walk, so that their densities have the
    /// transmittance as a factor (see `ray::transmittance`).
    #[inline]
    pub fn weight_through(self, open: f32, transmittance: Transmittance) -> f32 {
        if transmittance.is_one() {
            return open;
        }
        open / (open + (1.0 - open) * self.power(transmittance.share()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn two_weights_sum_to_one(a in 1e-18f32..1e18, b in 1e-18f32..1e18) {
            let (a, b) = (SolidAnglePdf(a), SolidAnglePdf(b));
            for h in [Heuristic::Balance, Heuristic::Power] {
                let sum = h.weight(a, b) + h.weight(b, a);
                prop_assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            }
        }
    }

    #[test]
    fn zero_and_infinite_densities() {
        for h in [Heuristic::Balance, Heuristic::Power] {
            assert_eq!(h.weight(SolidAnglePdf(0.5), SolidAnglePdf(0.0)), 1.0);
            assert_eq!(h.weight(SolidAnglePdf(0.5), SolidAnglePdf(f32::INFINITY)), 0.0);
        }
    }
}
