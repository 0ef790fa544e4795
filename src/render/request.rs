//! Requests: what a user asks for, and the plan that it makes together with the scene file.

use super::{Aov, Budget, ErrorTarget, JobError, Method, MethodRequest};
use crate::load::LoadOptions;
use crate::prepared::PrepareOptions;
use crate::scene::{Diagnostics, SceneDesc};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Samples per pixel if neither the request nor the scene says.
const DEFAULT_SPP: u64 = 64;
/// Least wall time between two checkpoints if the request does not say.
pub const DEFAULT_CHECKPOINT_INTERVAL: Duration = Duration::from_secs(60);

/// A scene file and how it is read.
#[derive(Clone, Debug)]
pub struct SceneRequest {
    /// Scene file.
    pub file: PathBuf,
    /// Options of the loader.
    pub options: LoadOptions,
}

/// A render from a scene file to pictures.
#[derive(Clone, Debug)]
pub struct RenderRequest {
    /// Scene.
    pub scene: SceneRequest,
    /// Backend, threads, size and window.
    pub prepare: PrepareOptions,
    /// Integrator and parameters.
    pub method: MethodRequest,
    /// Seed.
    pub seed: u64,
    /// Samples per pixel.
    pub spp: Option<u64>,
    /// Wall time of the iterations.
    pub time: Option<Duration>,
    /// Error at which the render ends.
    pub error_target: Option<ErrorTarget>,
    /// File to save checkpoints to; none: the checkpoint to go on from, if there is one.
    pub checkpoint: Option<PathBuf>,
    /// Least wall time between two checkpoints; none: [`DEFAULT_CHECKPOINT_INTERVAL`].
    pub checkpoint_interval: Option<Duration>,
    /// Checkpoint to go on from.
    pub resume: Option<PathBuf>,
    /// Files to write at the end.
    pub outputs: OutputRequest,
}

/// Files to write at the end of a render.
#[derive(Clone, Debug, Default)]
pub struct OutputRequest {
    /// Pictures.
    pub pictures: Vec<PathBuf>,
    /// Exposure of pictures in sRGB, in stops.
    pub exposure: f32,
    /// Auxiliary layers of EXR files.
    pub aovs: Vec<Aov>,
    /// Statistics as JSON.
    pub stats: Option<PathBuf>,
    /// Pictures of every technique.
    pub pyramid: Option<PyramidRequest>,
}

/// A pyramid of techniques.
#[derive(Clone, Debug)]
pub struct PyramidRequest {
    /// Folder to write it to.
    pub folder: PathBuf,
    /// Length of its longest paths in edges.
    pub max_edges: usize,
}

/// A resolved run: nothing is left open.
#[derive(Clone)]
pub struct Plan {
    /// Integrator and parameters.
    pub method: Method,
    /// Seed.
    pub seed: u64,
    /// Limits of the run.
    pub budget: Budget,
    /// Error at which the render ends.
    pub error_target: Option<ErrorTarget>,
    /// File to save checkpoints to.
    pub checkpoint: Option<PathBuf>,
    /// Least wall time between two checkpoints.
    pub checkpoint_interval: Duration,
    /// Checkpoint to go on from.
    pub resume: Option<PathBuf>,
    /// Length in edges of the longest paths of the pyramid, if one is kept.
    pub pyramid_edges: Option<usize>,
}

impl RenderRequest {
    /// The plan for the scene; problems of the scene's integrator block are diagnostics.
    ///
    /// # Errors
    /// If the integrator or a parameter of the request does not exist.
    pub fn resolve(&self, desc: &SceneDesc, diagnostics: &mut Diagnostics) -> Result<Plan, JobError> {
        let method = self.method.resolve(desc, diagnostics)?;
        let scene_spp = desc.sensors.first().and_then(|s| s.sample_count).map(u64::from);
        // A time or an error to reach replaces the scene's number of samples.
        let other_limit = self.time.is_some() || self.error_target.is_some();
        let default = (!other_limit).then(|| scene_spp.unwrap_or(DEFAULT_SPP).max(1));
        Ok(Plan {
            budget: Budget { iterations: self.spp.or(default), time: self.time },
            error_target: self.error_target,
            checkpoint: self.checkpoint_file().map(Path::to_owned),
            checkpoint_interval: self.checkpoint_interval.unwrap_or(DEFAULT_CHECKPOINT_INTERVAL),
            resume: self.resume.clone(),
            pyramid_edges: self.outputs.pyramid.as_ref().map(|p| p.max_edges),
            ..Plan::new(method, self.seed)
        })
    }
}

impl Plan {
    /// A run without limits and files.
    pub fn new(method: Method, seed: u64) -> Plan {
        Plan {
            method,
            seed,
            budget: Budget::default(),
            error_target: None,
            checkpoint: None,
            checkpoint_interval: DEFAULT_CHECKPOINT_INTERVAL,
            resume: None,
            pyramid_edges: None,
        }
    }
}
