//! From arguments to requests: every command that loads a scene gets it from here.

use super::Failure;
use super::cli::{Query, RenderArgs, SampleArgs, SceneArgs};
use super::environment::Environment;
use super::measure_args::MeasureArgs;
use crate::load::{CameraOptions, LoadOptions};
use crate::prepared::PrepareOptions;
use crate::ray::Backend;
use crate::render::{Aov, MethodRequest, OutputRequest, Plan, PyramidRequest, RenderRequest, SceneRequest};
use glam::DVec3;
use std::path::Path;

impl SceneArgs {
    pub fn request(&self) -> SceneRequest {
        let vector = |v: Option<[f64; 3]>| v.map(DVec3::from);
        let camera = CameraOptions {
            origin: vector(self.camera_origin),
            target: vector(self.camera_target),
            up: vector(self.camera_up),
            fov: self.camera_fov,
            resolution: None,
        };
        let options = LoadOptions { definitions: self.define.clone(), strict: self.strict, force: self.force, camera };
        SceneRequest { file: self.scene.clone(), options }
    }
}

impl SampleArgs {
    pub fn method(&self) -> MethodRequest {
        MethodRequest {
            label: None,
            integrator: self.integrator.clone(),
            max_depth: self.max_depth,
            params: self.param.clone(),
        }
    }

    pub fn prepare_options(&self, environment: &Environment) -> PrepareOptions {
        let backend = Query::backend(self.query);
        PrepareOptions { backend, threads: environment.threads, size: self.size, crop: self.crop }
    }
}

impl MeasureArgs {
    /// A scene file with the definitions of the command line.
    pub fn scene_request(&self, file: &Path) -> SceneRequest {
        let options = LoadOptions { definitions: self.define.clone(), force: self.force, ..LoadOptions::default() };
        SceneRequest { file: file.to_owned(), options }
    }

    pub fn prepare_options(&self, environment: &Environment) -> PrepareOptions {
        let backend = Query::backend(self.query);
        PrepareOptions { backend, threads: environment.threads, size: self.size, crop: None }
    }
}

/// Options for the scene as its file describes it.
pub(crate) fn plain_options(environment: &Environment) -> PrepareOptions {
    PrepareOptions { backend: Backend::default_available(), threads: environment.threads, size: None, crop: None }
}

impl RenderArgs {
    pub fn request(&self, environment: &Environment) -> Result<RenderRequest, Failure> {
        let pyramid = self.pyramid.clone();
        let outputs = OutputRequest {
            pictures: self.output.clone(),
            exposure: self.exposure,
            aovs: self.aov.iter().map(|name| aov(name)).collect::<Result<_, _>>()?,
            stats: self.stats.clone(),
            pyramid: pyramid.map(|folder| PyramidRequest { folder, max_edges: self.pyramid_depth as usize }),
        };
        Ok(RenderRequest {
            scene: self.scene.request(),
            prepare: self.sample.prepare_options(environment),
            method: self.sample.method(),
            seed: self.sample.seed,
            spp: self.spp,
            time: self.time,
            error_target: self.error_target,
            checkpoint: self.checkpoint.clone(),
            checkpoint_interval: self.checkpoint_interval,
            resume: self.resume.clone(),
            outputs,
        })
    }
}

/// Prints a resolved render as lines of `key = value`.
pub(crate) fn print_plan(request: &RenderRequest, plan: &Plan) {
    out!("scene = {}", request.scene.file.display());
    out!("integrator = {}", plan.method.spec.name);
    for (key, value) in plan.method.params.pairs() {
        out!("{key} = {value}");
    }
    if let Some(n) = plan.budget.iterations {
        out!("spp = {n}");
    }
    if let Some(t) = plan.budget.time {
        out!("time = {}s", t.as_secs_f64());
    }
    if let Some(target) = &plan.error_target {
        out!("error_target = {}={}", target.key, target.value);
    }
    out!("seed = {}", plan.seed);
    out!("threads = {}", request.prepare.threads);
}

fn aov(name: &str) -> Result<Aov, Failure> {
    Aov::ALL.iter().find(|(n, _)| *n == name).map(|&(_, a)| a).ok_or_else(|| {
        let known: Vec<_> = Aov::ALL.iter().map(|(n, _)| *n).collect();
        Failure::Input(format!("unknown layer \"{name}\"; known: {}", known.join(", ")))
    })
}
