//! Numbers at the edges of what people use, for every registered integrator: every sample is finite, and right where
//! the right value is known.

use crate::support::pictures::{Picture, SIGNIFICANCE, chance, parse, parse_beside, prepare, takes, unbiased};
use lightsieve::integrators::{IntegratorSpec, Params, REGISTRY};
use lightsieve::prepared::PreparedScene;
use lightsieve::ray::Backend;
use lightsieve::render::Estimator;
use std::fmt::Write;

/// Samples per pixel of each of the renders of a picture.
const SPP: u64 = 4;

/// A box with a lamp under its ceiling, of which a test changes a part.
#[derive(Clone)]
struct Box {
    /// Half of the side of the box, in scene units.
    scale: f64,
    /// Place of the middle of the box.
    centre: f64,
    /// Half of the side of the lamp, with a box of half side 1.
    lamp: f64,
    /// Radiance of the lamp.
    radiance: f64,
    /// Place of the camera on the axis, with a box of half side 1.
    camera: f64,
    size: [u32; 2],
    /// Other contents of the box.
    more: String,
}

impl Default for Box {
    fn default() -> Box {
        Box { scale: 1.0, centre: 0.0, lamp: 0.4, radiance: 5.0, camera: 0.9, size: [8, 8], more: String::new() }
    }
}

impl Box {
    fn xml(&self) -> String {
        let Box { scale, centre, lamp, radiance, camera, size: [width, height], more } = self;
        let place = |z: f64| format!("{centre}, {centre}, {}", centre + z * scale);
        format!(
            "<sensor type=\"perspective\"><float name=\"fov\" value=\"60\"/>\
             <float name=\"near_clip\" value=\"{near}\"/><float name=\"far_clip\" value=\"{far}\"/>\
             <transform name=\"to_world\"><lookat origin=\"{from}\" target=\"{to}\" up=\"0, 1, 0\"/></transform>\
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"{width}\"/>\
             <integer name=\"height\" value=\"{height}\"/><rfilter type=\"box\"/></film></sensor>\
             <bsdf type=\"twosided\" id=\"grey\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.5\"/></bsdf></bsdf>\
             <shape type=\"cube\"><transform name=\"to_world\"><scale value=\"{scale}\"/>\
             <translate value=\"{centre}, {centre}, {centre}\"/></transform><ref id=\"grey\"/></shape>\
             <shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"{lamp}\"/><rotate x=\"1\" angle=\"90\"/>\
             <translate y=\"0.9\"/><scale value=\"{scale}\"/><translate value=\"{centre}, {centre}, {centre}\"/></transform>\
             <ref id=\"grey\"/><emitter type=\"area\"><rgb name=\"radiance\" value=\"{radiance:e}\"/></emitter></shape>{more}",
            near = 1e-4 * scale,
            far = 1e4 * scale,
            from = place(*camera),
            to = place(-1.0),
        )
    }

    fn prepared(&self) -> PreparedScene {
        prepare(parse(&self.xml(), &[]), Backend::default_available(), None)
    }
}

fn render(spec: &'static IntegratorSpec, scene: &PreparedScene, seed: u64) -> Picture {
    Picture::render(spec, scene, &[("max_depth", "5")], SPP, seed)
}

/// The mean of a picture is that of another, times a factor.
#[track_caller]
fn assert_same_light(a: &Picture, b: &Picture, factor: f64, tolerance: f64, what: &str) {
    let scaled = (b.whole.0 * factor, b.whole.1 * factor * factor);
    let p = chance(a.whole, scaled, (a.freedom, b.freedom), tolerance);
    assert!(p > SIGNIFICANCE, "{what}: {:?} against {scaled:?}", a.whole);
}

#[test]
fn size_and_distance_from_the_origin() {
    let here = Box::default().prepared();
    for spec in unbiased() {
        let expected = render(spec, &here, 1);
        // Far away, single precision of the file's transforms is not what limits: those are of double precision.
        for (scale, centre) in [(1e-4, 0.0), (1e5, 0.0), (1.0, 1e6), (1e-4, 100.0)] {
            let there = Box { scale, centre, ..Box::default() }.prepared();
            let what = format!("{}: scale {scale}, at {centre}", spec.name);
            assert_same_light(&render(spec, &there, 100), &expected, 1.0, 1e-3, &what);
        }
    }
}

#[test]
fn intensities_over_sixteen_decades() {
    let here = Box::default().prepared();
    for spec in unbiased() {
        let expected = render(spec, &here, 1);
        for factor in [1e-8, 1e8] {
            let scene = Box { radiance: 5.0 * factor, ..Box::default() }.prepared();
            assert_same_light(&render(spec, &scene, 1), &expected, factor, 0.01, &format!("{}: x {factor}", spec.name));
        }
    }
}

#[test]
fn lamps_of_a_billionth() {
    let small = |lamp: f64| Box { lamp, radiance: 1.0 / (lamp * lamp), ..Box::default() }.prepared();
    let (tiny, little) = (small(1e-9), small(1e-3));
    for spec in unbiased() {
        // One path in a million hits the larger lamp; both are lit by next event alone, in effect.
        let what = format!("{}: a lamp of 1e-9", spec.name);
        assert_same_light(&render(spec, &tiny, 1), &render(spec, &little, 200), 1.0, 0.01, &what);
    }
}

#[test]
fn walls_that_reflect_everything() {
    // A closed box whose walls shine with radiance 1 and reflect all light: one for each edge of a path.
    let emission = "<shape type=\"cube\"><boolean name=\"flip_normals\" value=\"true\"/>\
        <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"1\"/></bsdf>\
        <emitter type=\"area\"><rgb name=\"radiance\" value=\"1\"/></emitter></shape>";
    let sensor = "<sensor type=\"perspective\"><transform name=\"to_world\"><lookat origin=\"0, 0, 0.5\" target=\"0, 0, -1\" \
        up=\"0, 1, 0\"/></transform><film type=\"hdrfilm\"><integer name=\"width\" value=\"4\"/>\
        <integer name=\"height\" value=\"4\"/></film></sensor>";
    let scene = prepare(parse(&format!("{sensor}{emission}"), &[]), Backend::default_available(), None);
    for spec in unbiased() {
        for depth in [2, 64] {
            let picture = Picture::render(spec, &scene, &[("max_depth", &depth.to_string())], 2, 1);
            let expected = Picture::constant(f64::from(depth), 16);
            assert_same_light(&picture, &expected, 1.0, 1e-3, &format!("{}: {depth} edges", spec.name));
        }
    }
}

#[test]
fn extreme_materials_and_shapes_are_finite() {
    let ball = |bsdf: &str| {
        format!("<shape type=\"sphere\"><transform name=\"to_world\"><scale value=\"0.4\"/></transform>{bsdf}</shape>")
    };
    let rough = |kind: &str, alpha: f64, ior: &str| {
        ball(&format!("<bsdf type=\"{kind}\"><float name=\"alpha\" value=\"{alpha}\"/>{ior}</bsdf>"))
    };
    let mut scenes: Vec<String> = vec![];
    for alpha in [1e-4, 1e-3, 1.0] {
        scenes.push(rough("roughconductor", alpha, "<string name=\"material\" value=\"Al\"/>"));
        for ior in [1.0, 1.0001, 0.5, 3.0] {
            let ior = format!("<float name=\"int_ior\" value=\"{ior}\"/><float name=\"ext_ior\" value=\"1\"/>");
            scenes.push(rough("roughdielectric", alpha, &ior));
            scenes.push(ball(&format!("<bsdf type=\"dielectric\">{ior}</bsdf>")));
        }
    }
    let sliver = "<shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"0.9\" y=\"9e-7\" z=\"1\"/>\
        <rotate x=\"1\" y=\"2\" z=\"3\" angle=\"37\"/></transform><ref id=\"grey\"/></shape>";
    scenes.push(sliver.into());
    for more in scenes {
        let scene = Box { more: more.clone(), size: [4, 4], ..Box::default() }.prepared();
        for spec in REGISTRY {
            let picture = Picture::render(spec, &scene, &[("max_depth", "6")], 1, 1);
            assert!(picture.whole.0.is_finite() && picture.whole.0 >= 0.0, "{}: {more}", spec.name);
        }
    }
}

#[test]
fn sampling_weights_change_noise_alone() {
    let lamp = |weight: &str| {
        format!(
            "<shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"0.5\"/><translate z=\"-0.9\"/>\
            </transform><ref id=\"grey\"/><emitter type=\"area\"><rgb name=\"radiance\" value=\"2\"/>{weight}</emitter></shape>"
        )
    };
    let weight = |value: f64| format!("<float name=\"sampling_weight\" value=\"{value}\"/>");
    let expected = Box { more: lamp(""), ..Box::default() }.prepared();
    for value in [5.0, 0.0] {
        let scene = Box { more: lamp(&weight(value)), ..Box::default() }.prepared();
        // Light that is never sampled leaves no light sub-path.
        for spec in unbiased().filter(|spec| value > 0.0 || spec.name != "light") {
            let what = format!("{}: weight {value}", spec.name);
            assert_same_light(&render(spec, &scene, 1), &render(spec, &expected, 200), 1.0, 0.01, &what);
        }
    }
}

/// A square emitter of 100,352 triangles, as an OBJ file, in the plane z = 0 from -1 to 1.
fn subdivided_square() -> String {
    const N: usize = 224;
    let mut obj = String::new();
    for i in 0..=N {
        for j in 0..=N {
            let at = |k: usize| 2.0 * k as f64 / N as f64 - 1.0;
            writeln!(obj, "v {} {} 0", at(j), at(i)).unwrap();
        }
    }
    for i in 0..N {
        for j in 0..N {
            let at = |i: usize, j: usize| i * (N + 1) + j + 1;
            writeln!(obj, "f {} {} {} {}", at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)).unwrap();
        }
    }
    obj
}

#[test]
fn a_hundred_thousand_lights() {
    // The box's own lamp is nearly black here: all light is that of the lamp below it.
    let lamp = "<shape type=\"obj\"><string name=\"filename\" value=\"lamp.obj\"/><transform name=\"to_world\">\
        <scale value=\"0.4\"/><rotate x=\"1\" angle=\"90\"/><translate y=\"0.8\"/></transform>\
        <ref id=\"grey\"/><emitter type=\"area\"><rgb name=\"radiance\" value=\"5\"/></emitter></shape>";
    let one = "<shape type=\"rectangle\"><transform name=\"to_world\">\
        <scale value=\"0.4\"/><rotate x=\"1\" angle=\"90\"/><translate y=\"0.8\"/></transform>\
        <ref id=\"grey\"/><emitter type=\"area\"><rgb name=\"radiance\" value=\"5\"/></emitter></shape>";
    let scene = |more: &str, files: &[(&str, &str)]| {
        let xml = Box { radiance: 1e-3, more: more.into(), ..Box::default() }.xml();
        prepare(parse(&xml, files), Backend::default_available(), None)
    };
    let (many, one) = (scene(lamp, &[("lamp.obj", &subdivided_square())]), scene(one, &[]));
    assert!(many.lights.len() > 100_000);
    for spec in unbiased() {
        let what = format!("{}: many lights", spec.name);
        assert_same_light(&render(spec, &many, 1), &render(spec, &one, 200), 1.0, 0.01, &what);
    }
}

#[test]
fn a_texel_of_a_million() {
    // A sky with a texel a million times as bright as the others, over a floor; its mean is known by path tracing.
    let width = 16;
    let mut sky = format!("PF\n{width} 8\n-1.0\n").into_bytes();
    for texel in 0..width * 8 {
        let value: f32 = if texel == 6 * width + 5 { 1e6 } else { 1.0 };
        (0..3).for_each(|_| sky.extend(value.to_le_bytes()));
    }
    let xml = "<sensor type=\"perspective\"><float name=\"fov\" value=\"60\"/><transform name=\"to_world\">\
        <lookat origin=\"0, 3, 3\" target=\"0, 0, 0\" up=\"0, 1, 0\"/></transform>\
        <film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/><integer name=\"height\" value=\"8\"/>\
        <rfilter type=\"box\"/></film></sensor>\
        <shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/><scale value=\"2\"/></transform>\
        <bsdf type=\"roughconductor\"><float name=\"alpha\" value=\"0.5\"/></bsdf></shape>\
        <shape type=\"cube\"><transform name=\"to_world\"><scale value=\"0.4\"/><translate y=\"0.5\"/></transform>\
        <bsdf type=\"diffuse\"/></shape>\
        <emitter type=\"envmap\"><string name=\"filename\" value=\"sky.pfm\"/></emitter>";
    let scene = prepare(parse_beside(xml, &[("sky.pfm", sky)]), Backend::default_available(), None);
    let path = unbiased().find(|spec| spec.name == "path").unwrap();
    let expected = Picture::render(path, &scene, &[("max_depth", "5")], 64, 1000);
    assert!(expected.whole.0 > 100.0, "{:?}", expected.whole);
    for spec in unbiased() {
        let what = format!("{}: a texel of 1e6", spec.name);
        assert_same_light(&render(spec, &scene, 1), &expected, 1.0, 0.01, &what);
    }
}

#[test]
fn cameras_in_glass() {
    let ball = |from: &str| {
        format!(
            "<shape type=\"sphere\"><transform name=\"to_world\"><scale value=\"0.3\"/><translate z=\"{from}\"/></transform>\
             <bsdf type=\"dielectric\"/></shape>"
        )
    };
    let scene = Box { more: ball("0.6"), camera: 0.7, ..Box::default() }.prepared();
    let path = unbiased().find(|spec| spec.name == "path").unwrap();
    let expected = Picture::render(path, &scene, &[("max_depth", "8")], 256, 1000);
    for spec in unbiased().filter(|spec| takes(spec, &scene)) {
        let picture = Picture::render(spec, &scene, &[("max_depth", "8")], 64, 1);
        assert_same_light(&picture, &expected, 1.0, 0.01, &format!("{}: a camera in glass", spec.name));
    }
}

#[test]
fn cameras_on_a_surface_and_in_the_dark() {
    let on_the_wall = Box { camera: 1.0, ..Box::default() }.prepared();
    let dark = "<shape type=\"cube\"><transform name=\"to_world\"><scale value=\"0.05\"/><translate z=\"0.9\"/></transform>\
        <ref id=\"grey\"/></shape>";
    let in_a_box = Box { more: dark.into(), ..Box::default() }.prepared();
    for spec in REGISTRY {
        render(spec, &on_the_wall, 1);
        assert_eq!(render(spec, &in_a_box, 1).whole.0, 0.0, "{}", spec.name);
    }
}

#[test]
fn narrow_films_have_the_light_of_square_ones() {
    for size in [[1, 1], [1, 512], [512, 1]] {
        let scene = Box { size, ..Box::default() }.prepared();
        for spec in unbiased().filter(|spec| takes(spec, &scene)) {
            let picture = Picture::render(spec, &scene, &[("max_depth", "3")], 1, 1);
            assert_eq!(picture.mean.len(), (size[0] * size[1]) as usize);
            assert!(picture.whole.0 > 0.0, "{} {size:?}", spec.name);
        }
    }
}

#[test]
fn many_threads_make_the_same_bits() {
    let scene = Box { size: [20, 20], ..Box::default() }.prepared();
    for spec in REGISTRY {
        let bits = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut params = Params::defaults(spec);
            if spec.has_param("presampled_paths") {
                params.set("presampled_paths", "64").unwrap();
            }
            pool.install(|| {
                let mut estimator = Estimator::new((spec.build)(&params), scene.window, 1);
                for _ in 0..2 {
                    estimator.iterate(&scene);
                }
                estimator.film.mean_f64().as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>()
            })
        };
        assert!(bits(64) == bits(1), "{}", spec.name);
    }
}
