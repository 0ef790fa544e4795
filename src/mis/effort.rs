//! How much work each kind of technique is worth in a scene.
//!
//! With the balance heuristic the estimator of a pixel has the second moment ∫ f²/D, D = Σ n_i c_i p_i, and every sample says f/D of
//! it. Other numbers of samples n′ only change D, and by how much follows from the weights that a sample's path gives to each kind
//! of technique: D′/D = Σ_kinds (n′/n) w_kind. So the samples of one setting tell the variance of any other, and with the costs of the kinds
//! the best of them (Grittmann et al. 2022, "Efficiency-aware multiple importance sampling for bidirectional rendering algorithms").
//!
//! That is the whole change if samples come and go one by one. Connections to one light sub-path stay or go together, and bring much or
//! nothing together: with fewer of them, the products of the contributions of a pixel's sample count as well
//! ([`EffortStatistics::add_together`]).
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
pub struct Together {
    /// What it brought, weighted.
    pub value: Rgb,
    /// Its weights.
    pub weight: Weight,
    /// It is a connection.
    pub connection: bool,
}

impl Together {
    fn is_finite(&self) -> bool {
        self.value.is_finite() && self.weight.light_image.is_finite() && self.weight.connections.is_finite()
    }
}

/// Sums over pairs of unlike contributions of their products, mean of the channels, if each is multiplied by what `scale` makes of its
/// weights: with connections, and without.
fn pairs(contributions: &[Together], scale: impl Fn(&Weight) -> f64) -> (f64, f64) {
    let mut pairs = (0.0, 0.0);
    for channel in 0..3 {
        let (mut sums, mut squares) = ([0.0; 2], [0.0; 2]);
        for c in contributions {
            let value = f64::from(c.value.to_array()[channel]) * scale(&c.weight);
            sums[usize::from(c.connection)] += value;
            squares[usize::from(c.connection)] += value * value;
        }
        pairs.0 += ((sums[0] + sums[1]).powi(2) - squares[0] - squares[1]) / 3.0;
        pairs.1 += (sums[0].powi(2) - squares[0]) / 3.0;
    }
    pairs
}

/// Statistics of one region of the picture: for every candidate setting, by how much it would raise the second moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    rises: Vec<f64>,
}

/// What samples at full effort say about a list of candidates.
#[derive(Clone, Debug)]
pub struct EffortStatistics {
    candidates: Vec<Effort>,
    regions: Vec<Region>,
}

/// Gains smaller than this are not worth a change.
const LEAST_GAIN: f64 = 0.95;

impl EffortStatistics {
    /// Nothing known of `regions` regions.
    pub fn new(candidates: Vec<Effort>, regions: usize) -> EffortStatistics {
        let regions = vec![Region { rises: vec![0.0; candidates.len()] }; regions];
        EffortStatistics { candidates, regions }
    }

    /// Takes in a sample: its contribution `square`, squared, in a region, and its weights.
    pub fn add(&mut self, region: usize, square: f64, weight: &Weight) {
        let Some(region) = self.regions.get_mut(region) else { return };
        // A sample that has no weight or is not finite says nothing.
        let weighed = weight.light_image.is_finite() && weight.connections.is_finite();
        if !(square > 0.0 && square.is_finite() && weighed) {
            return;
        }
        for (rise, effort) in region.rises.iter_mut().zip(&self.candidates) {
            *rise += square * (1.0 / effort.remains(weight) - 1.0);
        }
    }

    /// Takes in that one sample of a pixel was made of `contributions`, each of which has been added before, and whose connections
    /// were to one light sub-path. Counts for `times` such samples.
    pub fn add_together(&mut self, region: usize, contributions: &[Together], times: f64) {
        let Some(region) = self.regions.get_mut(region) else { return };
        if !contributions.iter().all(Together::is_finite) {
            return;
        }
        let now = pairs(contributions, |_| 1.0);
        for (rise, effort) in region.rises.iter_mut().zip(&self.candidates) {
            // A contribution is f/D, whatever D is.
            let (all, alone) = pairs(contributions, |weight| 1.0 / effort.remains(weight));
            let present = f64::from(effort.connections);
            *rise += times * (present * all + (1.0 - present) * alone - now.0);
        }
    }

    /// The candidate with the least product of variance and cost. `variances` has for each region the sum over samples of their variance at
    /// full effort, and of its mean, squared, by which it counts; a share of the mean over all regions keeps dark ones from counting
    /// too much.
    pub fn best(&self, variances: &[(f64, f64)], costs: &Costs) -> Effort {
        let overall = variances.iter().map(|v| v.1).sum::<f64>() / variances.len().max(1) as f64;
        let product = |number: usize| {
            let variance: f64 = self
                .regions
                .iter()
                .zip(variances)
                .map(|(region, (variance, mean2))| {
                    let scale = mean2 + 0.01 * overall;
                    if scale > 0.0 { (variance + region.rises[number]) / scale } else { 0.0 }
                })
                .sum();
            variance * self.candidates[number].cost(costs)
        };
        let full = self.candidates.iter().position(|c| *c == Effort::FULL).map_or(f64::INFINITY, product);
        let mut best = (Effort::FULL, full * LEAST_GAIN);
        for (number, candidate) in self.candidates.iter().enumerate() {
            let product = product(number);
            if product < best.1 {
                best = (*candidate, product);
            }
        }
        best.0
    }

    /// All sums, to be saved.
    pub fn sums(&self) -> impl Iterator<Item = f64> {
        self.regions.iter().flat_map(|r| r.rises.iter().copied())
    }

    /// Goes on from saved sums; false if there are not as many.
    pub fn restore(&mut self, sums: &[f64]) -> bool {
        let fits = sums.len() == self.candidates.len() * self.regions.len();
        if fits {
            let all = self.regions.iter_mut().flat_map(|r| &mut r.rises);
            all.zip(sums).for_each(|(a, b)| *a = *b);
        }
        fits
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
        let mut statistics = EffortStatistics::new(candidates(), 1);
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
            statistics.add(0, (f(x) / all).powi(2), &weight);
        }
        for (number, effort) in candidates().into_iter().enumerate() {
            let predicted = statistics.regions[0].rises[number] / (N / 3) as f64;
            let rise = moment(effort) - moment(Effort::FULL);
            assert!((predicted - rise).abs() < 0.02 * rise.abs() + 1e-9, "{effort:?}: {predicted} {rise}");
        }
    }

    /// The second moment of a pixel's sample that is made of two contributions of an eye sub-path and, with probability q, of two
    /// connections to one light sub-path, by brute force against what full effort predicts.
    #[test]
    fn contributions_that_come_together_are_predicted() {
        let f = |k: usize, x: usize| 1.0 + k as f64 + (x as f64 * 0.7).sin();
        let (eye, light) = (1.0 / 20.0, |x: usize| (x as f64 + 0.5) / 200.0);
        let all = || (0..20).flat_map(|x| (0..20).map(move |y| (x, y, eye * light(y))));
        let moment = |q: f64| -> f64 {
            let brings = |x: usize| (f(0, x) + f(1, x)) / (eye + q * light(x));
            all().map(|(x, y, p)| p * (q * (brings(x) + brings(y)).powi(2) + (1.0 - q) * brings(x).powi(2))).sum()
        };
        let mut statistics = EffortStatistics::new(candidates(), 1);
        for (x, y, p) in all() {
            let contribution = |k: usize, at: usize, connection: bool| {
                let d = eye + light(at);
                let share = light(at) / d;
                let own = if connection { share } else { 1.0 - share } as f32;
                let weight = Weight { own, light_image: 0.0, connections: share as f32 };
                Together { value: Rgb::grey((f(k, at) / d) as f32), weight, connection }
            };
            let sample =
                [(0, x, false), (1, x, false), (0, y, true), (1, y, true)].map(|(k, at, c)| contribution(k, at, c));
            for c in &sample {
                statistics.add(0, p * f64::from(c.value.g).powi(2), &c.weight);
            }
            statistics.add_together(0, &sample, p);
        }
        for (number, effort) in candidates().into_iter().enumerate() {
            let rise = moment(f64::from(effort.connections)) - moment(1.0);
            let predicted = statistics.regions[0].rises[number];
            assert!((predicted - rise).abs() < 1e-4 * (1.0 + rise.abs()), "{effort:?}: {predicted} {rise}");
        }
    }

    #[test]
    fn what_brings_nothing_is_left_out_and_what_brings_all_is_kept() {
        let decide = |light_image: f32, connections: f32| {
            let mut statistics = EffortStatistics::new(candidates(), 2);
            statistics.add(0, 4.0, &Weight { own: 0.1, light_image, connections });
            statistics.add(7, 1.0, &Weight { own: 0.1, light_image, connections });
            statistics.add(1, f64::NAN, &Weight { own: 0.1, light_image, connections });
            statistics.best(&[(1.0, 1.0), (1.0, 0.5)], &COSTS)
        };
        assert_eq!(decide(0.0, 0.0), Effort { light_image: 0.0625, connections: 0.0625 });
        assert_eq!(decide(0.0, 0.95), Effort { light_image: 0.0625, connections: 1.0 });
        assert_eq!(decide(0.9, 0.0), Effort { light_image: 1.0, connections: 0.0625 });
        // A scene without light teaches nothing.
        assert_eq!(EffortStatistics::new(candidates(), 1).best(&[(0.0, 0.0)], &COSTS), Effort::FULL);
    }

    #[test]
    fn sums_are_saved() {
        let mut one = EffortStatistics::new(candidates(), 2);
        one.add(1, 3.0, &Weight { own: 0.5, light_image: 0.25, connections: 0.25 });
        let mut other = EffortStatistics::new(candidates(), 2);
        assert!(other.restore(&one.sums().collect::<Vec<_>>()));
        assert_eq!(one.regions, other.regions);
        assert!(!other.restore(&[1.0]));
    }
}
