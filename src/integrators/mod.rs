//! Rendering algorithms: one folder and one registry line each.
//!
//! Parameters, help texts, refusals and the tests that run over every integrator come from [`REGISTRY`], never from a
//! second list.

pub mod bdpt;
pub mod bidirectional;
pub mod fallback;
pub mod importance;
pub mod light;
pub mod lvc;
pub mod params;
pub mod path;
pub mod resampling;

pub use crate::bidir::replay::{self, Replay};
pub use crate::path::Iteration;
pub use params::{ParamDefault, ParamError, ParamSpec, Params, Renamed};

use crate::film::{Film, Pyramid};
use crate::prepared::Features;
use crate::ray::RayStats;

/// Every integrator, by name.
pub static REGISTRY: &[&IntegratorSpec] = &[
    &path::SPEC,
    &light::SPEC,
    &bdpt::SPEC,
    &lvc::SPEC,
    &resampling::PCBPT,
    &resampling::RIS,
    &resampling::TWO_STAGE,
    &importance::SKELETON,
    &importance::IC_BDPT,
    &importance::IMPORTANCE_CACHING,
];

/// An integrator's entry in the registry.
pub struct IntegratorSpec {
    /// Name on the command line and in scene files.
    pub name: &'static str,
    /// Other names that scene files use for it.
    pub aliases: &'static [&'static str],
    /// Description in one line of at most 80 characters.
    pub short: &'static str,
    /// Description in full: the method and its uses, with the papers. Paragraphs are separated by a blank line.
    pub long: &'static str,
    /// Parameters, in groups that several integrators may share.
    pub params: &'static [&'static [ParamSpec]],
    /// Its expectation is the rendering equation's solution.
    pub unbiased: bool,
    /// Light that is missing from its pictures of a scene with these features, if any is.
    pub limitations: fn(Features) -> Option<String>,
    /// Builds it.
    pub build: fn(&Params) -> Box<dyn Integrator>,
}

impl IntegratorSpec {
    /// Its parameters, in the order of declaration.
    pub fn params(&self) -> impl Iterator<Item = &'static ParamSpec> + use<> {
        self.params.iter().copied().flatten()
    }
}

impl IntegratorSpec {
    /// True if it has a parameter of that name, or had one of that name earlier.
    pub fn has_param(&self, name: &str) -> bool {
        self.params().any(|p| p.name == name || p.aliases.iter().any(|alias| alias.name == name))
    }
}

/// The integrator of that name or alias.
pub fn find(name: &str) -> Option<&'static IntegratorSpec> {
    REGISTRY.iter().find(|s| s.name == name || s.aliases.contains(&name)).copied()
}

/// A rendering algorithm at work.
pub trait Integrator: Send {
    /// Adds one sample per pixel to the film, in parallel on the current thread pool; the result must not depend on the
    /// number of threads. The caller has begun the iteration ([`Film::begin_iteration`]), so that the film counts it
    /// already.
    fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats;

    /// State after the iterations so far, for a checkpoint.
    fn state(&self) -> Vec<u8> {
        vec![]
    }

    /// Goes on from a state of the same scene, seed and parameters; `iteration` is the next. False if the state is of
    /// something else.
    fn restore(&mut self, _iteration: &Iteration, state: &[u8]) -> bool {
        state.is_empty()
    }

    /// Its own decisions, for people to read.
    fn notes(&self) -> Vec<String> {
        vec![]
    }

    /// Adds the picture of every technique to `pyramid`, which is empty or of the iterations so far; false if there are
    /// no techniques to tell apart.
    fn keep_pyramid(&mut self, _pyramid: Pyramid) -> bool {
        false
    }

    /// The pictures of techniques, if they are kept.
    fn pyramid(&self) -> Option<&Pyramid> {
        None
    }

    /// Runs the sample of one pixel (column and row of the full picture) again and writes down all that happens.
    fn replay(&mut self, iteration: &Iteration, pixel: (u32, u32)) -> Replay;
}
