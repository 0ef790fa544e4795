use super::*;
use crate::integrators::{REGISTRY, find};

#[test]
fn every_integrator_declares_its_parameters_well() {
    for spec in REGISTRY {
        assert!(std::ptr::eq(find(spec.name).unwrap(), *spec));
        let mut params = Params::defaults(spec);
        for (name, value) in params.pairs() {
            assert_eq!(params.set(name, &value).unwrap(), None, "{name}={value} is written as it is now");
        }
        assert_eq!(params, Params::defaults(spec));
        // Building asks for every parameter by name and kind: an undeclared one would panic here.
        (spec.build)(&params);
    }
}

#[test]
fn names_and_earlier_names_are_unambiguous() {
    for spec in REGISTRY {
        let names: Vec<&str> =
            spec.params().flat_map(|p| std::iter::once(p.name).chain(p.aliases.iter().map(|a| a.name))).collect();
        let mut sorted = names.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), names.len(), "{}: {names:?}", spec.name);
    }
}

#[test]
fn slips_are_explained() {
    let mut params = Params::defaults(REGISTRY[0]);
    let unknown = params.set("max_dept", "3").unwrap_err();
    assert!(unknown.to_string().contains("did you mean \"max_depth\""), "{unknown}");
    let value = params.set("max_depth", "many").unwrap_err();
    assert!(value.to_string().contains("expected whole number"), "{value}");
    let mut params = Params::defaults(find("two-stage").unwrap());
    let american = params.set("neighbors", "3").unwrap_err().to_string();
    assert!(american.contains("did you mean \"nearest_caches\""), "{american}");
    for bad in ["0.001", "101%", "3/0", "0/0", "nan", "inf", "-0.4", "", "half"] {
        assert!(params.set("rr_scale", bad).is_err(), "{bad}");
    }
    for (name, bad) in [("keep", "0"), ("keep", "101"), ("epsilon", "0"), ("paths", "-1"), ("presampled_paths", "0")] {
        let e = params.set(name, bad).unwrap_err().to_string();
        assert!(e.contains(name), "{e}");
    }
    let e = params.set("keep", "0").unwrap_err().to_string();
    assert!(e.contains("`rr_scale`") && e.contains("0.4"), "{e}");
    assert_eq!(params, Params::defaults(find("two-stage").unwrap()), "a slip changes nothing");
}

/// Integrator, what was written earlier, what is written now.
const EARLIER: &[(&str, [&str; 2], [&str; 2])] = &[
    ("bdpt", ["skip", "never"], ["allocation", "full"]),
    ("bdpt", ["skip", "auto"], ["allocation", "auto"]),
    ("bdpt", ["path_fallback", "false"], ["fallback", "false"]),
    ("pcbpt", ["paths", "100"], ["presampled_paths", "100"]),
    ("pcbpt", ["weights", "ris"], ["weights", "resampling-aware"]),
    ("ris", ["paths", "1"], ["presampled_paths", "1"]),
    ("ris", ["samples", "2"], ["connections_per_vertex", "2"]),
    ("ris", ["neighbours", "0"], ["nearest_caches", "0"]),
    ("ris", ["caches", "1000"], ["cache_density", "1%"]),
    ("ris", ["caches", "400"], ["cache_density", "0.004"]),
    ("ris", ["metric", "plain"], ["metric", "position"]),
    ("ris", ["metric", "facing"], ["metric", "position-and-normal"]),
    ("ris", ["proposals", "mixture"], ["proposal_model", "mixture"]),
    ("ris", ["proposals", "asked"], ["proposal_model", "mixture-with-visibility"]),
    ("ris", ["proposals", "split"], ["proposal_model", "per-cache"]),
    ("ris", ["epsilon", "20"], ["min_density_ratio", "0.00002"]),
    ("ris", ["epsilon", "0.01"], ["min_density_ratio", "0.01"]),
    ("ris", ["doubt", "50000"], ["min_unseen_fraction", "5%"]),
    ("ris", ["doubt", "0"], ["min_unseen_fraction", "0"]),
    ("ris", ["trust", "full"], ["unseen_model", "constant"]),
    ("ris", ["trust", "learned"], ["unseen_model", "estimated"]),
    ("ris", ["keep", "100"], ["rr_scale", "1"]),
    ("ris", ["keep", "60"], ["rr_scale", "3/5"]),
    ("two-stage", ["paths", "0"], ["presampled_paths", "auto"]),
    ("two-stage", ["paths", "10000"], ["presampled_paths", "10000"]),
    ("two-stage", ["second_stage", "50"], ["second_stage_paths", "50"]),
    ("two-stage", ["caches", "20000"], ["cache_density", "1/5"]),
    ("two-stage", ["weights", "ris"], ["weights", "resampling-aware"]),
    ("skeleton", ["cells", "0"], ["voxel_resolution", "auto"]),
    ("skeleton", ["cells", "30"], ["voxel_resolution", "30"]),
    ("skeleton", ["acceptance", "100"], ["node_acceptance", "1"]),
    ("skeleton", ["acceptance", "250"], ["node_acceptance", "250%"]),
    ("skeleton", ["draws", "together"], ["selection", "all-lengths"]),
    ("skeleton", ["draws", "apart"], ["selection", "per-length"]),
    ("skeleton", ["distributions", "seen"], ["distributions", "visible"]),
    ("skeleton", ["distributions", "open"], ["distributions", "unoccluded"]),
    ("skeleton", ["weights", "aware"], ["weights", "resampling-aware"]),
    ("ic-bdpt", ["records", "500"], ["record_density", "0.5%"]),
    ("ic-bdpt", ["neighbours", "2"], ["nearest_records", "2"]),
    ("ic-bdpt", ["paths", "50"], ["presampled_paths", "50"]),
    ("importance-caching", ["samples", "7"], ["connections_per_vertex", "7"]),
];

#[test]
fn earlier_names_and_values_mean_the_present_ones() {
    for &(name, [earlier, earlier_value], [present, value]) in EARLIER {
        let spec = find(name).unwrap();
        let (mut by_earlier, mut by_present) = (Params::defaults(spec), Params::defaults(spec));
        let renamed = by_earlier.set(earlier, earlier_value).unwrap().unwrap();
        assert_eq!((renamed.given_name.as_str(), renamed.name), (earlier, present));
        assert_eq!(by_present.set(present, value).unwrap(), None, "{present}={value}");
        assert_eq!(by_earlier, by_present, "{name}: {earlier}={earlier_value}");
        assert_eq!(Params::with(spec, &[(renamed.name, renamed.value.as_str())]).unwrap(), by_present);
    }
    let tested = |spec: &str, alias: &str| EARLIER.iter().any(|(s, [a, _], _)| *s == spec && *a == alias);
    for alias in REGISTRY.iter().flat_map(|s| s.params()).flat_map(|p| p.aliases) {
        assert!(REGISTRY.iter().any(|s| tested(s.name, alias.name)), "{} is not tested", alias.name);
    }
}

#[test]
fn people_are_told_the_present_name() {
    let mut params = Params::defaults(find("ris").unwrap());
    let text = |r: Option<Renamed>| r.unwrap().to_string();
    let keep = text(params.set("keep", "40").unwrap());
    assert_eq!(keep, "parameter `keep` is now called `rr_scale`: `rr_scale=0.4`");
    let metric = text(params.set("metric", "plain").unwrap());
    assert_eq!(metric, "`metric=plain` is now written `metric=position`");
}

/// Single precision values that pictures and checkpoints depend on, as whole numbers of parts were rounded to them.
#[test]
fn defaults_have_the_bits_of_whole_numbers_of_parts() {
    let params = Params::defaults(find("ris").unwrap());
    assert_eq!((params.float("rr_scale") * 100.0) as f32 * 0.01, 40.0_f32 * 0.01);
    assert_eq!(params.float("min_density_ratio") as f32, 1000.0_f32 * 1e-6);
    assert_eq!(params.float("min_unseen_fraction") as f32, 20_000.0_f32 * 1e-6);
    assert_eq!(params.float("cache_density"), 400.0 * 1e-5);
    assert_eq!(Params::defaults(find("two-stage").unwrap()).float("cache_density"), 2000.0 * 1e-5);
    assert_eq!(Params::defaults(find("ic-bdpt").unwrap()).float("record_density"), 100.0 * 1e-5);
    assert_eq!(Params::defaults(find("skeleton").unwrap()).float("node_acceptance"), 20.0 * 0.01);
}

/// Words that were private to this program, and those that texts for its users should do without.
const UNWANTED: &[&str] = &[
    "apart", "ask", "asked", "asking", "asks", "bring", "brings", "doubt", "facing", "handful", "keep", "keeps",
    "know", "known", "knows", "matt", "nobody", "places", "skip", "somebody", "stage's", "trust", "worth it",
];

#[test]
fn texts_are_short_and_long_and_plain() {
    let plain = |what: &str, text: &str| {
        let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric() && c != '_' && c != '\'').collect();
        for word in UNWANTED {
            assert!(!words.iter().any(|w| w.eq_ignore_ascii_case(word)), "{what} says \"{word}\": {text}");
        }
        assert!(!text.contains("  "), "{what} has two spaces together: {text}");
    };
    let short_and_long = |what: &str, short: &str, long: &str| {
        assert!((10..=80).contains(&short.chars().count()) && !short.ends_with('.'), "{what}: {short}");
        assert!(long.len() > short.len() && long.ends_with('.'), "{what}: {long}");
        plain(what, short);
        plain(what, long);
    };
    for spec in REGISTRY {
        short_and_long(spec.name, spec.short, spec.long);
        for p in spec.params() {
            short_and_long(p.name, p.short, p.long);
            if let ParamDefault::Choice { default, choices } = p.default {
                assert!(choices.iter().any(|c| c.name == default), "{}", p.name);
                choices.iter().for_each(|c| plain(p.name, c.meaning));
                assert!(choices.iter().all(|c| !c.meaning.is_empty() && !c.meaning.ends_with('.')), "{}", p.name);
            }
            let number =
                !matches!(p.default, ParamDefault::Bool(_) | ParamDefault::Choice { .. } | ParamDefault::Techniques(_));
            assert!(number || p.unit.is_empty(), "{}", p.name);
        }
    }
}
