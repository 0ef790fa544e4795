//! Error against time, of several methods side by side.
//!
//! Of the methods that still have time left the one that has used least renders next, for a slice: a machine that becomes slower or
//! busier does so for all of them. The clock runs during iterations only; errors are taken while it stands.

use super::Contender;
use crate::film::Film;
use crate::image::flip::ldr_flip;
use crate::image::metrics::pixel_errors;
use crate::integrators::{Integrator, Iteration};
use crate::prepared::PreparedScene;
use crate::ray::RayStats;
use crate::render::stats::Clock;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A method goes on for so long before the next has its turn.
const SLICE: Duration = Duration::from_millis(100);

/// The errors of one method at one moment. See [`crate::image::Report`] for the measures.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Point {
    /// Samples per pixel.
    pub iterations: u64,
    /// Wall seconds of its iterations.
    pub seconds: f64,
    /// Mean of |d| / (r + 0.01).
    pub mape: f64,
    /// Mean of d² / (r² + 0.01).
    pub relmse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
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

struct Racer {
    run: Run,
    integrator: Box<dyn Integrator>,
    film: Film,
    clock: Clock,
    stats: RayStats,
    done: bool,
}

impl Racer {
    /// Iterates for a slice, or until the budget is used up.
    fn go(&mut self, scene: &PreparedScene, reference: &[[f64; 3]], time: Duration) {
        let end = self.clock.total() + SLICE;
        while self.clock.total() < end {
            let iteration = Iteration { scene, seed: self.run.seed, index: self.film.begin_iteration() };
            let (integrator, film) = (&mut self.integrator, &mut self.film);
            let stats = self.clock.time(|| integrator.iterate(&iteration, film));
            self.stats.merge(&stats);
            let n = self.film.iterations();
            // An iteration that would overshoot is not started.
            self.done = self.clock.total().mul_f64((n + 1) as f64 / n as f64) > time;
            if n.is_power_of_two() || self.done {
                self.note(reference, scene.window[2] as usize);
            }
            if self.done {
                return;
            }
        }
    }

    fn note(&mut self, reference: &[[f64; 3]], width: usize) {
        let picture = self.film.mean_f64();
        let e = pixel_errors(&picture, reference);
        // Equal black in both pictures keeps a non-finite pixel from spreading through ꟻLIP's filters.
        let finite = |p: &[f64; 3]| p.iter().all(|v| v.is_finite());
        let pair = picture.iter().zip(reference).map(|(a, b)| if finite(b) { (*a, *b) } else { ([0.0; 3], [0.0; 3]) });
        let (a, b): (Vec<_>, Vec<_>) = pair.unzip();
        let flip = ldr_flip(&a, &b, width).values;
        self.run.points.push(Point {
            iterations: self.film.iterations(),
            seconds: self.clock.total().as_secs_f64(),
            mape: e.mape,
            relmse: e.relmse,
            relmse_trimmed: e.relmse_trimmed,
            l1: e.mae,
            mse: e.mse,
            flip: flip.iter().sum::<f64>() / (flip.len() as f64 - e.non_finite as f64),
            mean_ratio: e.mean_ratio,
        });
    }
}

/// Races every method with every seed, `time` each; the seeds one after the other, since all films of one are held at once. After
/// every slice `watch` hears the seconds rendered so far. Runs on the current thread pool; an interrupt ends it early with
/// whatever there is.
pub fn converge(
    scene: &PreparedScene,
    contenders: &[Contender],
    reference: &[[f64; 3]],
    (time, seeds): (Duration, &[u64]),
    interrupt: &AtomicBool,
    mut watch: impl FnMut(f64),
) -> Vec<Run> {
    let (mut runs, mut before) = (vec![], 0.0);
    for &seed in seeds {
        let mut racers: Vec<Racer> = contenders
            .iter()
            .map(|contender| Racer {
                run: Run {
                    method: contender.label.clone(),
                    seed,
                    points: vec![],
                    rays: 0,
                    non_finite: 0,
                    picture: vec![],
                },
                integrator: (contender.spec.build)(&contender.params),
                film: Film::new(scene.window),
                clock: Clock::default(),
                stats: RayStats::default(),
                done: false,
            })
            .collect();
        while let Some(next) = racers.iter_mut().filter(|r| !r.done).min_by_key(|r| r.clock.total()) {
            if interrupt.load(Ordering::Relaxed) {
                break;
            }
            next.go(scene, reference, time);
            watch(before + racers.iter().map(|r| r.clock.total().as_secs_f64()).sum::<f64>());
        }
        before += racers.iter().map(|r| r.clock.total().as_secs_f64()).sum::<f64>();
        runs.extend(racers.into_iter().map(|mut racer| {
            racer.run.rays = racer.stats.total();
            racer.run.non_finite = racer.film.non_finite().0;
            racer.run.picture = racer.film.mean_f64();
            racer.run
        }));
        if interrupt.load(Ordering::Relaxed) {
            break;
        }
    }
    runs
}
