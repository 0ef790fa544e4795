//! Importance caching: probabilities of light vertices are kept at few places, as a combination of cautious and daring ones
//! (`resampling::combined`), with the weights of bidirectional path tracing.
//!
//! * `skeleton` (SkelBPT, Noël and Biri 2015): at nodes in the middle of empty space. Every eye vertex belongs to a node, whose look-up costs
//!   nothing, and connects to one light sub-path of each length.
//! * `ic-bdpt` (ICBPT, ibid. §5): at records on surfaces, the three nearest of which an eye vertex mixes.
//! * `importance-caching` (Georgiev et al. 2012): many-light rendering. What the camera sees is connected to virtual lights, the vertices
//!   of all light sub-paths; there are no other ways to make a path, so the 1/d² of near ones shows.

use super::bdpt::{Bidirectional, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH, TECHNIQUES, sizing};
use super::resampling::{self, Scheme, Settings, Weights};
use super::{Integrator, IntegratorSpec, ParamDefault, ParamSpec, Params};
use crate::mis::{Form, Heuristic, Techniques};
use crate::prepared::Features;
use crate::spatial::nearest::Metric;

const PATHS: ParamSpec = ParamSpec {
    about: "N, light sub-paths per iteration from which eye vertices draw; all others serve the light image only",
    default: ParamDefault::Int(1024, 1, 10_000_000),
    ..resampling::PATHS
};
const SAMPLES: ParamSpec =
    ParamSpec { about: "draws of each eye vertex, for each length of light sub-paths", ..resampling::SAMPLES };
const MANY_SAMPLES: ParamSpec = ParamSpec {
    about: "virtual lights that each camera ray's point is connected to",
    default: ParamDefault::Int(4, 1, 1024),
    ..SAMPLES
};
const RECORDS: ParamSpec = ParamSpec {
    name: "records",
    about: "eye sub-paths that make importance records, per 100 000 pixels",
    default: ParamDefault::Int(100, 0, 100_000),
};
const NEIGHBOURS: ParamSpec =
    ParamSpec { about: "records whose probabilities an eye vertex mixes", ..resampling::NEIGHBOURS };
const CELLS: ParamSpec = ParamSpec {
    name: "cells",
    about: "voxels along the longest side of the scene for its skeleton; 0: decided by the scene",
    default: ParamDefault::Int(0, 0, 1024),
};
const ACCEPTANCE: ParamSpec = ParamSpec {
    name: "acceptance",
    about: "nodes with at most so many percent of the mean number of eye vertices are left out; there, draws are uniform",
    default: ParamDefault::Int(100, 0, 10_000),
};
const WEIGHTS: ParamSpec = ParamSpec {
    name: "weights",
    about: "what weights know: balance: nothing of how sub-paths are drawn, as published; aware: what the places around would draw",
    default: ParamDefault::Choice("balance", &["balance", "aware"]),
};
/// Smallest ratio p/q that weights use, as in `ris`.
const EPSILON: f32 = 1e-3;
const SKIP: ParamSpec = sizing::parameter("auto");

fn build(params: &Params, settings: Settings, techniques: Techniques, size: bool) -> Box<dyn Integrator> {
    let mut this = Bidirectional::new(params, Heuristic::Balance, techniques);
    this.resample(settings);
    if size {
        this.size_by_scene();
    }
    Box::new(this)
}

/// The same with the weights that `params` ask for.
fn aware(params: &Params, settings: Settings) -> Settings {
    match params.choice("weights") {
        "aware" => Settings { weights: Weights::OneStage, form: Form::Asked, epsilon: EPSILON, ..settings },
        _ => settings,
    }
}

fn settings(params: &Params, scheme: Scheme, records: i64, neighbours: i64) -> Settings {
    Settings {
        scheme,
        paths: params.int("paths") as u32,
        second_stage: None,
        samples: params.int("samples") as u32,
        neighbours: neighbours as usize,
        cache_fraction: records as f64 * 1e-5,
        epsilon: 1.0,
        doubt: 0.0,
        trust: false,
        metric: Metric::Facing,
        radiance: false,
        form: Form::Mixture,
        weights: Weights::Balance,
    }
}

/// The registry's line of `skeleton`.
pub static SKELETON: IntegratorSpec = IntegratorSpec {
    name: "skeleton",
    aliases: &["skelbpt"],
    about: "Skeleton based connections (SkelBPT): eye vertices draw light sub-paths of each length by what is seen from the middle of the room they are in",
    params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS, TECHNIQUES, PATHS, SAMPLES, CELLS, ACCEPTANCE, WEIGHTS, SKIP],
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build: |params| {
        let cells = usize::try_from(params.int("cells")).ok().filter(|&n| n > 0);
        let scheme = Scheme::Skeleton { cells, acceptance: params.int("acceptance") as f64 * 0.01 };
        build(
            params,
            aware(params, settings(params, scheme, 0, 1)),
            params.techniques("techniques"),
            params.choice("skip") == "auto",
        )
    },
};

/// The registry's line of `ic-bdpt`.
pub static IC_BDPT: IntegratorSpec = IntegratorSpec {
    name: "ic-bdpt",
    aliases: &["icbpt"],
    about: "Bidirectional path tracing with importance caching (ICBPT): eye vertices draw light sub-paths of each length by probabilities kept at records on surfaces",
    params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS, TECHNIQUES, PATHS, SAMPLES, RECORDS, NEIGHBOURS, WEIGHTS, SKIP],
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build: |params| {
        let scheme = Scheme::Records { pooled: false };
        let settings = settings(params, scheme, params.int("records"), params.int("neighbours"));
        build(params, aware(params, settings), params.techniques("techniques"), params.choice("skip") == "auto")
    },
};

/// The registry's line of `importance-caching`.
pub static IMPORTANCE_CACHING: IntegratorSpec = IntegratorSpec {
    name: "importance-caching",
    aliases: &[],
    about: "Many lights with importance caching: what the camera sees is lit by virtual lights, drawn by probabilities kept at records on surfaces",
    params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS, PATHS, MANY_SAMPLES, RECORDS, NEIGHBOURS],
    unbiased: true,
    refuses: |_| None,
    cannot: |features| {
        (features.contains(Features::SPECULAR) || features.contains(Features::MASKS)).then(|| {
            "what the camera sees in mirrors, and through glass or masks, stays black: only its first hit is connected to lights".into()
        })
    },
    build: |params| {
        let mut techniques = Techniques::none();
        techniques.switch(0..usize::MAX, 2..3, true);
        let settings =
            settings(params, Scheme::Records { pooled: true }, params.int("records"), params.int("neighbours"));
        build(params, settings, techniques, false)
    },
};
