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
mod pmfs;
mod places;
mod prepare;
pub(in crate::integrators) mod resampler;
mod sites;
pub(in crate::integrators) mod store;

use super::bdpt::sizing;
use super::bdpt::{Bidirectional, HIDE_EMITTERS, MAX_DEPTH, TECHNIQUES};
use super::{IntegratorSpec, ParamDefault, ParamSpec, Params};
use crate::mis::{Form, Heuristic};
use crate::spatial::nearest::Metric;
pub(in crate::integrators) use combined::{Draws, DrawsFrom};
pub(in crate::integrators) use distributions::Distribution;
pub(in crate::integrators) use resampler::Resampler;

pub(in crate::integrators) const PATHS: ParamSpec = ParamSpec {
    name: "paths",
    about: "M, light sub-paths per iteration from which eye vertices draw",
    default: ParamDefault::Int(200, 1, 10_000_000),
};
/// One of many connections is drawn: they need not be as many.
pub(in crate::integrators) const RR_DEPTH: ParamSpec =
    ParamSpec { default: ParamDefault::Int(1, 1, 1_000_000), ..super::bdpt::RR_DEPTH };
pub(in crate::integrators) const KEEP: ParamSpec = ParamSpec {
    name: "keep",
    about: "percent of an eye sub-path's survival of Russian roulette on matt surfaces, where connections find all light: lower, more of them end early",
    default: ParamDefault::Int(40, 1, 100),
};
const FIRST_STAGE: ParamSpec = ParamSpec {
    name: "paths",
    about: "M1, light sub-paths per iteration for the first stage; 0: as many as are worth their time beside the eye sub-paths",
    default: ParamDefault::Int(0, 0, 10_000_000),
};
const SECOND_STAGE: ParamSpec = ParamSpec {
    name: "second_stage",
    about: "M2, light vertices that the first stage leaves to a group of cache points",
    default: ParamDefault::Int(200, 1, 1_000_000),
};
pub(in crate::integrators) const SAMPLES: ParamSpec =
    ParamSpec { name: "samples", about: "N, draws of each eye vertex", default: ParamDefault::Int(1, 1, 1024) };
pub(in crate::integrators) const NEIGHBOURS: ParamSpec = ParamSpec {
    name: "neighbours",
    about: "cache points whose probabilities an eye vertex mixes",
    default: ParamDefault::Int(3, 0, 3),
};
const CACHES: ParamSpec = ParamSpec {
    name: "caches",
    about: "eye sub-paths that make cache points, per 100 000 pixels",
    default: ParamDefault::Int(400, 0, 100_000),
};
/// Groups share their first stage and have but few vertices to ask for: they may be denser.
const GROUPED_CACHES: ParamSpec = ParamSpec { default: ParamDefault::Int(2000, 0, 100_000), ..CACHES };
const EPSILON: ParamSpec = ParamSpec {
    name: "epsilon",
    about: "smallest ratio of densities p/q that weights use, in millionths",
    default: ParamDefault::Int(1000, 1, 1_000_000),
};
const DOUBT: ParamSpec = ParamSpec {
    name: "doubt",
    about: "smallest share of light, in millionths, of which weights assume that the cache points around do not know it (proposals=mixture)",
    default: ParamDefault::Int(20_000, 0, 1_000_000),
};
const TRUST: ParamSpec = ParamSpec {
    name: "trust",
    about: "what weights assume of cache points (proposals=mixture): learned: that they know as much of a place's light as they turned out to know of each other's; full: all of it, but for `doubt`",
    default: ParamDefault::Choice("learned", &["learned", "full"]),
};
const METRIC: ParamSpec = ParamSpec {
    name: "metric",
    about: "the nearest cache points of a place are those on surfaces that face about the same way, or those of any surface (plain)",
    default: ParamDefault::Choice("facing", &["facing", "plain"]),
};
const TARGET: ParamSpec = ParamSpec {
    name: "target",
    about: "what probabilities at a cache point are proportional to: irradiance, the light that a sub-path brings there; radiance, what of it the surface there sends back to the eye",
    default: ParamDefault::Choice("irradiance", &["irradiance", "radiance"]),
};
/// By measurement: where cache points are few it is worth to weigh each by itself; where they are dense, their mixture is the better one, and
/// to ask them costs as much as it gains but for the rare and bright samples that it spares.
const fn proposals(default: &'static str) -> ParamSpec {
    ParamSpec {
        name: "proposals",
        about: "mixture: eye vertices draw from one mixture of the probabilities around and a uniform share, of which weights assume that they are those of the place itself; asked: the same, but weights ask the cache points around what these see; split: each of these probabilities is a technique with a weight of its own, as published (asked and split take metric=plain, split target=irradiance; all that weights=balance knows is the mixture)",
        default: ParamDefault::Choice(default, &["mixture", "asked", "split"]),
    }
}
const SKIP: ParamSpec = sizing::parameter("auto");
const fn weights(default: &'static str, choices: &'static [&'static str]) -> ParamSpec {
    ParamSpec {
        name: "weights",
        about: "what weights know: balance: nothing of resampling; ris: that one of many is drawn; two-stage: that it is drawn in two stages",
        default: ParamDefault::Choice(default, choices),
    }
}

/// The parameters of methods with one stage; they differ in the weights they take by default.
const fn one_stage(default_weights: &'static str) -> [ParamSpec; 17] {
    let weights = weights(default_weights, &["balance", "ris"]);
    [
        MAX_DEPTH,
        RR_DEPTH,
        KEEP,
        HIDE_EMITTERS,
        TECHNIQUES,
        PATHS,
        SAMPLES,
        NEIGHBOURS,
        CACHES,
        METRIC,
        TARGET,
        proposals("split"),
        EPSILON,
        DOUBT,
        TRUST,
        weights,
        SKIP,
    ]
}

const PCBPT_PARAMS: [ParamSpec; 17] = one_stage("balance");
const RIS_PARAMS: [ParamSpec; 17] = one_stage("ris");
const TWO_STAGE_PARAMS: [ParamSpec; 18] = [
    MAX_DEPTH,
    RR_DEPTH,
    KEEP,
    HIDE_EMITTERS,
    TECHNIQUES,
    FIRST_STAGE,
    SECOND_STAGE,
    SAMPLES,
    NEIGHBOURS,
    GROUPED_CACHES,
    METRIC,
    TARGET,
    proposals("asked"),
    EPSILON,
    DOUBT,
    TRUST,
    weights("two-stage", &["balance", "ris", "two-stage"]),
    SKIP,
];

fn build_with(params: &Params, second_stage: Option<u32>) -> Box<dyn super::Integrator> {
    let weights = match params.choice("weights") {
        "balance" => Weights::Balance,
        "ris" => Weights::OneStage,
        _ => Weights::TwoStage,
    };
    let form = match params.choice("proposals") {
        "asked" if weights != Weights::Balance => Form::Asked,
        "split" if weights != Weights::Balance => Form::Split,
        _ => Form::Mixture,
    };
    let settings = Settings {
        scheme: Scheme::Caches,
        paths: params.int("paths") as u32,
        second_stage,
        samples: params.int("samples") as u32,
        neighbours: params.int("neighbours") as usize,
        cache_fraction: params.int("caches") as f64 * 1e-5,
        epsilon: params.int("epsilon") as f32 * 1e-6,
        doubt: params.int("doubt") as f32 * 1e-6,
        trust: params.choice("trust") == "full",
        // Which cache points a weight asks must be the same from whichever side a technique looks at a surface.
        metric: if params.choice("metric") == "plain" || form.asks() { Metric::Plain } else { Metric::Facing },
        radiance: params.choice("target") == "radiance" && form != Form::Split,
        form,
        weights,
    };
    build_resampled(params, settings)
}

/// An integrator with the parameters that all methods of this kind have.
pub(in crate::integrators) fn build_resampled(params: &Params, settings: Settings) -> Box<dyn super::Integrator> {
    let mut this = Bidirectional::new(params, Heuristic::Balance, params.techniques("techniques"));
    this.weigher.eye_limits.keep = params.int("keep") as f32 * 0.01;
    this.resample(settings);
    if params.choice("skip") == "auto" {
        this.size_by_scene();
    }
    Box::new(this)
}

fn build(params: &Params) -> Box<dyn super::Integrator> {
    build_with(params, None)
}

/// The registry's line of `pcbpt`.
pub static PCBPT: IntegratorSpec = IntegratorSpec {
    name: "pcbpt",
    aliases: &[],
    about: "Probabilistic connections: eye vertices draw from many light sub-paths by what these bring to nearby cache points; weights of bidirectional path tracing",
    params: &PCBPT_PARAMS,
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build,
};

/// The registry's line of `ris`.
pub static RIS: IntegratorSpec = IntegratorSpec {
    name: "ris",
    aliases: &["risbpt"],
    about: "Resampled connections with resampling-aware weights (RISBPT): as pcbpt, with weights that know the density which resampling makes",
    params: &RIS_PARAMS,
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build,
};

/// The registry's line of `two-stage`.
pub static TWO_STAGE: IntegratorSpec = IntegratorSpec {
    name: "two-stage",
    aliases: &["tsr"],
    about: "Two-stage resampled connections: as ris, from very many light sub-paths, of which cache points ask for few",
    params: &TWO_STAGE_PARAMS,
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build: |params| build_with(params, Some(params.int("second_stage") as u32)),
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
