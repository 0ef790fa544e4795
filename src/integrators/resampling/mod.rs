//! Resampled connections: many light sub-paths are traced once per iteration, and every eye vertex is connected to the one that
//! matters for it (probabilistic connections, Popov et al. 2015; resampling-aware weights, Nabata et al. 2020).
//!
//! All vertices of M light sub-paths are candidates. At cache points (`caches.rs`) each has a probability proportional to
//! what it brings there, visibility included. An eye vertex z draws from the mixture
//!
//! P(y | z) = Σ_i P_i(y) / (n + 1) + 1 / ((n + 1) V)
//!
//! of the n nearest cache points and a uniform share over all V vertices, and estimates its connections (s ≥ 2, all s at once) by
//!
//! w f / (N M p(ȳ) p(z̄) P(y | z))   for each of N draws (eq. 6 there, with the mixture as its one pmf).
//!
//! P is positive wherever f is, and p(ȳ)⁻¹ = β_L / f_y, so any weights that sum to one per path make this unbiased. `pcbpt` takes the
//! weights of bidirectional path tracing; `ris` those that know how resampling changes the density (`mis::resampled`). These ask for
//! the irradiance Q, whose estimate comes from earlier iterations only, the first of them untallied.

pub(in crate::integrators) mod caches;
pub(in crate::integrators) mod store;

use super::bdpt::eye_path::Candidate;
use super::bdpt::{Bidirectional, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH, TECHNIQUES};
use super::{IntegratorSpec, Iteration, ParamDefault, ParamSpec, Params};
use crate::math::Vec3;
use crate::mis::{Heuristic, Resampled, Weigher};
use crate::ray::{Phases, RayStats};
use crate::shade::SurfacePoint;
use caches::{Caches, Pmfs};
use store::LightStore;

const PATHS: ParamSpec = ParamSpec {
    name: "paths",
    about: "M, light sub-paths per iteration from which eye vertices draw",
    default: ParamDefault::Int(200, 1, 10_000_000),
};
const SAMPLES: ParamSpec =
    ParamSpec { name: "samples", about: "N, draws of each eye vertex", default: ParamDefault::Int(1, 1, 1024) };
const NEIGHBOURS: ParamSpec = ParamSpec {
    name: "neighbours",
    about: "cache points whose probabilities an eye vertex mixes",
    default: ParamDefault::Int(3, 0, 3),
};
const CACHES: ParamSpec = ParamSpec {
    name: "caches",
    about: "eye sub-paths that make cache points, per 100 000 pixels",
    default: ParamDefault::Int(400, 0, 100_000),
};
const EPSILON: ParamSpec = ParamSpec {
    name: "epsilon",
    about: "smallest ratio of densities p/q that weights use, in millionths",
    default: ParamDefault::Int(1000, 1, 1_000_000),
};
const fn weights(default: &'static str) -> ParamSpec {
    ParamSpec {
        name: "weights",
        about: "balance: as if connections were not resampled; ris: with the density that resampling makes",
        default: ParamDefault::Choice(default, &["balance", "ris"]),
    }
}

/// The parameters of all resampled methods; they differ in the weights they take by default.
const fn parameters(default_weights: &'static str) -> [ParamSpec; 10] {
    [
        MAX_DEPTH,
        RR_DEPTH,
        HIDE_EMITTERS,
        TECHNIQUES,
        PATHS,
        SAMPLES,
        NEIGHBOURS,
        CACHES,
        EPSILON,
        weights(default_weights),
    ]
}

const PCBPT_PARAMS: [ParamSpec; 10] = parameters("balance");
const RIS_PARAMS: [ParamSpec; 10] = parameters("ris");

fn build(params: &Params) -> Box<dyn super::Integrator> {
    let settings = Settings {
        paths: params.int("paths") as u32,
        samples: params.int("samples") as u32,
        neighbours: params.int("neighbours") as usize,
        cache_fraction: params.int("caches") as f64 * 1e-5,
        epsilon: params.int("epsilon") as f32 * 1e-6,
        aware: params.choice("weights") == "ris",
    };
    let mut this = Bidirectional::new(params, Heuristic::Balance, params.techniques("techniques"));
    this.resample(settings);
    Box::new(this)
}

/// The registry's line of `pcbpt`.
pub static PCBPT: IntegratorSpec = IntegratorSpec {
    name: "pcbpt",
    aliases: &[],
    about: "Probabilistic connections: eye vertices draw from many light sub-paths by what these bring to nearby cache points; weights of bidirectional path tracing",
    params: &PCBPT_PARAMS,
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build,
};

/// The registry's line of `ris`.
pub static RIS: IntegratorSpec = IntegratorSpec {
    name: "ris",
    aliases: &["risbpt"],
    about: "Resampled connections with resampling-aware weights (RISBPT): as pcbpt, with weights that know the density which resampling makes",
    params: &RIS_PARAMS,
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build,
};

/// What a user decides.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrators) struct Settings {
    /// M.
    pub paths: u32,
    /// N.
    pub samples: u32,
    /// Cache points that an eye vertex mixes.
    pub neighbours: usize,
    /// Eye sub-paths that make cache points, per pixel.
    pub cache_fraction: f64,
    /// See [`Resampled::epsilon`].
    pub epsilon: f32,
    /// Weights know of the resampling.
    pub aware: bool,
}

/// Sets of light sub-paths that estimate irradiances before the first iteration.
const WARM_UP: u64 = 4;

/// The candidates of an iteration and how to draw from them.
#[derive(Debug)]
pub(in crate::integrators) struct Resampler {
    pub settings: Settings,
    caches: Option<Caches>,
    store: LightStore,
    pmfs: Pmfs,
    /// Irradiances of this iteration, to be learnt at its end.
    pending: Vec<f64>,
    /// Sum over sets of the number of vertices, and of sub-paths.
    seen: [u64; 2],
    /// Seed and iteration that replays are prepared for.
    ready: Option<(u64, u64)>,
}

/// The side of a point's surface on which the direction `d` leaves it.
#[inline]
fn side(point: &SurfacePoint, d: Vec3) -> Vec3 {
    if point.ng.dot(d) < 0.0 { -point.ng } else { point.ng }
}

impl Resampler {
    pub fn new(settings: Settings) -> Resampler {
        Resampler {
            settings,
            caches: None,
            store: LightStore::default(),
            pmfs: Pmfs::default(),
            pending: vec![],
            seen: [0; 2],
            ready: None,
        }
    }

    /// Q at a point, on the side of the direction `d`.
    #[inline]
    pub fn irradiance(&self, point: &SurfacePoint, d: Vec3) -> f32 {
        if !self.settings.aware {
            return 0.0;
        }
        self.caches.as_ref().map_or(0.0, |caches| caches.irradiance(point.p, side(point, d)))
    }

    /// c of a sub-path that brings `brings` to a point from the direction `from`.
    #[inline]
    pub fn factor(&self, weigher: &Weigher, brings: f32, point: &SurfacePoint, from: Vec3) -> f32 {
        match &weigher.resampled {
            None => 1.0,
            Some(resampled) => resampled.factor(brings, self.irradiance(point, from)),
        }
    }

    /// What weights know.
    fn resampled(&self) -> Option<Resampled> {
        let [vertices, paths] = self.seen;
        self.settings.aware.then(|| Resampled {
            paths: self.settings.paths as f32,
            epsilon: self.settings.epsilon,
            uniform: 1.0 / (self.settings.neighbours + 1) as f32,
            vertices_per_path: if paths > 0 { (vertices as f64 / paths as f64) as f32 } else { 0.0 },
        })
    }

    /// Draws a candidate for an eye vertex at `point` that looks from the side of `wo`; `None` if there are none.
    #[inline]
    pub fn draw(&self, point: &SurfacePoint, wo: Vec3, u: [f32; 2]) -> Option<Candidate<'_>> {
        let vertices = self.pmfs.vertices;
        if vertices == 0 {
            return None;
        }
        let uniform = 1.0 / vertices as f32;
        let mut mixed: [Option<&[f32]>; 3] = [None; 3];
        let mut n = 0;
        if let Some(caches) = &self.caches {
            for i in caches.index.find(point.p, side(point, wo)).take(self.settings.neighbours) {
                mixed[n] = self.pmfs.of(i);
                n += 1;
            }
        }
        let share = 1.0 / (n + 1) as f32;
        let chosen = ((u[0] * (n + 1) as f32) as usize).min(n);
        let v = match mixed.get(chosen) {
            Some(Some(cdf)) if chosen < n => cdf.partition_point(|&c| c <= u[1]),
            // A cache point that no light vertex reaches draws uniformly, as the last share does.
            _ => (u[1] * vertices as f32) as usize,
        }
        .min(vertices - 1);
        let mut p = share * uniform;
        for cdf in &mixed[..n] {
            p += share
                * match cdf {
                    Some(cdf) => cdf[v] - if v == 0 { 0.0 } else { cdf[v - 1] },
                    None => uniform,
                };
        }
        let scale = 1.0 / (p * self.settings.paths as f32 * self.settings.samples as f32);
        Some(self.store.candidate(v, scale))
    }

    /// What must be saved to go on later, as bytes.
    pub fn state(&self) -> Vec<u8> {
        let Some(caches) = &self.caches else { return vec![] };
        let (sums, iterations) = caches.state();
        let mut words = vec![iterations, self.seen[0], self.seen[1]];
        words.extend(sums.iter().map(|s| s.to_bits()));
        words.into_iter().flat_map(u64::to_le_bytes).collect()
    }
}

impl Bidirectional {
    /// Connections are resampled from now on.
    pub(in crate::integrators) fn resample(&mut self, settings: Settings) {
        self.weigher.techniques.set_connections(settings.samples as f32);
        self.connects &= settings.samples == 0;
        self.resampler = Some(Resampler::new(settings));
    }

    /// Cache points and first irradiances, once; they are functions of scene and seed alone.
    fn prepare_caches(&mut self, iteration: &Iteration, stats: &mut RayStats) {
        let scene = iteration.scene;
        let Some(resampler) = &mut self.resampler else { return };
        let (mut caches, s) = Caches::new(scene, iteration.seed, resampler.settings.cache_fraction, &self.limits);
        stats.merge(&s);
        let paths = resampler.settings.paths;
        let first = Iteration { index: 0, ..*iteration };
        for set in 1..=WARM_UP {
            let (store, s) = LightStore::trace(self, &first, paths, set);
            stats.merge(&s);
            let (_, irradiances, s) = caches.pmfs(scene, &store);
            stats.merge(&s);
            caches.learn(&irradiances);
            if let Some(resampler) = &mut self.resampler {
                resampler.seen[0] += store.vertices.len() as u64;
                resampler.seen[1] += u64::from(paths);
            }
        }
        if let Some(resampler) = &mut self.resampler {
            resampler.caches = Some(caches);
        }
    }

    /// Gets the candidates of an iteration ready.
    pub(in crate::integrators) fn prepare_resampling(&mut self, iteration: &Iteration) -> RayStats {
        let (mut stats, mut phases) = (RayStats::default(), Phases::default());
        if self.resampler.as_ref().is_none_or(|_| !self.weigher.techniques.uses_connections()) {
            return stats;
        }
        if self.resampler.as_ref().is_some_and(|r| r.caches.is_none()) {
            phases.time("placing caches", || self.prepare_caches(iteration, &mut stats));
        }
        let Some(resampler) = &self.resampler else { return stats };
        self.weigher.resampled = resampler.resampled();
        let paths = resampler.settings.paths;
        let (store, s) = phases.time("light paths", || LightStore::trace(self, iteration, paths, 0));
        stats.merge(&s);
        let Some(resampler) = &mut self.resampler else { return stats };
        if let Some(caches) = &resampler.caches {
            let (pmfs, irradiances, s) = phases.time("pmfs", || caches.pmfs(iteration.scene, &store));
            stats.merge(&s);
            (resampler.pmfs, resampler.pending) = (pmfs, irradiances);
        }
        resampler.store = store;
        stats.phases.merge(&phases);
        stats
    }

    /// Gets the candidates of an iteration ready as they were when it was rendered; once for any number of pixels.
    pub(in crate::integrators) fn prepare_replay(&mut self, iteration: &Iteration) {
        let Some(resampler) = &mut self.resampler else { return };
        let wanted = (iteration.seed, iteration.index);
        if resampler.ready == Some(wanted) {
            return;
        }
        *resampler = Resampler::new(resampler.settings);
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

    /// The iteration is over: its irradiances may now be known.
    pub(in crate::integrators) fn learn(&mut self) {
        if let Some(resampler) = &mut self.resampler
            && let Some(caches) = &mut resampler.caches
        {
            caches.learn(&resampler.pending);
            resampler.seen[0] += resampler.store.vertices.len() as u64;
            resampler.seen[1] += u64::from(resampler.store.paths_traced);
        }
    }

    /// Goes on from a saved state.
    pub(in crate::integrators) fn restore_resampling(&mut self, iteration: &Iteration, bytes: &[u8]) -> bool {
        let mut words = bytes.chunks_exact(8).map(|c| u64::from_le_bytes(c.try_into().unwrap_or_default()));
        let (Some(iterations), Some(vertices), Some(paths)) = (words.next(), words.next(), words.next()) else {
            return bytes.is_empty();
        };
        self.prepare_caches(iteration, &mut RayStats::default());
        match &mut self.resampler {
            Some(resampler) => {
                resampler.seen = [vertices, paths];
                resampler.caches.as_mut().is_some_and(|c| c.restore(words.map(f64::from_bits).collect(), iterations))
            }
            None => false,
        }
    }
}
