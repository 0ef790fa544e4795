//! `ris`: resampled connections with resampling-aware weights (RISBPT, Nabata et al. 2020).

use super::{ONE_STAGE, build_one_stage, params};
use crate::integrators::IntegratorSpec;
use crate::integrators::params::shared::{ALLOCATION, FALLBACK};

/// The registry's line.
pub static RIS: IntegratorSpec = IntegratorSpec {
    name: "ris",
    aliases: &["risbpt"],
    short: "Resampled connections with resampling-aware weights (RISBPT)",
    long: "As `pcbpt`, with weights that take the density of resampled connections into account, so that these get the light they \
        are good at. It is for interiors lit by way of other rooms or through gaps.\n\n\
        Nabata, Iwasaki and Dobashi 2020, \"Resampling-aware weighting functions for bidirectional path tracing using multiple \
        light sub-paths\". As published: rr_scale=1, allocation=full, presampled_paths=200.",
    params: &[ONE_STAGE, &[params::RIS_PATHS, params::weights("resampling-aware"), ALLOCATION, FALLBACK]],
    unbiased: true,
    limitations: |_| None,
    build: build_one_stage,
};
