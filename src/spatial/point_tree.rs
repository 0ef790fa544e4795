//! A binary tree over many points of different weight, and cuts through it: clusters that look like one point from a given place.
//!
//! Points come in Morton order, so that every node is a range of them and prefix sums give its weight. A range is split where the
//! highest differing bit of its codes changes. A cut starts with the root and always splits the cluster whose brightness is known worst
//! (as lightcuts do, Walter et al. 2005), until there are as many clusters as wanted. Clusters of a cut are a partition of the points.

use crate::math::Vec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Ranges of at most so many points are not split further, and none of at most as many as all have on average when there are `LEAVES`:
/// cuts have some hundreds of clusters.
const LEAF: usize = 2;
const LEAVES: usize = 1 << 14;

#[derive(Clone, Copy, Debug)]
struct Node {
    centre: Vec3,
    /// Half of the diagonal of the box around its points.
    radius: f32,
    first: u32,
    end: u32,
    /// Number of the first child, which the second one follows; 0 in leaves.
    child: u32,
}

/// A tree over weighted points.
#[derive(Debug, Default)]
pub struct PointTree {
    nodes: Vec<Node>,
    /// Sum of the weights of all points before each, and of all.
    sums: Vec<f64>,
    /// Corners of the boxes around nodes, while these are built; kept for its memory.
    boxes: Vec<(Vec3, Vec3)>,
}

/// Where a cut is looked at from: a ball of places whose surfaces face about the same way.
#[derive(Clone, Copy, Debug)]
pub struct ReceiverBounds {
    /// Middle of the ball.
    pub centre: Vec3,
    /// Its radius.
    pub radius: f32,
    /// What lies below the horizon of this unit normal, as far as the ball reaches, cannot be seen; zero if everything can be.
    pub normal: Vec3,
}

/// A cluster that may be split.
struct Open {
    error: f32,
    node: u32,
}

impl PartialEq for Open {
    fn eq(&self, other: &Open) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Open) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Open) -> Ordering {
        self.error.total_cmp(&other.error).then(other.node.cmp(&self.node))
    }
}

/// Memory of cuts, to be used again.
#[derive(Default)]
pub struct CutScratch(BinaryHeap<Open>);

impl PointTree {
    /// Builds the tree anew over points in Morton order ([`morton::sorted`](super::morton::sorted)), each with its position and its weight,
    /// which is not negative, and their codes.
    pub fn build(&mut self, codes: &[u32], points: &[(Vec3, f32)]) {
        self.nodes.clear();
        self.sums.clear();
        let (count, mut sum) = (points.len(), 0.0);
        self.sums.push(0.0);
        self.sums.extend(points.iter().map(|&(_, weight)| {
            sum += f64::from(weight);
            sum
        }));
        if count == 0 {
            return;
        }
        let leaf = LEAF.max(count / LEAVES);
        let root = Node { centre: Vec3::ZERO, radius: 0.0, first: 0, end: count as u32, child: 0 };
        self.nodes.push(root);
        // Children come after their parents: boxes are put together backwards.
        let mut at = 0;
        while at < self.nodes.len() {
            let Node { first, end, .. } = self.nodes[at];
            if (end - first) as usize > leaf {
                let middle = split(codes, first as usize..end as usize) as u32;
                self.nodes[at].child = self.nodes.len() as u32;
                self.nodes.extend([(first, middle), (middle, end)].map(|(first, end)| Node { first, end, ..root }));
            }
            at += 1;
        }
        let boxes = &mut self.boxes;
        boxes.clear();
        boxes.resize(self.nodes.len(), (Vec3::INFINITY, Vec3::NEG_INFINITY));
        for i in (0..self.nodes.len()).rev() {
            let Node { first, end, child, .. } = self.nodes[i];
            let (lo, hi) = if child == 0 {
                let own = &points[first as usize..end as usize];
                own.iter().fold(boxes[i], |(lo, hi), (p, _)| (lo.min(*p), hi.max(*p)))
            } else {
                let (a, b) = (boxes[child as usize], boxes[child as usize + 1]);
                (a.0.min(b.0), a.1.max(b.1))
            };
            boxes[i] = (lo, hi);
            (self.nodes[i].centre, self.nodes[i].radius) = ((lo + hi) * 0.5, (hi - lo).length() * 0.5);
        }
    }

    /// Sum of the weights of a range of points.
    #[inline]
    pub fn weight(&self, range: &Range<usize>) -> f64 {
        self.sums[range.end] - self.sums[range.start]
    }

    /// A point of `range`, drawn by its weight, and the probability of that; `None` if all weights are zero.
    #[inline]
    pub fn draw(&self, range: &Range<usize>, u: f32) -> Option<(usize, f64)> {
        let total = self.weight(range);
        if total <= 0.0 {
            return None;
        }
        let target = self.sums[range.start] + f64::from(u) * total;
        let after = &self.sums[range.start + 1..=range.end];
        let mut i = range.start + after.partition_point(|&s| s <= target);
        // Rounding may have led past the last point that weighs anything.
        while i >= range.end || self.sums[i + 1] <= self.sums[i] {
            i -= 1;
        }
        Some((i, (self.sums[i + 1] - self.sums[i]) / total))
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.sums.len().saturating_sub(1)
    }

    /// True if there are no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How much the light of a node may differ over its points as seen from `from`: its weight times the range of 1/distance². The ball's own
    /// extent softens the range: what differs inside of the ball no cut can tell.
    #[inline]
    fn error(&self, node: &Node, from: &ReceiverBounds) -> f32 {
        let weight = (self.sums[node.end as usize] - self.sums[node.first as usize]) as f32;
        let to = node.centre - from.centre;
        if from.normal.dot(to) < -(node.radius + from.radius) {
            return 0.0;
        }
        let (distance, soft) = (to.length(), from.radius * from.radius);
        let (near, far) = ((distance - node.radius).max(0.0), distance + node.radius);
        // No smaller than a fraction of the node: next to the ball, everything else would wait for the last point there.
        let soft = soft.max(0.01 * node.radius * node.radius).max(f32::MIN_POSITIVE);
        weight * (1.0 / (near * near + soft) - 1.0 / (far * far + soft)).max(0.0)
    }

    /// At most `clusters` ranges of points, a partition of all of them, left in `out` in the order of the points.
    pub fn cut(&self, from: &ReceiverBounds, clusters: usize, memory: &mut CutScratch, out: &mut Vec<Range<usize>>) {
        out.clear();
        let Some(root) = self.nodes.first() else { return };
        let heap = &mut memory.0;
        heap.clear();
        let range = |n: &Node| n.first as usize..n.end as usize;
        if root.child == 0 {
            out.push(range(root));
            return;
        }
        heap.push(Open { error: self.error(root, from), node: 0 });
        while out.len() + heap.len() < clusters {
            let Some(Open { node, .. }) = heap.pop() else { break };
            let child = self.nodes[node as usize].child;
            for number in [child, child + 1] {
                let node = &self.nodes[number as usize];
                if node.child == 0 {
                    out.push(range(node));
                } else {
                    heap.push(Open { error: self.error(node, from), node: number });
                }
            }
        }
        out.extend(heap.drain().map(|open| range(&self.nodes[open.node as usize])));
        out.sort_unstable_by_key(|r| r.start);
    }
}

/// Where a sorted range of codes is split: where their highest differing bit changes, or in the middle if all are equal.
fn split(codes: &[u32], range: Range<usize>) -> usize {
    let (first, last) = (codes[range.start], codes[range.end - 1]);
    if first == last {
        return range.start + range.len() / 2;
    }
    let bit = 31 - (first ^ last).leading_zeros();
    let upper = last >> bit << bit;
    range.start + codes[range].partition_point(|&c| c < upper)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;
    use crate::spatial::morton;

    fn tree(n: usize, seed: u64) -> (PointTree, Vec<Vec3>, Vec<f32>) {
        let mut rng = HashRng::new(seed, 1, 2, 3);
        let mut points: Vec<Vec3> = (0..n)
            .map(|i| {
                let [x, y, z, _] = rng.next_4();
                // Some points coincide, and many lie in one plane.
                if i % 7 == 0 { Vec3::splat(0.25) } else { Vec3::new(x, if i % 3 == 0 { 0.5 } else { y }, z) * 10.0 }
            })
            .collect();
        let sorted = morton::sorted(&points);
        points = sorted.iter().map(|&(_, i)| points[i as usize]).collect();
        let weights: Vec<f32> = (0..n).map(|i| if i % 5 == 0 { 0.0 } else { rng.next_f32() }).collect();
        let mut tree = PointTree::default();
        let codes: Vec<u32> = sorted.into_iter().map(|(code, _)| code).collect();
        let weighed: Vec<(Vec3, f32)> = points.iter().copied().zip(weights.iter().copied()).collect();
        tree.build(&codes, &weighed);
        (tree, points, weights)
    }

    #[test]
    fn cuts_are_partitions_and_their_sums_are_the_whole() {
        for n in [0, 1, 2, 3, 50, 3000] {
            let (tree, points, weights) = tree(n, n as u64);
            let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
            let (mut memory, mut cut) = (CutScratch::default(), vec![]);
            for clusters in [1, 2, 16, 200, 5000] {
                let from = ReceiverBounds { centre: Vec3::new(3.0, -1.0, 2.0), radius: 0.3, normal: Vec3::Y };
                tree.cut(&from, clusters, &mut memory, &mut cut);
                assert!(cut.len() <= clusters, "{n} {clusters}: {}", cut.len());
                assert!(cut.len() >= clusters.min(points.len() / LEAF / 2), "{n} {clusters}: {}", cut.len());
                let mut next = 0;
                let mut sum = 0.0;
                for range in &cut {
                    assert!(range.start == next && range.end > range.start);
                    next = range.end;
                    sum += tree.weight(range);
                }
                assert_eq!(next, n);
                assert!((sum - total).abs() <= 1e-9 * total, "{sum} {total}");
            }
        }
    }

    #[test]
    fn draws_follow_weights() {
        let (tree, _, weights) = tree(40, 9);
        let range = 7..29;
        let total: f64 = weights[range.clone()].iter().map(|w| f64::from(*w)).sum();
        const N: u32 = 100_000;
        let mut counts = [0u32; 40];
        for i in 0..N {
            let (at, p) = tree.draw(&range, (i as f32 + 0.5) / N as f32).unwrap();
            assert!((p - f64::from(weights[at]) / total).abs() < 1e-12);
            counts[at] += 1;
        }
        for (i, &count) in counts.iter().enumerate() {
            let expected = if range.contains(&i) { f64::from(weights[i]) / total * f64::from(N) } else { 0.0 };
            assert!((f64::from(count) - expected).abs() < 3.0, "{i}: {count} {expected}");
        }
        for u in [0.0, 1.0 - f32::EPSILON / 2.0] {
            assert!(weights[tree.draw(&(0..6), u).unwrap().0] > 0.0);
        }
        assert_eq!(tree.draw(&(5..6), 0.5), None);
    }

    #[test]
    fn cuts_are_fine_where_they_are_near() {
        let (tree, points, _) = tree(3000, 4);
        let from = ReceiverBounds { centre: Vec3::new(0.0, 5.0, 5.0), radius: 0.2, normal: Vec3::ZERO };
        let (mut memory, mut cut) = (CutScratch::default(), vec![]);
        tree.cut(&from, 100, &mut memory, &mut cut);
        let size = |near: bool| {
            let own: Vec<usize> = cut
                .iter()
                .filter(|r| (points[r.start].distance(from.centre) < 3.0) == near)
                .map(ExactSizeIterator::len)
                .collect();
            own.iter().sum::<usize>() as f64 / own.len() as f64
        };
        assert!(size(true) * 2.0 < size(false), "{} {}", size(true), size(false));
    }
}
