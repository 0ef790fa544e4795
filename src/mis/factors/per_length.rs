//! c of a connection that is drawn at an importance record or skeleton node from the light sub-paths of its own length.
//!
//! At a record, one of the N_s sub-paths of length s is drawn by the max combination of several pmfs (Noël and Biri
//! 2015, §4.3): in proportion to the light that a sub-path brings there, with and without visibility, to its flux, and
//! uniformly. The combined pmf is known only once the sub-paths are; the mean of the pmfs, which is at most as many
//! times smaller as there are of them, stands for it:
//!
//! q/p = (1/k) ( 1 + Σ_d w_d / W_d ),   c = [ 1/N_s + (1 − 1/N_s) · p/q ]⁻¹,
//!
//! with w_d the weight of the sub-path in pmf d, W_d the mean of that weight over the sub-paths of this length in
//! earlier iterations, and k the number of pmfs with W_d > 0, the uniform one included. Uniform drawing has c = 1,
//! since as many sub-paths of each length are connected to as without resampling.
//!
//! DEVIATION: Noël and Biri 2015 give balance weights; these are a named variant (`weights=aware`).

use crate::math::Rgb;
use crate::mis::factor::{ConnectionFactor, IncidentSubpath, bounded_p_over_q, ris_factor};
use crate::spatial::nearest::MAX_NEIGHBORS;
use std::sync::Arc;

/// Pmfs besides the uniform one: seen, open, bounded.
pub const DISTRIBUTIONS: usize = 3;
/// Lengths that are told apart; longer ones are counted with the last.
pub const LENGTHS: usize = 12;

/// Means over earlier iterations.
#[derive(Clone, Debug, Default)]
pub struct PerLengthMeans {
    /// W_d of each record, by length.
    pub means: Vec<[[f32; DISTRIBUTIONS]; LENGTHS]>,
    /// N_s by length; lengths that are missing have the number of the last.
    pub numbers: Vec<f32>,
}

/// The factor; see the module's head.
#[derive(Clone, Debug, Default)]
pub struct PerLengthFactor {
    /// Means at all records.
    pub means: Arc<PerLengthMeans>,
    /// ε, the lower bound of p/q.
    pub epsilon: f32,
}

/// A record near an eye vertex, as one light vertex y reaches it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LengthTerm {
    /// Number of the record.
    pub record: u32,
    /// Light at the record over β_L, visibility included.
    pub seen: Rgb,
    /// Light at the record over β_L, visibility left out.
    pub open: Rgb,
}

/// The records near an eye vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LengthTerms {
    /// How many there are.
    pub count: usize,
    /// The first `count` are valid.
    pub terms: [LengthTerm; MAX_NEIGHBORS],
}

impl PerLengthFactor {
    /// q/p at one record.
    fn q_over_p(&self, throughput: Rgb, s: usize, term: &LengthTerm) -> f32 {
        let Some(means) = self.means.means.get(term.record as usize) else { return 1.0 };
        let weights =
            [(throughput * term.seen).luminance(), (throughput * term.open).luminance(), throughput.luminance()];
        let (mut sum, mut count) = (1.0, 1.0);
        for (weight, mean) in weights.iter().zip(&means[s.min(LENGTHS - 1)]) {
            if *mean > 0.0 {
                sum += weight / mean;
                count += 1.0;
            }
        }
        sum / count
    }
}

impl ConnectionFactor for PerLengthFactor {
    type Edge = LengthTerms;

    fn c(&self, light: &IncidentSubpath, terms: &LengthTerms) -> f32 {
        let numbers = &self.means.numbers;
        let number = numbers.get(light.s).or(numbers.last()).copied().unwrap_or(1.0).max(1.0);
        let near = &terms.terms[..terms.count];
        let mean = near.iter().map(|t| self.q_over_p(light.throughput, light.s, t)).sum::<f32>() / near.len() as f32;
        ris_factor(number, bounded_p_over_q(if near.is_empty() { 1.0 } else { mean }, self.epsilon))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_density_is_the_mean_of_the_known_pmfs() {
        let mut means = [[0.0; DISTRIBUTIONS]; LENGTHS];
        means[3] = [2.0, 4.0, 0.0];
        let factor = |numbers: Vec<f32>| PerLengthFactor {
            means: Arc::new(PerLengthMeans { means: vec![means], numbers }),
            epsilon: 1e-3,
        };
        let usual = factor(vec![0.0, 0.0, 50.0, 100.0, 10.0]);
        let mut terms = LengthTerms { count: 1, ..LengthTerms::default() };
        terms.terms[0] = LengthTerm { record: 0, seen: Rgb::grey(8.0), open: Rgb::grey(8.0) };
        let expected = |n: f32, q: f32| 1.0 / (1.0 / n + (1.0 - 1.0 / n) / q);
        let c = |factor: &PerLengthFactor, s, terms: &LengthTerms| {
            factor.c(&IncidentSubpath { s, throughput: Rgb::grey(0.5), ..IncidentSubpath::default() }, terms)
        };
        assert!((c(&usual, 3, &terms) - expected(100.0, (1.0 + 2.0 + 1.0) / 3.0)).abs() < 1e-5);
        // Shorter ones are unknown: drawn uniformly, they have c = 1. So have all where there is no record.
        assert!((c(&usual, 2, &terms) - 1.0).abs() < 1e-6);
        assert!((c(&usual, 3, &LengthTerms::default()) - 1.0).abs() < 1e-6);
        // A sub-path that the record does not see may still be drawn without regard to visibility.
        terms.terms[0].seen = Rgb::BLACK;
        assert!((c(&usual, 3, &terms) - expected(100.0, (1.0 + 1.0) / 3.0)).abs() < 1e-5);
        // One candidate is drawn for certain.
        assert_eq!(c(&factor(vec![1.0]), 3, &terms), 1.0);
    }
}
