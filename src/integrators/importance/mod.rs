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

mod params;

use super::bdpt::Bidirectional;
use super::params::shared::{
    ALLOCATION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, RR_DEPTH_RESAMPLED, TECHNIQUES,
};
use super::resampling::{self, Distribution, Draws, DrawsFrom, Scheme, Settings, Weights};
use super::{Integrator, IntegratorSpec, ParamSpec, Params};
use crate::mis::{Form, Heuristic, Techniques};
use crate::prepared::Features;
use crate::spatial::nearest::Metric;

/// Smallest ratio p/q that weights use, as in `ris`.
const EPSILON: f32 = 1e-3;
/// Share of light of which weights assume that a site does not know it.
const DOUBT: f32 = 0.01;

/// What all have in common; for methods with several techniques, `params` say how they draw and weigh.
fn settings(params: &Params, scheme: Scheme, cache_fraction: f64, neighbours: i64) -> Settings {
    Settings {
        scheme,
        paths: params.int("presampled_paths") as u32,
        second_stage: None,
        samples: params.int("connections_per_vertex") as u32,
        neighbours: neighbours as usize,
        cache_fraction,
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
        from: if params.choice("selection") == "per-length" { DrawsFrom::Lengths } else { DrawsFrom::Mixture },
        only: match params.choice("distributions") {
            "visible" => Some(Distribution::Seen),
            "unoccluded" => Some(Distribution::Open),
            "uniform" => Some(Distribution::Uniform),
            _ => None,
        },
    }
}

/// Parameters of methods with several techniques, before those of their places.
const CANDIDATES: &[ParamSpec] = &[
    MAX_DEPTH,
    RR_DEPTH_RESAMPLED,
    resampling::params::RR_SCALE,
    HIDE_EMITTERS,
    TECHNIQUES,
    params::PRESAMPLED_PATHS,
    params::CONNECTIONS_PER_VERTEX,
];
/// Parameters of methods with several techniques, after those of their places.
const SELECTION: &[ParamSpec] = &[params::SELECTION, params::DISTRIBUTIONS, params::WEIGHTS, ALLOCATION];

/// Such a method; where it asks by shadow rays, it is of sub-paths of each length.
fn bidirectional(params: &Params, from: DrawsFrom, settings: Settings) -> Box<dyn Integrator> {
    let settings = match params.choice("weights") {
        "resampling-aware" => Settings {
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
    short: "Skeleton-based connections (SkelBPT): bidirectional, resampled per room",
    long: "As `ris`, with probabilities computed at the nodes of a curve skeleton of the empty space, in the middle \
        of rooms and passages. Finding the node of an eye vertex takes constant time. In large halls it is as good \
        as `two-stage`.\n\n\
        Noël and Biri 2015 (SkelBPT). As published: selection=per-length, weights=balance, connections_per_vertex=1, \
        rr_depth=2, rr_scale=1, allocation=full, node_acceptance=1.",
    params: &[CANDIDATES, &[params::VOXEL_RESOLUTION, params::NODE_ACCEPTANCE], SELECTION],
    unbiased: true,
    limitations: |_| None,
    build: |params| {
        let cells = params.auto_int("voxel_resolution").map(|n| n as usize);
        let acceptance = params.float("node_acceptance");
        let draws = draws(params);
        let scheme = Scheme::Skeleton { draws, cells, acceptance };
        bidirectional(params, draws.from, settings(params, scheme, 0.0, 1))
    },
};

/// The registry's line of `ic-bdpt`.
pub static IC_BDPT: IntegratorSpec = IntegratorSpec {
    name: "ic-bdpt",
    aliases: &["icbpt"],
    short: "Bidirectional path tracing with importance caching (ICBPT)",
    long: "As `skeleton`, with probabilities computed at importance records on surfaces; an eye vertex mixes those \
        of the nearest records.\n\n\
        Noël and Biri 2015, section 5, after Georgiev, Křivánek, Popov and Slusallek 2012, \"Importance caching for \
        complex illumination\". As published: selection=per-length, weights=balance, connections_per_vertex=1, \
        rr_depth=2, rr_scale=1, allocation=full.",
    params: &[CANDIDATES, &[params::RECORD_DENSITY, params::NEAREST_RECORDS], SELECTION],
    unbiased: true,
    limitations: |_| None,
    build: |params| {
        let draws = draws(params);
        let settings =
            settings(params, Scheme::Records(draws), params.float("record_density"), params.int("nearest_records"));
        bidirectional(params, draws.from, settings)
    },
};

/// The registry's line of `importance-caching`.
pub static IMPORTANCE_CACHING: IntegratorSpec = IntegratorSpec {
    name: "importance-caching",
    aliases: &[],
    short: "Many-light rendering with importance caching",
    long: "What the camera sees is connected to virtual lights, the vertices of many light sub-paths, drawn by \
        probabilities that are computed at importance records on surfaces. There are no other techniques, so that \
        the 1/d^2 of near virtual lights shows as noise.\n\n\
        Georgiev, Křivánek, Popov and Slusallek 2012, \"Importance caching for complex illumination\".",
    params: &[
        &[MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, HIDE_EMITTERS],
        &[params::VIRTUAL_LIGHT_PATHS, params::LIGHTS_PER_VERTEX],
        &[params::RECORD_DENSITY, params::NEAREST_RECORDS],
    ],
    unbiased: true,
    limitations: |features| {
        (features.contains(Features::SPECULAR) || features.contains(Features::MASKS)).then(|| {
            "what the camera sees in mirrors, and through glass or masks, stays black: only its first hit is connected to lights".into()
        })
    },
    build: |params| {
        let mut techniques = Techniques::none();
        techniques.switch(0..usize::MAX, 2..3, true);
        let scheme = Scheme::Records(Draws { from: DrawsFrom::Many, only: None });
        let mut this = Bidirectional::new(params, Heuristic::Balance, techniques);
        this.resample(settings(params, scheme, params.float("record_density"), params.int("nearest_records")));
        Box::new(this)
    },
};
