//! c of a resampled connection where weights evaluate the targets at the cache points themselves, visibility included.
//!
//! *Per cache*, as published: an eye vertex chooses one of its n nearest cache points or a *virtual* one, each with
//! probability 1/(n + 1), and draws a light sub-path by the pmf of that one alone; the virtual one draws uniformly
//! (Nabata et al. 2020, "Resampling-aware weighting functions", §5.2). Cache point i aims at q̂_i, the light that the
//! sub-path brings to cache point i, visibility included, and has the factor
//!
//! c_i = [ 1/M + (1 − 1/M) · p/q_i ]⁻¹ with q_i = q̂_i/Q_i,   c_i = 0 where q̂_i = 0,   c = Σ_i c_i / (n + 1),
//!
//! and with two stages c_i = [ 1/M + (1 − 1/M) ( (1/M₂) p/q₁ + (1 − 1/M₂) p/q₂ ) ]⁻¹, q₁ being that of cache point i
//! without visibility. The virtual one has q = p/L where L vertices per sub-path are drawn from alike; with two stages
//! it draws from what the first left, whose density is the mean q₁ of the cache points.
//!
//! *Mixture with visibility*: the pmfs are one mixture, Σ_i P_i/(n + 1), whose density is q = Σ_i q_i/(n + 1); c is the
//! factor of one such draw. DEVIATION: one mixture instead of n + 1 techniques, because one pmf per technique needs one
//! weight and no choice of a technique, and was the better one where cache points are dense.
//!
//! Unlike [`RisFactor`](super::RisFactor), which assumes that cache points are where the eye vertex is, these factors
//! need shadow rays from every cache point, for every technique of every path; in return they are exact about which
//! sub-paths a cache point can draw.

use super::ris::Stages;
use crate::math::Rgb;
use crate::mis::factor::{ConnectionFactor, IncidentSubpath, ResamplingTarget};
use crate::spatial::nearest::MAX_NEIGHBORS;

/// A cache point near an eye vertex, as one light vertex y reaches it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CacheTerm {
    /// q̂₂/p over β_L: ρ G V from y to the cache point; zero if it is occluded.
    pub full: Rgb,
    /// q̂₁/p over the luminance of β_L: G, without ρ and V.
    pub first_stage: f32,
    /// Q of both targets at the cache point.
    pub q: ResamplingTarget,
}

/// The cache points near an eye vertex, as one light vertex reaches them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CacheTerms {
    /// How many there are.
    pub count: usize,
    /// The first `count` are valid.
    pub terms: [CacheTerm; MAX_NEIGHBORS],
}

impl CacheTerms {
    fn valid(&self) -> &[CacheTerm] {
        &self.terms[..self.count]
    }
}

/// The factor; see the module's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerCacheFactor {
    /// Candidates.
    pub stages: Stages,
    /// Each cache point is a technique of its own; otherwise all are one mixture.
    pub per_cache: bool,
}

impl ConnectionFactor for PerCacheFactor {
    type Edge = CacheTerms;

    #[inline]
    fn c(&self, light: &IncidentSubpath, terms: &CacheTerms) -> f32 {
        match self.per_cache {
            true => self.shares(light.throughput, terms).iter().sum(),
            false => self.mixture(light.throughput, terms),
        }
    }

    #[inline]
    fn c_and_share(&self, light: &IncidentSubpath, terms: &CacheTerms, selected: usize) -> (f32, f32) {
        let shares = self.shares(light.throughput, terms);
        let c = shares.iter().sum();
        (c, shares[selected] / c)
    }
}

impl PerCacheFactor {
    /// c of the mixture.
    fn mixture(&self, throughput: Rgb, terms: &CacheTerms) -> f32 {
        let near = terms.valid();
        let p_over = |q_over_p| self.stages.p_over_q(q_over_p);
        let sum = |of: &dyn Fn(&CacheTerm) -> f32| near.iter().map(of).sum::<f32>();
        let q1 = sum(&|t| t.q.first_stage);
        let uniform = match self.stages.second_stage {
            Some(_) if q1 > 0.0 => throughput.luminance() * sum(&|t| t.first_stage) / q1,
            _ => 1.0 / self.stages.vertices_per_path,
        };
        // Where a cache point knows of no light, its share of the mixture is uniform, too.
        let q_over_p = |t: &CacheTerm| match t.q.full > 0.0 {
            true => (throughput * t.full).luminance() / t.q.full,
            false => uniform,
        };
        self.stages.factor(p_over(uniform), p_over((sum(&q_over_p) + uniform) / (near.len() + 1) as f32))
    }

    /// c_i / (n + 1) of each cache point, in order, and of the virtual one after them.
    fn shares(&self, throughput: Rgb, terms: &CacheTerms) -> [f32; MAX_NEIGHBORS + 1] {
        let near = terms.valid();
        let p_over = |q_over_p| self.stages.p_over_q(q_over_p);
        let choice = 1.0 / (near.len() + 1) as f32;
        let first_stage: f32 = throughput.luminance() * near.iter().map(|t| t.first_stage).sum::<f32>();
        let q1: f32 = near.iter().map(|t| t.q.first_stage).sum();
        let mut shares = [0.0; MAX_NEIGHBORS + 1];
        for (share, t) in shares.iter_mut().zip(near) {
            let full = (throughput * t.full).luminance();
            if full > 0.0 {
                // Where no light was known to arrive, the sub-path is certain to be drawn.
                let p_over_q1 = match t.q.first_stage > 0.0 {
                    true => p_over(throughput.luminance() * t.first_stage / t.q.first_stage),
                    false => self.stages.epsilon,
                };
                *share = choice * self.stages.factor(p_over_q1, p_over(full / t.q.full)); // [RISBPT §5.2]
            }
        }
        let p_over_uniform = match self.stages.second_stage {
            Some(_) if q1 > 0.0 => p_over(first_stage / q1),
            _ => self.stages.vertices_per_path.clamp(self.stages.epsilon, f32::MAX),
        };
        shares[near.len()] = choice * self.stages.factor(p_over_uniform, p_over_uniform);
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAGES: Stages = Stages { paths: 200.0, second_stage: None, epsilon: 1e-3, vertices_per_path: 3.0 };
    const PER_CACHE: PerCacheFactor = PerCacheFactor { stages: STAGES, per_cache: true };
    const MIXTURE: PerCacheFactor = PerCacheFactor { stages: STAGES, per_cache: false };

    fn near(full: [f32; MAX_NEIGHBORS]) -> CacheTerms {
        let q = ResamplingTarget { full: 2.0, first_stage: 5.0 };
        let terms = full.map(|full| CacheTerm { full: Rgb::grey(full), first_stage: 1.5, q });
        CacheTerms { count: MAX_NEIGHBORS, terms }
    }

    fn c(factor: PerCacheFactor, throughput: f32, terms: &CacheTerms) -> f32 {
        factor.c(&IncidentSubpath { throughput: Rgb::grey(throughput), ..IncidentSubpath::default() }, terms)
    }

    #[test]
    fn a_sub_path_that_a_cache_point_cannot_draw_has_no_share_there() {
        let shares = PER_CACHE.shares(Rgb::grey(3.0), &near([4.0, 0.0, 1.0]));
        assert_eq!(shares[1], 0.0);
        assert!(shares[0] > shares[2] && shares[2] > 0.0);
        assert!((shares[3] - 0.25 / (0.005 + 0.995 * 3.0)).abs() < 1e-6);
        // p/q = 2/12 at the first.
        assert!((shares[0] - 0.25 / (0.005 + 0.995 / 6.0)).abs() < 1e-6);
        assert!((c(PER_CACHE, 3.0, &near([4.0, 0.0, 1.0])) - shares.iter().sum::<f32>()).abs() < 1e-6);
        let light = IncidentSubpath { throughput: Rgb::grey(3.0), ..IncidentSubpath::default() };
        let sum: f32 = (0..4).map(|i| PER_CACHE.c_and_share(&light, &near([4.0, 0.0, 1.0]), i).1).sum();
        assert!((sum - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_density_of_a_mixture_is_the_mean() {
        // One of three cache points does not see the vertex.
        let q = (12.0 / 2.0 + 0.0 + 3.0 / 2.0 + 1.0 / 3.0) / 4.0;
        assert!((c(MIXTURE, 3.0, &near([4.0, 0.0, 1.0])) - 1.0 / (0.005 + 0.995 / q)).abs() < 1e-5);
        let many = PerCacheFactor { stages: Stages { second_stage: Some(1e9), ..STAGES }, ..MIXTURE };
        let q = (12.0 / 2.0 + 0.0 + 3.0 / 2.0 + 4.5 / 5.0) / 4.0;
        assert!((c(many, 3.0, &near([4.0, 0.0, 1.0])) - 1.0 / (0.005 + 0.995 / q)).abs() < 1e-5);
        let one = PerCacheFactor { stages: Stages { paths: 1.0, ..STAGES }, ..MIXTURE };
        assert_eq!(c(one, 1.0, &near([0.0; MAX_NEIGHBORS])), 1.0);
    }

    #[test]
    fn one_path_counts_once_and_without_cache_points_it_is_drawn_uniformly() {
        let one = PerCacheFactor { stages: Stages { paths: 1.0, ..STAGES }, ..PER_CACHE };
        assert!((c(one, 1.0, &near([1.0, 2.0, 3.0])) - 1.0).abs() < 1e-6);
        assert_eq!(c(one, 1.0, &CacheTerms::default()), 1.0);
        assert!((c(PER_CACHE, 1.0, &CacheTerms::default()) - 1.0 / (0.005 + 0.995 * 3.0)).abs() < 1e-6);
    }

    #[test]
    fn two_stages_lie_between_their_targets() {
        let shares = |m2: f32| {
            let stages = Stages { second_stage: Some(m2), ..STAGES };
            PerCacheFactor { stages, ..PER_CACHE }.shares(Rgb::grey(3.0), &near([4.0; MAX_NEIGHBORS]))
        };
        let c = |p_over_q: f32| 0.25 / (0.005 + 0.995 * p_over_q);
        assert!((shares(1.0)[0] - c(5.0 / 4.5)).abs() < 1e-5);
        assert!((shares(1e9)[0] - c(2.0 / 12.0)).abs() < 1e-5);
        assert!((shares(16.0)[MAX_NEIGHBORS] - c(5.0 / 4.5)).abs() < 1e-5);
    }
}
