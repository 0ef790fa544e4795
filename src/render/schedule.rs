//! Budgets, and who iterates next within one.

use super::estimator::Estimator;
use super::iterations::{Schedule, Stop, Turn};
use std::time::Duration;

/// Limits of a run; the first to be reached ends it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Budget {
    /// Iterations (samples per pixel) in all, those of a resumed checkpoint included.
    pub iterations: Option<u64>,
    /// Wall time of this run. Loading and preparing the scene does not count.
    pub time: Option<Duration>,
}

impl Budget {
    /// True if no further iteration may start. `iterations` counts all of them, `new_iterations` those of this run,
    /// which took the wall time `elapsed`. The next iteration is expected to take as long as the mean of these: one
    /// that would overshoot is not started, except for the first.
    pub fn used_up(&self, iterations: u64, new_iterations: u64, elapsed: Duration) -> bool {
        let mean = elapsed.checked_div(u32::try_from(new_iterations).unwrap_or(u32::MAX));
        let late = |time| mean.is_some_and(|mean| elapsed + mean > time);
        self.iterations.is_some_and(|n| iterations >= n) || self.time.is_some_and(late)
    }

    /// Part of the budget that is used, 0 … 1.
    pub fn used(&self, iterations: u64, elapsed: Duration) -> f64 {
        let by_iterations = self.iterations.map_or(0.0, |n| iterations as f64 / n.max(1) as f64);
        let by_time = self.time.map_or(0.0, |t| elapsed.as_secs_f64() / t.as_secs_f64().max(1e-9));
        by_iterations.max(by_time).min(1.0)
    }
}

/// Estimators take turns and share one budget: the one with the fewest iterations is next.
#[derive(Clone, Copy, Debug)]
pub struct Alternate {
    /// Budget of all estimators together.
    pub budget: Budget,
}

impl Schedule for Alternate {
    fn next(&mut self, estimators: &[Estimator], elapsed: Duration) -> Turn {
        let new_iterations = estimators.iter().map(Estimator::new_iterations).sum();
        if self.budget.used_up(total_iterations(estimators), new_iterations, elapsed) {
            return Turn::Stop(Stop::Budget);
        }
        let next = (0..estimators.len()).min_by_key(|&i| estimators[i].film.iterations());
        next.map_or(Turn::Stop(Stop::Budget), Turn::Iterate)
    }

    fn used(&self, estimators: &[Estimator], elapsed: Duration) -> f64 {
        self.budget.used(total_iterations(estimators), elapsed)
    }
}

/// Iterations in the films of all estimators.
pub(super) fn total_iterations(estimators: &[Estimator]) -> u64 {
    estimators.iter().map(|e| e.film.iterations()).sum()
}

/// Wall time that an estimator keeps its turn under [`EqualTime`].
const SLICE: Duration = Duration::from_millis(100);

/// Every estimator has the same budget of wall time. Of those with time left, the one that has used least is next,
/// for a slice of time: a machine that becomes slower or busier does so for all of them.
#[derive(Clone, Copy, Debug)]
pub struct EqualTime {
    budget: Budget,
    /// Index of the estimator whose turn it is, and its elapsed time at the end of the slice.
    slice: Option<(usize, Duration)>,
}

impl EqualTime {
    /// A schedule that gives each estimator the wall time `time`.
    pub fn new(time: Duration) -> EqualTime {
        EqualTime { budget: Budget { iterations: None, time: Some(time) }, slice: None }
    }

    /// True if the estimator's time is used up.
    pub fn is_done(&self, estimator: &Estimator) -> bool {
        self.budget.used_up(estimator.film.iterations(), estimator.new_iterations(), estimator.elapsed())
    }
}

impl Schedule for EqualTime {
    fn next(&mut self, estimators: &[Estimator], _elapsed: Duration) -> Turn {
        if let Some((i, end)) = self.slice
            && estimators[i].elapsed() < end
            && !self.is_done(&estimators[i])
        {
            return Turn::Iterate(i);
        }
        let unfinished = (0..estimators.len()).filter(|&i| !self.is_done(&estimators[i]));
        let next = unfinished.min_by_key(|&i| estimators[i].elapsed());
        self.slice = next.map(|i| (i, estimators[i].elapsed() + SLICE));
        next.map_or(Turn::Stop(Stop::Budget), Turn::Iterate)
    }

    fn used(&self, estimators: &[Estimator], _elapsed: Duration) -> f64 {
        let used = |e: &Estimator| self.budget.used(e.film.iterations(), e.elapsed());
        estimators.iter().map(used).sum::<f64>() / estimators.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_iteration_that_would_overshoot_is_not_started() {
        let seconds = Duration::from_secs;
        let budget = Budget { iterations: None, time: Some(seconds(10)) };
        // The first iteration of a run always starts, however many an earlier run has made.
        assert!(!budget.used_up(1000, 0, seconds(0)));
        assert!(!budget.used_up(4, 4, seconds(8)));
        assert!(budget.used_up(4, 4, seconds(9)));
        assert_eq!(budget.used(4, seconds(4)), 0.4);
        let both = Budget { iterations: Some(4), ..budget };
        assert!(both.used_up(4, 4, seconds(1)) && both.used_up(4, 0, seconds(0)) && !both.used_up(3, 3, seconds(1)));
        assert_eq!((both.used(2, seconds(1)), both.used(4, seconds(20))), (0.5, 1.0));
        assert!(!Budget::default().used_up(u64::MAX, u64::MAX, seconds(1)));
    }
}
