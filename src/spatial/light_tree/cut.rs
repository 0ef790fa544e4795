//! Cuts through a light tree: clusters that a receiver can treat as one source each.
//!
//! A cut begins with the root and always splits the cluster with the largest bound on its error, as lightcuts do
//! (Walter et al. 2005). The clusters of a cut are a partition of all sources.

use super::bounds::LightCluster;
use super::{LightTree, Node};
use crate::math::Vec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Bounds of the receivers of a cut: a ball of points whose surfaces face about the same way.
#[derive(Clone, Copy, Debug)]
pub struct ReceiverBounds {
    /// Centre of the ball.
    pub centre: Vec3,
    /// Radius of the ball.
    pub radius: f32,
    /// Unit normal of the receivers: they receive nothing from below its horizon. Zero if they have no normal in
    /// common.
    pub normal: Vec3,
}

/// When a cut is fine enough.
#[derive(Clone, Copy, Debug)]
pub struct CutLimits {
    /// Largest number of clusters.
    pub max_clusters: usize,
    /// No cluster is split whose error bound is below this (in units of weight / distance²); 0 if only the number of
    /// clusters counts.
    pub max_error: f32,
}

/// A cluster of a cut that can be split.
struct CutNode {
    error: f32,
    node: u32,
}

impl PartialEq for CutNode {
    fn eq(&self, other: &CutNode) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for CutNode {}

impl PartialOrd for CutNode {
    fn partial_cmp(&self, other: &CutNode) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for CutNode {
    fn cmp(&self, other: &CutNode) -> Ordering {
        self.error.total_cmp(&other.error).then(other.node.cmp(&self.node))
    }
}

/// Memory of cuts, to be used again.
#[derive(Default)]
pub struct CutScratch(BinaryHeap<CutNode>);

impl<C: LightCluster> LightTree<C> {
    /// Bound on the error of treating the sources of `node` as one: their weight times the range of 1/distance² over
    /// cluster and receivers. The receivers' radius softens the range: no cut resolves differences within the ball.
    #[inline]
    fn error_bound(&self, node: &Node<C>, receivers: &ReceiverBounds) -> f32 {
        let aabb = node.cluster.aabb();
        let (centre, radius) = ((aabb.min + aabb.max) * 0.5, (aabb.max - aabb.min).length() * 0.5);
        let to = centre - receivers.centre;
        if receivers.normal.dot(to) < -(radius + receivers.radius) {
            return 0.0;
        }
        let distance = to.length();
        let (near, far) = ((distance - radius).max(0.0), distance + radius);
        // At least a fraction of the cluster: otherwise a single source next to the receivers would be isolated before
        // anything else is split.
        let soft = receivers.radius * receivers.radius;
        let soft = soft.max(0.01 * radius * radius).max(f32::MIN_POSITIVE);
        let weight = self.weights.weight(&node.range()) as f32;
        weight * (1.0 / (near * near + soft) - 1.0 / (far * far + soft)).max(0.0)
    }

    /// The clusters of a cut for `receivers`: ranges of sources, left in `clusters` in ascending order. They are a
    /// partition of all sources. The error bound of a cluster is multiplied by its `importance`, which is not negative.
    pub fn cut(
        &self,
        receivers: &ReceiverBounds,
        limits: CutLimits,
        importance: impl Fn(&C) -> f32,
        scratch: &mut CutScratch,
        clusters: &mut Vec<Range<usize>>,
    ) {
        clusters.clear();
        let Some(root) = self.nodes.first() else { return };
        let heap = &mut scratch.0;
        heap.clear();
        if root.is_leaf() {
            clusters.push(root.range());
            return;
        }
        heap.push(CutNode { error: self.error_bound(root, receivers) * importance(&root.cluster), node: 0 });
        while clusters.len() + heap.len() < limits.max_clusters {
            if heap.peek().is_none_or(|worst| worst.error < limits.max_error) {
                break;
            }
            let Some(CutNode { node, .. }) = heap.pop() else { break };
            let child = self.nodes[node as usize].child;
            for number in [child, child + 1] {
                let node = &self.nodes[number as usize];
                if node.is_leaf() {
                    clusters.push(node.range());
                } else {
                    heap.push(CutNode {
                        error: self.error_bound(node, receivers) * importance(&node.cluster),
                        node: number,
                    });
                }
            }
        }
        clusters.extend(heap.drain().map(|open| self.nodes[open.node as usize].range()));
        clusters.sort_unstable_by_key(|r| r.start);
    }
}
