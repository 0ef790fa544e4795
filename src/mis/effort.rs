//! How much work each kind of technique is worth in a scene.
//!
//! With the balance heuristic the estimator of a pixel has the second moment ∫ f²/D, D = Σ n_i c_i p_i, and every sample says f/D of
//! it. Other numbers of samples n′ only change D, and by how much follows from the weights that a sample's path gives to each kind
//! of technique: D′/D = Σ_kinds (n′/n) w_kind. So the samples of one setting tell the variance of any other, and with the costs of the kinds
//! the best of them (Grittmann et al. 2022, "Efficiency-aware multiple importance sampling for bidirectional rendering algorithms").
//!
//! A pixel's sample X of all techniques with t ≥ 2, one eye sub-path's, has a variance of less than that: E(X²) − (E X)², of which
//! E(X²) also has the products of unlike contributions. In a well-lit room (E X)² is nearly all, and the second moment alone would tell that
//! splats, whose numbers in a pixel are random, are worth more than they are. With two samples X₁, X₂ of each pixel, ½ (X₁ − X₂)²
//! is its variance at full effort, and with every contribution times n′/n D/D′ what its variance will be, but for the squares of
//! single contributions: with fewer connections, each by itself, these fall by n′/n only once.
//!
//! Sums go by regions of the picture, so that each counts relative to its own brightness.

use super::weigh::Weight;
use crate::math::Rgb;

/// Numbers of samples relative to the full ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Of techniques with t = 1: light sub-paths for the light image.
    pub light_image: f32,
    /// Of connections, s ≥ 2 and t ≥ 2.
    pub connections: f32,
}

/// What an iteration spends at full effort, in any unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Costs {
    /// On what is always there.
    pub base: f64,
    /// On light sub-paths for the light image.
    pub light_image: f64,
    /// On connections.
    pub connections: f64,
}

impl Effort {
    /// Everything.
    pub const FULL: Effort = Effort { light_image: 1.0, connections: 1.0 };

    /// D′/D of a path with these weights at full effort.
    fn remains(&self, weight: &Weight) -> f64 {
        let less = f64::from(weight.light_image) * f64::from(1.0 - self.light_image)
            + f64::from(weight.connections) * f64::from(1.0 - self.connections);
        // Weights sum to one up to rounding.
        (1.0 - less).max(1e-6)
    }

    fn cost(&self, costs: &Costs) -> f64 {
        costs.base + costs.light_image * f64::from(self.light_image) + costs.connections * f64::from(self.connections)
    }
}

/// One of the contributions to a pixel's sample.
#[derive(Clone, Copy, Debug)]
pub struct Contribution {
    /// What it brought, weighted.
    pub value: Rgb,
    /// Its weights.
    pub weight: Weight,
    /// It is a connection.
    pub connection: bool,
}

impl Contribution {
    // One that has no weight or is not finite says nothing.
    fn is_known(&self) -> bool {
        self.value.is_finite() && self.weight.light_image.is_finite() && self.weight.connections.is_finite()
    }
}

/// Mean square of the channels.
fn square(value: [f64; 3]) -> f64 {
    value.into_iter().map(|v| v * v).sum::<f64>() / 3.0
}

/// What samples at full effort say about a list of candidates: for each region of the picture and every candidate, by how much it would
/// raise the variance.
#[derive(Clone, Debug)]
pub struct EffortStatistics {
    candidates: Vec<Effort>,
    /// For each region and candidate.
    rises: Vec<f64>,
    /// For each pixel that is looked at, and every candidate and full effort, the sample of the first iteration.
    first: Vec<[f32; 3]>,
}

/// For smaller gains than this connections are not left out: two iterations do not tell more exactly.
const LEAST_GAIN: f64 = 0.9;

impl EffortStatistics {
    /// Nothing known of `regions` regions, of which so many `pixels` will be looked at.
    pub fn new(candidates: Vec<Effort>, regions: usize, pixels: usize) -> EffortStatistics {
        let (rises, first) = (vec![0.0; regions * candidates.len()], vec![[0.0; 3]; pixels * (candidates.len() + 1)]);
        EffortStatistics { candidates, rises, first }
    }

    /// Takes in a contribution of any technique in a region.
    pub fn add(&mut self, region: usize, contribution: &Contribution, times: f64) {
        if !contribution.is_known() {
            return;
        }
        let square = square(contribution.value.to_array().map(f64::from)) * times;
        let n = self.candidates.len();
        let Some(rises) = self.rises.get_mut(region * n..(region + 1) * n) else { return };
        for (rise, effort) in rises.iter_mut().zip(&self.candidates) {
            *rise += square * (1.0 / effort.remains(&contribution.weight) - 1.0);
        }
    }

    /// Takes in that a pixel's sample in the first or the second iteration was made of `contributions`, each of which is also added by
    /// itself.
    pub fn add_sample(
        &mut self,
        (region, pixel): (usize, usize),
        second: bool,
        contributions: &[Contribution],
        times: f64,
    ) {
        let n = self.candidates.len();
        let (Some(rises), Some(first)) = (
            self.rises.get_mut(region * n..(region + 1) * n),
            self.first.get_mut(pixel * (n + 1)..(pixel + 1) * (n + 1)),
        ) else {
            return;
        };
        let rise = |effort: &Effort, first: &mut [f32; 3]| {
            let (mut sum, mut squares) = ([0.0; 3], 0.0);
            for c in contributions.iter().filter(|c| c.is_known()) {
                let present = if c.connection { f64::from(effort.connections) } else { 1.0 };
                let scale = present / effort.remains(&c.weight);
                let value = c.value.to_array().map(|v| f64::from(v) * scale);
                squares += square(value);
                (0..3).for_each(|i| sum[i] += value[i]);
            }
            if !second {
                *first = sum.map(|v| v as f32);
                return -squares;
            }
            // Of two equal samples, twice ½ (X₁ − X₂)².
            square(std::array::from_fn(|i| sum[i] - f64::from(first[i]))) - squares
        };
        let full = first.last_mut().map_or(0.0, |first| rise(&Effort::FULL, first));
        for ((sum, effort), first) in rises.iter_mut().zip(&self.candidates).zip(first) {
            *sum += times * (rise(effort, first) - full);
        }
    }

    /// The candidate with the least product of variance and cost, or of those that are nearly as good the one with most connections.
    /// `variances` has for each region the sum over samples of their variance at full effort, and of its mean, squared, by which it
    /// counts; a share of the mean over all regions keeps dark ones from counting too much.
    pub fn best(&self, variances: &[(f64, f64)], costs: &Costs) -> Effort {
        let overall = variances.iter().map(|v| v.1).sum::<f64>() / variances.len().max(1) as f64;
        let product = |number: usize| {
            let rises = self.rises.chunks_exact(self.candidates.len());
            let variance: f64 = rises
                .zip(variances)
                .map(|(rises, (variance, mean2))| {
                    let scale = mean2 + 0.01 * overall;
                    // What two samples say of a variance may be less than nothing.
                    if scale > 0.0 { (variance + rises[number]).max(0.0) / scale } else { 0.0 }
                })
                .sum();
            variance * self.candidates[number].cost(costs)
        };
        let products: Vec<f64> = (0..self.candidates.len()).map(product).collect();
        let least = products.iter().copied().fold(f64::INFINITY, f64::min);
        let good = self.candidates.iter().zip(products).filter(|(_, product)| *product <= least / LEAST_GAIN);
        let order = |a: &(&Effort, f64), b: &(&Effort, f64)| {
            a.0.connections
                .total_cmp(&b.0.connections)
                .then(b.1.total_cmp(&a.1))
                .then(a.0.light_image.total_cmp(&b.0.light_image))
        };
        good.max_by(order).map_or(Effort::FULL, |(effort, _)| *effort)
    }

    /// All that is known, to be saved.
    pub fn saved(&self) -> impl Iterator<Item = f64> {
        self.rises.iter().copied().chain(self.first.as_flattened().iter().map(|v| f64::from(*v)))
    }

    /// Goes on from what was saved; nothing if that is of something else.
    pub fn restored(candidates: Vec<Effort>, regions: usize, saved: &[f64]) -> Option<EffortStatistics> {
        let (rises, samples) = saved.split_at_checked(regions * candidates.len())?;
        let samples: Vec<f32> = samples.iter().map(|v| *v as f32).collect();
        let (first, rest) = samples.as_chunks::<3>();
        (rest.is_empty() && first.len().is_multiple_of(candidates.len() + 1)).then(|| EffortStatistics {
            rises: rises.to_vec(),
            first: first.to_vec(),
            candidates,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    const COSTS: Costs = Costs { base: 1.0, light_image: 1.0, connections: 2.0 };

    fn candidates() -> Vec<Effort> {
        let steps = [1.0, 0.25, 0.0625];
        steps.iter().flat_map(|&l| steps.map(|c| Effort { light_image: l, connections: c })).collect()
    }

    fn brought(value: f32, weight: Weight) -> Contribution {
        Contribution { value: Rgb::grey(value), weight, connection: false }
    }

    /// ∫ f² / D by brute force, of three techniques with made-up densities, against what samples at full effort predict.
    #[test]
    fn other_efforts_are_predicted() {
        // f and the three densities on 20 cells of one integral.
        let f = |x: usize| 1.0 + (x as f64 * 0.7).sin();
        let p = |x: usize| [1.0 / 20.0, (x as f64 + 0.5) / 200.0, (19.5 - x as f64) / 200.0];
        let moment = |e: Effort| -> f64 {
            let n = [1.0, f64::from(e.light_image), f64::from(e.connections)];
            (0..20).map(|x| f(x).powi(2) / p(x).iter().zip(n).map(|(p, n)| p * n).sum::<f64>()).sum()
        };
        let mut statistics = EffortStatistics::new(candidates(), 1, 1);
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
            let weight = Weight {
                own: (p(x)[technique] / all) as f32,
                light_image: (p(x)[1] / all) as f32,
                connections: (p(x)[2] / all) as f32,
            };
            statistics.add(0, &brought((f(x) / all) as f32, weight), 1.0);
        }
        for (number, effort) in candidates().into_iter().enumerate() {
            let predicted = statistics.rises[number] / (N / 3) as f64;
            let rise = moment(effort) - moment(Effort::FULL);
            assert!((predicted - rise).abs() < 0.02 * rise.abs() + 1e-9, "{effort:?}: {predicted} {rise}");
        }
    }

    /// The variance of a pixel's sample that is made of two contributions of an eye sub-path and of two connections to one light
    /// sub-path, each of them there by itself with probability q, by brute force against what full effort predicts.
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
                let weight = Weight { own, light_image: 0.0, connections: share as f32 };
                Contribution { connection, ..brought((f(k, at) / d) as f32, weight) }
            })
        };
        let mut statistics = EffortStatistics::new(candidates(), 1, 1);
        for (x, y, p) in all() {
            sample(x, y).iter().for_each(|c| statistics.add(0, c, 2.0 * p));
            for (x2, y2, p2) in all() {
                statistics.add_sample((0, 0), false, &sample(x, y), p * p2);
                statistics.add_sample((0, 0), true, &sample(x2, y2), p * p2);
            }
        }
        for (number, effort) in candidates().into_iter().enumerate() {
            let rise = variance(f64::from(effort.connections)) - variance(1.0);
            let predicted = 0.5 * statistics.rises[number];
            assert!((predicted - rise).abs() < 1e-4 * (1.0 + rise.abs()), "{effort:?}: {predicted} {rise}");
        }
    }

    #[test]
    fn what_brings_nothing_is_left_out_and_what_brings_all_is_kept() {
        let decide = |light_image: f32, connections: f32| {
            let weight = Weight { own: 0.1, light_image, connections };
            let mut statistics = EffortStatistics::new(candidates(), 2, 0);
            statistics.add(0, &brought(2.0, weight), 1.0);
            statistics.add(7, &brought(1.0, weight), 1.0);
            statistics.add(1, &brought(f32::NAN, weight), 1.0);
            statistics.best(&[(1.0, 1.0), (1.0, 0.5)], &COSTS)
        };
        assert_eq!(decide(0.0, 0.0), Effort { light_image: 0.0625, connections: 0.0625 });
        assert_eq!(decide(0.0, 0.95), Effort { light_image: 0.0625, connections: 1.0 });
        assert_eq!(decide(0.9, 0.0), Effort { light_image: 1.0, connections: 0.0625 });
        // A scene without light teaches nothing.
        assert_eq!(EffortStatistics::new(candidates(), 1, 0).best(&[(0.0, 0.0)], &COSTS), Effort::FULL);
    }

    #[test]
    fn what_is_known_is_saved() {
        let mut one = EffortStatistics::new(candidates(), 2, 3);
        let contribution = brought(3.0, Weight { own: 0.5, light_image: 0.25, connections: 0.25 });
        one.add(1, &contribution, 1.0);
        one.add_sample((1, 2), false, &[contribution], 1.0);
        let saved: Vec<f64> = one.saved().collect();
        let mut other = EffortStatistics::restored(candidates(), 2, &saved).unwrap();
        assert!(saved.iter().any(|v| *v != 0.0));
        for statistics in [&mut one, &mut other] {
            statistics.add_sample((1, 2), true, &[contribution], 1.0);
        }
        assert!(one.saved().eq(other.saved()));
        assert!(EffortStatistics::restored(candidates(), 2, &saved[..7]).is_none());
        assert!(EffortStatistics::restored(candidates(), 2, &saved[1..]).is_none());
    }
}
