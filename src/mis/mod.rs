//! Densities and weights of every technique; nothing else computes a weight.
//!
//! A technique i takes n_i samples of density p_i; the heuristic weighs a path found by technique i with
//! (n_i p_i)^β / Σ_j (n_j p_j)^β (Veach 1997, §9.2; β = 1 balance, β = 2 power). Ratios only: densities along a path are
//! never multiplied up, and squares are taken of ratios so that they do not overflow.
//!
//! Next event and hits of a path tracer are two techniques, weighed by [`Heuristic::weight`]. Bidirectional ones are many: each
//! sub-path keeps its densities in a [`Side`], and a [`Weigher`] weighs a path that joins two of them. [`effort`] tells from weights how many
//! samples of each kind a scene is worth.
//! [`definition`] says the same once more, slowly and in double precision, for tests and for explaining single paths.

pub mod definition;
pub mod effort;
pub mod lengths;
pub mod proposals;
pub mod resampled;
pub mod side;
pub mod techniques;
pub mod weigh;

pub use crate::math::measure::spread;
pub use effort::{Contribution, Costs, Effort, EffortStatistics};
pub use lengths::Lengths;
pub use proposals::{Proposal, Proposals, Shares};
pub use resampled::{Form, Resampled, Targets, There};
pub use side::{Lit, Node, Side, next_event};
pub use techniques::{Techniques, TechniquesError};
pub use weigh::{End, Joint, Split, Weigher, Weight};

use crate::math::SolidAnglePdf;

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

    /// Weight of the technique with density `this` against one with density `other`, both per steradian at the same point. A
    /// density that is zero cannot have found the path; an infinite one outweighs all others.
    #[inline]
    pub fn weight(self, this: SolidAnglePdf, other: SolidAnglePdf) -> f32 {
        1.0 / (1.0 + self.power(other.0 / this.0))
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
