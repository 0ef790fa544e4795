//! Objects that stand in the scene with an id and are referred to from where they belong.

use super::*;

const LIGHT: &str = "<emitter type=\"area\" id=\"glow\"><rgb name=\"radiance\" value=\"1, 2, 3\"/></emitter>";

#[test]
fn area_lights_may_stand_in_the_scene() {
    for inside in [
        format!("{LIGHT}<shape type=\"rectangle\" id=\"lamp\"><ref id=\"glow\"/></shape>"),
        format!("<shape type=\"rectangle\" id=\"lamp\"><ref name=\"emitter\" id=\"glow\"/></shape>{LIGHT}"),
        format!("{LIGHT}<alias id=\"glow\" as=\"g\"/><shape type=\"disk\" id=\"lamp\"><ref id=\"g\"/></shape>"),
    ] {
        let s = good(&inside);
        let lamp = s.shapes.iter().find(|s| s.name.as_deref() == Some("lamp")).unwrap();
        let radiance = lamp.emission.as_ref().unwrap().radiance;
        assert_eq!(radiance, ColorDesc::Constant(Rgb::new(1.0, 2.0, 3.0)), "{inside}");
        // The other light is the one that every scene here has.
        assert_eq!(s.emitters.len(), 1, "{inside}");
    }
    // One that no shape refers to is a mistake, and the only one.
    assert_eq!(messages(load(&scene(LIGHT))), [("scene::misplaced-element", 2, 1)]);
}

/// As in Mitsuba 3.9.1: what is referred to is a part of the scene; a shape that is one already is so once, a light of its
/// own shines twice.
#[test]
fn references_in_the_scene_place_what_they_name() {
    let group = "<shape type=\"shapegroup\" id=\"g\"><shape type=\"sphere\" id=\"ball\"/></shape>";
    assert_eq!(good(group).shapes.len(), 1);
    assert_eq!(good(&format!("{group}<ref id=\"ball\"/>")).shapes[1].name.as_deref(), Some("ball"));
    assert_eq!(good(&format!("<ref id=\"ball\"/>{group}")).shapes.len(), 2);
    for part in
        ["<shape type=\"disk\" id=\"x\"/>", "<shape type=\"shapegroup\" id=\"x\"><shape type=\"disk\"/></shape>"]
    {
        assert_eq!(good(&format!("{part}<ref id=\"x\"/>")).shapes.len(), good(part).shapes.len(), "{part}");
    }
    assert_eq!(good("<emitter type=\"point\" id=\"x\"/><ref id=\"x\"/>").emitters.len(), 3);
    let lamp = format!("<shape type=\"rectangle\">{LIGHT}</shape><ref id=\"glow\"/>");
    assert_eq!((good(&lamp).emitters.len(), good(&lamp).shapes.len()), (1, 2));
    assert_eq!(good("<bsdf type=\"diffuse\" id=\"x\"/><ref id=\"x\"/>").bsdfs.len(), 1);
    assert_eq!(messages(load(&scene("<ref id=\"nobody\"/>"))), [("scene::undefined-reference", 2, 10)]);
    // A light on no surface is one of no shape that a reference in the scene could help.
    assert_eq!(messages(load(&scene(&format!("{LIGHT}<ref id=\"glow\"/>")))), [("scene::misplaced-element", 2, 1)]);
}

#[test]
fn films_samplers_and_filters_may_stand_in_the_scene() {
    let declared = "<rfilter type=\"tent\" id=\"f\"><float name=\"radius\" value=\"2\"/></rfilter>\
        <film type=\"hdrfilm\" id=\"p\"><integer name=\"width\" value=\"12\"/><ref id=\"f\"/></film>\
        <sampler type=\"multijitter\" id=\"s\"><integer name=\"sample_count\" value=\"9\"/></sampler>";
    let s = good(&format!(
        "{declared}<sensor type=\"perspective\"><ref id=\"p\"/><ref id=\"s\"/></sensor>\
         <sensor type=\"perspective\"><ref name=\"film\" id=\"p\"/></sensor>"
    ));
    for sensor in &s.sensors[1..] {
        assert_eq!((sensor.film.width, sensor.film.filter), (12, FilterDesc::Tent { radius: 2.0 }));
    }
    assert_eq!((s.sensors[1].sample_count, s.sensors[2].sample_count), (Some(9), None));
}

#[test]
fn a_slip_in_an_object_that_several_share_is_said_once() {
    let film = "<film type=\"hdrfilm\" id=\"p\"><integer name=\"widht\" value=\"12\"/></film>";
    let inside = format!("{film}{}", "<sensor type=\"perspective\"><ref id=\"p\"/></sensor>".repeat(3));
    assert_eq!(messages(load(&scene(&inside))), [("scene::unknown-property", 2, 44)]);
    // Also where nobody refers to it.
    assert_eq!(messages(load(&scene(film))), [("scene::unknown-property", 2, 44)]);
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property float r\nproperty float g\nproperty float b\nelement face 1\nproperty list uchar int vertex_indices\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n\
    0 0 0 0.1 0.2 0.3\n1 0 0 0.4 0.5 0.6\n1 1 0 0.7 0.8 0.9\n0 1 0 1 1 1\n4 0 1 2 3 255 0 255\n";

fn attribute(name: &str) -> String {
    format!("<texture name=\"reflectance\" type=\"mesh_attribute\"><string name=\"name\" value=\"{name}\"/></texture>")
}

/// A PLY file with a material that looks up an attribute of the mesh, given in the shape or by reference.
fn with_attribute(name: &str, ply: &str) -> Result<(SceneDesc, Diagnostics), LoadFailure> {
    let shape = format!(
        "<bsdf type=\"twosided\" id=\"m\"><bsdf type=\"diffuse\">{}</bsdf></bsdf><shape type=\"ply\">\
         <string name=\"filename\" value=\"a.ply\"/><ref id=\"m\"/></shape>",
        attribute(name)
    );
    Files::new(&[("s.xml", &scene(&shape)), ("a.ply", ply)]).load(&LoadOptions::default())
}

#[test]
fn attributes_of_vertices_and_faces_are_the_colors_of_the_mesh() {
    let (s, _) = with_attribute("vertex_color", PLY).unwrap();
    let mesh = &s.meshes[1];
    assert_eq!((mesh.positions.len(), mesh.colors[2]), (4, Rgb::new(0.7, 0.8, 0.9)));
    let (s, _) = with_attribute("face_color", PLY).unwrap();
    let mesh = &s.meshes[1];
    assert_eq!(mesh.colors, [Rgb::new(1.0, 0.0, 1.0); 6]);
    assert_eq!((mesh.positions.len(), mesh.normals.len(), mesh.triangles.len()), (6, 6, 2));
    assert_eq!(mesh.triangles[1].map(|i| mesh.positions[i as usize].y), [0.0, 1.0, 1.0]);
    assert!(matches!(s.textures[0], TextureDesc::MeshAttribute { scale: 1.0 }));
}

#[test]
fn attributes_that_cannot_be_had_are_errors() {
    let code = |result: Result<(SceneDesc, Diagnostics), LoadFailure>| messages(result)[0].0;
    let plain = PLY.replace(
        "property float r\nproperty float g\nproperty float b\n",
        "property float p\nproperty float q\nproperty float s\n",
    );
    assert_eq!(code(with_attribute("vertex_color", &plain)), "load::missing-attribute");
    assert_eq!(
        code(with_attribute("face_color", &PLY.replace("uchar green", "uchar grun"))),
        "load::missing-attribute"
    );
    assert_eq!(code(with_attribute("vertex_velocity", PLY)), "scene::bad-value");
    // A sphere has none, a light and a bump map cannot look any up.
    for inside in [
        format!("<shape type=\"sphere\"><bsdf type=\"diffuse\">{}</bsdf></shape>", attribute("face_color")),
        format!(
            "<shape type=\"disk\"><emitter type=\"area\">{}</emitter></shape>",
            attribute("vertex_color").replace("reflectance", "radiance")
        ),
        format!(
            "<bsdf type=\"bumpmap\">{}<bsdf type=\"diffuse\"/></bsdf>",
            attribute("vertex_color").replace("reflectance", "map")
        ),
    ] {
        let e = load(&scene(&inside)).unwrap_err();
        assert!(
            ["load::missing-attribute", "scene::unsupported"].contains(&e.diagnostics.list[0].code),
            "{inside}: {e}"
        );
    }
}

#[test]
fn sampling_weights_do_not_change_the_picture_except_that_none_is_dark() {
    let point = |w: &str| format!("<emitter type=\"point\"><float name=\"sampling_weight\" value=\"{w}\"/></emitter>");
    assert_eq!(good(&point("0.5")).emitters.len(), 2);
    let (s, found) = load(&scene(&point("0"))).unwrap();
    assert_eq!((s.emitters.len(), found.list[0].code), (1, "scene::dark-emitter"));
    assert_eq!(messages(load(&scene(&point("-1"))))[0].0, "scene::bad-value");
    let area = point("0").replace("point", "area");
    let s = good(&format!("<shape type=\"disk\">{area}</shape>"));
    assert!(s.shapes[1].emission.is_some());
}

#[test]
fn axes_of_rotations_that_are_no_unit_vectors_are_said() {
    let rotated = |version: &str, axis: &str| {
        let inside = format!(
            "<shape type=\"cube\"><transform name=\"to_world\"><rotate {axis} angle=\"60\"/></transform></shape>"
        );
        let (s, found) = load(&scene(&inside).replacen("3.0.0", version, 1)).unwrap();
        (s.shapes[1].to_world, found.list.iter().map(|d| d.code).collect::<Vec<_>>())
    };
    let (unit, said) = rotated("3.0.0", "y=\"0.70710678\" z=\"0.70710678\"");
    assert!(said.is_empty());
    let (long, said) = rotated("3.0.0", "y=\"1\" z=\"1\"");
    assert!(said == ["scene::rotation-axis"] && (0..4).all(|i| (unit.col(i) - long.col(i)).length() < 1e-7));
    // Mitsuba 0.6 normalizes.
    assert!(rotated("0.6.0", "y=\"1\" z=\"1\"").1.is_empty());
}
