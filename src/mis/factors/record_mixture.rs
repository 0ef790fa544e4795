//! c of a connection that is drawn at an importance record or skeleton node from all light vertices together, by the
//! mixture P = ⅖ P_seen + ⅖ P_open + ⅕ P_uniform. `skeleton` and `ic-bdpt` use it by default; it costs no rays.
//!
//! The factor is that of resampling (Nabata et al. 2020, "Resampling-aware weighting functions", eq. 14) with
//!
//! q/p = (1 − u) a/Q + u/L,
//!
//! where a is the light that the sub-path brings to the eye vertex (visibility taken for granted), u the share of the
//! uniform pmf, L the connectable vertices per light sub-path, and 1/Q the sum of ⅖/(1 − u) over the sums of the
//! weights of each of the two other pmfs at the record, from earlier iterations.
//!
//! DEVIATION: Noël and Biri 2015 weigh by the balance heuristic, which does not know of the drawing. Balance weights
//! leave most of the light to other techniques; they stay selectable (`weights=balance`).

use super::ris::Stages;
use crate::mis::factor::{ConnectionFactor, IncidentSubpath};

/// The factor; see the module's head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordMixtureFactor {
    /// Candidates; one stage.
    pub stages: Stages,
    /// u.
    pub uniform_share: f32,
    /// Fraction of the light that the record is assumed not to see.
    pub unseen_fraction: f32,
}

/// Q at an eye vertex; 0 where no light is known of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RecordNormalization(pub f32);

impl ConnectionFactor for RecordMixtureFactor {
    type Edge = RecordNormalization;

    #[inline]
    fn c(&self, light: &IncidentSubpath, RecordNormalization(q): &RecordNormalization) -> f32 {
        if self.stages.vertices_per_path <= 0.0 || self.stages.paths <= 1.0 {
            return 1.0;
        }
        let uniform = 1.0 / self.stages.vertices_per_path;
        let (seen, unseen) = match *q > 0.0 {
            true => {
                let unseen = self.uniform_share * uniform;
                ((1.0 - self.uniform_share) * light.target_over_pdf.full / q + unseen, unseen)
            }
            false => (uniform, uniform),
        };
        let p_over = |q_over_p| self.stages.p_over_q(q_over_p);
        let p_over_q = (1.0 - self.unseen_fraction) * p_over(seen) + self.unseen_fraction * p_over(unseen);
        self.stages.factor(p_over_q, p_over_q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mis::factor::ResamplingTarget;

    #[test]
    fn the_density_is_the_mixtures() {
        let stages = Stages { paths: 1e9, second_stage: None, epsilon: 1e-6, vertices_per_path: 2.0 };
        let factor = RecordMixtureFactor { stages, uniform_share: 0.2, unseen_fraction: 0.0 };
        let light = |full| IncidentSubpath {
            target_over_pdf: ResamplingTarget { full, first_stage: 0.0 },
            ..IncidentSubpath::default()
        };
        assert!((factor.c(&light(6.0), &RecordNormalization(3.0)) - (0.8 * 2.0 + 0.2 / 2.0)).abs() < 1e-5);
        // Where nothing is known, all of the mixture is uniform.
        assert!((factor.c(&light(6.0), &RecordNormalization(0.0)) - 0.5).abs() < 1e-6);
        let one = RecordMixtureFactor { stages: Stages { paths: 1.0, ..stages }, ..factor };
        assert_eq!(one.c(&light(6.0), &RecordNormalization(3.0)), 1.0);
        // Half of the light unseen: the mean of the reciprocals.
        let half = RecordMixtureFactor { unseen_fraction: 0.5, ..factor };
        assert!((1.0 / half.c(&light(6.0), &RecordNormalization(3.0)) - 0.5 / 1.7 - 0.5 / 0.1).abs() < 1e-4);
    }
}
