//! Error against time, of several methods side by side.
//!
//! All methods render in turns, see [`EqualTime`]. The clock runs during iterations only: errors are taken while it
//! stands.

use crate::image::flip::ldr_flip;
use crate::image::metrics::picture_errors;
use crate::image::regions::RegionErrors;
use crate::prepared::PreparedScene;
use crate::render::schedule::EqualTime;
use crate::render::{Estimator, Method, run_iterations};
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The errors of one method at one moment. See [`crate::image::Report`] for the measures.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Point {
    /// Samples per pixel.
    pub iterations: u64,
    /// Wall seconds of its iterations.
    pub seconds: f64,
    /// Mean of |d| / (r + 0.01).
    pub mape: f64,
    /// Mean of d² / (r² + 0.01).
    pub relmse: f64,
    /// Mean of d² / (r² + 0.01) without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
    /// relMSE of means of regions.
    #[serde(flatten)]
    pub regions: RegionErrors,
    /// Mean of |d|.
    pub l1: f64,
    /// Mean of d².
    pub mse: f64,
    /// LDR-ꟻLIP.
    pub flip: f64,
    /// Mean of the picture over mean of the reference.
    pub mean_ratio: f64,
}

/// One method with one seed.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// The method's label.
    pub method: String,
    /// Seed.
    pub seed: u64,
    /// At one, two, four, … samples per pixel, and at the end.
    pub points: Vec<Point>,
    /// Rays of the whole run.
    pub rays: u64,
    /// Samples that were not finite.
    pub non_finite: u64,
    /// The picture at the end.
    #[serde(skip)]
    pub picture: Vec<[f64; 3]>,
}

impl Run {
    fn new(method: &Method, seed: u64) -> Run {
        Run { method: method.label.clone(), seed, points: vec![], rays: 0, non_finite: 0, picture: vec![] }
    }

    /// Takes the errors of the picture so far.
    fn measure(&mut self, estimator: &Estimator, reference: &[[f64; 3]]) {
        let film = &estimator.film;
        let picture = film.mean_f64();
        let e = picture_errors(&picture, reference, film.width as usize);
        // Equal black in both pictures keeps a non-finite pixel from spreading through ꟻLIP's filters.
        let finite = |p: &[f64; 3]| p.iter().all(|v| v.is_finite());
        let pair = picture.iter().zip(reference).map(|(a, b)| if finite(b) { (*a, *b) } else { ([0.0; 3], [0.0; 3]) });
        let (a, b): (Vec<_>, Vec<_>) = pair.unzip();
        let flip = ldr_flip(&a, &b, film.width as usize).values;
        self.points.push(Point {
            iterations: film.iterations(),
            seconds: estimator.elapsed().as_secs_f64(),
            mape: e.mape,
            relmse: e.relmse,
            relmse_trimmed: e.relmse_trimmed,
            regions: e.regions,
            l1: e.mae,
            mse: e.mse,
            flip: flip.iter().sum::<f64>() / (flip.len() as f64 - e.non_finite as f64),
            mean_ratio: e.mean_ratio,
        });
    }

    /// Takes the facts that are known at the end alone.
    fn finish(&mut self, estimator: &Estimator) {
        self.rays = estimator.rays().total();
        self.non_finite = estimator.film.non_finite().0;
        self.picture = estimator.film.mean_f64();
    }
}

/// Comparison of methods at equal time.
#[derive(Clone, Copy)]
pub struct EqualTimeTask<'a> {
    /// Scene.
    pub scene: &'a PreparedScene,
    /// Methods.
    pub methods: &'a [Method],
    /// Linear colours of the reference, row by row.
    pub reference: &'a [[f64; 3]],
    /// Wall time of each method with each seed.
    pub time: Duration,
    /// Seeds.
    pub seeds: &'a [u64],
}

/// Runs every method with every seed; the seeds one after the other, since the films of all methods are held at once.
/// After every iteration `watch` hears the part of the time that is used, 0 … 1. Runs on the current thread pool; an
/// interrupt ends it early with the points so far.
pub fn converge(task: &EqualTimeTask, interrupt: &AtomicBool, mut watch: impl FnMut(f64)) -> Vec<Run> {
    let mut finished: Vec<Run> = vec![];
    for (number, &seed) in task.seeds.iter().enumerate() {
        let estimator = |method: &Method| Estimator::new(method.build(), task.scene.window, seed);
        let mut estimators: Vec<Estimator> = task.methods.iter().map(estimator).collect();
        let mut runs: Vec<Run> = task.methods.iter().map(|method| Run::new(method, seed)).collect();
        let mut schedule = EqualTime::new(task.time);
        let rules = schedule;
        run_iterations(task.scene, &mut estimators, &mut schedule, interrupt, &mut |progress, estimators| {
            let estimator = &estimators[progress.estimator];
            if estimator.film.iterations().is_power_of_two() || rules.is_done(estimator) {
                runs[progress.estimator].measure(estimator, task.reference);
            }
            watch((number as f64 + progress.used) / task.seeds.len() as f64);
        });
        runs.iter_mut().zip(&estimators).for_each(|(run, estimator)| run.finish(estimator));
        finished.extend(runs);
        if interrupt.load(Ordering::Relaxed) {
            break;
        }
    }
    finished
}
