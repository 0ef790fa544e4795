//! Parameters of the light vertex cache.

use crate::integrators::params::{ParamDefault, ParamSpec, presampled};

/// M.
pub(super) const PRESAMPLED_PATHS: ParamSpec = ParamSpec {
    aliases: &[],
    default: ParamDefault::AutoInt { min: 1, max: 30_000_000 },
    short: "M: light sub-paths per iteration whose vertices are stored",
    long: "Eye vertices draw from the vertices of these light sub-paths. `auto` is one for every pixel of the full picture, as \
        published. Fewer of them need less memory, and more pixels share each.",
    ..presampled::PRESAMPLED_PATHS
};

/// C.
pub(super) const CONNECTIONS_PER_VERTEX: ParamSpec = ParamSpec {
    aliases: &[],
    default: ParamDefault::AutoInt { min: 1, max: 1024 },
    short: "C: connections of each eye vertex to stored light vertices",
    long: "`auto` is the mean number of stored vertices of a light sub-path, at least 1, as published: as many connections as in \
        bidirectional path tracing. More of them make an iteration less noisy and dearer.",
    ..presampled::CONNECTIONS_PER_VERTEX
};
