//! Rendering until the error is small enough, with an estimate of it that is honest.
//!
//! The samples of a pixel are stratified over iterations, so that their variance says too much, and halves of one sequence lean on
//! each other. A render with a target is therefore two renders with seeds of their own, A and B, whose iterations take turns.
//! Their mean M = (A + B)/2 is the picture. With independent A and B of equal distribution the error of M is distributed as
//! (A − B)/2 is (for a symmetric distribution; for squares always), so that any measure of A against M estimates the same
//! measure of M against the truth. What it costs: two sequences of n/2 samples are a little worse than one of n.

use super::driver::{Budget, Outcome, Progress, Stop, share};
use super::stats::{Clock, cpu_seconds};
use crate::film::Film;
use crate::image::metrics::{PixelErrors, pixel_errors};
use crate::integrators::{Integrator, Iteration};
use crate::math::hash::mix64;
use crate::prepared::PreparedScene;
use crate::ray::RayStats;
use std::sync::atomic::{AtomicBool, Ordering};

/// A measure's place among all.
type Of = fn(&PixelErrors) -> f64;

/// When the error is small enough.
#[derive(Clone, Copy, Debug)]
pub struct ErrorTarget {
    /// Name of the measure.
    pub key: &'static str,
    of: Of,
    /// The error to get below.
    pub value: f64,
}

/// What can be estimated.
const KEYS: [(&str, Of); 6] = [
    ("relmse", |e| e.relmse),
    ("relmse_trimmed", |e| e.relmse_trimmed),
    ("mape", |e| e.mape),
    ("mae", |e| e.mae),
    ("mse", |e| e.mse),
    ("rmse", |e| e.mse.sqrt()),
];

/// Iterations before the first look: fewer tell nothing.
const FIRST_LOOK: u64 = 8;
/// Iterations between two looks, at least and as a part of those so far. Looking costs a small part of an iteration, so that this keeps
/// it well below a hundredth of the time; a rule that looked at the clock would stop elsewhere each time.
const LOOK_AFTER: u64 = 4;
const LOOK_PART: u64 = 8;

impl ErrorTarget {
    /// Reads `relmse=0.01`.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(text: &str) -> Result<ErrorTarget, String> {
        let known = || KEYS.map(|k| k.0).join(", ");
        let (name, value) =
            text.split_once('=').ok_or_else(|| format!("expected MEASURE=VALUE, one of {}", known()))?;
        let found = KEYS.into_iter().find(|k| k.0 == name);
        let (key, of) = found.ok_or_else(|| format!("unknown measure \"{name}\"; known: {}", known()))?;
        let value = value.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
        Ok(ErrorTarget { key, of, value: value.ok_or("expected an error above zero")? })
    }

    /// The estimate from two halves.
    pub fn estimate(&self, halves: &[Film; 2]) -> f64 {
        let pictures = halves.each_ref().map(Film::mean_f64);
        let both = pictures[0].iter().zip(&pictures[1]);
        let mean: Vec<[f64; 3]> = both.map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
        (self.of)(&pixel_errors(&pictures[0], &mean))
    }
}

/// The seeds of the two halves.
pub fn seeds(seed: u64) -> [u64; 2] {
    [seed, mix64(seed ^ 0xbadc_0ffe_e0dd_f00d)]
}

/// Renders into an empty film until the estimate is below the target, the budget is used up or `interrupt` is set. Returns the last
/// estimate with the outcome. `build` makes the integrator of each half. Runs on the current thread pool.
pub fn render_to_target(
    scene: &PreparedScene,
    build: impl Fn() -> Box<dyn Integrator>,
    film: &mut Film,
    (seed, budget, target): (u64, Budget, &ErrorTarget),
    interrupt: &AtomicBool,
    mut watch: impl FnMut(&Progress, Option<f64>),
) -> (Outcome, Option<f64>) {
    let mut halves = [Film::new(scene.window), Film::new(scene.window)];
    let mut integrators = [build(), build()];
    let seeds = seeds(seed);
    let (mut clock, mut rays, mut estimate) = (Clock::default(), RayStats::default(), None);
    let (cpu_before, mut next_look) = (cpu_seconds(), FIRST_LOOK);
    let stop = loop {
        let n = halves[0].iterations() + halves[1].iterations();
        // Halves of equal size only: both seeds have had their turn.
        if n >= next_look && n.is_multiple_of(2) {
            let found = clock.time(|| target.estimate(&halves));
            estimate = Some(found);
            next_look = n + (n / LOOK_PART).max(LOOK_AFTER);
            if found < target.value {
                break Stop::Converged;
            }
        }
        if budget.used_up(n, n, clock.total()) {
            break Stop::Budget;
        }
        if interrupt.load(Ordering::Relaxed) {
            break Stop::Interrupted;
        }
        let half = (n % 2) as usize;
        let iteration = Iteration { scene, seed: seeds[half], index: halves[half].begin_iteration() };
        rays.merge(&clock.time(|| integrators[half].iterate(&iteration, &mut halves[half])));
        let elapsed = clock.total();
        let done = share(&budget, n + 1, elapsed);
        watch(&Progress { iterations: n + 1, rays: rays.total(), elapsed, done }, estimate);
    };
    for half in &halves {
        film.add(half);
    }
    if film.iterations() >= 2 && film.iterations().is_multiple_of(2) {
        estimate = Some(target.estimate(&halves));
    }
    let cpu_seconds = cpu_seconds().zip(cpu_before).map(|(after, before)| after - before);
    let iterations = film.iterations();
    (Outcome { stop, rays, wall: clock.total(), cpu_seconds, iterations, notes: integrators[0].notes() }, estimate)
}
