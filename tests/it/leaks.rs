//! Closed bodies do not leak: rays that meet a surface within the rounding error of an edge leave it on the inside.

use crate::support::pictures::{parse, prepare};
use lightsieve::math::hash::HashRng;
use lightsieve::math::warp::square_to_sphere;
use lightsieve::math::{Frame, Vec3};
use lightsieve::prepared::PreparedScene;
use lightsieve::ray::offset::offset_point;
use lightsieve::ray::{Backend, MeshBuffers, Ray};
use lightsieve::scene::RoundKind;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

const CAMERA: &str = r#"<sensor type="perspective"><film type="hdrfilm"/></sensor>"#;
const TURNED: &str = r#"<rotate x="0.26726" y="0.53452" z="0.80178" angle="37"/>"#;
/// A cube of which one side has a vertex more, on an edge that the neighbouring side does not split.
const T_JUNCTION: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nv 1 0.3 1\n\
    f 1 2 3\nf 1 3 4\nf 5 6 9\nf 5 9 8\nf 9 7 8\nf 2 3 7\nf 2 7 6\nf 1 4 8\nf 1 8 5\nf 1 2 6\nf 1 6 5\nf 4 3 7\nf 4 7 8\n";
/// Rays aimed at the edges of a body.
const RAYS: u32 = 200_000;

/// A sphere of triangles: 24 slices of 12 rings, with flat normals.
fn ball() -> String {
    let (slices, rings) = (24, 12);
    let vertex = |i: u32| {
        let (polar, azimuth) =
            (PI * f64::from(i / slices) / f64::from(rings), TAU * f64::from(i % slices) / f64::from(slices));
        let ((sin, cos), (s, c)) = (polar.sin_cos(), azimuth.sin_cos());
        // π is not exact: without rounding the vertices of a pole would not be one point.
        let sin = if i / slices == rings { 0.0 } else { sin };
        format!("v {} {} {}\n", sin * c, sin * s, cos)
    };
    let face = |i: u32| {
        let next = i / slices * slices + (i + 1) % slices;
        // Vertices count from 1.
        format!("f {} {} {} {}\n", i + 1, i + slices + 1, next + slices + 1, next + 1)
    };
    (0..(rings + 1) * slices).map(vertex).chain((0..rings * slices).map(face)).collect()
}

fn body(shapes: &str, backend: Backend) -> PreparedScene {
    let ball = ball();
    let files = [("cube.obj", T_JUNCTION), ("ball.obj", ball.as_str())];
    prepare(parse(&format!("{CAMERA}{shapes}<emitter type=\"constant\"/>"), &files), backend, None)
}

fn transform(inside: &str) -> String {
    format!("<transform name=\"to_world\">{inside}</transform>")
}

fn cube(turn: &str) -> String {
    format!("<shape type=\"cube\">{}</shape>", transform(turn))
}

/// Six rectangles with corners of their own, which touch along open edges.
fn rectangles(turn: &str) -> String {
    let sides =
        ["", "<rotate x=\"1\" angle=\"180\"/>", "<rotate x=\"1\" angle=\"90\"/>", "<rotate x=\"1\" angle=\"-90\"/>"];
    let sides = sides.into_iter().chain(["<rotate y=\"1\" angle=\"90\"/>", "<rotate y=\"1\" angle=\"-90\"/>"]);
    sides
        .map(|side| {
            format!("<shape type=\"rectangle\">{}</shape>", transform(&format!("<translate z=\"1\"/>{side}{turn}")))
        })
        .collect()
}

/// The ends of all edges of the body's triangles; where there are none, points of its rims or surface.
fn edges(scene: &PreparedScene) -> Vec<[Vec3; 2]> {
    let mut edges = vec![];
    let round = scene.geometry.round.iter();
    for shape in round {
        let along = |i: u32| {
            [if shape.kind == RoundKind::Sphere { i as f32 / 1000.0 } else { 0.999_999_9 }, i as f32 * 0.618_034 % 1.0]
        };
        edges.extend((0..1000).map(|i| [shape.point_of(shape.sample_unit(along(i))).p; 2]));
    }
    let middle = -scene.centre.as_vec3();
    // Geometry elsewhere only moves the body away from the scene's centre.
    let is_body = |mesh: &&MeshBuffers| mesh.positions.iter().all(|p| p.distance(middle) < 2.0);
    for mesh in scene.geometry.meshes.iter().filter(is_body) {
        for i in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(i);
            edges.extend([[a, b], [b, c], [c, a]]);
        }
    }
    edges
}

/// A random number that is often tiny.
fn tiny(rng: &mut HashRng) -> f32 {
    let size = 10f32.powf(-3.0 - 6.0 * rng.next_f32());
    size * (rng.next_f32() - 0.5)
}

/// Escaped rays: those from the inside to points of edges and corners, and those that leave the points that these meet.
fn leaks(scene: &PreparedScene, edges: &[[Vec3; 2]], rays: u32) -> (u32, u32) {
    let mut rng = HashRng::new(1, 2, 3, 4);
    let (mut first, mut second) = (0, 0);
    for i in 0..rays {
        let [a, b] = edges[i as usize % edges.len()];
        let [x, y, z, along] = rng.next_4();
        // One in five near a corner.
        let along = if i % 5 == 0 { tiny(&mut rng).abs() } else { along };
        let target = a.lerp(b, along) + Vec3::new(tiny(&mut rng), tiny(&mut rng), tiny(&mut rng));
        let o = (Vec3::new(x, y, z) - 0.5) * 0.6 - scene.centre.as_vec3();
        let d = (target - o).normalize();
        let Some(hit) = scene.query.closest(&Ray::leaving(o, d)) else {
            first += 1;
            continue;
        };
        let (point, _) = scene.surface_point(&hit);
        let normal = if point.ng.dot(d) > 0.0 { -point.ng } else { point.ng };
        let out = square_to_sphere([rng.next_f32(), rng.next_f32()]);
        let out = if out.dot(normal) < 0.0 { Frame::from_normal(normal).to_world(Vec3::Z) - out } else { out };
        let leaving = Ray::leaving(offset_point(point.p, point.error, point.ng, out), out);
        second += u32::from(out.dot(normal) > 0.0 && scene.query.closest(&leaving).is_none());
    }
    (first, second)
}

/// Names of bodies and their shapes.
fn bodies() -> Vec<(&'static str, String)> {
    let far = transform("<translate x=\"5\" y=\"7\" z=\"9\"/>");
    let mesh = |file: &str, turn: &str| {
        format!("<shape type=\"obj\"><string name=\"filename\" value=\"{file}\"/>{}</shape>", transform(turn))
    };
    let wall = transform(&format!("<scale z=\"2\"/><translate z=\"-1\"/>{TURNED}"));
    let caps = ["-1", "1"]
        .map(|z| format!("<shape type=\"disk\">{}</shape>", transform(&format!("<translate z=\"{z}\"/>{TURNED}"))));
    let group = format!("<shape type=\"shapegroup\" id=\"g\">{}</shape>", cube(""));
    let placed = transform("<scale x=\"0.8\" y=\"1.3\"/>");
    vec![
        ("cube", cube("")),
        ("turned cube", cube(TURNED)),
        ("turned cube away from the centre", format!("{}<shape type=\"cube\">{far}</shape>", cube(TURNED))),
        ("T-junctions", mesh("cube.obj", "")),
        ("turned T-junctions", mesh("cube.obj", TURNED)),
        ("rectangles", rectangles("")),
        ("turned rectangles", rectangles(TURNED)),
        ("sphere", format!("<shape type=\"sphere\">{}</shape>", transform(TURNED))),
        ("ball of triangles", mesh("ball.obj", TURNED)),
        ("can", format!("<shape type=\"cylinder\">{wall}</shape>{}", caps.concat())),
        ("instance", format!("{group}<shape type=\"instance\"><ref id=\"g\"/>{placed}</shape>")),
    ]
}

fn are_tight(rays: u32) {
    let bodies = bodies();
    let backends = [Backend::default_available(), Backend::Obvhs];
    bodies.par_iter().flat_map(|body| backends.map(|backend| (body, backend))).for_each(|((what, shapes), backend)| {
        let scene = body(shapes, backend);
        let (missed, left) = leaks(&scene, &edges(&scene), rays);
        assert_eq!(left, 0, "{what}, {backend:?}: rays that leave the point met");
        // Rays aimed at the poles of the ball, where 24 triangles meet, pass between them once in millions.
        assert!(missed <= rays / 1_000_000, "{what}, {backend:?}: {missed} rays miss the edge");
    });
}

/// LEAK_RAYS is the number of rays aimed at each body, if it is set.
#[test]
fn closed_bodies_are_tight() {
    are_tight(std::env::var("LEAK_RAYS").ok().and_then(|rays| rays.parse().ok()).unwrap_or(RAYS));
}
