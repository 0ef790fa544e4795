//! Materials of a scene: trees with their textures, built once, and resolved at every shading point.

use super::Bsdf;
use super::builder::{Builder, Subtree};
use super::diffuse::Lambert;
use super::features::Features;
use super::node::{Node, Resolver, VisibleSide};
use super::view::{LobeSum, Scattering};
use crate::math::{Frame, Rgb, Vec3};
use crate::scene::{BsdfDesc, BsdfId, Diagnostic, Diagnostics};
use crate::shade::SurfacePoint;
use crate::shade::texture::{ColorTexture, TextureSet};

/// One side of a material that is constant and Lambertian.
#[derive(Clone, Copy, Debug)]
struct LambertianSide {
    reflectance: Rgb,
    /// Factor of the shading normal that makes it point to the side that reflects; see [`VisibleSide`].
    normal_sign: f32,
}

impl LambertianSide {
    fn new(side: &VisibleSide) -> Option<LambertianSide> {
        let &ColorTexture::Constant(reflectance) = side.diffuse()? else { return None };
        let reflectance = if side.from_back { Rgb::BLACK } else { reflectance };
        Some(LambertianSide { reflectance, normal_sign: side.normal_sign })
    }
}

/// A material with its textures, shared by many points.
#[derive(Debug)]
pub struct Material {
    node: Node,
    features: Features,
    /// Constant and zero everywhere: it scatters nothing.
    black: bool,
    /// Front and back, if both are constant and Lambertian.
    lambertian: Option<[LambertianSide; 2]>,
}

impl Material {
    fn new(Subtree { node, features, black, .. }: Subtree) -> Material {
        let side = |from_back| LambertianSide::new(&node.visible_side(from_back));
        let lambertian = side(false).zip(side(true)).map(|(front, back)| [front, back]);
        Material { node, features, black, lambertian }
    }

    /// Mitsuba's material of shapes that name none: a diffuse reflectance of one half.
    fn default_material() -> Material {
        let features = Features { smooth: true, scatters: true, ..Features::default() };
        Material::new(Subtree::leaf(Node::lambertian(Rgb::grey(0.5)), features))
    }

    /// The share of light that goes straight through at `point`, as if there were no surface, in [0, 1].
    #[inline]
    pub fn holes(&self, point: &SurfacePoint) -> f32 {
        if self.features.passes_through { self.node.holes(point) } else { 0.0 }
    }

    /// Looks up every texture at `point` for a walk that arrived from `wo`. The BSDF is that of the surface between its
    /// holes: of a mask, the one that it covers.
    #[inline]
    pub fn resolve(&self, point: &SurfacePoint, wo: Vec3) -> Bsdf {
        let mut bsdf = Bsdf::empty(point);
        self.resolve_into(&mut bsdf, point, wo);
        bsdf
    }

    /// [`Material::resolve`] in place, for loops: a BSDF is large, and most of it is unused most of the time.
    #[inline]
    pub fn resolve_into(&self, bsdf: &mut Bsdf, point: &SurfacePoint, wo: Vec3) {
        if let Some(sides) = &self.lambertian {
            // Indexed by the sign bit: the visible side is hard to predict, so there is no branch.
            let cos = wo.dot(point.frame.n);
            let LambertianSide { reflectance, normal_sign } = sides[(cos.to_bits() >> 31) as usize];
            bsdf.begin(point, Scattering::Lambertian(Lambert { n: point.frame.n * normal_sign, reflectance }));
            return;
        }
        self.resolve_general(bsdf, point, wo);
    }

    fn resolve_general(&self, bsdf: &mut Bsdf, point: &SurfacePoint, wo: Vec3) {
        if !self.features.opaque() {
            bsdf.begin(point, Scattering::Lobes(LobeSum::new(point.frame)));
            let weight = if self.features.passes_through { 1.0 / (1.0 - self.holes(point)) } else { 1.0 };
            if weight.is_finite() {
                Resolver { point, only_side: None, bsdf }.root(&self.node, weight);
            }
            return;
        }
        let side = self.node.visible_side(wo.dot(point.frame.n) <= 0.0);
        let n = point.frame.n * side.normal_sign;
        if let Some(reflectance) = side.diffuse()
            && !side.from_back
        {
            bsdf.begin(point, Scattering::Lambertian(Lambert { n, reflectance: reflectance.eval(point) }));
            return;
        }
        bsdf.begin(point, Scattering::Lobes(LobeSum::new(Frame { n, ..point.frame })));
        Resolver { point, only_side: Some(usize::from(side.from_back)), bsdf }.root(side.node, 1.0);
    }

    /// Properties that hold at every point.
    pub fn features(&self) -> Features {
        self.features
    }

    /// True if the material scatters nothing anywhere: a walk may end at it.
    pub fn is_black(&self) -> bool {
        self.black
    }
}

/// All materials of a scene.
#[derive(Debug)]
pub struct MaterialSet {
    materials: Vec<Material>,
    /// Material of shapes that name none.
    default: Material,
}

impl MaterialSet {
    /// Builds every material. One that cannot be built (nested in itself, too many lobes, glass inside a two-sided
    /// material) is reported as an error and replaced by the default.
    pub fn build(descs: &[BsdfDesc], textures: &TextureSet, diagnostics: &mut Diagnostics) -> MaterialSet {
        let mut materials = Vec::with_capacity(descs.len());
        for (i, desc) in descs.iter().enumerate() {
            let tree = Builder::new(descs, textures).material(BsdfId(i as u32));
            let report = |error| {
                let name =
                    desc.name.as_deref().map_or_else(|| format!("material {i}"), |n| format!("material \"{n}\""));
                let message = format!("{name}: {error}");
                diagnostics.push(Diagnostic::error("scene::material", message).at(desc.span.clone()));
                Material::default_material()
            };
            materials.push(tree.map_or_else(report, Material::new));
        }
        MaterialSet { materials, default: Material::default_material() }
    }

    /// The material of a shape; the default one for `None`.
    #[inline]
    pub fn get(&self, id: Option<BsdfId>) -> &Material {
        id.and_then(|id| self.materials.get(id.index())).unwrap_or(&self.default)
    }

    /// Features that any of the materials or the default has.
    pub fn features(&self) -> Features {
        self.materials.iter().fold(self.default.features, |f, m| f.union(m.features))
    }
}
