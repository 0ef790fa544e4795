//! The registered bidirectional methods, and parameters that make them do on small scenes all that they do on large
//! ones.

use lightsieve::film::Pyramid;
use lightsieve::integrators::{IntegratorSpec, Params, REGISTRY};

/// Every registered method that has techniques to tell apart.
pub fn bidirectional_methods() -> impl Iterator<Item = &'static IntegratorSpec> {
    let has_techniques = |spec: &&'static IntegratorSpec| {
        (spec.build)(&Params::defaults(spec)).keep_pyramid(Pyramid::new([0, 0, 1, 1], 1))
    };
    REGISTRY.iter().copied().filter(has_techniques)
}

/// Values of parameters by name: those that a method has suit small scenes, and lead through its choices as `variant`
/// counts up.
pub fn for_small_scenes(spec: &IntegratorSpec, variant: usize) -> Vec<(&'static str, &'static str)> {
    let i = variant;
    let all = [
        ("allocation", "full"),
        ("proposal_model", ["mixture", "per-cache", "mixture-with-visibility"][(i + i / 3) % 3]),
        ("presampled_paths", ["200", "7", "1"][i % 3]),
        ("second_stage_paths", ["16", "1", "200"][i % 3]),
        // A film of 64 pixels needs more than its share of cache points and records.
        ("cache_density", "0.5"),
        ("record_density", "0.2"),
        ("node_acceptance", "0"),
        ("voxel_resolution", "30"),
        ("selection", ["per-length", "all-lengths"][(i + i / 2) % 2]),
        ("connections_per_vertex", ["1", "4"][i % 2]),
        ("rr_scale", ["1", "0.4"][i % 2]),
    ];
    declared(spec, &all).collect()
}

/// Parameters for tests of weights in small scenes, with other choices, roulette and heuristic as `variant` counts up.
pub fn weight_variant(spec: &'static IntegratorSpec, variant: usize) -> Params {
    let mut params = Params::defaults(spec);
    let common = [
        ("fallback", "false"),
        ("rr_depth", ["5", "1", "2"][variant % 3]),
        ("heuristic", ["balance", "power"][variant % 2]),
    ];
    for (name, value) in for_small_scenes(spec, variant).into_iter().chain(declared(spec, &common)) {
        params.set(name, value).unwrap();
    }
    params
}

/// The values whose parameters a method has.
pub fn declared<'a, 's>(
    spec: &'s IntegratorSpec,
    values: &'s [(&'a str, &'a str)],
) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a, 's> {
    let has = |name: &str| spec.params().any(|p| p.name == name);
    values.iter().copied().filter(move |(name, _)| has(name))
}
