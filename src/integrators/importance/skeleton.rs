//! `skeleton`: connections drawn at the nodes of the skeleton of empty space (SkelBPT, Noël and Biri 2015).

use super::{CANDIDATES, SELECTION, build, params};
use crate::integrators::IntegratorSpec;
use crate::integrators::importance::strategy::RecordPlaces;

/// The registry's line.
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
        build(params, RecordPlaces::Nodes { cells, acceptance: params.float("node_acceptance") })
    },
};
