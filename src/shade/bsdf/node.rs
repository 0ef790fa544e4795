//! The tree of a material, and how it becomes weighted lobes at a point.

use super::conductor::{Conductor, Metal, RoughConductor};
use super::dielectric::{Dielectric, ThinDielectric};
use super::diffuse::Diffuse;
use super::link::{Link, Step};
use super::lobe::Lobe;
use super::microfacet::Microfacets;
use super::phong::Phong;
use super::plastic::Plastic;
use super::principled::Principled;
use super::rough_dielectric::RoughDielectric;
use super::rough_plastic::{Coat, RoughPlastic};
use super::ward::Ward;
use super::{Bsdf, Leaf};
use crate::math::{Frame, Rgb, Vec3};
use crate::scene::{Distribution, WardVariant};
use crate::shade::SurfacePoint;
use crate::shade::texture::{ColorTexture, ScalarTexture, Texture};
use std::sync::Arc;

/// Roughness with its textures.
#[derive(Debug)]
pub(super) struct Roughness {
    pub distribution: Distribution,
    pub alpha_u: ScalarTexture,
    pub alpha_v: ScalarTexture,
    pub visible: bool,
}

impl Roughness {
    fn at(&self, point: &SurfacePoint) -> Microfacets {
        Microfacets::new(self.distribution, self.alpha_u.eval(point), self.alpha_v.eval(point), self.visible)
    }
}

/// Parameters of the principled material with their textures.
#[derive(Debug)]
pub(super) struct PrincipledNode {
    pub base_color: ColorTexture,
    pub eta: f32,
    pub roughness: ScalarTexture,
    pub anisotropic: ScalarTexture,
    pub metallic: ScalarTexture,
    pub spec_trans: ScalarTexture,
    pub spec_tint: ScalarTexture,
    pub sheen: ScalarTexture,
    pub sheen_tint: ScalarTexture,
    pub flatness: ScalarTexture,
    pub clearcoat: ScalarTexture,
    pub clearcoat_gloss: ScalarTexture,
}

/// A node of a material's tree. Children are boxed: trees are built once and walked from the root.
#[derive(Debug)]
pub(super) enum Node {
    Diffuse {
        reflectance: ColorTexture,
    },
    Dielectric {
        eta: f32,
        reflectance: ColorTexture,
        transmittance: ColorTexture,
    },
    ThinDielectric {
        eta: f32,
        reflectance: ColorTexture,
        transmittance: ColorTexture,
    },
    RoughDielectric {
        roughness: Roughness,
        eta: f32,
        reflectance: ColorTexture,
        transmittance: ColorTexture,
    },
    Conductor {
        eta: ColorTexture,
        k: ColorTexture,
        tint: ColorTexture,
    },
    RoughConductor {
        roughness: Roughness,
        eta: ColorTexture,
        k: ColorTexture,
        tint: ColorTexture,
    },
    Plastic {
        eta: f32,
        diffuse: ColorTexture,
        specular: ColorTexture,
        nonlinear: bool,
    },
    RoughPlastic {
        facets: Microfacets,
        coat: &'static Coat,
        eta: f32,
        diffuse: ColorTexture,
        specular: ColorTexture,
        nonlinear: bool,
    },
    Principled(Box<PrincipledNode>),
    Phong {
        exponent: ScalarTexture,
        diffuse: ColorTexture,
        specular: ColorTexture,
    },
    Ward {
        alpha_u: ScalarTexture,
        alpha_v: ScalarTexture,
        variant: WardVariant,
        diffuse: ColorTexture,
        specular: ColorTexture,
    },
    TwoSided {
        front: Box<Node>,
        back: Box<Node>,
    },
    Mask {
        nested: Box<Node>,
        opacity: ScalarTexture,
    },
    BumpMap {
        nested: Box<Node>,
        height: Arc<Texture>,
        scale: f32,
    },
    NormalMap {
        nested: Box<Node>,
        normals: Arc<Texture>,
    },
    Blend {
        weight: ScalarTexture,
        a: Box<Node>,
        b: Box<Node>,
    },
    Null,
}

/// Where in the tree a walk is.
#[derive(Clone, Copy)]
struct Place {
    /// Share of the material.
    weight: f32,
    /// Innermost frame.
    link: u8,
    /// Whether light seen from the front and from the back of the point's frame arrives here at all.
    active: [bool; 2],
    /// The front of this node is the back of the point's frame.
    mirrored: bool,
    /// The shading frame here in world space (never mirrored, normals not turned), for bump maps.
    frame: Frame,
}

/// The walk of a tree at a point.
pub(super) struct Resolver<'a> {
    pub point: &'a SurfacePoint,
    /// Only this side is asked for; `None` for both, in materials that let light through.
    pub only_side: Option<usize>,
    pub bsdf: &'a mut Bsdf,
}

impl Resolver<'_> {
    /// Adds the lobes of a whole material and normalises the choice between them.
    pub fn root(mut self, node: &Node, link: u8) {
        let active = match self.only_side {
            None => [true; 2],
            Some(s) => [s == 0, s == 1],
        };
        self.visit(node, Place { weight: 1.0, link, active, mirrored: false, frame: self.point.frame });
        self.bsdf.seal();
    }

    fn visit(&mut self, node: &Node, place: Place) {
        if place.weight <= 0.0 || place.active == [false; 2] {
            return;
        }
        match node {
            Node::TwoSided { front, back } => {
                let (f, b) = (usize::from(place.mirrored), usize::from(!place.mirrored));
                let only = |s: usize| std::array::from_fn(|i| i == s && place.active[i]);
                self.visit(front, Place { active: only(f), ..place });
                if place.active[b] {
                    let link = self.push_link(place.link, Step::Mirror);
                    self.visit(back, Place { active: only(b), link, mirrored: !place.mirrored, ..place });
                }
            }
            Node::Mask { nested, opacity } => {
                let opacity = opacity.eval(self.point).clamp(0.0, 1.0);
                self.visit(nested, Place { weight: place.weight * opacity, ..place });
                self.visit(&Node::Null, Place { weight: place.weight * (1.0 - opacity), ..place });
            }
            Node::Blend { weight, a, b } => {
                let weight = weight.eval(self.point).clamp(0.0, 1.0);
                self.visit(a, Place { weight: place.weight * (1.0 - weight), ..place });
                self.visit(b, Place { weight: place.weight * weight, ..place });
            }
            Node::BumpMap { nested, height, scale } => {
                let normal = self.bumped_normal(height, *scale, &place.frame);
                self.tilt(nested, normal, place);
            }
            Node::NormalMap { nested, normals } => {
                let c = normals.color(self.point);
                self.tilt(nested, Vec3::new(c.r, c.g, c.b) * 2.0 - Vec3::ONE, place);
            }
            _ => self.push_leaf(self.lobe(node), place),
        }
    }

    fn push_link(&mut self, outer: u8, step: Step) -> u8 {
        // The builder refuses trees with more links than there is room for.
        let index = self.bsdf.links.len() as u8;
        match self.bsdf.links.try_push(Link { outer, step }) {
            Ok(()) => index,
            Err(_) => outer,
        }
    }

    fn push_leaf(&mut self, lobe: Lobe, place: Place) {
        let active = if lobe.is_one_sided() {
            let front = usize::from(place.mirrored);
            std::array::from_fn(|i| i == front && place.active[i])
        } else {
            place.active
        };
        if active == [false; 2] {
            return;
        }
        let pick = place.weight * lobe.albedo().mean();
        // A single Lambertian lobe is evaluated without looking at its weight.
        let (lobe, weight) = match lobe {
            Lobe::Diffuse(d) => (Lobe::Diffuse(Diffuse { reflectance: d.reflectance * place.weight }), 1.0),
            other => (other, place.weight),
        };
        // The builder refuses trees with more leaves than there is room for.
        let _ = self.bsdf.leaves.try_push(Leaf { lobe, weight, pick, link: place.link, active });
    }

    /// Goes on below a normal `n` (any length) in coordinates of `place.frame`.
    fn tilt(&mut self, nested: &Node, n: Vec3, place: Place) {
        let n = n.normalize_or(Vec3::Z);
        let link = self.push_link(place.link, Step::Tilt(n));
        let inner = super::link::tilted_frame(n, n);
        let [s, t, n] = [inner.s, inner.t, inner.n].map(|v| place.frame.to_world(v));
        self.visit(nested, Place { link, frame: Frame { s, t, n }, ..place });
    }

    /// The normal of the displaced surface, the base's own curvature neglected (Blinn 1978), in `frame`.
    fn bumped_normal(&self, height: &Texture, scale: f32, frame: &Frame) -> Vec3 {
        let gradient = height.gradient(self.point) * scale;
        let displaced = |dp: Vec3, slope: f32| dp + frame.n * (slope - frame.n.dot(dp));
        let n = displaced(self.point.dpdu, gradient.x).cross(displaced(self.point.dpdv, gradient.y));
        frame.to_local(if n.dot(self.point.ng) < 0.0 { -n } else { n })
    }

    fn lobe(&self, node: &Node) -> Lobe {
        let p = self.point;
        match node {
            Node::Diffuse { reflectance } => Lobe::Diffuse(Diffuse { reflectance: reflectance.eval(p) }),
            Node::Dielectric { eta, reflectance, transmittance } => Lobe::Dielectric(Dielectric {
                eta: *eta,
                reflectance: reflectance.eval(p),
                transmittance: transmittance.eval(p),
            }),
            Node::ThinDielectric { eta, reflectance, transmittance } => Lobe::ThinDielectric(ThinDielectric {
                eta: *eta,
                reflectance: reflectance.eval(p),
                transmittance: transmittance.eval(p),
            }),
            Node::RoughDielectric { roughness, eta, reflectance, transmittance } => {
                Lobe::RoughDielectric(RoughDielectric {
                    facets: roughness.at(p),
                    eta: *eta,
                    reflectance: reflectance.eval(p),
                    transmittance: transmittance.eval(p),
                })
            }
            Node::Conductor { eta, k, tint } => {
                Lobe::Conductor(Conductor { metal: Metal { eta: eta.eval(p), k: k.eval(p), tint: tint.eval(p) } })
            }
            Node::RoughConductor { roughness, eta, k, tint } => Lobe::RoughConductor(RoughConductor {
                metal: Metal { eta: eta.eval(p), k: k.eval(p), tint: tint.eval(p) },
                facets: roughness.at(p),
            }),
            Node::Plastic { eta, diffuse, specular, nonlinear } => {
                Lobe::Plastic(Plastic::new(*eta, diffuse.eval(p), specular.eval(p), *nonlinear))
            }
            Node::RoughPlastic { facets, coat, eta, diffuse, specular, nonlinear } => Lobe::RoughPlastic(
                RoughPlastic::new(*facets, coat, *eta, diffuse.eval(p), specular.eval(p), *nonlinear),
            ),
            Node::Principled(n) => Lobe::Principled(Principled {
                base_color: n.base_color.eval(p),
                roughness: n.roughness.eval(p),
                metallic: n.metallic.eval(p),
                spec_trans: n.spec_trans.eval(p),
                eta: n.eta,
                spec_tint: n.spec_tint.eval(p),
                sheen: n.sheen.eval(p),
                sheen_tint: n.sheen_tint.eval(p),
                flatness: n.flatness.eval(p),
                clearcoat: n.clearcoat.eval(p),
                clearcoat_gloss: n.clearcoat_gloss.eval(p),
                anisotropic: n.anisotropic.eval(p),
            }),
            Node::Phong { exponent, diffuse, specular } => {
                Lobe::Phong(Phong::new(exponent.eval(p), diffuse.eval(p), specular.eval(p)))
            }
            Node::Ward { alpha_u, alpha_v, variant, diffuse, specular } => {
                let alpha = [alpha_u.eval(p), alpha_v.eval(p)];
                Lobe::Ward(Ward::new(alpha, *variant, diffuse.eval(p), specular.eval(p)))
            }
            // Everything else has children and never comes here.
            _ => Lobe::Null,
        }
    }
}

impl Node {
    /// A diffuse surface of constant albedo.
    pub fn lambert(reflectance: Rgb) -> Node {
        Node::Diffuse { reflectance: ColorTexture::Constant(reflectance) }
    }
}
