//! Profile of one method: its phases, its rays, and the time that bare backends need for the very same rays.

use super::machine::{Load, cpu_time};
use super::recorder::Recorder;
use super::visibility::{CostMap, VisibilityCost};
use super::{LoadWatch, Machine};
use crate::prepared::PreparedScene;
use crate::ray::tracer::KindStats;
use crate::ray::{Backend, QueryError, RayKind, RayQuery, RayStats, Work};
use crate::render::schedule::Alternate;
use crate::render::{Budget, Estimator, JobError, Method, Outcome, Stop, run_iterations};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Rays of one kind.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct KindRow {
    /// Rays.
    pub rays: u64,
    /// Nanoseconds of one thread for each (sampled clock).
    pub ns: f64,
    /// Share of all rays.
    pub share: f64,
    /// Share of shadow rays that were blocked; none for other rays.
    pub blocked: Option<f64>,
}

/// The rays of one iteration through a bare backend, on as many threads as they came from.
#[derive(Clone, Debug, Serialize)]
pub struct ReplayRow {
    /// Backend.
    pub backend: String,
    /// Processor nanoseconds for each ray, median of the rounds.
    pub ns_per_ray: f64,
    /// Share of the renderer's processor time for the same number of rays, median of the rounds, each beside an
    /// iteration of its own.
    pub share: f64,
    /// Rays that met something.
    pub met: u64,
}

/// Profile of a method on a scene. The keys are a contract.
#[derive(Clone, Debug, Serialize)]
pub struct Profile {
    /// Scene file.
    pub scene: String,
    /// Width and height of what was rendered.
    pub size: [u32; 2],
    /// Method.
    pub method: String,
    /// Parameters of the method.
    pub parameters: String,
    /// Seed.
    pub seed: u64,
    /// Iterations timed.
    pub iterations: u64,
    /// Wall seconds of the iterations.
    pub wall_s: f64,
    /// Processor seconds of the iterations, all threads.
    pub cpu_s: f64,
    /// Wall seconds by phase of the integrator.
    pub phases: BTreeMap<&'static str, f64>,
    /// Wall seconds of work inside of phases (sampled clock, processor seconds over threads; ray queries in between
    /// included). Connections include their weights.
    pub work: BTreeMap<&'static str, f64>,
    /// Rays by kind.
    pub rays: BTreeMap<&'static str, KindRow>,
    /// Millions of rays per wall second.
    pub mrays_per_s: f64,
    /// Processor nanoseconds per ray, all included.
    pub ns_per_ray: f64,
    /// Share of the processor time inside ray queries (sampled clock).
    pub query_share: f64,
    /// Share of all shadow rays that were blocked: contributions that visibility made zero.
    pub shadow_blocked: f64,
    /// Rays of one iteration: replayed, and left out for lack of memory.
    pub replayed: [u64; 2],
    /// The replay of these rays, by backend.
    pub replay: Vec<ReplayRow>,
    /// Share of the renderer's time beyond the bare queries of the backend in use.
    pub ours: Option<f64>,
    /// Cost of visibility, from single samples.
    #[serde(rename = "wasted")]
    pub visibility: VisibilityCost,
    /// Samples that were not finite.
    pub non_finite: u64,
    /// Machine.
    pub machine: Machine,
    /// Load of the machine by other programs.
    pub load: Load,
}

/// Rounds of the replay.
const ROUNDS: usize = 5;

/// Method, scene and time to profile.
pub struct Task<'a> {
    /// Name of the scene.
    pub scene: String,
    /// Method.
    pub method: &'a Method,
    /// Seed.
    pub seed: u64,
    /// Time for the iterations; the replay and the maps come on top.
    pub time: Duration,
    /// Threads of the pool.
    pub threads: usize,
}

/// Result of profiling.
pub struct Profiled {
    /// Numbers.
    pub profile: Profile,
    /// The picture after the timed iterations, row by row.
    pub picture: Vec<[f64; 3]>,
    /// Cost and visibility by pixel.
    pub map: CostMap,
}

/// Profiles a method on a scene; runs on the current thread pool.
///
/// # Errors
/// If a backend for the replay cannot be built, or the iterations are interrupted.
pub fn profile(scene: &mut PreparedScene, task: &Task, interrupt: &AtomicBool) -> Result<Profiled, JobError> {
    let watch = LoadWatch::start();
    let mut estimator = Estimator::new(task.method.build(), scene.window, task.seed);
    let mut schedule = Alternate { budget: Budget { iterations: None, time: Some(task.time) } };
    let (cpu_ns, outcome) = cpu_time(task.threads, || {
        run_iterations(scene, std::slice::from_mut(&mut estimator), &mut schedule, interrupt, &mut |_, _| {})
    });
    if outcome.stop == Stop::Interrupted {
        return Err(JobError::Interrupted);
    }
    let picture = estimator.film.mean_f64();
    let non_finite = estimator.film.non_finite().0;
    let replay = replay(scene, &mut estimator, task).map_err(JobError::input)?;
    let map = CostMap::measure(scene, task.method, task.seed, task.time / 4);
    let facts = Facts { task, outcome: &outcome, cpu_ns, non_finite, replay, map: &map, load: watch.finish() };
    Ok(Profiled { profile: facts.profile(scene), picture, map })
}

/// Everything that a [`Profile`] is put together from.
struct Facts<'a> {
    task: &'a Task<'a>,
    outcome: &'a Outcome,
    /// Processor nanoseconds of the iterations, all threads.
    cpu_ns: f64,
    non_finite: u64,
    replay: Replay,
    map: &'a CostMap,
    load: Load,
}

impl Facts<'_> {
    fn profile(self, scene: &PreparedScene) -> Profile {
        let Facts { task, cpu_ns, .. } = self;
        let stats = &self.outcome.rays;
        let (wall, rays) = (self.outcome.wall.as_secs_f64(), stats.total());
        let work = Work::ALL.into_iter().filter(|&w| stats.work[w as usize].calls > 0);
        Profile {
            scene: task.scene.clone(),
            size: [scene.window[2], scene.window[3]],
            method: task.method.label.clone(),
            parameters: task.method.parameters(),
            seed: task.seed,
            iterations: self.outcome.iterations,
            wall_s: wall,
            cpu_s: cpu_ns * 1e-9,
            phases: stats.phases.iter().collect(),
            work: work.map(|w| (w.name(), stats.work[w as usize].seconds() / task.threads.max(1) as f64)).collect(),
            rays: RayKind::ALL.into_iter().filter_map(|kind| kind_row(stats, kind)).collect(),
            mrays_per_s: rays as f64 / wall / 1e6,
            ns_per_ray: cpu_ns / rays.max(1) as f64,
            query_share: (stats.seconds() * 1e9 / cpu_ns).min(1.0),
            shadow_blocked: shadow_sum(stats, |k| k.blocked) as f64 / shadow_sum(stats, |k| k.rays).max(1) as f64,
            replayed: self.replay.rays,
            ours: self.replay.rows.first().map(|r| 1.0 - r.share),
            replay: self.replay.rows,
            visibility: self.map.visibility_cost(),
            non_finite: self.non_finite,
            machine: Machine::here(task.threads, scene.query.describe()),
            load: self.load,
        }
    }
}

/// Sum over all kinds of shadow rays.
fn shadow_sum(stats: &RayStats, of: fn(&KindStats) -> u64) -> u64 {
    RayKind::ALL.iter().filter(|k| k.is_shadow()).map(|&k| of(&stats.kinds[k as usize])).sum()
}

/// The row of a kind of rays, if there were any.
fn kind_row(stats: &RayStats, kind: RayKind) -> Option<(&'static str, KindRow)> {
    let k = &stats.kinds[kind as usize];
    let blocked = kind.is_shadow().then_some(k.blocked as f64 / k.rays as f64);
    let (ns, share) = (k.seconds() * 1e9 / k.rays as f64, k.rays as f64 / stats.total() as f64);
    (k.rays > 0).then_some((kind.name(), KindRow { rays: k.rays, ns, share, blocked }))
}

/// Rays of one iteration, sent through bare backends.
struct Replay {
    rows: Vec<ReplayRow>,
    /// Rays replayed, and rays left out for lack of memory.
    rays: [u64; 2],
}

/// Records one iteration; then iterations and replays of the recording take turns.
fn replay(scene: &mut PreparedScene, estimator: &mut Estimator, task: &Task) -> Result<Replay, QueryError> {
    // The backend in use goes behind the recorder and comes back afterwards.
    let bare: Arc<dyn RayQuery> = Arc::from(std::mem::replace(&mut scene.query, Box::new(NoBackend)));
    let (recorder, tape) = Recorder::new(bare.clone(), task.threads);
    scene.query = Box::new(recorder);
    estimator.iterate(scene);
    scene.query = Box::new(bare.clone());
    let recording = tape.take();

    let mut backends = vec![bare.clone()];
    for other in [Backend::default_available(), Backend::Obvhs] {
        let built: Arc<dyn RayQuery> = Arc::from(other.build(scene.geometry.clone(), task.threads)?);
        if backends.iter().all(|b| b.describe() != built.describe()) {
            backends.push(built);
        }
    }
    let mut rounds: Vec<Vec<Round>> = vec![vec![]; backends.len()];
    let mut met = vec![0; backends.len()];
    for _ in 0..ROUNDS {
        let (iteration_ns, stats) = cpu_time(task.threads, || estimator.iterate(scene));
        let iteration_ns_per_ray = iteration_ns / stats.total().max(1) as f64;
        for (i, backend) in backends.iter().enumerate() {
            let (ns, hits) = cpu_time(task.threads, || recording.play(&**backend));
            let ns_per_ray = ns / recording.rays().max(1) as f64;
            rounds[i].push(Round { ns_per_ray, share: ns_per_ray / iteration_ns_per_ray });
            met[i] = hits;
        }
    }
    let rows = backends.iter().zip(rounds).zip(met).map(|((backend, rounds), met)| ReplayRow {
        backend: backend.describe(),
        ns_per_ray: median(rounds.iter().map(|r| r.ns_per_ray).collect()),
        share: median(rounds.iter().map(|r| r.share).collect()),
        met,
    });
    Ok(Replay { rows: rows.collect(), rays: [recording.rays(), recording.beyond()] })
}

/// One replay beside one iteration.
#[derive(Clone, Copy)]
struct Round {
    /// Processor nanoseconds of the bare backend for each ray.
    ns_per_ray: f64,
    /// Part of the renderer's processor time for as many rays.
    share: f64,
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Stands in while backends change places.
struct NoBackend;

impl RayQuery for NoBackend {
    fn describe(&self) -> String {
        "no backend".into()
    }
    fn closest_of(&self, _: &crate::ray::Ray, _: crate::ray::SurfaceMask) -> Option<crate::ray::Hit> {
        None
    }
    fn occluded(&self, _: &crate::ray::Ray, _: crate::ray::SurfaceMask) -> bool {
        false
    }
}
