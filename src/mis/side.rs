//! What one walk knows of the densities of the vertices it made.
//!
//! Write u_0, u_1, … for the vertices of a sub-path (y from the light, z from the camera). For each of them a [`Node`] keeps the
//! area density with which this walk made it, and the ratio of the density with which a walk from the *other* end would
//! have made it to that. Products of such ratios take a technique to its neighbours, so nothing else is ever multiplied up.
//!
//! Densities of a vertex at infinity are per steradian of its direction; the disk that emission rays start on stands in for
//! the direction's density at the next vertex (see `emit::sample`). [`Node::spread`] hides the difference.

use super::There;
use crate::math::{AreaPdf, Rgb, SolidAnglePdf};

/// A vertex of one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Area density with which this side's walk makes the vertex, survival of roulette at the vertex before included.
    pub forward: AreaPdf,
    /// Turns a density per steradian at this vertex, for directions towards the vertex before, into the latter's area density:
    /// |cos| there / distance²; 1 if that vertex is at infinity. Of a vertex that is itself at infinity: |cos| there, for the density
    /// per unit area of the emission disk.
    pub spread: f32,
    /// Survival of roulette at this vertex, where the walk from the other end plays it.
    pub survival: f32,
    /// Area density of this vertex when it is walked to from the other end, without the survival at the vertex after it, over
    /// `forward`. Valid once the walk has left the vertex after it.
    pub ratio: f32,
    /// Both directions of the path at this vertex are tied by a density, so that edges on either side of it can be connections. Valid
    /// once the walk has left it.
    pub smooth: bool,
    /// Light side: c of the connection that ends at this vertex, see `mis::resampled`.
    pub factor: f32,
    /// Eye side: what is known of the light there is at this vertex, on the side that the walk goes on to.
    pub there: There,
    /// Eye side: |cos| at this vertex between its surface's normal and the edge to the vertex before.
    pub cos: f32,
    /// Eye side: square of the distance to the vertex before.
    pub distance2: f32,
    /// Eye side: value of this vertex for a walk from the light, cosine weighted.
    pub adjoint: Rgb,
    /// Eye side: density per steradian with which a walk from the light would go on from here to the vertex before.
    pub reverse: f32,
}

impl Node {
    fn plain(forward: AreaPdf) -> Node {
        Node {
            forward,
            spread: 0.0,
            survival: 1.0,
            ratio: 0.0,
            smooth: true,
            factor: 1.0,
            there: There::default(),
            cos: 0.0,
            distance2: 0.0,
            adjoint: Rgb::BLACK,
            reverse: 0.0,
        }
    }

    /// The origin of a sub-path.
    pub fn origin(forward: AreaPdf) -> Node {
        Node { spread: 0.0, survival: 1.0, ..Node::plain(forward) }
    }
}

/// |cos| / distance²: from a density per steradian to one per unit area at the far point (Veach 1997, eq. 8.8).
#[inline]
pub fn spread(cos: f32, dist2: f32) -> f32 {
    cos.abs() / dist2
}

/// The vertices of one sub-path, in the order in which they were made.
#[derive(Clone, Debug, Default)]
pub struct Side {
    nodes: Vec<Node>,
}

impl Side {
    /// Starts over at an origin of the given density.
    pub fn begin(&mut self, origin: AreaPdf) {
        self.nodes.clear();
        self.nodes.push(Node::origin(origin));
    }

    /// The walk arrived at its next vertex.
    #[inline]
    pub fn arrive(&mut self, forward: AreaPdf, spread: f32, survival: f32) {
        self.nodes.push(Node { spread, survival, ..Node::plain(forward) });
    }

    /// The walk leaves its last vertex; `reverse` is the density per steradian there of the direction back, given the one it goes on
    /// in (of a delta event the discrete probability of the reverse event).
    #[inline]
    pub fn leave(&mut self, reverse: SolidAnglePdf, delta: bool) {
        if let [.., before, last] = self.nodes.as_mut_slice() {
            last.smooth = !delta;
            before.ratio = reverse.0 * last.spread / before.forward.0;
        }
    }

    /// The last vertex.
    #[inline]
    pub fn last_mut(&mut self) -> Option<&mut Node> {
        self.nodes.last_mut()
    }

    /// The first `n` vertices.
    #[inline]
    pub fn first(&self, n: usize) -> &[Node] {
        &self.nodes[..n]
    }

    /// All vertices.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }
}
