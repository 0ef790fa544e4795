//! Where the time of one method goes: its phases, its rays, and how much of it bare backends need for the very same rays.

use super::machine::{Load, cpu_time};
use super::recorder::Recorder;
use super::visibility::{CostMap, Wasted, cost_map};
use super::{Contender, LoadWatch, Machine};
use crate::film::Film;
use crate::integrators::{Integrator, Iteration};
use crate::prepared::PreparedScene;
use crate::ray::{Backend, QueryError, RayKind, RayStats, Work};
use crate::render::stats::Clock;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
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
    /// Of shadow rays, the share that was blocked.
    pub blocked: Option<f64>,
}

/// The rays of one iteration through a bare backend, on as many threads as they came from.
#[derive(Clone, Debug, Serialize)]
pub struct ReplayRow {
    /// Backend.
    pub backend: String,
    /// Processor nanoseconds for each ray, median of the rounds.
    pub ns_per_ray: f64,
    /// Share of the renderer's processor time for the same number of rays, median of the rounds, each beside an iteration of its own.
    pub share: f64,
    /// Rays that met something.
    pub met: u64,
}

/// Everything that was found out. The keys are a contract.
#[derive(Clone, Debug, Serialize)]
pub struct Profile {
    /// Scene file.
    pub scene: String,
    /// Width and height of what was rendered.
    pub size: [u32; 2],
    /// Method.
    pub method: String,
    /// Its parameters.
    pub parameters: String,
    /// Seed.
    pub seed: u64,
    /// Iterations timed.
    pub iterations: u64,
    /// Wall seconds of these.
    pub wall_s: f64,
    /// Processor seconds of these, all threads.
    pub cpu_s: f64,
    /// Wall seconds by phase, as far as the integrator tells phases apart.
    pub phases: BTreeMap<&'static str, f64>,
    /// Wall seconds of work inside of phases (sampled clock, processor seconds over threads; ray queries in between included).
    /// Connections include their weights.
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
    /// Rays replayed, and those of the iteration that there was no room for.
    pub replayed: [u64; 2],
    /// The replay.
    pub replay: Vec<ReplayRow>,
    /// The share of the time that is not the bare queries' of the backend in use: ours to remove.
    pub ours: Option<f64>,
    /// What single samples tell of visibility.
    pub wasted: Wasted,
    /// Samples that were not finite.
    pub non_finite: u64,
    /// Machine.
    pub machine: Machine,
    /// Who else used it.
    pub load: Load,
}

/// Rounds of the replay.
const ROUNDS: usize = 5;

/// What is to be profiled.
pub struct Task<'a> {
    /// Name of the scene.
    pub scene: String,
    /// Method.
    pub method: &'a Contender,
    /// Seed.
    pub seed: u64,
    /// Time for the iterations; the replay and the maps come on top.
    pub time: Duration,
    /// Threads of the pool.
    pub threads: usize,
}

/// Profiles a method on a scene; the pool is the current one. The film and the maps are for pictures.
///
/// # Errors
/// If a backend for the replay cannot be built.
pub fn profile(scene: &mut PreparedScene, task: &Task) -> Result<(Profile, Film, CostMap), QueryError> {
    let watch = LoadWatch::start();
    let mut integrator = (task.method.spec.build)(&task.method.params);
    let mut film = Film::new(scene.window);
    let (mut clock, mut stats) = (Clock::default(), RayStats::default());
    let mut cpu = 0.0;
    while film.iterations() == 0 || clock.total().mul_f64(1.0 + 1.0 / film.iterations() as f64) < task.time {
        let iteration = Iteration { scene, seed: task.seed, index: film.begin_iteration() };
        let (ns, found) = cpu_time(task.threads, || clock.time(|| integrator.iterate(&iteration, &mut film)));
        stats.merge(&found);
        cpu += ns;
    }
    let (replay, replayed) = replay(scene, &mut *integrator, &mut film.clone(), task)?;
    let map = cost_map(scene, task.method, task.seed, task.time / 4);

    let (wall, rays) = (clock.total().as_secs_f64(), stats.total());
    let shadow = |of: fn(&crate::ray::tracer::KindStats) -> u64| -> u64 {
        RayKind::ALL.iter().filter(|k| k.is_shadow()).map(|&k| of(&stats.kinds[k as usize])).sum()
    };
    let row = |kind: RayKind| {
        let k = &stats.kinds[kind as usize];
        let blocked = kind.is_shadow().then_some(k.blocked as f64 / k.rays as f64);
        let (ns, share) = (k.seconds() * 1e9 / k.rays as f64, k.rays as f64 / rays as f64);
        (k.rays > 0).then_some((kind.name(), KindRow { rays: k.rays, ns, share, blocked }))
    };
    let profile = Profile {
        scene: task.scene.clone(),
        size: [scene.window[2], scene.window[3]],
        method: task.method.label.clone(),
        parameters: task.method.parameters(),
        seed: task.seed,
        iterations: film.iterations(),
        wall_s: wall,
        phases: stats.phases.iter().collect(),
        work: Work::ALL
            .into_iter()
            .filter(|&w| stats.work[w as usize].calls > 0)
            .map(|w| (w.name(), stats.work[w as usize].seconds() / task.threads.max(1) as f64))
            .collect(),
        rays: RayKind::ALL.into_iter().filter_map(row).collect(),
        mrays_per_s: rays as f64 / wall / 1e6,
        cpu_s: cpu * 1e-9,
        ns_per_ray: cpu / rays.max(1) as f64,
        query_share: (stats.seconds() * 1e9 / cpu).min(1.0),
        shadow_blocked: shadow(|k| k.blocked) as f64 / shadow(|k| k.rays).max(1) as f64,
        replayed,
        ours: replay.first().map(|r| 1.0 - r.share),
        replay,
        wasted: map.wasted(),
        non_finite: film.non_finite().0,
        machine: Machine::here(task.threads, scene.query.describe()),
        load: watch.finish(),
    };
    Ok((profile, film, map))
}

/// Records one iteration, then lets iterations and replays take turns.
fn replay(
    scene: &mut PreparedScene,
    integrator: &mut dyn Integrator,
    film: &mut Film,
    task: &Task,
) -> Result<(Vec<ReplayRow>, [u64; 2]), QueryError> {
    // The backend in use goes behind the recorder and comes back afterwards.
    let bare: Arc<dyn crate::ray::RayQuery> = Arc::from(std::mem::replace(&mut scene.query, Box::new(Nothing)));
    let (recorder, tape) = Recorder::new(bare.clone(), task.threads);
    scene.query = Box::new(recorder);
    integrator.iterate(&Iteration { scene, seed: task.seed, index: film.begin_iteration() }, film);
    scene.query = Box::new(bare.clone());
    let recording = tape.take();

    let mut backends = vec![bare.clone()];
    for other in [Backend::default_available(), Backend::Obvhs] {
        let built: Arc<dyn crate::ray::RayQuery> = Arc::from(other.build(scene.geometry.clone(), task.threads)?);
        if backends.iter().all(|b| b.describe() != built.describe()) {
            backends.push(built);
        }
    }
    let mut rounds: Vec<Vec<(f64, f64)>> = vec![vec![]; backends.len()];
    let mut met = vec![0; backends.len()];
    for _ in 0..ROUNDS {
        let own = own_ns(scene, integrator, film, task);
        for (i, backend) in backends.iter().enumerate() {
            let (ns, hits) = cpu_time(task.threads, || recording.play(&**backend));
            let ns = ns / recording.rays().max(1) as f64;
            rounds[i].push((ns, ns / own));
            met[i] = hits;
        }
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let rows = backends.iter().zip(rounds).zip(met).map(|((backend, rounds), met)| ReplayRow {
        backend: backend.describe(),
        ns_per_ray: median(rounds.iter().map(|r| r.0).collect()),
        share: median(rounds.iter().map(|r| r.1).collect()),
        met,
    });
    Ok((rows.collect(), [recording.rays(), recording.beyond()]))
}

/// Processor nanoseconds per ray in a whole iteration.
fn own_ns(scene: &PreparedScene, integrator: &mut dyn Integrator, film: &mut Film, task: &Task) -> f64 {
    let iteration = Iteration { scene, seed: task.seed, index: film.begin_iteration() };
    let (ns, stats) = cpu_time(task.threads, || integrator.iterate(&iteration, film));
    ns / stats.total().max(1) as f64
}

/// Stands in while backends change places.
struct Nothing;

impl crate::ray::RayQuery for Nothing {
    fn describe(&self) -> String {
        "nothing".into()
    }
    fn closest(&self, _: &crate::ray::Ray) -> Option<crate::ray::Hit> {
        None
    }
    fn occluded(&self, _: &crate::ray::Ray) -> bool {
        false
    }
}
