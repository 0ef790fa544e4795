//! Scenes × integrators against earlier measurements: is anything slower, or noisier, than it was?
//!
//! Time is seconds per iteration over the time of a piece of plain arithmetic, measured around each scene, which
//! takes out how fast the machine was at the time; error is the relMSE without the worst 0.1 %, and that of the means
//! of 16 × 16 blocks, at the largest number of samples that both measurements have. Equal seeds make equal pictures, so
//! an error that moves means an algorithm that has changed, and how much it may move by chance is known from the spread
//! over seeds.

use super::converge::{Point, Run};
use super::machine::{Load, Machine};
use crate::math::hash::mix64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::hint::black_box;
use std::time::Instant;

/// Standard errors that count as chance.
const SIGMAS: f64 = 3.0;
/// Changes below these tolerances count as none, whatever the spread says.
const TIME_TOLERANCE: f64 = 0.05;
const ERROR_TOLERANCE: f64 = 0.02;

/// One method on one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Scene.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Seconds per iteration, of each seed.
    pub seconds_per_iteration: Vec<f64>,
    /// Nanoseconds of the piece of arithmetic around the measurement.
    pub calibration: f64,
    /// Samples per pixel, and the error of each seed there.
    pub errors: Vec<(u64, Vec<f64>)>,
    /// Samples per pixel, and the relMSE of means of 16 × 16 blocks of each seed there; absent in earlier measurements.
    #[serde(default)]
    pub block_errors: Vec<(u64, Vec<f64>)>,
    /// Samples that were not finite.
    pub non_finite: u64,
}

/// Measurements of one day.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// Machine.
    pub machine: Machine,
    /// Load of the machine by other programs.
    pub load: Load,
    /// Rows.
    pub rows: Vec<Row>,
}

/// Earlier measurements.
#[derive(Clone, Debug, Deserialize)]
pub struct Baseline {
    /// Load of the machine by other programs; absent in earlier measurements.
    #[serde(default)]
    pub load: Option<Load>,
    /// Rows.
    pub rows: Vec<Row>,
}

/// Which numbers two measurements are judged by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judged {
    /// Times and errors.
    All,
    /// Errors alone: other programs used the processors during one of the measurements.
    Errors,
}

impl Judged {
    /// The numbers by which measurements under these loads can be judged.
    pub fn under(loads: [Option<&Load>; 2]) -> Judged {
        match loads.into_iter().flatten().any(|load| load.disturbance().is_some()) {
            true => Judged::Errors,
            false => Judged::All,
        }
    }
}

/// A change of one number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// New over old.
    pub ratio: f64,
    /// Largest ratio that chance explains.
    pub bound: f64,
    /// The ratio is beyond the bound.
    pub regression: bool,
}

/// One row against the same row of the baseline.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Scene.
    pub scene: String,
    /// Method.
    pub method: String,
    /// Seconds per iteration; none if times are not judged.
    pub time: Option<Change>,
    /// Error at equal samples; none if there are no equal numbers of samples.
    pub error: Option<Change>,
    /// Error of 16 × 16 blocks at equal samples; none if one of the measurements has none.
    pub block_error: Option<Change>,
}

impl Row {
    /// From the runs of one method on one scene.
    pub fn new(scene: &str, method: &str, runs: &[&Run], calibration: f64) -> Row {
        let ends = runs.iter().filter_map(|r| r.points.last());
        let first = runs.first().map(|r| r.points.as_slice()).unwrap_or_default();
        let errors = |of: fn(&Point) -> f64| {
            let at = |p: &Point| {
                let same = |r: &&Run| r.points.iter().find(|q| q.iterations == p.iterations).map(of);
                runs.iter().map(same).collect::<Option<Vec<f64>>>().map(|e| (p.iterations, e))
            };
            first.iter().filter(|p| p.iterations.is_power_of_two()).filter_map(at).collect()
        };
        Row {
            scene: scene.into(),
            method: method.into(),
            seconds_per_iteration: ends.map(|p| p.seconds / p.iterations as f64).collect(),
            calibration,
            errors: errors(|p| p.relmse_trimmed),
            block_errors: errors(|p| p.regions.relmse_16x16),
            non_finite: runs.iter().map(|r| r.non_finite).sum(),
        }
    }

    /// Mean seconds per iteration.
    pub fn seconds(&self) -> f64 {
        moments(&self.seconds_per_iteration).0
    }

    /// The largest number of samples with its mean error.
    pub fn last_error(&self) -> Option<(u64, f64)> {
        self.errors.last().map(|(n, e)| (*n, moments(e).0))
    }
}

/// Mean and its standard error.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, if n > 1.0 { (squares / (n * (n - 1.0))).sqrt() } else { 0.0 })
}

fn change(old: (f64, f64), new: (f64, f64), tolerance: f64) -> Change {
    let ratio = new.0 / old.0;
    let spread = ((old.1 / old.0).powi(2) + (new.1 / new.0).powi(2)).sqrt();
    let bound = 1.0 + tolerance + SIGMAS * spread;
    Change { ratio, bound, regression: ratio > bound }
}

/// The change of the errors at the largest number of samples that both have.
fn error_change(old: &[(u64, Vec<f64>)], new: &[(u64, Vec<f64>)]) -> Option<Change> {
    let before = |n: u64| old.iter().find(|e| e.0 == n).map(|e| moments(&e.1));
    let (old, new) = new.iter().rev().find_map(|(n, errors)| Some((before(*n)?, moments(errors))))?;
    Some(change(old, new, ERROR_TOLERANCE))
}

impl Verdict {
    /// Something became worse.
    pub fn is_worse(&self) -> bool {
        [self.time, self.error, self.block_error].into_iter().flatten().any(|e| e.regression)
    }
}

/// Compares every row that both measurements have.
pub fn against(old: &[Row], new: &[Row], judged: Judged) -> Vec<Verdict> {
    let pair = |row: &Row| {
        let before = old.iter().find(|r| r.scene == row.scene && r.method == row.method)?;
        let time = |r: &Row| {
            let (mean, error) = moments(&r.seconds_per_iteration);
            (mean / r.calibration, error / r.calibration)
        };
        Some(Verdict {
            scene: row.scene.clone(),
            method: row.method.clone(),
            time: (judged == Judged::All).then(|| change(time(before), time(row), TIME_TOLERANCE)),
            error: error_change(&before.errors, &row.errors),
            block_error: error_change(&before.block_errors, &row.block_errors),
        })
    };
    new.iter().filter_map(pair).collect()
}

/// Nanoseconds of a step of plain arithmetic while all threads of the current pool do so too: the speed of the
/// machine at the moment.
pub fn calibrate() -> f64 {
    const STEPS: u64 = 4_000_000;
    let start = Instant::now();
    let threads = rayon::current_num_threads();
    (0..threads).into_par_iter().with_max_len(1).for_each(|i| {
        black_box((0..STEPS).fold(i as u64, |h, k| mix64(h ^ k)));
    });
    start.elapsed().as_secs_f64() * 1e9 / STEPS as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(seconds: [f64; 3], calibration: f64, errors: [f64; 3]) -> Row {
        Row {
            scene: "s".into(),
            method: "m".into(),
            seconds_per_iteration: seconds.into(),
            calibration,
            errors: vec![(4, [1.0; 3].into()), (8, errors.into())],
            block_errors: vec![(8, errors.map(|e| 0.01 * e).into())],
            non_finite: 0,
        }
    }

    #[test]
    fn changes_beyond_noise_are_found() {
        let old = row([1.0, 1.01, 0.99], 10.0, [0.5, 0.51, 0.49]);
        let verdict = |new: Row| {
            let judge = |judged| against(std::slice::from_ref(&old), std::slice::from_ref(&new), judged).pop().unwrap();
            let (v, errors) = (judge(Judged::All), judge(Judged::Errors));
            let (time, error) = (v.time.unwrap().regression, v.error.unwrap().regression);
            assert_eq!(error, v.block_error.unwrap().regression);
            assert_eq!(v.is_worse(), time || error);
            assert!(errors.time.is_none() && errors.is_worse() == error);
            (time, error)
        };
        assert_eq!(verdict(old.clone()), (false, false));
        assert_eq!(verdict(row([1.3, 1.31, 1.29], 10.0, [0.5, 0.51, 0.49])), (true, false));
        // The whole machine was slower.
        assert_eq!(verdict(row([1.3, 1.31, 1.29], 13.0, [0.5, 0.51, 0.49])), (false, false));
        // Times like these tell nothing.
        assert_eq!(verdict(row([1.0, 1.9, 0.9], 10.0, [0.5, 0.51, 0.49])), (false, false));
        assert_eq!(verdict(row([1.0, 1.01, 0.99], 10.0, [0.8, 0.81, 0.79])), (false, true));
        assert!(against(&[], &[old], Judged::All).is_empty());
    }

    #[test]
    fn times_of_a_machine_in_use_are_not_judged() {
        let load = |others: f64| Load { seconds: 1.0, average_before: None, average_after: None, others: Some(others) };
        let (quiet, busy) = (load(0.04), load(0.06));
        assert_eq!(Judged::under([Some(&quiet), Some(&quiet)]), Judged::All);
        assert_eq!(Judged::under([None, Some(&quiet)]), Judged::All);
        assert_eq!(Judged::under([Some(&busy), Some(&quiet)]), Judged::Errors);
        assert_eq!(Judged::under([None, Some(&busy)]), Judged::Errors);
    }
}
