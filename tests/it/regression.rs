//! Traps that other renderers fell into (pbrt-v3 issue 229, pbrt-v4 issue 347 and others), and bugs found here: one
//! test each.

use crate::support::pictures::{Picture, parse, prepare, sampled_by_pixel, takes, unbiased};
use lightsieve::ray::Backend;

/// A camera above the plane z = 0.
fn camera(width: u32, height: u32, filter: &str) -> String {
    format!(
        r#"<sensor type="perspective"><float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/>
        <rfilter type="{filter}"/></film></sensor>"#
    )
}

/// A big floor.
const FLOOR: &str = r#"<shape type="rectangle"><transform name="to_world"><scale value="9"/><translate z="-1"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>"#;

/// A square of side 2 at z = 0 that winds around +z and has these vertex normals.
fn square(normal: Option<&str>) -> String {
    let corners = ["-1 -1 0", "1 -1 0", "1 1 0", "-1 1 0"];
    let properties = if normal.is_some() { "property float nx\nproperty float ny\nproperty float nz\n" } else { "" };
    let vertices: Vec<String> = corners.iter().map(|c| format!("{c} {}\n", normal.unwrap_or(""))).collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{properties}\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n{}3 0 1 2\n3 0 2 3\n",
        vertices.concat()
    )
}

/// A square light seen from +z and −z: which side shines?
fn shining_sides(mesh: &str, scale: [i32; 3]) -> [bool; 2] {
    ["3", "-3"].map(|z| {
        let [x, y, w] = scale;
        let xml = format!(
            r#"<sensor type="perspective"><float name="fov" value="5"/>
            <transform name="to_world"><lookat origin="0, 0, {z}" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
            <shape type="ply"><string name="filename" value="square.ply"/>
            <transform name="to_world"><scale x="{x}" y="{y}" z="{w}"/></transform>
            <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#
        );
        let scene = prepare(parse(&xml, &[("square.ply", mesh)]), Backend::default_available(), None);
        let seen: Vec<bool> = sampled_by_pixel()
            .filter(|s| takes(s, &scene))
            .map(|spec| {
                let picture = Picture::render(spec, &scene, &[], 8, 1);
                if picture.whole.0 > 0.5 {
                    picture.assert_agrees(&Picture::constant(1.0, 16), 0.0, spec.name);
                    true
                } else {
                    picture.assert_agrees(&Picture::constant(0.0, 16), 0.0, spec.name);
                    false
                }
            })
            .collect();
        assert!(seen.iter().all(|&s| s == seen[0]));
        seen[0]
    })
}

#[test]
fn a_mirrored_light_shines_where_its_normals_point() {
    let (up, down, none) = (square(Some("0 0 1")), square(Some("0 0 -1")), square(None));
    const UP: [bool; 2] = [true, false];
    const DOWN: [bool; 2] = [false, true];
    // As in Mitsuba 3.9.1: normals are mapped as normals; without them, the corners' winding after the map counts.
    for (scale, front, back, wound) in [
        ([1, 1, 1], UP, DOWN, UP),
        ([-1, 1, 1], UP, DOWN, DOWN),
        ([1, 1, -1], DOWN, UP, UP),
        ([-1, -1, -1], DOWN, UP, UP),
    ] {
        assert_eq!(shining_sides(&up, scale), front, "{scale:?}");
        assert_eq!(shining_sides(&down, scale), back, "{scale:?}");
        assert_eq!(shining_sides(&none, scale), wound, "{scale:?}, without normals");
    }
}

#[test]
fn a_crop_window_keeps_the_brightness() {
    let light = r#"<emitter type="point"><point name="position" x="0" y="0" z="1"/></emitter>"#;
    let xml = camera(12, 12, "box") + FLOOR + light;
    let whole = prepare(parse(&xml, &[]), Backend::default_available(), None);
    for spec in sampled_by_pixel().filter(|s| takes(s, &whole)) {
        let all = Picture::render(spec, &whole, &[], 64, 1);
        for crop in [[0, 0, 6, 6], [6, 6, 6, 6], [3, 5, 1, 1], [11, 0, 1, 12]] {
            let part = prepare(parse(&xml, &[]), Backend::default_available(), Some(crop));
            let picture = Picture::render(spec, &part, &[], 64, 100);
            let expected = all.window(12, crop);
            assert_eq!(picture.mean.len(), expected.mean.len());
            picture.assert_agrees(&expected, 0.0, &format!("{}: {crop:?}", spec.name));
        }
    }
}

#[test]
fn triangles_without_area_emit_nothing() {
    let clean = square(Some("0 0 -1"));
    let degenerate = clean.replace("element face 2", "element face 5") + "3 0 0 1\n3 2 2 2\n3 0 1 1\n";
    let light = r#"<shape type="ply"><string name="filename" value="square.ply"/><transform name="to_world">
        <scale value="0.5"/><translate x="2" z="1"/></transform>
        <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>"#;
    let xml = camera(8, 8, "box") + FLOOR + light;
    let scenes = [&clean, &degenerate]
        .map(|mesh| prepare(parse(&xml, &[("square.ply", mesh)]), Backend::default_available(), None));
    for spec in unbiased().filter(|s| takes(s, &scenes[0])) {
        let pictures = [0, 1].map(|i| Picture::render(spec, &scenes[i], &[], 64, 1 + 100 * i as u64));
        assert!(pictures[0].whole.0 > 0.01);
        pictures[0].assert_agrees(&pictures[1], 0.0, spec.name);
    }
}

#[test]
fn lights_without_power_are_no_lights() {
    let dark = r#"<emitter type="point"><point name="position" x="1" y="0" z="1"/><rgb name="intensity" value="0"/></emitter>
        <emitter type="directional"><vector name="direction" value="0, 0, -1"/><rgb name="irradiance" value="0"/></emitter>
        <emitter type="constant"><rgb name="radiance" value="0"/></emitter>
        <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><translate x="2" z="2"/></transform>
            <emitter type="area"><rgb name="radiance" value="0"/></emitter></shape>"#;
    let lamp = r#"<emitter type="point"><point name="position" x="0" y="0.5" z="1"/></emitter>"#;
    // A lamp in a closed box reaches nobody: renders end, black.
    let enclosed = r#"<shape type="sphere"><transform name="to_world"><scale value="0.1"/></transform>
            <emitter type="area"><rgb name="radiance" value="9"/></emitter></shape>
        <shape type="cube"><transform name="to_world"><scale value="0.3"/></transform></shape>"#;
    let build =
        |lights: &str| prepare(parse(&(camera(8, 8, "box") + FLOOR + lights), &[]), Backend::default_available(), None);
    for (what, lights) in [("none", ""), ("dark", dark), ("enclosed", enclosed)] {
        let scene = build(lights);
        for spec in unbiased().filter(|s| takes(s, &scene)) {
            let picture = Picture::render(spec, &scene, &[], 16, 1);
            picture.assert_agrees(&Picture::constant(0.0, 64), 0.0, &format!("{}: {what}", spec.name));
        }
    }
    // Beside a real light they change nothing.
    let scenes = [build(lamp), build(&format!("{lamp}{dark}"))];
    for spec in unbiased().filter(|s| takes(s, &scenes[1])) {
        let pictures = [0, 1].map(|i| Picture::render(spec, &scenes[i], &[], 64, 1 + 100 * i as u64));
        assert!(pictures[0].whole.0 > 0.01);
        pictures[0].assert_agrees(&pictures[1], 0.0, spec.name);
    }
}

#[test]
fn no_sample_is_lost_at_the_border() {
    // Odd sizes, tiles cut short, filters that reach beyond the picture: a white world is white everywhere.
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
        <shape type="cube"><transform name="to_world"><translate z="9"/></transform></shape>"#;
    for (width, height) in [(1, 1), (17, 1), (1, 33), (31, 18)] {
        for filter in ["box", "tent", "gaussian", "mitchell"] {
            let xml = camera(width, height, filter) + sky;
            let scene = prepare(parse(&xml, &[]), Backend::default_available(), None);
            for spec in sampled_by_pixel().filter(|s| takes(s, &scene)) {
                let picture = Picture::render(spec, &scene, &[], 16, 1);
                let exact = Picture::constant(1.0, (width * height) as usize);
                picture.assert_agrees(&exact, 0.0, &format!("{}: {width} x {height}, {filter}", spec.name));
            }
        }
    }
}

/// Random numbers of exactly zero (one in 2^23) fall on the rim of a filter whose density begins at zero.
#[test]
fn the_rim_of_a_pixel_filter_is_finite() {
    use lightsieve::emit::PixelFilter;
    use lightsieve::scene::FilterDesc;
    let last = 1.0 - f32::EPSILON / 2.0;
    for desc in [
        FilterDesc::Box,
        FilterDesc::Tent { radius: 1.0 },
        FilterDesc::Gaussian { stddev: 0.5 },
        FilterDesc::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
    ] {
        let filter = PixelFilter::new(desc);
        for u in [[0.0, 0.0], [0.0, 0.5], [0.5, 0.0], [last, last], [f32::MIN_POSITIVE, last]] {
            let (offset, weight) = filter.sample(u);
            assert!(offset[0].is_finite() && offset[1].is_finite() && weight.is_finite(), "{desc:?} {u:?}");
            assert!(offset[0].abs() <= filter.radius() && offset[1].abs() <= filter.radius(), "{desc:?} {u:?}");
        }
    }
}

/// The two faces of a thin sheet, a quarter of a millimetre apart some metres from the origin, both count. (Mitsuba
/// 3.9.1 starts the next ray beyond the second face, a third of a millimetre off: there, such a sheet lets 1 − opacity
/// through, not its square.)
#[test]
fn the_second_face_of_a_thin_sheet_is_not_skipped() {
    let sheet = |z: f32| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="9"/><translate x="3" z="{z}"/></transform>
            <bsdf type="mask"><rgb name="opacity" value="0.5"/>
            <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></bsdf></shape>"#
        )
    };
    for gap in [1e-2, 2.6e-4, 1e-5] {
        let xml = format!(
            r#"<sensor type="perspective"><float name="fov" value="5"/>
            <transform name="to_world"><lookat origin="3, 0, 2" target="3, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film></sensor>
            {}{}<shape type="rectangle"><transform name="to_world"><scale value="9"/><translate z="-2"/></transform>
            <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#,
            sheet(0.0),
            sheet(-gap)
        );
        let scene = prepare(parse(&xml, &[]), Backend::default_available(), None);
        for spec in unbiased().filter(|s| takes(s, &scene)) {
            let picture = Picture::render(spec, &scene, &[], 1024, 1);
            // Few light sub-paths begin where the camera looks: light tracing has more noise.
            let tolerance = 4.0 * picture.whole.1.sqrt() + 0.005;
            assert!((picture.whole.0 - 0.25).abs() < tolerance, "{} {gap}: {:?}", spec.name, picture.whole);
        }
    }
}
