//! Measuring sessions: scenes that are ready, methods that can render them, and references.

use super::Failure;
use super::environment::Environment;
use super::measure_args::{MeasureArgs, ReferenceArgs};
use crate::integrators::REGISTRY;
use crate::measure::parse_methods;
use crate::measure::reference::{Reference, ReferenceError, ReferenceTask};
use crate::prepared::PreparedScene;
use crate::render::files::write_or_rescue;
use crate::render::memory::{FilmMemory, check_light_subpaths};
use crate::render::method::find_integrator;
use crate::render::{Budget, JobError, Method, MethodRequest, OutputFiles, job};
use crate::scene::{Diagnostics, SceneDesc};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Time for a reference, if the command line does not limit it.
const REFERENCE_TIME: Duration = Duration::from_secs(60);

/// Arguments, methods and environment of a measuring command, for all its scenes.
pub(crate) struct Session<'a> {
    pub args: &'a MeasureArgs,
    pub methods: Vec<MethodRequest>,
    pub environment: Environment,
    /// Files that the command writes.
    outputs: OutputFiles,
}

/// A prepared scene with the methods that can render it.
pub(crate) struct SceneMethods {
    /// Name of the scene: that of its file without the ending.
    pub name: String,
    pub scene: PreparedScene,
    pub methods: Vec<Method>,
    /// Methods of which the best renders the reference; none if none is suitable.
    pub reference_methods: Vec<Method>,
}

impl<'a> Session<'a> {
    /// A session of a command that reads `inputs` and writes `outputs`, which are checked before anything is done.
    pub fn new<'b>(
        args: &'a MeasureArgs,
        outputs: OutputFiles,
        inputs: impl IntoIterator<Item = &'b Path>,
    ) -> Result<Session<'a>, Failure> {
        outputs.check_inputs(inputs)?;
        outputs.check()?;
        let all = || REGISTRY.iter().map(|s| s.name).collect::<Vec<_>>().join(",");
        let methods = methods(args, &args.integrators.clone().unwrap_or_else(all))?;
        check_params(args, &methods)?;
        let environment = Environment::new(args.threads, args.quiet)?;
        environment.console.catch_ctrl_c();
        let session = Session { args, methods, environment, outputs };
        // Once for all scenes.
        for method in &session.methods {
            method.renamed()?.iter().for_each(|renamed| session.say(&format!("note: {renamed}")));
        }
        Ok(session)
    }

    /// Loads and prepares a scene, with warnings for methods that leave light of it out.
    pub fn prepare(&self, path: &Path, references: Option<&ReferenceArgs>) -> Result<SceneMethods, Failure> {
        let runtime = self.environment.runtime();
        let loaded = job::load(&self.args.scene_request(path), runtime)?;
        self.outputs.check_inputs(loaded.desc.files.iter().map(PathBuf::as_path))?;
        let methods = self.methods.iter().map(|m| resolve(m, &loaded.desc)).collect::<Result<Vec<_>, _>>()?;
        let named_method = match references.and_then(|r| r.reference_integrator.as_ref()) {
            Some(text) => Some(resolve(&self.one_method(text)?, &loaded.desc)?),
            None => None,
        };
        let scene = job::prepare(loaded, &self.args.prepare_options(&self.environment), runtime)?.scene;
        FilmMemory { window: scene.window, films: methods.len(), pyramid_edges: None }.check()?;
        methods.iter().try_for_each(check_light_subpaths)?;
        let name = scene_name(path);
        for method in &methods {
            if let Some(limitation) = method.limitation(&scene) {
                self.say(&format!("warning: {}: {limitation}", method.label));
            }
        }
        let complete = |m: &&Method| is_complete(m, &scene);
        let all_complete = || methods.iter().filter(complete).cloned().collect();
        let reference_methods = named_method.map_or_else(all_complete, |method| vec![method]);
        Ok(SceneMethods { name, scene, methods, reference_methods })
    }

    fn one_method(&self, text: &str) -> Result<MethodRequest, Failure> {
        <[MethodRequest; 1]>::try_from(methods(self.args, text)?)
            .map(|[method]| method)
            .map_err(|_| Failure::Input(format!("--reference-integrator {text}: expected one method")))
    }

    /// The reference of a scene from the cache, or rendered now.
    pub fn reference(&self, scene: &SceneMethods, args: &ReferenceArgs) -> Result<Reference, Failure> {
        if scene.reference_methods.is_empty() {
            return Err(Failure::Input(format!(
                "no unbiased method renders all of {}: name one with --reference-integrator, or a --reference",
                scene.name
            )));
        }
        let time = args.reference_time.or(args.reference_spp.is_none().then_some(REFERENCE_TIME));
        let budget = Budget { iterations: args.reference_spp, time };
        let folder = args.cache.clone().unwrap_or_else(cache_folder);
        let task = ReferenceTask { scene: &scene.scene, name: &scene.name, methods: &scene.reference_methods, budget };
        Reference::cached(&task, &folder, self.environment.runtime()).map_err(reference_failure)
    }

    /// Prints a line to standard error, unless the command is quiet.
    pub fn say(&self, text: &str) {
        self.environment.console.say(text);
    }
}

/// True if the method's expectation is the whole light of the scene.
pub(crate) fn is_complete(method: &Method, scene: &PreparedScene) -> bool {
    method.spec.unbiased && method.limitation(scene).is_none()
}

/// Reads methods, which must exist, and gives them the parameters that hold for all methods.
fn methods(args: &MeasureArgs, text: &str) -> Result<Vec<MethodRequest>, Failure> {
    let mut methods = parse_methods(text).map_err(Failure::Input)?;
    for method in &mut methods {
        method.max_depth = args.max_depth;
        let Some(name) = &method.integrator else { continue };
        let spec = find_integrator(name)?;
        // A method's own parameters come after those of all methods.
        let own = std::mem::take(&mut method.params);
        let common = args.param.iter().filter(|(key, _)| spec.has_param(key)).cloned();
        method.params = common.chain(own).collect();
    }
    Ok(methods)
}

/// Refuses parameters of all methods that none of them has.
fn check_params(args: &MeasureArgs, methods: &[MethodRequest]) -> Result<(), Failure> {
    let has = |method: &MethodRequest, key: &str| method.params.iter().any(|(k, _)| k == key);
    match args.param.iter().find(|(key, _)| !methods.iter().any(|m| has(m, key))) {
        Some((key, _)) => Err(Failure::Input(format!("-p {key}: none of the methods has this parameter"))),
        None => Ok(()),
    }
}

/// Diagnostics about the scene's own integrator block would repeat for each method, and are left out.
fn resolve(method: &MethodRequest, desc: &SceneDesc) -> Result<Method, JobError> {
    method.resolve(desc, &mut Diagnostics::default())
}

/// The failure with the exit code of the fault.
pub(crate) fn reference_failure(e: ReferenceError) -> Failure {
    use crate::image::ImageFault;
    match e {
        ReferenceError::Image(e) if !matches!(e.fault, ImageFault::Io(_)) => Failure::input(e),
        ReferenceError::Job(e) => e.into(),
        e => Failure::io(e),
    }
}

fn cache_folder() -> PathBuf {
    let from = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let base = from("XDG_CACHE_HOME").or_else(|| from("HOME").map(|h| h.join(".cache")));
    base.unwrap_or_else(std::env::temp_dir).join("lightsieve")
}

/// The command line, for reports.
pub(crate) fn command_line() -> String {
    let words: Vec<String> = std::env::args().collect();
    let quote = |w: &String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+".contains(c);
        if !w.is_empty() && w.chars().all(plain) { w.clone() } else { format!("'{}'", w.replace('\'', "'\\''")) }
    };
    let rest: Vec<String> = words.iter().skip(1).map(quote).collect();
    format!("lightsieve {}", rest.join(" "))
}

/// Writes a text file of a report's folder, which is made if it does not exist.
pub(crate) fn write_text(folder: &Path, name: &str, text: &str) -> Result<PathBuf, Failure> {
    let path = folder.join(name);
    let io = |e: std::io::Error| Failure::Io(format!("{}: {e}", path.display()));
    std::fs::create_dir_all(folder).map_err(io)?;
    write_or_rescue(&path, |path| {
        crate::image::atomic_write(path, |w| w.write_all(text.as_bytes()))
            .map_err(|e| format!("{}: {e}", path.display()))
    })?;
    Ok(path)
}

pub(crate) fn to_json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(Failure::io)
}

/// Name of a scene: that of its file, or of its folder if the file is called `scene`.
fn scene_name(path: &Path) -> String {
    let text = |part: Option<&std::ffi::OsStr>| part.map(|s| s.to_string_lossy().into_owned());
    match text(path.file_stem()) {
        Some(name) if name != "scene" => name,
        stem => text(path.parent().and_then(Path::file_name)).or(stem).unwrap_or_else(|| "scene".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_have_names() {
        for (path, name) in
            [("a/door.xml", "door"), ("rooms/hall/scene.xml", "hall"), ("scene.xml", "scene"), ("/scene.xml", "scene")]
        {
            assert_eq!(scene_name(Path::new(path)), name);
        }
    }
}
