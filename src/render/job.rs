//! The pipeline from a scene file to pictures. Every command of the program is made of its steps:
//!
//! ```text
//! file → SceneDesc → Plan    → PreparedScene → integrator.iterate(k) → Film → EXR / PNG / JSON
//!      load        resolve   prepare           run                          finish
//! ```
//!
//! `render` takes all five steps. `info` and `check-rays` end with a prepared scene, `replay` runs a single sample of
//! it, and `converge`, `bench` and `profile` resolve and run several methods on one prepared scene.

use super::stats::Clock;
use super::{Finished, JobError, Method, Plan, RenderRequest, Rendered, Runtime, SceneRequest};
use crate::load::load_scene;
use crate::prepared::{PrepareOptions, PreparedScene};
use crate::scene::{Diagnostic, Diagnostics, SceneDesc};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Renders a scene file and writes everything that the request names.
///
/// # Errors
/// If there is no picture. Files that cannot be written after rendering are reported in [`Finished`].
pub fn render(request: &RenderRequest, runtime: Runtime) -> Result<Finished, JobError> {
    request.check_files()?;
    let mut loaded = load(&request.scene, runtime)?;
    request.check_scene_files(&loaded.desc)?;
    let plan = resolve(request, &mut loaded)?;
    let prepared = prepare(loaded, &request.prepare, runtime)?;
    prepared.check_method(&plan.method, runtime);
    let rendered = run(&prepared, &plan, runtime)?;
    Ok(finish(&prepared, &plan, rendered, request, runtime))
}

/// A scene as its file describes it.
pub struct LoadedScene {
    /// Scene file.
    pub file: PathBuf,
    /// Description of the scene.
    pub desc: SceneDesc,
    /// Diagnostics that the observer has not heard yet.
    pub diagnostics: Diagnostics,
    /// Why the picture is another than the file asks for.
    changes: Vec<String>,
    /// Wall seconds of loading.
    seconds: f64,
}

/// A scene that is ready for rays.
pub struct PreparedJob {
    /// Scene file.
    pub file: PathBuf,
    /// Prepared scene.
    pub scene: PreparedScene,
    /// Facts about loading and preparing.
    pub(super) history: History,
}

/// Facts about loading and preparing, for statistics.
#[derive(Clone, Debug)]
pub(super) struct History {
    /// Pictures and patterns of the description.
    pub textures: usize,
    /// Why the picture is another than the file asks for.
    pub changes: Vec<String>,
    /// Wall seconds by phase.
    pub phases: BTreeMap<&'static str, f64>,
}

/// Step 1: reads the scene file.
///
/// # Errors
/// If a file cannot be read or is wrong.
pub fn load(request: &SceneRequest, runtime: Runtime) -> Result<LoadedScene, JobError> {
    let mut clock = Clock::default();
    let (desc, diagnostics) = clock.time(|| runtime.pool.install(|| load_scene(&request.file, &request.options)))?;
    runtime.observer.diagnostics(&diagnostics);
    let (file, seconds) = (request.file.clone(), clock.total().as_secs_f64());
    let changes = diagnostics.changing_picture().list.iter().map(Diagnostic::line).collect();
    Ok(LoadedScene { file, desc, diagnostics: Diagnostics::default(), changes, seconds })
}

/// Step 2: fills in what the request leaves open.
///
/// # Errors
/// If the integrator or a parameter of the request does not exist.
pub fn resolve(request: &RenderRequest, loaded: &mut LoadedScene) -> Result<Plan, JobError> {
    request.resolve(&loaded.desc, &mut loaded.diagnostics)
}

/// Step 3: makes the scene ready for rays.
///
/// # Errors
/// If the scene cannot be rendered, or not as the options ask.
pub fn prepare(loaded: LoadedScene, options: &PrepareOptions, runtime: Runtime) -> Result<PreparedJob, JobError> {
    let LoadedScene { file, desc, mut diagnostics, changes, seconds } = loaded;
    let textures = desc.textures.len();
    let mut clock = Clock::default();
    let scene = clock.time(|| runtime.pool.install(|| PreparedScene::build(desc, options, &mut diagnostics)));
    runtime.observer.diagnostics(&diagnostics);
    let scene = scene.map_err(JobError::input)?;
    let prepare = clock.total().as_secs_f64();
    let phases = BTreeMap::from([("load", seconds), ("prepare", prepare), ("tree", scene.tree_seconds)]);
    Ok(PreparedJob { file, scene, history: History { textures, changes, phases } })
}

impl PreparedJob {
    /// Warns of a method that leaves light of the scene out.
    pub fn check_method(&self, method: &Method, runtime: Runtime) {
        if let Some(limitation) = method.limitation(&self.scene) {
            runtime.observer.warning(&format!("{}: {limitation}", method.label));
        }
    }
}

/// Step 4: runs iterations until the plan's limits are reached, see [`super::run`].
///
/// # Errors
/// If a checkpoint cannot be resumed, or the run was interrupted before its first iteration.
pub fn run(prepared: &PreparedJob, plan: &Plan, runtime: Runtime) -> Result<Rendered, JobError> {
    super::run::run(&prepared.scene, plan, runtime)
}

/// Step 5: writes pictures and statistics, see [`super::output`].
pub fn finish(
    prepared: &PreparedJob,
    plan: &Plan,
    rendered: Rendered,
    request: &RenderRequest,
    runtime: Runtime,
) -> Finished {
    runtime.pool.install(|| super::output::write_all(prepared, plan, rendered, request))
}
