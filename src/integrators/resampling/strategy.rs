//! Connections drawn by the pmfs at the cache points near an eye vertex.
//!
//! All vertices of M light sub-paths are candidates. At cache points (`cache_points`) each has a probability
//! proportional to the light that it brings there, visibility included (`pmfs`). An eye vertex z draws from the mixture
//!
//! P(y | z) = Σ_i P_i(y) / (n + 1) + 1 / ((n + 1) V)
//!
//! of the n nearest cache points and a uniform component over all V vertices, and estimates its connections (s ≥ 2, all
//! s at once) by
//!
//! w f / (N M p(ȳ) p(z̄) P(y | z))   for each of N draws (Nabata et al. 2020, "Resampling-aware weighting functions",
//! eq. 6).
//!
//! DEVIATION: eq. 6 there has the pmf of one of n + 1 techniques, each with a weight of its own
//! (`proposal_model=per-cache`). The mixture is one technique with one pmf, which is positive wherever f is, so that
//! any weights that sum to one per path make the estimate unbiased.
//!
//! With two stages, pmfs are of M₂ representatives of all vertices, drawn before by the light they would bring if all
//! were in sight. Groups of neighbouring cache points share their representatives, so that the mixture above is one
//! over the same M₂ vertices; P is then P₁ P₂ (Nabata et al. 2020, "Two-stage resampling").

use super::cache_points::{CachePoints, FoundLight};
use super::learned_visibility::SeenCells;
use super::models::CacheFactor;
use super::path_count::{EYE_COST, VERTEX_COST, best_path_count, variance_of_paths};
use super::pmfs::{Pmfs, Selection};
use super::settings::ResamplingSettings;
use crate::bidir::{Candidate, ConnectionStrategy, EyeVertex, LightSubpaths, VertexCount, VertexStore, WarmUp};
use crate::math::sampler::{PathSampler, SampleSlot, systematic};
use crate::math::{Rgb, Vec3};
use crate::mis::ConnectionFactor;
use crate::mis::factors::Stages;
use crate::path::{Iteration, StoredPlace};
use crate::ray::offset::SegmentEnd;
use crate::ray::{RayKind, RayStats, Tracer};
use crate::spatial::nearest::MAX_NEIGHBORS;
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// The cache points near an eye vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NearestCaches {
    count: usize,
    caches: [usize; MAX_NEIGHBORS],
}

impl NearestCaches {
    /// Their numbers.
    #[inline]
    pub fn caches(&self) -> &[usize] {
        &self.caches[..self.count]
    }
}

/// Cache points with the pmfs of an iteration's light vertices.
#[derive(Debug, Default)]
pub(super) struct CacheStructure {
    /// `None` until they are placed.
    pub points: Option<CachePoints>,
    pub pmfs: Pmfs,
    neighbors: usize,
}

impl CacheStructure {
    /// The cache points near a place, on the side of the direction `d`.
    #[inline]
    pub fn nearest(&self, place: &StoredPlace, d: Vec3) -> NearestCaches {
        let mut near = NearestCaches::default();
        if let Some(points) = &self.points {
            for i in points.index.find(place.position(), place.side_normal(d)).take(self.neighbors) {
                near.caches[near.count] = i;
                near.count += 1;
            }
        }
        near
    }
}

/// A saved state.
#[derive(Serialize, Deserialize)]
struct SavedCaches {
    sums: Vec<FoundLight>,
    iterations: u64,
    counted: VertexCount,
    /// Learned visibility, for each group of cache points.
    seen: Vec<SeenCells>,
}

/// The strategy, with weights by the factor `F`.
#[derive(Debug)]
pub(super) struct CacheStrategy<F> {
    settings: ResamplingSettings,
    caches: CacheStructure,
    /// M.
    paths: u32,
    counted: VertexCount,
    factor: PhantomData<F>,
}

impl<F: CacheFactor> CacheStrategy<F> {
    /// Without cache points yet.
    pub fn new(settings: ResamplingSettings) -> CacheStrategy<F> {
        CacheStrategy {
            settings,
            caches: CacheStructure { neighbors: settings.neighbors, ..CacheStructure::default() },
            paths: settings.paths,
            counted: VertexCount::default(),
            factor: PhantomData,
        }
    }

    /// Candidates, as weights count them.
    fn stages(&self) -> Stages {
        let second_stage = self.settings.second_stage;
        let (paths, second_stage) = match second_stage {
            Some(m2) if !self.settings.two_stage_weights => (m2.min(self.paths), None),
            _ => (self.paths, second_stage),
        };
        Stages {
            paths: paths as f32,
            second_stage: second_stage.map(|m2| m2 as f32),
            epsilon: self.settings.epsilon,
            vertices_per_path: self.counted.vertices_per_path() as f32,
        }
    }

    /// Draws a candidate by the cache points `near`; `None` if there is nothing to draw.
    #[inline]
    fn select(&self, near: &NearestCaches, u: [f32; 2], store: &VertexStore) -> Option<(Option<usize>, Selection)> {
        match near.caches() {
            _ if self.settings.per_cache => {
                self.select_per_cache(near, u, store).map(|(cache, selection)| (Some(cache), selection))
            }
            [] => Some((None, self.select_uniformly(u[1], store)?)),
            caches => Some((None, self.caches.pmfs.draw(caches, u)?)),
        }
    }

    /// Chooses one of the cache points `near` or the virtual one, and draws by its pmf alone: the number of the cache
    /// point, and the light vertex with its probability, the choice of the cache point included.
    fn select_per_cache(&self, near: &NearestCaches, u: [f32; 2], store: &VertexStore) -> Option<(usize, Selection)> {
        let (n, pmfs) = (near.count, &self.caches.pmfs);
        let chosen = ((u[0] * (n + 1) as f32) as usize).min(n);
        let selection = match near.caches().get(chosen) {
            Some(&cache) => pmfs.draw_at(cache, u[1])?,
            None => match near.caches().first() {
                Some(&cache) => pmfs.draw_uniformly(cache, u[1])?,
                None => self.select_uniformly(u[1], store)?,
            },
        };
        Some((chosen, Selection { probability: selection.probability / (n + 1) as f32, ..selection }))
    }

    /// Far from all cache points: uniformly or, as a first stage would, by f_y/p.
    fn select_uniformly(&self, u: f32, store: &VertexStore) -> Option<Selection> {
        let all = store.len();
        if self.settings.second_stage.is_none() {
            let vertex = ((u * all as f32) as usize).min(all - 1);
            return Some(Selection { entry: vertex, vertex, probability: 1.0 / all as f32 });
        }
        let (vertex, p) = store.tree.sample_in(&(0..all), u)?;
        Some(Selection { entry: vertex, vertex, probability: p as f32 })
    }

    /// A drawn light vertex as a candidate, of whose kind a `fraction` is drawn.
    #[inline]
    fn candidate<'a>(
        &self,
        near: &NearestCaches,
        (selected, Selection { entry, vertex, probability }): (Option<usize>, Selection),
        fraction: f32,
        store: &'a VertexStore,
    ) -> Candidate<'a, F::Lookup> {
        let draws = probability * self.paths as f32 * self.settings.samples as f32 * fraction;
        let lookup = F::drawn(&self.caches, near, entry);
        Candidate { selected, lookup, ..store.candidate(vertex, 1.0 / draws) } // [RISBPT eq. 6]
    }
}

impl<F: CacheFactor> ConnectionStrategy for CacheStrategy<F> {
    type Factor = F;
    type Lookup = F::Lookup;

    const NEEDS_LIGHT_VERTEX: bool = F::NEEDS_LIGHT_VERTEX;

    fn light_subpaths(&self) -> LightSubpaths {
        LightSubpaths::Shared { count: self.paths, tree: self.settings.second_stage.is_some() }
    }

    fn samples(&self) -> f32 {
        self.settings.samples as f32
    }

    fn factor(&self) -> F {
        F::new(&self.settings, self.stages())
    }

    fn place(&mut self, warm_up: &WarmUp) -> RayStats {
        let (mut points, mut stats) = CachePoints::place(warm_up, &self.settings);
        let film_size = warm_up.iteration.scene.film_size;
        let pixels = f64::from(film_size[0]) * f64::from(film_size[1]);
        let eye_rays = stats.rays(&[RayKind::Cache]) / (pixels * self.settings.cache_fraction).max(1.0);
        let paths = if self.settings.paths > 0 { self.settings.paths } else { pixels as u32 }.min(WarmUp::MAX_PATHS);
        let second_stage = self.settings.second_stage.map(|m2| m2 as usize);
        if self.settings.learned_visibility {
            self.caches.pmfs.learn_visibility(warm_up.iteration.scene.radius);
        }
        let (mut light_rays, mut found) = (0.0, vec![]);
        for set in 1..=WarmUp::SETS {
            let (store, s) = warm_up.light_vertices(paths, set, second_stage.is_some());
            stats.merge(&s);
            light_rays += s.rays(&[RayKind::Light, RayKind::LightBounce]);
            // Sets of iterations count from zero up, those of warm-ups from the top down.
            let (iteration, pmfs) = (&warm_up.iteration, &mut self.caches.pmfs);
            stats.merge(&pmfs.find(iteration, &points, &store, second_stage, u64::MAX - set));
            points.learn(pmfs.found());
            found.push(pmfs.found_by_group().collect());
            pmfs.learn(&points, &store);
            self.counted.add(&store);
        }
        if self.settings.paths == 0 {
            let variance = variance_of_paths(&found, paths);
            let VertexCount { vertices, paths } = self.counted;
            let light = (light_rays + VERTEX_COST * vertices as f64) / paths.max(1) as f64;
            self.paths = best_path_count(pixels, EYE_COST * eye_rays, light, variance);
        }
        self.caches.points = Some(points);
        stats
    }

    fn prepare(&mut self, iteration: &Iteration, store: &VertexStore) -> RayStats {
        let Some(points) = &self.caches.points else { return RayStats::default() };
        let second_stage = self.settings.second_stage.map(|m2| m2 as usize);
        self.caches.pmfs.find(iteration, points, store, second_stage, iteration.index)
    }

    fn learn(&mut self, store: &VertexStore) {
        if let Some(points) = &mut self.caches.points {
            points.learn(self.caches.pmfs.found());
            self.caches.pmfs.learn(points, store);
            self.counted.add(store);
        }
    }

    fn reset(&mut self) {
        *self = CacheStrategy::new(self.settings);
    }

    #[inline]
    fn draw<'a>(
        &'a self,
        eye: &EyeVertex<'a, '_>,
        sampler: &mut PathSampler,
        wanted: impl Fn(usize) -> bool,
        mut connect: impl FnMut(Candidate<'a, F::Lookup>),
    ) {
        if eye.store.is_empty() || self.caches.points.is_none() {
            return;
        }
        // Next event leaves the last of its numbers.
        let [.., offset] = sampler.vertex(eye.vertex.index, SampleSlot::Emitter);
        let near = self.caches.nearest(&eye.vertex.place.stored(), eye.vertex.wo);
        for number in 0..self.settings.samples {
            let [cache, present, ..] = sampler.rng().next_4();
            if present < eye.fraction
                && let Some(selection) =
                    self.select(&near, [cache, systematic(number, self.settings.samples, offset)], eye.store)
            {
                let candidate = self.candidate(&near, selection, eye.fraction, eye.store);
                if wanted(candidate.vertex.length()) {
                    connect(candidate);
                }
            }
        }
    }

    #[inline]
    fn look_up(&self, z: &StoredPlace, d: Vec3) -> F::Lookup {
        F::look_up(&self.caches, z, d)
    }

    #[inline]
    fn see(&self, lookup: &mut F::Lookup, y: &SegmentEnd, tracer: &mut Tracer) {
        F::see(&self.caches, lookup, y, tracer);
    }

    #[inline]
    fn edge(&self, lookup: &F::Lookup, y: &StoredPlace, value: impl Fn(Vec3) -> Rgb) -> <F as ConnectionFactor>::Edge {
        F::edge(&self.caches, lookup, y, value)
    }

    fn note(&self) -> Option<String> {
        let points = self.caches.points.as_ref()?;
        let (caches, groups) = (points.len(), points.groups.len());
        Some(format!("{caches} cache points in {groups} groups, {} light sub-paths", self.paths))
    }

    fn save(&self) -> Vec<u8> {
        let Some((sums, iterations)) = self.caches.points.as_ref().map(CachePoints::sums) else { return vec![] };
        let seen = self.caches.pmfs.seen_cells().cloned().collect();
        let saved = SavedCaches { sums: sums.to_vec(), iterations, counted: self.counted, seen };
        postcard::to_allocvec(&saved).unwrap_or_default()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let Some(points) = &mut self.caches.points else { return state.is_empty() };
        let Ok(SavedCaches { sums, iterations, counted, seen }) = postcard::from_bytes(state) else { return false };
        self.counted = counted;
        points.restore(sums, iterations) && self.caches.pmfs.restore(seen)
    }
}
