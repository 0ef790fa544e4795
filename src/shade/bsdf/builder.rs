//! Descriptions of materials → trees with textures, with limits on their size.

use super::features::Features;
use super::lobe::{self, TexturedModel};
use super::model::{TextureBinder, Textured};
use super::node::Node;
use super::{MAX_FRAMES, MAX_LOBES};
use crate::math::Rgb;
use crate::scene::{
    BsdfDesc, BsdfId, BsdfKind, BsdfModel, CoatingDesc, ColorDesc, Convert, Described, PlasticParams, ScalarDesc,
    TextureId,
};
use crate::shade::texture::{ScalarTexture, Texture, TextureSet};
use std::sync::Arc;

/// Trees deeper than this are taken for circles.
const MAX_DEPTH: u32 = 32;
/// Most nodes of a tree: materials that share children can be exponentially larger than their descriptions.
const MAX_NODES: u32 = 256;

/// A tree or a part of one, and the room that it needs.
pub(super) struct Subtree {
    pub node: Node,
    pub features: Features,
    /// Constant and zero everywhere.
    pub black: bool,
    /// Most lobes at a point.
    lobes: usize,
    /// Most nested frames at a point.
    frames: usize,
}

impl Subtree {
    /// A tree of one node.
    pub fn leaf(node: Node, features: Features) -> Subtree {
        Subtree { node, features, black: false, lobes: 1, frames: 0 }
    }
}

/// Builds the tree of one material.
pub(super) struct Builder<'a> {
    descs: &'a [BsdfDesc],
    textures: &'a TextureSet,
    /// Nodes built so far.
    nodes: u32,
}

impl<'a> Builder<'a> {
    pub fn new(descs: &'a [BsdfDesc], textures: &'a TextureSet) -> Builder<'a> {
        Builder { descs, textures, nodes: 0 }
    }

    /// The whole tree of a material. The error completes "material …: ".
    pub fn material(mut self, id: BsdfId) -> Result<Subtree, String> {
        let tree = self.subtree(id, 0)?;
        if tree.lobes > MAX_LOBES {
            return Err(format!("it mixes {} lobes; at most {MAX_LOBES} are supported", tree.lobes));
        }
        if tree.frames > MAX_FRAMES {
            return Err(format!("it nests {} frames; at most {MAX_FRAMES} are supported", tree.frames));
        }
        Ok(tree)
    }

    fn subtree(&mut self, id: BsdfId, depth: u32) -> Result<Subtree, String> {
        let desc = self.descs.get(id.index()).ok_or("it refers to a material that does not exist")?;
        self.nodes += 1;
        if depth > MAX_DEPTH || self.nodes > MAX_NODES {
            return Err("it is nested in itself, or too deeply".into());
        }
        let depth = depth + 1;
        match &desc.kind {
            BsdfKind::Model(desc) => self.model(desc),
            BsdfKind::Null => Ok(Subtree { lobes: 0, ..Subtree::leaf(Node::Null, Features::hole()) }),
            BsdfKind::TwoSided { front, back } => two_sided(self.subtree(*front, depth)?, self.subtree(*back, depth)?),
            BsdfKind::Mask { nested, opacity } => {
                let nested = self.subtree(*nested, depth)?;
                Ok(self.mask(nested, opacity))
            }
            BsdfKind::Blend { weight, a, b } => {
                let (a, b) = (self.subtree(*a, depth)?, self.subtree(*b, depth)?);
                Ok(self.blend(weight, a, b))
            }
            BsdfKind::Coating(coating) => self.coating(coating, depth),
            BsdfKind::BumpMap { nested, height, scale } => {
                let height = self.texture(*height).ok_or("its height map could not be read")?;
                Ok(tilted(self.subtree(*nested, depth)?, |nested| Node::BumpMap { nested, height, scale: *scale }))
            }
            BsdfKind::NormalMap { nested, normals } => {
                let normals = self.texture(*normals).ok_or("its normal map could not be read")?;
                Ok(tilted(self.subtree(*nested, depth)?, |nested| Node::NormalMap { nested, normals }))
            }
        }
    }

    fn texture(&self, id: TextureId) -> Option<Arc<Texture>> {
        self.textures.get(id).cloned()
    }

    fn model(&self, desc: &BsdfModel) -> Result<Subtree, String> {
        let mut binder = TextureBinder { textures: self.textures, textured: false };
        let model = TexturedModel::bind(desc, &mut binder)?;
        let features = Features { textured: binder.textured, ..lobe::features(desc) };
        Ok(Subtree { black: lobe::is_black(desc), ..Subtree::leaf(Node::Model(model), features) })
    }

    /// Binds a parameter of an operator; the features say whether it is a texture.
    fn scalar(&self, desc: &ScalarDesc) -> (ScalarTexture, Features) {
        let mut binder = TextureBinder { textures: self.textures, textured: false };
        let scalar = binder.scalar(desc);
        (scalar, Features { textured: binder.textured, ..Features::default() })
    }

    fn coating(&mut self, coating: &CoatingDesc, depth: u32) -> Result<Subtree, String> {
        let CoatingDesc { nested, eta, sigma_a, thickness, specular_reflectance } = *coating;
        let nested = self.subtree(nested, depth)?;
        if !nested.features.opaque() {
            return Err("a coat over a material that lets light through is not supported".into());
        }
        // The discrete reflection of plastic is that of a smooth coat; its base is black here.
        let black = ColorDesc::Constant(Rgb::BLACK);
        let surface = PlasticParams { eta, diffuse_reflectance: black, specular_reflectance, nonlinear: false };
        let surface = self.model(&BsdfModel::Plastic(surface))?;
        let mut binder = TextureBinder { textures: self.textures, textured: false };
        let sigma_a = Convert::<Described, Textured>::color(&mut binder, &sigma_a);
        let features = Features { two_sided: true, textured: binder.textured, ..surface.features };
        let node =
            Node::Coating { nested: Box::new(nested.node), surface: Box::new(surface.node), eta, sigma_a, thickness };
        Ok(Subtree {
            features: nested.features.union(features),
            // The coat's surface on both sides; its back and what is below it have frames.
            lobes: nested.lobes + 2,
            frames: nested.frames + 2,
            black: false,
            node,
        })
    }

    fn mask(&self, nested: Subtree, opacity: &ScalarDesc) -> Subtree {
        let (opacity, textured) = self.scalar(opacity);
        Subtree {
            features: nested.features.union(Features::hole()).union(textured),
            lobes: nested.lobes,
            frames: nested.frames,
            black: false,
            node: Node::Mask { nested: Box::new(nested.node), opacity },
        }
    }

    fn blend(&self, weight: &ScalarDesc, a: Subtree, b: Subtree) -> Subtree {
        let (weight, textured) = self.scalar(weight);
        Subtree {
            features: a.features.union(b.features).union(textured),
            lobes: a.lobes + b.lobes,
            frames: a.frames + b.frames,
            black: a.black && b.black,
            node: Node::Blend { weight, a: Box::new(a.node), b: Box::new(b.node) },
        }
    }
}

fn two_sided(front: Subtree, back: Subtree) -> Result<Subtree, String> {
    let features = front.features.union(back.features);
    if features.transmissive {
        return Err("a two-sided material cannot hold one that refracts light".into());
    }
    Ok(Subtree {
        features: Features { two_sided: true, ..features },
        // An opaque material shows one side only, but a mask further out is only known at the root.
        lobes: front.lobes + back.lobes,
        frames: front.frames + back.frames + 1,
        black: front.black && back.black,
        node: Node::TwoSided { front: Box::new(front.node), back: Box::new(back.node) },
    })
}

/// A bump or normal map over `nested`.
fn tilted(nested: Subtree, node: impl FnOnce(Box<Node>) -> Node) -> Subtree {
    Subtree {
        features: Features { tilted: true, textured: true, oriented: true, ..nested.features },
        lobes: nested.lobes,
        frames: nested.frames + 1,
        black: nested.black,
        node: node(Box::new(nested.node)),
    }
}
