//! `two-stage`: resampled connections in two stages, from very many light sub-paths (Nabata et al. 2020, "Two-stage
//! resampling").

use super::params;
use crate::integrators::params::presampled::{CONNECTIONS_PER_VERTEX, RR_SCALE};
use crate::integrators::params::shared::{
    ALLOCATION, FALLBACK, GUIDED_EMISSION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_RESAMPLED, TECHNIQUES,
};
use crate::integrators::{IntegratorSpec, ParamSpec};

const PARAMS: &[ParamSpec] = &[
    MAX_DEPTH,
    RR_DEPTH_RESAMPLED,
    RR_SCALE,
    HIDE_EMITTERS,
    TECHNIQUES,
    GUIDED_EMISSION,
    params::FIRST_STAGE_PATHS,
    params::SECOND_STAGE_PATHS,
    params::FIRST_STAGE,
    CONNECTIONS_PER_VERTEX,
    params::NEAREST_CACHES,
    params::GROUPED_CACHE_DENSITY,
    params::GROUP_SIZE,
    params::METRIC,
    params::TARGET,
    params::proposal_model("mixture-with-visibility"),
    params::MIN_DENSITY_RATIO,
    params::MIN_UNSEEN_FRACTION,
    params::UNSEEN_MODEL,
    params::TWO_STAGE_WEIGHTS,
    ALLOCATION,
    FALLBACK,
];

/// The registry's line.
pub static TWO_STAGE: IntegratorSpec = IntegratorSpec {
    name: "two-stage",
    aliases: &["tsr"],
    short: "Resampled connections in two stages, from very many light sub-paths",
    long: "As `ris`, from many more light sub-paths: a first stage, which ignores visibility and needs no shadow rays, leaves few \
        of them to each group of cache points; a second stage resamples those with visibility. It is the first choice for \
        interiors that are hard to light.\n\n\
        Nabata, Iwasaki and Dobashi 2020, \"Two-stage resampling for bidirectional path tracing with multiple light \
        sub-paths\". As published: rr_scale=1, allocation=full, proposal_model=per-cache, first_stage=unoccluded, \
        presampled_paths=10000, second_stage_paths=200, \
        cache_density=0.4%, group_size=16.",
    params: &[PARAMS],
    unbiased: true,
    limitations: |_| None,
    build: |params| {
        // Zero is decided by the scene.
        let paths = params.auto_int("presampled_paths").unwrap_or(0) as u32;
        super::build(params, paths, Some(params.int("second_stage_paths") as u32))
    },
};
