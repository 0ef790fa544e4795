//! Statistics of a render, as JSON with fixed keys.

use super::{Plan, PreparedJob, Rendered};
use crate::film::NonFinite;
use crate::ray::RayKind;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Adds up stretches of wall time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    total: Duration,
}

impl Clock {
    /// Runs `f` on the clock.
    pub fn time<T>(&mut self, f: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let out = f();
        self.total += start.elapsed();
        out
    }

    /// Time so far.
    pub fn total(&self) -> Duration {
        self.total
    }
}

/// Processor seconds of this process so far, all threads, where the system tells (Linux).
pub fn cpu_seconds() -> Option<f64> {
    // Fields 14 and 15 of /proc/self/stat, user and system time in clock ticks; the name in parentheses may hold
    // blanks.
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
    let user: f64 = fields.nth(11)?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    // USER_HZ is 100 on every Linux of today.
    Some((user + system) / 100.0)
}

/// Largest resident memory of this process so far in bytes, where the system tells (Linux).
pub fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kb| kb * 1024)
}

/// An error that is estimated from the picture alone, see [`super::error_target`].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ErrorEstimate {
    /// Measure.
    pub measure: &'static str,
    /// The error to get below.
    pub target: f64,
    /// The estimated error; none if there were too few iterations.
    pub estimate: Option<f64>,
    /// Seeds of the two halves that the estimate compares.
    pub seeds: [u64; 2],
}

impl ErrorEstimate {
    /// True if the estimated error is below the target.
    pub fn is_reached(&self) -> bool {
        self.estimate.is_some_and(|estimate| estimate < self.target)
    }
}

/// The scene in numbers.
#[derive(Clone, Debug, Serialize)]
pub struct SceneStats {
    /// Triangles a ray can meet, instances counted each time.
    pub triangles: usize,
    /// Lights; every emitting triangle is one.
    pub emitters: usize,
    /// Pictures and patterns.
    pub textures: usize,
    /// Names of features.
    pub features: Vec<&'static str>,
}

/// Statistics of one render. The keys are a contract.
#[derive(Clone, Debug, Serialize)]
pub struct RenderStats {
    /// Samples per pixel in the film.
    pub iterations: u64,
    /// Wall seconds of the iterations of this run.
    pub wall_s: f64,
    /// Processor seconds of these iterations, all threads.
    pub cpu_s: Option<f64>,
    /// Wall seconds by phase.
    pub phases: BTreeMap<&'static str, f64>,
    /// Rays by kind.
    pub rays: BTreeMap<&'static str, u64>,
    /// Blocked shadow rays by kind.
    pub blocked: BTreeMap<&'static str, u64>,
    /// Nanoseconds of one thread per ray, by kind (sampled clock).
    pub ns_per_ray: BTreeMap<&'static str, f64>,
    /// Rays per wall second.
    pub rays_per_s: f64,
    /// Share of the render's wall time (all threads) inside ray queries, 0 … 1, each as long as it takes by itself
    /// (see `ray::tracer`).
    pub ray_query_share: f64,
    /// Largest resident memory.
    pub peak_rss_bytes: Option<u64>,
    /// Samples that were not finite and were left out.
    pub non_finite: u64,
    /// Pixels and sources of the first of them.
    pub non_finite_at: Vec<NonFinite>,
    /// Rays with a component that was not finite; not traced.
    pub invalid_rays: u64,
    /// Error target and estimated error, if there is a target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<ErrorEstimate>,
    /// Seed.
    pub seed: u64,
    /// Threads.
    pub threads: usize,
    /// Ray-query backend and its version.
    pub backend: String,
    /// Decisions of the integrator, for people to read.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Why the picture is another than the scene file asks for: what was left out or replaced, by message and place.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scene_changes: Vec<String>,
    /// Integrator.
    pub integrator: &'static str,
    /// Program version.
    pub version: &'static str,
    /// The scene.
    pub scene: SceneStats,
}

impl SceneStats {
    fn new(prepared: &PreparedJob) -> SceneStats {
        let scene = &prepared.scene;
        SceneStats {
            triangles: scene.geometry.triangle_count(),
            emitters: scene.lights.len(),
            textures: prepared.history.textures,
            features: scene.features.names(),
        }
    }
}

impl RenderStats {
    /// Statistics of a render on the threads of the current pool.
    pub fn new(prepared: &PreparedJob, plan: &Plan, rendered: &Rendered) -> RenderStats {
        let (scene, film, outcome) = (&prepared.scene, &rendered.film, &rendered.outcome);
        let threads = rayon::current_num_threads();
        let mut phases = prepared.history.phases.clone();
        let wall = outcome.wall.as_secs_f64();
        phases.insert("render", wall);
        for (name, seconds) in outcome.rays.phases.iter() {
            phases.insert(name, seconds);
        }
        let (non_finite, non_finite_at) = film.non_finite();
        let kinds = || RayKind::ALL.iter().map(|&k| (k.name(), &outcome.rays.kinds[k as usize]));
        let rays = outcome.rays.total();
        RenderStats {
            iterations: film.iterations(),
            wall_s: wall,
            cpu_s: outcome.cpu_seconds,
            phases,
            rays: kinds().filter(|(_, k)| k.rays > 0).map(|(n, k)| (n, k.rays)).collect(),
            blocked: kinds().filter(|(_, k)| k.blocked > 0).map(|(n, k)| (n, k.blocked)).collect(),
            ns_per_ray: kinds()
                .filter(|(_, k)| k.rays > 0)
                .map(|(n, k)| (n, k.seconds() * 1e9 / k.rays as f64))
                .collect(),
            rays_per_s: if wall > 0.0 { rays as f64 / wall } else { 0.0 },
            ray_query_share: if wall > 0.0 { (outcome.rays.seconds() / (wall * threads as f64)).min(1.0) } else { 0.0 },
            peak_rss_bytes: peak_rss_bytes(),
            non_finite,
            non_finite_at,
            invalid_rays: outcome.rays.invalid,
            error: rendered.error,
            seed: plan.seed,
            threads,
            backend: scene.query.describe(),
            notes: outcome.notes.clone(),
            scene_changes: prepared.history.changes.clone(),
            integrator: plan.method.spec.name,
            version: env!("CARGO_PKG_VERSION"),
            scene: SceneStats::new(prepared),
        }
    }
}
