//! What one walk knows of the densities of the vertices it made.
//!
//! Write u_0, u_1, … for the vertices of a sub-path (y from the light, z from the camera). For each of them a [`Node`] keeps the
//! area density with which this walk made it, and the ratio of the density with which a walk from the *other* end would
//! have made it to that. Products of such ratios take a technique to its neighbours, so nothing else is ever multiplied up.
//!
//! Densities of a vertex at infinity are per steradian of its direction; the disk that emission rays start on stands in for
//! the direction's density at the next vertex (see `emit::sample`). [`Node::spread`] hides the difference.

use super::{Proposals, There};
use crate::math::measure::spread;
use crate::math::{AreaPdf, Rgb, SolidAnglePdf};
use crate::path::{Edge, SurfaceVertex};
use crate::shade::{BsdfSample, Transport};

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
    /// Summed up shares of the techniques that use no vertices of this side but those before this one, see
    /// [`Weigher::sum_up`](super::Weigher::sum_up). Valid once the walk has left it.
    pub shorter: [f32; 2],
}

/// What weights that know of resampling ask about a vertex of an eye sub-path, for the light that a walk from the other end would bring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lit {
    /// What is known of the light there is, on the side that the walk goes on to.
    pub there: There,
    /// |cos| between the surface's normal and the edge to the vertex before.
    pub cos: f32,
    /// Square of the distance to the vertex before.
    pub distance2: f32,
    /// Value of the vertex for a walk from the light, cosine weighted.
    pub adjoint: Rgb,
    /// Density per steradian with which a walk from the light would go on from here to the vertex before.
    pub reverse: f32,
}

impl Node {
    fn plain(forward: AreaPdf, spread: f32, survival: f32) -> Node {
        Node { forward, spread, survival, ratio: 0.0, smooth: true, factor: 1.0, shorter: [0.0; 2] }
    }

    /// The origin of a sub-path.
    pub fn origin(forward: AreaPdf) -> Node {
        Node::plain(forward, 0.0, 1.0)
    }
}

/// c_1 of a light with extent: the density per steradian with which next event draws its point from the next vertex, over the area density
/// `origin` with which light sub-paths begin there; `to_area` turns the one measure into the other.
#[inline]
pub fn next_event(direct: SolidAnglePdf, to_area: f32, origin: AreaPdf) -> f32 {
    direct.0 * to_area / origin.0
}

/// The vertices of one sub-path, in the order in which they were made.
#[derive(Clone, Debug, Default)]
pub struct Side {
    nodes: Vec<Node>,
    /// One for each node, or none at all.
    lit: Vec<Lit>,
    /// For each node, the cache points near the vertex before as seen from it; only where weights want them.
    proposals: Vec<Proposals>,
    aware: bool,
    cos_leaving: f32,
}

impl Side {
    /// Starts over at an origin of the given density; `aware` of the light at its vertices or not.
    pub fn begin(&mut self, origin: AreaPdf, aware: bool) {
        self.nodes.clear();
        self.lit.clear();
        self.proposals.clear();
        self.aware = aware;
        self.cos_leaving = 0.0;
        self.push(Node::origin(origin), 0.0, 0.0);
    }

    #[inline]
    fn push(&mut self, node: Node, cos: f32, distance2: f32) {
        self.nodes.push(node);
        if self.aware {
            self.lit.push(Lit { cos, distance2, ..Lit::default() });
        }
    }

    /// The walk arrived on a surface from another vertex that is not a light's; `survival` is that of a walk from the other end there. The
    /// area density of having come.
    #[inline]
    pub fn arrive_on(&mut self, vertex: &SurfaceVertex, survival: f32) -> AreaPdf {
        let (edge, cos) = (vertex.edge, vertex.point.ng.dot(vertex.wo));
        let distance2 = edge.distance * edge.distance;
        let forward = SolidAnglePdf(edge.pdf.0 * edge.survival).to_area(cos, distance2);
        let spread = spread(self.cos_leaving, distance2);
        self.push(Node::plain(forward, spread, survival), cos.abs(), distance2);
        forward
    }

    /// The walk left the scene. Such a vertex has a density per steradian, and only the tilt of the vertex before spreads the disk that
    /// emission from there starts on.
    pub fn arrive_at_infinity(&mut self, edge: &Edge) {
        self.arrive(AreaPdf(edge.pdf.0 * edge.survival), self.cos_leaving.abs(), 1.0);
    }

    /// The walk arrived at its next vertex, with densities of the light's own.
    #[inline]
    pub fn arrive(&mut self, forward: AreaPdf, spread: f32, survival: f32) {
        self.push(Node::plain(forward, spread, survival), 0.0, 0.0);
    }

    /// The walk leaves its last vertex, `vertex`, by `sample`; `back` is the transport of a walk from the other end. Returned is the
    /// density per steradian there of the direction back, given the one the walk goes on in (of a delta event the discrete probability of
    /// the reverse event).
    #[inline]
    pub fn leave(&mut self, vertex: &SurfaceVertex, sample: &BsdfSample, back: Transport) -> SolidAnglePdf {
        self.cos_leaving = vertex.point.ng.dot(sample.wi);
        let reverse = match sample.delta {
            true => sample.pdf_reverse_delta,
            false => vertex.bsdf.pdf(sample.wi, vertex.wo, back),
        };
        if let [.., before, last] = self.nodes.as_mut_slice() {
            last.smooth = !sample.delta;
            before.ratio = reverse.0 * last.spread / before.forward.0;
        }
        reverse
    }

    /// Cosine between the last vertex's surface and the edge on which the walk left it.
    #[inline]
    pub fn cos_leaving(&self) -> f32 {
        self.cos_leaving
    }

    /// The last vertex.
    #[inline]
    pub fn last_mut(&mut self) -> Option<&mut Node> {
        self.nodes.last_mut()
    }

    /// What is known of the light at the last vertex, if the walk is aware of it.
    #[inline]
    pub fn last_lit_mut(&mut self) -> Option<&mut Lit> {
        self.lit.last_mut()
    }

    /// What is known of the light at all vertices; nothing if the walk is not aware of it.
    #[inline]
    pub fn lit(&self) -> &[Lit] {
        &self.lit
    }

    /// How the cache points near the vertex before the last are seen from the last; those of vertices that are not given are none.
    pub fn propose(&mut self, proposals: Proposals) {
        self.proposals.resize(self.nodes.len(), Proposals::default());
        if let Some(last) = self.proposals.last_mut() {
            *last = proposals;
        }
    }

    /// The cache points near the vertex before each, as seen from it, where weights want them.
    #[inline]
    pub fn proposals(&self) -> &[Proposals] {
        &self.proposals
    }

    /// The first `n` vertices.
    #[inline]
    pub fn first(&self, n: usize) -> &[Node] {
        &self.nodes[..n]
    }

    /// All vertices, for sums over them.
    #[inline]
    pub fn nodes_mut(&mut self) -> &mut [Node] {
        &mut self.nodes
    }

    /// All vertices.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }
}
