//! Materials from descriptions: what is refused, what is known before rendering, what sides show.

use super::*;
use crate::shade::Transport;

/// Builds the last description of `bsdfs` and returns the messages.
fn messages(bsdfs: Vec<BsdfKind>) -> (MaterialSet, Vec<String>) {
    let descs: Vec<BsdfDesc> = bsdfs.into_iter().map(|kind| BsdfDesc { name: None, kind, span: None }).collect();
    let mut diagnostics = Diagnostics::default();
    let set = MaterialSet::build(&descs, &TextureSet::default(), &mut diagnostics);
    (set, diagnostics.list.into_iter().map(|d| d.message).collect())
}

fn grey() -> BsdfKind {
    DiffuseParams { reflectance: rgb(0.2, 0.2, 0.2) }.into()
}

#[test]
fn impossible_trees_are_errors_and_render_as_the_default() {
    let blend = |a, b| BsdfKind::Blend { weight: num(0.5), a: BsdfId(a), b: BsdfId(b) };
    let glass = DielectricParams { eta: 1.5, specular_reflectance: white(), specular_transmittance: white() };
    let cases: Vec<(Vec<BsdfKind>, &str)> = vec![
        (vec![blend(0, 0)], "nested in itself"),
        (vec![blend(7, 7)], "does not exist"),
        (vec![grey(), blend(0, 0), blend(1, 1), blend(2, 2), blend(3, 3)], "16 lobes"),
        (vec![glass.into(), BsdfKind::TwoSided { front: BsdfId(0), back: BsdfId(0) }], "two-sided"),
        (vec![grey(), BsdfKind::BumpMap { nested: BsdfId(0), height: TextureId(3), scale: 1.0 }], "height map"),
        (vec![grey(), BsdfKind::NormalMap { nested: BsdfId(0), normals: TextureId(3) }], "normal map"),
        (
            vec![
                PlasticParams {
                    eta: -1.0,
                    diffuse_reflectance: white(),
                    specular_reflectance: white(),
                    nonlinear: false,
                }
                .into(),
            ],
            "not positive",
        ),
    ];
    for (kinds, expected) in cases {
        let last = BsdfId(kinds.len() as u32 - 1);
        let (set, messages) = messages(kinds);
        assert!(messages.iter().any(|m| m.contains(expected)), "{expected}: {messages:?}");
        let bsdf = set.get(Some(last)).resolve(&flat(), Vec3::Z);
        assert_eq!(bsdf.albedo(), Rgb::grey(0.5));
    }
    // Children shared so often that the tree would have 2^30 nodes.
    let doubling: Vec<BsdfKind> = std::iter::once(grey()).chain((0..30).map(|i| blend(i, i))).collect();
    assert!(!messages(doubling).1.is_empty());
}

#[test]
fn eight_lobes_are_all_there() {
    let blend = |a, b| BsdfKind::Blend { weight: num(0.5), a: BsdfId(a), b: BsdfId(b) };
    let (set, messages) = messages(vec![grey(), blend(0, 0), blend(1, 1), blend(2, 2)]);
    assert!(messages.is_empty(), "{messages:?}");
    let bsdf = set.get(Some(BsdfId(3))).resolve(&flat(), Vec3::Z);
    let (value, pdf) = bsdf.eval_and_pdf(Vec3::Z, Vec3::Z, Transport::Radiance);
    assert!(
        (value.g - 0.2 * std::f32::consts::FRAC_1_PI).abs() < 1e-6
            && (pdf.0 - std::f32::consts::FRAC_1_PI).abs() < 1e-6
    );
}

#[test]
fn features_say_what_a_material_can_do() {
    let of = |name: &str| ZOO.get(name).features();
    assert!(of("diffuse").smooth && of("diffuse").opaque() && !of("diffuse").delta && !of("diffuse").two_sided);
    assert!(of("dielectric").delta && of("dielectric").transmissive && !of("dielectric").smooth);
    assert!(of("plastic").delta && of("plastic").smooth && of("plastic").opaque());
    assert!(of("mask").passes_through && !of("mask").opaque() && of("mask").two_sided);
    assert!(of("bump_diffuse").textured && of("bump_diffuse").tilted);
    assert!(of("principled_glass").transmissive && !of("principled_opaque").transmissive);
    let (set, _) = messages(vec![DiffuseParams { reflectance: rgb(0.0, 0.0, 0.0) }.into()]);
    assert!(set.get(Some(BsdfId(0))).is_black() && !set.get(None).is_black());
    assert!(!ZOO.get("mask").is_black());
}

/// The events that a material shows from one side of a flat point.
#[derive(Default)]
struct Observed {
    smooth: bool,
    delta: bool,
    /// Light goes to the other side.
    crosses: bool,
}

fn observe(material: &Material, wo: Vec3) -> Observed {
    let (mut rng, mut seen) = (HashRng::new(21, 0, 0, 0), Observed::default());
    let bsdf = material.resolve(&flat(), wo);
    for s in (0..500).filter_map(|_| bsdf.sample(wo, next3(&mut rng), Transport::Radiance)) {
        (seen.smooth, seen.delta) = (seen.smooth || !s.delta, seen.delta || s.delta);
        seen.crosses |= s.wi.z * wo.z < 0.0;
    }
    seen
}

/// The features of every model of the table are those that its samples and values show.
#[test]
fn features_of_all_models_agree_with_their_behaviour() {
    let (wo, wi) = (Vec3::new(0.3, 0.1, 0.8).normalize(), Vec3::new(-0.1, 0.25, 0.9).normalize());
    let quarter_turn = SurfacePoint { frame: Frame { s: Vec3::Y, t: -Vec3::X, n: Vec3::Z }, ..flat() };
    let value = |material: &Material, p: &SurfacePoint| material.resolve(p, wo).eval(wo, wi, Transport::Radiance);
    for model in MODELS {
        for variant in ["default", "textured", "varied"] {
            let name = format!("{} {variant}", model.name);
            let material = ZOO.get(&name);
            let f = material.features();
            let (front, back) = (observe(material, wo), observe(material, -wo));
            assert_eq!((f.smooth, f.delta, f.transmissive), (front.smooth, front.delta, front.crosses), "{name}");
            assert_eq!(f.two_sided, back.smooth || back.delta, "{name}");
            assert_eq!(f.textured, variant == "textured", "{name}");
            assert!(!f.tilted && !f.passes_through && !material.is_black(), "{name}");
            assert_eq!(f.oriented, value(material, &flat()) != value(material, &quarter_turn), "{name}");
        }
    }
}

#[test]
fn operators_hand_features_on() {
    let oriented = |name: &str| ZOO.get(name).features().oriented;
    for name in ["rough_conductor_ggx", "two_sided_bump", "bump_diffuse", "normal_map", "blend_mask"] {
        assert!(oriented(name), "{name}");
    }
    for name in ["two_sided", "blend", "mask", "mask_two_sided", "rough_conductor_beckmann"] {
        assert!(!oriented(name), "{name}");
    }
}

#[test]
fn backs_are_black_unless_two_sided() {
    let (wo, wi) = (Vec3::new(0.3, 0.1, -0.8).normalize(), Vec3::new(-0.2, 0.4, -0.7).normalize());
    for name in ["diffuse", "rough_conductor_ggx", "plastic", "rough_plastic_ggx", "principled_plain", "phong", "ward"]
    {
        let bsdf = ZOO.get(name).resolve(&flat(), wo);
        assert!(
            bsdf.eval(wo, wi, Transport::Radiance).is_black()
                && bsdf.sample(wo, [0.5; 3], Transport::Radiance).is_none()
        );
        assert!(!bsdf.connectable(), "{name}");
    }
    // The front is diffuse, the back a mirror.
    let back = ZOO.get("two_sided").resolve(&flat(), wo);
    let s = back.sample(wo, [0.5; 3], Transport::Radiance).expect("a mirror reflects");
    assert!(s.delta && (s.wi - Vec3::new(-wo.x, -wo.y, wo.z)).length() < 1e-6 && !back.connectable());
    assert!(ZOO.get("two_sided").resolve(&flat(), -wo).connectable());
}

#[test]
fn holes_let_light_through_and_the_rest_is_the_nested_material() {
    let (wo, wi) = (Vec3::new(0.3, 0.1, 0.8).normalize(), Vec3::new(-0.2, 0.4, 0.7).normalize());
    let holes = |name: &str| ZOO.get(name).holes(&leaning());
    for (name, share) in
        [("null", 1.0), ("mask", 0.6), ("mask_two_sided", 0.3), ("blend_mask", 0.25 * 0.6), ("two_sided", 0.0)]
    {
        assert!((holes(name) - share).abs() < 1e-6, "{name} {}", holes(name));
    }
    // A mask of 0.7 over a two-sided material: what is no hole is that material.
    let [masked, nested] = ["mask_two_sided", "two_sided"].map(|name| ZOO.get(name).resolve(&leaning(), wo));
    let [(a, p), (b, q)] = [&masked, &nested].map(|bsdf| bsdf.eval_and_pdf(wo, wi, Transport::Radiance));
    assert!((a.g - b.g).abs() < 1e-6 && (p.0 - q.0).abs() < 1e-6 && b.g > 0.0);
    assert!(ZOO.get("null").resolve(&leaning(), wo).is_black());
    let features = |name: &str| ZOO.get(name).features();
    assert!(!features("mask").delta && features("mask_two_sided").delta && !features("null").scatters);
}

/// Sides with different holes: light meets the same holes from either side.
#[test]
fn two_sided_materials_have_the_holes_of_both_sides() {
    let mask = |opacity: f32| BsdfKind::Mask { nested: BsdfId(0), opacity: num(opacity) };
    let of = |front: u32, back: u32| BsdfKind::TwoSided { front: BsdfId(front), back: BsdfId(back) };
    let (set, messages) = messages(vec![grey(), mask(0.3), mask(0.8), of(1, 2), of(1, 0)]);
    assert!(messages.is_empty(), "{messages:?}");
    let holes = |i: u32| set.get(Some(BsdfId(i))).holes(&flat());
    assert!((holes(3) - 0.2).abs() < 1e-6 && holes(4) == 0.0);
}

#[test]
fn a_bsdf_is_a_small_value() {
    assert!(std::mem::size_of::<crate::shade::Bsdf>() <= 1024, "{}", std::mem::size_of::<crate::shade::Bsdf>());
}
