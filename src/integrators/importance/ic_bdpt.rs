//! `ic-bdpt`: connections drawn at importance records on surfaces (ICBPT, Noël and Biri 2015, §5).

use super::{CANDIDATES, SELECTION, build, params, surfaces};
use crate::integrators::IntegratorSpec;

/// The registry's line.
pub static IC_BDPT: IntegratorSpec = IntegratorSpec {
    name: "ic-bdpt",
    aliases: &["icbpt"],
    short: "Bidirectional path tracing with importance caching (ICBPT)",
    long: "As `skeleton`, with probabilities computed at importance records on surfaces; an eye vertex mixes those of the nearest \
        records.\n\n\
        Noël and Biri 2015, section 5, after Georgiev, Křivánek, Popov and Slusallek 2012, \"Importance caching for complex \
        illumination\". As published: selection=per-length, weights=balance, connections_per_vertex=1, rr_depth=2, \
        rr_scale=1, allocation=full.",
    params: &[CANDIDATES, &[params::RECORD_DENSITY, params::NEAREST_RECORDS], SELECTION],
    unbiased: true,
    limitations: |_| None,
    build: |params| build(params, surfaces(params)),
};
