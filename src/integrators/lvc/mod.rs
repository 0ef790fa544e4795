//! `lvc`: bidirectional path tracing with a light vertex cache (Davidovič, Křivánek, Hašan & Slusallek 2014,
//! "Progressive light transport simulation on the GPU: survey and improvements", §5.2). All light sub-paths of an
//! iteration are traced first; every eye vertex is then connected to C of their vertices, drawn uniformly.
//!
//! It is the baseline between `bdpt`, whose eye vertices are connected to all vertices of one light sub-path, and
//! `pcbpt`, whose eye vertices draw by the light that arrives.

mod params;
mod strategy;

use super::fallback::with_fallback;
use super::params::presampled::RR_SCALE;
use super::params::shared::{
    ALLOCATION, FALLBACK, GUIDED_EMISSION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, TECHNIQUES,
};
use super::{IntegratorSpec, ParamDefault, ParamSpec, bidirectional};
use crate::bidir::Bidirectional;
use strategy::VertexCache;

/// The registry's line.
pub static SPEC: IntegratorSpec = IntegratorSpec {
    name: "lvc",
    aliases: &["lvcbpt"],
    short: "Bidirectional path tracing with a light vertex cache (LVC-BPT)",
    long: "The vertices of all light sub-paths of an iteration are stored, and every eye vertex is connected to a few of them, drawn \
        uniformly, with weights that count this density. It is the usual baseline between `bdpt` and the resampled methods.\n\n\
        Davidovič, Křivánek, Hašan and Slusallek 2014, \"Progressive light transport simulation on the GPU: survey and \
        improvements\", section 5.2. As published: allocation=full.",
    params: &[
        &[MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, NO_RR_SCALE, HIDE_EMITTERS, TECHNIQUES, GUIDED_EMISSION],
        &[params::PRESAMPLED_PATHS, params::CONNECTIONS_PER_VERTEX, ALLOCATION, FALLBACK],
    ],
    unbiased: true,
    limitations: |_| None,
    build: |params| {
        let paths = params.auto_int("presampled_paths").map(|n| n as u32);
        let connections = params.auto_int("connections_per_vertex").map(|n| n as u32);
        let settings = bidirectional::resampled_settings(params, params.techniques("techniques"));
        let this = Bidirectional::new(settings, VertexCache::new(paths, connections));
        with_fallback(params, this.with_optimizer(bidirectional::optimizer(params)))
    },
};

/// Ordinary Russian roulette: uniform draws do not find all light.
const NO_RR_SCALE: ParamSpec =
    ParamSpec { default: ParamDefault::Fraction { default: 1.0, min: 0.01, max: 1.0 }, ..RR_SCALE };
