//! Light sub-paths before the first iteration, from which strategies estimate normalisations.

use super::light_subpath::{LightSubpath, LightSubpathTracer, LightSubpathUse};
use super::store::{StoreChunk, VertexStore};
use super::strategy::NoConnections;
use crate::emit::EmissionDistribution;
use crate::math::sampler::PathSampler;
use crate::mis::factors::Balance;
use crate::mis::{Heuristic, MisContext, Techniques};
use crate::path::{Iteration, PathLimits, ScatterSampler, streams};
use crate::ray::RayStats;
use rayon::prelude::*;

/// Sub-paths in a piece of work.
const CHUNK: u32 = 64;

/// Access to light and eye vertices before the first iteration.
#[derive(Clone, Copy)]
pub struct WarmUp<'a> {
    /// Scene and seed.
    pub iteration: Iteration<'a>,
    /// Limits of eye sub-paths.
    pub eye_limits: PathLimits,
    /// Limits of light sub-paths.
    pub light_limits: PathLimits,
    /// How light sub-paths begin.
    pub emission: &'a EmissionDistribution,
}

impl WarmUp<'_> {
    /// Sets of light sub-paths from which strategies estimate normalisations.
    pub const SETS: u64 = 4;
    /// Light sub-paths of one of these sets, at most.
    pub const MAX_PATHS: u32 = 4000;

    /// Traces `paths` light sub-paths; `set` tells one set from another.
    pub fn light_vertices(&self, paths: u32, set: u64, with_tree: bool) -> (VertexStore, RayStats) {
        let iteration = &self.iteration;
        let mis = MisContext {
            techniques: Techniques::none(),
            heuristic: Heuristic::Balance,
            eye_limits: self.eye_limits,
            light_limits: self.light_limits,
            emission: self.emission.clone(),
            directions: ScatterSampler,
            factor: Balance,
        };
        let rules =
            LightSubpathTracer { scene: iteration.scene, mis: &mis, strategy: &NoConnections, hide_emitters: false };
        let stream = streams::WARM_UP | set << 32;
        let trace_chunk = |(number, chunk): (usize, &mut StoreChunk)| {
            let (mut tracer, mut path) = (iteration.tracer(), LightSubpath::default());
            let first = number as u32 * CHUNK;
            for number in first..paths.min(first + CHUNK) {
                let mut sampler = PathSampler::new(iteration.seed, stream, iteration.index, u64::from(number));
                let purpose = LightSubpathUse { number, keep_vertices: true, ..LightSubpathUse::default() };
                rules.trace(&mut sampler, &mut tracer, &mut path, purpose);
                chunk.push(number, &path);
            }
            tracer.stats
        };
        let mut store = VertexStore::default();
        let stats: Vec<RayStats> =
            store.begin(paths.div_ceil(CHUNK)).par_iter_mut().enumerate().map(trace_chunk).collect();
        store.finish(paths, with_tree);
        let mut all = RayStats::default();
        stats.iter().for_each(|s| all.merge(s));
        (store, all)
    }
}
