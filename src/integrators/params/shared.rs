//! Parameters that several integrators share.

use super::{AliasValues, Choice, ParamAlias, ParamDefault, ParamSpec};

/// Largest number of edges of a path.
pub const MAX_DEPTH: ParamSpec = ParamSpec {
    name: "max_depth",
    aliases: &[],
    default: ParamDefault::Int { default: -1, min: -1, max: 1_000_000 },
    unit: "edges",
    short: "Largest number of edges of a path; -1 for no limit",
    long: "Paths with more edges are not rendered. 1 shows emitters only, 2 adds direct light, 3 one bounce of \
        indirect light. The meaning is that of max_depth in Mitsuba. Changing it changes the expected picture. It is \
        also an option of its own: --max-depth N.",
};

/// First vertex at which Russian roulette is played.
const RR_DEPTH: ParamSpec = ParamSpec {
    name: "rr_depth",
    aliases: &[],
    default: ParamDefault::Int { default: 5, min: 1, max: 1_000_000 },
    unit: "vertices",
    short: "First vertex at which Russian roulette may end a sub-path; 1 is the first hit",
    long: "From this vertex on a walk survives with a probability that depends on the albedo of the surface, and \
        surviving walks are weighted up. A smaller number makes samples cheaper and noisier. It changes the noise \
        only, not the expected picture.",
};

/// For eye sub-paths that carry all of the light.
pub const RR_DEPTH_UNIDIRECTIONAL: ParamSpec = RR_DEPTH;

/// For sub-paths of both ends, one of each kind per sample. Long paths are joined from short sub-paths: early roulette
/// saves far more connections than it costs in variance.
pub const RR_DEPTH_BIDIRECTIONAL: ParamSpec = ParamSpec {
    default: ParamDefault::Int { default: 2, min: 1, max: 1_000_000 },
    long: "From this vertex on, counted from its own end, a sub-path survives with a probability that depends on the \
        albedo of the surface, and surviving sub-paths are weighted up. Long paths are connected from short \
        sub-paths, so that early roulette saves many connections at little variance. It changes the noise only, not \
        the expected picture.",
    ..RR_DEPTH
};

/// For sub-paths of both ends where each eye vertex makes few connections to many light sub-paths.
pub const RR_DEPTH_RESAMPLED: ParamSpec =
    ParamSpec { default: ParamDefault::Int { default: 1, min: 1, max: 1_000_000 }, ..RR_DEPTH_BIDIRECTIONAL };

/// Emitters that are seen directly are black.
pub const HIDE_EMITTERS: ParamSpec = ParamSpec {
    name: "hide_emitters",
    aliases: &[],
    default: ParamDefault::Bool(false),
    unit: "",
    short: "Emitters seen directly by the camera are black",
    long: "Leaves out paths of one edge: the environment and area lights that the camera sees without a reflection \
        or refraction in between. The light they cast stays. The meaning is that of hide_emitters in Mitsuba.",
};

/// Set of techniques of a bidirectional method.
pub const TECHNIQUES: ParamSpec = ParamSpec {
    name: "techniques",
    aliases: &[],
    // Lights that the lens sees are hit by eye sub-paths at every sample; splats of the lights themselves could only
    // add noise.
    default: ParamDefault::Techniques("-1:1"),
    unit: "",
    short: "Techniques (s, t) in use, as s:t with s light and t eye vertices",
    long: "A list of items, each taking effect on the result of those before it: `all`, `none`, `s:t` or `+s:t` to \
        switch a technique on, `-s:t` to switch it off; s and t are numbers, or * for all. A list that begins with a \
        technique to switch on starts from none, any other list from all. `all,-0:*` never counts a light hit by an \
        eye sub-path, `*:1` is light tracing.\n\n\
        The weights of the remaining techniques sum to one again, so that the expected picture is the same as long \
        as they can make every path. Numbering as in Veach 1997, section 10.2. By default lights are not connected \
        to the lens (1:1), which eye sub-paths do better.",
};

const BALANCE: Choice = Choice { name: "balance", aliases: &[], meaning: "balance heuristic (Veach 1997, eq. 9.8)" };
const POWER: Choice =
    Choice { name: "power", aliases: &[], meaning: "power heuristic with exponent 2 (Veach 1997, eq. 9.13)" };

/// Heuristic of multiple importance sampling.
pub const fn heuristic(default: &'static str) -> ParamSpec {
    ParamSpec {
        name: "heuristic",
        aliases: &[],
        default: ParamDefault::Choice { default, choices: &[BALANCE, POWER] },
        unit: "",
        short: "Heuristic by which multiple importance sampling weights techniques",
        long: "Changes the noise only. The power heuristic is better where one technique is close to ideal for a \
            path, the balance heuristic is safer elsewhere. In bdpt the sample allocation is optimized for the \
            balance heuristic; with power, numbers of samples that are `auto` are the full ones.",
    }
}

/// Whether numbers of samples are decided by the program.
pub const ALLOCATION: ParamSpec = ParamSpec {
    name: "allocation",
    aliases: &[ParamAlias { name: "skip", values: AliasValues::Same }],
    default: ParamDefault::Choice {
        default: "auto",
        choices: &[
            Choice {
                name: "auto",
                aliases: &[],
                meaning: "after two iterations at full numbers, the allocation with the smallest product of cost and \
                    error, of pixels and of 16x16 blocks alike, as these two iterations estimate it",
            },
            Choice { name: "full", aliases: &["never"], meaning: "full numbers in every iteration, as published" },
        ],
    },
    unit: "",
    short: "How many light sub-paths and connections an iteration takes",
    long: "A scene in which connections or the light image contribute little is rendered sooner with fewer of them. \
        At least 1/16 of the connections and 1/64 of the light sub-paths remain, unless path tracing takes over (fallback). The \
        decision depends on earlier iterations only, so that every iteration is unbiased, and on counts of rays \
        rather than on times, so that it is the same on any machine. Choose `full` to repeat published methods.",
};

/// Whether light sub-paths begin where they matter.
pub const GUIDED_EMISSION: ParamSpec = ParamSpec {
    name: "guided_emission",
    aliases: &[],
    default: ParamDefault::Bool(true),
    unit: "",
    short: "Light sub-paths of sun and sky begin where they matter",
    long: "In a scene with lights at infinity (sun, sky, environment maps, directional lights), eye sub-paths before the \
        first iteration find the rays that light the picture, through the windows of a room for example. \
        Light sub-paths then begin with such rays more often, and the weights count that. The expected picture is the \
        same. Choose `false` to repeat published methods.",
};

/// Simpler methods may render the scene.
pub const FALLBACK: ParamSpec = ParamSpec {
    name: "fallback",
    aliases: &[ParamAlias { name: "path_fallback", values: AliasValues::Same }],
    default: ParamDefault::Bool(true),
    unit: "",
    short: "Leaves the render to a simpler method where that is more efficient",
    long: "With allocation=auto and all techniques, the first two iterations and a few samples of path tracing and, beside \
        other methods, of bidirectional path tracing tell which of them has the smallest product of cost and error, of \
        pixels and of 16x16 blocks alike. Scenes in which next event finds all light are then rendered as `path` \
        renders them, scenes in which shared light sub-paths leave more error in regions than they save in pixels as \
        `bdpt` does. Scenes with light that path tracing cannot find are never left to it. The choice is written into \
        the statistics. The expected picture is the same.",
};
