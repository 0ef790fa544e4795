//! Choice of a light for a point: a binary tree over lights with a position, whose nodes bound the light's contribution.
//!
//! Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting" (bounds of §4.1, the surface area
//! orientation heuristic of §4.4, importance of §5.1 without splitting), with the distance kept from falling below the node's radius.
//! A walk from the root draws one light; the probability of any light is the product along its own path, which is kept as bits.
//!
//! The walk ends early at a set of lights that face nearly one way and are seen under a small angle (`Node::is_one_from`): they are as
//! good as one light, and one of them is chosen by its power. A finely tessellated emitter then costs a few levels, not all of them.

use super::light::Light;
use crate::math::float::ONE_MINUS_EPSILON;
use crate::math::{Pmf, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// A cone of directions: axis and half angle `spread` of the normals, and how far beyond them a normal emits.
#[derive(Clone, Copy, Debug)]
struct Cone {
    axis: Vec3,
    spread: f32,
    emission: f32,
}

impl Cone {
    fn union(self, other: Cone) -> Cone {
        let (a, b) = if self.spread >= other.spread { (self, other) } else { (other, self) };
        let emission = a.emission.max(b.emission);
        let between = a.axis.dot(b.axis).clamp(-1.0, 1.0).acos();
        if (between + b.spread).min(PI) <= a.spread {
            return Cone { emission, ..a };
        }
        let spread = 0.5 * (a.spread + between + b.spread);
        let pivot = a.axis.cross(b.axis);
        if spread >= PI || pivot.length_squared() < 1e-12 {
            return Cone { axis: a.axis, spread: PI, emission };
        }
        let axis = glam::Quat::from_axis_angle(pivot.normalize(), spread - a.spread) * a.axis;
        Cone { axis: axis.normalize(), spread, emission }
    }

    /// M_Ω, the orientation measure: the solid angle lit, weighted by the cosine beyond the spread.
    fn measure(&self) -> f32 {
        let w = (self.spread + self.emission).min(PI);
        let (sin, cos) = self.spread.sin_cos();
        2.0 * PI * (1.0 - cos)
            + FRAC_PI_2 * (2.0 * w * sin - (self.spread - 2.0 * w).cos() - 2.0 * self.spread * sin + cos)
    }
}

/// What is known of the lights below a node.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: Vec3,
    max: Vec3,
    cone: Cone,
    power: f32,
}

impl Bounds {
    fn of(light: &Light) -> Option<Bounds> {
        let power = light.power();
        if !(power > 0.0 && power.is_finite()) {
            return None;
        }
        let (min, max, cone) = match light {
            Light::Triangle(l) => {
                let [a, b, c] = l.corners();
                (a.min(b).min(c), a.max(b).max(c), Cone { axis: l.ng(), spread: 0.0, emission: FRAC_PI_2 })
            }
            Light::Point(l) => (l.position(), l.position(), Cone { axis: Vec3::Z, spread: PI, emission: FRAC_PI_2 }),
            // Nearly uniform inside: the whole cone counts as normals, and nothing lies beyond.
            Light::Spot(l) => (l.position(), l.position(), Cone { axis: l.axis(), spread: l.cutoff(), emission: 1e-3 }),
            Light::Directional(_) | Light::Environment(_) => return None,
        };
        Some(Bounds { min, max, cone, power })
    }

    fn union(self, o: Bounds) -> Bounds {
        Bounds {
            min: self.min.min(o.min),
            max: self.max.max(o.max),
            cone: self.cone.union(o.cone),
            power: self.power + o.power,
        }
    }

    fn centre(&self) -> Vec3 {
        self.min + (self.max - self.min) * 0.5
    }

    /// Surface area, with a thickness so that flat and point-like sets still tell far from near.
    fn area(&self, thickness: f32) -> f32 {
        let d = self.max - self.min + Vec3::splat(thickness);
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }
}

/// A node as it is walked: bounding sphere, cone as cosines and sines, power.
#[derive(Clone, Copy, Debug)]
struct Node {
    centre: Vec3,
    radius2: f32,
    axis: Vec3,
    cos_spread: f32,
    sin_spread: f32,
    cos_emission: f32,
    power: f32,
    /// Squared distance of `centre` from which on the node counts as one light; infinite if it is too wide open, or a leaf.
    one_from2: f32,
    link: Link,
    /// Its lights are places `begin..end` of the tree's order.
    begin: u32,
    end: u32,
}

/// A set of lights whose normals differ by no more than this from their axis, in radians …
const ONE_SPREAD: f32 = 0.2;
/// … and whose radius is at most this part of the distance, counts as one light. Distance and cosines vary by a tenth or two over it,
/// which is little beside what visibility and the BSDF leave.
const ONE_RADIUS: f32 = 0.1;

#[derive(Clone, Copy, Debug)]
enum Link {
    /// The light's index.
    Leaf(u32),
    /// The first child follows its parent; this is the second's index.
    Inner(u32),
}

/// Cosine and sine of max(0, a − b) for angles in [0, π].
fn subtract(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    if a.0 >= b.0 { (1.0, 0.0) } else { (a.0 * b.0 + a.1 * b.1, (a.1 * b.0 - a.0 * b.1).max(0.0)) }
}

fn with_sine(cos: f32) -> (f32, f32) {
    (cos, (1.0 - cos * cos).max(0.0).sqrt())
}

impl Node {
    fn new(b: &Bounds, link: Link, range: std::ops::Range<usize>) -> Node {
        let (sin_spread, cos_spread) = b.cone.spread.sin_cos();
        let radius2 = 0.25 * (b.max - b.min).length_squared();
        let one = matches!(link, Link::Inner(_)) && b.cone.spread <= ONE_SPREAD;
        Node {
            centre: b.centre(),
            radius2,
            axis: b.cone.axis,
            cos_spread,
            sin_spread,
            cos_emission: b.cone.emission.cos(),
            power: b.power,
            one_from2: if one { radius2 / (ONE_RADIUS * ONE_RADIUS) } else { f32::INFINITY },
            link,
            begin: range.start as u32,
            end: range.end as u32,
        }
    }

    /// Whether the lights below need not be told apart at the point `p`.
    #[inline]
    fn is_one_from(&self, p: Vec3) -> bool {
        self.centre.distance_squared(p) > self.one_from2
    }

    /// An estimate of the light that arrives; zero only if none can.
    #[inline]
    fn importance(&self, p: Vec3, n: Option<Vec3>) -> f32 {
        let to = self.centre - p;
        let d2 = to.length_squared();
        if d2 <= self.radius2 || d2 < f32::MIN_POSITIVE {
            return self.power / d2.max(self.radius2).max(f32::MIN_POSITIVE);
        }
        let inverse_d2 = 1.0 / d2;
        let wi = to * inverse_d2.sqrt();
        // Half angle under which the bounding sphere is seen.
        let seen = {
            let sin2 = self.radius2 * inverse_d2;
            ((1.0 - sin2).max(0.0).sqrt(), sin2.sqrt())
        };
        let facing = with_sine((-self.axis.dot(wi)).clamp(-1.0, 1.0));
        let beyond = subtract(subtract(facing, (self.cos_spread, self.sin_spread)), seen);
        // Rounding must not darken a light that just reaches the point.
        if beyond.0 < self.cos_emission - 1e-4 {
            return 0.0;
        }
        let importance = self.power * inverse_d2 * beyond.0.max(1e-3);
        let Some(n) = n else { return importance };
        let (cos, _) = subtract(with_sine(n.dot(wi).clamp(-1.0, 1.0)), seen);
        if cos < -1e-4 { 0.0 } else { importance * cos.max(1e-3) }
    }
}

/// The tree.
#[derive(Debug, Default)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// By light: where it is; `None` for lights that are not in the tree.
    places: Vec<Option<Place>>,
    /// The lights from the first leaf to the last.
    order: Vec<u32>,
    /// Sum of the powers before each place of `order`, and of all.
    sums: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    /// Turns from the root: bit 0 first, 1 = second child.
    path: u64,
    /// In `order`.
    index: u32,
}

/// Below this depth subtrees are halved by count, so that 64 turns suffice for 2³² lights.
const MAX_CHOSEN_DEPTH: u32 = 32;
/// Buckets per axis in which splits are tried.
const BUCKETS: usize = 12;

impl LightTree {
    /// Over the lights that have a position and power.
    pub fn new(lights: &[Light]) -> LightTree {
        let mut items: Vec<(u32, Bounds)> =
            lights.iter().enumerate().filter_map(|(i, l)| Some((i as u32, Bounds::of(l)?))).collect();
        let mut tree =
            LightTree { nodes: Vec::new(), places: vec![None; lights.len()], order: Vec::new(), sums: vec![0.0] };
        if !items.is_empty() {
            tree.nodes.reserve(2 * items.len());
            tree.build(&mut items, 0, 0);
        }
        tree
    }

    /// True if no light is in it.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn build(&mut self, items: &mut [(u32, Bounds)], path: u64, depth: u32) -> Bounds {
        let index = self.nodes.len();
        if let [(light, bounds)] = items {
            let place = self.order.len();
            self.nodes.push(Node::new(bounds, Link::Leaf(*light), place..place + 1));
            self.places[*light as usize] = Some(Place { path, index: place as u32 });
            self.order.push(*light);
            self.sums.push(self.sums[place] + f64::from(bounds.power));
            return *bounds;
        }
        let middle = split(items, depth);
        let (first, second) = items.split_at_mut(middle);
        // Filled in when the children are known.
        let begin = self.order.len();
        let placeholder = Node::new(&first[0].1, Link::Leaf(0), 0..0);
        self.nodes.push(placeholder);
        let a = self.build(first, path, depth + 1);
        let link = Link::Inner(self.nodes.len() as u32);
        let b = self.build(second, path | 1 << depth, depth + 1);
        let bounds = a.union(b);
        self.nodes[index] = Node::new(&bounds, link, begin..self.order.len());
        bounds
    }

    /// Probability of the light at `place` of the order among those of `node`, by power.
    fn share_by_power(&self, node: &Node, place: usize) -> f32 {
        let total = self.sums[node.end as usize] - self.sums[node.begin as usize];
        ((self.sums[place + 1] - self.sums[place]) / total) as f32
    }

    /// Place of the light of `node` that `u` in [0, 1) chooses by power.
    fn place_by_power(&self, node: &Node, u: f64) -> usize {
        let (begin, end) = (node.begin as usize, node.end as usize);
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

    /// Probability of the second child.
    fn second_share(&self, first: usize, second: usize, p: Vec3, n: Option<Vec3>) -> f32 {
        let (a, b) = (&self.nodes[first], &self.nodes[second]);
        let (ia, ib) = (a.importance(p, n), b.importance(p, n));
        let total = ia + ib;
        // Where nothing arrives the choice does not matter, but probabilities still sum to one.
        if total > 0.0 && total.is_finite() { ib / total } else { b.power / (a.power + b.power) }
    }

    /// Draws a light for the point `p`; see [`super::LightSet::pick_from`]. `None` for an empty tree.
    pub fn sample(&self, p: Vec3, n: Option<Vec3>, u: f32) -> Option<(u32, Pmf)> {
        let mut at = 0;
        let mut pmf = 1.0;
        let mut u = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON));
        loop {
            let node = self.nodes.get(at)?;
            match node.link {
                Link::Leaf(light) => return Some((light, Pmf(pmf))),
                Link::Inner(_) if node.is_one_from(p) => {
                    let place = self.place_by_power(node, u);
                    return Some((self.order[place], Pmf(pmf * self.share_by_power(node, place))));
                }
                Link::Inner(second) => {
                    let share = self.second_share(at + 1, second as usize, p, n);
                    let first_share = 1.0 - share;
                    let split = f64::from(first_share);
                    // In double precision the number can be used again at every level.
                    if u < split {
                        u /= split;
                        pmf *= first_share;
                        at += 1;
                    } else {
                        u = ((u - split) / f64::from(share)).min(1.0 - f64::EPSILON);
                        pmf *= share;
                        at = second as usize;
                    }
                }
            }
        }
    }

    /// Probability with which [`LightTree::sample`] draws `light`.
    pub fn pmf(&self, p: Vec3, n: Option<Vec3>, light: u32) -> Pmf {
        let Some(Some(Place { mut path, index })) = self.places.get(light as usize).copied() else {
            return Pmf(0.0);
        };
        let (mut at, mut pmf) = (0, 1.0);
        while let Link::Inner(second) = self.nodes[at].link {
            let node = &self.nodes[at];
            if node.is_one_from(p) {
                return Pmf(pmf * self.share_by_power(node, index as usize));
            }
            let share = self.second_share(at + 1, second as usize, p, n);
            if path & 1 == 0 {
                pmf *= 1.0 - share;
                at += 1;
            } else {
                pmf *= share;
                at = second as usize;
            }
            path >>= 1;
        }
        Pmf(pmf)
    }
}

/// Orders `items` and says where to cut them (both parts non-empty): the cheapest bucket boundary of the surface area orientation
/// heuristic, or the middle if there is none.
fn split(items: &mut [(u32, Bounds)], depth: u32) -> usize {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (mut all_low, mut all_high) = (low, high);
    for (_, b) in items.iter() {
        low = low.min(b.centre());
        high = high.max(b.centre());
        all_low = all_low.min(b.min);
        all_high = all_high.max(b.max);
    }
    let extent = high - low;
    let whole = all_high - all_low;
    let thickness = 1e-3 * whole.max_element();
    let bucket_of = |b: &Bounds, axis: usize| {
        (((b.centre()[axis] - low[axis]) / extent[axis] * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| depth < MAX_CHOSEN_DEPTH && extent[axis] > 0.0) {
        let mut buckets: [Option<Bounds>; BUCKETS] = [None; BUCKETS];
        for (_, b) in items.iter() {
            let bucket = &mut buckets[bucket_of(b, axis)];
            *bucket = Some(bucket.map_or(*b, |o| o.union(*b)));
        }
        let join = |a: Option<Bounds>, b: &Option<Bounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(*b)),
            (a, b) => a.or(*b),
        };
        let cost = |b: Option<Bounds>| b.map(|b| b.power * b.area(thickness) * b.cone.measure());
        let above: Vec<Option<f32>> = {
            let mut sum = None;
            let mut v: Vec<_> = buckets
                .iter()
                .rev()
                .map(|b| {
                    sum = join(sum, b);
                    cost(sum)
                })
                .collect();
            v.reverse();
            v
        };
        // Long thin sets should be cut across their length.
        let shape = whole.max_element() / whole[axis].max(thickness);
        let mut below = None;
        for k in 1..BUCKETS {
            below = join(below, &buckets[k - 1]);
            if let (Some(a), Some(b)) = (cost(below), above[k]) {
                let c = shape * (a + b);
                if c.is_finite() && best.is_none_or(|(lowest, ..)| c < lowest) {
                    best = Some((c, axis, k));
                }
            }
        }
    }
    match best {
        Some((_, axis, cut)) => {
            items.sort_unstable_by_key(|(i, b)| (bucket_of(b, axis) >= cut, *i));
            items.partition_point(|(_, b)| bucket_of(b, axis) < cut)
        }
        None => {
            let axis = extent.max_position();
            items.sort_unstable_by(|a, b| a.1.centre()[axis].total_cmp(&b.1.centre()[axis]).then(a.0.cmp(&b.0)));
            items.len() / 2
        }
    }
}
