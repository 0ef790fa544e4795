//! Vertex normals that are made anew with `max_smooth_angle`, and those that are dropped with `face_normals`.

use super::*;

/// A roof of two squares that meet at 60 degrees in the edge from (0, 0, 0) to (0, 1, 0), with smooth normals.
const ROOF: &str = "v 0 0 0\nv 0 1 0\nv 1 1 -0.577350\nv 1 0 -0.577350\nv -1 1 -0.577350\nv -1 0 -0.577350\n\
    vn 0 0 1\nf 1//1 4//1 3//1 2//1\nf 1//1 2//1 5//1 6//1\n";

/// Normals of the roof's corners on its ridge, one for each triangle's corner there; `None` if the mesh has no normals.
fn ridge(properties: &str) -> Option<Vec<glam::Vec3>> {
    let shape = format!("<shape type=\"obj\"><string name=\"filename\" value=\"roof.obj\"/>{properties}</shape>");
    let files = Files::new(&[("s.xml", &scene(&shape)), ("roof.obj", ROOF)]);
    let (scene, found) = files.load(&LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(found.list.is_empty(), "{}", found.list[0].message);
    let mesh = scene.meshes.iter().find(|m| m.triangles.len() == 4).unwrap();
    let at = |i: u32| (mesh.positions[i as usize].x == 0.0).then(|| mesh.normals[i as usize]);
    (!mesh.normals.is_empty()).then(|| mesh.triangles.iter().flatten().filter_map(|&i| at(i)).collect())
}

#[test]
fn creases_sharper_than_the_angle_stay() {
    let angle = |degrees: f32| ridge(&format!("<float name=\"max_smooth_angle\" value=\"{degrees}\"/>")).unwrap();
    assert!(ridge("").unwrap().iter().all(|n| *n == glam::Vec3::Z), "the file's own");
    for normal in angle(61.0) {
        assert!((normal - glam::Vec3::Z).length() < 1e-5, "{normal}");
    }
    for normal in angle(59.0) {
        assert!((normal.x.abs() - 0.5).abs() < 1e-5 && (normal.z - 0.866_025).abs() < 1e-5, "{normal}");
    }
    assert_eq!(ridge("<boolean name=\"face_normals\" value=\"true\"/>"), None);
}

#[test]
fn both_ways_to_make_normals_exclude_each_other() {
    let shape = "<shape type=\"obj\"><string name=\"filename\" value=\"roof.obj\"/>\
        <boolean name=\"face_normals\" value=\"true\"/><float name=\"max_smooth_angle\" value=\"30\"/></shape>";
    let found = |shape: &str| {
        messages(Files::new(&[("s.xml", &scene(shape)), ("roof.obj", ROOF)]).load(&LoadOptions::default()))
    };
    assert_eq!(found(shape), [("scene::bad-value", 2, 1)]);
    let negative = "<shape type=\"obj\"><string name=\"filename\" value=\"roof.obj\"/>\n\
        <float name=\"max_smooth_angle\" value=\"-1\"/></shape>";
    assert_eq!(found(negative), [("scene::bad-value", 3, 39)]);
    // The property belongs to meshes.
    let cube = "<shape type=\"cube\">\n<float name=\"max_smooth_angle\" value=\"30\"/></shape>";
    assert_eq!(found(cube), [("scene::unknown-property", 3, 14)]);
}
