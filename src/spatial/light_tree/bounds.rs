//! Bounds of clusters of light sources: a box, a cone of normals, the power.
//!
//! Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", §4.1.

use crate::math::{Rgb, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Bounds of a cluster of light sources.
pub trait LightCluster: Copy {
    /// Bounds of both clusters together.
    fn union(self, other: Self) -> Self;

    /// Box around the cluster.
    fn aabb(&self) -> &Aabb;
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Corner with the least coordinates.
    pub min: Vec3,
    /// Corner with the largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The box that contains nothing.
    pub const EMPTY: Aabb = Aabb { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box around some points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Aabb {
        points.into_iter().fold(Aabb::EMPTY, |b, p| Aabb { min: b.min.min(p), max: b.max.max(p) })
    }

    /// Lengths of the sides.
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }

    /// Middle of the box.
    pub fn centre(&self) -> Vec3 {
        self.min + self.extent() * 0.5
    }

    /// Squared radius of the sphere around the box.
    pub fn radius2(&self) -> f32 {
        0.25 * self.extent().length_squared()
    }
}

impl LightCluster for Aabb {
    fn union(self, other: Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    fn aabb(&self) -> &Aabb {
        self
    }
}

/// Bounds on the directions in which a cluster emits.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// Unit vector in the middle of the normals.
    pub axis: Vec3,
    /// Largest angle between the axis and a normal, in radians.
    pub half_angle: f32,
    /// Largest angle between a normal and a direction in which its source emits, in radians.
    pub emission: f32,
}

impl Cone {
    fn union(self, other: Cone) -> Cone {
        let (a, b) = if self.half_angle >= other.half_angle { (self, other) } else { (other, self) };
        let emission = a.emission.max(b.emission);
        let between = a.axis.dot(b.axis).clamp(-1.0, 1.0).acos();
        if (between + b.half_angle).min(PI) <= a.half_angle {
            return Cone { emission, ..a };
        }
        let half_angle = 0.5 * (a.half_angle + between + b.half_angle);
        let pivot = a.axis.cross(b.axis);
        if half_angle >= PI || pivot.length_squared() < 1e-12 {
            return Cone { axis: a.axis, half_angle: PI, emission };
        }
        let axis = glam::Quat::from_axis_angle(pivot.normalize(), half_angle - a.half_angle) * a.axis;
        Cone { axis: axis.normalize(), half_angle, emission }
    }

    /// The orientation measure M_Ω: the solid angle that receives light, beyond the half angle weighted by the cosine.
    fn measure(&self) -> f32 {
        let w = (self.half_angle + self.emission).min(PI);
        let (sin, cos) = self.half_angle.sin_cos();
        2.0 * PI * (1.0 - cos)
            + FRAC_PI_2 * (2.0 * w * sin - (self.half_angle - 2.0 * w).cos() - 2.0 * self.half_angle * sin + cos)
    }
}

/// Emitted power: a number or a colour.
pub trait Power: Copy + std::ops::Add<Output = Self> {
    /// Luminance: the weight of a source with this power.
    fn luminance(self) -> f32;
}

impl Power for f32 {
    fn luminance(self) -> f32 {
        self
    }
}

impl Power for Rgb {
    fn luminance(self) -> f32 {
        Rgb::luminance(self)
    }
}

/// Bounds of a cluster of oriented light sources.
#[derive(Clone, Copy, Debug)]
pub struct LightBounds<P = f32> {
    /// Box around the sources.
    pub aabb: Aabb,
    /// Cone around their normals.
    pub cone: Cone,
    /// Sum of their powers.
    pub power: P,
}

impl<P: Power> LightBounds<P> {
    /// Cost of treating the cluster as one source, by the surface area orientation heuristic. All sides of the box are
    /// made longer by `thickness`, so that the cost of flat and point-like clusters still depends on their size.
    pub fn cost(&self, thickness: f32) -> f32 {
        let d = self.aabb.extent() + Vec3::splat(thickness);
        let area = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x);
        self.power.luminance() * area * self.cone.measure()
    }
}

impl<P: Power> LightCluster for LightBounds<P> {
    fn union(self, other: LightBounds<P>) -> LightBounds<P> {
        LightBounds {
            aabb: self.aabb.union(other.aabb),
            cone: self.cone.union(other.cone),
            power: self.power + other.power,
        }
    }

    fn aabb(&self) -> &Aabb {
        &self.aabb
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    #[test]
    fn a_union_of_cones_holds_the_normals_of_both() {
        let mut rng = HashRng::new(3, 1, 4, 1);
        for _ in 0..2000 {
            let mut cone = || {
                let [x, y, z, w] = rng.next_4();
                let axis = (Vec3::new(x, y, z) - 0.5).normalize_or(Vec3::X);
                Cone { axis, half_angle: w * w * PI, emission: w * FRAC_PI_2 }
            };
            let (a, b) = (cone(), cone());
            let both = a.union(b);
            assert!(both.emission == a.emission.max(b.emission) && both.half_angle <= PI);
            for c in [a, b] {
                let farthest = c.axis.dot(both.axis).clamp(-1.0, 1.0).acos() + c.half_angle;
                assert!(farthest <= both.half_angle + 1e-3 || both.half_angle >= PI - 1e-3, "{a:?} {b:?} {both:?}");
            }
        }
    }

    #[test]
    fn coloured_bounds_add_up_colours() {
        let bounds = |x: f32, power: Rgb| LightBounds {
            aabb: Aabb::of([Vec3::X * x]),
            cone: Cone { axis: Vec3::Z, half_angle: 0.0, emission: FRAC_PI_2 },
            power,
        };
        let both = bounds(-1.0, Rgb::new(1.0, 0.0, 0.0)).union(bounds(3.0, Rgb::new(0.0, 2.0, 0.0)));
        assert_eq!(both.power, Rgb::new(1.0, 2.0, 0.0));
        assert_eq!((both.aabb.centre(), both.aabb.radius2()), (Vec3::X, 4.0));
        // A flat cluster costs something, and one of half the power half as much.
        let half = bounds(-1.0, Rgb::grey(0.5)).union(bounds(3.0, Rgb::BLACK));
        let whole = bounds(-1.0, Rgb::grey(1.0)).union(bounds(3.0, Rgb::BLACK));
        assert!(half.cost(0.1) > 0.0 && (whole.cost(0.1) / half.cost(0.1) - 2.0).abs() < 1e-5);
    }
}
