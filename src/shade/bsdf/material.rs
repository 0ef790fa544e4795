//! Materials of a scene: descriptions checked and turned into trees, once, and what can be known of them without a point.

use super::diffuse::Lambert;
use super::link::ROOT;
use super::microfacet::Microfacets;
use super::node::{Node, PrincipledNode, Resolver, Roughness};
use super::rough_plastic::Coat;
use super::{Bsdf, MAX_LEAVES, MAX_LINKS, Scattering};
use crate::math::{Frame, Rgb, Vec3};
use crate::scene::{BsdfDesc, BsdfId, BsdfKind, Diagnostic, Diagnostics, PrincipledDesc, RoughnessDesc, ScalarDesc};
use crate::shade::SurfacePoint;
use crate::shade::texture::{ColorTexture, ScalarTexture, TextureSet};

/// What a material can do anywhere on a surface, known before any point is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Some parameter comes from a texture.
    pub textured: bool,
    /// Some lobe has discrete directions (mirrors, glass, masks).
    pub delta: bool,
    /// Some lobe has a density: connections and light samples can reach it.
    pub smooth: bool,
    /// Light crosses the surface and is refracted or passes a pane.
    pub transmissive: bool,
    /// Light may go straight on as if nothing were there (mask, null).
    pub passes_through: bool,
    /// Normals are tilted by a bump or normal map.
    pub tilted: bool,
    /// Seen from behind it scatters light as well.
    pub two_sided: bool,
}

impl Features {
    /// No light ever crosses the surface.
    pub fn opaque(&self) -> bool {
        !self.transmissive && !self.passes_through
    }

    fn union(self, o: Features) -> Features {
        Features {
            textured: self.textured || o.textured,
            delta: self.delta || o.delta,
            smooth: self.smooth || o.smooth,
            transmissive: self.transmissive || o.transmissive,
            passes_through: self.passes_through || o.passes_through,
            tilted: self.tilted || o.tilted,
            two_sided: self.two_sided || o.two_sided,
        }
    }
}

/// One side of a material that is constant and Lambertian.
#[derive(Clone, Copy, Debug)]
struct Side {
    reflectance: Rgb,
    /// What the normal is multiplied by to be on the side that reflects: 1 on a back that does not, which nothing can then be seen from.
    turn: f32,
}

/// A material with its textures, shared by many points.
#[derive(Debug)]
pub struct Material {
    node: Node,
    features: Features,
    /// Constant and zero everywhere: it scatters nothing.
    black: bool,
    /// Front and back, where one constant Lambertian lobe a side is all there is.
    lambert: Option<[Side; 2]>,
}

impl Material {
    fn new(part: Part) -> Material {
        let constant = |node: &Node| match node {
            Node::Diffuse { reflectance: ColorTexture::Constant(reflectance) } => Some(*reflectance),
            _ => None,
        };
        let side = |reflectance, turn| Side { reflectance, turn };
        let lambert = match &part.node {
            Node::TwoSided { front, back } => {
                constant(front).zip(constant(back)).map(|(f, b)| [side(f, 1.0), side(b, -1.0)])
            }
            node => constant(node).map(|front| [side(front, 1.0), side(Rgb::BLACK, 1.0)]),
        };
        Material { node: part.node, features: part.features, black: part.black, lambert }
    }

    /// Looks up every texture at `point` for a walk that arrived from `wo`.
    #[inline]
    pub fn resolve(&self, point: &SurfacePoint, wo: Vec3) -> Bsdf {
        let mut bsdf = Bsdf::empty(point);
        self.resolve_into(&mut bsdf, point, wo);
        bsdf
    }

    /// [`Material::resolve`] in place, for loops: a BSDF is large, and most of it is unused most of the time.
    #[inline]
    pub fn resolve_into(&self, bsdf: &mut Bsdf, point: &SurfacePoint, wo: Vec3) {
        if let Some(sides) = &self.lambert {
            // By the bit of the sign: which side is seen is hard to guess, so there is no branch.
            let cos = wo.dot(point.frame.n);
            let Side { reflectance, turn } = sides[(cos.to_bits() >> 31) as usize];
            bsdf.begin(point, Scattering::Lambertian(Lambert { n: point.frame.n * turn, reflectance }));
            return;
        }
        self.resolve_general(bsdf, point, wo);
    }

    fn resolve_general(&self, bsdf: &mut Bsdf, point: &SurfacePoint, wo: Vec3) {
        let mut frame = point.frame;
        let mut node = &self.node;
        let mut only_side = None;
        if self.features.opaque() {
            let mut behind = wo.dot(point.frame.n) <= 0.0;
            // The commonest nesting needs no frame of its own.
            if let Node::TwoSided { front, back } = node {
                node = if behind { back } else { front };
                if behind {
                    frame = Frame { n: -point.frame.n, ..point.frame };
                    behind = false;
                }
            }
            if let Node::Diffuse { reflectance } = node
                && !behind
            {
                bsdf.begin(point, Scattering::Lambertian(Lambert { n: frame.n, reflectance: reflectance.eval(point) }));
                return;
            }
            only_side = Some(usize::from(behind));
        }
        bsdf.begin(point, Scattering::Lobes { frame, pick_scale: [0.0; 2] });
        Resolver { point, only_side, bsdf }.root(node, ROOT);
    }

    /// What the material can do.
    pub fn features(&self) -> Features {
        self.features
    }

    /// True if it scatters nothing anywhere: a walk may end at it.
    pub fn is_black(&self) -> bool {
        self.black
    }
}

/// All materials of a scene.
#[derive(Debug)]
pub struct MaterialSet {
    materials: Vec<Material>,
    /// Mitsuba's material of shapes that name none: a diffuse reflectance of one half.
    default: Material,
}

impl MaterialSet {
    /// Builds every material. One that cannot be built (nested in itself, too many lobes, glass inside a two-sided material) is
    /// reported as an error and replaced by the default.
    pub fn build(descs: &[BsdfDesc], textures: &TextureSet, diagnostics: &mut Diagnostics) -> MaterialSet {
        let mut materials = Vec::with_capacity(descs.len());
        for (i, desc) in descs.iter().enumerate() {
            let material = Builder { descs, textures, nodes: 0 }.material(BsdfId(i as u32)).unwrap_or_else(|what| {
                let name =
                    desc.name.as_deref().map_or_else(|| format!("material {i}"), |n| format!("material \"{n}\""));
                diagnostics.push(Diagnostic::error("scene::material", format!("{name}: {what}")).at(desc.span.clone()));
                default_material()
            });
            materials.push(material);
        }
        MaterialSet { materials, default: default_material() }
    }

    /// The material of a shape; the default one for `None`.
    #[inline]
    pub fn get(&self, id: Option<BsdfId>) -> &Material {
        id.and_then(|id| self.materials.get(id.index())).unwrap_or(&self.default)
    }

    /// All that any of the materials, or the default, can do.
    pub fn features(&self) -> Features {
        self.materials.iter().fold(self.default.features, |f, m| f.union(m.features))
    }
}

fn default_material() -> Material {
    Material::new(Part::leaf(Node::lambert(Rgb::grey(0.5)), smooth()))
}

/// Trees deeper than this are taken for circles.
const MAX_DEPTH: u32 = 32;
/// Relative indices nearer to one than this make half vectors meaningless; rough interfaces are kept this far away.
const MIN_ETA_DIFFERENCE: f32 = 1e-3;

/// Most nodes of a tree: materials that share children can be exponentially larger than their descriptions.
const MAX_NODES: u32 = 256;

struct Builder<'a> {
    descs: &'a [BsdfDesc],
    textures: &'a TextureSet,
    /// Nodes built so far.
    nodes: u32,
}

/// A subtree and its demands.
struct Part {
    node: Node,
    features: Features,
    /// Most lobes at a point.
    leaves: usize,
    /// Most frames at a point.
    links: usize,
    black: bool,
}

impl Part {
    fn leaf(node: Node, features: Features) -> Part {
        Part { node, features, leaves: 1, links: 0, black: false }
    }
}

fn smooth() -> Features {
    Features { smooth: true, ..Features::default() }
}

fn away_from_one(eta: f32) -> f32 {
    if (eta - 1.0).abs() < MIN_ETA_DIFFERENCE { 1.0 + MIN_ETA_DIFFERENCE.copysign(eta - 1.0) } else { eta }
}

fn refractive(eta: f32) -> Result<f32, String> {
    if eta.is_finite() && eta > 0.0 { Ok(eta) } else { Err(format!("a refractive index of {eta} is not positive")) }
}

impl Builder<'_> {
    fn material(&mut self, id: BsdfId) -> Result<Material, String> {
        let part = self.part(id, 0)?;
        if part.leaves > MAX_LEAVES {
            return Err(format!("it mixes {} lobes; at most {MAX_LEAVES} are supported", part.leaves));
        }
        if part.links > MAX_LINKS {
            return Err(format!("it nests {} frames; at most {MAX_LINKS} are supported", part.links));
        }
        Ok(Material::new(part))
    }

    fn part(&mut self, id: BsdfId, depth: u32) -> Result<Part, String> {
        let desc = self.descs.get(id.index()).ok_or("it refers to a material that does not exist")?;
        self.nodes += 1;
        if depth > MAX_DEPTH || self.nodes > MAX_NODES {
            return Err("it is nested in itself, or too deeply".into());
        }
        let textures = self.textures;
        let color = |c: &crate::scene::ColorDesc| textures.color(*c);
        let scalar = |s: &ScalarDesc| textures.scalar(*s);
        let delta = Features { delta: true, ..Features::default() };
        let glass = Features { transmissive: true, two_sided: true, ..Features::default() };
        let mut part = match &desc.kind {
            BsdfKind::Diffuse { reflectance } => {
                let reflectance = color(reflectance);
                let black = !reflectance.is_textured() && reflectance.mean().is_black();
                Part { black, ..Part::leaf(Node::Diffuse { reflectance }, smooth()) }
            }
            BsdfKind::Dielectric { eta, specular_reflectance, specular_transmittance } => Part::leaf(
                Node::Dielectric {
                    eta: refractive(*eta)?,
                    reflectance: color(specular_reflectance),
                    transmittance: color(specular_transmittance),
                },
                delta.union(glass),
            ),
            BsdfKind::ThinDielectric { eta, specular_reflectance, specular_transmittance } => Part::leaf(
                Node::ThinDielectric {
                    eta: refractive(*eta)?,
                    reflectance: color(specular_reflectance),
                    transmittance: color(specular_transmittance),
                },
                delta.union(glass),
            ),
            BsdfKind::RoughDielectric { roughness, eta, specular_reflectance, specular_transmittance } => Part::leaf(
                Node::RoughDielectric {
                    roughness: self.roughness(roughness),
                    eta: away_from_one(refractive(*eta)?),
                    reflectance: color(specular_reflectance),
                    transmittance: color(specular_transmittance),
                },
                smooth().union(glass),
            ),
            BsdfKind::Conductor { eta, k, specular_reflectance } => {
                Part::leaf(Node::Conductor { eta: color(eta), k: color(k), tint: color(specular_reflectance) }, delta)
            }
            BsdfKind::RoughConductor { roughness, eta, k, specular_reflectance } => Part::leaf(
                Node::RoughConductor {
                    roughness: self.roughness(roughness),
                    eta: color(eta),
                    k: color(k),
                    tint: color(specular_reflectance),
                },
                smooth(),
            ),
            BsdfKind::Plastic { eta, diffuse_reflectance, specular_reflectance, nonlinear } => Part::leaf(
                Node::Plastic {
                    eta: refractive(*eta)?,
                    diffuse: color(diffuse_reflectance),
                    specular: color(specular_reflectance),
                    nonlinear: *nonlinear,
                },
                delta.union(smooth()),
            ),
            BsdfKind::RoughPlastic { roughness, eta, diffuse_reflectance, specular_reflectance, nonlinear } => {
                let eta = away_from_one(refractive(*eta)?);
                // The coat's table is for one roughness; a texture counts by its mean (Mitsuba takes numbers only).
                let alpha = scalar(&roughness.alpha_u).mean();
                let facets = Microfacets::new(roughness.distribution, alpha, alpha, roughness.sample_visible);
                Part::leaf(
                    Node::RoughPlastic {
                        facets,
                        coat: Coat::get(roughness.distribution, alpha, eta),
                        eta,
                        diffuse: color(diffuse_reflectance),
                        specular: color(specular_reflectance),
                        nonlinear: *nonlinear,
                    },
                    smooth(),
                )
            }
            BsdfKind::Principled(p) => self.principled(p)?,
            BsdfKind::Phong { exponent, specular_reflectance, diffuse_reflectance } => Part::leaf(
                Node::Phong {
                    exponent: scalar(exponent),
                    diffuse: color(diffuse_reflectance),
                    specular: color(specular_reflectance),
                },
                smooth(),
            ),
            BsdfKind::Ward { alpha_u, alpha_v, variant, specular_reflectance, diffuse_reflectance } => Part::leaf(
                Node::Ward {
                    alpha_u: scalar(alpha_u),
                    alpha_v: scalar(alpha_v),
                    variant: *variant,
                    diffuse: color(diffuse_reflectance),
                    specular: color(specular_reflectance),
                },
                smooth(),
            ),
            BsdfKind::Null => Part::leaf(
                Node::Null,
                Features { delta: true, passes_through: true, two_sided: true, ..Features::default() },
            ),
            BsdfKind::TwoSided { front, back } => self.two_sided(*front, *back, depth)?,
            BsdfKind::Mask { nested, opacity } => {
                let nested = self.part(*nested, depth + 1)?;
                let holes = Features { delta: true, passes_through: true, two_sided: true, ..Features::default() };
                Part {
                    features: nested.features.union(holes),
                    leaves: nested.leaves + 1,
                    links: nested.links,
                    black: false,
                    node: Node::Mask { nested: Box::new(nested.node), opacity: scalar(opacity) },
                }
            }
            BsdfKind::Blend { weight, a, b } => {
                let (a, b) = (self.part(*a, depth + 1)?, self.part(*b, depth + 1)?);
                Part {
                    features: a.features.union(b.features),
                    leaves: a.leaves + b.leaves,
                    links: a.links + b.links,
                    black: a.black && b.black,
                    node: Node::Blend { weight: scalar(weight), a: Box::new(a.node), b: Box::new(b.node) },
                }
            }
            BsdfKind::BumpMap { nested, height, scale } => {
                let height = self.textures.get(*height).ok_or("its height map could not be read")?.clone();
                let part = self.part(*nested, depth + 1)?;
                tilted(part, |nested| Node::BumpMap { nested, height, scale: *scale })
            }
            BsdfKind::NormalMap { nested, normals } => {
                let normals = self.textures.get(*normals).ok_or("its normal map could not be read")?.clone();
                let part = self.part(*nested, depth + 1)?;
                tilted(part, |nested| Node::NormalMap { nested, normals })
            }
        };
        part.features.textured |= textured(&desc.kind);
        Ok(part)
    }

    fn two_sided(&mut self, front: BsdfId, back: BsdfId, depth: u32) -> Result<Part, String> {
        let (front, back) = (self.part(front, depth + 1)?, self.part(back, depth + 1)?);
        let features = front.features.union(back.features);
        if features.transmissive {
            return Err("a two-sided material cannot hold one that refracts light".into());
        }
        Ok(Part {
            features: Features { two_sided: true, ..features },
            // Where nothing passes, only one side is looked at; a mask further out is only known at the root.
            leaves: front.leaves + back.leaves,
            links: front.links + back.links + 1,
            black: front.black && back.black,
            node: Node::TwoSided { front: Box::new(front.node), back: Box::new(back.node) },
        })
    }

    fn roughness(&self, desc: &RoughnessDesc) -> Roughness {
        Roughness {
            distribution: desc.distribution,
            alpha_u: self.textures.scalar(desc.alpha_u),
            alpha_v: self.textures.scalar(desc.alpha_v),
            visible: desc.sample_visible,
        }
    }

    fn principled(&self, p: &PrincipledDesc) -> Result<Part, String> {
        let scalar = |s: ScalarDesc| self.textures.scalar(s);
        let spec_trans = scalar(p.spec_trans);
        let refracts = !matches!(spec_trans, ScalarTexture::Constant(0.0));
        let eta = refractive(p.eta)?;
        let eta = if refracts { away_from_one(eta) } else { eta };
        let node = PrincipledNode {
            base_color: self.textures.color(p.base_color),
            eta,
            roughness: scalar(p.roughness),
            anisotropic: scalar(p.anisotropic),
            metallic: scalar(p.metallic),
            spec_trans,
            spec_tint: scalar(p.spec_tint),
            sheen: scalar(p.sheen),
            sheen_tint: scalar(p.sheen_tint),
            flatness: scalar(p.flatness),
            clearcoat: scalar(p.clearcoat),
            clearcoat_gloss: scalar(p.clearcoat_gloss),
        };
        let features = Features { smooth: true, transmissive: refracts, two_sided: refracts, ..Features::default() };
        Ok(Part::leaf(Node::Principled(Box::new(node)), features))
    }
}

fn tilted(nested: Part, node: impl FnOnce(Box<Node>) -> Node) -> Part {
    Part {
        features: Features { tilted: true, textured: true, ..nested.features },
        leaves: nested.leaves,
        links: nested.links + 1,
        black: nested.black,
        node: node(Box::new(nested.node)),
    }
}

/// True if a parameter of this node itself is looked up.
fn textured(kind: &BsdfKind) -> bool {
    use crate::scene::ColorDesc;
    let color = |c: &ColorDesc| matches!(c, ColorDesc::Texture(_));
    let scalar = |s: &ScalarDesc| matches!(s, ScalarDesc::Texture(_));
    let rough = |r: &RoughnessDesc| scalar(&r.alpha_u) || scalar(&r.alpha_v);
    match kind {
        BsdfKind::Diffuse { reflectance } => color(reflectance),
        BsdfKind::Dielectric { specular_reflectance, specular_transmittance, .. }
        | BsdfKind::ThinDielectric { specular_reflectance, specular_transmittance, .. } => {
            color(specular_reflectance) || color(specular_transmittance)
        }
        BsdfKind::RoughDielectric { roughness, specular_reflectance, specular_transmittance, .. } => {
            rough(roughness) || color(specular_reflectance) || color(specular_transmittance)
        }
        BsdfKind::Conductor { eta, k, specular_reflectance } => color(eta) || color(k) || color(specular_reflectance),
        BsdfKind::RoughConductor { roughness, eta, k, specular_reflectance } => {
            rough(roughness) || color(eta) || color(k) || color(specular_reflectance)
        }
        BsdfKind::Plastic { diffuse_reflectance, specular_reflectance, .. }
        | BsdfKind::RoughPlastic { diffuse_reflectance, specular_reflectance, .. } => {
            color(diffuse_reflectance) || color(specular_reflectance)
        }
        BsdfKind::Principled(p) => {
            color(&p.base_color)
                || [
                    &p.roughness,
                    &p.anisotropic,
                    &p.metallic,
                    &p.spec_trans,
                    &p.spec_tint,
                    &p.sheen,
                    &p.sheen_tint,
                    &p.flatness,
                    &p.clearcoat,
                    &p.clearcoat_gloss,
                ]
                .into_iter()
                .any(scalar)
        }
        BsdfKind::Phong { exponent, specular_reflectance, diffuse_reflectance } => {
            scalar(exponent) || color(specular_reflectance) || color(diffuse_reflectance)
        }
        BsdfKind::Ward { alpha_u, alpha_v, specular_reflectance, diffuse_reflectance, .. } => {
            scalar(alpha_u) || scalar(alpha_v) || color(specular_reflectance) || color(diffuse_reflectance)
        }
        BsdfKind::Mask { opacity, .. } => scalar(opacity),
        BsdfKind::Blend { weight, .. } => scalar(weight),
        BsdfKind::BumpMap { .. } | BsdfKind::NormalMap { .. } => true,
        BsdfKind::TwoSided { .. } | BsdfKind::Null => false,
    }
}
