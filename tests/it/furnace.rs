//! Furnaces: scenes whose radiance is the same known number everywhere, for every integrator, material and camera.

use crate::support::pictures::{Picture, SIGNIFICANCE, chance, parse, prepare, takes, unbiased};
use lightsieve::ray::Backend;

const SIDE: usize = 8;
const PINHOLE: &str = r#"<sensor type="perspective">"#;
const LENS: &str =
    r#"<sensor type="thinlens"><float name="aperture_radius" value="0.2"/><float name="focus_distance" value="1.5"/>"#;

/// A camera at `origin` that looks at the world's origin.
fn camera(kind: &str, origin: &str, filter: &str) -> String {
    format!(
        r#"{kind}<float name="fov" value="50"/>
        <transform name="to_world"><lookat origin="{origin}" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="{SIDE}"/><integer name="height" value="{SIDE}"/>
        <rfilter type="{filter}"/></film></sensor>"#
    )
}

/// A shape seen from its inside, of grey diffuse material, that shines everywhere with radiance 1.
fn closed(shape: &str, albedo: f64) -> String {
    format!(
        r#"<shape type="{shape}"><boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#
    )
}

#[test]
fn a_closed_furnace_sums_the_geometric_series() {
    let albedo = 0.6;
    for shape in ["cube", "sphere"] {
        for (kind, filter) in [(PINHOLE, "box"), (PINHOLE, "mitchell"), (LENS, "box"), (LENS, "gaussian")] {
            for crop in [None, Some([3, 1, 4, 6])] {
                let xml = camera(kind, "0.1, 0.2, 0.5", filter) + &closed(shape, albedo);
                let scene = prepare(parse(&xml, &[]), Backend::default_available(), crop);
                for spec in unbiased().filter(|s| takes(s, &scene)) {
                    let picture = Picture::render(spec, &scene, &[], 32, 1);
                    let what = format!("{}: {shape}, {kind}, {filter}, {crop:?}", spec.name);
                    let exact = Picture::constant(1.0 / (1.0 - albedo), picture.mean.len());
                    picture.assert_agrees(&exact, 0.0, &what);
                }
            }
        }
    }
}

#[test]
fn every_path_length_of_a_closed_furnace_has_its_share() {
    let albedo: f64 = 0.8;
    let xml = camera(PINHOLE, "0.1, 0.2, 0.5", "box") + &closed("cube", albedo);
    let scene = prepare(parse(&xml, &[]), Backend::default_available(), None);
    for spec in unbiased().filter(|s| takes(s, &scene)) {
        for depth in [1, 2, 3, 4, 7] {
            // Roulette from the first vertex on changes noise only.
            for roulette in ["1", "100"] {
                let params = [("max_depth", &*depth.to_string()), ("rr_depth", roulette)];
                let picture = Picture::render(spec, &scene, &params, 32, 1);
                let exact = (1.0 - albedo.powi(depth)) / (1.0 - albedo);
                let what = format!("{}: up to {depth} edges, roulette from {roulette}", spec.name);
                picture.assert_agrees(&Picture::constant(exact, SIDE * SIDE), 0.0, &what);
            }
        }
    }
}

/// Materials that return all the light they receive.
const WHITE: [(&str, &str); 9] = [
    ("diffuse", r#"<bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf>"#),
    ("dielectric", r#"<bsdf type="dielectric"/>"#),
    ("thindielectric", r#"<bsdf type="thindielectric"/>"#),
    ("conductor", r#"<bsdf type="conductor"><rgb name="eta" value="0"/><rgb name="k" value="1"/></bsdf>"#),
    (
        "twosided",
        r#"<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf><bsdf type="conductor"/></bsdf>"#,
    ),
    (
        "mask",
        r#"<bsdf type="mask"><float name="opacity" value="0.3"/><bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></bsdf></bsdf>"#,
    ),
    (
        "blend",
        r#"<bsdf type="blendbsdf"><float name="weight" value="0.4"/><bsdf type="conductor"/><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></bsdf>"#,
    ),
    ("null", r#"<bsdf type="null"/>"#),
    (
        "bump map",
        r#"<bsdf type="bumpmap"><texture type="checkerboard"><rgb name="color0" value="0"/><rgb name="color1" value="0"/></texture><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></bsdf>"#,
    ),
];

/// Materials that lose some light by their nature (single scattering, a base under a coat), with the mean of the whole
/// picture, of which they cover only a part: measured once with the path tracer, standard error below 0.001. Burley's
/// model is missing: it reflects more than it receives at grazing angles (1.07 where this cube shows most of that).
const OFF_WHITE: [(&str, &str, f64); 8] = [
    ("rough glass", r#"<bsdf type="roughdielectric"><float name="alpha" value="0.3"/></bsdf>"#, 0.9455),
    (
        "rough glass, ggx",
        r#"<bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha" value="0.1"/></bsdf>"#,
        0.9674,
    ),
    (
        "rough mirror",
        r#"<bsdf type="roughconductor"><float name="alpha" value="0.4"/><rgb name="eta" value="0"/><rgb name="k" value="1"/></bsdf>"#,
        0.9640,
    ),
    (
        "plastic",
        r#"<bsdf type="plastic"><boolean name="nonlinear" value="true"/><rgb name="diffuse_reflectance" value="1"/></bsdf>"#,
        0.9997,
    ),
    (
        "rough plastic",
        r#"<bsdf type="roughplastic"><float name="alpha" value="0.2"/><boolean name="nonlinear" value="true"/><rgb name="diffuse_reflectance" value="1"/></bsdf>"#,
        0.9713,
    ),
    (
        "principled metal",
        r#"<bsdf type="principled"><rgb name="base_color" value="1"/><float name="metallic" value="1"/><float name="roughness" value="0.5"/></bsdf>"#,
        0.9483,
    ),
    (
        "phong",
        r#"<bsdf type="phong"><rgb name="specular_reflectance" value="0.4"/><rgb name="diffuse_reflectance" value="0.6"/></bsdf>"#,
        0.9310,
    ),
    (
        "ward",
        r#"<bsdf type="ward"><float name="alpha" value="0.3"/><rgb name="specular_reflectance" value="0.4"/><rgb name="diffuse_reflectance" value="0.6"/></bsdf>"#,
        0.9739,
    ),
];

/// A tilted cube in a world that shines with radiance 1 from everywhere.
fn open(bsdf: &str) -> String {
    camera(PINHOLE, "0, 0, 4.5", "box")
        + &format!(
            r#"<shape type="cube"><transform name="to_world"><rotate x="1" y="0.5" angle="40"/></transform>{bsdf}</shape>
            <emitter type="constant"><rgb name="radiance" value="1"/></emitter>"#
        )
}

#[test]
fn white_materials_vanish_in_a_white_world() {
    for (name, bsdf) in WHITE {
        let scene = prepare(parse(&open(bsdf), &[]), Backend::default_available(), None);
        for spec in unbiased().filter(|s| takes(s, &scene)) {
            let picture = Picture::render(spec, &scene, &[], 64, 1);
            // Stratified roulette with a survival near one goes wrong so rarely that few renders know of no variance at
            // all.
            picture.assert_agrees(&Picture::constant(1.0, SIDE * SIDE), 0.005, &format!("{}: {name}", spec.name));
        }
    }
}

#[test]
fn no_material_makes_light() {
    for (name, bsdf, known) in OFF_WHITE {
        let scene = prepare(parse(&open(bsdf), &[]), Backend::default_available(), None);
        for spec in unbiased().filter(|s| takes(s, &scene)) {
            let picture = Picture::render(spec, &scene, &[], 64, 1);
            let per_test = 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / (3 * SIDE * SIDE) as f64);
            for (i, (mean, variance)) in picture.mean.iter().zip(&picture.variance).enumerate() {
                for c in 0..3 {
                    let p = chance((mean[c], variance[c]), (1.0, 0.0), (picture.freedom, f64::INFINITY), 0.0);
                    // One-sided: half the chance.
                    let text = format!("{}: {name}: {} in pixel {i}, p = {p:e}", spec.name, mean[c]);
                    assert!(mean[c] <= 1.0 || 0.5 * p >= per_test, "{text}");
                }
            }
            let (mean, variance) = picture.whole;
            let p = chance((mean, variance), (1.0, 0.0), (picture.freedom, f64::INFINITY), 0.0);
            assert!(mean <= 1.0 || 0.5 * p >= SIGNIFICANCE, "{}: {name}: {mean}, p = {p:e}", spec.name);
            let p = chance((mean, variance), (known, 0.0), (picture.freedom, f64::INFINITY), 0.002);
            let text = format!("{}: {name}: {mean} ± {} instead of {known}, p = {p:e}", spec.name, variance.sqrt());
            assert!(p >= SIGNIFICANCE && variance.sqrt() < 0.03, "{text}");
        }
    }
}
