//! A tree over weighted light sources, for all that samples or clusters them: emitters of a scene, and stored light
//! vertices.
//!
//! [`LightTree`] is a binary tree. A node is a range of the sources, and has the bounds of its sources as a
//! [`LightCluster`]: a box ([`Aabb`]), or box, cone of normals and power ([`LightBounds`]). How sets are split is up to
//! a [`SplitRule`]. Prefix sums give the weight of any node, and draw a representative of it by weight. There are two
//! ways through the tree:
//!
//! * [`LightTree::cut`]: clusters for receivers, split where the error is largest;
//! * [`WideLightTree`]: one source for a point, drawn from root to leaf by bounds on its contribution, and the
//!   probability of that. It is a copy of a binary tree with eight children a node, whose importances are computed side
//!   by side.

pub mod bounds;
pub mod cut;
pub mod split;
pub mod wide;

pub use bounds::{Aabb, Cone, LightBounds, LightCluster, Power};
pub use cut::{CutLimits, CutScratch, ReceiverBounds};
pub use split::{MortonSplit, SaohSplit, SplitRule};
pub use wide::WideLightTree;

use crate::math::Vec3;
use crate::math::cdf::PrefixSums;
use std::ops::Range;

/// A light source as a leaf of a tree.
pub trait LightSource {
    /// Bounds of clusters of such sources.
    type Cluster: LightCluster;

    /// Bounds of this source.
    fn bounds(&self) -> Self::Cluster;

    /// Finite and not negative: sources of a cluster are drawn in proportion to it.
    fn weight(&self) -> f32;
}

/// A point with a weight.
#[derive(Clone, Copy, Debug)]
pub struct WeightedPoint {
    /// Position.
    pub p: Vec3,
    /// Its weight, finite and not negative.
    pub weight: f32,
}

impl LightSource for WeightedPoint {
    type Cluster = Aabb;

    fn bounds(&self) -> Aabb {
        Aabb { min: self.p, max: self.p }
    }

    fn weight(&self) -> f32 {
        self.weight
    }
}

/// A source with orientation and power.
#[derive(Clone, Copy, Debug)]
pub struct OrientedSource<P = f32> {
    /// Number of the source in the list of its owner.
    pub index: u32,
    /// Its bounds.
    pub bounds: LightBounds<P>,
}

impl<P: Power> LightSource for OrientedSource<P> {
    type Cluster = LightBounds<P>;

    fn bounds(&self) -> LightBounds<P> {
        self.bounds
    }

    fn weight(&self) -> f32 {
        self.bounds.power.luminance()
    }
}

/// A set of sources.
#[derive(Clone, Copy, Debug)]
struct Node<C> {
    cluster: C,
    first: u32,
    end: u32,
    /// Number of the first child, which the second one follows; 0 in leaves.
    child: u32,
}

impl<C> Node<C> {
    #[inline]
    fn is_leaf(&self) -> bool {
        self.child == 0
    }

    #[inline]
    fn range(&self) -> Range<usize> {
        self.first as usize..self.end as usize
    }
}

/// A binary tree over light sources with bounds `C`.
#[derive(Debug)]
pub struct LightTree<C> {
    /// The root first, children after their parents.
    nodes: Vec<Node<C>>,
    weights: PrefixSums,
}

/// A tree over virtual point lights, which have positions and weights.
pub type VplTree = LightTree<Aabb>;

impl<C> Default for LightTree<C> {
    fn default() -> LightTree<C> {
        LightTree { nodes: Vec::new(), weights: PrefixSums::default() }
    }
}

impl<C: LightCluster> LightTree<C> {
    /// Builds the tree anew, in the memory of the old one. `rule` puts the sources in order; ranges are ranges of that
    /// order. Sets of at most `max_leaf` sources are not split.
    pub fn build<S: LightSource<Cluster = C>>(&mut self, sources: &mut [S], rule: &impl SplitRule<S>, max_leaf: usize) {
        self.nodes.clear();
        if let Some(any) = sources.first() {
            let root = Node { cluster: any.bounds(), first: 0, end: sources.len() as u32, child: 0 };
            self.nodes.push(root);
            self.split_nodes(sources, rule, max_leaf.max(1));
            self.bound_nodes(sources);
        }
        self.weights.rebuild(sources.iter().map(S::weight));
    }

    /// Makes all nodes below the root, level by level. Their bounds are not known yet.
    fn split_nodes<S: LightSource<Cluster = C>>(
        &mut self,
        sources: &mut [S],
        rule: &impl SplitRule<S>,
        max_leaf: usize,
    ) {
        let (mut at, mut depth, mut end_of_level) = (0, 0, 1);
        while at < self.nodes.len() {
            if at == end_of_level {
                depth += 1;
                end_of_level = self.nodes.len();
            }
            let node = self.nodes[at];
            let range = node.range();
            if range.len() > max_leaf {
                let middle = node.first + rule.split(&mut sources[range], node.first as usize, depth) as u32;
                self.nodes[at].child = self.nodes.len() as u32;
                self.nodes.extend([Node { end: middle, ..node }, Node { first: middle, ..node }]);
            }
            at += 1;
        }
    }

    /// Computes all bounds, those of children before those of their parents.
    fn bound_nodes<S: LightSource<Cluster = C>>(&mut self, sources: &[S]) {
        for i in (0..self.nodes.len()).rev() {
            let node = self.nodes[i];
            self.nodes[i].cluster = if node.is_leaf() {
                let own = &sources[node.range()];
                own[1..].iter().fold(own[0].bounds(), |bounds, s| bounds.union(s.bounds()))
            } else {
                let [a, b] = [node.child, node.child + 1].map(|child| self.nodes[child as usize].cluster);
                a.union(b)
            };
        }
    }
}

impl<C> LightTree<C> {
    /// Sum of the weights of a range of sources.
    #[inline]
    pub fn weight(&self, range: &Range<usize>) -> f64 {
        self.weights.weight(range)
    }

    /// Draws a representative of a range of sources in proportion to weight, and returns it with its probability. `u`
    /// is a random number in [0, 1). `None` if the range has no weight.
    #[inline]
    pub fn sample_in(&self, range: &Range<usize>, u: f32) -> Option<(usize, f64)> {
        let source = self.weights.sample(range, f64::from(u))?;
        Some((source, self.weights.pmf(range, source)))
    }

    /// Number of sources.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// True if there are no sources.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Largest leaf of a [`VplTree`] of few points.
const MIN_VPL_LEAF: usize = 2;
/// About so many leaves are enough for a [`VplTree`]: cuts have some hundreds of clusters.
const VPL_LEAVES: usize = 1 << 14;

impl VplTree {
    /// Builds the tree anew over points in Morton order, with their codes ([`crate::spatial::morton::sorted`]).
    pub fn build_morton(&mut self, codes: &[u32], points: &mut [WeightedPoint]) {
        let max_leaf = MIN_VPL_LEAF.max(points.len() / VPL_LEAVES);
        self.build(points, &MortonSplit { codes }, max_leaf);
    }
}

#[cfg(test)]
mod tests;
