//! Light through masks and `null` interfaces, in every method: values known by hand, pictures without the surfaces, and
//! weights.

use crate::support::methods::{bidirectional_methods, weight_variant};
use crate::support::pictures::{Picture, parse, prepare, takes, unbiased};
use lightsieve::integrators::{IntegratorSpec, Iteration, importance, path};
use lightsieve::math::sampler::PathSampler;
use lightsieve::path::first_seen;
use lightsieve::prepared::{Features, PreparedScene};
use lightsieve::ray::{Backend, Ray, RayKind};

const SPP: u64 = 64;
/// Albedo of the floor.
const ALBEDO: f64 = 0.6;

fn scene(parts: &[&str]) -> PreparedScene {
    prepare(parse(&parts.concat(), &[]), Backend::default_available(), None)
}

/// A camera above the origin that looks at a floor.
fn floor(bsdf: &str) -> String {
    format!(
        r#"<sensor type="perspective"><float name="fov" value="25"/>
        <transform name="to_world"><lookat origin="0, 4, 1" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film>
        </sensor><shape type="rectangle"><transform name="to_world"><scale value="8"/><rotate x="1" angle="-90"/>
        </transform>{bsdf}</shape>"#
    )
}

fn diffuse(albedo: f64) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf>"#)
}

/// A horizontal square of half side `size` at height `y`; its front looks down.
fn square(size: f64, y: f64, content: &str) -> String {
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="{size}"/><rotate x="1" angle="90"/>
        <translate y="{y}"/></transform>{content}</shape>"#
    )
}

/// A mask over a black surface.
fn black_mask(opacity: &str) -> String {
    format!(r#"<bsdf type="mask">{opacity}{}</bsdf>"#, diffuse(0.0))
}

const SUN: &str = r#"<emitter type="directional"><vector name="direction" value="0, -1, 0"/>
    <rgb name="irradiance" value="3.14159265"/></emitter>"#;

const POINT: &str = r#"<emitter type="point"><point name="position" value="0.3, 1.5, 0.2"/>
    <rgb name="intensity" value="5"/></emitter>"#;

/// Every method that claims all of the light of the scene, and importance caching.
fn methods(scene: &PreparedScene) -> impl Iterator<Item = &'static IntegratorSpec> {
    unbiased().chain([&importance::IMPORTANCE_CACHING]).filter(|spec| takes(spec, scene))
}

fn render(spec: &'static IntegratorSpec, scene: &PreparedScene, seed: u64) -> Picture {
    Picture::render(spec, scene, &[("fallback", "false")], SPP, seed)
}

/// Every method renders the picture `expected` of the scene.
fn all_agree(scene: &PreparedScene, expected: &Picture, what: &str) {
    assert!(methods(scene).count() >= 9, "{what}");
    for spec in methods(scene) {
        // Virtual lights near a surface have no variance to judge by.
        let tolerance = if spec.name == "importance-caching" { 0.002 } else { 0.0 };
        render(spec, scene, 1).assert_agrees(expected, tolerance, &format!("{}: {what}", spec.name));
    }
}

#[test]
fn a_null_shell_around_a_light_is_nothing() {
    let shell = r#"<shape type="sphere"><point name="center" value="0.3, 1.5, 0.2"/><float name="radius" value="0.4"/>
        <bsdf type="null"/></shape><shape type="cube"><transform name="to_world"><scale value="0.7"/>
        <translate y="1.4"/></transform><bsdf type="null"/></shape>"#;
    let [without, with] = [[&floor(&diffuse(ALBEDO)), POINT, ""], [&floor(&diffuse(ALBEDO)), POINT, shell]];
    let expected = render(&path::SPEC, &scene(&without), 100);
    let with = scene(&with);
    // Interfaces cost nothing: no ray meets them.
    assert!(!with.features.contains(Features::MASKS));
    all_agree(&with, &expected, "null shell");
    // The depth of a path does not count them either.
    for spec in methods(&with) {
        let shallow = Picture::render(spec, &with, &[("max_depth", "2"), ("fallback", "false")], SPP, 1);
        shallow.assert_agrees(&expected, 0.002, spec.name);
    }
}

#[test]
fn the_sun_through_a_mask_seen_through_the_mask() {
    let mask = black_mask(r#"<float name="opacity" value="0.3"/>"#);
    let canopy = scene(&[&floor(&diffuse(ALBEDO)), SUN, &square(6.0, 2.0, &mask)]);
    all_agree(&canopy, &Picture::constant(ALBEDO * 0.7 * 0.7, 16), "canopy");
}

/// Ten thousand leaves that let nearly all light pass, one above the other.
#[test]
fn thousands_of_crossings_lose_nothing() {
    let leaf = black_mask(r#"<float name="opacity" value="0.0001"/>"#);
    let stack: String = (0..5000).map(|i| square(6.0, 1.0 + 2e-4 * f64::from(i), &leaf)).collect();
    let scene = scene(&[&floor(&diffuse(ALBEDO)), SUN, &stack]);
    let share = 0.9999f64.powi(5000);
    let expected = Picture::constant(ALBEDO * share * share, 16);
    // Few samples: each has ten thousand crossings.
    let picture = Picture::render(&path::SPEC, &scene, &[], 8, 1);
    picture.assert_agrees(&expected, 1e-4, "path");
}

#[test]
fn opacity_may_differ_from_point_to_point() {
    // Holes of a chessboard, half as wide as a pixel sees: a quarter of the light by way of both crossings is lost to
    // squares, the rest depends on where the two crossings are. A chessboard over the light's side alone is exact.
    let board = r#"<texture type="checkerboard" name="opacity"><rgb name="color0" value="0"/><rgb name="color1" value="1"/>
        <transform name="to_uv"><scale x="5" y="5"/></transform></texture>"#;
    let light = r#"<emitter type="area"><rgb name="radiance" value="6, 5, 4"/></emitter>"#;
    let surroundings = [&floor(&diffuse(ALBEDO)), &square(1.0, 3.0, light)].map(String::as_str).concat();
    let grey = format!(r#"<bsdf type="mask">{board}<bsdf type="twosided">{}</bsdf></bsdf>"#, diffuse(0.5));
    let holes = scene(&[&surroundings, &square(1.5, 1.0, &grey)]);
    // The squares themselves: every second of a grid of ten by ten.
    let tile = |i: i32, j: i32| {
        let [x, z] = [i, j].map(|i| -1.5 + 0.3 * (f64::from(i) + 0.5));
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="0.15"/><rotate x="1" angle="90"/>
            <translate x="{x}" y="1" z="{z}"/></transform><bsdf type="twosided">{}</bsdf></shape>"#,
            diffuse(0.5)
        )
    };
    let cells = (0..10).flat_map(|i| (0..10).map(move |j| (i, j)));
    let squares =
        |odd: i32| cells.clone().filter(|(i, j)| (i + j) % 2 == odd).map(|(i, j)| tile(i, j)).collect::<String>();
    let pictures =
        [0, 1].map(|odd| Picture::render(&path::SPEC, &scene(&[&surroundings, &squares(odd)]), &[], 4 * SPP, 100));
    // Which of the squares are holes is for texture coordinates to say.
    let same = render(&path::SPEC, &holes, 500);
    let expected = pictures.iter().find(|p| same.difference(p, 0.0).is_none()).expect("neither half of the squares");
    all_agree(&holes, expected, "chessboard");
}

/// A surface emits all of its emission, whatever its opacity is, and light from behind comes through.
#[test]
fn emitters_with_holes_emit_and_let_light_through() {
    let emission =
        |radiance: f64| format!(r#"<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter>"#);
    let opacity = |alpha: f64| black_mask(&format!(r#"<float name="opacity" value="{alpha}"/>"#));
    let lamp = |size: f64, y: f64, radiance: f64, bsdf: &str| square(size, y, &(emission(radiance) + bsdf));
    let floor = floor(&diffuse(ALBEDO));
    for (bsdf, share) in [(r#"<bsdf type="null"/>"#.to_owned(), 1.0), (opacity(0.4), 0.6)] {
        let masked = scene(&[&floor, &lamp(0.5, 1.2, 2.0, &bsdf), &lamp(1.0, 2.4, 3.0, &opacity(1.0))]);
        // One lamp after the other, beside the surface of the other.
        let alone = scene(&[&floor, &lamp(0.5, 1.2, 2.0, &bsdf), &square(1.0, 2.4, &opacity(1.0))]);
        let behind = scene(&[&floor, &square(0.5, 1.2, &bsdf), &lamp(1.0, 2.4, 3.0, &opacity(1.0))]);
        let [alone, behind] = [&alone, &behind].map(|s| Picture::render(&path::SPEC, s, &[], 4 * SPP, 100));
        let mut expected = alone.clone();
        let add = |sums: &mut Vec<[f64; 3]>, more: &[[f64; 3]]| {
            sums.iter_mut().flatten().zip(more.iter().flatten()).for_each(|(sum, more)| *sum += more);
        };
        add(&mut expected.mean, &behind.mean);
        add(&mut expected.variance, &behind.variance);
        expected.whole = (alone.whole.0 + behind.whole.0, alone.whole.1 + behind.whole.1);
        all_agree(&masked, &expected, &format!("emitter that lets {share} through"));
    }
    // Light that the camera sees of them: their own emission and 0.6 of that behind.
    let camera = r#"<sensor type="perspective"><float name="fov" value="20"/>
        <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film>
        </sensor>"#;
    let wall = |z: f64, content: String| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="5"/><translate z="{z}"/></transform>
            {content}</shape>"#
        )
    };
    let seen = scene(&[camera, &wall(0.0, emission(2.0) + &opacity(0.4)), &wall(-1.0, emission(3.0) + &opacity(1.0))]);
    all_agree(&seen, &Picture::constant(2.0 + 0.6 * 3.0, 16), "seen directly");
}

/// Walls of masks between everything: weights are those of the definition, and sum to one.
#[test]
fn weights_count_the_masks_on_every_edge() {
    let mask = |alpha: f64| {
        let grey = diffuse(0.7);
        format!(
            r#"<bsdf type="mask"><float name="opacity" value="{alpha}"/><bsdf type="twosided">{grey}</bsdf></bsdf>"#
        )
    };
    let light = r#"<emitter type="area"><rgb name="radiance" value="6, 5, 4"/></emitter>"#;
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="0.4"/></emitter>"#;
    let scene = scene(&[
        &floor(&diffuse(ALBEDO)),
        &square(6.0, 0.7, &mask(0.5)),
        &square(6.0, 1.3, &mask(0.2)),
        &square(4.0, 3.0, &(light.to_owned() + &mask(0.7))),
        sky,
    ]);
    for spec in bidirectional_methods() {
        let (mut checked, mut connections) = (0, 0);
        for variant in 0..6 {
            let mut integrator = (spec.build)(&weight_variant(spec, variant));
            // Few light sub-paths meet what the camera sees, and other methods find more paths from each pixel.
            let iterations = if spec.name == "light" { 100 } else { 8 };
            for c in (0..16 * iterations).flat_map(|i| {
                let pixel = (i % 4, i / 4 % 4);
                integrator.replay(&Iteration::new(&scene, 7, u64::from(i / 16)), pixel).contributions
            }) {
                let (s, sum) = (c.s, c.techniques.iter().map(|t| t.1).sum::<f64>());
                let what = format!("{} variant {variant} ({s}, {}): {:?}", spec.name, c.t, c.techniques);
                assert!((sum - 1.0).abs() < 1e-12, "{sum} {what}");
                assert!((f64::from(c.weight) - c.techniques[s].1).abs() < 1e-4, "{} {what}", c.weight);
                checked += 1;
                connections += usize::from(s >= 2 && c.t >= 2);
            }
        }
        assert!(checked > 100 && (connections > 50) == (spec.name != "light"), "{} {checked} {connections}", spec.name);
    }
}

/// Auxiliary layers show surfaces behind holes, at their own distance.
#[test]
fn the_first_surface_is_behind_the_holes() {
    let all_holes = black_mask(r#"<float name="opacity" value="0"/>"#);
    let behind = [square(6.0, 2.0, &all_holes), square(6.0, 1.0, r#"<bsdf type="null"/>"#)].concat();
    for backend in [Backend::default_available(), Backend::Obvhs, Backend::Brute] {
        let scene = prepare(parse(&(floor(&diffuse(ALBEDO)) + &behind), &[]), backend, None);
        let eye = scene.camera.sample_ray([2.0, 2.0], [0.5; 2]);
        let ray = Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far };
        let (mut tracer, mut sampler) = (scene.tracer(), PathSampler::new(1, 2, 3, 4));
        let (hit, point, material) = first_seen(&scene, &ray, &mut tracer, sampler.rng()).unwrap();
        assert!((f64::from(hit.t) - 17.0f64.sqrt()).abs() < 1e-4, "{backend:?} {}", hit.t);
        assert!(point.ng.y.abs() > 0.999 && !material.features().passes_through);
        // The mask, and the floor; no ray meets an interface.
        assert_eq!(tracer.stats.rays(&[RayKind::Camera]), 2.0, "{backend:?}");
    }
}
