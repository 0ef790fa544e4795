//! `pcbpt`: probabilistic connections (Popov et al. 2015), with the weights of bidirectional path tracing.

use super::{ONE_STAGE, build_one_stage, params};
use crate::integrators::IntegratorSpec;
use crate::integrators::params::presampled::PRESAMPLED_PATHS;
use crate::integrators::params::shared::{ALLOCATION, FALLBACK};

/// The registry's line.
pub static PCBPT: IntegratorSpec = IntegratorSpec {
    name: "pcbpt",
    aliases: &[],
    short: "Probabilistic connections (PCBPT): bidirectional, connections are resampled",
    long: "Many light sub-paths are traced in every iteration. Each eye vertex is connected to one of their vertices, drawn by \
        the contributions that light sub-paths make at nearby cache points. Weights are those of bidirectional path \
        tracing, which ignore resampling; `ris` is the same method with better weights.\n\n\
        Popov, Ramamoorthi, Durand and Drettakis 2015, \"Probabilistic connections for bidirectional path tracing\". As \
        published: rr_scale=1, allocation=full.",
    params: &[ONE_STAGE, &[PRESAMPLED_PATHS, params::weights("balance"), ALLOCATION, FALLBACK]],
    unbiased: true,
    limitations: |_| None,
    build: build_one_stage,
};
