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
//! A weight may use any Q that does not depend on the sub-paths it weighs: an estimate from earlier iterations. It need not be good for
//! the result to be right; the ratio p/q is clamped from below so that a bad one costs a bounded variance.

/// How connections are resampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resampled {
    /// M.
    pub paths: f32,
    /// Smallest p/q.
    pub epsilon: f32,
    /// u.
    pub uniform: f32,
    /// L, an estimate; 0 if nothing is known yet.
    pub vertices_per_path: f32,
}

impl Resampled {
    /// c for a sub-path that brings `a` to a place with the irradiance `irradiance`.
    #[inline]
    pub fn factor(&self, a: f32, irradiance: f32) -> f32 {
        if self.vertices_per_path <= 0.0 {
            return 1.0;
        }
        let uniform = 1.0 / self.vertices_per_path;
        // Where no light is known of, all of the mixture is uniform.
        let q_over_p =
            if irradiance > 0.0 { (1.0 - self.uniform) * a / irradiance + self.uniform * uniform } else { uniform };
        let p_over_q = (1.0 / q_over_p).max(self.epsilon);
        let m = 1.0 / self.paths;
        1.0 / (m + (1.0 - m) * p_over_q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn one_path_is_not_resampled(a in 0.0f32..1e6, q in 0.0f32..1e6, l in 0.1f32..20.0) {
            let r = Resampled { paths: 1.0, epsilon: 1e-3, uniform: 0.25, vertices_per_path: l };
            prop_assert_eq!(r.factor(a, q), 1.0);
        }

        #[test]
        fn factors_grow_with_light_and_stay_bounded(a in 0.0f32..1e6, b in 0.0f32..1e6, q in 1e-6f32..1e6, m in 1.0f32..1e5) {
            let r = Resampled { paths: m, epsilon: 1e-3, uniform: 0.25, vertices_per_path: 3.0 };
            let (x, y) = (r.factor(a.min(b), q), r.factor(a.max(b), q));
            prop_assert!(x <= y && x > 0.0 && y <= 1001.0);
        }
    }

    #[test]
    fn many_paths_reach_the_target() {
        let r = Resampled { paths: 1e9, epsilon: 1e-3, uniform: 0.0, vertices_per_path: 3.0 };
        assert!((r.factor(6.0, 2.0) - 3.0).abs() < 1e-5);
        assert_eq!(Resampled { vertices_per_path: 0.0, ..r }.factor(6.0, 2.0), 1.0);
        assert_eq!(r.factor(5.0, 0.0), Resampled { uniform: 1.0, ..r }.factor(5.0, 2.0));
    }
}
