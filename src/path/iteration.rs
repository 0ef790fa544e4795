//! One iteration of a render.

use crate::prepared::PreparedScene;
use crate::ray::Tracer;

/// One iteration of a render.
#[derive(Clone, Copy)]
pub struct Iteration<'a> {
    /// The scene.
    pub scene: &'a PreparedScene,
    /// Seed of the render.
    pub seed: u64,
    /// Number of the iteration, from zero.
    pub index: u64,
    /// Time of the iteration in the shutter interval [0, 1). Light vertices are shared by all pixels, so that all paths
    /// of an iteration have one time.
    pub time: f32,
}

impl<'a> Iteration<'a> {
    /// The iteration `index` of the render of `scene` with `seed`.
    pub fn new(scene: &'a PreparedScene, seed: u64, index: u64) -> Iteration<'a> {
        // Scenes do not move yet: every time shows the same.
        Iteration { scene, seed, index, time: 0.0 }
    }

    /// Another iteration of the same render.
    pub fn with_index(&self, index: u64) -> Iteration<'a> {
        Iteration::new(self.scene, self.seed, index)
    }

    /// A tracer of rays through the scene at the iteration's time, with empty counters.
    #[inline]
    pub fn tracer(&self) -> Tracer<'a> {
        self.scene.tracer()
    }

    /// Number of the pixel (x, y) in the full picture, row by row.
    #[inline]
    pub fn pixel_index(&self, x: u32, y: u32) -> u64 {
        u64::from(y) * u64::from(self.scene.film_size[0]) + u64::from(x)
    }
}
