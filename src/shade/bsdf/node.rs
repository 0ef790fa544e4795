//! Trees of materials with their textures, and their resolution into the lobes at a point.

use super::Bsdf;
use super::diffuse::Diffuse;
use super::lobe::{Lobe, TexturedModel};
use super::nested_frame::{Coat, NestedFrame, ROOT, Step, tilted_frame};
use super::view::WeightedLobe;
use crate::math::{Frame, Rgb, Vec3};
use crate::scene::DiffuseParams;
use crate::shade::SurfacePoint;
use crate::shade::texture::{ColorTexture, ScalarTexture, Texture};
use std::sync::Arc;

/// A node of a material's tree. Children are boxed: trees are built once and walked from the root.
#[derive(Debug)]
pub(super) enum Node {
    Model(TexturedModel),
    TwoSided {
        front: Box<Node>,
        back: Box<Node>,
    },
    /// A surface with holes.
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
    /// `surface` is what the coat itself reflects.
    Coating {
        nested: Box<Node>,
        surface: Box<Node>,
        eta: f32,
        sigma_a: ColorTexture,
        thickness: f32,
    },
    /// No surface.
    Null,
}

/// One side of an opaque material.
pub(super) struct VisibleSide<'a> {
    /// The node that is seen, with an outermost two-sided node taken off.
    pub node: &'a Node,
    /// Factor of the shading normal: −1 where the back of a two-sided node is seen, whose front then faces the viewer;
    /// else 1.
    pub normal_sign: f32,
    /// The node is seen from its back.
    pub from_back: bool,
}

impl<'a> VisibleSide<'a> {
    /// Albedo of the node's front, if the node is a diffuse surface.
    pub fn diffuse(&self) -> Option<&'a ColorTexture> {
        match self.node {
            Node::Model(TexturedModel::Diffuse(params)) => Some(&params.reflectance),
            _ => None,
        }
    }
}

impl Node {
    /// A diffuse surface of constant albedo.
    pub fn lambertian(reflectance: Rgb) -> Node {
        Node::Model(TexturedModel::Diffuse(DiffuseParams { reflectance: ColorTexture::Constant(reflectance) }))
    }

    /// The share of light that goes straight through at `point`, in [0, 1]. It is the same from either side: a two-sided
    /// material has the holes that both of its sides have.
    pub fn holes(&self, point: &SurfacePoint) -> f32 {
        match self {
            Node::Null => 1.0,
            // A coat covers what has no holes.
            Node::Model(_) | Node::Coating { .. } => 0.0,
            Node::TwoSided { front, back } => front.holes(point).min(back.holes(point)),
            Node::BumpMap { nested, .. } | Node::NormalMap { nested, .. } => nested.holes(point),
            Node::Mask { nested, opacity } => {
                let opacity = opacity.eval(point).clamp(0.0, 1.0);
                (1.0 - opacity) + opacity * nested.holes(point)
            }
            Node::Blend { weight, a, b } => {
                let weight = weight.eval(point).clamp(0.0, 1.0);
                (1.0 - weight) * a.holes(point) + weight * b.holes(point)
            }
        }
    }

    /// The front or back of an opaque material. The commonest nesting, two-sided at the root, needs no frame of its
    /// own.
    #[inline]
    pub fn visible_side(&self, from_back: bool) -> VisibleSide<'_> {
        match (self, from_back) {
            (Node::TwoSided { front, .. }, false) => VisibleSide { node: front, normal_sign: 1.0, from_back: false },
            (Node::TwoSided { back, .. }, true) => VisibleSide { node: back, normal_sign: -1.0, from_back: false },
            (node, from_back) => VisibleSide { node, normal_sign: 1.0, from_back },
        }
    }
}

/// State of the resolution at a node.
#[derive(Clone, Copy)]
struct Context {
    /// Fraction of the material.
    weight: f32,
    /// Index of the innermost frame.
    frame_index: u8,
    /// Whether light seen from the front and from the back of the point's frame arrives at the node.
    active: [bool; 2],
    /// The front of the node is the back of the point's frame.
    mirrored: bool,
    /// The shading frame at the node in world space (never mirrored, normals not turned), for bump maps.
    frame: Frame,
}

/// Resolves a tree into lobes at a point.
pub(super) struct Resolver<'a> {
    pub point: &'a SurfacePoint,
    /// The only side from which the point is seen; `None` for both, in materials that let light through.
    pub only_side: Option<usize>,
    pub bsdf: &'a mut Bsdf,
}

impl Resolver<'_> {
    /// Adds the lobes of a whole material, times `weight`, and normalises the choice between them.
    pub fn root(mut self, node: &Node, weight: f32) {
        let active = match self.only_side {
            None => [true; 2],
            Some(s) => [s == 0, s == 1],
        };
        let frame = self.point.frame;
        self.visit(node, Context { weight, frame_index: ROOT, active, mirrored: false, frame });
        self.bsdf.normalise_selection();
    }

    fn visit(&mut self, node: &Node, at: Context) {
        if at.weight <= 0.0 || at.active == [false; 2] {
            return;
        }
        match node {
            Node::Model(model) => self.push_lobe(model.at(self.point), at),
            Node::Null => {}
            Node::TwoSided { front, back } => self.two_sided(front, back, at),
            Node::Mask { nested, opacity } => {
                let opacity = opacity.eval(self.point).clamp(0.0, 1.0);
                self.visit(nested, Context { weight: at.weight * opacity, ..at });
            }
            Node::Blend { weight, a, b } => {
                let weight = weight.eval(self.point).clamp(0.0, 1.0);
                self.visit(a, Context { weight: at.weight * (1.0 - weight), ..at });
                self.visit(b, Context { weight: at.weight * weight, ..at });
            }
            Node::Coating { nested, surface, eta, sigma_a, thickness } => {
                // Both sides of the coat reflect.
                self.two_sided(surface, surface, at);
                let absorption = sigma_a.eval(self.point).map(|c| c.max(0.0) * thickness);
                let frame_index = self.push_frame(at.frame_index, Step::Coat(Coat { eta: *eta, absorption }));
                self.visit(nested, Context { frame_index, ..at });
            }
            Node::BumpMap { nested, height, scale } => {
                let normal = self.bumped_normal(height, *scale, &at.frame);
                self.tilt(nested, normal, at);
            }
            Node::NormalMap { nested, normals } => {
                let c = normals.color(self.point);
                self.tilt(nested, Vec3::new(c.r, c.g, c.b) * 2.0 - Vec3::ONE, at);
            }
        }
    }

    fn two_sided(&mut self, front: &Node, back: &Node, at: Context) {
        let (f, b) = (usize::from(at.mirrored), usize::from(!at.mirrored));
        let only = |s: usize| std::array::from_fn(|i| i == s && at.active[i]);
        self.visit(front, Context { active: only(f), ..at });
        if at.active[b] {
            let frame_index = self.push_frame(at.frame_index, Step::Mirror);
            self.visit(back, Context { active: only(b), frame_index, mirrored: !at.mirrored, ..at });
        }
    }

    fn push_frame(&mut self, outer: u8, step: Step) -> u8 {
        // The builder refuses trees with more frames than there is room for.
        let index = self.bsdf.frames.len() as u8;
        match self.bsdf.frames.try_push(NestedFrame { outer, step }) {
            Ok(()) => index,
            Err(_) => outer,
        }
    }

    fn push_lobe(&mut self, lobe: Lobe, at: Context) {
        let active = if lobe.is_one_sided() {
            let front = usize::from(at.mirrored);
            std::array::from_fn(|i| i == front && at.active[i])
        } else {
            at.active
        };
        if active == [false; 2] {
            return;
        }
        let selection_weight = at.weight * lobe.albedo().mean();
        // A single Lambertian lobe is evaluated without looking at its weight.
        let (lobe, weight) = match lobe {
            Lobe::Diffuse(d) => (Lobe::Diffuse(Diffuse { reflectance: d.reflectance * at.weight }), 1.0),
            other => (other, at.weight),
        };
        // The builder refuses trees with more lobes than there is room for.
        let lobe = WeightedLobe { lobe, weight, selection_weight, frame: at.frame_index, active };
        let _ = self.bsdf.lobes.try_push(lobe);
    }

    /// Continues below a normal `n` (any length) in coordinates of the node's frame.
    fn tilt(&mut self, nested: &Node, n: Vec3, at: Context) {
        let n = n.normalize_or(Vec3::Z);
        let frame_index = self.push_frame(at.frame_index, Step::Tilt(n));
        let inner = tilted_frame(n, n);
        let [s, t, n] = [inner.s, inner.t, inner.n].map(|v| at.frame.to_world(v));
        self.visit(nested, Context { frame_index, frame: Frame { s, t, n }, ..at });
    }

    /// The normal of the displaced surface, the base's own curvature neglected (Blinn 1978), in `frame`.
    fn bumped_normal(&self, height: &Texture, scale: f32, frame: &Frame) -> Vec3 {
        let gradient = height.gradient(self.point) * scale;
        let displaced = |dp: Vec3, slope: f32| dp + frame.n * (slope - frame.n.dot(dp));
        let n = displaced(self.point.dpdu, gradient.x).cross(displaced(self.point.dpdv, gradient.y));
        frame.to_local(if n.dot(self.point.ng) < 0.0 { -n } else { n })
    }
}
