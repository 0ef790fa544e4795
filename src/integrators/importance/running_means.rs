//! Sums over iterations of the weights that pmfs at records are made of, by length of light sub-paths: the knowledge of
//! weights.

use super::distributions::{UNIFORM, mixture};
use super::record_pmfs::RecordPmfs;
use crate::mis::factors::PerLengthMeans;
use crate::mis::factors::per_length::{DISTRIBUTIONS, LENGTHS};
use serde::{Deserialize, Serialize};

/// Sums of one record, by length and pmf.
type RecordSums = [[f64; DISTRIBUTIONS]; LENGTHS];

/// Sums over iterations.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct RunningMeans {
    /// Weights at each record, by length and pmf.
    sums: Vec<RecordSums>,
    /// Numbers of sub-paths of each length.
    vertices: [f64; LENGTHS],
}

impl RunningMeans {
    /// Adds the weights of an iteration.
    pub fn learn(&mut self, pmfs: &RecordPmfs) {
        for (record, classes) in pmfs.weight_sums().enumerate() {
            if record == self.sums.len() {
                self.sums.push([[0.0; DISTRIBUTIONS]; LENGTHS]);
            }
            for class in classes {
                let s = class.s.min(LENGTHS - 1);
                if record == 0 {
                    self.vertices[s] += class.vertices as f64;
                }
                for (own, sum) in self.sums[record][s].iter_mut().zip(class.sums) {
                    *own += sum;
                }
            }
        }
    }

    /// Means over all sub-paths of a length; `numbers` is how many of each there are in an iteration.
    pub fn per_length(&self, numbers: Vec<f32>) -> PerLengthMeans {
        let mean = |sum: f64, s: usize| if self.vertices[s] > 0.0 { (sum / self.vertices[s]) as f32 } else { 0.0 };
        let means = self.sums.iter().map(|record| std::array::from_fn(|s| record[s].map(|sum| mean(sum, s))));
        PerLengthMeans { means: means.collect(), numbers }
    }

    /// Where all light vertices are drawn from together: the factor from the light of a vertex at the record to the
    /// probability with which the record's mixture draws it over the uniform probability, without the uniform component
    /// and over its share; zero if no light is known of.
    #[inline]
    pub fn probability_per_light(&self, record: usize) -> f64 {
        // All lengths are one class, of length 0.
        let Some([sums, ..]) = self.sums.get(record) else { return 0.0 };
        let [seen, open] = mixture(*sums);
        (seen + open) * self.vertices[0] / (1.0 - UNIFORM)
    }

    /// True if nothing was learnt.
    pub fn is_empty(&self) -> bool {
        self.sums.is_empty()
    }

    /// True if `other` is of the same records.
    pub fn fits(&self, other: &RunningMeans) -> bool {
        self.sums.len() == other.sums.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_count_the_mixture_that_is_drawn_from() {
        // Ten vertices, of which one brings 3, seen: it is drawn with ⅖ 3/6 + ⅖ 3/12 + ⅕ 1/10.
        let mut means = RunningMeans { sums: vec![[[0.0; DISTRIBUTIONS]; LENGTHS]], vertices: [0.0; LENGTHS] };
        assert_eq!(means.probability_per_light(0), 0.0);
        (means.sums[0][0], means.vertices[0]) = ([6.0, 12.0, 1.0], 10.0);
        let drawn = (1.0 - UNIFORM) * means.probability_per_light(0) * 3.0 / 10.0 + UNIFORM / 10.0;
        assert!((drawn - (0.4 * 3.0 / 6.0 + 0.4 * 3.0 / 12.0 + 0.02)).abs() < 1e-12, "{drawn}");
        // After twice as many iterations it is the same.
        (means.sums[0][0], means.vertices[0]) = ([12.0, 24.0, 2.0], 20.0);
        assert!(((1.0 - UNIFORM) * means.probability_per_light(0) * 3.0 / 10.0 + UNIFORM / 10.0 - drawn).abs() < 1e-12);
    }
}
