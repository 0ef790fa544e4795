//! What happens between iterations: light sub-paths are traced, probabilities found, normalisations learnt, states restored.

use super::caches::Caches;
use super::combined::{CombinedPmfs, Draws, DrawsFrom};
use super::learnt::Learnt;
use super::places::{AtCaches, AtSites, Places};
use super::pmfs::Pmfs;
use super::resampler::Resampler;
use super::sites::Sites;
use super::store::LightStore;
use super::{Scheme, Settings, Weights};
use crate::integrators::Iteration;
use crate::integrators::bdpt::{Bidirectional, Piece};
use crate::ray::{Phases, RayKind, RayStats};

/// Sets of light sub-paths that estimate normalisations before the first iteration.
const WARM_UP: u64 = 4;
/// √(B/A) of [`best_number`].
const WORTH: f64 = 36.0;
/// What a ray of an eye sub-path costs with all that belongs to it, and a light vertex besides its ray, in rays of light sub-paths.
const EYE_COST: f64 = 3.5;
const VERTEX_COST: f64 = 2.0;
/// Bounds of what it finds, unless the picture has fewer pixels.
const BY_COST: [f64; 2] = [1000.0, 100_000.0];
/// Light sub-paths of one of these sets, at most.
const WARM_UP_PATHS: u32 = 4000;

/// M₁ by what sub-paths cost. The variance of a picture falls with it as A + B/M₁ while the cost of an iteration grows as P e + M₁ l, where
/// each of P eye sub-paths costs e and a light sub-path l. Their product is least at M₁ = √(B/A · P e/l).
fn best_number(pixels: f64, eye: f64, light: f64) -> u32 {
    let best = WORTH * (pixels * eye / light.max(f64::MIN_POSITIVE)).sqrt();
    // Where light sub-paths end at once, or nothing is known of them, the number is a bound's.
    best.clamp(BY_COST[0], BY_COST[1]).min(pixels).max(1.0) as u32
}

/// Rays of some kinds.
fn rays(stats: &RayStats, kinds: &[RayKind]) -> f64 {
    kinds.iter().map(|k| stats.kinds[*k as usize].rays as f64).sum()
}

impl Bidirectional {
    /// Connections are resampled from now on.
    pub(in crate::integrators) fn resample(&mut self, settings: Settings) {
        self.connects &= settings.samples == 0;
        self.resampler = Some(Resampler::new(settings));
    }

    /// Connections of this iteration are drawn from light sub-paths that are traced before.
    pub(in crate::integrators) fn resamples(&self) -> bool {
        self.resampler.is_some() && self.weigher.techniques.uses_connections() && self.weigher.eye_limits.max_edges >= 3
    }

    /// Places to know light at and what is found there before the first iteration, once; they are functions of scene and seed alone.
    fn place(&mut self, iteration: &Iteration, stats: &mut RayStats) {
        let Some(resampler) = &self.resampler else { return };
        let (settings, mut seen) = (resampler.settings, [0; 2]);
        let (places, paths) = match settings.scheme {
            Scheme::Caches => {
                let (at, paths) = self.place_caches(iteration, &settings, &mut seen, stats);
                (Places::Caches(Box::new(at)), paths)
            }
            Scheme::Records(draws) | Scheme::Skeleton { draws, .. } => {
                let at = self.place_sites(iteration, &settings, draws, &mut seen, stats);
                (Places::Sites(Box::new(at)), settings.paths)
            }
        };
        if let Some(resampler) = &mut self.resampler {
            (resampler.places, resampler.seen, resampler.settings.paths) = (places, seen, paths);
        }
    }

    /// Cache points with first normalisations, the number of light sub-paths of iterations and, in `seen`, what has been seen of light sub-paths.
    fn place_caches(
        &self,
        iteration: &Iteration,
        settings: &Settings,
        seen: &mut [u64; 2],
        stats: &mut RayStats,
    ) -> (AtCaches, u32) {
        let scene = iteration.scene;
        let &Settings { cache_fraction, second_stage, paths, .. } = settings;
        let clusters = second_stage.map(|m2| m2 as usize);
        let (mut caches, s) = Caches::new(scene, iteration.seed, settings, &self.weigher.eye_limits);
        stats.merge(&s);
        let pixels = f64::from(scene.film_size[0]) * f64::from(scene.film_size[1]);
        let eye_rays = rays(&s, &[RayKind::Cache]) / (pixels * cache_fraction).max(1.0);
        let warm_up_paths = if paths > 0 { paths } else { pixels as u32 }.min(WARM_UP_PATHS);
        let first = Iteration { index: 0, ..*iteration };
        let (mut pmfs, mut light_rays) = (Pmfs::default(), 0.0);
        for set in 1..=WARM_UP {
            let (store, s) = LightStore::trace(self, &first, (warm_up_paths, set), clusters.is_some());
            stats.merge(&s);
            light_rays += rays(&s, &[RayKind::Light, RayKind::LightBounce]);
            // Random numbers of iterations count from zero up, those of warm-ups from the top down.
            stats.merge(&pmfs.find(scene, &caches, &store, clusters, (iteration.seed, u64::MAX - set)));
            caches.learn(pmfs.found());
            *seen = [seen[0] + store.len() as u64, seen[1] + u64::from(store.paths_traced)];
        }
        let paths = match paths {
            0 => {
                let light = (light_rays + VERTEX_COST * seen[0] as f64) / seen[1].max(1) as f64;
                best_number(pixels, EYE_COST * eye_rays, light)
            }
            _ => paths,
        };
        (AtCaches { caches, pmfs }, paths)
    }

    /// Sites of importance caching with what they find before the first iteration, if weights ask them.
    fn place_sites(
        &self,
        iteration: &Iteration,
        settings: &Settings,
        draws: Draws,
        seen: &mut [u64; 2],
        stats: &mut RayStats,
    ) -> AtSites {
        let (scene, limits) = (iteration.scene, &self.weigher.eye_limits);
        let (sites, s) = match settings.scheme {
            Scheme::Skeleton { cells, acceptance, .. } => {
                Sites::nodes(scene, iteration.seed, cells, acceptance, limits)
            }
            _ => Sites::records(scene, iteration.seed, settings.cache_fraction, limits),
        };
        stats.merge(&s);
        let (mut learnt, mut lengths) = (Learnt::default(), vec![]);
        let first = Iteration { index: 0, ..*iteration };
        if draws.from == DrawsFrom::Lengths {
            let (store, s) = LightStore::trace(self, &first, (WARM_UP_PATHS, 1), false);
            stats.merge(&s);
            // A length that was not met is not impossible.
            lengths = store.lengths().iter().map(|&n| (n as f32).max(0.5) / WARM_UP_PATHS as f32).collect();
        }
        if settings.weights != Weights::Balance {
            for set in 1..=WARM_UP {
                let paths = settings.paths.min(WARM_UP_PATHS);
                let (store, s) = LightStore::trace(self, &first, (paths, set), false);
                stats.merge(&s);
                let mut combined = CombinedPmfs::default();
                stats.merge(&combined.find(scene, &sites, &store, draws));
                learnt.learn(&combined);
                *seen = [seen[0] + store.len() as u64, seen[1] + u64::from(store.paths_traced)];
            }
        }
        AtSites { sites, draws, combined: CombinedPmfs::default(), learnt, lengths }
    }

    /// Gets the candidates of an iteration ready. All its light sub-paths are traced, and what the lens sees of them is brought back:
    /// those to draw from are the first of them.
    pub(in crate::integrators) fn prepare_resampling(&mut self, iteration: &Iteration) -> (RayStats, Vec<Piece>) {
        let (mut stats, mut phases) = (RayStats::default(), Phases::default());
        if self.resampler.as_ref().is_some_and(|r| matches!(r.places, Places::None)) {
            phases.time("placing caches", || self.place(iteration, &mut stats));
        }
        let Some(resampler) = &mut self.resampler else { return (stats, vec![]) };
        (self.weigher.resampled, self.weigher.lengths) = (resampler.resampled(), resampler.by_length());
        let Settings { second_stage, paths, .. } = resampler.settings;
        let mut store = std::mem::take(&mut resampler.store);
        let pieces = phases.time("light paths", || self.light_pass(iteration, paths, &mut store));
        phases.time("light tree", || store.finish(paths, second_stage.is_some()));
        let Some(resampler) = &mut self.resampler else { return (stats, pieces) };
        resampler.store = store;
        let (scene, store) = (iteration.scene, &resampler.store);
        stats.merge(&phases.time("pmfs", || match &mut resampler.places {
            Places::None => RayStats::default(),
            Places::Caches(at) => {
                let random = (iteration.seed, iteration.index);
                at.pmfs.find(scene, &at.caches, store, second_stage.map(|m2| m2 as usize), random)
            }
            Places::Sites(at) => at.combined.find(scene, &at.sites, store, at.draws),
        }));
        stats.phases.merge(&phases);
        (stats, pieces)
    }

    /// Gets the candidates of an iteration ready as they were when it was rendered; once for any number of pixels.
    pub(in crate::integrators) fn prepare_replay(&mut self, iteration: &Iteration) {
        let Some(resampler) = &mut self.resampler else { return };
        let wanted = (iteration.seed, iteration.index);
        if resampler.ready == Some(wanted) {
            return;
        }
        *resampler = Resampler::new(resampler.settings);
        if !self.resamples() {
            return;
        }
        // What an iteration knows comes from those before it.
        for index in 0..iteration.index {
            self.prepare_resampling(&Iteration { index, ..*iteration });
            self.learn();
        }
        self.prepare_resampling(iteration);
        if let Some(resampler) = &mut self.resampler {
            resampler.ready = Some(wanted);
        }
    }

    /// The iteration is over: what it found may now be known.
    pub(in crate::integrators) fn learn(&mut self) {
        let Some(resampler) = &mut self.resampler else { return };
        match &mut resampler.places {
            Places::Caches(at) => at.caches.learn(at.pmfs.found()),
            Places::Sites(at) if resampler.settings.weights != Weights::Balance => at.learnt.learn(&at.combined),
            Places::Sites(_) | Places::None => return,
        }
        resampler.seen[0] += resampler.store.len() as u64;
        resampler.seen[1] += u64::from(resampler.store.paths_traced);
    }

    /// Goes on from a saved state.
    pub(in crate::integrators) fn restore_resampling(&mut self, iteration: &Iteration, bytes: &[u8]) -> bool {
        let mut words = bytes.chunks_exact(8).map(|c| u64::from_le_bytes(c.try_into().unwrap_or_default()));
        // Rays that place caches belong to the first iteration, whose costs are known already.
        self.place(iteration, &mut RayStats::default());
        let (Some(iterations), Some(vertices), Some(paths)) = (words.next(), words.next(), words.next()) else {
            return bytes.is_empty();
        };
        let sums: Vec<f64> = words.map(f64::from_bits).collect();
        let Some(resampler) = &mut self.resampler else { return false };
        resampler.seen = [vertices, paths];
        resampler.places.restore(&sums, iterations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_number_has_the_least_product_of_variance_and_cost() {
        let (pixels, eye, light) = (1e5, 5.0, 8.0);
        let product = |m: f64| (1.0 + WORTH * WORTH / m) * (pixels * eye + m * light);
        let best = f64::from(best_number(pixels, eye, light));
        assert!((BY_COST[0]..BY_COST[1]).contains(&best));
        assert!([0.9, 1.1].iter().all(|f| product(best) < product(best * f)), "{best}");
    }

    #[test]
    fn it_has_bounds_whatever_is_known() {
        assert_eq!(best_number(40.0, 5.0, 8.0), 40);
        assert_eq!(best_number(2000.0, 0.0, 8.0), 1000);
        assert_eq!(best_number(1e9, 5.0, 0.0), 100_000);
        assert_eq!(best_number(1e9, 0.0, 0.0), 1000);
    }
}
