//! Choice of a light for a point: a tree of eight children a node over lights with a position, whose nodes bound the light's contribution.
//!
//! Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting": importance of §5.1 without splitting,
//! with the distance kept from falling below the node's radius, over the bounds of `light_bounds.rs`. The tree is cut in two as there,
//! then three levels become one, so that the importances of eight children are computed side by side. A walk from the root draws
//! one light; the probability of any light is the product along its own path, which is kept as bits.
//!
//! The walk ends early at a set of lights that face nearly one way and are seen under a small angle (`Children::is_one_from`): they
//! are as good as one light, and one of them is chosen by its power. A finely tessellated emitter then costs a few levels, not all of
//! them.

use super::light::Light;
use super::light_bounds::{Bounds, split};
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Pmf, Vec3};
use std::ops::Range;

/// Children of a node.
const WIDTH: usize = 8;
/// Levels of the binary tree that one node stands for.
const LEVELS: u32 = WIDTH.ilog2();
/// Below this depth of the binary tree sets are halved by count, so that the turns to any of 2³² lights fit into 64 bits.
const MAX_CHOSEN_DEPTH: u32 = 31;

/// One number of each child.
type Lanes = [f32; WIDTH];

/// A set of lights whose normals differ by no more than this from their axis, in radians …
const ONE_SPREAD: f32 = 0.2;
/// … and whose radius is at most this part of the distance, counts as one light. Distance and cosines vary by a tenth or two over it,
/// which is little beside what visibility and the BSDF leave.
const ONE_RADIUS: f32 = 0.1;

/// The children of a node, number by number. A child is a set of lights: its bounding sphere, its cone as cosines and sines, its
/// power, its range of the tree's order. Lanes without a child have no power.
#[derive(Clone, Debug, Default)]
#[repr(C, align(64))]
struct Children {
    centre: [Lanes; 3],
    radius2: Lanes,
    axis: [Lanes; 3],
    cos_spread: Lanes,
    sin_spread: Lanes,
    cos_emission: Lanes,
    power: Lanes,
    /// Squared distance of `centre` from which on the child counts as one light; infinite if it is too wide open, less than nothing if
    /// it is one light.
    one_from2: Lanes,
    begin: [u32; WIDTH],
    end: [u32; WIDTH],
    /// The child's own children, if it is more than one light.
    below: [u32; WIDTH],
}

/// Cosine and sine of max(0, a − b) for angles in [0, π].
#[inline]
fn subtract(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    let (cos, sin) = (a.0 * b.0 + a.1 * b.1, (a.1 * b.0 - a.0 * b.1).max(0.0));
    if a.0 >= b.0 { (1.0, 0.0) } else { (cos, sin) }
}

#[inline]
fn with_sine(cos: f32) -> (f32, f32) {
    let cos = cos.clamp(-1.0, 1.0);
    (cos, (1.0 - cos * cos).sqrt())
}

impl Children {
    fn set(&mut self, lane: usize, set: &Set) {
        let b = &set.bounds;
        let (centre, axis) = (b.centre().to_array(), b.cone.axis.to_array());
        for c in 0..3 {
            self.centre[c][lane] = centre[c];
            self.axis[c][lane] = axis[c];
        }
        self.radius2[lane] = b.radius2();
        (self.sin_spread[lane], self.cos_spread[lane]) = b.cone.spread.sin_cos();
        self.cos_emission[lane] = b.cone.emission.cos();
        self.power[lane] = b.power;
        self.one_from2[lane] = match set.halves {
            None => -1.0,
            Some(_) if b.cone.spread <= ONE_SPREAD => self.radius2[lane] / (ONE_RADIUS * ONE_RADIUS),
            Some(_) => f32::INFINITY,
        };
        (self.begin[lane], self.end[lane]) = (set.range.start, set.range.end);
    }

    fn range(&self, lane: usize) -> Range<usize> {
        self.begin[lane] as usize..self.end[lane] as usize
    }

    /// Whether the lights of a child need not be told apart at the point `p`.
    #[inline]
    fn is_one_from(&self, lane: usize, p: Vec3) -> bool {
        let centre = Vec3::new(self.centre[0][lane], self.centre[1][lane], self.centre[2][lane]);
        let near = centre.distance_squared(p) <= self.one_from2[lane];
        !near
    }

    /// Estimates of the light that arrives from each child; zero only if none can. No branches: all lanes are computed at once.
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
            let beyond = subtract(subtract(facing, (self.cos_spread[k], self.sin_spread[k])), seen).0;
            // Rounding must not darken a light that just reaches the point.
            let mut factor = if beyond < self.cos_emission[k] - 1e-4 { 0.0 } else { beyond.max(1e-3) };
            if FACING {
                let cos = subtract(with_sine(cos_to([n.x, n.y, n.z])), seen).0;
                factor *= if cos < -1e-4 { 0.0 } else { cos.max(1e-3) };
            }
            self.power[k] * inverse_d2 * if inside { 1.0 } else { factor }
        })
    }

    /// The sums of the importances before each child, and of all.
    #[inline]
    fn shares(&self, p: Vec3, n: Option<Vec3>) -> Shares {
        let importance = match n {
            Some(n) => self.importance::<true>(p, n),
            None => self.importance::<false>(p, Vec3::ZERO),
        };
        let shares = Shares::new(&importance);
        // Where nothing arrives the choice does not matter, but probabilities still sum to one.
        if shares.total() > 0.0 && shares.total().is_finite() { shares } else { Shares::new(&self.power) }
    }
}

/// The unit interval divided among the children of a node, not normalised. In double precision, in which sums of eight numbers are as
/// good as exact: no child loses its part to rounding, and what is left of a random number can be used again at every level.
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

    /// The child that `u` in [0, 1) chooses, and what is left of the number.
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

/// The tree.
#[derive(Debug, Default)]
pub struct LightTree {
    /// The root is the only child of the first, and every other node follows the one above it.
    nodes: Vec<Children>,
    /// By light: where it is; `None` for lights that are not in the tree.
    places: Vec<Option<Place>>,
    /// The lights in the order of the leaves.
    order: Vec<u32>,
    /// Sum of the powers before each place of `order`, and of all.
    sums: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    /// The child to take at each node from the root on, three bits each, the lowest first.
    path: u64,
    /// In `order`.
    index: u32,
}

/// A set of lights of the binary tree.
struct Set {
    bounds: Bounds,
    /// Its lights are places of the tree's order.
    range: Range<u32>,
    /// `None` for a single light.
    halves: Option<[Box<Set>; 2]>,
}

impl Set {
    fn is_single(&self) -> bool {
        self.halves.is_none()
    }

    /// Its children in a tree with nodes of [`WIDTH`] children: the sets [`LEVELS`] below it, and if they are fewer, the parts of those
    /// that can least be treated as one.
    fn children(&self) -> Vec<&Set> {
        let mut children = vec![self];
        for _ in 0..LEVELS {
            let halves = |set| match set {
                &Set { halves: Some([ref a, ref b]), .. } => vec![&**a, &**b],
                single => vec![single],
            };
            children = children.into_iter().flat_map(halves).collect();
        }
        while children.len() < WIDTH {
            let open = (0..children.len()).filter(|&i| !children[i].is_single());
            let cost = |i: usize| children[i].bounds.cost(children[i].bounds.thickness());
            let costliest = open.max_by(|&i, &j| cost(i).total_cmp(&cost(j)));
            let Some((i, Some([a, b]))) = costliest.map(|i| (i, &children[i].halves)) else { break };
            children.splice(i..=i, [&**a, &**b]);
        }
        children
    }
}

impl LightTree {
    /// Over the lights that have a position and power.
    pub fn new(lights: &[Light]) -> LightTree {
        let mut items: Vec<(u32, Bounds)> =
            lights.iter().enumerate().filter_map(|(i, l)| Some((i as u32, Bounds::of(l)?))).collect();
        let mut tree =
            LightTree { nodes: Vec::new(), places: vec![None; lights.len()], order: Vec::new(), sums: vec![0.0] };
        if !items.is_empty() {
            let root = tree.halve(&mut items, 0);
            let mut above = Children::default();
            above.set(0, &root);
            tree.nodes.push(above);
            tree.widen((0, 0), &root, (0, 0));
        }
        tree
    }

    /// True if no light is in it.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The binary tree; puts the lights in order.
    fn halve(&mut self, items: &mut [(u32, Bounds)], depth: u32) -> Set {
        let begin = self.order.len() as u32;
        if let [(light, bounds)] = items {
            self.order.push(*light);
            self.sums.push(self.sums[begin as usize] + f64::from(bounds.power));
            return Set { bounds: *bounds, range: begin..begin + 1, halves: None };
        }
        let middle = split(items, depth >= MAX_CHOSEN_DEPTH);
        let (first, second) = items.split_at_mut(middle);
        let halves = [first, second].map(|half| Box::new(self.halve(half, depth + 1)));
        let bounds = halves[0].bounds.union(halves[1].bounds);
        Set { bounds, range: begin..self.order.len() as u32, halves: Some(halves) }
    }

    /// Makes the nodes below the child `at` = (node, lane), which is `set` and reached by the turns `path`, `shift` bits of them.
    fn widen(&mut self, at: (usize, usize), set: &Set, (path, shift): (u64, u32)) {
        if set.is_single() {
            let index = set.range.start;
            self.places[self.order[index as usize] as usize] = Some(Place { path, index });
            return;
        }
        let node = self.nodes.len();
        self.nodes[at.0].below[at.1] = node as u32;
        self.nodes.push(Children::default());
        for (lane, child) in set.children().into_iter().enumerate() {
            self.nodes[node].set(lane, child);
            self.widen((node, lane), child, (path | (lane as u64) << shift, shift + LEVELS));
        }
    }

    /// Probability of the light at `place` of the order among those at `range`, by power.
    fn share_by_power(&self, range: &Range<usize>, place: usize) -> f32 {
        let total = self.sums[range.end] - self.sums[range.start];
        ((self.sums[place + 1] - self.sums[place]) / total) as f32
    }

    /// Place of the light of those at `range` that `u` in [0, 1) chooses by power.
    fn place_by_power(&self, range: &Range<usize>, u: f64) -> usize {
        let (begin, end) = (range.start, range.end);
        let target = self.sums[begin] + u * (self.sums[end] - self.sums[begin]);
        // Triangles of one emitter are often alike, so that the search begins next to its end.
        let guess = (begin + (u * (end - begin) as f64) as usize).min(end - 1);
        let (mut low, mut high) = (begin, end);
        let mut step = 1;
        if self.sums[guess] <= target {
            low = guess;
            while low + step < end && self.sums[low + step] <= target {
                low += step;
                step *= 2;
            }
            high = (low + step).min(end);
        } else {
            high = high.min(guess);
            while high > begin + step && self.sums[high - step] > target {
                high -= step;
                step *= 2;
            }
            low = low.max(high.saturating_sub(step));
        }
        while high - low > 1 {
            let mid = (low + high) / 2;
            if self.sums[mid] <= target { low = mid } else { high = mid }
        }
        low
    }

    /// Draws a light for the point `p`; see [`super::LightSet::sample_light_from`]. `None` for an empty tree.
    pub fn sample(&self, p: Vec3, n: Option<Vec3>, u: f32) -> Option<(u32, Pmf)> {
        let (mut node, mut lane, mut pmf) = (self.nodes.first()?, 0, 1.0);
        let mut u = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON));
        while !node.is_one_from(lane, p) {
            node = &self.nodes[node.below[lane] as usize];
            let shares = node.shares(p, n);
            (lane, u) = shares.choose(u);
            pmf *= shares.pmf(lane);
        }
        let range = node.range(lane);
        if range.len() == 1 {
            return Some((self.order[range.start], Pmf(pmf)));
        }
        let place = self.place_by_power(&range, u);
        Some((self.order[place], Pmf(pmf * self.share_by_power(&range, place))))
    }

    /// Probability with which [`LightTree::sample`] draws `light`.
    pub fn pmf(&self, p: Vec3, n: Option<Vec3>, light: u32) -> Pmf {
        let Some(Some(Place { mut path, index })) = self.places.get(light as usize).copied() else {
            return Pmf(0.0);
        };
        let (mut node, mut lane, mut pmf) = (&self.nodes[0], 0, 1.0);
        while !node.is_one_from(lane, p) {
            node = &self.nodes[node.below[lane] as usize];
            lane = path as usize % WIDTH;
            path >>= LEVELS;
            pmf *= node.shares(p, n).pmf(lane);
        }
        let range = node.range(lane);
        Pmf(if range.len() == 1 { pmf } else { pmf * self.share_by_power(&range, index as usize) })
    }
}
