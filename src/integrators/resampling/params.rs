//! Parameters of methods that draw connections from many light sub-paths.
//!
//! Cited as *weights*: Nabata et al. 2020, "Resampling-aware weighting functions for bidirectional path tracing using
//! multiple light sub-paths"; as *two-stage*: Nabata et al. 2020, "Two-stage resampling for bidirectional path tracing
//! with multiple light sub-paths".

use super::settings::MAX_GROUP;
use crate::integrators::params::presampled::PRESAMPLED_PATHS;
use crate::integrators::params::{AliasValues, Choice, ParamAlias, ParamDefault, ParamSpec};

/// M of `ris`.
pub(super) const RIS_PATHS: ParamSpec = ParamSpec {
    default: ParamDefault::Int { default: 1000, min: 1, max: 10_000_000 },
    long: "The vertices of the first M light sub-paths of an iteration are the proposals of resampling; every cache \
        point casts a shadow ray to each of them. All pixels share them: fewer make whole regions too bright or too \
        dark together, more make iterations dearer. Published: 200 (Nabata et al. 2020, resampling-aware weights, \
        section 6.1).",
    ..PRESAMPLED_PATHS
};

/// M₁.
pub(super) const FIRST_STAGE_PATHS: ParamSpec = ParamSpec {
    aliases: &[ParamAlias { name: "paths", values: AliasValues::ZeroIsAuto }],
    default: ParamDefault::AutoInt { min: 1, max: 10_000_000 },
    short: "M1: light sub-paths per iteration that the first stage resamples",
    long: "The first stage draws M2 light vertices (second_stage_paths) from those of these M1 light sub-paths for \
        each group of cache points, without shadow rays. `auto` chooses the number with the least product of \
        variance and time, from the measured lengths of light and eye sub-paths, the number of pixels, and how much \
        the light of several sets of light sub-paths differs. Published: \
        10000 (Nabata et al. 2020, two-stage resampling, section 6).",
    ..PRESAMPLED_PATHS
};

/// M₂.
pub(super) const SECOND_STAGE_PATHS: ParamSpec = ParamSpec {
    name: "second_stage_paths",
    aliases: &[ParamAlias { name: "second_stage", values: AliasValues::Same }],
    default: ParamDefault::Int { default: 400, min: 1, max: 1_000_000 },
    unit: "paths",
    short: "M2: light sub-paths that the first stage leaves to a group of cache points",
    long: "The second stage resamples these by their contribution to each cache point, visibility included: one \
        shadow ray for each of them and each cache point. All pixels around a group share them: fewer make whole regions \
        too bright or too dark together. Published: 200 (Nabata et al. 2020, two-stage resampling, \
        section 6).",
};

/// N_c.
pub(super) const NEAREST_CACHES: ParamSpec = ParamSpec {
    name: "nearest_caches",
    aliases: &[ParamAlias { name: "neighbours", values: AliasValues::Same }],
    default: ParamDefault::Int { default: 3, min: 0, max: 3 },
    unit: "points",
    short: "N_c: nearest cache points whose probabilities an eye vertex uses",
    long: "A uniform distribution over all presampled light vertices always takes part as one more, the virtual \
        cache point of Nabata et al. 2020 (resampling-aware weights, section 5.2); with 0 it is the only one. Fewer \
        cache points are cheaper and miss more light at the edges of shadows. Published: 3.",
};

/// Cache points of methods with one stage.
pub(super) const CACHE_DENSITY: ParamSpec = ParamSpec {
    name: "cache_density",
    aliases: &[ParamAlias { name: "caches", values: AliasValues::Parts(100_000) }],
    default: ParamDefault::Fraction { default: 0.004, min: 0.0, max: 1.0 },
    unit: "per pixel",
    short: "Eye sub-paths per pixel whose vertices become cache points",
    long: "All vertices of these eye sub-paths are cache points, at which the probabilities of light vertices are \
        computed in every iteration. Denser cache points are closer to each eye vertex and cost more shadow rays. \
        Published: 0.4% (Nabata et al. 2020, resampling-aware weights, section 6.1).",
};

/// Cache points of methods with two stages. Groups of cache points share the first stage and cast few shadow rays in
/// the second, so that cache points may be denser.
pub(super) const GROUPED_CACHE_DENSITY: ParamSpec = ParamSpec {
    default: ParamDefault::Fraction { default: 0.02, min: 0.0, max: 1.0 },
    long: "All vertices of these eye sub-paths are cache points. Groups of neighbouring cache points share the first \
        stage and each casts few shadow rays in the second, so that they may be denser than with one stage. Denser \
        cache points are closer to each eye vertex and cost more shadow rays. Published: 0.4% (Nabata et al. 2020, \
        two-stage resampling, section 6).",
    ..CACHE_DENSITY
};

/// Cache points of a group.
pub(super) const GROUP_SIZE: ParamSpec = ParamSpec {
    name: "group_size",
    aliases: &[],
    default: ParamDefault::Int { default: 8, min: 1, max: MAX_GROUP as i64 },
    unit: "points",
    short: "Neighbouring cache points that share the candidates of the second stage",
    long: "The first stage draws its candidates once for a group of cache points. An eye vertex uses cache points of \
        one group only. Smaller groups make errors of whole regions smaller, as fewer pixels share candidates; larger \
        ones make pixels less noisy. In the published method every cache point has candidates of its own (Nabata et \
        al. 2020, two-stage resampling, section 5).",
};

/// Distance by which cache points are nearest.
pub(super) const METRIC: ParamSpec = ParamSpec {
    name: "metric",
    aliases: &[],
    default: ParamDefault::Choice {
        default: "position-and-normal",
        choices: &[
            Choice {
                name: "position-and-normal",
                aliases: &["facing"],
                meaning: "the nearest of those on surfaces with a similar normal",
            },
            Choice { name: "position", aliases: &["plain"], meaning: "the nearest on any surface, as published" },
        ],
    },
    unit: "",
    short: "What makes a cache point near to an eye vertex",
    long: "With `position` an eye vertex near an edge or a thin wall may use cache points that receive other light. \
        The proposal models mixture-with-visibility and per-cache always use `position`, because a weight must find \
        the same cache points for every technique that makes the path.",
};

/// q̂.
pub(super) const TARGET: ParamSpec = ParamSpec {
    name: "target",
    aliases: &[],
    default: ParamDefault::Choice {
        default: "irradiance",
        choices: &[
            Choice {
                name: "irradiance",
                aliases: &[],
                meaning: "the irradiance that the light sub-path causes at the cache point, visibility included \
                    (Nabata et al. 2020, resampling-aware weights, eq. 15)",
            },
            Choice {
                name: "radiance",
                aliases: &[],
                meaning: "the radiance that the cache point reflects of it towards the preceding vertex (Popov et \
                    al. 2015)",
            },
        ],
    },
    unit: "",
    short: "Target function of resampling at a cache point",
    long: "`radiance` includes the BSDF at the cache point. It helps where the BSDF at the eye vertex is like that \
        at the cache point, and harms on glossy surfaces, where it is not. proposal_model=per-cache always uses \
        `irradiance`.",
};

/// Techniques that resampled connections are.
pub(super) const fn proposal_model(default: &'static str) -> ParamSpec {
    ParamSpec {
        name: "proposal_model",
        aliases: &[ParamAlias { name: "proposals", values: AliasValues::Same }],
        default: ParamDefault::Choice {
            default,
            choices: &[
                Choice {
                    name: "mixture",
                    aliases: &[],
                    meaning: "one technique that draws from the mixture of all distributions; weights estimate its \
                        density at the eye vertex without shadow rays",
                },
                Choice {
                    name: "mixture-with-visibility",
                    aliases: &["asked"],
                    meaning: "the same technique; weights evaluate its density exactly, with a shadow ray from every \
                        nearest cache point",
                },
                Choice {
                    name: "per-cache",
                    aliases: &["split"],
                    meaning: "one technique for every distribution, each with an exact weight of its own, as \
                        published (Nabata et al. 2020, resampling-aware weights, section 5.2)",
                },
            ],
        },
        unit: "",
        short: "Density of a resampled connection that weights use",
        long: "An eye vertex uses the distributions of its nearest cache points and a uniform one. Weights with \
            shadow rays cost about three rays for every vertex of every path and spare rare, bright samples at the \
            edges of shadows. Where cache points are few, per-cache had the least error in equal time; where they \
            are dense, the mixture had. With weights=balance the model is always mixture.",
    }
}

/// ε.
pub(super) const MIN_DENSITY_RATIO: ParamSpec = ParamSpec {
    name: "min_density_ratio",
    aliases: &[ParamAlias { name: "epsilon", values: AliasValues::Parts(1_000_000) }],
    default: ParamDefault::Float { default: 1e-3, min: 1e-6, max: 1.0 },
    unit: "",
    short: "Epsilon: lower bound of the density ratio p/q in weights",
    long: "The ratio of the density of a light sub-path to that of the resampling target is estimated; clamping it \
        from below bounds the variance that a bad estimate can cause. A larger value is more careful: with 1, \
        weights never count a resampled connection as likelier than an ordinary one. Published: 0.001 (Nabata et al. \
        2020, resampling-aware weights, section 6.1).",
};

/// Smallest π.
pub(super) const MIN_UNSEEN_FRACTION: ParamSpec = ParamSpec {
    name: "min_unseen_fraction",
    aliases: &[ParamAlias { name: "doubt", values: AliasValues::Parts(1_000_000) }],
    default: ParamDefault::Fraction { default: 0.02, min: 0.0, max: 1.0 },
    unit: "of the light",
    short: "Smallest fraction of light that weights take as unseen by cache points",
    long: "An eye vertex may receive light that none of its nearest cache points receives; only the uniform \
        distribution draws it then. Weights assume that at least this fraction of the light is of that kind. A \
        larger value gives more weight to other techniques and avoids rare, bright samples. It takes effect with \
        proposal_model=mixture only. Not in the published method.",
};

/// How π is found.
pub(super) const UNSEEN_MODEL: ParamSpec = ParamSpec {
    name: "unseen_model",
    aliases: &[ParamAlias { name: "trust", values: AliasValues::Same }],
    default: ParamDefault::Choice {
        default: "estimated",
        choices: &[
            Choice {
                name: "estimated",
                aliases: &["learned"],
                meaning: "estimated in earlier iterations by leaving one out: the fraction of the light at a cache \
                    point that its neighbours do not receive, but at least min_unseen_fraction",
            },
            Choice { name: "constant", aliases: &["full"], meaning: "min_unseen_fraction everywhere" },
        ],
    },
    unit: "",
    short: "How weights find the fraction of light that nearest cache points do not see",
    long: "It takes effect with proposal_model=mixture only. Not in the published method, which evaluates visibility \
        from the cache points instead (per-cache).",
};

const BALANCE: Choice = Choice {
    name: "balance",
    aliases: &[],
    meaning: "the balance heuristic of bidirectional path tracing, which ignores resampling (Popov et al. 2015)",
};
const RESAMPLING_AWARE: Choice = Choice {
    name: "resampling-aware",
    aliases: &["ris"],
    meaning: "resampling in one stage is taken into account (Nabata et al. 2020, resampling-aware weights, eq. 14)",
};
const TWO_STAGE: Choice = Choice {
    name: "two-stage",
    aliases: &[],
    meaning: "resampling in two stages is taken into account (Nabata et al. 2020, two-stage resampling, eq. 17)",
};

/// Weights of a method with one stage.
pub(super) const fn weights(default: &'static str) -> ParamSpec {
    ParamSpec { default: ParamDefault::Choice { default, choices: &[BALANCE, RESAMPLING_AWARE] }, ..TWO_STAGE_WEIGHTS }
}

/// Importance of clusters of light vertices in the first of two stages.
pub(super) const FIRST_STAGE: ParamSpec = ParamSpec {
    name: "first_stage",
    aliases: &[],
    default: ParamDefault::Choice {
        default: "learned-visibility",
        choices: &[
            Choice {
                name: "unoccluded",
                meaning: "as if all light vertices were in sight: candidates behind walls are as many as others",
                aliases: &[],
            },
            Choice {
                name: "learned-visibility",
                meaning: "by the share of light vertices that the group has seen there in earlier iterations",
                aliases: &[],
            },
        ],
    },
    unit: "",
    short: "Which light vertices become candidates of the second stage",
    long: "The first stage divides the light vertices of an iteration into clusters and leaves one of each to a group of cache \
        points. Clusters are smaller where they are more important. Either choice has the same expected picture. \
        Published: unoccluded (Nabata et al. 2020, two-stage resampling, section 5.1).",
};

/// Weights of a method with two stages.
pub(super) const TWO_STAGE_WEIGHTS: ParamSpec = ParamSpec {
    name: "weights",
    aliases: &[],
    default: ParamDefault::Choice { default: "two-stage", choices: &[BALANCE, RESAMPLING_AWARE, TWO_STAGE] },
    unit: "",
    short: "Whether weights take the density of resampled connections into account",
    long: "Resampling makes light sub-paths likelier that contribute much. Weights that ignore this leave most of \
        the light to other techniques, and with it their noise. All choices have the same expected picture.",
};
