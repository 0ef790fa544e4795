//! Importance caching: probabilities of light vertices are kept at few places, as a combination of cautious and daring ones
//! (`resampling::combined`).
//!
//! * `skeleton` (SkelBPT, Noël and Biri 2015): at nodes in the middle of empty space. Every eye vertex belongs to a node, whose look-up costs
//!   nothing.
//! * `ic-bdpt` (ICBPT, ibid. §5): at records on surfaces, the three nearest of which an eye vertex mixes.
//! * `importance-caching` (Georgiev et al. 2012): many-light rendering. What the camera sees is connected to virtual lights, the vertices
//!   of all light sub-paths; there are no other ways to make a path, so the 1/d² of near ones shows.
//!
//! As published, the first two connect an eye vertex to one light sub-path of each length, with the weights of bidirectional path tracing.
//! These do not know how much more likely than others the sub-paths are drawn that matter, so that other techniques keep most of the
//! light, and noise. By default eye vertices draw from all lengths together, and weights know of it as those of `ris` do: from means of
//! earlier iterations at the same places (`mis::resampled`). They are wrong about what a place sees and its site does not, and
//! cost no rays.

use super::bdpt::{self, Bidirectional, HIDE_EMITTERS, MAX_DEPTH, TECHNIQUES, sizing};
use super::resampling::{self, Distribution, Draws, DrawsFrom, KEEP, RR_DEPTH, Scheme, Settings, Weights};
use super::{Integrator, IntegratorSpec, ParamDefault, ParamSpec, Params};
use crate::mis::{Form, Heuristic, Techniques};
use crate::prepared::Features;
use crate::spatial::nearest::Metric;

const PATHS: ParamSpec = ParamSpec {
    about: "N, light sub-paths per iteration from which eye vertices draw; all others serve the light image only",
    default: ParamDefault::Int(1024, 1, 10_000_000),
    ..resampling::PATHS
};
const SAMPLES: ParamSpec = ParamSpec {
    about: "draws of each eye vertex; with draws=apart, for each length of light sub-paths",
    default: ParamDefault::Int(4, 1, 1024),
    ..resampling::SAMPLES
};
const MANY_SAMPLES: ParamSpec =
    ParamSpec { about: "virtual lights that each camera ray's point is connected to", ..SAMPLES };
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
    default: ParamDefault::Int(20, 0, 10_000),
};
const DRAWS: ParamSpec = ParamSpec {
    name: "draws",
    about: "together: from light sub-paths of all lengths, by a mixture of what is seen, of what would be if nothing were in the way, and of all alike; apart: from those of each length, by whichever of these gives a vertex most, as published",
    default: ParamDefault::Choice("together", &["together", "apart"]),
};
const DISTRIBUTIONS: ParamSpec = ParamSpec {
    name: "distributions",
    about: "of light sub-paths: all, or besides the uniform one only what is seen, only what would be if nothing were in the way, or nothing",
    default: ParamDefault::Choice("all", &["all", "seen", "open", "uniform"]),
};
const WEIGHTS: ParamSpec = ParamSpec {
    name: "weights",
    about: "what weights know: balance: nothing of how sub-paths are drawn, as published; aware: what the places around would draw, by what they have found so far (with draws=apart they are asked by shadow rays)",
    default: ParamDefault::Choice("aware", &["balance", "aware"]),
};
/// Smallest ratio p/q that weights use, as in `ris`.
const EPSILON: f32 = 1e-3;
/// Share of light of which weights assume that a site does not know it.
const DOUBT: f32 = 0.01;
const SKIP: ParamSpec = sizing::parameter("auto");

/// What all have in common; for methods with several techniques, `params` say how they draw and weigh.
fn settings(params: &Params, scheme: Scheme, records: i64, neighbours: i64) -> Settings {
    Settings {
        scheme,
        paths: params.int("paths") as u32,
        second_stage: None,
        samples: params.int("samples") as u32,
        neighbours: neighbours as usize,
        cache_fraction: records as f64 * 1e-5,
        epsilon: EPSILON,
        doubt: DOUBT,
        trust: false,
        metric: Metric::Facing,
        radiance: false,
        form: Form::Mixture,
        weights: Weights::Balance,
    }
}

fn draws(params: &Params) -> Draws {
    Draws {
        from: if params.choice("draws") == "apart" { DrawsFrom::Lengths } else { DrawsFrom::Mixture },
        only: match params.choice("distributions") {
            "seen" => Some(Distribution::Seen),
            "open" => Some(Distribution::Open),
            "uniform" => Some(Distribution::Uniform),
            _ => None,
        },
    }
}

/// The parameters of methods with several techniques, which differ in their places.
const fn parameters([first, second]: [ParamSpec; 2]) -> [ParamSpec; 13] {
    [
        MAX_DEPTH,
        RR_DEPTH,
        KEEP,
        HIDE_EMITTERS,
        TECHNIQUES,
        PATHS,
        SAMPLES,
        first,
        second,
        DRAWS,
        DISTRIBUTIONS,
        WEIGHTS,
        SKIP,
    ]
}

const SKELETON_PARAMS: [ParamSpec; 13] = parameters([CELLS, ACCEPTANCE]);
const IC_BDPT_PARAMS: [ParamSpec; 13] = parameters([RECORDS, NEIGHBOURS]);

/// Such a method; where it asks by shadow rays, it is of sub-paths of each length.
fn bidirectional(params: &Params, from: DrawsFrom, settings: Settings) -> Box<dyn Integrator> {
    let settings = match params.choice("weights") {
        "aware" => Settings {
            weights: Weights::OneStage,
            form: if from == DrawsFrom::Lengths { Form::Asked } else { Form::Mixture },
            ..settings
        },
        _ => settings,
    };
    resampling::build_resampled(params, settings)
}

/// The registry's line of `skeleton`.
pub static SKELETON: IntegratorSpec = IntegratorSpec {
    name: "skeleton",
    aliases: &["skelbpt"],
    about: "Skeleton based connections (SkelBPT): eye vertices draw light sub-paths by what is seen from the middle of the room they are in",
    params: &SKELETON_PARAMS,
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build: |params| {
        let cells = usize::try_from(params.int("cells")).ok().filter(|&n| n > 0);
        let acceptance = params.int("acceptance") as f64 * 0.01;
        let draws = draws(params);
        let scheme = Scheme::Skeleton { draws, cells, acceptance };
        bidirectional(params, draws.from, settings(params, scheme, 0, 1))
    },
};

/// The registry's line of `ic-bdpt`.
pub static IC_BDPT: IntegratorSpec = IntegratorSpec {
    name: "ic-bdpt",
    aliases: &["icbpt"],
    about: "Bidirectional path tracing with importance caching (ICBPT): eye vertices draw light sub-paths by probabilities kept at records on surfaces",
    params: &IC_BDPT_PARAMS,
    unbiased: true,
    refuses: |_| None,
    cannot: |_| None,
    build: |params| {
        let draws = draws(params);
        let settings = settings(params, Scheme::Records(draws), params.int("records"), params.int("neighbours"));
        bidirectional(params, draws.from, settings)
    },
};

/// The registry's line of `importance-caching`.
pub static IMPORTANCE_CACHING: IntegratorSpec = IntegratorSpec {
    name: "importance-caching",
    aliases: &[],
    about: "Many lights with importance caching: what the camera sees is lit by virtual lights, drawn by probabilities kept at records on surfaces",
    params: &[MAX_DEPTH, bdpt::RR_DEPTH, HIDE_EMITTERS, PATHS, MANY_SAMPLES, RECORDS, NEIGHBOURS],
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
        let scheme = Scheme::Records(Draws { from: DrawsFrom::Many, only: None });
        let mut this = Bidirectional::new(params, Heuristic::Balance, techniques);
        this.resample(settings(params, scheme, params.int("records"), params.int("neighbours")));
        Box::new(this)
    },
};
