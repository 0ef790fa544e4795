//! What the command line and the scene file together mean: one integrator with all its parameters, and a budget.

use super::Failure;
use super::cli::RenderArgs;
use crate::integrators::{self, IntegratorSpec, Params, Renamed};
use crate::render::{Aov, Budget};
use crate::scene::diag::nearest;
use crate::scene::{Diagnostic, Diagnostics, SceneDesc};

/// A resolved render.
pub(crate) struct Config {
    pub spec: &'static IntegratorSpec,
    pub params: Params,
    pub budget: Budget,
    pub threads: usize,
    pub aovs: Vec<Aov>,
}

/// Parameters that say what the picture shows, whichever way it is made.
const OF_THE_PICTURE: [&str; 2] = ["max_depth", "hide_emitters"];

/// Samples per pixel when neither the command line nor the scene says.
const DEFAULT_SPP: u64 = 64;

impl Config {
    pub fn resolve(args: &RenderArgs, desc: &SceneDesc, diagnostics: &mut Diagnostics) -> Result<Config, Failure> {
        let (spec, params) = Config::of_integrator(
            args.what.integrator.as_deref(),
            args.what.max_depth,
            &args.what.param,
            desc,
            diagnostics,
        )?;
        let file_spp = desc.sensors.first().and_then(|s| s.sample_count).map(u64::from);
        // A time or an error to reach replaces the scene's number of samples.
        let iterations = match (args.spp, args.time.is_some() || args.error_target.is_some()) {
            (Some(spp), _) => Some(spp),
            (None, true) => None,
            (None, false) => Some(file_spp.unwrap_or(DEFAULT_SPP).max(1)),
        };
        let threads = args
            .threads
            .map_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get), |n| n as usize);
        let aovs = args.aov.iter().map(|name| aov(name)).collect::<Result<_, _>>()?;
        Ok(Config { spec, params, budget: Budget { iterations, time: args.time }, threads, aovs })
    }

    /// The integrator and its parameters, from the command line or else the scene file.
    pub fn of_integrator(
        integrator: Option<&str>,
        max_depth: Option<i64>,
        given: &[(String, String)],
        desc: &SceneDesc,
        diagnostics: &mut Diagnostics,
    ) -> Result<(&'static IntegratorSpec, Params), Failure> {
        let spec = match (integrator, &desc.integrator) {
            (Some(name), _) => integrators::find(name).ok_or_else(|| unknown_integrator(name))?,
            (None, Some(block)) => integrators::find(&block.name).unwrap_or_else(|| {
                let d = Diagnostic::warning(
                    "integrator::unknown",
                    format!("integrator \"{}\" is not known here; rendering with \"path\"", block.name),
                );
                diagnostics.push(d.at(block.span.clone()).label(known_integrators(&block.name)));
                &integrators::path::SPEC
            }),
            (None, None) => &integrators::path::SPEC,
        };
        let mut params = Params::defaults(spec);
        for (key, value, span) in desc.integrator.iter().flat_map(|b| &b.params) {
            // What a scene says of another integrator describes the picture where it limits paths; how that one samples is its own.
            let own = desc
                .integrator
                .as_ref()
                .is_some_and(|b| integrators::find(&b.name).is_none_or(|s| s.name == spec.name));
            if !own && !OF_THE_PICTURE.contains(&key.as_str()) {
                continue;
            }
            // The scene's block is a proposal: what does not fit is said and left.
            match params.set(key, value) {
                Ok(renamed) => renamed.iter().for_each(|r| diagnostics.push(renamed_note(r).at(span.clone()))),
                Err(e) => {
                    diagnostics.push(Diagnostic::warning("integrator::parameter", e.to_string()).at(span.clone()));
                }
            }
        }
        if let Some(depth) = max_depth {
            params.set("max_depth", &depth.to_string()).map_err(Failure::input)?;
        }
        for (key, value) in given {
            let renamed = params.set(key, value).map_err(Failure::input)?;
            renamed.iter().for_each(|r| diagnostics.push(renamed_note(r)));
        }
        Ok((spec, params))
    }

    /// As lines of `key = value`.
    pub fn print(&self, args: &RenderArgs) {
        out!("scene = {}", args.scene.scene.display());
        out!("integrator = {}", self.spec.name);
        for (key, value) in self.params.pairs() {
            out!("{key} = {value}");
        }
        if let Some(n) = self.budget.iterations {
            out!("spp = {n}");
        }
        if let Some(t) = self.budget.time {
            out!("time = {}s", t.as_secs_f64());
        }
        if let Some(target) = &args.error_target {
            out!("error_target = {}={}", target.key, target.value);
        }
        out!("seed = {}", args.what.seed);
        out!("threads = {}", self.threads);
    }
}

fn renamed_note(renamed: &Renamed) -> Diagnostic {
    Diagnostic::note("integrator::renamed", renamed.to_string())
}

/// Which of these parameters have another name or value now.
pub(crate) fn renamed(spec: &IntegratorSpec, given: &[(String, String)]) -> Result<Vec<Renamed>, Failure> {
    let mut params = Params::defaults(spec);
    let renamed: Result<Vec<_>, _> = given.iter().filter_map(|(k, v)| params.set(k, v).transpose()).collect();
    renamed.map_err(Failure::input)
}

/// Says so, and which there are.
pub(crate) fn unknown_integrator(name: &str) -> Failure {
    Failure::Input(format!("unknown integrator \"{name}\"; {}", known_integrators(name)))
}

/// The one that was meant, or all there are.
fn known_integrators(name: &str) -> String {
    let known = || integrators::REGISTRY.iter().map(|s| s.name);
    nearest(name, known()).map_or_else(
        || format!("known: {}", known().collect::<Vec<_>>().join(", ")),
        |n| format!("did you mean \"{n}\"?"),
    )
}

fn aov(name: &str) -> Result<Aov, Failure> {
    Aov::ALL.iter().find(|(n, _)| *n == name).map(|&(_, a)| a).ok_or_else(|| {
        let known: Vec<_> = Aov::ALL.iter().map(|(n, _)| *n).collect();
        Failure::Input(format!("unknown layer \"{name}\"; known: {}", known.join(", ")))
    })
}
