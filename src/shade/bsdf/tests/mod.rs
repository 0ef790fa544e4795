//! Tests of all models together, on a zoo of materials.

mod build;
mod mitsuba;
mod mitsuba_data;
mod physics;
mod sampling;

use super::{Material, MaterialSet};
use crate::image::{Image, Pixels};
use crate::math::hash::HashRng;
use crate::math::{Frame, Rgb, Vec2, Vec3, warp};
use crate::scene::*;
use crate::shade::{SurfacePoint, TextureSet};
use std::sync::{Arc, LazyLock};

/// Named materials.
pub struct Zoo {
    set: MaterialSet,
    names: Vec<(String, BsdfId)>,
}

impl Zoo {
    pub fn get(&self, name: &str) -> &Material {
        let (_, id) = self.names.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no material {name}"));
        self.set.get(Some(*id))
    }

    pub fn all(&self) -> impl Iterator<Item = (&str, &Material)> {
        self.names.iter().map(|(n, id)| (n.as_str(), self.set.get(Some(*id))))
    }
}

pub fn rgb(r: f32, g: f32, b: f32) -> ColorDesc {
    ColorDesc::Constant(Rgb::new(r, g, b))
}

pub fn white() -> ColorDesc {
    rgb(1.0, 1.0, 1.0)
}

pub fn num(v: f32) -> ScalarDesc {
    ScalarDesc::Constant(v)
}

pub fn rough(distribution: Distribution, u: f32, v: f32, sample_visible: bool) -> Roughness {
    Roughness { distribution, alpha_u: num(u), alpha_v: num(v), sample_visible }
}

const GOLD: ComplexIor =
    ComplexIor { eta: ColorDesc::Constant(Rgb::new(0.2, 0.4, 1.3)), k: ColorDesc::Constant(Rgb::new(3.9, 2.4, 1.8)) };

pub fn gold(roughness: Roughness, tint: ColorDesc) -> RoughConductorParams {
    RoughConductorParams { roughness, ior: GOLD, specular_reflectance: tint }
}

/// Principled parameters: a plain base, changed by `f`.
pub fn principled(f: impl FnOnce(&mut PrincipledParams)) -> PrincipledParams {
    let mut p = PrincipledParams::read(&mut TestParams::Default);
    p.base_color = rgb(0.7, 0.4, 0.2);
    f(&mut p);
    p
}

/// Refractive index of all models that are read from [`TestParams`].
pub const TEST_IOR: f32 = 1.5;

/// Parameters for any model of the table.
pub enum TestParams {
    /// Every parameter has its default.
    Default,
    /// Every colour and number comes from the given texture.
    Textured(TextureId),
    /// Every number is constant and below the one before, starting below the given one.
    Varied(f32),
}

impl ParamSource for TestParams {
    fn color(&mut self, _: &'static str, default: f32) -> ColorDesc {
        match self {
            TestParams::Textured(id) => ColorDesc::Texture(*id),
            _ => ColorDesc::Constant(Rgb::grey(default)),
        }
    }

    fn scalar(&mut self, _: &'static str, default: f32) -> ScalarDesc {
        match self {
            TestParams::Default => num(default),
            TestParams::Textured(id) => ScalarDesc::Texture(*id),
            TestParams::Varied(next) => {
                *next -= 0.06;
                num(*next)
            }
        }
    }

    fn flag(&mut self, _: &'static str, default: bool) -> bool {
        default
    }

    fn relative_ior(&mut self, _: f64) -> f32 {
        TEST_IOR
    }

    fn principled_ior(&mut self) -> f32 {
        TEST_IOR
    }

    fn complex_ior(&mut self) -> ComplexIor {
        match self {
            TestParams::Textured(id) => ComplexIor { eta: ColorDesc::Texture(*id), k: ColorDesc::Texture(*id) },
            _ => GOLD,
        }
    }

    fn roughness(&mut self) -> Roughness {
        // Wide enough for the numerical integrals of densities.
        let (alpha_u, alpha_v) = (self.scalar("alpha_u", 0.4), self.scalar("alpha_v", 0.4));
        Roughness { distribution: Distribution::Beckmann, alpha_u, alpha_v, sample_visible: true }
    }

    fn ward_variant(&mut self, _: &'static str, default: WardVariant) -> WardVariant {
        default
    }
}

pub fn float_image(width: u32, height: u32, channels: u32, values: &[f32]) -> ImageDesc {
    let image = Image { width, height, channels, pixels: Pixels::F32(values.to_vec()) };
    ImageDesc { path: "test".into(), image: Arc::new(image) }
}

pub fn bitmap(image: u32) -> TextureDesc {
    TextureDesc::Bitmap {
        image: ImageId(image),
        to_uv: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        filter: TextureFilter::Bilinear,
        wrap: WrapMode::Repeat,
        scale: 1.0,
    }
}

/// Builds materials; panics on any diagnostic.
pub struct ZooBuilder {
    pub bsdfs: Vec<BsdfDesc>,
    names: Vec<(String, BsdfId)>,
}

impl ZooBuilder {
    pub fn new() -> ZooBuilder {
        ZooBuilder { bsdfs: Vec::new(), names: Vec::new() }
    }

    pub fn add(&mut self, kind: impl Into<BsdfKind>) -> BsdfId {
        self.bsdfs.push(BsdfDesc { name: None, kind: kind.into(), span: None });
        BsdfId(self.bsdfs.len() as u32 - 1)
    }

    pub fn name(&mut self, name: impl Into<String>, kind: impl Into<BsdfKind>) -> BsdfId {
        let id = self.add(kind);
        self.names.push((name.into(), id));
        id
    }

    /// Every model of the table, named after it: with default, textured and varied parameters.
    pub fn models(&mut self, texture: TextureId) {
        for model in MODELS {
            let sources = [
                ("default", TestParams::Default),
                ("textured", TestParams::Textured(texture)),
                ("varied", TestParams::Varied(0.9)),
            ];
            for (variant, mut params) in sources {
                self.name(format!("{} {variant}", model.name), BsdfKind::Model((model.read)(&mut params)));
            }
        }
    }

    pub fn build(self, textures: &[TextureDesc], images: &[ImageDesc]) -> Zoo {
        let mut diagnostics = Diagnostics::default();
        let textures = TextureSet::build(textures, images, &mut diagnostics);
        let set = MaterialSet::build(&self.bsdfs, &textures, &mut diagnostics);
        assert!(diagnostics.list.is_empty(), "{:?}", diagnostics.list);
        Zoo { set, names: self.names }
    }
}

/// Every model, with and without nesting.
pub static ZOO: LazyLock<Zoo> = LazyLock::new(|| {
    use Distribution::{Beckmann, Ggx};
    let mut z = ZooBuilder::new();
    let orange = || DiffuseParams { reflectance: rgb(0.8, 0.4, 0.1) };
    let tints = (rgb(0.9, 0.8, 0.7), rgb(0.5, 0.6, 0.9));
    let glass = |roughness, eta, (specular_reflectance, specular_transmittance)| RoughDielectricParams {
        specular_reflectance,
        specular_transmittance,
        roughness,
        eta,
    };
    let brown = rgb(0.6, 0.3, 0.1);
    let diffuse = z.name("diffuse", orange());
    z.name("dielectric", DielectricParams { eta: 1.5, specular_reflectance: tints.0, specular_transmittance: tints.1 });
    z.name("thin", ThinDielectricParams { eta: 1.5, specular_reflectance: tints.0, specular_transmittance: tints.1 });
    let polished = z.name("conductor", ConductorParams { ior: GOLD, specular_reflectance: white() });
    z.name("rough_conductor_ggx", gold(rough(Ggx, 0.3, 0.1, true), tints.0));
    z.name("rough_conductor_beckmann", gold(rough(Beckmann, 0.4, 0.4, true), white()));
    z.name("rough_conductor_all_normals", gold(rough(Beckmann, 0.25, 0.25, false), white()));
    let frosted = z.name("rough_dielectric_ggx", glass(rough(Ggx, 0.4, 0.2, true), 1.5, tints));
    z.name("rough_dielectric_beckmann", glass(rough(Beckmann, 0.5, 0.5, true), 1.33, (white(), white())));
    z.name("rough_dielectric_all_normals", glass(rough(Ggx, 0.3, 0.3, false), 1.5, (white(), white())));
    for (name, eta, nonlinear) in [("plastic", 1.49, false), ("plastic_nonlinear", 1.9, true)] {
        let kind = PlasticParams { eta, diffuse_reflectance: brown, specular_reflectance: white(), nonlinear };
        z.name(name, kind);
    }
    z.name(
        "rough_plastic_ggx",
        RoughPlasticParams {
            roughness: rough(Ggx, 0.2, 0.2, true),
            eta: 1.49,
            diffuse_reflectance: brown,
            specular_reflectance: white(),
            nonlinear: false,
        },
    );
    z.name(
        "rough_plastic_beckmann",
        RoughPlasticParams {
            roughness: rough(Beckmann, 0.4, 0.4, true),
            eta: 1.7,
            diffuse_reflectance: brown,
            specular_reflectance: rgb(0.7, 0.7, 0.7),
            nonlinear: true,
        },
    );
    z.name(
        "pplastic",
        PolarizedPlasticParams {
            roughness: rough(Ggx, 0.3, 0.15, true),
            eta: 1.6,
            diffuse_reflectance: brown,
            specular_reflectance: tints.0,
        },
    );
    z.name("principled_plain", principled(|p| p.roughness = num(0.4)));
    z.name(
        "principled_opaque",
        principled(|p| {
            p.anisotropic = num(0.6);
            p.metallic = num(0.3);
            p.eta = 1.45;
            p.spec_tint = num(0.7);
            p.sheen = num(0.8);
            p.sheen_tint = num(0.4);
            p.flatness = num(0.5);
            p.clearcoat = num(0.9);
            p.clearcoat_gloss = num(0.3);
        }),
    );
    z.name(
        "principled_glass",
        principled(|p| {
            p.base_color = rgb(0.9, 0.7, 0.8);
            p.spec_trans = num(0.8);
            p.metallic = num(0.1);
            p.eta = 1.4;
            p.spec_tint = num(0.2);
            p.clearcoat = num(0.5);
            p.clearcoat_gloss = num(0.1);
            p.anisotropic = num(0.3);
        }),
    );
    z.name(
        "phong",
        PhongParams {
            exponent: num(12.0),
            specular_reflectance: rgb(0.5, 0.3, 0.2),
            diffuse_reflectance: rgb(0.2, 0.3, 0.4),
        },
    );
    for (name, variant) in
        [("ward", WardVariant::Ward), ("ward_duer", WardVariant::WardDuer), ("ward_balanced", WardVariant::Balanced)]
    {
        let kind = WardParams {
            alpha_u: num(0.2),
            alpha_v: num(0.4),
            variant,
            specular_reflectance: rgb(0.5, 0.3, 0.2),
            diffuse_reflectance: rgb(0.2, 0.3, 0.4),
        };
        z.name(name, kind);
    }
    z.name("null", BsdfKind::Null);
    let two_sided = z.name("two_sided", BsdfKind::TwoSided { front: diffuse, back: polished });
    let satin = z.add(gold(rough(Ggx, 0.3, 0.3, true), white()));
    z.name("blend", BsdfKind::Blend { weight: num(0.3), a: diffuse, b: satin });
    let both = z.add(BsdfKind::TwoSided { front: diffuse, back: diffuse });
    let mask = z.name("mask", BsdfKind::Mask { nested: both, opacity: num(0.4) });
    z.name("mask_two_sided", BsdfKind::Mask { nested: two_sided, opacity: num(0.7) });
    let one_sided_mix = z.name("blend_glass", BsdfKind::Blend { weight: num(0.6), a: diffuse, b: frosted });
    z.name("blend_mask", BsdfKind::Blend { weight: num(0.25), a: one_sided_mix, b: mask });
    let brushed = z.add(gold(rough(Ggx, 0.5, 0.2, true), white()));
    let bump = |nested| BsdfKind::BumpMap { nested, height: TextureId(0), scale: 0.3 };
    z.name("bump_diffuse", bump(diffuse));
    let bumped = z.name("bump_conductor", bump(brushed));
    let clear = z.add(glass(rough(Ggx, 0.4, 0.2, true), 1.5, (white(), white())));
    z.name("normal_map", BsdfKind::NormalMap { nested: clear, normals: TextureId(1) });
    let coat = |nested, sigma_a| {
        let specular_reflectance = rgb(0.9, 0.8, 0.7);
        BsdfKind::Coating(CoatingDesc { nested, eta: 1.5, sigma_a, thickness: 0.5, specular_reflectance })
    };
    let absorbing = rgb(0.1, 0.5, 1.0);
    z.name("coating_diffuse", coat(diffuse, rgb(0.0, 0.0, 0.0)));
    let lacquer = z.name("coating_rough_conductor", coat(brushed, absorbing));
    z.name("coating_conductor", coat(polished, absorbing));
    z.name("coating_bump", coat(bumped, absorbing));
    z.name("coating_coating", coat(lacquer, absorbing));
    z.name("bump_coating", bump(lacquer));
    z.name("two_sided_coating", BsdfKind::TwoSided { front: lacquer, back: diffuse });
    z.name("two_sided_bump", BsdfKind::TwoSided { front: bumped, back: bumped });
    let brushed_both = z.add(BsdfKind::TwoSided { front: brushed, back: brushed });
    z.name("bump_two_sided", bump(brushed_both));
    z.name("bump_bump", bump(bumped));
    z.name("bump_mirror", bump(polished));
    z.models(TextureId(0));
    let height = float_image(3, 2, 1, &[0.1, 0.5, 0.3, 0.7, 0.2, 0.9]);
    let normals = float_image(2, 2, 3, &[0.6, 0.55, 0.9, 0.3, 0.5, 0.8, 0.5, 0.8, 0.85, 0.45, 0.2, 0.7]);
    z.build(&[bitmap(0), bitmap(1)], &[height, normals])
});

/// A point whose shading normal is `ns` and geometric normal `ng`.
pub fn point(ns: Vec3, ng: Vec3) -> SurfacePoint {
    SurfacePoint {
        p: Vec3::ZERO,
        error: 0.0,
        ng,
        frame: if ns == Vec3::Z { Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z } } else { Frame::from_normal(ns) },
        uv: Vec2::new(0.3, 0.6),
        dpdu: Vec3::X,
        dpdv: Vec3::new(-0.1, 0.9, 0.0),
        color: Rgb::WHITE,
    }
}

/// A flat point in the plane z = 0.
pub fn flat() -> SurfacePoint {
    point(Vec3::Z, Vec3::Z)
}

/// A point whose shading normal leans.
pub fn leaning() -> SurfacePoint {
    point(Vec3::new(0.2, -0.3, 0.9).normalize(), Vec3::new(-0.1, 0.1, 1.0).normalize())
}

pub fn random_direction(rng: &mut HashRng) -> Vec3 {
    warp::square_to_sphere([rng.next_f32(), rng.next_f32()])
}

pub fn next3(rng: &mut HashRng) -> [f32; 3] {
    [rng.next_f32(), rng.next_f32(), rng.next_f32()]
}
