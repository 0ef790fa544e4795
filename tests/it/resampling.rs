//! Resampled connections agree with the path tracer whatever their parameters are: few or many light sub-paths, no cache points or
//! three, one vertex in the second stage or all, any weights. So do connections to a light sub-path that pixels share, of which few are made.

use crate::support::gallery::{GALLERY, exhibit};
use crate::support::pictures::{Picture, prepare};
use lightsieve::integrators::{IntegratorSpec, bdpt, importance, path, resampling};
use lightsieve::ray::Backend;

const SPP: u64 = 32;

#[test]
fn parameters_do_not_change_the_expectation() {
    let (ris, two) = (&resampling::RIS, &resampling::TWO_STAGE);
    let variants: [(&'static IntegratorSpec, &[(&str, &str)]); 39] = [
        (ris, &[("paths", "1")]),
        (ris, &[("paths", "2"), ("neighbours", "1")]),
        (ris, &[("paths", "200"), ("neighbours", "0")]),
        (ris, &[("weights", "balance"), ("keep", "100")]),
        (ris, &[("doubt", "0"), ("keep", "100"), ("skip", "never"), ("trust", "full")]),
        (ris, &[("target", "radiance")]),
        (ris, &[("proposals", "split"), ("paths", "7")]),
        (ris, &[("proposals", "split"), ("neighbours", "1"), ("samples", "2")]),
        (two, &[("proposals", "split"), ("second_stage", "8"), ("doubt", "0"), ("keep", "100"), ("skip", "never")]),
        (two, &[("proposals", "split"), ("paths", "100"), ("second_stage", "100"), ("neighbours", "0")]),
        (two, &[("proposals", "asked"), ("second_stage", "16")]),
        (ris, &[("proposals", "asked"), ("neighbours", "2"), ("paths", "20")]),
        (two, &[("target", "radiance"), ("metric", "plain")]),
        (ris, &[("epsilon", "1000000"), ("doubt", "1000000")]),
        (two, &[("second_stage", "1")]),
        (two, &[("second_stage", "16"), ("neighbours", "1"), ("samples", "3"), ("metric", "plain")]),
        (two, &[("paths", "200"), ("second_stage", "200"), ("skip", "never")]),
        (two, &[("paths", "300"), ("second_stage", "16"), ("neighbours", "0")]),
        (two, &[("paths", "1"), ("second_stage", "1"), ("keep", "60")]),
        (two, &[("weights", "ris"), ("second_stage", "8")]),
        (two, &[("weights", "balance"), ("second_stage", "8")]),
        (&bdpt::SPEC, &[]),
        (&bdpt::SPEC, &[("rr_depth", "5")]),
        (&bdpt::SPEC, &[("light_paths", "1/4"), ("connections", "1/2")]),
        (&bdpt::SPEC, &[("light_paths", "1/16"), ("connections", "1/16"), ("heuristic", "power")]),
        (&bdpt::SPEC, &[("light_paths", "1/16"), ("skip", "never")]),
        (&importance::SKELETON, &[("acceptance", "0"), ("cells", "30")]),
        (&importance::SKELETON, &[("paths", "7"), ("weights", "balance"), ("samples", "3")]),
        (&importance::SKELETON, &[("draws", "apart"), ("weights", "balance"), ("samples", "1"), ("skip", "never")]),
        (&importance::SKELETON, &[("draws", "apart"), ("acceptance", "0"), ("cells", "30")]),
        (&importance::SKELETON, &[("distributions", "seen"), ("skip", "never")]),
        (&importance::SKELETON, &[("distributions", "open"), ("draws", "apart"), ("weights", "balance")]),
        (&importance::SKELETON, &[("distributions", "uniform")]),
        (&importance::IC_BDPT, &[("distributions", "seen"), ("draws", "apart"), ("samples", "1")]),
        (&importance::IC_BDPT, &[("distributions", "open")]),
        (&importance::IC_BDPT, &[("paths", "50"), ("neighbours", "1")]),
        (&importance::IC_BDPT, &[("neighbours", "0"), ("samples", "2")]),
        (&importance::IC_BDPT, &[("draws", "apart"), ("weights", "balance"), ("paths", "7"), ("neighbours", "2")]),
        (&importance::IC_BDPT, &[("draws", "apart"), ("skip", "never")]),
    ];
    // Diffuse and glossy; lit from everywhere; by lights that have no size.
    let shown = ["room", "environment", "delta-lights", "principled"];
    for name in GALLERY.into_iter().filter(|name| shown.contains(name)) {
        let scene = prepare(exhibit(name), Backend::default_available(), None);
        let reference = Picture::render(&path::SPEC, &scene, &[], SPP, 900);
        for (spec, params) in variants {
            // A film of 64 pixels needs more than its share of places.
            let places = match spec.name {
                "skeleton" => None,
                "ic-bdpt" => Some(("records", "20000")),
                _ => Some(("caches", "20000")),
            };
            let params: Vec<(&str, &str)> =
                [("skip", "auto"), ("keep", "30")].into_iter().chain(places).chain(params.iter().copied()).collect();
            let picture = Picture::render(spec, &scene, &params, SPP, 930);
            picture.assert_agrees(&reference, 0.0, &format!("{} {params:?}: {name}", spec.name));
        }
    }
}

/// What is learnt from iteration to iteration changes no expectation, and adds no noise that would not average out: the variance of the mean
/// is a straight line in logarithms, and where it has become small the mean is still that of the path tracer.
#[test]
fn variance_falls_with_the_number_of_iterations_and_the_mean_stays() {
    let scene = prepare(exhibit("room"), Backend::default_available(), None);
    let reference = Picture::render(&path::SPEC, &scene, &[], 512, 700);
    for spec in
        [&resampling::PCBPT, &resampling::RIS, &resampling::TWO_STAGE, &importance::SKELETON, &importance::IC_BDPT]
    {
        let after = |iterations: u64| {
            let params = [("caches", "20000"), ("second_stage", "16"), ("records", "20000")];
            Picture::render(spec, &scene, &params, iterations, 740 + iterations)
        };
        let counts = [5, 20, 80];
        let pictures = counts.map(after);
        let variances: Vec<f64> = pictures.iter().map(|p| p.variance.as_flattened().iter().sum()).collect();
        // Variance times number of iterations, relative to the mean of that over all, in logarithms.
        let levels: Vec<f64> = variances.iter().zip(counts).map(|(v, n)| (v * n as f64).ln()).collect();
        let mean = levels.iter().sum::<f64>() / levels.len() as f64;
        for (level, n) in levels.iter().zip(counts) {
            assert!((level - mean).abs() < 0.35, "{}: {n} iterations, {levels:?}", spec.name);
        }
        pictures[2].assert_agrees(&reference, 0.0, &format!("{} after {} iterations", spec.name, counts[2]));
    }
}
