//! Parameters of bidirectional path tracing that other methods do not have.

use crate::integrators::params::{ParamDefault, ParamSpec};

/// Light sub-paths.
pub(super) const LIGHT_PATHS: ParamSpec = ParamSpec {
    name: "light_paths",
    aliases: &[],
    default: ParamDefault::AutoFraction { min: 1.0 / 256.0, max: 1.0 },
    unit: "per pixel",
    short: "Light sub-paths per pixel and iteration; fewer are shared by several pixels",
    long: "With 1/4, each light sub-path is connected to the eye sub-paths of four pixels, which are different ones \
        in every iteration, and the light image gets a quarter of the splats. The number is rounded to a power of \
        two. `auto` takes all of them if allocation=full, else one of 1, 1/4 and 1/16, decided after two iterations. \
        Published: 1.",
};

/// Connections.
pub(super) const CONNECTIONS: ParamSpec = ParamSpec {
    name: "connections",
    aliases: &[],
    default: ParamDefault::AutoFraction { min: 1.0 / 64.0, max: 1.0 },
    unit: "of all pairs",
    short: "Fraction of the connections between the two sub-paths that is evaluated",
    long: "The connections of each eye vertex to light vertices (s and t both at least 2) are evaluated with this \
        probability and weighted up; the weights of all techniques take it into account. The number is rounded to a \
        power of two. `auto` evaluates all of them if allocation=full, else a fraction of 1, 1/2, 1/4, 1/8 or 1/16, \
        decided after two iterations. Published: 1.",
};
