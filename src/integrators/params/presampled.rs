//! Parameters of methods in which eye vertices draw connections from many light sub-paths.

use super::{AliasValues, ParamAlias, ParamDefault, ParamSpec};

/// M.
pub const PRESAMPLED_PATHS: ParamSpec = ParamSpec {
    name: "presampled_paths",
    aliases: &[ParamAlias { name: "paths", values: AliasValues::Same }],
    default: ParamDefault::Int { default: 200, min: 1, max: 10_000_000 },
    unit: "paths",
    short: "M: light sub-paths per iteration from which eye vertices draw",
    long: "The vertices of the first M light sub-paths of an iteration are the proposals of resampling; every cache \
        point casts a shadow ray to each of them. More of them make better connections and dearer iterations. \
        Published: 200 in Nabata et al. 2020 (resampling-aware weights, section 6.1), 100 in Popov et al. 2015.",
};

/// N.
pub const CONNECTIONS_PER_VERTEX: ParamSpec = ParamSpec {
    name: "connections_per_vertex",
    aliases: &[ParamAlias { name: "samples", values: AliasValues::Same }],
    default: ParamDefault::Int { default: 1, min: 1, max: 1024 },
    unit: "connections",
    short: "N: connections of each eye vertex to resampled light sub-paths",
    long: "Each of the N connections is drawn by itself, with replacement. More of them make an iteration less noisy \
        and dearer; raise the number where cache points cost much more than connections. Published: 1 (Nabata et al. \
        2020, resampling-aware weights, section 6.1.5, which finds 2 better in some scenes).",
};

/// Factor on the survival of eye sub-paths.
pub const RR_SCALE: ParamSpec = ParamSpec {
    name: "rr_scale",
    aliases: &[ParamAlias { name: "keep", values: AliasValues::Parts(100) }],
    default: ParamDefault::Fraction { default: 0.4, min: 0.01, max: 1.0 },
    unit: "",
    short: "Factor on the roulette survival of eye sub-paths at diffuse surfaces",
    long: "Connections from a diffuse surface carry most of its indirect light already, so that eye sub-paths may \
        end there sooner. The factor multiplies the survival probability from vertex rr_depth on. A smaller one \
        makes samples cheaper and noisier. 1 is ordinary Russian roulette, as published.",
};
