//! How many samples each group of techniques is worth in a scene.
//!
//! With the balance heuristic the estimator of a pixel has the second moment ∫ f²/D, D = Σ n_i c_i p_i, and every
//! sample is a sample of f/D. Other numbers of samples n′ change only D, and the weights that a sample's path gives to
//! each group of techniques tell by how much: D′/D = Σ_groups (n′/n) w_group. So the samples of one setting predict the
//! variance of any other, and with the costs of the groups the best of them (Grittmann et al. 2022, "Efficiency-aware
//! multiple importance sampling for bidirectional rendering algorithms").
//!
//! A pixel's sample X of all techniques with t ≥ 2, those of one eye sub-path, has a smaller variance than that: E(X²)
//! − (E X)², where E(X²) also has the products of different contributions. In a well-lit room (E X)² is nearly all, and
//! the second moment alone would overrate splats, whose numbers in a pixel are random. With two samples X₁, X₂ of each
//! pixel, ½ (X₁ − X₂)² estimates its variance at full allocation, and with every contribution times n′/n D/D′ the
//! variance at another one, but for the squares of single contributions: with fewer connections, each left out by
//! itself, these fall by n′/n only once.
//!
//! Sums are kept by region of the picture, so that each region counts relative to its own brightness.

use super::weight::MisWeight;
use crate::math::Rgb;
use serde::{Deserialize, Serialize};

/// Numbers of samples relative to the full ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SampleAllocation {
    /// Samples of techniques with t = 1: light sub-paths for the light image.
    pub light_image: f32,
    /// Samples of connections, s ≥ 2 and t ≥ 2.
    pub connections: f32,
}

/// Costs of an iteration at full allocation, in any unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AllocationCosts {
    /// Cost of the techniques that are always used.
    pub base: f64,
    /// Cost of light sub-paths for the light image.
    pub light_image: f64,
    /// Cost of connections.
    pub connections: f64,
}

impl SampleAllocation {
    /// All samples.
    pub const FULL: SampleAllocation = SampleAllocation { light_image: 1.0, connections: 1.0 };

    /// D′/D of a path with these weights at full allocation.
    fn density_ratio(&self, weight: &MisWeight) -> f64 {
        let less = f64::from(weight.light_image) * f64::from(1.0 - self.light_image)
            + f64::from(weight.connections) * f64::from(1.0 - self.connections);
        // Weights sum to one up to rounding.
        (1.0 - less).max(1e-6)
    }

    fn cost(&self, costs: &AllocationCosts) -> f64 {
        costs.base + costs.light_image * f64::from(self.light_image) + costs.connections * f64::from(self.connections)
    }
}

/// One of the contributions to the sample of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct WeightedContribution {
    /// Its value times its weight.
    pub value: Rgb,
    /// Its weights.
    pub weight: MisWeight,
    /// It is a connection.
    pub connection: bool,
}

impl WeightedContribution {
    fn is_finite(&self) -> bool {
        self.value.is_finite() && self.weight.light_image.is_finite() && self.weight.connections.is_finite()
    }
}

/// Mean square of the channels.
fn square(value: [f64; 3]) -> f64 {
    value.into_iter().map(|v| v * v).sum::<f64>() / 3.0
}

/// Estimates from samples at full allocation, for each region of the picture and every candidate, by how much the
/// candidate would increase the variance.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EfficiencyEstimator {
    candidates: Vec<SampleAllocation>,
    /// For each region and candidate.
    increases: Vec<f64>,
    /// For each probed pixel, every candidate and full allocation, the sample of the first iteration.
    first: Vec<[f32; 3]>,
}

/// A probed pixel in one of the two probing iterations.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// Its region.
    pub region: usize,
    /// Its number among the probed pixels.
    pub pixel: usize,
    /// The iteration is the second.
    pub second: bool,
}

/// For smaller gains than this connections are not left out: two iterations do not tell more exactly.
const LEAST_GAIN: f64 = 0.9;

impl EfficiencyEstimator {
    /// No samples yet, of `regions` regions and `pixels` probed pixels.
    pub fn new(candidates: Vec<SampleAllocation>, regions: usize, pixels: usize) -> EfficiencyEstimator {
        let (increases, first) =
            (vec![0.0; regions * candidates.len()], vec![[0.0; 3]; pixels * (candidates.len() + 1)]);
        EfficiencyEstimator { candidates, increases, first }
    }

    /// Adds a contribution of any technique in a region, which stands for `times` of its kind.
    pub fn add(&mut self, region: usize, contribution: &WeightedContribution, times: f64) {
        if !contribution.is_finite() {
            return;
        }
        let square = square(contribution.value.to_array().map(f64::from)) * times;
        let n = self.candidates.len();
        let Some(increases) = self.increases.get_mut(region * n..(region + 1) * n) else { return };
        for (increase, allocation) in increases.iter_mut().zip(&self.candidates) {
            *increase += square * (1.0 / allocation.density_ratio(&contribution.weight) - 1.0);
        }
    }

    /// Adds the sample of a pixel in the first or the second iteration, the sum of `contributions`, each of which is
    /// also added by itself.
    pub fn add_sample(&mut self, probe: Probe, contributions: &[WeightedContribution], times: f64) {
        let Probe { region, pixel, second } = probe;
        let n = self.candidates.len();
        let (Some(increases), Some(first)) = (
            self.increases.get_mut(region * n..(region + 1) * n),
            self.first.get_mut(pixel * (n + 1)..(pixel + 1) * (n + 1)),
        ) else {
            return;
        };
        let increase = |allocation: &SampleAllocation, first: &mut [f32; 3]| {
            let (mut sum, mut squares) = ([0.0; 3], 0.0);
            for c in contributions.iter().filter(|c| c.is_finite()) {
                let present = if c.connection { f64::from(allocation.connections) } else { 1.0 };
                let scale = present / allocation.density_ratio(&c.weight);
                let value = c.value.to_array().map(|v| f64::from(v) * scale);
                squares += square(value);
                (0..3).for_each(|i| sum[i] += value[i]);
            }
            if !second {
                *first = sum.map(|v| v as f32);
                return -squares;
            }
            // Twice ½ (X₁ − X₂)², since there are two samples.
            square(std::array::from_fn(|i| sum[i] - f64::from(first[i]))) - squares
        };
        let full = first.last_mut().map_or(0.0, |first| increase(&SampleAllocation::FULL, first));
        for ((sum, allocation), first) in increases.iter_mut().zip(&self.candidates).zip(first) {
            *sum += times * (increase(allocation, first) - full);
        }
    }

    /// The candidate with the least product of variance and cost, or of those that are nearly as good the one with most
    /// connections. `variances` has for each region the sum over samples of their variance at full allocation, and of
    /// its mean, squared, by which it counts; a share of the mean over all regions keeps dark ones from counting too
    /// much.
    pub fn best(&self, variances: &[(f64, f64)], costs: &AllocationCosts) -> SampleAllocation {
        let overall = variances.iter().map(|v| v.1).sum::<f64>() / variances.len().max(1) as f64;
        let product = |number: usize| {
            let increases = self.increases.chunks_exact(self.candidates.len());
            let variance: f64 = increases
                .zip(variances)
                .map(|(increases, (variance, mean2))| {
                    let scale = mean2 + 0.01 * overall;
                    // An estimate of a variance from two samples may be negative.
                    if scale > 0.0 { (variance + increases[number]).max(0.0) / scale } else { 0.0 }
                })
                .sum();
            variance * self.candidates[number].cost(costs)
        };
        let products: Vec<f64> = (0..self.candidates.len()).map(product).collect();
        let least = products.iter().copied().fold(f64::INFINITY, f64::min);
        let good = self.candidates.iter().zip(products).filter(|(_, product)| *product <= least / LEAST_GAIN);
        let order = |a: &(&SampleAllocation, f64), b: &(&SampleAllocation, f64)| {
            a.0.connections
                .total_cmp(&b.0.connections)
                .then(b.1.total_cmp(&a.1))
                .then(a.0.light_image.total_cmp(&b.0.light_image))
        };
        good.max_by(order).map_or(SampleAllocation::FULL, |(allocation, _)| *allocation)
    }

    /// True if the sums are of these candidates, as many regions and as many probed pixels: a saved state can be of
    /// another render.
    pub fn fits(&self, candidates: &[SampleAllocation], regions: usize) -> bool {
        self.candidates == candidates
            && self.increases.len() == regions * candidates.len()
            && self.first.len().is_multiple_of(candidates.len() + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    const COSTS: AllocationCosts = AllocationCosts { base: 1.0, light_image: 1.0, connections: 2.0 };

    fn candidates() -> Vec<SampleAllocation> {
        let steps = [1.0, 0.25, 0.0625];
        steps.iter().flat_map(|&l| steps.map(|c| SampleAllocation { light_image: l, connections: c })).collect()
    }

    fn contribution_of(value: f32, weight: MisWeight) -> WeightedContribution {
        WeightedContribution { value: Rgb::grey(value), weight, connection: false }
    }

    /// ∫ f² / D by brute force, of three techniques with made-up densities, against what samples at full allocation
    /// predict.
    #[test]
    fn other_efforts_are_predicted() {
        // f and the three densities on 20 cells of one integral.
        let f = |x: usize| 1.0 + (x as f64 * 0.7).sin();
        let p = |x: usize| [1.0 / 20.0, (x as f64 + 0.5) / 200.0, (19.5 - x as f64) / 200.0];
        let moment = |e: SampleAllocation| -> f64 {
            let n = [1.0, f64::from(e.light_image), f64::from(e.connections)];
            (0..20).map(|x| f(x).powi(2) / p(x).iter().zip(n).map(|(p, n)| p * n).sum::<f64>()).sum()
        };
        let mut statistics = EfficiencyEstimator::new(candidates(), 1, 1);
        let mut rng = HashRng::new(1, 2, 3, 4);
        const N: usize = 400_000;
        for i in 0..N {
            // One sample of each technique in turn.
            let technique = i % 3;
            let mut u = f64::from(rng.next_f32());
            let x = (0..19)
                .find(|&x| {
                    u -= p(x)[technique];
                    u < 0.0
                })
                .unwrap_or(19);
            let all: f64 = p(x).iter().sum();
            let weight = MisWeight {
                own: (p(x)[technique] / all) as f32,
                light_image: (p(x)[1] / all) as f32,
                connections: (p(x)[2] / all) as f32,
            };
            statistics.add(0, &contribution_of((f(x) / all) as f32, weight), 1.0);
        }
        for (number, allocation) in candidates().into_iter().enumerate() {
            let predicted = statistics.increases[number] / (N / 3) as f64;
            let increase = moment(allocation) - moment(SampleAllocation::FULL);
            assert!(
                (predicted - increase).abs() < 0.02 * increase.abs() + 1e-9,
                "{allocation:?}: {predicted} {increase}"
            );
        }
    }

    /// The variance of a pixel's sample that is made of two contributions of an eye sub-path and of two connections to
    /// one light sub-path, each of them there by itself with probability q, by brute force against what full allocation
    /// predicts.
    #[test]
    fn the_variance_of_a_pixel_is_predicted() {
        let f = |k: usize, x: usize| 1.0 + k as f64 + (x as f64 * 0.7).sin();
        let (eye, light) = (1.0 / 8.0, |x: usize| (x as f64 + 0.5) / 32.0);
        let all = || (0..8).flat_map(|x| (0..8).map(move |y| (x, y, eye * light(y))));
        let variance = |q: f64| -> f64 {
            let brings = |k: usize, x: usize| f(k, x) / (eye + q * light(x));
            let (mut mean, mut moment) = (0.0, 0.0);
            for (x, y, p) in all() {
                for there in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
                    let p = p * there.iter().map(|b| b * q + (1.0 - b) * (1.0 - q)).product::<f64>();
                    let connected = there[0] * brings(0, y) + there[1] * brings(1, y);
                    let sample = brings(0, x) + brings(1, x) + connected;
                    mean += p * sample;
                    moment += p * sample * sample;
                }
            }
            moment - mean * mean
        };
        let sample = |x: usize, y: usize| {
            [(0, x, false), (1, x, false), (0, y, true), (1, y, true)].map(|(k, at, connection)| {
                let d = eye + light(at);
                let share = light(at) / d;
                let own = if connection { share } else { 1.0 - share } as f32;
                let weight = MisWeight { own, light_image: 0.0, connections: share as f32 };
                WeightedContribution { connection, ..contribution_of((f(k, at) / d) as f32, weight) }
            })
        };
        let mut statistics = EfficiencyEstimator::new(candidates(), 1, 1);
        for (x, y, p) in all() {
            sample(x, y).iter().for_each(|c| statistics.add(0, c, 2.0 * p));
            for (x2, y2, p2) in all() {
                statistics.add_sample(Probe { region: 0, pixel: 0, second: false }, &sample(x, y), p * p2);
                statistics.add_sample(Probe { region: 0, pixel: 0, second: true }, &sample(x2, y2), p * p2);
            }
        }
        for (number, allocation) in candidates().into_iter().enumerate() {
            let increase = variance(f64::from(allocation.connections)) - variance(1.0);
            let predicted = 0.5 * statistics.increases[number];
            assert!(
                (predicted - increase).abs() < 1e-4 * (1.0 + increase.abs()),
                "{allocation:?}: {predicted} {increase}"
            );
        }
    }

    #[test]
    fn useless_samples_are_left_out_and_useful_ones_kept() {
        let decide = |light_image: f32, connections: f32| {
            let weight = MisWeight { own: 0.1, light_image, connections };
            let mut statistics = EfficiencyEstimator::new(candidates(), 2, 0);
            statistics.add(0, &contribution_of(2.0, weight), 1.0);
            statistics.add(7, &contribution_of(1.0, weight), 1.0);
            statistics.add(1, &contribution_of(f32::NAN, weight), 1.0);
            statistics.best(&[(1.0, 1.0), (1.0, 0.5)], &COSTS)
        };
        assert_eq!(decide(0.0, 0.0), SampleAllocation { light_image: 0.0625, connections: 0.0625 });
        assert_eq!(decide(0.0, 0.95), SampleAllocation { light_image: 0.0625, connections: 1.0 });
        assert_eq!(decide(0.9, 0.0), SampleAllocation { light_image: 1.0, connections: 0.0625 });
        // In a scene without light there is nothing to decide.
        assert_eq!(EfficiencyEstimator::new(candidates(), 1, 0).best(&[(0.0, 0.0)], &COSTS), SampleAllocation::FULL);
    }

    #[test]
    fn a_state_of_another_render_does_not_fit() {
        let one = EfficiencyEstimator::new(candidates(), 2, 3);
        assert!(one.fits(&candidates(), 2));
        assert!(!one.fits(&candidates(), 3) && !one.fits(&candidates()[1..], 2));
    }
}
