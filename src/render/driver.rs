//! The loop over iterations. Everything that happens per iteration counts against a time budget; loading does not. An iteration
//! that would overshoot is not started.

use super::stats::{Clock, cpu_seconds};
use crate::film::Film;
use crate::integrators::{Integrator, Iteration};
use crate::prepared::PreparedScene;
use crate::ray::RayStats;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// When to stop; whichever comes first.
#[derive(Clone, Copy, Debug, Default)]
pub struct Budget {
    /// Iterations (samples per pixel) in all, those of a resumed checkpoint included.
    pub iterations: Option<u64>,
    /// Wall time of this run.
    pub time: Option<Duration>,
}

impl Budget {
    /// True if nothing is left with `iterations` in the film, `done` of them in the time `elapsed` of this run: an iteration that
    /// would overshoot is not started, but the first is.
    pub(super) fn used_up(&self, iterations: u64, done: u64, elapsed: Duration) -> bool {
        let late = |time| done > 0 && elapsed + elapsed / u32::try_from(done).unwrap_or(u32::MAX) > time;
        self.iterations.is_some_and(|n| iterations >= n) || self.time.is_some_and(late)
    }
}

/// Why the loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The budget is used up.
    Budget,
    /// The error is below its target.
    Converged,
    /// Somebody asked.
    Interrupted,
}

/// Where the render is; shown while it runs.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Iterations in the film.
    pub iterations: u64,
    /// Rays of this run.
    pub rays: u64,
    /// Wall time of this run.
    pub elapsed: Duration,
    /// Share of the budget used, 0 … 1.
    pub done: f64,
}

/// How it went.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Why it ended.
    pub stop: Stop,
    /// Rays of this run.
    pub rays: RayStats,
    /// Wall time of this run's iterations.
    pub wall: Duration,
    /// Processor seconds of this run's iterations, all threads.
    pub cpu_seconds: Option<f64>,
    /// Iterations of this run.
    pub iterations: u64,
    /// What the integrator decided by itself.
    pub notes: Vec<String>,
}

/// Renders into `film` until the budget is used up or `interrupt` is set; calls `watch` after every iteration, which may save a
/// checkpoint (its time is not counted) with what the integrator has learnt. Runs on the current thread pool.
pub fn render(
    scene: &PreparedScene,
    integrator: &mut dyn Integrator,
    film: &mut Film,
    seed: u64,
    budget: Budget,
    interrupt: &AtomicBool,
    mut watch: impl FnMut(&Progress, &Film, &dyn Fn() -> Vec<u8>),
) -> Outcome {
    let mut clock = Clock::default();
    let mut rays = RayStats::default();
    let (cpu_before, first) = (cpu_seconds(), film.iterations());
    let stop = loop {
        if budget.used_up(film.iterations(), film.iterations() - first, clock.total()) {
            break Stop::Budget;
        }
        if interrupt.load(Ordering::Relaxed) {
            break Stop::Interrupted;
        }
        let iteration = Iteration { scene, seed, index: film.begin_iteration() };
        let stats = clock.time(|| integrator.iterate(&iteration, film));
        rays.merge(&stats);
        let elapsed = clock.total();
        watch(
            &Progress {
                iterations: film.iterations(),
                rays: rays.total(),
                elapsed,
                done: share(&budget, film.iterations(), elapsed),
            },
            film,
            &|| integrator.state(),
        );
    };
    let cpu_seconds = cpu_seconds().zip(cpu_before).map(|(after, before)| after - before);
    let (iterations, notes) = (film.iterations() - first, integrator.notes());
    Outcome { stop, rays, wall: clock.total(), cpu_seconds, iterations, notes }
}

pub(super) fn share(budget: &Budget, iterations: u64, elapsed: Duration) -> f64 {
    let by_iterations = budget.iterations.map_or(0.0, |n| iterations as f64 / n.max(1) as f64);
    let by_time = budget.time.map_or(0.0, |t| elapsed.as_secs_f64() / t.as_secs_f64().max(1e-9));
    by_iterations.max(by_time).min(1.0)
}
