//! `bdpt`: bidirectional path tracing (Lafortune & Willems 1993; Veach & Guibas 1994; Veach 1997, §10).
//!
//! Every pixel of every iteration traces one eye sub-path z_0 … and one light sub-path y_0 … and connects every prefix
//! of one with every prefix of the other. By default pixels share light sub-paths, and only some connections are made,
//! where more would not pay (`bidir::allocation`); weights count them.

mod own_subpath;
mod params;

use super::params::shared::{
    ALLOCATION, FALLBACK, GUIDED_EMISSION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, TECHNIQUES, heuristic,
};
use super::{Integrator, IntegratorSpec, ParamDefault, Params, bidirectional, fallback};
use crate::bidir::allocation::combinations;
use crate::bidir::{AllocationOptimizer, BidirSettings, Bidirectional, RayCosts};
use crate::mis::{Heuristic, LightSharing, SampleAllocation};
pub use own_subpath::OwnSubpath;

/// The registry's line.
pub static SPEC: IntegratorSpec = IntegratorSpec {
    name: "bdpt",
    aliases: &[],
    short: "Bidirectional path tracing",
    long: "A sub-path from the camera and one from a light are connected in every possible way, and the techniques are combined \
        by multiple importance sampling. It renders caustics and light that arrives by way of other rooms. By default pixels \
        share light sub-paths and evaluate some of the connections only, where that pays; allocation=full is the published \
        method.\n\n\
        Lafortune and Willems 1993, \"Bi-directional path tracing\"; Veach and Guibas 1994, \"Bidirectional estimators for \
        light transport\"; Veach 1997, chapter 10.",
    params: &[
        &[MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, HIDE_EMITTERS, heuristic("balance"), TECHNIQUES, GUIDED_EMISSION],
        &[ALLOCATION, params::LIGHT_PATHS, params::CONNECTIONS, FALLBACK],
    ],
    unbiased: true,
    limitations: |_| None,
    build,
};

/// Numbers of light sub-paths that may be decided, as fractions of the full number.
const LIGHT_PATHS: [f32; 3] = [1.0, 0.25, 0.0625];
/// Numbers of connections that may be decided, as fractions of the full number.
const CONNECTIONS: [f32; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];

/// Bidirectional path tracing with its defaults, as far as the parameters of another method do not say otherwise.
pub fn beside(params: &Params) -> Bidirectional<OwnSubpath> {
    let ParamDefault::Int { default: rr_depth, .. } = RR_DEPTH_BIDIRECTIONAL.default else { unreachable!() };
    let settings = bidirectional::settings_with(params, params.techniques("techniques"), rr_depth as u32);
    let candidates = combinations(&LIGHT_PATHS, &CONNECTIONS);
    let optimizer = AllocationOptimizer::new(candidates, RayCosts::OWN_SUBPATH, LightSharing::OfPixels);
    Bidirectional::new(settings, OwnSubpath).with_optimizer(Some(optimizer.predicting_eye_only()))
}

fn build(params: &Params) -> Box<dyn Integrator> {
    let heuristic = if params.is("heuristic", "balance") { Heuristic::Balance } else { Heuristic::Power };
    let settings = bidirectional::settings(params, params.techniques("techniques"));
    let this = Bidirectional::new(BidirSettings { heuristic, ..settings }, OwnSubpath);
    let candidates = candidates(params);
    match (&candidates[..], heuristic) {
        // The variance at other numbers of samples is known for the balance heuristic only.
        (&[only], _) | (&[only, ..], Heuristic::Power) => Box::new(this.with_allocation(only)),
        _ => {
            let optimizer = AllocationOptimizer::new(candidates, RayCosts::OWN_SUBPATH, LightSharing::OfPixels);
            let optimizer = if fallback::is_allowed(params) { optimizer.predicting_eye_only() } else { optimizer };
            fallback::with_path_tracing(params, this.with_optimizer(Some(optimizer)))
        }
    }
}

/// The allocations that the parameters allow.
fn candidates(params: &Params) -> Vec<SampleAllocation> {
    let full = params.is("allocation", "full");
    let fractions = |name: &str, all: &[f32]| match params.auto_float(name) {
        Some(fixed) => vec![nearest_power_of_two(fixed)],
        None if full => vec![1.0],
        None => all.to_vec(),
    };
    combinations(&fractions("light_paths", &LIGHT_PATHS), &fractions("connections", &CONNECTIONS))
}

/// The power of two with the nearest logarithm.
fn nearest_power_of_two(x: f64) -> f32 {
    x.log2().round().exp2() as f32
}
