//! Sampling of one light source for a point, by a tree with eight children a node.
//!
//! Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting": importance of §5.1
//! without splitting, with the distance kept from falling below the node's radius. Three levels of the binary tree
//! become one, so that the importances of eight children are computed side by side. A walk from the root draws one
//! source; the probability of any source is the product along its own path, which is stored as bits.
//!
//! The walk ends early at a cluster of sources that face nearly one way and are seen under a small angle
//! (`WideNode::treat_as_single`): one of its sources is drawn by power. A finely tessellated emitter then costs a few
//! levels, not all of them.

use super::bounds::{LightBounds, Power};
use super::{LightTree, Node, OrientedSource, SaohSplit};
use crate::math::cdf::PrefixSums;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Pmf, Vec3};
use std::ops::Range;

/// Children of a node.
const WIDTH: usize = 8;
/// Levels of the binary tree in one node.
const LEVELS: u32 = WIDTH.ilog2();
/// Below this depth of the binary tree sets are halved by count, so that the path to any of 2³² sources fits into 64
/// bits.
const MAX_SAOH_DEPTH: u32 = 31;

/// One number for each child.
type Lanes = [f32; WIDTH];

/// Largest half angle of a cluster that is treated as one source, in radians …
const SINGLE_HALF_ANGLE: f32 = 0.2;
/// … and its largest radius as a fraction of the distance. Distance and cosines vary by a tenth or two over such a
/// cluster, which is little compared with the variation of visibility and BSDF.
const SINGLE_RADIUS: f32 = 0.1;

/// The children of a node, as one array for each number: bounding sphere, cone as cosines and sines, power, and range
/// of sources. Lanes without a child have no power.
#[derive(Clone, Debug, Default)]
#[repr(C, align(64))]
struct WideNode {
    centre: [Lanes; 3],
    radius2: Lanes,
    axis: [Lanes; 3],
    cos_half_angle: Lanes,
    sin_half_angle: Lanes,
    cos_emission: Lanes,
    power: Lanes,
    /// Squared distance from `centre` beyond which the child is treated as one source; infinite if its half angle is
    /// too large, negative if it is one source.
    single_distance2: Lanes,
    begin: [u32; WIDTH],
    end: [u32; WIDTH],
    /// Number of the node with the child's own children, if it is more than one source.
    child: [u32; WIDTH],
}

/// Cosine and sine of max(0, a − b) for angles in [0, π], each given as cosine and sine.
#[inline]
fn subtract(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    let (cos, sin) = (a.0 * b.0 + a.1 * b.1, (a.1 * b.0 - a.0 * b.1).max(0.0));
    if a.0 >= b.0 { (1.0, 0.0) } else { (cos, sin) }
}

/// Cosine and sine of the angle in [0, π] with the cosine `cos`.
#[inline]
fn with_sine(cos: f32) -> (f32, f32) {
    let cos = cos.clamp(-1.0, 1.0);
    (cos, (1.0 - cos * cos).sqrt())
}

impl WideNode {
    fn set<P: Power>(&mut self, lane: usize, node: &Node<LightBounds<P>>) {
        let LightBounds { aabb, cone, power } = &node.cluster;
        let (centre, axis) = (aabb.centre().to_array(), cone.axis.to_array());
        for c in 0..3 {
            self.centre[c][lane] = centre[c];
            self.axis[c][lane] = axis[c];
        }
        self.radius2[lane] = aabb.radius2();
        (self.sin_half_angle[lane], self.cos_half_angle[lane]) = cone.half_angle.sin_cos();
        self.cos_emission[lane] = cone.emission.cos();
        self.power[lane] = power.luminance();
        self.single_distance2[lane] = if node.is_leaf() {
            -1.0
        } else if cone.half_angle <= SINGLE_HALF_ANGLE {
            self.radius2[lane] / (SINGLE_RADIUS * SINGLE_RADIUS)
        } else {
            f32::INFINITY
        };
        (self.begin[lane], self.end[lane]) = (node.first, node.end);
    }

    fn range(&self, lane: usize) -> Range<usize> {
        self.begin[lane] as usize..self.end[lane] as usize
    }

    /// True if the sources of a child are drawn by power alone for the point `p`.
    #[inline]
    fn treat_as_single(&self, lane: usize, p: Vec3) -> bool {
        let centre = Vec3::new(self.centre[0][lane], self.centre[1][lane], self.centre[2][lane]);
        let near = centre.distance_squared(p) <= self.single_distance2[lane];
        !near
    }

    /// Estimates of the light that arrives from each child at `p`, on a surface with the normal `n` if `FACING`; zero
    /// only if none can arrive. There are no branches: all lanes are computed at once.
    #[inline]
    fn importance<const FACING: bool>(&self, p: Vec3, n: Vec3) -> Lanes {
        std::array::from_fn(|k| {
            let to: [f32; 3] = [self.centre[0][k] - p.x, self.centre[1][k] - p.y, self.centre[2][k] - p.z];
            let d2 = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
            let inside = d2 <= self.radius2[k] || d2 < f32::MIN_POSITIVE;
            let inverse_d2 = 1.0 / d2.max(self.radius2[k]).max(f32::MIN_POSITIVE);
            let inverse_d = inverse_d2.sqrt();
            let cos_to = |v: [f32; 3]| (v[0] * to[0] + v[1] * to[1] + v[2] * to[2]) * inverse_d;
            // Half angle under which the bounding sphere is seen.
            let sin2 = (self.radius2[k] * inverse_d2).min(1.0);
            let seen = ((1.0 - sin2).sqrt(), sin2.sqrt());
            let facing = with_sine(-cos_to([self.axis[0][k], self.axis[1][k], self.axis[2][k]]));
            let beyond = subtract(subtract(facing, (self.cos_half_angle[k], self.sin_half_angle[k])), seen).0;
            // Rounding must not darken a source whose light just reaches the point.
            let mut factor = if beyond < self.cos_emission[k] - 1e-4 { 0.0 } else { beyond.max(1e-3) };
            if FACING {
                let cos = subtract(with_sine(cos_to([n.x, n.y, n.z])), seen).0;
                factor *= if cos < -1e-4 { 0.0 } else { cos.max(1e-3) };
            }
            self.power[k] * inverse_d2 * if inside { 1.0 } else { factor }
        })
    }

    /// The children's shares of the unit interval for the point `p`.
    #[inline]
    fn shares(&self, p: Vec3, n: Option<Vec3>) -> Shares {
        let importance = match n {
            Some(n) => self.importance::<true>(p, n),
            None => self.importance::<false>(p, Vec3::ZERO),
        };
        let shares = Shares::new(&importance);
        // If nothing arrives any choice is right, but probabilities must still sum to one.
        if shares.total() > 0.0 && shares.total().is_finite() { shares } else { Shares::new(&self.power) }
    }
}

/// Sums of the importances before each child, and of all: the unit interval divided among the children, not normalised.
/// In double precision sums of eight numbers are as good as exact: no child loses its part to rounding, and the rest of
/// a random number can be used again at every level.
struct Shares([f64; WIDTH + 1]);

impl Shares {
    #[inline]
    fn new(parts: &Lanes) -> Shares {
        let [a, b, c, d, e, f, g, h] = parts.map(f64::from);
        // In an order that keeps the chain of additions short.
        let (half, pair) = ((a + b) + (c + d), e + f);
        Shares([0.0, a, a + b, (a + b) + c, half, half + e, half + pair, half + (pair + g), half + (pair + (g + h))])
    }

    #[inline]
    fn total(&self) -> f64 {
        self.0[WIDTH]
    }

    /// Width of the part of `child`.
    #[inline]
    fn part(&self, child: usize) -> f64 {
        self.0[child + 1] - self.0[child]
    }

    /// Probability of `child`.
    #[inline]
    fn pmf(&self, child: usize) -> f32 {
        (self.part(child) / self.total()) as f32
    }

    /// The child whose part holds `u` in [0, 1), and the relative position of `u` in that part.
    #[inline]
    fn choose(&self, u: f64) -> (usize, f64) {
        let target = u * self.total();
        let mut child = (1..WIDTH).map(|k| usize::from(target >= self.0[k])).sum::<usize>();
        // Rounding put the number at the very end, behind the last part.
        while child > 0 && self.part(child) <= 0.0 {
            child -= 1;
        }
        (child, ((target - self.0[child]) / self.part(child)).clamp(0.0, 1.0 - f64::EPSILON))
    }
}

/// A tree over oriented light sources that samples one of them for a point.
#[derive(Debug, Default)]
pub struct WideLightTree {
    /// The root of the binary tree is the only child of the first node; every other node comes after its parent.
    nodes: Vec<WideNode>,
    /// By index of the source; `None` for indices without a source.
    leaves: Vec<Option<LeafPath>>,
    /// Indices of the sources in the order of the leaves.
    order: Vec<u32>,
    /// Sums of powers in that order.
    weights: PrefixSums,
}

#[derive(Clone, Copy, Debug)]
struct LeafPath {
    /// The child to take at each node from the root on, three bits each, the lowest first.
    path: u64,
    /// Position in the order of the leaves.
    position: u32,
}

/// Part of a wide tree under construction.
struct Widening<'a, P> {
    binary: &'a LightTree<LightBounds<P>>,
    wide: WideLightTree,
}

impl<P: Power> Widening<'_, P> {
    /// Numbers of the binary nodes that are the children of `node` in a tree with nodes of [`WIDTH`] children: those
    /// [`LEVELS`] below it, and as long as they are fewer, the two halves of the one with the largest cost.
    fn children(&self, node: usize) -> Vec<usize> {
        let nodes = &self.binary.nodes;
        let halves = |n: usize| [nodes[n].child as usize, nodes[n].child as usize + 1];
        let mut children = vec![node];
        for _ in 0..LEVELS {
            children = children
                .into_iter()
                .flat_map(|n| if nodes[n].is_leaf() { vec![n] } else { halves(n).to_vec() })
                .collect();
        }
        // A small part of the box's extent is added to its sides, so that flat clusters have a cost.
        let cost = |node: usize| {
            let bounds = &nodes[node].cluster;
            bounds.cost(1e-3 * bounds.aabb.extent().max_element())
        };
        while children.len() < WIDTH {
            let open = (0..children.len()).filter(|&i| !nodes[children[i]].is_leaf());
            let Some(i) = open.max_by(|&i, &j| cost(children[i]).total_cmp(&cost(children[j]))) else { break };
            children.splice(i..=i, halves(children[i]));
        }
        children
    }

    /// Makes the wide nodes below the lane `at` = (node, lane), which is the binary node `node` and is reached by
    /// `path`, whose first `bits` bits are known.
    fn widen(&mut self, at: (usize, usize), node: usize, path: u64, bits: u32) {
        let binary = &self.binary.nodes[node];
        if binary.is_leaf() {
            let index = self.wide.order[binary.first as usize] as usize;
            self.wide.leaves[index] = Some(LeafPath { path, position: binary.first });
            return;
        }
        let number = self.wide.nodes.len();
        self.wide.nodes[at.0].child[at.1] = number as u32;
        self.wide.nodes.push(WideNode::default());
        for (lane, child) in self.children(node).into_iter().enumerate() {
            self.wide.nodes[number].set(lane, &self.binary.nodes[child]);
            self.widen((number, lane), child, path | (lane as u64) << bits, bits + LEVELS);
        }
    }
}

impl WideLightTree {
    /// The tree over `sources`, whose indices differ and whose powers are positive and finite.
    pub fn new<P: Power>(mut sources: Vec<OrientedSource<P>>) -> WideLightTree {
        let mut binary = LightTree::default();
        binary.build(&mut sources, &SaohSplit { max_depth: MAX_SAOH_DEPTH }, 1);
        let order: Vec<u32> = sources.iter().map(|s| s.index).collect();
        let leaves = vec![None; order.iter().max().map_or(0, |&last| last as usize + 1)];
        let wide = WideLightTree { nodes: Vec::new(), leaves, order, weights: binary.weights.clone() };
        let mut widening = Widening { binary: &binary, wide };
        if let Some(root) = binary.nodes.first() {
            let mut first = WideNode::default();
            first.set(0, root);
            widening.wide.nodes.push(first);
            widening.widen((0, 0), 0, 0, 0);
        }
        widening.wide
    }

    /// True if there are no sources.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Draws a source that may light the point `p`, and returns its index and probability. `n` is the unit normal on
    /// the side where light is received; `None` if light is received from all sides. `None` is returned only by an
    /// empty tree.
    pub fn sample(&self, p: Vec3, n: Option<Vec3>, u: f32) -> Option<(u32, Pmf)> {
        let (mut node, mut lane, mut pmf) = (self.nodes.first()?, 0, 1.0);
        let mut u = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON));
        while !node.treat_as_single(lane, p) {
            node = &self.nodes[node.child[lane] as usize];
            let shares = node.shares(p, n);
            (lane, u) = shares.choose(u);
            pmf *= shares.pmf(lane);
        }
        let range = node.range(lane);
        if range.len() == 1 {
            return Some((self.order[range.start], Pmf(pmf)));
        }
        let position = self.weights.sample(&range, u)?;
        Some((self.order[position], Pmf(pmf * self.weights.pmf(&range, position) as f32)))
    }

    /// Probability with which [`WideLightTree::sample`] draws the source with the index `index` for the same `p` and
    /// `n`.
    pub fn pmf(&self, p: Vec3, n: Option<Vec3>, index: u32) -> Pmf {
        let Some(Some(LeafPath { mut path, position })) = self.leaves.get(index as usize).copied() else {
            return Pmf(0.0);
        };
        let (mut node, mut lane, mut pmf) = (&self.nodes[0], 0, 1.0);
        while !node.treat_as_single(lane, p) {
            node = &self.nodes[node.child[lane] as usize];
            lane = path as usize % WIDTH;
            path >>= LEVELS;
            pmf *= node.shares(p, n).pmf(lane);
        }
        let range = node.range(lane);
        Pmf(if range.len() == 1 { pmf } else { pmf * self.weights.pmf(&range, position as usize) as f32 })
    }
}
