//! The factor c of a connection that is drawn from the light sub-paths of its own length.
//!
//! At a site, one of the N_s sub-paths of length s is drawn by the max combination of several distributions (see
//! `integrators::resampling::combined`): in proportion to what a sub-path brings there, seen or not, to its flux, and uniformly. What
//! that makes of the density is not known before the sub-paths are; the mean of these distributions, which is at most as many times smaller as
//! there are of them, stands for it:
//!
//! q/p = (1/k) ( 1 + Σ_d w_d / W_d ),   c = [ 1/N_s + (1 − 1/N_s) · p/q ]⁻¹,
//!
//! with w_d what distribution d goes by, W_d the mean of that over the sub-paths of this length in earlier iterations, and k the number of
//! distributions with W_d > 0, the uniform one included. Uniform drawing counts as one, since as many sub-paths of each length are
//! connected to as without resampling.

use super::proposals::{Proposal, Proposals};
use crate::math::Rgb;

/// Distributions besides the uniform one: seen, open, bounded.
pub const DISTRIBUTIONS: usize = 3;
/// Lengths that are told apart; longer ones are like the last.
pub const LENGTHS: usize = 12;

/// What sites know of sub-paths of each length.
#[derive(Clone, Debug, Default)]
pub struct Lengths {
    /// W_d of each site, by length.
    pub means: Vec<[[f32; DISTRIBUTIONS]; LENGTHS]>,
    /// N_s by length; what is not there is like the last.
    pub numbers: Vec<f32>,
    /// Smallest p/q.
    pub epsilon: f32,
}

impl Lengths {
    /// c of a connection to a light vertex at which the light β_L = `arriving` is, the last of `s`.
    pub fn factor(&self, arriving: Rgb, proposals: &Proposals, s: usize) -> f32 {
        let number = self.numbers.get(s).or(self.numbers.last()).copied().unwrap_or(1.0).max(1.0);
        let q_over_p = |p: &Proposal| {
            let Some(means) = self.means.get(p.site as usize) else { return 1.0 };
            let brings = [(arriving * p.scattered).luminance(), (arriving * p.open).luminance(), arriving.luminance()];
            let (mut sum, mut count) = (1.0, 1.0);
            for (brings, mean) in brings.iter().zip(&means[s.min(LENGTHS - 1)]) {
                if *mean > 0.0 {
                    sum += brings / mean;
                    count += 1.0;
                }
            }
            sum / count
        };
        let near = &proposals.each[..proposals.count];
        let mean = near.iter().map(q_over_p).sum::<f32>() / near.len() as f32;
        let p_over_q = (1.0 / if near.is_empty() { 1.0 } else { mean }).clamp(self.epsilon, f32::MAX);
        let m = 1.0 / number;
        1.0 / (m + (1.0 - m) * p_over_q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_density_is_the_mean_of_what_is_known() {
        let mut means = [[0.0; DISTRIBUTIONS]; LENGTHS];
        means[3] = [2.0, 4.0, 0.0];
        let lengths = Lengths { means: vec![means], numbers: vec![0.0, 0.0, 50.0, 100.0, 10.0], epsilon: 1e-3 };
        let mut proposals = Proposals { count: 1, ..Proposals::NONE };
        proposals.each[0].scattered = Rgb::grey(8.0);
        proposals.each[0].open = Rgb::grey(8.0);
        let c = |n: f32, q: f32| 1.0 / (1.0 / n + (1.0 - 1.0 / n) / q);
        let factor = |s| lengths.factor(Rgb::grey(0.5), &proposals, s);
        assert!((factor(3) - c(100.0, (1.0 + 2.0 + 1.0) / 3.0)).abs() < 1e-5);
        // Nothing is known of shorter ones: drawn uniformly, they count as one. So do all where there is no site.
        assert!((factor(2) - 1.0).abs() < 1e-6);
        assert!((lengths.factor(Rgb::WHITE, &Proposals::NONE, 3) - 1.0).abs() < 1e-6);
        // What cannot be seen may still be drawn as if it could.
        proposals.each[0].scattered = Rgb::BLACK;
        let hidden = lengths.factor(Rgb::grey(0.5), &proposals, 3);
        assert!((hidden - c(100.0, (1.0 + 1.0) / 3.0)).abs() < 1e-5);
        // One candidate is drawn for certain.
        let one = Lengths { numbers: vec![1.0], ..lengths.clone() };
        assert_eq!(one.factor(Rgb::grey(0.5), &proposals, 3), 1.0);
    }
}
