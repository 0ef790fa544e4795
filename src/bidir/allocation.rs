//! How many samples of each group of techniques a render takes, decided once from its first iterations.
//!
//! The first two iterations take all samples, and are part of the picture like any other. Their samples tell the cost
//! and the variance of other numbers (`mis::allocation`); the best allocation holds from then on. No group is ever
//! given up: light that the first iterations did not meet could be rare and bright, so that a sixteenth of the
//! connections and a sixteenth or, where they serve the light image only, a sixty-fourth of the light sub-paths always
//! stay. The decision depends on
//! earlier iterations only, so every iteration is unbiased, and on counts of rays instead of times, so it is the same
//! for any machine.

use super::contribution::Contribution;
use crate::film::{Film, FilmTile, TILE};
use crate::mis::allocation::{LightSharing, Probe, RegionVariance, WeightedContribution};
use crate::mis::{AllocationCosts, EfficiencyEstimator, ProbedErrors, SampleAllocation};
use crate::ray::{RayKind, RayStats};
use serde::{Deserialize, Serialize};

/// Every combination of a fraction of the light sub-paths and one of the connections.
pub fn combinations(light_image: &[f32], connections: &[f32]) -> Vec<SampleAllocation> {
    light_image
        .iter()
        .flat_map(|&light_image| {
            connections.iter().map(move |&connections| SampleAllocation { light_image, connections })
        })
        .collect()
}

/// Iterations at full allocation.
const PROBE_ITERATIONS: u64 = 2;
/// Sub-paths that are probed in each of them, about.
const PROBE_SUBPATHS: u32 = 1 << 15;

/// Cost of a ray with the work that belongs to it, in any unit.
#[derive(Clone, Copy, Debug)]
pub struct RayCosts {
    /// Rays of eye sub-paths and of next event.
    pub eye: f64,
    /// Rays of light sub-paths and to the lens.
    pub light: f64,
    /// Connections with their weights.
    pub connection: f64,
}

impl RayCosts {
    /// Connections to the pixel's own light sub-path, measured in ten scenes.
    pub const OWN_SUBPATH: RayCosts = RayCosts { eye: 1.0, light: 1.2, connection: 0.7 };
    /// Connections drawn from many light sub-paths, measured in ten scenes.
    pub const SHARED_SUBPATHS: RayCosts = RayCosts { eye: 1.0, light: 1.2, connection: 1.0 };
}

/// Costs of rays, with the work that belongs to them, in an iteration of a method whose weights count connections. The
/// unit is the cost of a ray of path tracing. Fitted to the times of seven scenes, within about a third.
mod iteration_costs {
    /// Rays of eye sub-paths and of next event.
    pub const EYE: f64 = 1.7;
    /// Rays of light sub-paths and to the lens.
    pub const LIGHT: f64 = 1.5;
    /// Connections with their weights.
    pub const CONNECTION: f64 = 1.2;
    /// Shadow rays of weights.
    pub const WEIGHT: f64 = 0.9;
    /// Shadow rays of pmfs.
    pub const PMF: f64 = 0.4;
}

/// Error and cost of an iteration at the allocation that was decided.
#[derive(Clone, Debug)]
pub struct ProbedEfficiency {
    /// Errors.
    pub errors: ProbedErrors,
    /// Cost, in rays of path tracing.
    pub cost: f64,
}

impl ProbedEfficiency {
    /// Relative variance times cost: the less the better.
    pub fn product(&self) -> f64 {
        self.errors.variance * self.cost
    }
}

/// The samples of the first iterations, and the decision.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct AllocationState {
    estimator: Option<EfficiencyEstimator>,
    costs: AllocationCosts,
    /// Probing iterations so far.
    probed: u64,
    decided: Option<SampleAllocation>,
}

/// Decides the allocation of a render.
#[derive(Debug)]
pub struct AllocationOptimizer {
    candidates: Vec<SampleAllocation>,
    ray_costs: RayCosts,
    sharing: LightSharing,
    state: AllocationState,
    /// From the decision on, until it is asked for.
    efficiency: Option<ProbedEfficiency>,
}

/// The contributions of an iteration to probed sub-paths.
pub struct ProbedIteration<'a> {
    /// The film, the iteration included.
    pub film: &'a Film,
    /// Number of iterations in the film.
    pub iterations: u64,
    /// Size of the full picture.
    pub film_size: [u32; 2],
    /// Visible contributions of every n-th sub-path.
    pub contributions: &'a [Vec<Contribution>],
    /// n.
    pub stride: u32,
    /// Rays of the iteration.
    pub stats: &'a RayStats,
    /// Light sub-paths that eye vertices are connected to, over the number of those with splats at full allocation.
    pub stored_fraction: f32,
}

impl AllocationOptimizer {
    /// Undecided among `candidates`.
    pub fn new(candidates: Vec<SampleAllocation>, ray_costs: RayCosts, sharing: LightSharing) -> AllocationOptimizer {
        let state = AllocationState { estimator: None, costs: AllocationCosts::default(), probed: 0, decided: None };
        AllocationOptimizer { candidates, ray_costs, sharing, state, efficiency: None }
    }

    /// Predicts also how techniques without light sub-paths would do alone.
    #[must_use]
    pub fn predicting_eye_only(mut self) -> AllocationOptimizer {
        self.candidates.push(SampleAllocation::EYE_ONLY);
        self
    }

    /// Error and cost of later iterations, once after the decision.
    pub fn take_efficiency(&mut self) -> Option<ProbedEfficiency> {
        self.efficiency.take()
    }

    /// The allocation of iteration `index`.
    pub fn allocation(&self, index: u64) -> SampleAllocation {
        match self.state.decided {
            Some(allocation) if index >= PROBE_ITERATIONS => allocation,
            _ => SampleAllocation::FULL,
        }
    }

    /// If iteration `index` is one of the first: contributions of every n-th sub-path are wanted.
    pub fn probe_stride(&self, index: u64, sub_paths: u32) -> Option<u32> {
        let probes = self.state.decided.is_none() && index < PROBE_ITERATIONS;
        probes.then(|| sub_paths.div_ceil(PROBE_SUBPATHS).max(1))
    }

    /// Iterations that must have been probed before iteration `index` can be repeated.
    pub fn missing(&self, index: u64) -> u64 {
        if self.state.decided.is_none() { index.min(PROBE_ITERATIONS) } else { 0 }
    }

    /// Adds one of the first iterations. Decides after the last.
    pub fn learn(&mut self, probed: &ProbedIteration) {
        self.add_contributions(probed);
        let (state, each, stats) = (&mut self.state, self.ray_costs, probed.stats);
        state.costs.base +=
            each.eye * stats.rays_with_masks(&[RayKind::Camera, RayKind::Bounce, RayKind::ShadowDirect]);
        state.costs.light_image +=
            each.light * stats.rays_with_masks(&[RayKind::Light, RayKind::LightBounce, RayKind::ShadowLens]);
        state.costs.connections += each.connection * stats.rays_with_masks(&[RayKind::ShadowConnection]);
        state.probed += 1;
        if state.probed == PROBE_ITERATIONS && probed.iterations == PROBE_ITERATIONS {
            let variances = variances(probed.film, probed.iterations);
            if let Some((allocation, errors)) = state.estimator.take().map(|e| e.best(&variances, &state.costs)) {
                state.decided = Some(allocation);
                self.efficiency = Some(ProbedEfficiency { errors, cost: iteration_cost(probed, &allocation) });
            }
        }
    }

    fn add_contributions(&mut self, probed: &ProbedIteration) {
        let ProbedIteration { film, film_size, contributions, stride, .. } = *probed;
        let columns = film.width.div_ceil(TILE);
        let pixels = (film_size[0] * film_size[1]).div_ceil(stride);
        let (candidates, sharing) = (&self.candidates, self.sharing);
        let estimator = self.state.estimator.get_or_insert_with(|| {
            EfficiencyEstimator::new(candidates.clone(), film.tiles.len(), pixels as usize, sharing)
        });
        let region_of = |(x, y): (u32, u32)| {
            let (x, y) = (x.wrapping_sub(film.x0), y.wrapping_sub(film.y0));
            (x < film.width && y < film.height).then(|| (y / TILE * columns + x / TILE) as usize)
        };
        let (mut of_pixels, times) = (vec![], f64::from(stride));
        for c in contributions.iter().flatten() {
            let Some(region) = region_of((c.x, c.y)) else { continue };
            let weighted = WeightedContribution { value: c.weighted(), weight: c.weight, connection: c.s >= 2 };
            estimator.add(region, &weighted, times);
            if c.t >= 2 {
                of_pixels.push((c.y * film_size[0] + c.x, weighted));
            }
        }
        // A stable sort keeps the order in which they were found, so that sums have the same bits.
        of_pixels.sort_by_key(|(pixel, _)| *pixel);
        let mut of_pixels = of_pixels.chunk_by(|(a, _), (b, _)| a == b).peekable();
        for number in 0..pixels {
            let pixel = number * stride;
            let contributions: Vec<WeightedContribution> = of_pixels
                .next_if(|sample| sample[0].0 == pixel)
                .map_or(vec![], |sample| sample.iter().map(|(_, c)| *c).collect());
            if let Some(region) = region_of((pixel % film_size[0], pixel / film_size[0])) {
                let probe = Probe { region, pixel: number as usize, second: self.state.probed > 0 };
                estimator.add_sample(probe, &contributions, times);
            }
        }
    }

    /// The decision, for people.
    pub fn note(&self) -> Option<String> {
        let SampleAllocation { light_image, connections } = self.state.decided?;
        Some(format!("samples of the light image x {light_image}, of connections x {connections}"))
    }

    /// The state that must be saved to go on later.
    pub fn save(&self) -> impl Serialize + '_ {
        &self.state
    }

    /// Goes on from a saved state of a film with so many tiles; false if it is of something else.
    pub fn restore(&mut self, state: SavedAllocation, tiles: usize) -> bool {
        let SavedAllocation(state) = state;
        let fits = state.estimator.as_ref().is_none_or(|e| e.fits(&self.candidates, tiles));
        if fits {
            self.state = state;
        }
        fits
    }
}

/// A saved state of an [`AllocationOptimizer`].
#[derive(Debug, Deserialize)]
#[serde(transparent)]
pub struct SavedAllocation(AllocationState);

/// Cost of an iteration at an allocation, from the rays of a later iteration than the first at full allocation.
fn iteration_cost(probed: &ProbedIteration, allocation: &SampleAllocation) -> f64 {
    use iteration_costs::{CONNECTION, EYE, LIGHT, PMF, WEIGHT};
    let rays = |kinds: &[RayKind]| probed.stats.rays_with_masks(kinds);
    let light = f64::from(allocation.light_image.max(probed.stored_fraction.min(1.0)));
    EYE * rays(&[RayKind::Camera, RayKind::Bounce, RayKind::ShadowDirect])
        + LIGHT * light * rays(&[RayKind::Light, RayKind::LightBounce, RayKind::ShadowLens])
        + CONNECTION * f64::from(allocation.connections) * rays(&[RayKind::ShadowConnection])
        + WEIGHT * rays(&[RayKind::ShadowWeight])
        + PMF * rays(&[RayKind::ShadowPmf])
}

/// The samples of each tile.
fn variances(film: &Film, iterations: u64) -> Vec<RegionVariance> {
    let n = iterations as f64;
    let region = |tile: &FilmTile| {
        let pixels = f64::from(tile.pixels());
        let mean = tile.sums.iter().flatten().sum::<f64>() / (3.0 * n * pixels);
        RegionVariance { pixels, variance: n * tile.sample_variance(iterations), mean2: mean * mean }
    };
    film.tiles.iter().map(region).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_survives_saving() {
        let candidates = combinations(&[1.0, 0.25], &[1.0, 0.5]);
        let mut one = AllocationOptimizer::new(candidates.clone(), RayCosts::OWN_SUBPATH, LightSharing::OfPixels);
        one.state.costs.base = 3.0;
        one.state.probed = 1;
        one.state.estimator = Some(EfficiencyEstimator::new(candidates.clone(), 4, 7, LightSharing::OfPixels));
        let bytes = postcard::to_allocvec(&one.save()).unwrap();
        let mut other = AllocationOptimizer::new(candidates, RayCosts::OWN_SUBPATH, LightSharing::OfPixels);
        assert!(!other.restore(postcard::from_bytes(&bytes).unwrap(), 5), "of another film");
        assert!(other.restore(postcard::from_bytes(&bytes).unwrap(), 4));
        assert_eq!(postcard::to_allocvec(&other.save()).unwrap(), bytes);
    }
}
