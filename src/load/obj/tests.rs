use super::*;

fn read(text: &str) -> Result<ObjFile, String> {
    parse(text.as_bytes()).map_err(|e| e.to_string())
}

const QUAD: &str = "# quad\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n\
    usemtl a b\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

#[test]
fn corners_of_every_form() {
    let tail = QUAD.replace("f 1/1/1 2/2/1 3/3/1 4/4/1\n", "");
    for face in ["f 1/1/1 2/2/1 3/3/1", "f -4/-4/-1 -3/-3/-1 -2/-2/-1", "f 1/1/1 2/2/1 \\\n 3/3/1"] {
        let f = read(&format!("{tail}{face}\n")).unwrap();
        assert_eq!(f.triangles, [[[0, 0, 0], [1, 1, 0], [2, 2, 0]]]);
    }
    assert_eq!(
        read(&format!("{tail}f 1 2 3\n")).unwrap().triangles,
        [[[0, NONE, NONE], [1, NONE, NONE], [2, NONE, NONE]]]
    );
    assert_eq!(
        read(&format!("{tail}f 1//1 2//1 3//1\n")).unwrap().triangles,
        [[[0, NONE, 0], [1, NONE, 0], [2, NONE, 0]]]
    );
    let material = MaterialUse { name: "a b".to_owned(), first_triangle: 0, line: 11 };
    assert_eq!(read(QUAD).unwrap().materials, [material]);
}

#[test]
fn comments_end_statements_but_not_names() {
    let f =
        read("\u{feff}# c\nusemtl Material #25\nusemtl red # brick\nmtllib a#b.mtl #\nv 1 2 3 #4\nv 1 2 3#\n").unwrap();
    assert_eq!(f.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["Material #25", "red"]);
    assert_eq!((f.libraries[0].names.as_str(), f.libraries[0].line), ("a#b.mtl", 4));
    assert_eq!((f.positions.len(), f.colors.len()), (2, 0));
}

#[test]
fn vertices_are_shared_where_all_indices_agree() {
    let f = read(&format!("{QUAD}f 1/1/1 3/3/1 2/3/1\n")).unwrap();
    let m = mesh_of(&f, &f.triangles);
    assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 4]]);
    assert_eq!((m.positions.len(), m.uvs.len(), m.normals.len()), (5, 5, 5));
    assert_eq!(m.positions[4], Vec3::X);
}

/// Mitsuba 3.9.1, scalar_rgb: v turned round by default, smooth normals generated where the file has none.
#[test]
fn conventions_are_mitsubas() {
    let f = read("v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n").unwrap();
    let mut m = mesh_of(&f, &f.triangles);
    mesh::finish(&mut m, MeshOptions { flip_v: true, ..MeshOptions::default() });
    assert_eq!(m.uvs, [[0., 1.], [1., 1.], [1., 0.], [0., 0.]].map(Vec2::from));
    assert!((m.normals[1] - Vec3::new(0.0, -0.447_213_6, 0.894_427_2)).length() < 1e-6);
}

#[test]
fn unknown_statements_are_skipped_and_counted() {
    let f = read(&format!("{QUAD}\nfoo 1 2\nv 2 2 2\nbar\nfoo\nf 1 2 5\n")).unwrap();
    assert_eq!((f.triangles.len(), f.positions.len()), (3, 5));
    let unknown = UnknownStatements { count: 3, first: "foo".to_owned(), line: 14 };
    assert_eq!(f.dropped, Dropped { faces: 0, statements: Some(unknown) });
    let said = f.dropped.messages(Path::new("a.obj"));
    assert_eq!(said, ["`a.obj`: 3 unknown statements are skipped; the first is `foo` in line 14"]);
}

/// An L of six corners, from each of them: the fan of two of them leaves it.
#[test]
fn concave_polygons_are_covered_once() {
    let vertices = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n";
    for first in 0..6 {
        let corners: String = (0..6).map(|i| format!(" {}", (first + i) % 6 + 1)).collect();
        let f = read(&format!("{vertices}f{corners}\n")).unwrap();
        let area = |t: &[Corner; 3]| {
            let [a, b, c] = t.map(|c| f.positions[c[0] as usize]);
            (b - a).cross(c - a).z * 0.5
        };
        let areas: Vec<f32> = f.triangles.iter().map(area).collect();
        assert!(areas.len() == 4 && areas.iter().all(|&a| a > 0.0), "{corners}: {areas:?}");
        assert_eq!(areas.iter().sum::<f32>(), 3.0, "{corners}");
    }
}

#[test]
fn mistakes_have_their_line() {
    for (text, says) in [
        ("v 0 0\n", "line 1: expected 3 numbers, found 2"),
        ("v 0 0 x\n", "line 1: `x` is not a finite number"),
        ("v 0 0 nan\n", "line 1: `nan` is not a finite number"),
        ("v 0 0 0\nf 1 1 2\n", "line 2: there is no vertex 2: 1 are defined so far"),
        ("v 0 0 0\nf 1 1 -2\n", "line 2: there is no vertex -2"),
        ("v 0 0 0\nf 0 1 1\n", "line 2: there is no vertex 0"),
        ("v 0 0 0\nf 1/1 1 1\n", "line 2: there is no texture coordinate 1"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", "line 2: there is no texture coordinate"),
        ("v 0 0 0\nf a 1 1\n", "line 2: `a` is not a corner"),
        // Nothing in it is of this format.
        ("\u{0}PNG\n", "line 1: unknown statement"),
        ("v 0 0 0\n\nsolid cube\nsolid 2\n", "line 3: unknown statement `solid`: not an OBJ file?"),
    ] {
        let e = read(text).unwrap_err();
        assert!(e.starts_with(says), "{text}: {e}");
    }
}

proptest::proptest! {
    #[test]
    fn mutated_files_never_panic(
        edits in proptest::collection::vec((0usize..200, proptest::prelude::any::<u8>()), 1..6),
    ) {
        let mut bytes = QUAD.as_bytes().to_vec();
        for (at, value) in edits {
            let at = at % bytes.len();
            bytes[at] = value;
        }
        if let Ok(f) = parse(bytes.as_slice()) {
            let m = mesh_of(&f, &f.triangles);
            proptest::prop_assert!(m.triangles.iter().flatten().all(|&v| (v as usize) < m.positions.len()));
        }
    }
}
