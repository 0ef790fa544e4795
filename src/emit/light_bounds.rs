//! What is known of a set of lights: a box around them, a cone around their normals, their power; and where to cut a set in two.
//!
//! Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting": bounds of §4.1, the surface area
//! orientation heuristic of §4.4.

use super::light::Light;
use crate::math::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// A cone of directions: axis and half angle `spread` of the normals, and how far beyond them a normal emits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    pub axis: Vec3,
    pub spread: f32,
    pub emission: f32,
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
pub(super) struct Bounds {
    min: Vec3,
    max: Vec3,
    pub cone: Cone,
    pub power: f32,
}

impl Bounds {
    pub fn of(light: &Light) -> Option<Bounds> {
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

    pub fn union(self, o: Bounds) -> Bounds {
        Bounds {
            min: self.min.min(o.min),
            max: self.max.max(o.max),
            cone: self.cone.union(o.cone),
            power: self.power + o.power,
        }
    }

    pub fn centre(&self) -> Vec3 {
        self.min + (self.max - self.min) * 0.5
    }

    /// Squared radius of the sphere around the box.
    pub fn radius2(&self) -> f32 {
        0.25 * (self.max - self.min).length_squared()
    }

    /// A small part of the box's extent.
    pub fn thickness(&self) -> f32 {
        1e-3 * (self.max - self.min).max_element()
    }

    /// What treating the lights as one costs, by the surface area orientation heuristic; the box gets a thickness so that flat and
    /// point-like sets still tell far from near.
    pub fn cost(&self, thickness: f32) -> f32 {
        let d = self.max - self.min + Vec3::splat(thickness);
        let area = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x);
        self.power * area * self.cone.measure()
    }
}

/// Buckets per axis in which splits are tried.
const BUCKETS: usize = 12;

/// Orders `items` and says where to cut them (both parts non-empty): the cheapest bucket boundary of the surface area orientation
/// heuristic, or the middle if there is none, or if the halves are to be `even`.
pub(super) fn split(items: &mut [(u32, Bounds)], even: bool) -> usize {
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
    for axis in (0..3).filter(|&axis| !even && extent[axis] > 0.0) {
        let mut buckets: [Option<Bounds>; BUCKETS] = [None; BUCKETS];
        for (_, b) in items.iter() {
            let bucket = &mut buckets[bucket_of(b, axis)];
            *bucket = Some(bucket.map_or(*b, |o| o.union(*b)));
        }
        let join = |a: Option<Bounds>, b: &Option<Bounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(*b)),
            (a, b) => a.or(*b),
        };
        let cost = |b: Option<Bounds>| b.map(|b| b.cost(thickness));
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
