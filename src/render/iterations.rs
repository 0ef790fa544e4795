//! The loop over iterations, of which the program has one.
//!
//! A loop runs one or more [`Estimator`]s. A [`Schedule`] decides which of them iterates next, and when to stop. A
//! plain render is one estimator, a render with an error target is two halves with seeds of their own, and a
//! convergence study one for each method. The clock runs during iterations and decisions of the schedule; what
//! `watch` does (progress, checkpoints, errors against a reference) takes no time of the budget.

use super::estimator::Estimator;
use super::stats::{Clock, cpu_seconds};
use crate::prepared::PreparedScene;
use crate::ray::RayStats;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Reason for the end of a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The budget is used up.
    Budget,
    /// The error is below its target.
    Converged,
    /// The user asked for it (Ctrl-C).
    Interrupted,
}

/// Decision of a schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// The estimator of that index iterates.
    Iterate(usize),
    /// The loop ends.
    Stop(Stop),
}

/// An estimate of the error of the picture so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentError {
    /// Name of the measure.
    pub measure: &'static str,
    /// Value of the measure.
    pub value: f64,
}

/// Decides about the next iteration. `elapsed` is the wall time of the loop so far.
pub trait Schedule {
    /// The next turn.
    fn next(&mut self, estimators: &[Estimator], elapsed: Duration) -> Turn;

    /// Part of the budget that is used, 0 … 1.
    fn used(&self, estimators: &[Estimator], elapsed: Duration) -> f64;

    /// The latest estimate of the picture's error, if the schedule makes one.
    fn error(&self) -> Option<CurrentError> {
        None
    }
}

/// State of a loop after an iteration.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Index of the estimator that has just iterated.
    pub estimator: usize,
    /// Iterations in all films.
    pub iterations: u64,
    /// Rays of this run.
    pub rays: u64,
    /// Wall time of this run.
    pub elapsed: Duration,
    /// Part of the budget that is used, 0 … 1.
    pub used: f64,
    /// The latest estimate of the picture's error, if there is one.
    pub error: Option<CurrentError>,
}

/// Result of a loop.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Reason for its end.
    pub stop: Stop,
    /// Rays of this run, of all estimators.
    pub rays: RayStats,
    /// Wall time of this run's iterations.
    pub wall: Duration,
    /// Processor seconds of this run, all threads.
    pub cpu_seconds: Option<f64>,
    /// Iterations of this run, of all estimators.
    pub iterations: u64,
    /// Decisions of the integrators, for people to read.
    pub notes: Vec<String>,
}

/// Runs iterations until the schedule ends the loop or `interrupt` is set, and calls `watch` after each of them. Runs
/// on the current thread pool.
pub fn run_iterations(
    scene: &PreparedScene,
    estimators: &mut [Estimator],
    schedule: &mut dyn Schedule,
    interrupt: &AtomicBool,
    watch: &mut dyn FnMut(&Progress, &[Estimator]),
) -> Outcome {
    let mut clock = Clock::default();
    let cpu_before = cpu_seconds();
    let stop = loop {
        let elapsed = clock.total();
        let estimator = match clock.time(|| schedule.next(estimators, elapsed)) {
            Turn::Iterate(estimator) => estimator,
            Turn::Stop(stop) => break stop,
        };
        if interrupt.load(Ordering::Relaxed) {
            break Stop::Interrupted;
        }
        clock.time(|| estimators[estimator].iterate(scene));
        let elapsed = clock.total();
        let progress = Progress {
            estimator,
            iterations: estimators.iter().map(|e| e.film.iterations()).sum(),
            rays: estimators.iter().map(|e| e.rays().total()).sum(),
            elapsed,
            used: schedule.used(estimators, elapsed),
            error: schedule.error(),
        };
        watch(&progress, estimators);
    };
    let mut rays = RayStats::default();
    estimators.iter().for_each(|e| rays.merge(e.rays()));
    let mut notes: Vec<String> = vec![];
    for note in estimators.iter().flat_map(|e| e.integrator.notes()) {
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    Outcome {
        stop,
        rays,
        wall: clock.total(),
        cpu_seconds: cpu_seconds().zip(cpu_before).map(|(after, before)| after - before),
        iterations: estimators.iter().map(Estimator::new_iterations).sum(),
        notes,
    }
}
