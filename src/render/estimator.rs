//! Estimators: an integrator that adds iterations to a film of its own.

use super::stats::Clock;
use crate::film::Film;
use crate::integrators::{Integrator, Iteration};
use crate::prepared::PreparedScene;
use crate::ray::RayStats;
use std::time::Duration;

/// An integrator with its film and its seed. The film counts the iterations.
pub struct Estimator {
    /// Integrator.
    pub integrator: Box<dyn Integrator>,
    /// Sums of all iterations so far.
    pub film: Film,
    /// Seed of all its random numbers.
    pub seed: u64,
    /// Iterations that the film had before this run.
    resumed_at: u64,
    clock: Clock,
    rays: RayStats,
}

impl Estimator {
    /// An estimator with an empty film for the window x, y, width, height.
    pub fn new(integrator: Box<dyn Integrator>, window: [u32; 4], seed: u64) -> Estimator {
        let film = Film::new(window);
        Estimator { integrator, film, seed, resumed_at: 0, clock: Clock::default(), rays: RayStats::default() }
    }

    /// Goes on from a film and an integrator's state of an earlier run; false if the state does not fit the integrator.
    #[must_use]
    pub fn restore(&mut self, scene: &PreparedScene, film: Film, state: &[u8]) -> bool {
        self.film = film;
        self.resumed_at = self.film.iterations();
        let next = Iteration::new(scene, self.seed, self.resumed_at);
        self.integrator.restore(&next, state)
    }

    /// Adds one iteration to the film; its wall time and its rays count. Returns the statistics of this iteration
    /// alone.
    pub fn iterate(&mut self, scene: &PreparedScene) -> RayStats {
        let index = self.film.begin_iteration();
        let iteration = Iteration::new(scene, self.seed, index);
        let rays = self.clock.time(|| self.integrator.iterate(&iteration, &mut self.film));
        self.rays.merge(&rays);
        rays
    }

    /// Iterations of this run: those in the film but for the ones of an earlier run.
    pub fn new_iterations(&self) -> u64 {
        self.film.iterations() - self.resumed_at
    }

    /// Wall time of the iterations of this run.
    pub fn elapsed(&self) -> Duration {
        self.clock.total()
    }

    /// Rays of the iterations of this run.
    pub fn rays(&self) -> &RayStats {
        &self.rays
    }
}
