//! Which light sub-paths an iteration traces, and what it takes from them: splats, and vertices to draw from.

use super::light_path::{self, LensQueue};
use super::sharing::{Sharing, contains};
use super::worker::{Piece, Worker, splat};
use super::{Bidirectional, Found, LIGHT_PATHS_AT_ONCE, LIGHT_STREAM};
use crate::integrators::resampling::store::{LightStore, Part};
use crate::integrators::{Iteration, Replay};
use crate::math::sampler::PathSampler;
use crate::ray::Tracer;
use rayon::prelude::*;

impl Bidirectional {
    /// How pixels share light sub-paths in an iteration.
    pub(super) fn sharing(&self, iteration: &Iteration) -> Sharing {
        Sharing::new(iteration.scene.film_size, self.effort.light_image, iteration.seed, iteration.index)
    }

    /// Pixels have light sub-paths of their own.
    pub(super) fn uses_light_paths(&self) -> bool {
        self.connects || self.weigher.techniques.uses_light_image()
    }

    /// Light sub-paths of an iteration for the light image: one for every pixel of the full film, or fewer.
    pub(super) fn light_paths(&self, iteration: &Iteration) -> f32 {
        if self.resampler.is_none() {
            return self.sharing(iteration).paths() as f32;
        }
        let [width, height] = iteration.scene.film_size.map(|n| n as f32);
        (width * height * self.effort.light_image).ceil()
    }

    /// Random numbers of light sub-path `path`.
    pub(in crate::integrators) fn light_sampler(&self, iteration: &Iteration, path: u32) -> PathSampler {
        // The sub-paths of one iteration are points of one sequence: they are stratified among themselves.
        PathSampler::new(iteration.seed, LIGHT_STREAM, iteration.index, u64::from(path))
    }

    /// One light sub-path: its vertices and its splats, as far as they are wanted.
    pub(super) fn light_path(
        &self,
        iteration: &Iteration,
        path: u32,
        worker: &mut Worker,
        tracer: &mut Tracer,
        record: Option<&mut Replay>,
        (keep_vertices, splats_it): (bool, bool),
    ) {
        let mut sampler = self.light_sampler(iteration, path);
        let (splats, all) = (&mut worker.splats, &mut worker.found);
        let mut found = |found: Found| {
            splats.push(splat(found));
            if self.wants(found.path) {
                all.push(found);
            }
        };
        let mut lens = LensQueue { queue: &mut worker.lens, found: &mut found, path };
        light_path::trace(
            self,
            iteration.scene,
            &mut sampler,
            tracer,
            &mut worker.light,
            splats_it.then_some(&mut lens),
            record,
            keep_vertices,
        );
    }

    /// All light sub-paths of an iteration whose eye vertices draw from the first `kept` of them, which are left in `store`.
    pub(in crate::integrators) fn light_pass(
        &self,
        iteration: &Iteration,
        kept: u32,
        store: &mut LightStore,
    ) -> Vec<Piece> {
        let scene = iteration.scene;
        let splat = match self.weigher.techniques.uses_light_image() {
            true => self.weigher.techniques.light_paths() as u32,
            false => 0,
        };
        let all = splat.max(kept);
        let one_piece = |worker: &mut Worker, (chunk, mut part): (usize, Option<&mut Part>)| {
            let mut tracer = Tracer::new(&*scene.query);
            let first = chunk as u32 * LIGHT_PATHS_AT_ONCE;
            for path in first..all.min(first + LIGHT_PATHS_AT_ONCE) {
                let keep = path < kept;
                if path < splat {
                    self.light_path(iteration, path, worker, &mut tracer, None, (keep, true));
                } else {
                    let mut sampler = self.light_sampler(iteration, path);
                    light_path::trace(self, scene, &mut sampler, &mut tracer, &mut worker.light, None, None, keep);
                }
                if let (true, Some(part)) = (keep, part.as_deref_mut()) {
                    part.keep(path, &worker.light);
                }
            }
            worker.finish(self, tracer)
        };
        // Of the pieces, which may be very many, only the first leave something in the store.
        let (pieces, kept_pieces) = (all.div_ceil(LIGHT_PATHS_AT_ONCE), kept.div_ceil(LIGHT_PATHS_AT_ONCE));
        let kept_parts = store.begin(kept_pieces).par_iter_mut().map(Some);
        let others = (kept_pieces..pieces).into_par_iter().map(|_| None);
        kept_parts.chain(others).enumerate().map_init(Worker::new, one_piece).collect()
    }

    /// Light sub-paths in a row of blocks whose owners are outside of the window: only their splats matter.
    pub(super) fn light_only(&self, iteration: &Iteration, rows: [u32; 4], worker: &mut Worker) -> Piece {
        let scene = iteration.scene;
        let mut tracer = Tracer::new(&*scene.query);
        let sharing = self.sharing(iteration);
        for slot in sharing.slots_in(rows) {
            let owner = sharing.owner(slot);
            if contains([0, 0, scene.film_size[0], scene.film_size[1]], owner) && !contains(scene.window, owner) {
                self.light_path(iteration, sharing.path(slot), worker, &mut tracer, None, (false, true));
            }
        }
        worker.finish(self, tracer)
    }
}
