//! Shading normals that lean away from the surface: which side light comes from is decided by them, as in Mitsuba.

use crate::support::pictures::{Picture, SIGNIFICANCE, chance, parse, prepare, unbiased};
use lightsieve::ray::Backend;

/// A sheet in the plane y = 0 whose shading normals lean towards +x, a lamp above it, and one below its plane that only
/// the shading normals face; behind it a wall.
const SCENE: &str = "<sensor type=\"perspective\"><float name=\"fov\" value=\"50\"/><transform name=\"to_world\">\
    <lookat origin=\"0, 2, 2.5\" target=\"0, 0, 0\" up=\"0, 1, 0\"/></transform>\
    <film type=\"hdrfilm\"><integer name=\"width\" value=\"8\"/><integer name=\"height\" value=\"8\"/>\
    <rfilter type=\"box\"/></film></sensor>\
    <bsdf type=\"twosided\" id=\"grey\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.7\"/></bsdf></bsdf>\
    <shape type=\"obj\"><string name=\"filename\" value=\"sheet.obj\"/><ref id=\"grey\"/></shape>\
    <shape type=\"rectangle\"><transform name=\"to_world\"><translate z=\"-1.2\"/></transform><ref id=\"grey\"/></shape>\
    <shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"0.3\"/><rotate x=\"1\" angle=\"90\"/>\
    <translate y=\"1.5\"/></transform><emitter type=\"area\"><rgb name=\"radiance\" value=\"10\"/></emitter></shape>\
    <shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"0.3\"/><rotate y=\"1\" angle=\"-90\"/>\
    <translate x=\"1.6\" y=\"-0.4\"/></transform><emitter type=\"area\"><rgb name=\"radiance\" value=\"BELOW\"/>\
    </emitter></shape>";

const SHEET: &str = "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvn 0.3 0.9 0\nvn 0.7 0.7 0.2\nvn 0.8 0.6 0\nvn 0.5 0.8 -0.2\n\
    f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n";

fn render(below: &str, spp: u64) -> Vec<(&'static str, Picture)> {
    let desc = parse(&SCENE.replace("BELOW", below), &[("sheet.obj", SHEET)]);
    let scene = prepare(desc, Backend::default_available(), None);
    unbiased().map(|spec| (spec.name, Picture::render(spec, &scene, &[("max_depth", "5")], spp, 1))).collect()
}

/// Walks from the camera and from the lights see the same light, that from behind the surface included.
#[test]
fn both_directions_agree_with_each_other_and_with_mitsuba() {
    // Mitsuba 3.9.1, path, max_depth 5, 16 renders of 65,536 samples per pixel: means of the picture and their standard
    // errors, without and with the lower lamp.
    for (below, mean, error) in [("0", 0.078_045, 1.2e-5), ("20", 0.312_89, 2.1e-4)] {
        for (name, picture) in render(below, 64) {
            let p = chance(picture.whole, (mean, error * error), (picture.freedom, 15.0), 1e-3);
            assert!(p > SIGNIFICANCE, "{name}, lower lamp {below}: {:?} against {mean}", picture.whole);
        }
    }
}
