//! Resampled connections: many light sub-paths are traced once per iteration, and every eye vertex is connected to the one that
//! matters for it (probabilistic connections, Popov et al. 2015; resampling-aware weights, Nabata et al. 2020).
//!
//! All vertices of M light sub-paths are candidates. At cache points (`caches.rs`) each has a probability proportional to
//! what it brings there, visibility included. An eye vertex z draws from the mixture
//!
//! P(y | z) = Σ_i P_i(y) / (n + 1) + 1 / ((n + 1) V)
//!
//! of the n nearest cache points and a uniform share over all V vertices, and estimates its connections (s ≥ 2, all s at once) by
//!
//! w f / (N M p(ȳ) p(z̄) P(y | z))   for each of N draws (eq. 6 there, with the mixture as its one pmf).
//!
//! P is positive wherever f is, and p(ȳ)⁻¹ = β_L / f_y, so any weights that sum to one per path make this unbiased. `pcbpt` takes the
//! weights of bidirectional path tracing; `ris` those that know how resampling changes the density (`mis::resampled`). These ask for
//! the normalisation Q, whose estimate comes from earlier iterations only, the first of them untallied. As published, `ris` has no mixture
//! but n + 1 techniques, each with a weight of its own (`near.rs`, `mis::proposals`).
//!
//! `two-stage` asks at cache points for a few vertices only, M₂ of all those of M sub-paths, drawn before by what they would bring if
//! all were in sight (`pmfs.rs`). Groups of neighbouring cache points share what they draw, so that the mixture above is one over the
//! same M₂ vertices; P is then P₁ P₂ (Nabata et al. 2020, "Two-stage resampling").
//!
//! Candidates are the first M of an iteration's light sub-paths, whose splats the light image takes in any case.

pub(in crate::integrators) mod caches;
pub(in crate::integrators) mod near;
mod combined;
mod distributions;
mod learnt;
pub(in crate::integrators) mod params;
mod pmfs;
mod places;
mod prepare;
pub(in crate::integrators) mod resampler;
mod sites;
pub(in crate::integrators) mod store;

use super::bdpt::Bidirectional;
use super::params::shared::{ALLOCATION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_RESAMPLED, TECHNIQUES};
use super::{IntegratorSpec, ParamSpec, Params};
use crate::mis::{Form, Heuristic};
use crate::spatial::nearest::Metric;
pub(in crate::integrators) use combined::{Draws, DrawsFrom};
pub(in crate::integrators) use distributions::Distribution;
pub(in crate::integrators) use resampler::Resampler;

/// Parameters of methods with one stage, up to the weights; the latter differ in their default.
const ONE_STAGE: &[ParamSpec] = &[
    MAX_DEPTH,
    RR_DEPTH_RESAMPLED,
    params::RR_SCALE,
    HIDE_EMITTERS,
    TECHNIQUES,
    params::PRESAMPLED_PATHS,
    params::CONNECTIONS_PER_VERTEX,
    params::NEAREST_CACHES,
    params::CACHE_DENSITY,
    params::METRIC,
    params::TARGET,
    params::proposal_model("per-cache"),
    params::MIN_DENSITY_RATIO,
    params::MIN_UNSEEN_FRACTION,
    params::UNSEEN_MODEL,
];

const TWO_STAGES: &[ParamSpec] = &[
    MAX_DEPTH,
    RR_DEPTH_RESAMPLED,
    params::RR_SCALE,
    HIDE_EMITTERS,
    TECHNIQUES,
    params::FIRST_STAGE_PATHS,
    params::SECOND_STAGE_PATHS,
    params::CONNECTIONS_PER_VERTEX,
    params::NEAREST_CACHES,
    params::GROUPED_CACHE_DENSITY,
    params::METRIC,
    params::TARGET,
    params::proposal_model("mixture-with-visibility"),
    params::MIN_DENSITY_RATIO,
    params::MIN_UNSEEN_FRACTION,
    params::UNSEEN_MODEL,
    params::TWO_STAGE_WEIGHTS,
    ALLOCATION,
];

fn build_with(params: &Params, paths: u32, second_stage: Option<u32>) -> Box<dyn super::Integrator> {
    let weights = match params.choice("weights") {
        "balance" => Weights::Balance,
        "resampling-aware" => Weights::OneStage,
        _ => Weights::TwoStage,
    };
    let form = match params.choice("proposal_model") {
        "mixture-with-visibility" if weights != Weights::Balance => Form::Asked,
        "per-cache" if weights != Weights::Balance => Form::Split,
        _ => Form::Mixture,
    };
    let settings = Settings {
        scheme: Scheme::Caches,
        paths,
        second_stage,
        samples: params.int("connections_per_vertex") as u32,
        neighbours: params.int("nearest_caches") as usize,
        cache_fraction: params.float("cache_density"),
        epsilon: params.float("min_density_ratio") as f32,
        doubt: params.float("min_unseen_fraction") as f32,
        trust: params.choice("unseen_model") == "constant",
        // Which cache points a weight asks must be the same from whichever side a technique looks at a surface.
        metric: if params.choice("metric") == "position" || form.asks() { Metric::Plain } else { Metric::Facing },
        radiance: params.choice("target") == "radiance" && form != Form::Split,
        form,
        weights,
    };
    build_resampled(params, settings)
}

/// An integrator with the parameters that all methods of this kind have.
pub(in crate::integrators) fn build_resampled(params: &Params, settings: Settings) -> Box<dyn super::Integrator> {
    let mut this = Bidirectional::new(params, Heuristic::Balance, params.techniques("techniques"));
    // By way of percent, so that the rounding is that of checkpoints and pictures that exist.
    this.weigher.eye_limits.keep = (params.float("rr_scale") * 100.0) as f32 * 0.01;
    this.resample(settings);
    if params.choice("allocation") == "auto" {
        this.size_by_scene();
    }
    Box::new(this)
}

fn build(params: &Params) -> Box<dyn super::Integrator> {
    build_with(params, params.int("presampled_paths") as u32, None)
}

/// The registry's line of `pcbpt`.
pub static PCBPT: IntegratorSpec = IntegratorSpec {
    name: "pcbpt",
    aliases: &[],
    short: "Probabilistic connections (PCBPT): bidirectional, connections are resampled",
    long: "Many light sub-paths are traced in every iteration. Each eye vertex is connected to one of their \
        vertices, drawn by the contributions that light sub-paths make at nearby cache points. Weights are those of \
        bidirectional path tracing, which ignore resampling; `ris` is the same method with better weights.\n\n\
        Popov, Ramamoorthi, Durand and Drettakis 2015, \"Probabilistic connections for bidirectional path tracing\". \
        As published: rr_scale=1, allocation=full.",
    params: &[ONE_STAGE, &[params::weights("balance"), ALLOCATION]],
    unbiased: true,
    limitations: |_| None,
    build,
};

/// The registry's line of `ris`.
pub static RIS: IntegratorSpec = IntegratorSpec {
    name: "ris",
    aliases: &["risbpt"],
    short: "Resampled connections with resampling-aware weights (RISBPT)",
    long: "As `pcbpt`, with weights that take the density of resampled connections into account, so that these get \
        the light they are good at. It is for interiors lit by way of other rooms or through gaps.\n\n\
        Nabata, Iwasaki and Dobashi 2020, \"Resampling-aware weighting functions for bidirectional path tracing \
        using multiple light sub-paths\". As published: rr_scale=1, allocation=full.",
    params: &[ONE_STAGE, &[params::weights("resampling-aware"), ALLOCATION]],
    unbiased: true,
    limitations: |_| None,
    build,
};

/// The registry's line of `two-stage`.
pub static TWO_STAGE: IntegratorSpec = IntegratorSpec {
    name: "two-stage",
    aliases: &["tsr"],
    short: "Resampled connections in two stages, from very many light sub-paths",
    long: "As `ris`, from many more light sub-paths: a first stage, which ignores visibility and needs no shadow \
        rays, leaves few of them to each group of cache points; a second stage resamples those with visibility. It \
        is the first choice for interiors that are hard to light.\n\n\
        Nabata, Iwasaki and Dobashi 2020, \"Two-stage resampling for bidirectional path tracing with multiple light \
        sub-paths\". As published: rr_scale=1, allocation=full, proposal_model=per-cache, presampled_paths=10000, \
        cache_density=0.4%.",
    params: &[TWO_STAGES],
    unbiased: true,
    limitations: |_| None,
    build: |params| {
        // Zero is decided by the scene.
        let paths = params.auto_int("presampled_paths").unwrap_or(0) as u32;
        build_with(params, paths, Some(params.int("second_stage_paths") as u32))
    },
};

/// What weights know of resampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrators) enum Weights {
    /// Nothing.
    Balance,
    /// That one of M sub-paths is drawn (of two stages: one of M₂).
    OneStage,
    /// That it is drawn in two stages.
    TwoStage,
}

/// Where probabilities are kept, and of what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::integrators) enum Scheme {
    /// At cache points, of all light vertices together (`pmfs.rs`).
    Caches,
    /// At importance records.
    Records(Draws),
    /// At nodes of the skeleton of empty space.
    Skeleton {
        draws: Draws,
        /// Voxels along the longest side of the scene, if not decided by the scene.
        cells: Option<usize>,
        /// Share of the mean number of eye vertices that a node must have to be used.
        acceptance: f64,
    },
}

/// What a user decides.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrators) struct Settings {
    /// Where probabilities are kept.
    pub scheme: Scheme,
    /// M; 0: decided by the size of the picture.
    pub paths: u32,
    /// M₂, if there are two stages.
    pub second_stage: Option<u32>,
    /// N.
    pub samples: u32,
    /// Cache points that an eye vertex mixes.
    pub neighbours: usize,
    /// Eye sub-paths that make cache points, per pixel.
    pub cache_fraction: f64,
    /// See [`Resampled::epsilon`](crate::mis::Resampled).
    pub epsilon: f32,
    /// See [`Resampled::doubt`](crate::mis::Resampled).
    pub doubt: f32,
    /// Weights assume that a place's light is what its cache points know.
    pub trust: bool,
    /// Which cache points are near.
    pub metric: Metric,
    /// Probabilities at cache points count the BSDF there.
    pub radiance: bool,
    /// What is one technique, and what weights know of cache points.
    pub form: Form,
    /// What weights know.
    pub weights: Weights,
}
