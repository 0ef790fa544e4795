//! Weights of sampled paths against their definition, for every technique, any subset of techniques, and scenes with every
//! feature: they sum to one, the fast ones are the slow ones, and they depend on nothing that they should not.

use crate::support::gallery::{GALLERY, exhibit};
use crate::support::pictures::{parse, prepare};
use lightsieve::integrators::replay::Contribution;
use lightsieve::integrators::{IntegratorSpec, Iteration, Params, bdpt, importance, resampling};
use lightsieve::math::{AreaPdf, Rgb, SolidAnglePdf};
use lightsieve::mis::definition::{Densities, densities};
use lightsieve::mis::{End, Heuristic, Joint, Node, Split, Techniques, Weigher};
use lightsieve::path::{FullPath, Limits};
use lightsieve::prepared::PreparedScene;
use lightsieve::ray::Backend;

/// Every path that bidirectional path tracing finds in a grid of pixels.
fn found(
    spec: &'static IntegratorSpec,
    scene: &PreparedScene,
    params: &[(&str, &str)],
    iterations: u64,
) -> Vec<Contribution> {
    let mut values = Params::defaults(spec);
    for (name, value) in params {
        values.set(name, value).unwrap();
    }
    let mut integrator = (spec.build)(&values);
    let [x0, y0, width, height] = scene.window;
    let mut all = vec![];
    for index in 0..iterations {
        for i in 0..16 {
            let pixel = (x0 + (i % 4) * width / 4, y0 + (i / 4) * height / 4);
            all.extend(integrator.replay(&Iteration { scene, seed: 5, index }, pixel).contributions);
        }
    }
    all
}

fn weigher(scene: &PreparedScene, techniques: &str, heuristic: Heuristic, roulette_from: u32) -> Weigher {
    let mut techniques = Techniques::parse(techniques).unwrap();
    techniques.set_light_paths(scene.film_size[0] as f32 * scene.film_size[1] as f32);
    let limits = Limits { max_edges: u32::MAX, roulette_from, keep: 1.0 };
    Weigher { techniques, heuristic, eye_limits: limits, light_limits: limits, resampled: None, lengths: None }
}

/// How far the rounding of positions, from which the definition computes directions and cosines anew, changes these: it counts on short
/// edges and at grazing angles.
fn rounding(path: &FullPath) -> f64 {
    let normal = |k: usize| path.interior.get(k.wrapping_sub(1)).map(|v| v.point.ng);
    let edge = |k: usize| {
        let (a, b) = (path.position(k)?, path.position(k + 1)?);
        let (length, d) = ((b - a).length(), (b - a).normalize());
        let cos = [k, k + 1].into_iter().filter_map(normal).map(|n| n.dot(d).abs()).fold(1.0, f32::min);
        Some(f64::from(f32::EPSILON * (a.length() + b.length()) / (length * cos)))
    };
    (0..path.edges()).filter_map(edge).sum()
}

const SUBSETS: [&str; 6] = ["all", "-*:1", "-0:*", "-1:*", "all,-2:2,-3:1,-0:3", "-*:1,-0:*"];

#[test]
fn fast_weights_are_those_of_the_definition() {
    let mut checked = 0;
    for name in GALLERY {
        for crop in [None, Some([1, 1, 5, 4])] {
            let scene = prepare(exhibit(name), Backend::default_available(), crop);
            for (i, techniques) in SUBSETS.into_iter().enumerate() {
                let heuristic = ["balance", "power"][i % 2];
                let roulette = ["5", "1", "2"][i % 3];
                let plain = ("allocation", "full");
                let params = [("techniques", techniques), ("heuristic", heuristic), ("rr_depth", roulette), plain];
                for c in found(&bdpt::SPEC, &scene, &params, 12) {
                    let (s, sum) = (c.s, c.techniques.iter().map(|t| t.1).sum::<f64>());
                    let what = format!("{name} {crop:?} {params:?} ({s}, {}): {:?}", c.t, c.techniques);
                    assert!((sum - 1.0).abs() < 1e-12, "{sum} {what}");
                    let error = (f64::from(c.weight) - c.techniques[s].1).abs();
                    let tolerance = (6e-5 + c.path.as_ref().map_or(0.0, rounding)).min(2e-4);
                    assert!(error < tolerance, "{} off by {error} > {tolerance} {what}", c.weight);
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 60_000, "{checked}");
}

#[test]
fn resampling_aware_weights_are_those_of_the_definition() {
    let (mut checked, mut connections) = (0, 0);
    for name in GALLERY {
        let scene = prepare(exhibit(name), Backend::default_available(), None);
        for (i, techniques) in SUBSETS.into_iter().enumerate() {
            let roulette = ["5", "1", "2"][i % 3];
            let paths = ["200", "7", "1"][i % 3];
            // A film of 64 pixels needs more than its share of cache points.
            let params = [
                ("proposal_model", ["mixture", "per-cache", "mixture-with-visibility"][(i + i / 3) % 3]),
                ("techniques", techniques),
                ("rr_depth", roulette),
                ("presampled_paths", paths),
                ("cache_density", "0.5"),
                ("rr_scale", ["1", "0.4"][i % 2]),
            ];
            let two_stage = [&params[..], &[("second_stage_paths", ["16", "1", "200"][i % 3])]].concat();
            let one = found(&resampling::RIS, &scene, &params, 2);
            let drawn = [
                ("selection", ["per-length", "all-lengths"][(i + i / 2) % 2]),
                ("connections_per_vertex", ["1", "4"][i % 2]),
                ("techniques", techniques),
                ("rr_depth", roulette),
                ("presampled_paths", ["1024", "20", "1"][i % 3]),
            ];
            let skeleton = [&drawn[..], &[("node_acceptance", "0"), ("voxel_resolution", "30")]].concat();
            let records = [&drawn[..], &[("record_density", "0.2")]].concat();
            let all = [
                one,
                found(&resampling::TWO_STAGE, &scene, &two_stage, 2),
                found(&importance::SKELETON, &scene, &skeleton, 2),
                found(&importance::IC_BDPT, &scene, &records, 2),
            ];
            for c in all.into_iter().flatten() {
                let (s, sum) = (c.s, c.techniques.iter().map(|t| t.1).sum::<f64>());
                let what = format!("{name} {params:?} ({s}, {}): {:?}", c.t, c.techniques);
                assert!((sum - 1.0).abs() < 1e-12, "{sum} {what}");
                assert!((f64::from(c.weight) - c.techniques[s].1).abs() < 1e-4, "{} {what}", c.weight);
                checked += 1;
                connections += usize::from(s >= 2 && c.t >= 2);
            }
        }
    }
    assert!(checked > 8000 && connections > 2000, "{checked} {connections}");
}

/// Weight of the technique with s light vertices, evaluated as if it had sampled the path. What the evaluation must not look at is
/// poisoned.
fn fast(weigher: &Weigher, d: &Densities, s: usize) -> f32 {
    let k = d.eye.len() - 1;
    const POISON: f32 = -1000.0;
    // Survival is part of both densities here.
    let side =
        |n: usize, own: &dyn Fn(usize) -> f64, other: &dyn Fn(usize) -> f64, smooth: &dyn Fn(usize) -> bool, end| {
            let mut nodes: Vec<Node> = (0..n)
                .map(|i| Node {
                    forward: AreaPdf(own(i) as f32),
                    spread: 1.0,
                    survival: 1.0,
                    ratio: if i + 2 < n { (other(i) / own(i)) as f32 } else { POISON },
                    smooth: i + 1 < n && smooth(i),
                    shorter: [POISON; 2],
                    ..Node::origin(AreaPdf(0.0))
                })
                .collect();
            // All but the last vertex have been left.
            for left in 1..n {
                weigher.sum_up(&mut nodes[..left], end);
            }
            let joint = Joint {
                arrival: AreaPdf(if n >= 1 { other(n - 1) as f32 } else { POISON }),
                departure: SolidAnglePdf(if n >= 2 { other(n - 2) as f32 } else { POISON }),
            };
            (nodes, joint)
        };
    // A vertex has smooth events unless no edge beside it can be a connection.
    let smooth = |i: usize| i == 0 || i == k || d.joinable[i] || d.joinable[i + 1];
    let light_end = End::Light { can_be_hit: d.joinable[0], next_event: d.next_event as f32 };
    let light = |i: usize| d.light.get(i).copied().unwrap_or(0.0);
    let (light_nodes, light_joint) = side(s, &light, &|i| d.eye[i], &smooth, light_end);
    let (eye_nodes, eye_joint) = side(k + 1 - s, &|i| d.eye[k - i], &|i| light(k - i), &|i| smooth(k - i), End::Lens);
    let weight = weigher.weight(&Split {
        light: &light_nodes,
        light_joint,
        eye: &eye_nodes,
        eye_lit: &[],
        eye_proposals: None,
        eye_joint,
        next_event: d.next_event as f32,
        light_can_be_hit: d.joinable[0],
        factor: 1.0,
        arriving: Rgb::BLACK,
        adjoint: Rgb::BLACK,
    });
    weight.own
}

#[test]
fn weights_of_all_techniques_sum_to_one() {
    let mut checked = 0;
    for name in GALLERY {
        let scene = prepare(exhibit(name), Backend::default_available(), None);
        let paths: Vec<FullPath> = found(&bdpt::SPEC, &scene, &[], 8).into_iter().filter_map(|c| c.path).collect();
        for path in &paths {
            for (i, techniques) in SUBSETS.into_iter().enumerate() {
                let weigher =
                    weigher(&scene, techniques, [Heuristic::Balance, Heuristic::Power][i % 2], [5, 2][i / 2 % 2]);
                let d = densities(&scene, &weigher, &|_, _| 1.0, path);
                let slow = d.weights(&weigher);
                // A subset need not have any technique that makes the path; single precision has no densities beyond its range.
                let extreme = |p: &f64| *p > 0.0 && !(1e-15..1e15).contains(p);
                if slow.iter().all(|w| w.is_nan() || *w == 0.0) || d.light.iter().chain(&d.eye).any(extreme) {
                    continue;
                }
                let possible = |s: &usize| d.log_shares(&weigher)[*s] > f64::NEG_INFINITY;
                let sum: f32 = (0..slow.len()).filter(possible).map(|s| fast(&weigher, &d, s)).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{name} {techniques}: {sum}, {slow:?}");
                checked += 1;
            }
        }
    }
    assert!(checked > 15_000, "{checked}");
}

/// One room at three scales: the same random numbers give the same paths and weights.
#[test]
fn weights_do_not_depend_on_the_unit_of_length() {
    let room = |scale: f64| {
        let at = |x: f64, y: f64, z: f64| format!("{}, {}, {}", scale * x, scale * y, scale * z);
        let wall = |bsdf: &str, more: &str, to_world: String| {
            format!(
                r#"<shape type="rectangle"><transform name="to_world">{to_world}<scale value="{scale}"/></transform>{bsdf}{more}</shape>"#
            )
        };
        let grey = r#"<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>"#;
        let gloss =
            r#"<bsdf type="twosided"><bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>"#;
        let lamp = r#"<emitter type="area"><rgb name="radiance" value="5"/></emitter>"#;
        let xml = format!(
            r#"<sensor type="perspective"><float name="fov" value="60"/><float name="near_clip" value="{}"/><float name="far_clip" value="{}"/>
            <transform name="to_world"><lookat origin="{}" target="{}" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>"#,
            0.01 * scale,
            100.0 * scale,
            at(0.0, 0.1, 0.9),
            at(0.0, 0.0, 0.0)
        ) + &wall(grey, "", r#"<translate z="-1"/>"#.into())
            + &wall(gloss, "", r#"<rotate x="1" angle="-90"/><translate y="-1"/>"#.into())
            + &wall(grey, lamp, r#"<rotate x="1" angle="90"/><scale value="0.4"/><translate y="1"/>"#.into())
            + &wall(grey, "", r#"<rotate y="1" angle="90"/><translate x="-1"/>"#.into());
        found(&bdpt::SPEC, &prepare(parse(&xml, &[]), Backend::default_available(), None), &[], 16)
    };
    let unit = room(1.0);
    assert!(unit.len() > 500, "{}", unit.len());
    for scale in [1e-4, 1e4] {
        let other = room(scale);
        let mut compared = 0;
        for (a, b) in unit.iter().zip(&other) {
            // Rounding may turn a ray to another triangle; from there on the walks differ.
            if (a.s, a.t) == (b.s, b.t) && (a.raw.g - b.raw.g).abs() < 1e-3 * a.raw.g {
                assert!((a.weight - b.weight).abs() < 1e-3, "{scale} ({}, {}): {} {}", a.s, a.t, a.weight, b.weight);
                compared += 1;
            }
        }
        assert!(compared > unit.len() / 2, "{compared} of {}", unit.len());
    }
}
