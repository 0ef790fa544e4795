//! Files made by chance, of statements that both readers understand alike.

use super::*;

/// Names of materials in `usemtl` statements; the last is in no library.
const MATERIALS: [&str; 4] = ["red", "old brick", "Material #25", "unheard of"];

/// Attributes of the corners of a file besides the position.
#[derive(Clone, Copy, Debug)]
struct Attributes {
    uvs: bool,
    normals: bool,
    colors: bool,
}

/// Chooses a corner of a face among what is defined before it.
#[derive(Clone, Copy, Debug)]
struct Pick {
    position: u16,
    uv: u16,
    normal: u16,
    /// Counted from the end.
    negative: bool,
}

#[derive(Clone, Debug)]
enum Statement {
    /// One position with all attributes of the file.
    Vertex([f32; 11]),
    Face(Vec<Pick>),
    Group(u8),
    UseMaterial(usize),
    /// Ignored by both.
    Other(usize),
}

const OTHERS: [&str; 7] = ["# a comment", "", "s 1", "p 1", "l -1 -2", "vp 0.5 0.5", "vw 0 0 0.5"];

fn finite() -> impl Strategy<Value = f32> {
    use proptest::num::f32::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    prop_oneof![3 => -10.0f32..10.0, 1 => NORMAL | SUBNORMAL | ZERO | POSITIVE | NEGATIVE]
}

fn statement() -> impl Strategy<Value = Statement> {
    let pick = (any::<[u16; 3]>(), any::<bool>()).prop_map(|([position, uv, normal], negative)| Pick {
        position,
        uv,
        normal,
        negative,
    });
    prop_oneof![
        6 => proptest::array::uniform11(finite()).prop_map(Statement::Vertex),
        6 => proptest::collection::vec(pick, 1..8).prop_map(Statement::Face),
        1 => (0u8..4).prop_map(Statement::Group),
        2 => (0..MATERIALS.len()).prop_map(Statement::UseMaterial),
        1 => (0..OTHERS.len()).prop_map(Statement::Other),
    ]
}

/// Writes the index `chosen` out of `count`.
fn index(chosen: u16, count: usize, negative: bool) -> i64 {
    let from_zero = i64::from(chosen) % count as i64;
    if negative { from_zero - count as i64 } else { from_zero + 1 }
}

/// The text of a file. It begins with a few vertices, so that every face has something to choose from.
fn text(statements: &[Statement], has: Attributes, ending: &str) -> String {
    let mut out = String::from("mtllib m.mtl");
    let start = [0.0, 1.0, 2.0].map(|i| Statement::Vertex([i, 0.5, i * i, 0.0, i, 0.0, 0.0, 1.0, 0.25, 0.5, i]));
    let mut count = 0;
    for statement in start.iter().chain(statements) {
        out.push_str(ending);
        match statement {
            Statement::Vertex(v) => {
                count += 1;
                write!(out, "v {} {:e} {}", v[0], v[1], v[2]).unwrap();
                if has.colors {
                    write!(out, " {} {}\t{}", v[8], v[9], v[10]).unwrap();
                }
                if has.uvs {
                    write!(out, "{ending}vt {} {}", v[3], v[4]).unwrap();
                }
                if has.normals {
                    write!(out, "{ending}vn  {} {} {:E}", v[5], v[6], v[7]).unwrap();
                }
            }
            Statement::Face(picks) => {
                out.push('f');
                for (i, mut pick) in picks.iter().copied().enumerate() {
                    // For polygons that are not convex the two readers make different triangles; one that goes to and
                    // fro between two places has no area and becomes a fan here as well.
                    if picks.len() > 3 {
                        pick.position = picks[i % 2].position;
                    }
                    let [v, vt, vn] = [pick.position, pick.uv, pick.normal].map(|i| index(i, count, pick.negative));
                    match (has.uvs, has.normals) {
                        (false, false) => write!(out, " {v}"),
                        (true, false) => write!(out, " {v}/{vt}"),
                        (false, true) => write!(out, " {v}//{vn}"),
                        (true, true) => write!(out, "  {v}/{vt}/{vn}"),
                    }
                    .unwrap();
                }
            }
            Statement::Group(i) => write!(out, "{} part {i}", if i % 2 == 0 { "o" } else { "g" }).unwrap(),
            Statement::UseMaterial(i) => write!(out, "usemtl {}", MATERIALS[*i]).unwrap(),
            Statement::Other(i) => out.push_str(OTHERS[*i]),
        }
    }
    out
}

proptest! {
    #[test]
    fn objects_agree(
        statements in proptest::collection::vec(statement(), 0..40),
        (uvs, normals, colors) in any::<(bool, bool, bool)>(),
        crlf in any::<bool>(),
    ) {
        let mtl = "newmtl red\nKd 1 0 0\nnewmtl old brick\nnewmtl Material #25\n";
        let obj = text(&statements, Attributes { uvs, normals, colors }, if crlf { "\r\n" } else { "\n" });
        let reading = agreed(obj.as_bytes(), mtl.as_bytes());
        let split = statements.iter().any(|s| matches!(s, Statement::Group(_) | Statement::UseMaterial(_)));
        if !split {
            // One vertex for each combination of indices, in either.
            let single = theirs(obj.as_bytes(), mtl.as_bytes(), Indexing::Single).unwrap();
            prop_assert_eq!(reading.vertices, single.vertices);
        }
        let faces = statements.iter().map(|s| if let Statement::Face(corners) = s { corners.len() } else { 0 });
        prop_assert_eq!(reading.triangles.len(), faces.map(|corners| corners.saturating_sub(2)).sum::<usize>());
    }

    #[test]
    fn materials_agree(
        colors in proptest::collection::vec(proptest::array::uniform3(proptest::array::uniform3(finite())), 1..5),
        (shininess, ior, dissolve) in (0.0f32..1e4, 1.0f32..3.0, 0.0f32..=1.0),
        model in 0u8..10,
        crlf in any::<bool>(),
    ) {
        let mut text = String::new();
        for (i, [kd, ks, ke]) in colors.iter().enumerate() {
            let line = |[r, g, b]: [f32; 3]| format!("{r} {g:e} {b}");
            write!(text, "newmtl a material {i}\nKd {}\n  Ks  {}\nKe {}\n", line(*kd), line(*ks), line(*ke)).unwrap();
            write!(text, "Ns {shininess}\nNi {ior:e}\nd {dissolve}\nillum {model}\n").unwrap();
            write!(text, "map_Kd a picture {i}.png\n\tmap_Ks b.png\n# a comment\n\nmap_d c/d {i}.png\n").unwrap();
        }
        let text = if crlf { text.replace('\n', "\r\n") } else { text };
        let here = materials_of(text.as_bytes()).unwrap();
        let (there, _) = tobj::load_mtl_buf(&mut text.as_bytes()).unwrap();
        prop_assert_eq!(here.len(), there.len());
        for (here, there) in here.iter().zip(&there) {
            prop_assert_eq!(&here.name, &there.name);
            let colors = [here.diffuse, here.specular, here.emission].map(|c| c.map(Rgb::to_array));
            prop_assert_eq!(colors, [there.diffuse, there.specular, there.emissive]);
            let numbers = [here.shininess, here.ior, here.dissolve];
            prop_assert_eq!(numbers, [there.shininess, there.optical_density, there.dissolve]);
            prop_assert_eq!(here.illumination, there.illumination_model.map(u32::from));
            let maps = [&here.map_diffuse, &here.map_specular, &here.map_dissolve];
            let files = maps.map(|m| m.as_ref().map(|m| m.file.clone()));
            let other = [&there.diffuse_texture, &there.specular_texture, &there.dissolve_texture].map(Clone::clone);
            prop_assert_eq!(files, other);
        }
    }
}
