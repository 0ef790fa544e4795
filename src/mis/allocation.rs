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
//! Pixels that share light sub-paths are wrong together, and their mean keeps the error. With C the covariance of two
//! pixels of a region, the mean of its B pixels has the variance (V + (B − 1) C) / B. What is minimised is the mean of
//! the variance of pixels, V, and that of regions as it would be with independent pixels, V + (B − 1) C. From the
//! differences Δ = X₁ − X₂ of m probed pixels of the region, C is estimated by [(Σ Δ)² − Σ Δ²] / (2 m (m − 1)). Where
//! each pixel has a light sub-path of its own, the probes share none, but a candidate lets k pixels share one: then
//! (k − 1) times the variance of connections is taken for (B − 1) C, as if it all came from the light sub-path.
//!
//! Sums are kept by region of the picture, so that each region counts relative to its own brightness.
//!
//! [`SampleAllocation::EYE_ONLY`] leaves little but hits and next event. Its predicted variance is about that of path
//! tracing with the roulette of the probed eye sub-paths, and tells whether path tracing finds the light that
//! connections found.

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
    /// Hits and next event, nearly alone. It is predicted for comparison with path tracing, never chosen. Path tracing
    /// itself is not predicted: light that it cannot find would make its variance infinite.
    pub const EYE_ONLY: SampleAllocation = SampleAllocation { light_image: 1e-3, connections: 1e-3 };

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

/// The sample of a pixel as it would be at another allocation, as far as it is not left to chance.
struct PredictedSample {
    all: [f64; 3],
    connections: [f64; 3],
    /// Sum of the squares of its contributions.
    squares: f64,
}

impl PredictedSample {
    fn new(allocation: &SampleAllocation, contributions: &[WeightedContribution]) -> PredictedSample {
        let mut sample = PredictedSample { all: [0.0; 3], connections: [0.0; 3], squares: 0.0 };
        for c in contributions.iter().filter(|c| c.is_finite()) {
            let present = if c.connection { f64::from(allocation.connections) } else { 1.0 };
            let scale = present / allocation.density_ratio(&c.weight);
            let value = c.value.to_array().map(|v| f64::from(v) * scale);
            sample.squares += square(value);
            (0..3).for_each(|i| sample.all[i] += value[i]);
            if c.connection {
                (0..3).for_each(|i| sample.connections[i] += value[i]);
            }
        }
        sample
    }

    /// Twice the pixel's variance less the squares of its contributions, of both iterations together. The first
    /// iteration's sample waits in `first`.
    fn increase(&self, second: bool, first: &mut PixelSample, differences: &mut Differences) -> f64 {
        if !second {
            *first = PixelSample { all: self.all.map(|v| v as f32), connections: self.connections.map(|v| v as f32) };
            return -self.squares;
        }
        let difference = |a: &[f64; 3], b: &[f32; 3]| std::array::from_fn(|i| a[i] - f64::from(b[i]));
        let all: [f64; 3] = difference(&self.all, &first.all);
        (0..3).for_each(|i| differences.sum[i] += all[i]);
        differences.squares += square(all);
        differences.connection_squares += square(difference(&self.connections, &first.connections));
        // Twice ½ (X₁ − X₂)², since there are two samples.
        square(all) - self.squares
    }
}

/// The samples of a region at full allocation.
#[derive(Clone, Copy, Debug)]
pub struct RegionVariance {
    /// Number of pixels.
    pub pixels: f64,
    /// Sum over samples of their variance.
    pub variance: f64,
    /// Square of their mean.
    pub mean2: f64,
}

/// Divisors of the regions' variances: the square of the region's mean, and a share of the mean over all regions.
fn scales(variances: &[RegionVariance]) -> impl Iterator<Item = f64> {
    let overall = variances.iter().map(|v| v.mean2).sum::<f64>() / variances.len().max(1) as f64;
    variances.iter().map(move |v| v.mean2 + 0.01 * overall)
}

/// Errors of an iteration as the probes predict them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProbedErrors {
    /// Relative variance at the chosen allocation, the mean of pixels and of regions, summed over pixels.
    pub variance: f64,
    /// As much at [`SampleAllocation::EYE_ONLY`], if that is one of the candidates.
    pub eye_only: Option<f64>,
    /// The divisor of each region's variance, in squared radiance.
    pub scales: Vec<f64>,
}

/// Estimates from samples at full allocation, for each region of the picture and every candidate, by how much the
/// candidate would increase the variance.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EfficiencyEstimator {
    candidates: Vec<SampleAllocation>,
    /// For each region and candidate.
    increases: Vec<f64>,
    /// For each probed pixel, every candidate and full allocation, the sample of the first iteration.
    first: Vec<PixelSample>,
    /// For each region, its probed pixels.
    probed: Vec<u32>,
    /// For each region and candidate.
    differences: Vec<Differences>,
    /// How pixels come to share light sub-paths.
    sharing: LightSharing,
}

/// How the pixels of a region come to share light sub-paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LightSharing {
    /// All eye vertices are connected to the light sub-paths of the iteration: probes show what this does.
    OfIteration,
    /// With a light image of 1/k, k pixels of a region have one sub-path together.
    OfPixels,
}

/// A pixel's sample at some allocation.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct PixelSample {
    all: [f32; 3],
    connections: [f32; 3],
}

/// Differences Δ of two samples of the pixels of a region.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Differences {
    sum: [f64; 3],
    squares: f64,
    /// Σ Δ² of connections alone.
    connection_squares: f64,
}

impl Differences {
    /// C, from the differences of `pixels` pixels.
    fn covariance(&self, pixels: u32) -> f64 {
        let pairs = f64::from(pixels) * (f64::from(pixels) - 1.0);
        if pairs > 0.0 { (square(self.sum) - self.squares) / (2.0 * pairs) } else { 0.0 }
    }
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
    pub fn new(
        candidates: Vec<SampleAllocation>,
        regions: usize,
        pixels: usize,
        sharing: LightSharing,
    ) -> EfficiencyEstimator {
        let n = candidates.len();
        EfficiencyEstimator {
            candidates,
            increases: vec![0.0; regions * n],
            first: vec![PixelSample::default(); pixels * (n + 1)],
            probed: vec![0; regions],
            differences: vec![Differences::default(); regions * n],
            sharing,
        }
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
        let (Some(increases), Some(first), Some(differences)) = (
            self.increases.get_mut(region * n..(region + 1) * n),
            self.first.get_mut(pixel * (n + 1)..(pixel + 1) * (n + 1)),
            self.differences.get_mut(region * n..(region + 1) * n),
        ) else {
            return;
        };
        self.probed[region] += u32::from(second);
        let full = PredictedSample::new(&SampleAllocation::FULL, contributions);
        let full = first.last_mut().map_or(0.0, |first| full.increase(second, first, &mut Differences::default()));
        let of_candidates = increases.iter_mut().zip(&self.candidates).zip(first).zip(differences);
        for (((sum, allocation), first), differences) in of_candidates {
            let sample = PredictedSample::new(allocation, contributions);
            *sum += times * (sample.increase(second, first, differences) - full);
        }
    }

    /// By how much sharing makes the mean of the variances of pixels and regions larger, summed over both samples of
    /// all pixels of a region that has `pixels` of them.
    fn shared_error(&self, region: usize, number: usize, pixels: f64) -> f64 {
        let differences = &self.differences[region * self.candidates.len() + number];
        let probed = self.probed[region];
        match self.sharing {
            LightSharing::OfIteration => pixels * (pixels - 1.0) * differences.covariance(probed),
            LightSharing::OfPixels => {
                let pixels_per_path = 1.0 / f64::from(self.candidates[number].light_image);
                let times = pixels / f64::from(probed.max(1));
                0.5 * (pixels_per_path - 1.0) * times * differences.connection_squares
            }
        }
    }

    /// Relative variance of a candidate, the mean of pixels and of regions, summed over both samples of all pixels. A
    /// share of the mean over all regions keeps dark ones from counting too much.
    fn relative_variance(&self, number: usize, variances: &[RegionVariance]) -> f64 {
        // Paths of hits and next event are independent.
        let shares = self.candidates[number] != SampleAllocation::EYE_ONLY;
        let relative = |(region, (v, scale)): (usize, (&RegionVariance, f64))| {
            let shared = if shares { self.shared_error(region, number, v.pixels) } else { 0.0 };
            let variance = v.variance + self.increases[region * self.candidates.len() + number] + shared;
            // An estimate of a variance from two samples may be negative.
            if scale > 0.0 { variance.max(0.0) / scale } else { 0.0 }
        };
        variances.iter().zip(scales(variances)).enumerate().map(relative).sum()
    }

    /// The candidate with the least product of variance and cost, or of those that are nearly as good the one with most
    /// connections, and its errors.
    pub fn best(&self, variances: &[RegionVariance], costs: &AllocationCosts) -> (SampleAllocation, ProbedErrors) {
        struct Choice {
            allocation: SampleAllocation,
            variance: f64,
            product: f64,
        }
        let choices = self.candidates.iter().enumerate().filter(|(_, a)| **a != SampleAllocation::EYE_ONLY);
        let choices: Vec<Choice> = choices
            .map(|(number, &allocation)| {
                let variance = self.relative_variance(number, variances);
                Choice { allocation, variance, product: variance * allocation.cost(costs) }
            })
            .collect();
        let least = choices.iter().map(|c| c.product).fold(f64::INFINITY, f64::min);
        let good = choices.iter().filter(|c| c.product <= least / LEAST_GAIN);
        let order = |a: &&Choice, b: &&Choice| {
            a.allocation
                .connections
                .total_cmp(&b.allocation.connections)
                .then(b.product.total_cmp(&a.product))
                .then(a.allocation.light_image.total_cmp(&b.allocation.light_image))
        };
        let eye_only = self.candidates.iter().position(|a| *a == SampleAllocation::EYE_ONLY);
        let (allocation, variance) =
            good.max_by(order).map_or((SampleAllocation::FULL, 0.0), |c| (c.allocation, c.variance));
        let errors = ProbedErrors {
            variance: 0.5 * variance,
            eye_only: eye_only.map(|number| 0.5 * self.relative_variance(number, variances)),
            scales: scales(variances).collect(),
        };
        (allocation, errors)
    }

    /// True if the sums are of these candidates, as many regions and as many probed pixels: a saved state can be of
    /// another render.
    pub fn fits(&self, candidates: &[SampleAllocation], regions: usize) -> bool {
        self.candidates == candidates
            && self.increases.len() == regions * candidates.len()
            && self.first.len().is_multiple_of(candidates.len() + 1)
            && self.probed.len() == regions
            && self.differences.len() == self.increases.len()
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
        let mut statistics = EfficiencyEstimator::new(candidates(), 1, 1, LightSharing::OfIteration);
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
        let mut statistics = EfficiencyEstimator::new(candidates(), 1, 1, LightSharing::OfIteration);
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
            let mut statistics = EfficiencyEstimator::new(candidates(), 2, 0, LightSharing::OfIteration);
            statistics.add(0, &contribution_of(2.0, weight), 1.0);
            statistics.add(7, &contribution_of(1.0, weight), 1.0);
            statistics.add(1, &contribution_of(f32::NAN, weight), 1.0);
            let region = |mean2| RegionVariance { pixels: 1.0, variance: 1.0, mean2 };
            statistics.best(&[region(1.0), region(0.5)], &COSTS).0
        };
        assert_eq!(decide(0.0, 0.0), SampleAllocation { light_image: 0.0625, connections: 0.0625 });
        assert_eq!(decide(0.0, 0.95), SampleAllocation { light_image: 0.0625, connections: 1.0 });
        assert_eq!(decide(0.9, 0.0), SampleAllocation { light_image: 1.0, connections: 0.0625 });
        // In a scene without light there is nothing to decide.
        assert_eq!(
            EfficiencyEstimator::new(candidates(), 1, 0, LightSharing::OfIteration)
                .best(&[RegionVariance { pixels: 1.0, variance: 0.0, mean2: 0.0 }], &COSTS)
                .0,
            SampleAllocation::FULL
        );
    }

    /// Samples of a region of many pixels that are the sum of a part of their own and one that all share, which is a
    /// connection: its variance is found as a covariance, and falls with the square of the share of connections.
    #[test]
    fn the_covariance_of_pixels_is_found() {
        const PIXELS: usize = 64;
        const REGIONS: usize = 4000;
        let mut rng = HashRng::new(5, 6, 7, 8);
        let mut estimator = EfficiencyEstimator::new(candidates(), REGIONS, PIXELS, LightSharing::OfIteration);
        let eye = MisWeight { own: 1.0, light_image: 0.0, connections: 0.0 };
        let connected = MisWeight { own: 0.5, light_image: 0.0, connections: 0.5 };
        for region in 0..REGIONS {
            for second in [false, true] {
                let shared = rng.next_f32();
                for pixel in 0..PIXELS {
                    let own = contribution_of(rng.next_f32(), eye);
                    let shared = WeightedContribution { connection: true, ..contribution_of(shared, connected) };
                    estimator.add_sample(Probe { region, pixel, second }, &[own, shared], 1.0);
                }
            }
        }
        for (number, allocation) in candidates().iter().enumerate() {
            let each = estimator.differences.iter().skip(number).step_by(candidates().len());
            let mean = each.map(|d| d.covariance(PIXELS as u32)).sum::<f64>() / REGIONS as f64;
            let p = f64::from(allocation.connections);
            let expected = (p / (1.0 - 0.5 * (1.0 - p))).powi(2) / 12.0;
            assert!((mean / expected - 1.0).abs() < 0.1, "{allocation:?}: {mean} {expected}");
            // Twice for two samples, half for the mean of pixels and regions.
            let all: f64 = (0..REGIONS).map(|r| estimator.shared_error(r, number, PIXELS as f64)).sum();
            let expected = expected * (PIXELS * (PIXELS - 1)) as f64;
            assert!((all / REGIONS as f64 / expected - 1.0).abs() < 0.1, "{allocation:?}: {all}");
        }
    }

    /// Connections that cost little and are shared by all pixels of a region are kept where pixels count alone, and
    /// left to other techniques where regions count too.
    #[test]
    fn light_sub_paths_of_several_pixels_count_as_shared() {
        let decide = |sharing: LightSharing| {
            let mut statistics = EfficiencyEstimator::new(candidates(), 1, 2, sharing);
            let weight = MisWeight { own: 1.0, light_image: 0.0, connections: 1.0 };
            for (pixel, values) in [[0.0, 2.0], [2.0, 0.0]].into_iter().enumerate() {
                for (second, value) in [(false, values[0]), (true, values[1])] {
                    let c = WeightedContribution { connection: true, ..contribution_of(value, weight) };
                    statistics.add(0, &c, 1.0);
                    statistics.add_sample(Probe { region: 0, pixel, second }, &[c], 1.0);
                }
            }
            statistics.best(&[RegionVariance { pixels: 2.0, variance: 8.0, mean2: 1.0 }], &COSTS).0.light_image
        };
        assert_eq!(decide(LightSharing::OfPixels), 1.0);
        assert_eq!(decide(LightSharing::OfIteration), 0.0625);
    }

    #[test]
    fn a_state_of_another_render_does_not_fit() {
        let one = EfficiencyEstimator::new(candidates(), 2, 3, LightSharing::OfIteration);
        assert!(one.fits(&candidates(), 2));
        assert!(!one.fits(&candidates(), 3) && !one.fits(&candidates()[1..], 2));
    }
}
