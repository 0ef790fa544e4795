//! Rendering until the error is small enough, with an honest estimate of the error.
//!
//! The samples of a pixel are stratified over iterations, so that their variance overestimates the error, and the
//! halves of one sequence are correlated. A render with a target is therefore two renders with seeds of their own, A
//! and B, whose iterations take turns. Their mean M = (A + B)/2 is the picture. With independent A and B of equal
//! distribution the error of M is distributed as (A − B)/2 (for a symmetric distribution; for squares always), so
//! that any measure of A against M estimates the measure of M against the truth. The price: two sequences of n/2
//! samples are a little worse than one of n.

use super::estimator::Estimator;
use super::iterations::{CurrentError, Schedule, Stop, Turn};
use super::schedule::{Alternate, Budget, total_iterations};
use crate::film::Film;
use crate::image::metrics::{PictureErrors, picture_errors};
use crate::math::hash::mix64;
use std::time::Duration;

/// Reads one measure out of all.
type Selector = fn(&PictureErrors) -> f64;

/// The error at which a render ends.
#[derive(Clone, Copy, Debug)]
pub struct ErrorTarget {
    /// Name of the measure.
    pub key: &'static str,
    select: Selector,
    /// The error to get below.
    pub value: f64,
}

/// Measures that can be estimated.
const MEASURES: [(&str, Selector); 10] = [
    ("relmse", |e| e.relmse),
    ("relmse_trimmed", |e| e.relmse_trimmed),
    ("relmse_8x8", |e| e.regions.relmse_8x8),
    ("relmse_16x16", |e| e.regions.relmse_16x16),
    ("relmse_32x32", |e| e.regions.relmse_32x32),
    ("relmse_whole", |e| e.regions.relmse_whole),
    ("mape", |e| e.mape),
    ("mae", |e| e.mae),
    ("mse", |e| e.mse),
    ("rmse", |e| e.mse.sqrt()),
];

/// Iterations (of both halves) before the first estimate: fewer say nothing.
const FIRST_ESTIMATE: u64 = 8;
/// Iterations between two estimates: at least `MIN_INTERVAL`, and at least the part 1/`INTERVAL_DIVISOR` of those so
/// far. An estimate costs a small part of an iteration, so that this keeps its share of the time well below a
/// hundredth. The rule does not depend on the clock: a render with a target ends at the same iteration on every
/// machine.
const MIN_INTERVAL: u64 = 4;
const INTERVAL_DIVISOR: u64 = 8;

impl ErrorTarget {
    /// Reads `relmse=0.01`.
    ///
    /// # Errors
    /// The expected form, as text.
    pub fn parse(text: &str) -> Result<ErrorTarget, String> {
        let known = || MEASURES.map(|m| m.0).join(", ");
        let (name, value) =
            text.split_once('=').ok_or_else(|| format!("expected MEASURE=VALUE, one of {}", known()))?;
        let found = MEASURES.into_iter().find(|m| m.0 == name);
        let (key, select) = found.ok_or_else(|| format!("unknown measure \"{name}\"; known: {}", known()))?;
        let value = value.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
        Ok(ErrorTarget { key, select, value: value.ok_or("expected an error above zero")? })
    }

    /// The error of the mean of two independent films with equal numbers of iterations, estimated from their
    /// difference.
    pub fn estimate(&self, a: &Film, b: &Film) -> f64 {
        let pictures = [a.mean_f64(), b.mean_f64()];
        let both = pictures[0].iter().zip(&pictures[1]);
        let mean: Vec<[f64; 3]> = both.map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
        (self.select)(&picture_errors(&pictures[0], &mean, a.width as usize))
    }
}

/// The seeds of the two halves.
pub fn half_seeds(seed: u64) -> [u64; 2] {
    [seed, mix64(seed ^ 0xbadc_0ffe_e0dd_f00d)]
}

/// Two halves take turns until the estimated error is below the target or the budget of both is used up.
#[derive(Clone, Copy, Debug)]
pub struct UntilError {
    target: ErrorTarget,
    turns: Alternate,
    /// Iterations of both halves at which the next estimate is due.
    next_estimate: u64,
    latest: Option<f64>,
}

impl UntilError {
    /// A schedule for two halves that have `iterations` iterations together already. The estimates of a resumed
    /// render are due at the iterations at which those of an uninterrupted one are.
    pub fn new(target: ErrorTarget, budget: Budget, iterations: u64) -> UntilError {
        let mut next_estimate = FIRST_ESTIMATE;
        while even(next_estimate) < iterations {
            next_estimate = estimate_after(even(next_estimate));
        }
        UntilError { target, turns: Alternate { budget }, next_estimate, latest: None }
    }

    /// The estimate for the films as they are, or the latest one if the halves are not of equal size.
    pub fn final_estimate(&self, estimators: &[Estimator]) -> Option<f64> {
        equal_halves(estimators).map(|[a, b]| self.target.estimate(a, b)).or(self.latest)
    }
}

/// The films of the halves, if both have had the same number of turns.
fn equal_halves(estimators: &[Estimator]) -> Option<[&Film; 2]> {
    let [a, b] = estimators else { return None };
    let equal = a.film.iterations() == b.film.iterations() && a.film.iterations() > 0;
    equal.then_some([&a.film, &b.film])
}

/// The next even number: halves are compared when both have had their turn.
fn even(iterations: u64) -> u64 {
    iterations.next_multiple_of(2)
}

/// Iterations at which the estimate that follows one at `iterations` is due.
fn estimate_after(iterations: u64) -> u64 {
    iterations + (iterations / INTERVAL_DIVISOR).max(MIN_INTERVAL)
}

impl Schedule for UntilError {
    fn next(&mut self, estimators: &[Estimator], elapsed: Duration) -> Turn {
        let iterations = total_iterations(estimators);
        if iterations >= self.next_estimate
            && let Some([a, b]) = equal_halves(estimators)
        {
            let error = self.target.estimate(a, b);
            self.latest = Some(error);
            self.next_estimate = estimate_after(iterations);
            if error < self.target.value {
                return Turn::Stop(Stop::Converged);
            }
        }
        self.turns.next(estimators, elapsed)
    }

    fn used(&self, estimators: &[Estimator], elapsed: Duration) -> f64 {
        self.turns.used(estimators, elapsed)
    }

    fn error(&self) -> Option<CurrentError> {
        self.latest.map(|value| CurrentError { measure: self.target.key, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_render_makes_its_estimates_when_an_uninterrupted_one_does() {
        let target = ErrorTarget::parse("mse=1").unwrap();
        let due = |iterations: u64| UntilError::new(target, Budget::default(), iterations).next_estimate;
        let mut estimates = vec![FIRST_ESTIMATE];
        while estimates[estimates.len() - 1] < 1000 {
            estimates.push(even(estimate_after(estimates[estimates.len() - 1])));
        }
        for iterations in 0..1000 {
            let next = estimates.iter().copied().find(|&e| e >= iterations).unwrap();
            assert_eq!(even(due(iterations)), next, "{iterations}");
        }
    }
}
