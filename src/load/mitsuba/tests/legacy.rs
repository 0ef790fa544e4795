//! Properties of versions 0.5 and 0.6 that Mitsuba 3 no longer has, or reads otherwise.

use super::*;

/// A scene of version 0.6.
fn old(inside: &str) -> String {
    scene(inside).replacen("3.0.0", "0.6.0", 1)
}

#[test]
fn the_later_of_two_properties_holds() {
    let inside = "<shape type=\"rectangle\">\n<boolean name=\"flipNormals\" value=\"false\"/>\n<boolean name=\"flipNormals\" value=\"true\"/></shape>";
    let (s, found) = load(&old(inside)).unwrap();
    assert!(s.shapes[1].flip_normals);
    assert_eq!(found.list[0].severity, Severity::Warning);
    assert_eq!(messages(Ok((s, found))), [("scene::duplicate-property", 4, 16)]);
    // Mitsuba 3 refuses it.
    let inside = inside.replace("flipNormals", "flip_normals");
    let e = load(&scene(&inside)).unwrap_err();
    assert_eq!(messages(Err(e)), [("scene::duplicate-property", 4, 16)]);
}

#[test]
fn three_numbers_in_a_spectrum_are_rgb() {
    for numbers in ["0.1, 0.2, 0.3", "0.1 0.2 0.3", "0.1,0.2,0.3", " 0.1 , 0.2  0.3 "] {
        let inside =
            format!("<bsdf type=\"diffuse\" id=\"d\"><spectrum name=\"reflectance\" value=\"{numbers}\"/></bsdf>");
        let (s, _) = load(&old(&inside)).unwrap();
        let BsdfKind::Model(BsdfModel::Diffuse(p)) = bsdf(&s, "d") else { panic!() };
        assert_eq!(p.reflectance, ColorDesc::Constant(Rgb::new(0.1, 0.2, 0.3)), "{numbers}");
        assert_eq!(messages(load(&scene(&inside))), [("scene::bad-value", 2, 65)], "{numbers}");
    }
    let two = "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"1 2\"/></bsdf>";
    assert_eq!(messages(load(&old(two)))[0].0, "scene::bad-value");
}

/// Mitsuba 0.6 scales a reflectance above 1 so that its largest component is 0.99.
#[test]
fn bright_reflectances_are_scaled_down() {
    let inside = "<bsdf type=\"diffuse\" id=\"d\"><rgb name=\"reflectance\" value=\"1.98, 0.99, 0\"/></bsdf>";
    let (s, found) = load(&old(inside)).unwrap();
    assert_eq!(found.list[0].code, "scene::bright-reflectance");
    let BsdfKind::Model(BsdfModel::Diffuse(p)) = bsdf(&s, "d") else { panic!() };
    let ColorDesc::Constant(c) = p.reflectance else { panic!() };
    assert!((c.r - 0.99).abs() < 1e-6 && (c.g - 0.495).abs() < 1e-6 && c.b == 0.0, "{c:?}");
}

/// The albedo of blends of Lambertian materials.
fn diffuse_albedo(scene: &SceneDesc, id: BsdfId) -> f32 {
    match scene.bsdfs[id.index()].kind {
        BsdfKind::Model(BsdfModel::Diffuse(DiffuseParams { reflectance: ColorDesc::Constant(c) })) => c.g,
        BsdfKind::Blend { weight: ScalarDesc::Constant(w), a, b } => {
            (1.0 - w) * diffuse_albedo(scene, a) + w * diffuse_albedo(scene, b)
        }
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn mixtures_weigh_each_of_their_materials() {
    let grey = |v: f64| format!("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"{v}\"/></bsdf>");
    let nested = [0.2, 0.4, 0.8].map(grey).concat();
    // Light is lost where the weights do not reach one; weights beyond one are scaled.
    let mixtures =
        [("0.5, 0.25, 0.125", 0.3), ("0.5;0.25;0.25", 0.4), ("0 0 0.5", 0.4), ("2 1 1", 0.4), ("0 1 0", 0.4)];
    for (weights, expected) in mixtures {
        let scene = good(&format!(
            "<bsdf type=\"mixturebsdf\" id=\"mixed\"><string name=\"weights\" value=\"{weights}\"/>{nested}</bsdf>"
        ));
        let id = scene.bsdfs.iter().position(|bsdf| bsdf.name.as_deref() == Some("mixed")).unwrap();
        let albedo = diffuse_albedo(&scene, BsdfId(id as u32));
        assert!((albedo - expected).abs() < 1e-6, "{weights}: {albedo}");
    }
}
