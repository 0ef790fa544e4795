use super::*;
use crate::load::load_scene;
use crate::scene::{BsdfModel, ConductorParams, DielectricParams, PhongParams, ScalarDesc, Severity, TextureDesc};
use glam::DVec3;

const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nusemtl wall\nf 1 2 3\nusemtl glass\nf 1 3 4\nusemtl wall\nf 2 3 4\nusemtl lamp\nf 1/1 2/1 4/1\nusemtl mirror\nf 1 2 4\nusemtl shiny\nf 1 2 4\n";
const MTL: &str = "newmtl wall\nKd 0.2 0.4 0.6\nnewmtl glass\nillum 7\nNi 1.33\nTf 0.9 1 1\nnewmtl lamp\nKe 5 4 3\nnewmtl mirror\nillum 5\nKs 0.9 0.9 0.9\n\
    newmtl shiny\nKd 0.8 0.8 0.8\nKs 0.8 0.8 0.8\nNs 50\nmap_d missing.png\n";

fn load(
    obj: &str,
    mtl: Option<&str>,
    options: &LoadOptions,
) -> Result<(SceneDesc, crate::scene::Diagnostics), crate::load::LoadFailure> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, obj).unwrap();
    if let Some(mtl) = mtl {
        std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
    }
    load_scene(&path, options)
}

#[test]
fn materials_become_what_they_look_like() {
    let (scene, found) = load(OBJ, Some(MTL), &LoadOptions::default()).unwrap();
    assert_eq!(scene.shapes.len(), 5);
    assert_eq!(scene.meshes.iter().map(|m| m.triangles.len()).collect::<Vec<_>>(), [2, 1, 1, 1, 1]);
    let kind = |i: usize| &scene.bsdfs[scene.shapes[i].bsdf.unwrap().index()].kind;
    let front = |i: usize| match kind(i) {
        BsdfKind::TwoSided { front, .. } => &scene.bsdfs[front.index()].kind,
        other => panic!("{other:?}"),
    };
    assert!(
        matches!(front(0), BsdfKind::Model(BsdfModel::Diffuse(DiffuseParams { reflectance: ColorDesc::Constant(c) })) if *c == Rgb::new(0.2, 0.4, 0.6))
    );
    assert!(matches!(kind(1), BsdfKind::Model(BsdfModel::Dielectric(DielectricParams { eta, .. })) if *eta == 1.33));
    assert_eq!(scene.shapes[2].emission.as_ref().unwrap().radiance, ColorDesc::Constant(Rgb::new(5.0, 4.0, 3.0)));
    assert!(
        matches!(front(3), BsdfKind::Model(BsdfModel::Conductor(ConductorParams { specular_reflectance: ColorDesc::Constant(c), .. })) if *c == Rgb::grey(0.9))
    );
    let BsdfKind::Mask { nested, opacity: ScalarDesc::Texture(_) } = kind(4) else { panic!("{:?}", kind(4)) };
    let BsdfKind::TwoSided { front, .. } = scene.bsdfs[nested.index()].kind else { panic!() };
    // 0.8 + 0.8 would reflect more than arrives.
    assert!(
        matches!(&scene.bsdfs[front.index()].kind, BsdfKind::Model(BsdfModel::Phong(PhongParams { diffuse_reflectance: ColorDesc::Constant(c), .. })) if (c.r - 0.5).abs() < 1e-6)
    );
    // The lamp shines: no sky. The missing picture is one magenta pixel and one warning, at its material.
    assert!(scene.emitters.is_empty());
    assert_eq!(scene.images[0].image.rgb(0, 0), Rgb::new(1.0, 0.0, 1.0));
    let warnings: Vec<_> = found.list.iter().filter(|d| d.code == "load::image").collect();
    assert_eq!(warnings.len(), 1);
    assert_eq!(warnings[0].span.as_ref().unwrap().line_column().0, 12);
    let strict = load(OBJ, Some(MTL), &LoadOptions { strict: true, ..LoadOptions::default() }).unwrap_err();
    assert!(
        strict.io && strict.diagnostics.list.iter().any(|d| d.code == "load::image" && d.severity == Severity::Error)
    );
}

#[test]
fn a_missing_mtl_costs_the_colours_only() {
    let (scene, found) = load(OBJ, None, &LoadOptions::default()).unwrap();
    assert_eq!(scene.shapes.len(), 5);
    let codes: Vec<_> = found.list.iter().map(|d| d.code).collect();
    assert!(
        codes.contains(&"load::missing-mtl")
            && codes.contains(&"load::unknown-material")
            && codes.contains(&"load::added-sky"),
        "{codes:?}"
    );
    assert!(matches!(scene.emitters[0].kind, EmitterKind::Constant { .. }));
}

#[test]
fn one_statement_names_several_libraries_or_one_with_blanks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(folder.path().join("a.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    std::fs::write(folder.path().join("b c.mtl"), "newmtl blue\nKd 0 0 1\n").unwrap();
    for (libraries, missing, known) in [("a.mtl gone.mtl", 1, 1), ("b c.mtl", 0, 1), ("gone.mtl d.mtl", 1, 0)] {
        let text =
            format!("mtllib {libraries}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 3 2\n");
        std::fs::write(&path, text).unwrap();
        let (_, found) = load_scene(&path, &LoadOptions::default()).unwrap();
        let count = |code| found.list.iter().filter(|d| d.code == code).count();
        assert_eq!((count("load::missing-mtl"), count("load::unknown-material")), (missing, 2 - known), "{libraries}");
    }
}

#[test]
fn the_camera_sees_all_corners_or_stands_where_it_is_told() {
    let (scene, _) = load(OBJ, None, &LoadOptions::default()).unwrap();
    let s = &scene.sensors[0];
    let half = (s.fov * 0.5).to_radians().tan();
    for p in &scene.meshes[0].positions {
        let q = s.to_world.inverse().transform_point3(p.as_dvec3());
        assert!(q.z > s.near_clip && (q.x / q.z).abs() < half && (q.y / q.z).abs() < half * 9.0 / 16.0, "{q}");
    }
    let mut options = LoadOptions::default();
    options.camera.origin = Some(DVec3::new(0.0, 0.0, 9.0));
    options.camera.target = Some(DVec3::ZERO);
    options.camera.resolution = Some([64, 32]);
    let (scene, _) = load(OBJ, None, &options).unwrap();
    let s = &scene.sensors[0];
    assert_eq!((s.film.width, s.film.height), (64, 32));
    assert!((s.to_world.transform_vector3(DVec3::Z) - DVec3::NEG_Z).length() < 1e-12);
    // +x is to the left: seen along −z with y up, that is −x.
    assert!((s.to_world.transform_vector3(DVec3::X) - DVec3::NEG_X).length() < 1e-12);
    options.camera.up = Some(DVec3::Z);
    assert_eq!(load(OBJ, None, &options).unwrap_err().diagnostics.list.last().unwrap().code, "load::camera");
}

#[test]
fn a_lone_ply_is_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.PLY");
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    std::fs::write(&path, text).unwrap();
    let (scene, _) = load_scene(&path, &LoadOptions::default()).unwrap();
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[0].normals.len()), (1, 3));
    std::fs::write(&path, text.replace("3 0 1 2", "3 0 1 3")).unwrap();
    let e = load_scene(&path, &LoadOptions::default()).unwrap_err();
    assert!(!e.io && e.to_string().contains("names vertex 3"), "{e}");
    assert!(load_scene(&folder.path().join("none.obj"), &LoadOptions::default()).unwrap_err().io);
}

/// A folder with an OBJ file, a library in a folder of its own, and pictures of one pixel.
fn folder_with(mtl: &str, pictures: &[(&str, [u8; 3])]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("lib/maps")).unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, "mtllib lib\\m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl a\nf 1 2 3\n").unwrap();
    std::fs::write(folder.path().join("lib/m.mtl"), mtl).unwrap();
    for (name, color) in pictures {
        image::RgbImage::from_pixel(1, 1, image::Rgb(*color)).save(folder.path().join(name)).unwrap();
    }
    (folder, path)
}

#[test]
fn textures_are_looked_for_beside_the_mtl_and_then_beside_the_obj() {
    let (red, green) = ([255, 0, 0], [0, 255, 0]);
    for (name, pictures, want) in [
        ("k.png", vec![("lib/k.png", red), ("k.png", green)], Rgb::new(1.0, 0.0, 0.0)),
        ("k.png", vec![("k.png", green)], Rgb::new(0.0, 1.0, 0.0)),
        ("maps\\k.png", vec![("lib/maps/k.png", green)], Rgb::new(0.0, 1.0, 0.0)),
        ("C:\\Users\\me\\k.png", vec![("lib/k.png", red)], Rgb::new(1.0, 0.0, 0.0)),
    ] {
        let (_folder, path) = folder_with(&format!("newmtl a\nmap_Kd {name}\n"), &pictures);
        let (scene, found) = load_scene(&path, &LoadOptions::default()).unwrap();
        assert_eq!(scene.images[0].image.rgb(0, 0), want, "{name}");
        let codes: Vec<_> = found.list.iter().map(|d| d.code).filter(|code| *code != "load::added-sky").collect();
        let moved = name.starts_with('C');
        assert_eq!(codes, if moved { vec!["load::other-folder"] } else { vec![] }, "{name}");
    }
}

#[test]
fn bump_and_normal_maps_tilt_the_material_under_both_sides() {
    let grey = [128, 128, 128];
    let tilted = [170, 140, 230];
    for (mtl, pictures, is_normal, said) in [
        ("map_Bump -bm 0.5 b.png", [("lib/b.png", grey)], false, false),
        ("norm b.png", [("lib/b.png", tilted)], true, false),
        // Exporters write normals behind either keyword.
        ("bump b.png", [("lib/b.png", tilted)], true, true),
    ] {
        let (_folder, path) = folder_with(&format!("newmtl a\n{mtl}\n"), &pictures);
        let (scene, found) = load_scene(&path, &LoadOptions::default()).unwrap();
        let BsdfKind::TwoSided { front, back } = scene.bsdfs[scene.shapes[0].bsdf.unwrap().index()].kind else {
            panic!()
        };
        assert_eq!(front, back);
        let (nested, texture) = match scene.bsdfs[front.index()].kind {
            BsdfKind::BumpMap { nested, height, scale: 0.5 } if !is_normal => (nested, height),
            BsdfKind::NormalMap { nested, normals } if is_normal => (nested, normals),
            ref other => panic!("{mtl}: {other:?}"),
        };
        assert!(matches!(scene.bsdfs[nested.index()].kind, BsdfKind::Model(BsdfModel::Diffuse(_))));
        // Plain numbers, as the format means them.
        let TextureDesc::Bitmap { image, .. } = scene.textures[texture.index()] else { panic!() };
        assert!(matches!(scene.images[image.index()].image.pixels, crate::image::Pixels::Linear8(_)));
        assert_eq!(found.list.iter().any(|d| d.code == "load::normals-as-bump"), said, "{mtl}");
    }
}

#[test]
fn unknown_statements_are_a_warning() {
    let (scene, found) = load(&OBJ.replace("vt 0 0", "vt 0 0\nfoo 1"), Some(MTL), &LoadOptions::default()).unwrap();
    assert_eq!(scene.shapes.len(), 5);
    assert!(found.list.iter().any(|d| d.code == "load::mesh" && d.message.contains("first is `foo` in line 7")));
}
