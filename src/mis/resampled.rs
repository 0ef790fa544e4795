//! The factor c of a connection whose light sub-path was resampled.
//!
//! One light sub-path is drawn from all prefixes of M sub-paths with a probability that aims at a density q(ȳ | z). Its
//! distribution lies between p (M = 1) and q (M → ∞), and so does the density that its weight should count
//! (Nabata et al. 2020, "Resampling-aware weighting functions", eq. 14):
//!
//! c = [ 1/M + (1 − 1/M) · p(ȳ)/q(ȳ | z) ]⁻¹.
//!
//! Here q = q̂/Q with q̂ = f_y ρ G V, the light that the sub-path brings to the place z (per unit area, luminance, the BSDF at z left out),
//! and Q its integral over all sub-paths: the irradiance at z by light sub-paths of two and more vertices. With a = q̂/p, what one
//! drawn sub-path says of that irradiance, q/p = a/Q. The pmf is a mixture with a uniform one, whose share is u; L vertices per
//! sub-path then make q/p = (1 − u) a/Q + u/L.
//!
//! Two stages draw M₂ of the sub-paths by q̂₁ = f_y G first, and one of these by q̂₂ = q̂ (Nabata et al. 2020, "Two-stage
//! resampling", eq. 17):
//!
//! c = [ 1/M + (1 − 1/M) ( (1/M₂) p/q₁ + (1 − 1/M₂) p/q₂ ) ]⁻¹.
//!
//! The uniform share is one over the M₂, which are distributed as q₁: q₂/p = (1 − u) a₂/Q₂ + u a₁/Q₁.
//!
//! All that holds where the place is like its cache points. Where these do not see a sub-path that the place sees, only the uniform share
//! draws it, and the density is c₀, that of the uniform share alone. Nobody can say without shadow rays where that happens, but how
//! often is known: it is the share π of their light that cache points would have missed by asking their neighbours instead. The variance
//! is governed by the mean of the reciprocal density: 1/c becomes (1 − π)/c + π/c₀.
//!
//! Nor do cache points see the 1/d² of a light vertex that is nearer to the place than they are to each other: their
//! probability is about that at d² + r², r being their distance, and so must the density be. Else such vertices, drawn as rarely as
//! their neighbours, would get all of the weight.
//!
//! A weight may use any Q that does not depend on the sub-paths it weighs: an estimate from earlier iterations. It need not be good for
//! the result to be right; the ratios p/q are clamped from below so that a bad one costs a bounded variance.

/// Two functions of a light sub-path and a place that resampling aims at: each over the sub-path's density (what the sub-path brings), or
/// integrated over all sub-paths (what there is). Luminance per unit area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Targets {
    /// q̂₂ = f_y ρ G V: light that is scattered at y_{s−1} towards the place.
    pub scattered: f32,
    /// q̂₁ = f_y G: the BSDF at y_{s−1} left out.
    pub unscattered: f32,
}

/// What there is at a place, as far as is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct There {
    /// Q of both targets.
    pub all: Targets,
    /// π, the share of light that the cache points around would not know of.
    pub missed: f32,
    /// Square of the distance to which these cache points see alike.
    pub blur2: f32,
}

/// How connections are resampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resampled {
    /// M.
    pub paths: f32,
    /// M₂, if there are two stages.
    pub second_stage: Option<f32>,
    /// Smallest p/q.
    pub epsilon: f32,
    /// Smallest π: what is not known of what is not known.
    pub doubt: f32,
    /// u.
    pub uniform: f32,
    /// L, an estimate; 0 if nothing is known yet.
    pub vertices_per_path: f32,
    /// What is one technique, and what weights know of cache points.
    pub form: Form,
}

/// What is one technique, and what weights know of the cache points that it draws by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// All proposals are one mixture, of which weights assume that its cache points are where the eye vertex is; see
    /// [`Resampled::factor`].
    Mixture,
    /// All proposals are one mixture, and weights ask its cache points; see `mis::proposals`.
    Asked,
    /// Proposals are techniques of their own, and weights ask the cache points; see `mis::proposals`.
    Split,
}

impl Form {
    /// Weights ask the cache points.
    #[inline]
    pub fn asks(self) -> bool {
        self != Form::Mixture
    }
}

impl Resampled {
    /// c for a sub-path that brings `brings` to a place where there is `there`; its last vertex is at the squared distance `distance2`.
    #[inline]
    pub fn factor(&self, brings: Targets, distance2: f32, there: There) -> f32 {
        if self.vertices_per_path <= 0.0 || self.paths <= 1.0 {
            return 1.0;
        }
        let There { all, missed, blur2 } = there;
        let blur = if blur2 > 0.0 { distance2 / (distance2 + blur2) } else { 1.0 };
        let brings = Targets { scattered: brings.scattered * blur, unscattered: brings.unscattered * blur };
        let by_number = 1.0 / self.vertices_per_path;
        let p_over = |q_over_p| self.p_over(q_over_p);
        // The share that is spread over everything; where no light is known of, all of the mixture is.
        let uniform = match self.second_stage {
            Some(_) if all.unscattered > 0.0 => brings.unscattered / all.unscattered,
            _ => by_number,
        };
        let (known, unknown) = match all.scattered > 0.0 {
            true => {
                let unknown = self.uniform * uniform;
                ((1.0 - self.uniform) * brings.scattered / all.scattered + unknown, unknown)
            }
            false => (uniform, uniform),
        };
        let missed = missed.max(self.doubt);
        self.factor_with(p_over(uniform), (1.0 - missed) * p_over(known) + missed * p_over(unknown))
    }

    /// p/q, as far as weights believe it.
    #[inline]
    pub(super) fn p_over(&self, q_over_p: f32) -> f32 {
        (1.0 / q_over_p).clamp(self.epsilon, f32::MAX)
    }

    /// c where p/q is `first` for what the first of two stages aims at, and `last` for what the last (or only) one aims at.
    #[inline]
    pub(super) fn factor_with(&self, first: f32, last: f32) -> f32 {
        let p_over_q = match self.second_stage {
            None => last,
            Some(m2) => first / m2 + (1.0 - 1.0 / m2) * last,
        };
        let m = 1.0 / self.paths;
        1.0 / (m + (1.0 - m) * p_over_q)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub const ONE_STAGE: Resampled = Resampled {
        paths: 200.0,
        second_stage: None,
        epsilon: 1e-3,
        doubt: 0.0,
        uniform: 0.25,
        vertices_per_path: 3.0,
        form: Form::Mixture,
    };

    fn lit(scattered: f32) -> Targets {
        Targets { scattered, unscattered: 0.0 }
    }

    fn there(scattered: f32) -> There {
        There { all: lit(scattered), ..There::default() }
    }

    proptest! {
        #[test]
        fn one_path_is_not_resampled(a in 0.0f32..1e6, q in 0.0f32..1e6, l in 0.1f32..20.0) {
            let r = Resampled { paths: 1.0, vertices_per_path: l, ..ONE_STAGE };
            prop_assert_eq!(r.factor(lit(a), 1.0, there(q)), 1.0);
            prop_assert_eq!(Resampled { second_stage: Some(1.0), ..r }.factor(lit(a), 1.0, there(q)), 1.0);
        }

        #[test]
        fn factors_grow_with_light_and_stay_bounded(
            a in 0.0f32..1e6, b in 0.0f32..1e6, q in 1e-6f32..1e6, m in 1.0f32..1e5, a1 in 0.0f32..1e6, q1 in 0.0f32..1e6, missed in 0.0f32..1.0, two: bool
        ) {
            let r = Resampled { paths: m, second_stage: two.then_some(m.sqrt()), ..ONE_STAGE };
            let brings = |scattered| Targets { scattered, unscattered: a1 };
            let there = There { all: Targets { scattered: q, unscattered: q1 }, missed, blur2: 0.5 };
            let (x, y) = (r.factor(brings(a.min(b)), 1.0, there), r.factor(brings(a.max(b)), 1.0, there));
            prop_assert!(x <= y && x >= 0.0 && y <= 1001.0);
        }

        /// A first stage that draws but one sub-path decides alone; one that draws very many decides nothing.
        #[test]
        fn two_stages_lie_between_their_targets(a in 1e-3f32..1e3, a1 in 1e-3f32..1e3) {
            let brings = Targets { scattered: a, unscattered: a1 };
            let there_is = There { all: Targets { scattered: 2.0, unscattered: 5.0 }, ..There::default() };
            let r = |m2: f32| Resampled { uniform: 0.0, second_stage: Some(m2), ..ONE_STAGE }.factor(brings, 1.0, there_is);
            let first = Resampled { uniform: 0.0, ..ONE_STAGE }.factor(lit(a1), 1.0, there(5.0));
            let second = Resampled { uniform: 0.0, ..ONE_STAGE }.factor(lit(a), 1.0, there(2.0));
            prop_assert!((r(1.0) - first).abs() < 1e-4 * first);
            prop_assert!((r(1e9) - second).abs() < 1e-4 * second);
        }
    }

    #[test]
    fn what_is_missed_counts_as_the_uniform_share() {
        let (brings, at) = (lit(40.0), |missed| There { all: lit(2.0), missed, blur2: 0.0 });
        let all_missed = ONE_STAGE.factor(brings, 1.0, at(1.0));
        assert!(
            (all_missed
                - Resampled { uniform: 1.0, vertices_per_path: 12.0, ..ONE_STAGE }.factor(brings, 1.0, at(0.0)))
            .abs()
                < 1e-6
        );
        let (none, half) = (ONE_STAGE.factor(brings, 1.0, at(0.0)), ONE_STAGE.factor(brings, 1.0, at(0.5)));
        assert!((2.0 / half - 1.0 / none - 1.0 / all_missed).abs() < 1e-4);
    }

    #[test]
    fn near_vertices_are_seen_from_afar() {
        let at = There { all: lit(2.0), missed: 0.0, blur2: 1.0 };
        // A light of 1/d² that is twice as near brings four times as much, of which cache points know little.
        let far = ONE_STAGE.factor(lit(1e-4), 1e4, at);
        assert!((far - ONE_STAGE.factor(lit(1e-4), 1e4, there(2.0))).abs() < 1e-3 * far);
        let [near, nearer] = [1e-2f32, 1e-4].map(|d2| ONE_STAGE.factor(lit(1.0 / d2), d2, at));
        assert!((near - nearer).abs() < 0.02 * near, "{near} {nearer}");
    }

    #[test]
    fn many_paths_reach_the_target() {
        let r = Resampled { paths: 1e9, uniform: 0.0, ..ONE_STAGE };
        assert!((r.factor(lit(6.0), 1.0, there(2.0)) - 3.0).abs() < 1e-5);
        assert_eq!(Resampled { vertices_per_path: 0.0, ..r }.factor(lit(6.0), 1.0, there(2.0)), 1.0);
        assert_eq!(
            r.factor(lit(5.0), 1.0, there(0.0)),
            Resampled { uniform: 1.0, ..r }.factor(lit(5.0), 1.0, there(2.0))
        );
    }
}
