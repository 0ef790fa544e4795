//! The crate `tobj` as a second reader of OBJ and MTL: both must give the same triangles, texture coordinates, normals,
//! colours and materials wherever both accept a file, except that `tobj` makes fans of all polygons. Where they differ by intention, a test states what either does.

use super::super::obj_material::{self, Mtl};
use super::super::obj_scene::by_material;
use super::*;
use proptest::prelude::*;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};

#[derive(Clone, Copy, Debug, PartialEq)]
struct Vertex {
    position: Vec3,
    uv: Option<Vec2>,
    normal: Option<Vec3>,
    color: Option<[f32; 3]>,
}

#[derive(Clone, Debug, PartialEq)]
struct Triangle {
    /// Name of a material, if the library has it.
    material: Option<String>,
    vertices: [Vertex; 3],
}

/// The result of a reader.
#[derive(Debug, PartialEq)]
struct Reading {
    /// In the order of the file.
    triangles: Vec<Triangle>,
    /// Number of distinct vertices.
    vertices: usize,
}

impl Reading {
    fn materials(&self) -> Vec<&str> {
        self.triangles.iter().map(|t| t.material.as_deref().unwrap_or("-")).collect()
    }
}

/// Reads with lightsieve; `mtl` is the contents of every library.
fn ours(obj: &[u8], mtl: &[u8]) -> Result<Reading, String> {
    let file = parse(obj).map_err(|e| e.to_string())?;
    let known: Vec<String> = match file.libraries.as_slice() {
        [] => Vec::new(),
        _ => materials_of(mtl)?.into_iter().map(|m| m.name).collect(),
    };
    let mut material = vec![None; file.triangles.len()];
    for group in by_material(&file) {
        for triangle in group.triangles.into_iter().flatten() {
            material[triangle] = Some(group.name.clone()).filter(|name| known.contains(name));
        }
    }
    let mesh = mesh_of(&file, &file.triangles);
    let vertex = |i: u32| {
        let i = i as usize;
        let (uv, normal) = (mesh.uvs.get(i).copied(), mesh.normals.get(i).copied());
        Vertex { position: mesh.positions[i], uv, normal, color: mesh.colors.get(i).map(|c| c.to_array()) }
    };
    let triangles = mesh.triangles.iter().zip(material);
    let triangles = triangles.map(|(t, material)| Triangle { material, vertices: t.map(vertex) }).collect();
    Ok(Reading { triangles, vertices: mesh.positions.len() })
}

fn materials_of(mtl: &[u8]) -> Result<Vec<Mtl>, String> {
    obj_material::parse(mtl).map(|(materials, _)| materials).map_err(|e| e.to_string())
}

/// How `tobj` numbers the corners of its triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Indexing {
    /// One index for all of a corner.
    Single,
    /// One each for position, texture coordinate and normal.
    Separate,
}

/// Reads with `tobj`; a panic counts as an error.
fn theirs(obj: &[u8], mtl: &[u8], indexing: Indexing) -> Result<Reading, String> {
    let single_index = indexing == Indexing::Single;
    let options = tobj::LoadOptions { single_index, triangulate: true, ignore_points: true, ignore_lines: true };
    let load = || tobj::load_obj_buf(&mut &*obj, &options, |_| tobj::load_mtl_buf(&mut &*mtl));
    let loaded = catch_unwind(AssertUnwindSafe(load)).map_err(|_| "panic")?;
    let (models, materials) = loaded.map_err(|e| e.to_string())?;
    let materials = materials.unwrap_or_default();
    let mut reading = Reading { triangles: Vec::new(), vertices: 0 };
    for model in &models {
        let material = model.mesh.material_id.map(|id| materials[id].name.clone());
        let corners: Vec<Vertex> =
            (0..model.mesh.indices.len()).map(|i| their_vertex(&model.mesh, i, indexing)).collect();
        for vertices in corners.as_chunks().0 {
            reading.triangles.push(Triangle { material: material.clone(), vertices: *vertices });
        }
        reading.vertices += model.mesh.positions.len() / 3;
    }
    Ok(reading)
}

fn their_vertex(mesh: &tobj::Mesh, corner: usize, indexing: Indexing) -> Vertex {
    let (uv_indices, normal_indices) = match indexing {
        Indexing::Single => (&mesh.indices, &mesh.indices),
        Indexing::Separate => (&mesh.texcoord_indices, &mesh.normal_indices),
    };
    let at = |indices: &[u32]| indices.get(corner).map(|&i| i as usize);
    let three = |values: &[f32], i: usize| values.as_chunks::<3>().0.get(i).copied();
    let position = mesh.indices[corner] as usize;
    Vertex {
        position: three(&mesh.positions, position).map(Vec3::from).unwrap(),
        uv: at(uv_indices).and_then(|i| mesh.texcoords.as_chunks::<2>().0.get(i)).copied().map(Vec2::from),
        normal: at(normal_indices).and_then(|i| three(&mesh.normals, i)).map(Vec3::from),
        color: three(&mesh.vertex_color, position),
    }
}

/// Asserts that both readers accept a file and agree on it, and returns what they read.
fn agreed(obj: &[u8], mtl: &[u8]) -> Reading {
    let text = String::from_utf8_lossy(obj);
    let reading = ours(obj, mtl).unwrap_or_else(|e| panic!("{e}\n{text}"));
    for indexing in [Indexing::Single, Indexing::Separate] {
        let other = theirs(obj, mtl, indexing).unwrap_or_else(|e| panic!("tobj, {indexing:?}: {e}\n{text}"));
        assert_eq!(reading.triangles, other.triangles, "{indexing:?}\n{text}");
    }
    reading
}

mod differences;
mod generated;

const MTL: &[u8] = b"newmtl red\nKd 1 0 0\nnewmtl old brick\nKd 0.5 0.2 0.1\n";
const FOUR: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\n";

#[test]
fn corners_of_every_form_agree() {
    let attributes = format!("{FOUR}vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\n");
    for (faces, triangles) in [
        ("f 1 2 3\n", 1),
        ("f 1 2 3 4\n", 2),
        ("f -4 -3 -2 -1", 2),
        ("f 1 2 3 4 1 2 3\nf 4 3 2 1\n", 7),
        ("s 1\nf\t1  2 3 \r\ns off\r\nf 2 3\t4\r\n\r\n", 2),
        ("p 1\nf 1\nf 1 2\nl 1 2\nf 1 2 3\n", 1),
    ] {
        assert_eq!(agreed(format!("{FOUR}{faces}").as_bytes(), MTL).triangles.len(), triangles, "{faces}");
    }
    for (faces, triangles) in [
        ("f 1/1/1 2/2/2 3/3/1 4/1/2\n", 2),
        ("f -4/-3/-2 -3/-2/-1 -2/-1/-2\nf 1/1/1 3/3/2 4/2/1\n", 2),
        ("f 1/1/1 2/1/1 3/1/1\nv 9 9 9\nvt 5 5\nvn 1 0 0\nf -1/-1/-1 -2/-2/-2 -3/-3/-3\n", 2),
    ] {
        assert_eq!(agreed(format!("{attributes}{faces}").as_bytes(), MTL).triangles.len(), triangles, "{faces}");
    }
    let normals_only = agreed(format!("{FOUR}vn 0 0 1\nf 1//1 2//1 3//1 4//-1\n").as_bytes(), MTL);
    assert!(
        normals_only.triangles[1].vertices[2]
            == Vertex { normal: Some(Vec3::Z), uv: None, ..normals_only.triangles[1].vertices[2] }
    );
    let uvs_only = agreed(format!("{FOUR}vt 0.25 0.75 0\nf 1/1 2/1 3/-1\n").as_bytes(), MTL);
    assert_eq!(uvs_only.triangles[0].vertices[0].uv, Some(Vec2::new(0.25, 0.75)));
}

#[test]
fn numbers_and_colors_agree() {
    let text = "v +1e2 -.5 5.\nv 1E-3 0001 -0\nv 3.4028235e38 1e-45 0.1\nf 1 2 3\n";
    let reading = agreed(text.as_bytes(), MTL);
    assert_eq!(reading.triangles[0].vertices[0].position, Vec3::new(100.0, -0.5, 5.0));
    let text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1e-2\nf 3 2 1\n";
    let reading = agreed(text.as_bytes(), MTL);
    assert_eq!(reading.triangles[0].vertices[0].color, Some([0.0, 0.0, 0.01]));
}

#[test]
fn materials_agree() {
    let text = format!(
        "{FOUR}f 1 2 3\nmtllib some library.mtl\no one\nusemtl red\nf 1 2 4\ng two\nf 1 3 4\nusemtl  old brick \n\
         f 2 3 4\no three\nf 4 3 2\nusemtl unheard of\nf 4 2 1\nusemtl red\nf 3 2 1\n"
    );
    let reading = agreed(text.as_bytes(), MTL);
    assert_eq!(reading.materials(), ["-", "red", "red", "old brick", "old brick", "-", "red"]);
}
