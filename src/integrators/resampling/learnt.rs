//! What sites of importance caching have found so far of the light sub-paths of each length: the means that weights know.

use super::combined::CombinedPmfs;
use super::distributions::{UNIFORM, mixture};
use crate::mis::Lengths;
use crate::mis::lengths::{DISTRIBUTIONS, LENGTHS};

/// Numbers of a site in a saved state.
const PER_SITE: usize = DISTRIBUTIONS * LENGTHS;

/// Sums over iterations.
#[derive(Debug, Default)]
pub(super) struct Learnt {
    /// Of what each site found, by length and distribution.
    sums: Vec<[[f64; DISTRIBUTIONS]; LENGTHS]>,
    /// Of the number of sub-paths of each length.
    vertices: [f64; LENGTHS],
}

impl Learnt {
    /// Adds what an iteration's probabilities say.
    pub fn learn(&mut self, combined: &CombinedPmfs) {
        for (site, found) in combined.found().enumerate() {
            if site == self.sums.len() {
                self.sums.push([[0.0; DISTRIBUTIONS]; LENGTHS]);
            }
            for (s, count, sums) in found {
                let s = s.min(LENGTHS - 1);
                if site == 0 {
                    self.vertices[s] += count as f64;
                }
                for (own, sum) in self.sums[site][s].iter_mut().zip(sums) {
                    *own += sum;
                }
            }
        }
    }

    /// Means over all sub-paths of a length; `numbers` is how many of each there are in an iteration.
    pub fn lengths(&self, numbers: Vec<f32>, epsilon: f32) -> Lengths {
        let mean = |sum: f64, s: usize| if self.vertices[s] > 0.0 { (sum / self.vertices[s]) as f32 } else { 0.0 };
        let means = self.sums.iter().map(|site| std::array::from_fn(|s| site[s].map(|sum| mean(sum, s))));
        Lengths { means: means.collect(), numbers, epsilon }
    }

    /// Where all light vertices are one class: what light of one unit makes of the probability with which the site's mixture draws its vertex,
    /// over that of drawing it uniformly and without the uniform share; zero if no light is known of.
    #[inline]
    pub fn known(&self, site: usize) -> f64 {
        // Many lights have no length.
        let Some([sums, ..]) = self.sums.get(site) else { return 0.0 };
        let [seen, open] = mixture(*sums);
        (seen + open) * self.vertices[0] / (1.0 - UNIFORM)
    }

    /// What must be saved to go on later; nothing if nothing was learnt.
    pub fn state(&self) -> Vec<f64> {
        match self.sums.is_empty() {
            true => vec![],
            false => self.vertices.iter().chain(self.sums.as_flattened().as_flattened()).copied().collect(),
        }
    }

    /// Goes on from a saved state; false if it is of other sites.
    pub fn restore(&mut self, state: &[f64]) -> bool {
        let Some((vertices, sums)) = state.split_first_chunk::<LENGTHS>() else { return false };
        if sums.len() != self.sums.len() * PER_SITE {
            return false;
        }
        self.vertices = *vertices;
        for (own, sum) in self.sums.as_flattened_mut().as_flattened_mut().iter_mut().zip(sums) {
            *own = *sum;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_know_the_mixture_that_is_drawn_from() {
        // Ten vertices, of which one brings 3 in sight: it is drawn with ⅖ 3/6 + ⅖ 3/12 + ⅕ 1/10.
        let mut learnt = Learnt { sums: vec![[[0.0; DISTRIBUTIONS]; LENGTHS]], vertices: [0.0; LENGTHS] };
        assert_eq!(learnt.known(0), 0.0);
        (learnt.sums[0][0], learnt.vertices[0]) = ([6.0, 12.0, 1.0], 10.0);
        let drawn = (1.0 - UNIFORM) * learnt.known(0) * 3.0 / 10.0 + UNIFORM / 10.0;
        assert!((drawn - (0.4 * 3.0 / 6.0 + 0.4 * 3.0 / 12.0 + 0.02)).abs() < 1e-12, "{drawn}");
        // After twice as many iterations it is the same.
        (learnt.sums[0][0], learnt.vertices[0]) = ([12.0, 24.0, 2.0], 20.0);
        assert!(((1.0 - UNIFORM) * learnt.known(0) * 3.0 / 10.0 + UNIFORM / 10.0 - drawn).abs() < 1e-12);
    }
}
