use super::*;
use crate::math::Rgb;
use glam::{Vec2, Vec3};
use proptest::prelude::*;

fn parse(bytes: &[u8]) -> Result<LoadedMesh, MeshError> {
    parse_ply(bytes, bytes.len() as u64, MeshOptions::default()).map(|parsed| parsed.loaded)
}

fn message(bytes: &[u8]) -> String {
    parse(bytes).unwrap_err().to_string()
}

const ASCII: &str = "ply\nformat ascii 1.0\ncomment two faces\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
    property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n4 0 1 2 3\n3 0 1 4\n";

#[test]
fn convex_polygons_become_fans() {
    let m = parse(ASCII.as_bytes()).unwrap().mesh;
    assert_eq!(m.positions.len(), 5);
    assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 4]]);
    // Windows line ends, no end of line after the last row, and blank lines change nothing.
    let windows = ASCII.replace('\n', "\r\n").replace("end_header\r\n", "end_header\r\n\r\n");
    assert_eq!(parse(windows.trim_end().as_bytes()).unwrap().mesh.triangles, m.triangles);
}

/// Writes the same quad in any binary layout.
struct Writer {
    big: bool,
    body: Vec<u8>,
}

impl Writer {
    fn put(&mut self, kind: &str, v: f64) {
        macro_rules! put {
            ($t:ty) => {{
                let v = v as $t;
                self.body.extend(if self.big { v.to_be_bytes().to_vec() } else { v.to_le_bytes().to_vec() })
            }};
        }
        match kind {
            "char" => put!(i8),
            "uchar" | "uint8" => put!(u8),
            "short" => put!(i16),
            "ushort" => put!(u16),
            "int" | "int32" => put!(i32),
            "uint" => put!(u32),
            "float" | "float32" => put!(f32),
            _ => put!(f64),
        }
    }
}

/// A quad with normals and uvs: property names and types of the vertices, types of a face's count and indices.
fn quad(big: bool, vertex: &[(&str, &str)], count: &str, item: &str, extra_face: bool) -> Vec<u8> {
    let mut w = Writer { big, body: Vec::new() };
    for i in 0..4 {
        let (x, y) = ([0.0, 1.0, 1.0, 0.0][i], [0.0, 0.0, 1.0, 1.0][i]);
        for (kind, name) in vertex {
            w.put(
                kind,
                match *name {
                    "x" => x,
                    "y" => y,
                    "nz" => 1.0,
                    "u" | "s" | "texture_u" => 1.0 - x,
                    "v" | "t" | "texture_v" => y * 2.0,
                    "r" | "red" => 255.0,
                    "b" | "blue" => 0.5,
                    _ => 0.0,
                },
            );
        }
    }
    for face in [[0, 1, 2], [0, 2, 3]] {
        if extra_face {
            w.put("short", 7.0);
        }
        w.put(count, 3.0);
        face.iter().for_each(|&i| w.put(item, f64::from(i)));
    }
    let order = if big { "big" } else { "little" };
    let mut head = format!("ply\nformat binary_{order}_endian 1.0\nelement vertex 4\n");
    vertex.iter().for_each(|(kind, name)| head += &format!("property {kind} {name}\n"));
    head += "element face 2\n";
    if extra_face {
        head += "property short flags\n";
    }
    head += &format!("property list {count} {item} vertex_index\nend_header\n");
    [head.into_bytes(), w.body].concat()
}

#[test]
fn every_binary_layout_reads_the_same() {
    let usual = ["x", "y", "z", "nx", "ny", "nz", "u", "v"].map(|n| ("float", n));
    let odd = [
        ("double", "z"),
        ("uchar", "quality"),
        ("float", "s"),
        ("float", "t"),
        ("short", "x"),
        ("float32", "y"),
        ("float", "nx"),
        ("float", "ny"),
        ("double", "nz"),
    ];
    for big in [false, true] {
        for vertex in [&usual[..], &odd[..]] {
            for (count, item, extra) in [
                ("uchar", "int", false),
                ("uchar", "uint", false),
                ("int", "ushort", false),
                ("uint8", "uchar", true),
                ("uchar", "int32", true),
            ] {
                let m = parse(&quad(big, vertex, count, item, extra)).unwrap().mesh;
                assert_eq!(m.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
                assert_eq!(m.normals, [Vec3::Z; 4]);
                assert_eq!(m.uvs, [[1., 0.], [0., 0.], [0., 2.], [1., 2.]].map(Vec2::from));
                assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3]]);
            }
        }
    }
}

#[test]
fn byte_colours_are_srgb_and_floats_linear() {
    let xyz = [("float", "x"), ("float", "y"), ("float", "z")];
    let float = [&xyz[..], &[("float", "r"), ("float", "g"), ("float", "b")]].concat();
    assert_eq!(parse(&quad(false, &float, "uchar", "int", false)).unwrap().mesh.colors, [Rgb::new(255.0, 0.0, 0.5); 4]);
    let bytes = [&xyz[..], &[("uchar", "red"), ("uchar", "green"), ("uchar", "blue")]].concat();
    assert_eq!(parse(&quad(false, &bytes, "uchar", "int", false)).unwrap().mesh.colors, [Rgb::new(1.0, 0.0, 0.0); 4]);
}

#[test]
fn lists_among_vertices_and_unknown_elements_are_skipped() {
    let mut w = Writer { big: false, body: Vec::new() };
    for i in 0..3 {
        w.put("uchar", f64::from(i));
        (0..i).for_each(|k| w.put("int", f64::from(k)));
        [f64::from(i == 1), f64::from(i == 2), 0.0].into_iter().for_each(|v| w.put("float", v));
    }
    (0..2).for_each(|_| {
        w.put("uchar", 2.0);
        w.put("double", 1.0);
        w.put("double", 2.0);
    });
    w.put("uchar", 3.0);
    [0., 1., 2.].into_iter().for_each(|v| w.put("int", v));
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty list uchar int around\nproperty float x\nproperty float y\nproperty float z\n\
        element edge 2\nproperty list uchar double ends\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let m = parse(&[head.as_bytes(), &w.body].concat()).unwrap().mesh;
    assert_eq!((m.positions, m.triangles), (vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]));
}

#[test]
fn mistakes_are_placed() {
    let replaced = |from: &str, to: &str| message(ASCII.replace(from, to).as_bytes());
    assert_eq!(message(b""), "line 1: the file is empty");
    assert!(message(b"plx\n").starts_with("line 1: not a PLY file"));
    assert!(replaced("ascii", "assci").starts_with("line 2: unknown format `assci`"));
    assert!(replaced("float z", "flot z").starts_with("line 7: unknown property type `flot`"));
    assert!(replaced("float z", "float w").contains("lacks one of the properties x, y, z"));
    assert!(replaced("vertex_indices", "corners").contains("lacks an integer list"));
    assert!(replaced("end_header\n", "").starts_with("line 10: unknown keyword `0`"));
    assert!(replaced("1 1 0\n", "1 x 0\n").starts_with("line 13: `x` is not a number"));
    assert!(replaced("1 1 0\n", "1 nan 0\n").starts_with("line 13: a vertex is not finite"));
    assert!(replaced("1 1 0\n", "1 1\n").starts_with("line 13: `z` is missing"));
    assert!(replaced("3 0 1 4\n", "").starts_with("line 17: truncated"));
    assert!(replaced("3 0 1 4", "3 0 1 -1").starts_with("line 17: `-1` is not the index"));
    assert!(replaced("3 0 1 4", "3 0 1 5").contains("face 1 names vertex 5, but there are 5 vertices"));

    let xyz = [("float", "x"), ("float", "y"), ("float", "z")];
    let good = quad(false, &xyz, "uchar", "int", false);
    let body = good.len() - 4 * 12 - 2 * 13;
    assert!(message(&good[..good.len() - 1]).contains("truncated"));
    let mut nan = good.clone();
    nan[body + 24..body + 28].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(message(&nan), format!("byte {}: vertex 2 is not finite", body + 24));
    let mut index = good.clone();
    index[body + 48 + 14..body + 48 + 18].copy_from_slice(&(-1i32).to_le_bytes());
    assert!(message(&index).contains("face 1 names vertex -1, but there are 4 vertices"));
    let mut long = good;
    long[body + 48] = 200;
    assert_eq!(message(&long), format!("byte {}: truncated: the file ends within the `face` rows", body + 48));
}

#[test]
fn absurd_counts_do_not_allocate() {
    for count in ["18446744073709551615", "4000000000", "99999999999"] {
        let m = message(ASCII.replace("vertex 5", &format!("vertex {count}")).as_bytes());
        assert!(m.contains("do not fit"), "{m}");
    }
    assert!(message(ASCII.replace("face 2", "face -2").as_bytes()).contains("not a number of rows"));
    let list = "ply\nformat binary_little_endian 1.0\nelement other 1\nproperty list uint double a\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    assert!(message(&[list.as_bytes(), &[0xFF; 9]].concat()).contains("truncated"));
}

#[test]
fn faces_of_two_corners_are_left_out_and_counted() {
    let loaded = parse(ASCII.replace("3 0 1 4", "2 0 1").as_bytes()).unwrap();
    assert_eq!((loaded.dropped.faces, loaded.mesh.triangles.len()), (1, 2));
}

/// A quad with a notch at corner 2: a fan from corner 0 or 1 leaves it, wherever the vertices are.
#[test]
fn concave_polygons_are_cut_into_triangles_inside() {
    let rows = ["0 0 0", "2 0 0", "0.5 0.5 0", "0 2 0"];
    let header = "ply\nformat ascii 1.0\n";
    let vertices = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let faces = "element face 1\nproperty list uchar int vertex_indices\n";
    for first in 0..4 {
        let face: String = (0..4).map(|i| format!(" {}", (first + i) % 4)).collect();
        for text in [
            format!("{header}{vertices}{faces}end_header\n{}\n4{face}\n", rows.join("\n")),
            format!("{header}{faces}{vertices}end_header\n4{face}\n{}\n", rows.join("\n")),
        ] {
            let mesh = parse(text.as_bytes()).unwrap().mesh;
            let area = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                (b - a).cross(c - a).z * 0.5
            };
            let areas: Vec<f32> = mesh.triangles.iter().map(area).collect();
            assert_eq!(areas, [0.5, 0.5], "{text}");
        }
    }
}

#[test]
fn chunks_join_without_seams() {
    // Far more than one chunk of vertices and of faces, a quad now and then to break the runs of triangles.
    let n = 60_000u32;
    let mut w = Writer { big: false, body: Vec::new() };
    for i in 0..n {
        [f64::from(i), f64::from(i % 7), 0.0].into_iter().for_each(|v| w.put("float", v));
    }
    let (mut want, mut faces) = (Vec::new(), 0);
    for i in 0..n - 3 {
        let quad = i % 1000 == 0;
        w.put("uchar", if quad { 4.0 } else { 3.0 });
        (i..i + if quad { 4 } else { 3 }).for_each(|v| w.put("int", f64::from(v)));
        want.push([i, i + 1, i + 2]);
        if quad {
            want.push([i, i + 2, i + 3]);
        }
        faces += 1;
    }
    let head = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let m = parse(&[head.as_bytes(), &w.body].concat()).unwrap().mesh;
    assert!(m.positions.iter().enumerate().all(|(i, p)| p.x == i as f32));
    assert_eq!(m.triangles, want);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn mutated_files_never_panic(which in 0usize..3, edits in proptest::collection::vec((0usize..400, any::<u8>()), 1..6), cut in 0usize..600) {
        let usual = ["x", "y", "z", "nx", "ny", "nz", "u", "v"].map(|n| ("float", n));
        let mut bytes = match which {
            0 => ASCII.as_bytes().to_vec(),
            1 => quad(false, &usual, "uchar", "int", false),
            _ => quad(true, &[("double", "x"), ("float", "y"), ("uchar", "z")], "int", "ushort", true),
        };
        for (at, value) in edits {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        bytes.truncate(cut.max(1));
        if let Ok(m) = parse(&bytes) {
            let n = m.mesh.positions.len();
            prop_assert!(m.mesh.triangles.iter().flatten().all(|&v| (v as usize) < n));
            prop_assert!(m.mesh.positions.iter().all(|p| p.is_finite()));
        }
    }
}
