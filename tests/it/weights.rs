//! Weights of sampled paths against their definition, for every technique, any subset of techniques, and scenes with
//! every feature: they sum to one, the fast ones are the slow ones, and they depend on nothing that they should not.

use crate::support::gallery::{GALLERY, exhibit};
use crate::support::methods::{bidirectional_methods, for_small_scenes};
use crate::support::pictures::{parse, prepare};
use lightsieve::bidir::ContributionRecord;
use lightsieve::emit::EmissionDistribution;
use lightsieve::integrators::{IntegratorSpec, Iteration, Params, bdpt};
use lightsieve::math::{AreaPdf, Rgb, SolidAnglePdf};
use lightsieve::mis::factors::Balance;
use lightsieve::mis::{
    ConnectedPath, EmitterFactors, EndpointPdfs, Heuristic, MisContext, PathEnd, PathPdfs, ReversePath, Techniques,
    VertexPdfs,
};
use lightsieve::path::{FullPath, PathLimits, ScatterSampler};
use lightsieve::prepared::PreparedScene;
use lightsieve::ray::{Backend, Transmittance};

/// Every path that bidirectional path tracing finds in a grid of pixels.
fn found(
    spec: &'static IntegratorSpec,
    scene: &PreparedScene,
    params: &[(&str, &str)],
    iterations: u64,
) -> Vec<ContributionRecord> {
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
            all.extend(integrator.replay(&Iteration::new(scene, 5, index), pixel).contributions);
        }
    }
    all
}

fn context(scene: &PreparedScene, techniques: &str, heuristic: Heuristic, rr_depth: u32) -> MisContext<Balance> {
    let mut techniques = Techniques::parse(techniques).unwrap();
    techniques.set_light_paths(scene.film_size[0] as f32 * scene.film_size[1] as f32);
    let limits = PathLimits { max_edges: u32::MAX, rr_depth, rr_scale: 1.0 };
    MisContext {
        techniques,
        heuristic,
        eye_limits: limits,
        light_limits: limits,
        emission: EmissionDistribution::default(),
        directions: ScatterSampler,
        factor: Balance,
    }
}

/// How far the rounding of positions, from which the definition computes directions and cosines anew, changes these: it
/// counts on short edges and at grazing angles.
fn rounding(path: &FullPath) -> f64 {
    let place = |k: usize| path.interior.get(k.wrapping_sub(1)).map(|v| v.place);
    let edge = |k: usize| {
        let (a, b) = (path.position(k)?, path.position(k + 1)?);
        let (length, d) = ((b - a).length(), (b - a).normalize());
        let cos = [k, k + 1].into_iter().filter_map(place).map(|place| place.cosine(d).abs()).fold(1.0, f32::min);
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
                    let tolerance = (6e-5 + c.path.as_ref().map_or(0.0f64, rounding)).min(2e-4);
                    assert!(error < tolerance, "{} off by {error} > {tolerance} {what}", c.weight);
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 60_000, "{checked}");
}

/// Every registered method, with parameters that lead through all its weights; a new method takes part by being
/// registered.
#[test]
fn weights_of_every_method_are_those_of_the_definition() {
    for spec in bidirectional_methods() {
        let (mut checked, mut connections) = (0, 0);
        for name in GALLERY {
            let scene = prepare(exhibit(name), Backend::default_available(), None);
            for (i, techniques) in SUBSETS.into_iter().enumerate() {
                let mut params = for_small_scenes(spec, i);
                let mut set = |name: &'static str, value: &'static str| {
                    if spec.params().any(|p| p.name == name) {
                        params.push((name, value));
                    }
                };
                set("techniques", techniques);
                set("rr_depth", ["5", "1", "2"][i % 3]);
                for c in found(spec, &scene, &params, 2) {
                    let (s, sum) = (c.s, c.techniques.iter().map(|t| t.1).sum::<f64>());
                    let what = format!("{} {name} {params:?} ({s}, {}): {:?}", spec.name, c.t, c.techniques);
                    assert!((sum - 1.0).abs() < 1e-12, "{sum} {what}");
                    assert!((f64::from(c.weight) - c.techniques[s].1).abs() < 1e-4, "{} {what}", c.weight);
                    checked += 1;
                    connections += usize::from(s >= 2 && c.t >= 2);
                }
            }
        }
        let connects = spec.name != "light";
        assert!(checked > 1000 && (connections > 250) == connects, "{} {checked} {connections}", spec.name);
    }
}

/// Densities of the first n vertices of one end of a path, as the walk from there keeps them when it has arrived at the
/// last. Numbers that must not be read are poisoned.
struct Subpath<'a> {
    n: usize,
    /// Density of vertex i by the walk from this end.
    own: &'a dyn Fn(usize) -> f64,
    /// Density of vertex i by the walk from the other end.
    other: &'a dyn Fn(usize) -> f64,
    /// Transmittance of the edge between vertices i − 1 and i.
    transmittance: &'a dyn Fn(usize) -> f64,
    connectable: &'a dyn Fn(usize) -> bool,
    end: PathEnd,
}

const POISON: f32 = -1000.0;

impl Subpath<'_> {
    fn pdfs(&self, mis: &MisContext<Balance>) -> (Vec<VertexPdfs>, EndpointPdfs) {
        let (n, own, other) = (self.n, self.own, self.other);
        // Survival is part of both densities here.
        let mut vertices: Vec<VertexPdfs> = (0..n)
            .map(|i| VertexPdfs {
                pdf_fwd: AreaPdf(own(i) as f32),
                area_jacobian: 1.0,
                survival: 1.0,
                rev_over_fwd: if i + 2 < n { (other(i) / own(i)) as f32 } else { POISON },
                connectable: i + 1 < n && (self.connectable)(i),
                connection_factor: if i > 0 { (1.0 / (self.transmittance)(i)) as f32 } else { 1.0 },
                partial_sums: [POISON; 2],
            })
            .collect();
        // All but the last vertex have been left.
        for left in 1..n {
            mis.accumulate_partial_sums(&mut vertices[..left], self.end);
        }
        let end = EndpointPdfs {
            pdf_rev: AreaPdf(if n >= 1 { other(n - 1) as f32 } else { POISON }),
            pdf_rev_prev: SolidAnglePdf(if n >= 2 { other(n - 2) as f32 } else { POISON }),
        };
        (vertices, end)
    }
}

/// Weight of the technique with s light vertices, evaluated as if it had sampled the path.
fn fast(mis: &MisContext<Balance>, d: &PathPdfs, s: usize) -> f32 {
    let k = d.eye.len() - 1;
    // A vertex has events with densities unless no edge beside it can be a connection.
    let connectable = |i: usize| i == 0 || i == k || d.connectable[i] || d.connectable[i + 1];
    let emitter = EmitterFactors { can_be_hit: d.connectable[0], next_event: d.next_event as f32 };
    let light = |i: usize| d.light.get(i).copied().unwrap_or(0.0);
    let light_side = Subpath {
        n: s,
        own: &light,
        other: &|i| d.eye[i],
        transmittance: &|i| d.transmittances[i],
        connectable: &connectable,
        end: PathEnd::Light(emitter),
    };
    let eye_side = Subpath {
        n: k + 1 - s,
        own: &|i| d.eye[k - i],
        other: &|i| light(k - i),
        transmittance: &|i| d.transmittances[k + 1 - i],
        connectable: &|i| connectable(k - i),
        end: PathEnd::Lens,
    };
    let ((light, light_end), (eye, eye_end)) = (light_side.pdfs(mis), eye_side.pdfs(mis));
    let reverse = ReversePath { vertices: &[], edges: &[], last_edge: (), throughput: Rgb::BLACK, value: Rgb::BLACK };
    let path = ConnectedPath { light: &light, light_end, eye: &eye, eye_end, emitter, connection_factor: 1.0, reverse };
    // As where the transmittance of the connection is found after the weight.
    let open = mis.weight(&path);
    let mut transmittance = Transmittance::ONE;
    transmittance *= d.transmittances[s] as f32;
    open.through(transmittance, mis.heuristic, (s, k + 1 - s)).own
}

#[test]
fn weights_of_all_techniques_sum_to_one() {
    let mut checked = 0;
    for name in GALLERY {
        let scene = prepare(exhibit(name), Backend::default_available(), None);
        let paths: Vec<FullPath> =
            found(&bdpt::SPEC, &scene, &[("fallback", "false")], 8).into_iter().filter_map(|c| c.path).collect();
        for path in &paths {
            for (i, techniques) in SUBSETS.into_iter().enumerate() {
                let mis = context(&scene, techniques, [Heuristic::Balance, Heuristic::Power][i % 2], [5, 2][i / 2 % 2]);
                let d = PathPdfs::new(&scene, &mis, &|_| 1.0, path);
                let slow = d.weights(&mis);
                // A subset need not have any technique that makes the path; single precision has no densities beyond
                // its range.
                let extreme = |p: &f64| *p > 0.0 && !(1e-15..1e15).contains(p);
                if slow.iter().all(|w| w.is_nan() || *w == 0.0) || d.light.iter().chain(&d.eye).any(extreme) {
                    continue;
                }
                let possible = |s: &usize| d.log_effective_pdfs(&mis)[*s] > f64::NEG_INFINITY;
                let sum: f32 = (0..slow.len()).filter(possible).map(|s| fast(&mis, &d, s)).sum();
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
        found(&bdpt::SPEC, &prepare(parse(&xml, &[]), Backend::default_available(), None), &[("fallback", "false")], 16)
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
        // All 740 are, with these seeds; processors that round otherwise may lose a path.
        assert!(compared * 100 >= 99 * unit.len(), "{compared} of {}", unit.len());
    }
}
