//! The light sub-paths of an iteration, and what becomes of each: splats, and vertices to connect to.

use super::assignment::{LightPathAssignment, contains};
use super::engine::Bidirectional;
use super::light_subpath::{LightSubpathTracer, LightSubpathUse};
use super::scratch::{ThreadScratch, TileOutput};
use super::store::{StoreChunk, VertexStore};
use super::strategy::{ConnectionStrategy, LightSubpaths};
use crate::math::sampler::PathSampler;
use crate::path::{Iteration, streams};
use crate::ray::Tracer;
use rayon::prelude::*;

/// Light sub-paths in a piece of work that has no eye sub-paths.
const CHUNK: u32 = 512;

/// Random numbers of light sub-path `number` of an iteration.
pub(super) fn light_sampler(iteration: &Iteration, number: u32) -> PathSampler {
    // The sub-paths of one iteration are points of one sequence: they are stratified among themselves.
    PathSampler::new(iteration.seed, streams::LIGHT, iteration.index, u64::from(number))
}

impl<S: ConnectionStrategy> Bidirectional<S> {
    /// How pixels share light sub-paths in an iteration.
    pub(super) fn assignment(&self, iteration: &Iteration) -> LightPathAssignment {
        let fraction = self.allocation.light_image;
        LightPathAssignment::new(iteration.scene.film_size, fraction, iteration.seed, iteration.index)
    }

    /// The rules of the iteration's light sub-paths.
    pub(super) fn light_rules<'a>(&'a self, iteration: &Iteration<'a>) -> LightSubpathTracer<'a, S> {
        LightSubpathTracer {
            scene: iteration.scene,
            mis: &self.mis,
            strategy: &self.strategy,
            hide_emitters: self.hide_emitters,
        }
    }

    /// Number of light sub-paths of an iteration that are connected to the lens.
    pub(super) fn light_paths(&self, iteration: &Iteration) -> f32 {
        match self.strategy.light_subpaths() {
            LightSubpaths::OfPixel => self.assignment(iteration).paths() as f32,
            LightSubpaths::Shared { .. } => {
                let [width, height] = iteration.scene.film_size.map(|n| n as f32);
                (width * height * self.allocation.light_image).ceil()
            }
        }
    }

    /// Traces the light sub-path `number` into the scratch memory.
    pub(super) fn light_path(
        &self,
        iteration: &Iteration,
        scratch: &mut ThreadScratch<S::Factor>,
        tracer: &mut Tracer,
        purpose: LightPathPurpose,
    ) {
        let LightPathPurpose { number, keep_vertices, splats } = purpose;
        let ThreadScratch { light, splats: queue, .. } = scratch;
        let purpose = LightSubpathUse { number, keep_vertices, splats: splats.then_some(queue), replay: None };
        self.light_rules(iteration).trace(&mut light_sampler(iteration, number), tracer, light, purpose);
    }

    /// Traces all light sub-paths of an iteration whose eye vertices draw from the first `kept` of them, which are left
    /// in `store`.
    pub(super) fn light_pass(&self, iteration: &Iteration, kept: u32, store: &mut VertexStore) -> Vec<TileOutput> {
        let techniques = &self.mis.techniques;
        let splats = if techniques.uses_light_image() { techniques.light_paths() as u32 } else { 0 };
        let all = splats.max(kept);
        type Piece<'a> = (usize, Option<&'a mut StoreChunk>);
        let trace = |scratch: &mut ThreadScratch<S::Factor>, (piece, mut chunk): Piece| {
            let mut tracer = iteration.tracer();
            let first = piece as u32 * CHUNK;
            for number in first..all.min(first + CHUNK) {
                let keep_vertices = number < kept;
                let purpose = LightPathPurpose { number, keep_vertices, splats: number < splats };
                self.light_path(iteration, scratch, &mut tracer, purpose);
                if let (true, Some(chunk)) = (keep_vertices, chunk.as_deref_mut()) {
                    chunk.push(number, &scratch.light);
                }
            }
            scratch.finish(tracer, vec![])
        };
        // There may be very many pieces; only the first leave something in the store.
        let (pieces, kept_pieces) = (all.div_ceil(CHUNK), kept.div_ceil(CHUNK));
        let kept_chunks = store.begin(kept_pieces).par_iter_mut().map(Some);
        let others = (kept_pieces..pieces).into_par_iter().map(|_| None);
        kept_chunks
            .chain(others)
            .enumerate()
            .map_init(|| ThreadScratch::new(self.probe_stride, self.mis.heuristic), trace)
            .collect()
    }

    /// Traces the light sub-paths in a row of blocks whose home pixels are outside of the window: only their splats
    /// matter.
    pub(super) fn outside_splats(
        &self,
        iteration: &Iteration,
        rows: [u32; 4],
        scratch: &mut ThreadScratch<S::Factor>,
    ) -> TileOutput {
        let scene = iteration.scene;
        let mut tracer = iteration.tracer();
        let assignment = self.assignment(iteration);
        for slot in assignment.slots_in(rows) {
            let home = assignment.home_pixel(slot);
            if contains([0, 0, scene.film_size[0], scene.film_size[1]], home) && !contains(scene.window, home) {
                let number = assignment.path(slot);
                let purpose = LightPathPurpose { number, keep_vertices: false, splats: true };
                self.light_path(iteration, scratch, &mut tracer, purpose);
            }
        }
        scratch.finish(tracer, vec![])
    }
}

/// A light sub-path of a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightPathPurpose {
    /// Its number among those of the iteration.
    pub number: u32,
    /// Vertices are kept for connections.
    pub keep_vertices: bool,
    /// Vertices are connected to the lens.
    pub splats: bool,
}
