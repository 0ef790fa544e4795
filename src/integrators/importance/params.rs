//! Parameters of importance caching.

use crate::integrators::params::presampled;
use crate::integrators::params::{AliasValues, Choice, ParamAlias, ParamDefault, ParamSpec};

/// N of Noël and Biri 2015.
pub(super) const PRESAMPLED_PATHS: ParamSpec = ParamSpec {
    default: ParamDefault::Int { default: 1024, min: 1, max: 10_000_000 },
    short: "Light sub-paths per iteration from which eye vertices draw",
    long: "Of all light sub-paths of an iteration these take part in resampled connections; the others serve the \
        light image only. More of them make better connections and dearer iterations. Published: 1024 (Noël and Biri \
        2015, section 5).",
    ..presampled::PRESAMPLED_PATHS
};

/// Light sub-paths of virtual lights.
pub(super) const VIRTUAL_LIGHT_PATHS: ParamSpec = ParamSpec {
    short: "Light sub-paths per iteration whose vertices are the virtual lights",
    long: "All vertices of these light sub-paths are virtual lights, from which visible points draw. More of them \
        make better connections and dearer iterations.",
    ..PRESAMPLED_PATHS
};

/// Connections of methods with several techniques.
pub(super) const CONNECTIONS_PER_VERTEX: ParamSpec = ParamSpec {
    default: ParamDefault::Int { default: 4, min: 1, max: 1024 },
    short: "Connections of each eye vertex to resampled light sub-paths",
    long: "With selection=per-length it is the number for each length of light sub-paths. More of them make an \
        iteration less noisy and dearer. Published: 1 for each length.",
    ..presampled::CONNECTIONS_PER_VERTEX
};

/// Connections of many-light rendering.
pub(super) const LIGHTS_PER_VERTEX: ParamSpec = ParamSpec {
    short: "Virtual lights that each visible point is connected to",
    long: "They are drawn by the probabilities of the nearest importance records. More of them make an iteration \
        less noisy and dearer.",
    ..CONNECTIONS_PER_VERTEX
};

/// Importance records.
pub(super) const RECORD_DENSITY: ParamSpec = ParamSpec {
    name: "record_density",
    aliases: &[ParamAlias { name: "records", values: AliasValues::Parts(100_000) }],
    default: ParamDefault::Fraction { default: 0.001, min: 0.0, max: 1.0 },
    unit: "per pixel",
    short: "Eye sub-paths per pixel whose vertices become importance records",
    long: "All vertices of these eye sub-paths are importance records, at which the probabilities of light vertices \
        are computed in every iteration. Denser records are closer to each eye vertex and cost more shadow rays. \
        Published: 0.001, the density d of Noël and Biri 2015, section 5.",
};

/// Records whose probabilities are used.
pub(super) const NEAREST_RECORDS: ParamSpec = ParamSpec {
    name: "nearest_records",
    aliases: &[ParamAlias { name: "neighbours", values: AliasValues::Same }],
    default: ParamDefault::Int { default: 3, min: 0, max: 3 },
    unit: "records",
    short: "Nearest importance records whose probabilities an eye vertex uses",
    long: "Their probabilities are mixed in equal parts. With 0, light sub-paths are drawn uniformly. Fewer records \
        are cheaper and miss more light at the edges of shadows.",
};

/// Resolution of the skeleton.
pub(super) const VOXEL_RESOLUTION: ParamSpec = ParamSpec {
    name: "voxel_resolution",
    aliases: &[ParamAlias { name: "cells", values: AliasValues::ZeroIsAuto }],
    default: ParamDefault::AutoInt { min: 1, max: 1024 },
    unit: "voxels",
    short: "Voxels along the longest side of the scene for its skeleton",
    long: "The empty space of the scene is divided into voxels and thinned to a skeleton once, before the first \
        iteration. A higher resolution finds narrower passages and takes more time and memory. `auto` is 120, and up \
        to 240 for flat scenes.",
};

/// α_accept.
pub(super) const NODE_ACCEPTANCE: ParamSpec = ParamSpec {
    name: "node_acceptance",
    aliases: &[ParamAlias { name: "acceptance", values: AliasValues::Parts(100) }],
    default: ParamDefault::Fraction { default: 0.2, min: 0.0, max: 100.0 },
    unit: "of the mean",
    short: "Nodes with at most this share of the mean number of eye vertices are left out",
    long: "Nodes of the skeleton that few eye vertices belong to are not worth their shadow rays; at those vertices \
        light sub-paths are drawn uniformly. 0 uses every node that has eye vertices. Published: 1, the parameter \
        alpha_accept of Noël and Biri 2015, section 4.",
};

/// Sets of light vertices among which one is drawn.
pub(super) const SELECTION: ParamSpec = ParamSpec {
    name: "selection",
    aliases: &[ParamAlias { name: "draws", values: AliasValues::Same }],
    default: ParamDefault::Choice {
        default: "all-lengths",
        choices: &[
            Choice {
                name: "all-lengths",
                aliases: &["together"],
                meaning: "one light vertex among those of all sub-path lengths, from a mixture of the distributions",
            },
            Choice {
                name: "per-length",
                aliases: &["apart"],
                meaning: "one light vertex for each sub-path length, from the distributions combined by the max \
                    heuristic, as published",
            },
        ],
    },
    unit: "",
    short: "Whether a connection is drawn among all lengths of light sub-paths or for each",
    long: "Long light sub-paths carry little light in most scenes: all-lengths spends few connections on them and \
        usually has less error in equal time.",
};

/// Distributions that are combined.
pub(super) const DISTRIBUTIONS: ParamSpec = ParamSpec {
    name: "distributions",
    aliases: &[],
    default: ParamDefault::Choice {
        default: "all",
        choices: &[
            Choice {
                name: "all",
                aliases: &[],
                meaning: "visible, unoccluded and uniform; at importance records with selection=per-length also \
                    bounded (Georgiev et al. 2012)",
            },
            Choice {
                name: "visible",
                aliases: &["seen"],
                meaning: "by contribution, visibility included (V, eq. 6), and uniform",
            },
            Choice {
                name: "unoccluded",
                aliases: &["open"],
                meaning: "by contribution, visibility ignored (U, eq. 7), and uniform",
            },
            Choice { name: "uniform", aliases: &[], meaning: "uniform only (C, eq. 8)" },
        ],
    },
    unit: "",
    short: "Distributions of light vertices that are combined",
    long: "Equations are those of Noël and Biri 2015. The uniform distribution always takes part, because it alone \
        reaches every light vertex. Switching others off shows what they contribute.",
};

/// Weights.
pub(super) const WEIGHTS: ParamSpec = ParamSpec {
    name: "weights",
    aliases: &[],
    default: ParamDefault::Choice {
        default: "resampling-aware",
        choices: &[
            Choice {
                name: "balance",
                aliases: &[],
                meaning: "the balance heuristic of bidirectional path tracing, which ignores resampling, as \
                    published",
            },
            Choice {
                name: "resampling-aware",
                aliases: &["aware"],
                meaning: "the density of resampled connections is taken into account, as estimated in earlier \
                    iterations; with selection=per-length it is evaluated with shadow rays",
            },
        ],
    },
    unit: "",
    short: "Whether weights take the density of resampled connections into account",
    long: "Resampling makes light sub-paths likelier that contribute much. Weights that ignore this leave most of \
        the light to other techniques, and with it their noise. Both choices have the same expected picture. \
        Resampling-aware weights are those of Nabata et al. 2020.",
};
