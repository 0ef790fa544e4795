//! Where the two readers differ by intention. Should a later `tobj` behave otherwise, the test that fails here says
//! which line of the README to strike out.

use super::*;

/// `tobj` with both ways of indexing, which must refuse or accept alike.
fn theirs_twice(obj: &[u8], mtl: &[u8]) -> Result<[Reading; 2], String> {
    Ok([theirs(obj, mtl, Indexing::Single)?, theirs(obj, mtl, Indexing::Separate)?])
}

#[test]
fn mistakes_have_a_line_only_here() {
    for (text, here, there) in [
        ("v 0 0\n", "line 1: expected 3 numbers, found 2", "position parse error"),
        ("\n\nv 0 0 x\n", "line 3: `x` is not a finite number", "position parse error"),
        ("v 0 0 0\nvn 0 0\n", "line 2: expected 3 numbers, found 2", "normal parse error"),
        ("v 0 0 0\nf 1 a 1\n", "line 2: `a` is not a corner", "face parse error"),
        ("v 0 0 0\nf 1 1 2\nv 0 x 0\n", "line 2: there is no vertex 2", "position parse error"),
        ("v 0 0 0\nf 1 1 9\n", "line 2: there is no vertex 9", "face vertex index out of bounds"),
        ("v 0 0 0\nf 1 1 0\n", "line 2: there is no vertex 0", "face vertex index out of bounds"),
        ("v 0 0 0\nf 1 1 -2\n", "line 2: there is no vertex -2", "face vertex index out of bounds"),
    ] {
        let e = ours(text.as_bytes(), MTL).unwrap_err();
        assert!(e.starts_with(here), "{text}: {e}");
        assert_eq!(theirs_twice(text.as_bytes(), MTL).unwrap_err(), there, "{text}");
    }
}

#[test]
fn refused_here_accepted_there() {
    for (tail, here) in [
        // Without a face: a file of another kind would be an empty scene.
        ("PNG\n", "unknown statement `PNG`"),
        ("v nan 0 0\n", "`nan` is not a finite number"),
        ("v 0 inf 0\n", "`inf` is not a finite number"),
        // `tobj` takes index 0 for a missing one, and does not look at indices of a kind the file has none of.
        ("vt 0 0\nf 1/0 2/0 3/0\n", "there is no texture coordinate 0"),
        ("f 1//7 2//7 3//7\n", "there is no normal 7"),
        // Mostly a wrong number; of the files looked at none means it.
        ("f 1 2 5\nv 7 7 7\n", "there is no vertex 5: 4 are defined so far"),
    ] {
        let text = format!("{FOUR}{tail}");
        let e = ours(text.as_bytes(), MTL).unwrap_err();
        assert!(e.contains(here), "{tail}: {e}");
        assert!(theirs_twice(text.as_bytes(), MTL).is_ok(), "{tail}");
    }
}

#[test]
fn accepted_here_refused_there() {
    for (tail, triangles, there) in [
        ("f 1 2 \\\n 3\n", 1, "face parse error"),
        ("f 1 2 3 # a comment\n", 1, "face parse error"),
        ("v 0 0 0 #5\nf 1 2 3\n", 1, "position parse error"),
        ("vt 0.5\nf 1/1 2/1 3/1\n", 1, "texcoord parse error"),
        // Weights or opacities that exporters add.
        ("v 0 0 0 1 2\nf 1 2 3\n", 1, "color parse error (too many or too few components)"),
        ("v 0 0 0 1 1 1 1\nf 1 2 3\n", 1, "color parse error (too many or too few components)"),
        ("v 0 0 0 1 1 1\nf 3 4 5\n", 1, "face vertex color index out of bounds"),
        ("f\nf 1 2 3\n", 1, "invalid polygon"),
        ("usemtl\nf 1 2 3\n", 1, "material parse error"),
        ("mtllib m.mtl\nusemtl\tred\nf 1 2 3\n", 1, "material parse error"),
    ] {
        let text = format!("{FOUR}{tail}");
        assert_eq!(ours(text.as_bytes(), MTL).unwrap().triangles.len(), triangles, "{tail}");
        assert_eq!(theirs_twice(text.as_bytes(), MTL).unwrap_err(), there, "{tail}");
    }
    let latin = [FOUR.as_bytes(), b"g K\xf6rper\nf 1 2 3\n"].concat();
    assert_eq!(ours(&latin, MTL).unwrap().triangles.len(), 1);
    assert_eq!(theirs_twice(&latin, MTL).unwrap_err(), "read error");
}

#[test]
fn concave_polygons_are_fans_there() {
    // A notch at the third corner.
    let text = b"v 0 0 0\nv 2 0 0\nv 0.5 0.5 0\nv 0 2 0\nf 2 3 4 1\n";
    let area = |reading: &Reading| -> f32 {
        let areas = reading.triangles.iter().map(|t| {
            let [a, b, c] = t.vertices.map(|v| v.position);
            (b - a).cross(c - a).length() * 0.5
        });
        areas.sum()
    };
    assert_eq!(area(&ours(text, MTL).unwrap()), 1.0);
    for reading in theirs_twice(text, MTL).unwrap() {
        assert_eq!(area(&reading), 3.0);
    }
}

#[test]
fn polylines_are_triangles_there() {
    let text = format!("{FOUR}l 1 2 3 4\nf 1 2 3\n");
    assert_eq!(ours(text.as_bytes(), MTL).unwrap().triangles.len(), 1);
    for reading in theirs_twice(text.as_bytes(), MTL).unwrap() {
        assert_eq!(reading.triangles.len(), 3);
    }
}

/// The weight is one of rational curves and surfaces; it is none of a polygon.
#[test]
fn vertices_are_divided_by_their_weight_there() {
    let text = b"v 1 2 4 2\nv 1 0 0 2\nv 0 1 0 2\nf 1 2 3\n";
    assert_eq!(ours(text, MTL).unwrap().triangles[0].vertices[0].position, Vec3::new(1.0, 2.0, 4.0));
    for reading in theirs_twice(text, MTL).unwrap() {
        assert_eq!(reading.triangles[0].vertices[0].position, Vec3::new(0.5, 1.0, 2.0));
    }
}

#[test]
fn colors_of_some_vertices_go_to_others_there() {
    let text = b"v 0 0 0\nv 1 0 0\nv 0 1 0 1 0 0\nv 0 1 1 0 1 0\nf 1 2 1\n";
    assert_eq!(ours(text, MTL).unwrap().triangles[0].vertices[0].color, None);
    for reading in theirs_twice(text, MTL).unwrap() {
        assert_eq!(reading.triangles[0].vertices[0].color, Some([1.0, 0.0, 0.0]));
    }
}

#[test]
fn corners_without_normals_or_uvs_get_those_of_others_there() {
    // Corners 1 and 3 lack both.
    let text = format!("{FOUR}vt 0.5 0.5\nvt 0.25 0.25\nvn 0 0 1\nvn 0 1 0\nf 1 2/2/2 3\n");
    let [one, two, three] = ours(text.as_bytes(), MTL).unwrap().triangles[0].vertices;
    assert_eq!([one.uv, two.uv, three.uv], [Some(Vec2::ZERO), Some(Vec2::new(0.25, 0.25)), Some(Vec2::ZERO)]);
    assert_eq!([one.normal, two.normal, three.normal], [None; 3], "all are generated instead");
    let [single, separate] = theirs_twice(text.as_bytes(), MTL).unwrap();
    let normals = |reading: &Reading| reading.triangles[0].vertices.map(|v| v.normal);
    assert_eq!(normals(&single), [Some(Vec3::Y), None, None], "the second corner's normal at the first");
    assert_eq!(normals(&separate), [Some(Vec3::Z), Some(Vec3::Y), Some(Vec3::Y)]);
}

/// Normals that are generated from shared vertices would have seams at groups.
#[test]
fn groups_share_no_vertices_there() {
    let text = format!("{FOUR}g one\nf 1 2 3\ng two\nf 1 3 4\n");
    let reading = agreed(text.as_bytes(), MTL);
    assert_eq!(reading.vertices, 4);
    assert_eq!(theirs(text.as_bytes(), MTL, Indexing::Single).unwrap().vertices, 6);
}

#[test]
fn names_of_materials_are_lost_there() {
    // An indented statement, a comment, and a library that comes late.
    for (text, here, there) in [
        ("mtllib m.mtl\n usemtl red\nf 1 2 3\n", "red", "-"),
        ("mtllib m.mtl\nusemtl red # bricks\nf 1 2 3\n", "red", "-"),
        ("usemtl red\nf 1 2 3\nmtllib m.mtl\n", "red", "-"),
    ] {
        let text = format!("{FOUR}{text}");
        assert_eq!(ours(text.as_bytes(), MTL).unwrap().materials(), [here], "{text}");
        for reading in theirs_twice(text.as_bytes(), MTL).unwrap() {
            assert_eq!(reading.materials(), [there], "{text}");
        }
    }
    // The message to the user names what no library has; `tobj` has no place for that name.
    let file = parse(format!("{FOUR}usemtl unheard of\nf 1 2 3\n").as_bytes()).unwrap();
    assert_eq!((by_material(&file)[0].name.as_str(), by_material(&file)[0].line), ("unheard of", 5));
}

#[test]
fn a_mistake_costs_a_library_there() {
    for (line, there) in [
        ("Kd 0.5 x 1", "material parse error"),
        ("Ns high", "material parse error"),
        ("map_Kd", "material parse error"),
        // One number stands for all three in the format.
        ("Kd 0.5", "panic"),
    ] {
        let text = format!("newmtl a\nKs 0.25 0.5 0.75\n{line}\nnewmtl b\n");
        let names: Vec<String> = materials_of(text.as_bytes()).unwrap().into_iter().map(|m| m.name).collect();
        assert_eq!(names, ["a", "b"], "{line}");
        let obj = format!("{FOUR}mtllib m.mtl\nusemtl a\nf 1 2 3\n");
        assert_eq!(ours(obj.as_bytes(), text.as_bytes()).unwrap().materials(), ["a"], "{line}");
        match theirs_twice(obj.as_bytes(), text.as_bytes()) {
            Err(e) => assert_eq!((e.as_str(), there), ("panic", "panic"), "{line}"),
            Ok(readings) => readings.iter().for_each(|r| assert_eq!(r.materials(), ["-"], "{line}")),
        }
    }
}

#[test]
fn some_properties_of_materials_remain_text_there() {
    let text = b"newmtl a\nTf 0.5 0.5 0.5\nTr 0.25\nmap_Ke lamp.png\nmap_Kd -s 2 2 1 -clamp on a\\b.png # wood\n";
    let here = &materials_of(text).unwrap()[0];
    assert!(here.transmission.is_some() && here.map_emission.is_some() && here.opacity() == 0.75);
    assert_eq!(
        here.map_diffuse.as_ref().map(|m| (m.file.as_str(), m.scale, m.clamp)),
        Some(("a\\b.png", [2.0; 2], true))
    );
    let (there, _) = tobj::load_mtl_buf(&mut text.as_slice()).unwrap();
    assert_eq!(there[0].diffuse_texture.as_deref(), Some("-s 2 2 1 -clamp on a\\b.png # wood"));
    for (name, value) in [("Tf", "0.5 0.5 0.5"), ("Tr", "0.25"), ("map_Ke", "lamp.png")] {
        assert_eq!(there[0].unknown_param.get(name).map(String::as_str), Some(value));
    }
}
