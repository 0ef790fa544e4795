//! c of a connection that is resampled by one mixture of pmfs around the eye vertex z, where weights assume that the
//! cache points of the mixture are at z itself. `ris` and `two-stage` use it with `proposal_model=mixture`; it costs no
//! rays.
//!
//! One stage (Nabata et al. 2020, "Resampling-aware weighting functions", eq. 14) aims at q̂ = f_y ρ G V, the light
//! that the sub-path brings to z (per unit area, luminance, the BSDF at z left out), and Q is its integral over all
//! sub-paths: the irradiance at z by light sub-paths of two and more vertices. With a = q̂/p, which one drawn sub-path
//! estimates, q/p = a/Q. The pmf is a mixture with a uniform one, whose share is u; L vertices per sub-path then make
//! q/p = (1 − u) a/Q + u/L.
//!
//! Two stages draw M₂ of the sub-paths by q̂₁ = f_y G first, and one of these by q̂₂ = q̂ (Nabata et al. 2020,
//! "Two-stage resampling", eq. 17):
//!
//! c = [ 1/M + (1 − 1/M) ( (1/M₂) p/q₁ + (1 − 1/M₂) p/q₂ ) ]⁻¹.
//!
//! The uniform share is one over the M₂, which are distributed as q₁: q₂/p = (1 − u) a₂/Q₂ + u a₁/Q₁.
//!
//! DEVIATION: both papers evaluate q̂ at the cache points, visibility included. Here it is evaluated at z and taken to
//! be visible, with two corrections that cost no rays:
//!
//! * Where the cache points do not see a sub-path that z sees, only the uniform share draws it, and the factor is c₀, of the uniform share
//!   alone. How often that happens is estimated: it is the fraction π of their light that cache points would have missed by asking
//!   their neighbours instead. The variance is governed by the mean of the reciprocal density: 1/c becomes (1 − π)/c + π/c₀.
//! * A light vertex that is nearer to z than the cache points are to each other has a pmf of about 1/(d² + r²) at these, r being their
//!   distance, and not of 1/d². Its density is lowered by d²/(d² + r²), or such vertices, drawn as rarely as their neighbours, would get
//!   all of the weight.

use crate::mis::factor::{ConnectionFactor, IncidentSubpath, ResamplingTarget, bounded_p_over_q, ris_factor};

/// Numbers of candidates, and the quantities that all factors of resampling share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stages {
    /// M, the light sub-paths of an iteration.
    pub paths: f32,
    /// M₂, if there are two stages.
    pub second_stage: Option<f32>,
    /// ε, the lower bound of p/q.
    pub epsilon: f32,
    /// L, an estimate of the connectable vertices per light sub-path; 0 if nothing is known yet.
    pub vertices_per_path: f32,
}

impl Stages {
    /// p/q from q/p.
    #[inline]
    pub fn p_over_q(&self, q_over_p: f32) -> f32 {
        bounded_p_over_q(q_over_p, self.epsilon)
    }

    /// c from p/q₁ of the first of two stages, and p/q₂ of the last (or only) one.
    #[inline]
    pub fn factor(&self, p_over_q1: f32, p_over_q2: f32) -> f32 {
        let p_over_q = match self.second_stage {
            None => p_over_q2,
            Some(m2) => p_over_q1 / m2 + (1.0 - 1.0 / m2) * p_over_q2, // [two-stage eq. 17, inner bracket]
        };
        ris_factor(self.paths, p_over_q)
    }
}

/// The light at an eye vertex, estimated from earlier iterations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NormalizationEstimate {
    /// Q of both targets.
    pub q: ResamplingTarget,
    /// π, the fraction of the light that the cache points around would not see.
    pub unseen_fraction: f32,
    /// r², the square of the distance within which the pmfs of these cache points are alike.
    pub cache_radius2: f32,
}

/// The factor of a resampled connection; see the module's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RisFactor {
    /// Candidates.
    pub stages: Stages,
    /// u, the share of the uniform pmf in the mixture.
    pub uniform_share: f32,
    /// Lower bound of π.
    pub min_unseen_fraction: f32,
}

impl ConnectionFactor for RisFactor {
    type Edge = NormalizationEstimate;

    #[inline]
    fn c(&self, light: &IncidentSubpath, at: &NormalizationEstimate) -> f32 {
        if self.stages.vertices_per_path <= 0.0 || self.stages.paths <= 1.0 {
            return 1.0;
        }
        let NormalizationEstimate { q, unseen_fraction, cache_radius2 } = *at;
        let (target, d2) = (light.target_over_pdf, light.distance2);
        let nearness = if cache_radius2 > 0.0 { d2 / (d2 + cache_radius2) } else { 1.0 };
        let target = ResamplingTarget { full: target.full * nearness, first_stage: target.first_stage * nearness };
        // q/p of the uniform share; where no light is known of, it is all of the mixture.
        let uniform = match self.stages.second_stage {
            Some(_) if q.first_stage > 0.0 => target.first_stage / q.first_stage,
            _ => 1.0 / self.stages.vertices_per_path,
        };
        let (seen, unseen) = match q.full > 0.0 {
            true => {
                let unseen = self.uniform_share * uniform;
                ((1.0 - self.uniform_share) * target.full / q.full + unseen, unseen)
            }
            false => (uniform, uniform),
        };
        let unseen_fraction = unseen_fraction.max(self.min_unseen_fraction);
        let p_over = |q_over_p| self.stages.p_over_q(q_over_p);
        let p_over_q2 = (1.0 - unseen_fraction) * p_over(seen) + unseen_fraction * p_over(unseen);
        self.stages.factor(p_over(uniform), p_over_q2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const STAGES: Stages = Stages { paths: 200.0, second_stage: None, epsilon: 1e-3, vertices_per_path: 3.0 };
    const ONE_STAGE: RisFactor = RisFactor { stages: STAGES, uniform_share: 0.25, min_unseen_fraction: 0.0 };

    fn only(full: f32) -> ResamplingTarget {
        ResamplingTarget { full, first_stage: 0.0 }
    }

    fn known(full: f32) -> NormalizationEstimate {
        NormalizationEstimate { q: only(full), ..NormalizationEstimate::default() }
    }

    fn c(factor: RisFactor, target_over_pdf: ResamplingTarget, distance2: f32, at: NormalizationEstimate) -> f32 {
        factor.c(&IncidentSubpath { target_over_pdf, distance2, ..IncidentSubpath::default() }, &at)
    }

    fn with(stages: Stages) -> RisFactor {
        RisFactor { stages, ..ONE_STAGE }
    }

    proptest! {
        #[test]
        fn one_path_is_not_resampled(a in 0.0f32..1e6, q in 0.0f32..1e6, l in 0.1f32..20.0) {
            let one = Stages { paths: 1.0, vertices_per_path: l, ..STAGES };
            prop_assert_eq!(c(with(one), only(a), 1.0, known(q)), 1.0);
            prop_assert_eq!(c(with(Stages { second_stage: Some(1.0), ..one }), only(a), 1.0, known(q)), 1.0);
        }

        #[test]
        fn factors_grow_with_light_and_stay_bounded(
            a in 0.0f32..1e6, b in 0.0f32..1e6, q in 1e-6f32..1e6, m in 1.0f32..1e5, a1 in 0.0f32..1e6, q1 in 0.0f32..1e6,
            unseen_fraction in 0.0f32..1.0, two: bool
        ) {
            let factor = with(Stages { paths: m, second_stage: two.then_some(m.sqrt()), ..STAGES });
            let target = |full| ResamplingTarget { full, first_stage: a1 };
            let q = ResamplingTarget { full: q, first_stage: q1 };
            let at = NormalizationEstimate { q, unseen_fraction, cache_radius2: 0.0 };
            let (x, y) = (c(factor, target(a.min(b)), 1.0, at), c(factor, target(a.max(b)), 1.0, at));
            prop_assert!(x <= y && x >= 0.0 && y <= 1001.0);
        }

        /// A first stage of which the second keeps one sub-path decides alone; one of very many decides nothing.
        #[test]
        fn two_stages_lie_between_their_targets(a in 1e-3f32..1e3, a1 in 1e-3f32..1e3) {
            let target = ResamplingTarget { full: a, first_stage: a1 };
            let at = NormalizationEstimate { q: ResamplingTarget { full: 2.0, first_stage: 5.0 }, ..known(0.0) };
            let no_uniform = RisFactor { uniform_share: 0.0, ..ONE_STAGE };
            let two = |m2: f32| RisFactor { stages: Stages { second_stage: Some(m2), ..STAGES }, ..no_uniform };
            let first = c(no_uniform, only(a1), 1.0, known(5.0));
            let second = c(no_uniform, only(a), 1.0, known(2.0));
            prop_assert!((c(two(1.0), target, 1.0, at) - first).abs() < 1e-4 * first);
            prop_assert!((c(two(1e9), target, 1.0, at) - second).abs() < 1e-4 * second);
        }
    }

    #[test]
    fn unseen_light_is_drawn_by_the_uniform_share() {
        let at = |unseen_fraction| NormalizationEstimate { unseen_fraction, ..known(2.0) };
        let all_unseen = c(ONE_STAGE, only(40.0), 1.0, at(1.0));
        let uniform =
            RisFactor { uniform_share: 1.0, stages: Stages { vertices_per_path: 12.0, ..STAGES }, ..ONE_STAGE };
        assert!((all_unseen - c(uniform, only(40.0), 1.0, at(0.0))).abs() < 1e-6);
        let (none, half) = (c(ONE_STAGE, only(40.0), 1.0, at(0.0)), c(ONE_STAGE, only(40.0), 1.0, at(0.5)));
        assert!((2.0 / half - 1.0 / none - 1.0 / all_unseen).abs() < 1e-4);
    }

    #[test]
    fn near_vertices_are_drawn_as_from_the_cache_points() {
        let at = NormalizationEstimate { cache_radius2: 1.0, ..known(2.0) };
        // A light of 1/d² at half the distance brings four times as much, of which cache points know little.
        let far = c(ONE_STAGE, only(1e-4), 1e4, at);
        assert!((far - c(ONE_STAGE, only(1e-4), 1e4, known(2.0))).abs() < 1e-3 * far);
        let [near, nearer] = [1e-2f32, 1e-4].map(|d2| c(ONE_STAGE, only(1.0 / d2), d2, at));
        assert!((near - nearer).abs() < 0.02 * near, "{near} {nearer}");
    }

    #[test]
    fn many_paths_reach_the_target() {
        let many = RisFactor { uniform_share: 0.0, ..with(Stages { paths: 1e9, ..STAGES }) };
        assert!((c(many, only(6.0), 1.0, known(2.0)) - 3.0).abs() < 1e-5);
        let unknown = RisFactor { stages: Stages { vertices_per_path: 0.0, ..many.stages }, ..many };
        assert_eq!(c(unknown, only(6.0), 1.0, known(2.0)), 1.0);
        let uniform = RisFactor { uniform_share: 1.0, ..many };
        assert_eq!(c(many, only(5.0), 1.0, known(0.0)), c(uniform, only(5.0), 1.0, known(2.0)));
    }
}
