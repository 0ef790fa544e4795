//! Estimators of the same thing agree: integrators, heuristics, backends, crops, instances, formulas, and Mitsuba 3.

use crate::support::gallery::{GALLERY, exhibit, file};
use crate::support::pictures::{Picture, parse, prepare, sampled_by_pixel, takes, unbiased};
use glam::{DMat4, DVec3, EulerRot};
use lightsieve::integrators::{importance, path};
use lightsieve::prepared::PreparedScene;
use lightsieve::ray::Backend;
use lightsieve::scene::{SceneDesc, ShapeDesc};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Samples per pixel and render; the error of most pixels is about one percent.
const SPP: u64 = 64;
/// Comparisons of one integrator that may fail at the first try. Of 10 to 24 comparisons of each integrator, two of
/// `bdpt` do (the scene "instances", which fails against one and the same reference) and two of `importance-caching`,
/// none of the others.
const MAX_REPEATED: usize = 2;
/// Renders that Mitsuba's means are made of.
const MITSUBA_RENDERS: f64 = 32.0;

fn prepared(desc: SceneDesc) -> PreparedScene {
    prepare(desc, Backend::default_available(), None)
}

/// Means and standard errors from Mitsuba 3.9.1.
fn mitsuba(name: &str) -> Picture {
    let text = std::fs::read_to_string(file(name, "txt")).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .map(|l| l.split_whitespace().map(|v| v.parse().unwrap()).collect())
        .collect();
    let three = |at: usize| rows.iter().map(move |r| [r[at], r[at + 1], r[at + 2]]);
    let errors: Vec<[f64; 3]> = three(3).collect();
    let mut picture = Picture::exact(three(0).collect());
    // The channels of a pixel share their paths, so their errors add up; those of different pixels are independent.
    let n = errors.len() as f64;
    picture.whole.1 = errors.iter().map(|e| e.iter().sum::<f64>().powi(2)).sum::<f64>() / (9.0 * n * n);
    picture.variance = errors.into_iter().map(|e| e.map(|e| e * e)).collect();
    picture.freedom = MITSUBA_RENDERS - 1.0;
    picture
}

#[test]
fn the_path_tracer_agrees_with_mitsuba() {
    for name in GALLERY {
        // Balls and tubes are triangles here and formulas there.
        let tolerance = if ["glass", "normals", "principled"].contains(&name) { 0.01 } else { 0.0 };
        let scene = prepared(exhibit(name));
        let ours = Picture::render(&path::SPEC, &scene, &[], SPP, 2);
        // One of very many pixels may differ by chance; what is really different is so at four times the samples.
        if let Some(difference) = ours.difference(&mitsuba(name), tolerance) {
            let closer = Picture::render(&path::SPEC, &scene, &[], 4 * SPP, 1002);
            closer.assert_agrees(&mitsuba(name), tolerance, &format!("{name}: {difference}, and again"));
        }
    }
}

#[test]
fn every_integrator_agrees_with_the_path_tracer() {
    // Comparisons of each integrator that failed at first, and the number of all of its comparisons.
    let mut repeated: BTreeMap<&str, (Vec<String>, usize)> = BTreeMap::new();
    for name in GALLERY {
        let scene = prepared(exhibit(name));
        let power = [("heuristic", "power")];
        // More samples than those of the others: a reference that lacks rare highlights looks surer than it is.
        let reference = Picture::render(&path::SPEC, &scene, &power, 4 * SPP, 100);
        for spec in unbiased().chain([&importance::IMPORTANCE_CACHING]).filter(|s| takes(s, &scene)) {
            for heuristic in ["balance", "power"] {
                if heuristic == "power" && spec.params().all(|p| p.name != "heuristic") {
                    continue;
                }
                let paths = if spec.name == "importance-caching" { "1024" } else { "100" };
                let params = [("heuristic", heuristic), ("paths", paths)];
                // Virtual lights near a surface have no variance to judge by: 1/d² is all that they weigh.
                let tolerance = if spec.name == "importance-caching" { 0.002 } else { 0.0 };
                let picture = Picture::render(spec, &scene, &params, SPP, 250);
                let (failed, compared) = repeated.entry(spec.name).or_default();
                *compared += 1;
                // So many comparisons fail by chance now and then. What is really different is so at four times the
                // samples.
                if let Some(difference) = picture.difference(&reference, tolerance) {
                    failed.push(format!("{name} ({heuristic}): {difference}"));
                    let closer = Picture::render(spec, &scene, &params, 4 * SPP, 1250);
                    let reference = Picture::render(&path::SPEC, &scene, &power, 4 * SPP, 1100);
                    closer.assert_agrees(
                        &reference,
                        tolerance,
                        &format!("{} ({heuristic}): {name}: {difference}, and again", spec.name),
                    );
                }
            }
        }
    }
    for (integrator, (failed, compared)) in &repeated {
        assert!(
            failed.len() <= MAX_REPEATED,
            "{integrator}: {} of {compared} failed at first: {failed:?}",
            failed.len()
        );
    }
}

#[test]
fn backends_agree() {
    for name in GALLERY {
        let pictures = [(Backend::default_available(), 300), (Backend::Obvhs, 400)].map(|(backend, seed)| {
            Picture::render(&path::SPEC, &prepare(exhibit(name), backend, None), &[], SPP, seed)
        });
        pictures[0].assert_agrees(&pictures[1], 0.0, name);
    }
}

#[test]
fn a_crop_is_a_part_of_the_picture() {
    for name in ["delta-lights", "environment", "lens", "room"] {
        let whole = prepared(exhibit(name));
        let window = [2, 3, 5, 4];
        let part = prepare(exhibit(name), Backend::default_available(), Some(window));
        for spec in unbiased().filter(|s| takes(s, &part)) {
            let expected = Picture::render(spec, &whole, &[], SPP, 500).window(whole.film_size[0], window);
            let picture = Picture::render(spec, &part, &[], SPP, 600);
            picture.assert_agrees(&expected, 0.0, &format!("{}: {name}", spec.name));
        }
    }
}

#[test]
fn an_instance_is_its_shapes_in_their_place() {
    let mut flat = exhibit("instances");
    for instance in std::mem::take(&mut flat.instances) {
        for shape in &flat.groups[instance.group.index()].shapes {
            flat.shapes.push(ShapeDesc { to_world: instance.to_world * shape.to_world, ..shape.clone() });
        }
    }
    flat.groups.clear();
    let (placed, flat) = (prepared(exhibit("instances")), prepared(flat));
    assert_eq!((placed.geometry.instances.len(), flat.geometry.instances.len()), (2, 0));
    for spec in unbiased().filter(|s| takes(s, &placed)) {
        let pictures = [(&placed, 700), (&flat, 800)].map(|(scene, seed)| Picture::render(spec, scene, &[], SPP, seed));
        pictures[0].assert_agrees(&pictures[1], 0.0, spec.name);
    }
}

const ALBEDO: f64 = 0.6;

/// A tiny field of view onto the origin of the plane z = 0 of albedo [`ALBEDO`], with a light.
fn lit_plane(light: &str) -> PreparedScene {
    let xml = format!(
        r#"<sensor type="perspective"><float name="fov" value="0.002"/>
        <transform name="to_world"><lookat origin="3, -2, 4" target="0, 0, 0" up="0, 0, 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film>
        </sensor><shape type="rectangle"><transform name="to_world"><scale value="100"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="{ALBEDO}"/></bsdf></shape>{light}"#
    );
    prepared(parse(&xml, &[]))
}

/// Every integrator sees the irradiance `e` on the plane.
fn assert_irradiance(light: &str, e: f64) {
    let scene = lit_plane(light);
    for spec in sampled_by_pixel().filter(|s| takes(s, &scene)) {
        let picture = Picture::render(spec, &scene, &[("max_depth", "2")], SPP, 900);
        picture.assert_agrees(&Picture::constant(ALBEDO * e / PI, 16), 2e-4, &format!("{}: {light}", spec.name));
    }
}

#[test]
fn delta_lights_follow_their_formulas() {
    let p = DVec3::new(0.5, -1.0, 2.0);
    let point = format!(
        r#"<emitter type="point"><point name="position" x="{}" y="{}" z="{}"/><rgb name="intensity" value="3"/></emitter>"#,
        p.x, p.y, p.z
    );
    assert_irradiance(&point, 3.0 * p.z / p.length().powi(3));
    // On the axis, and 15 degrees off it, between a beam width of 10 and a cutoff at 30.
    for (axis, share) in [(DVec3::ZERO, 1.0), (DVec3::new(3.0 * (PI / 12.0).tan(), 0.0, 0.0), 0.75)] {
        let spot = format!(
            r#"<emitter type="spot"><rgb name="intensity" value="5"/><float name="cutoff_angle" value="30"/>
            <float name="beam_width" value="10"/><transform name="to_world">
            <lookat origin="0, 0, 3" target="{}, {}, {}" up="0, 1, 0"/></transform></emitter>"#,
            axis.x, axis.y, axis.z
        );
        assert_irradiance(&spot, 5.0 * share / 9.0);
    }
    let d = DVec3::new(0.3, 0.4, -1.2);
    let parallel = format!(
        r#"<emitter type="directional"><vector name="direction" x="{}" y="{}" z="{}"/><rgb name="irradiance" value="2"/></emitter>"#,
        d.x, d.y, d.z
    );
    assert_irradiance(&parallel, 2.0 * -d.z / d.length());
}

#[test]
fn a_constant_sky_lights_an_open_plane() {
    assert_irradiance(r#"<emitter type="constant"><rgb name="radiance" value="0.7"/></emitter>"#, 0.7 * PI);
}

#[test]
fn a_polygonal_light_follows_lamberts_formula() {
    // A tilted rectangle; irradiance by the contour integral (Lambert 1760; Arvo 1995, "Applications of irradiance
    // tensors", eq. 2.4).
    for (scale, place) in
        [(DVec3::new(0.3, 0.2, 1.0), DVec3::new(0.5, 0.4, 1.5)), (DVec3::ONE, DVec3::new(-0.3, 0.2, 1.2))]
    {
        // The matrix as the file's, row by row.
        let m = DMat4::from_translation(place)
            * DMat4::from_euler(EulerRot::XYZ, PI - 0.3, 0.2, 0.5)
            * DMat4::from_scale(scale);
        let rows: Vec<String> = m.transpose().to_cols_array().iter().map(f64::to_string).collect();
        let light = format!(
            r#"<shape type="rectangle"><transform name="to_world"><matrix value="{}"/></transform>
            <emitter type="area"><rgb name="radiance" value="4"/></emitter></shape>"#,
            rows.join(" ")
        );
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| m.transform_point3(DVec3::new(x, y, 0.0)).normalize());
        let edges = (0..4).map(|i| (corners[i], corners[(i + 1) % 4]));
        let sum: f64 = edges.map(|(a, b)| a.angle_between(b) * a.cross(b).normalize().z).sum();
        assert_irradiance(&light, 4.0 * 0.5 * sum.abs());
    }
}

#[test]
fn a_pixel_is_covered_by_its_share() {
    // A square light of half side 0.6 at distance 4 in a picture of 8 pixels that spans 40 degrees.
    let xml = r#"<sensor type="perspective"><float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film>
        </sensor><shape type="rectangle"><transform name="to_world"><scale value="0.6"/></transform>
        <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#;
    let scene = prepared(parse(xml, &[]));
    let half = 4.0 * 0.6 / (4.0 * (PI / 9.0).tan());
    let share = |i: usize| ((i as f64 + 1.0).min(4.0 + half) - (i as f64).max(4.0 - half)).max(0.0);
    let exact = Picture::exact((0..64).map(|i| [share(i / 8) * share(i % 8); 3]).collect());
    for spec in unbiased().filter(|s| takes(s, &scene)) {
        Picture::render(spec, &scene, &[], SPP, 1000).assert_agrees(&exact, 0.0, spec.name);
    }
}
