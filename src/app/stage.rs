//! What all measuring commands begin with: a scene that is ready, methods that can render it, a reference.

use super::Failure;
use super::cli::{Query, SceneArgs};
use super::config::{self, Config, unknown_integrator};
use super::measure_args::{MeasureArgs, ReferenceArgs};
use super::render::{catch_ctrl_c, progress_bar, show};
use super::report;
use crate::integrators::REGISTRY;
use crate::measure::Contender;
use crate::measure::method::{MethodText, parse_methods};
use crate::measure::reference::{Reference, ReferenceError};
use crate::prepared::{PrepareOptions, PreparedScene};
use crate::render::Budget;
use crate::scene::{Diagnostics, SceneDesc};
use rayon::ThreadPool;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Time for a reference, if nothing is said.
const REFERENCE_TIME: Duration = Duration::from_secs(60);

/// What is the same for all scenes of a command.
pub(crate) struct Stage<'a> {
    pub args: &'a MeasureArgs,
    pub methods: Vec<MethodText>,
    pub threads: usize,
    pub pool: ThreadPool,
    pub interrupt: Arc<AtomicBool>,
}

/// A scene with those who render it.
pub(crate) struct Set {
    /// Name: the file's, without its ending.
    pub name: String,
    pub scene: PreparedScene,
    pub contenders: Vec<Contender>,
    /// Who renders the reference.
    pub judge: Option<Contender>,
}

impl<'a> Stage<'a> {
    pub fn new(args: &'a MeasureArgs) -> Result<Stage<'a>, Failure> {
        let all = || REGISTRY.iter().map(|s| s.name).collect::<Vec<_>>().join(",");
        let text = args.integrators.clone().unwrap_or_else(all);
        let methods = parse_methods(&text).map_err(Failure::Input)?;
        for m in &methods {
            let spec = crate::integrators::find(&m.integrator).ok_or_else(|| unknown_integrator(&m.integrator))?;
            // Said here, once for all scenes.
            for renamed in config::renamed(spec, &m.params)?.iter().filter(|_| !args.quiet) {
                note!("note: {renamed}");
            }
        }
        let all = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let threads = args.threads.map_or_else(all, |n| n as usize);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(Failure::input)?;
        let interrupt = Arc::new(AtomicBool::new(false));
        catch_ctrl_c(interrupt.clone())?;
        Ok(Stage { args, methods, threads, pool, interrupt })
    }

    /// Loads and prepares a scene.
    pub fn set(&self, path: &Path, references: Option<&ReferenceArgs>) -> Result<Set, Failure> {
        let (desc, mut diagnostics) = report::load(&self.scene_args(path), self.args.quiet)?;
        let said = diagnostics.list.len();
        let contenders: Result<Vec<Contender>, Failure> =
            self.methods.iter().map(|m| self.contender(m, &desc, &mut diagnostics)).collect();
        let contenders = contenders?;
        let judge = match references.and_then(|r| r.reference_integrator.as_ref()) {
            Some(text) => {
                let methods = parse_methods(text).map_err(Failure::Input)?;
                let [method] = methods.as_slice() else {
                    return Err(Failure::Input(format!("--reference-integrator {text}: expected one method")));
                };
                Some(self.contender(method, &desc, &mut diagnostics)?)
            }
            None => None,
        };
        let options = PrepareOptions {
            backend: Query::backend(self.args.query),
            threads: self.threads,
            size: self.args.size,
            crop: None,
        };
        // What each method has to say of the scene's own integrator block would be said many times.
        diagnostics.list.truncate(said);
        let prepared = self.pool.install(|| PreparedScene::build(desc, &options, &mut diagnostics));
        diagnostics.list.drain(..said.min(diagnostics.list.len()));
        if !self.args.quiet || diagnostics.has_errors() {
            report::print(&diagnostics);
        }
        let scene = prepared.map_err(Failure::input)?;
        let name = scene_name(path);
        for c in &contenders {
            if let Some(what) = (c.spec.limitations)(scene.features) {
                self.say(&format!("warning: {}: {what}", c.label));
            }
        }
        let whole = |c: &&Contender| c.spec.unbiased && (c.spec.limitations)(scene.features).is_none();
        let judge = judge.or_else(|| contenders.iter().find(whole).cloned());
        Ok(Set { name, scene, contenders, judge })
    }

    fn scene_args(&self, path: &Path) -> SceneArgs {
        SceneArgs {
            scene: path.to_owned(),
            define: self.args.define.clone(),
            strict: false,
            camera_origin: None,
            camera_target: None,
            camera_up: None,
            camera_fov: None,
        }
    }

    fn contender(&self, m: &MethodText, desc: &SceneDesc, diagnostics: &mut Diagnostics) -> Result<Contender, Failure> {
        let (spec, params) =
            Config::of_integrator(Some(&m.integrator), self.args.max_depth, &m.params, desc, diagnostics)?;
        Ok(Contender { label: m.label.clone(), spec, params })
    }

    /// The reference of a scene from the cache, or rendered now.
    pub fn reference(&self, set: &Set, args: &ReferenceArgs) -> Result<Reference, Failure> {
        let Some(judge) = &set.judge else {
            return Err(Failure::Input(format!(
                "no unbiased method renders all of {}: name one with --reference-integrator, or a --reference",
                set.name
            )));
        };
        let time = args.reference_time.or(args.reference_spp.is_none().then_some(REFERENCE_TIME));
        let budget = Budget { iterations: args.reference_spp, time };
        let bar = progress_bar(self.args.quiet);
        self.say(&format!("{}: reference by {}", set.name, judge.label));
        let found = self.pool.install(|| {
            let folder = args.cache.clone().unwrap_or_else(cache_folder);
            Reference::cached(&set.scene, (&set.name, judge, budget), &folder, &self.interrupt, |p| show(&bar, p))
        });
        bar.finish_and_clear();
        found.map_err(reference_failure)
    }

    /// To standard error, unless it is to be quiet.
    pub fn say(&self, text: &str) {
        if !self.args.quiet {
            note!("{text}");
        }
    }
}

/// Each fault with its exit code.
pub(crate) fn reference_failure(e: ReferenceError) -> Failure {
    use crate::image::ImageFault;
    match e {
        ReferenceError::Image(e) if !matches!(e.fault, ImageFault::Io(_)) => Failure::input(e),
        ReferenceError::Interrupted => Failure::Interrupted,
        e => Failure::io(e),
    }
}

fn cache_folder() -> PathBuf {
    let from = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let base = from("XDG_CACHE_HOME").or_else(|| from("HOME").map(|h| h.join(".cache")));
    base.unwrap_or_else(std::env::temp_dir).join("lightsieve")
}

/// What was typed, for reports.
pub(crate) fn command_line() -> String {
    let words: Vec<String> = std::env::args().collect();
    let quote = |w: &String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+".contains(c);
        if !w.is_empty() && w.chars().all(plain) { w.clone() } else { format!("'{}'", w.replace('\'', "'\\''")) }
    };
    let rest: Vec<String> = words.iter().skip(1).map(quote).collect();
    format!("lightsieve {}", rest.join(" "))
}

/// Writes a text file of a report's folder, which is made if it is not there.
pub(crate) fn write_text(folder: &Path, name: &str, text: &str) -> Result<PathBuf, Failure> {
    let path = folder.join(name);
    let io = |e: std::io::Error| Failure::Io(format!("{}: {e}", path.display()));
    std::fs::create_dir_all(folder).map_err(io)?;
    crate::image::atomic_write(&path, |w| w.write_all(text.as_bytes())).map_err(io)?;
    Ok(path.clone())
}

pub(crate) fn to_json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(Failure::io)
}

/// What a scene is called: its file's name, or its folder's where all files are called `scene`.
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
