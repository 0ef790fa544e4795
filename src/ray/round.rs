//! Spheres, disks and cylinders as rays meet them, exactly: in double precision, so that the error of a hit is the
//! rounding of its coordinates to single precision, however large the shape or far the ray's origin.
//!
//! A shape is the image of a unit shape under an affine map. A hit names its point by two numbers, the shape's *code*,
//! which stand where a triangle's barycentrics do; the point made from them is on the surface again.

use super::SurfaceMask;
use super::offset::EDGE_MARGIN;
use crate::math::float::gamma;
use crate::math::{DVec3, Vec2, Vec3};
use crate::scene::RoundKind;
use glam::{Affine3A, DAffine3, DMat3, DMat4, DVec2};
use std::f64::consts::{PI, TAU};

/// A round shape in its place (the world, or the space of its group).
#[derive(Clone, Debug)]
pub struct RoundShape {
    /// Which unit shape it is the image of.
    pub kind: RoundKind,
    /// The kind of its surface.
    pub surface: SurfaceMask,
    /// Space of the unit shape → place.
    to_place: DAffine3,
    /// Place → space of the unit shape.
    from_place: DAffine3,
    /// The front is the side of the unit shape's outward (a disk's upper) normal.
    outward: bool,
}

/// A point of a round shape.
#[derive(Clone, Copy, Debug)]
pub struct RoundPoint {
    /// Position.
    pub p: Vec3,
    /// Bound on the error of any component of `p`.
    pub error: f32,
    /// Unit normal on the front.
    pub ng: Vec3,
}

/// Texture coordinates of a point of a round shape, and the derivatives of its position.
#[derive(Clone, Copy, Debug)]
pub struct RoundUv {
    /// Texture coordinates, as Mitsuba 3 has them: sphere (azimuth / 2π, polar angle / π), disk (radius, azimuth / 2π),
    /// cylinder (azimuth / 2π, height).
    pub uv: Vec2,
    /// ∂p/∂u.
    pub dpdu: Vec3,
    /// ∂p/∂v.
    pub dpdv: Vec3,
}

/// Boxes are larger than the shape by this share of their largest coordinate.
const BOX_MARGIN: f32 = 1.0 / (1 << 22) as f32;

impl RoundShape {
    /// The image of the unit shape `kind` under `to_place`, an invertible map. `flip` turns its surface inside out.
    pub fn new(kind: RoundKind, to_place: DMat4, flip: bool, surface: SurfaceMask) -> RoundShape {
        let to_place = DAffine3::from_mat4(to_place);
        // As in Mitsuba 3, a mirrored sphere is inside out; the others keep facing where their normal goes.
        let mirrored = kind == RoundKind::Sphere && to_place.matrix3.determinant() < 0.0;
        RoundShape { kind, surface, to_place, from_place: to_place.inverse(), outward: flip == mirrored }
    }

    /// The shape in the world, placed by an instance. Codes of hits stay the same.
    pub fn placed(&self, to_world: &Affine3A) -> RoundShape {
        let m = to_world.matrix3;
        let linear = DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3());
        let to_world = DAffine3 { matrix3: linear, translation: to_world.translation.as_dvec3() };
        let to_place = to_world * self.to_place;
        RoundShape { to_place, from_place: to_place.inverse(), ..self.clone() }
    }

    /// The shape moved by `shift`.
    pub fn moved(&self, shift: DVec3) -> RoundShape {
        let to_place = DAffine3 { translation: self.to_place.translation + shift, ..self.to_place };
        RoundShape { to_place, from_place: to_place.inverse(), ..self.clone() }
    }

    /// The front is the outside of a sphere or cylinder, or the upper side of a disk.
    pub fn is_outward(&self) -> bool {
        self.outward
    }

    /// Image of the origin of the unit shape: centre of a sphere or disk, foot of a cylinder's axis.
    pub fn origin(&self) -> DVec3 {
        self.to_place.translation
    }

    /// Images of the unit shape's axes.
    pub fn axes(&self) -> [DVec3; 3] {
        let m = &self.to_place.matrix3;
        [m.x_axis, m.y_axis, m.z_axis]
    }

    /// Surface area; of ellipsoids, elliptic and oblique cylinders meaningless.
    pub fn area(&self) -> f64 {
        let [x, y, z] = self.axes();
        match self.kind {
            RoundKind::Sphere => 4.0 * PI * x.length_squared(),
            RoundKind::Disk => PI * x.cross(y).length(),
            RoundKind::Cylinder => TAU * x.length() * z.length(),
        }
    }

    /// Smallest box around the shape, up to a margin for rounding.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let [x, y, z] = self.axes();
        let ellipse = DVec3::from_array(std::array::from_fn(|i| x[i].hypot(y[i])));
        let (foot, head, reach) = match self.kind {
            RoundKind::Sphere => {
                let reach = DVec3::from_array(std::array::from_fn(|i| ellipse[i].hypot(z[i])));
                (self.origin(), self.origin(), reach)
            }
            RoundKind::Disk => (self.origin(), self.origin(), ellipse),
            RoundKind::Cylinder => (self.origin(), self.origin() + z, ellipse),
        };
        let (lo, hi) = ((foot.min(head) - reach).as_vec3(), (foot.max(head) + reach).as_vec3());
        let margin = lo.abs().max(hi.abs()).max_element() * BOX_MARGIN;
        (lo - margin, hi + margin)
    }

    /// Ray parameter and code of the first point of the shape that the ray `o + t·d` meets with t in
    /// [`t_min`, `t_max`).
    #[inline]
    pub fn intersect(&self, o: Vec3, d: Vec3, [t_min, t_max]: [f32; 2]) -> Option<(f64, [f32; 2])> {
        let o = self.from_place.transform_point3(o.as_dvec3());
        let d = self.from_place.transform_vector3(d.as_dvec3());
        let inside = |t: f64| t >= f64::from(t_min) && t < f64::from(t_max);
        let met = |t: f64| {
            let x = o + d * t;
            let on_shape = match self.kind {
                RoundKind::Sphere => true,
                RoundKind::Disk => x.x * x.x + x.y * x.y <= 1.0,
                RoundKind::Cylinder => x.z >= 0.0 && x.z <= 1.0,
            };
            (inside(t) && on_shape).then(|| (t, self.encode(x)))
        };
        match self.kind {
            RoundKind::Disk => met(-o.z / d.z),
            RoundKind::Sphere => {
                let [near, far] =
                    roots(o.length_squared() - 1.0, o.dot(d), d.length_squared(), |s| (o - d * s).length_squared())?;
                met(near).or_else(|| met(far))
            }
            RoundKind::Cylinder => {
                let (o, d) = (o.truncate(), d.truncate());
                let [near, far] =
                    roots(o.length_squared() - 1.0, o.dot(d), d.length_squared(), |s| (o - d * s).length_squared())?;
                met(near).or_else(|| met(far))
            }
        }
    }

    /// Two numbers for the point `x` of (or next to) the unit shape.
    pub fn encode(&self, x: DVec3) -> [f32; 2] {
        let code = match self.kind {
            RoundKind::Disk => x.truncate(),
            // The angle by one coordinate of the square |x| + |y| = 1, from −1 to 1.
            RoundKind::Cylinder => {
                let along = x.x / (x.x.abs() + x.y.abs());
                DVec2::new((0.5 * (1.0 - along)).copysign(x.y), x.z)
            }
            // The octahedron |x| + |y| + |z| = 1 unfolded to a square.
            RoundKind::Sphere => {
                let q = x.truncate() / x.abs().element_sum();
                if x.z < 0.0 { DVec2::new((1.0 - q.y.abs()).copysign(q.x), (1.0 - q.x.abs()).copysign(q.y)) } else { q }
            }
        };
        code.as_vec2().to_array()
    }

    /// Code of the point of the shape next to `p`.
    #[cfg(test)]
    pub fn code_of(&self, p: Vec3) -> [f32; 2] {
        self.encode(self.from_place.transform_point3(p.as_dvec3()))
    }

    /// The point of the unit shape with the given code.
    fn decode(&self, code: [f32; 2]) -> DVec3 {
        let q = DVec2::new(f64::from(code[0]), f64::from(code[1]));
        match self.kind {
            RoundKind::Disk => q.extend(0.0),
            RoundKind::Cylinder => {
                let along = 1.0 - 2.0 * q.x.abs();
                DVec2::new(along, (1.0 - along.abs()).copysign(q.x)).normalize().extend(q.y)
            }
            RoundKind::Sphere => {
                let z = 1.0 - q.x.abs() - q.y.abs();
                let xy = if z < 0.0 {
                    DVec2::new((1.0 - q.y.abs()).copysign(q.x), (1.0 - q.x.abs()).copysign(q.y))
                } else {
                    q
                };
                xy.extend(z).normalize()
            }
        }
    }

    /// The point with the given code.
    #[inline]
    pub fn point(&self, code: [f32; 2]) -> RoundPoint {
        self.point_of(self.decode(code))
    }

    /// The point with the given code, moved off the edge of a disk or cylinder, where another surface may be joined, by
    /// [`EDGE_MARGIN`] times the larger one of its own error bound and `error`.
    pub fn point_off_edges(&self, code: [f32; 2], error: f32) -> RoundPoint {
        let x = self.decode(code);
        let point = self.point_of(x);
        if self.kind == RoundKind::Sphere {
            return point;
        }
        let margin = (f64::from(EDGE_MARGIN * point.error.max(error)) * self.shrink()).min(0.5);
        let off_edges = match self.kind {
            RoundKind::Disk => x * ((1.0 - margin) / x.length()).min(1.0),
            _ => x.with_z(x.z.clamp(margin, 1.0 - margin)),
        };
        if off_edges == x { point } else { self.point_of(off_edges) }
    }

    /// Bound on how much the map to the unit shape lengthens: its Frobenius norm.
    fn shrink(&self) -> f64 {
        let m = &self.from_place.matrix3;
        (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt()
    }

    /// The image of the point `x` of the unit shape.
    pub fn point_of(&self, x: DVec3) -> RoundPoint {
        let p = self.to_place.transform_point3(x).as_vec3();
        let n = match self.kind {
            RoundKind::Sphere => x,
            RoundKind::Disk => DVec3::Z,
            RoundKind::Cylinder => x.with_z(0.0),
        };
        let ng = (self.from_place.matrix3.transpose() * n).normalize_or_zero().as_vec3();
        // The coordinates are rounded once here and once more when the point is moved off the surface.
        let error = gamma(3) * p.abs().max_element();
        RoundPoint { p, error, ng: if self.outward { ng } else { -ng } }
    }

    /// Texture coordinates of the point with the given code.
    pub fn parametrise(&self, code: [f32; 2]) -> RoundUv {
        let x = self.decode(code);
        let angle = x.y.atan2(x.x);
        let azimuth = if angle < 0.0 { angle / TAU + 1.0 } else { angle / TAU };
        let around = DVec3::new(-x.y, x.x, 0.0) * TAU;
        let radius = x.truncate().length();
        let (sin, cos) = angle.sin_cos();
        let (uv, dpdu, dpdv) = match self.kind {
            RoundKind::Sphere => {
                let polar = radius.atan2(x.z);
                (DVec2::new(azimuth, polar / PI), around, DVec3::new(x.z * cos, x.z * sin, -radius) * PI)
            }
            RoundKind::Disk => (DVec2::new(radius, azimuth), DVec3::new(cos, sin, 0.0), around),
            RoundKind::Cylinder => (DVec2::new(azimuth, x.z), around, DVec3::Z),
        };
        let placed = |v: DVec3| self.to_place.transform_vector3(v).as_vec3();
        RoundUv { uv: uv.as_vec2(), dpdu: placed(dpdu), dpdv: placed(dpdv) }
    }

    /// The point of the unit shape that the pair `u` of uniform numbers draws, uniform in area on shapes that
    /// [keep their kind](RoundKind::is_kept_by).
    pub fn sample_unit(&self, u: [f32; 2]) -> DVec3 {
        let [a, b] = u.map(f64::from);
        let (sin, cos) = (TAU * b).sin_cos();
        match self.kind {
            RoundKind::Disk => {
                let r = a.sqrt();
                DVec3::new(r * cos, r * sin, 0.0)
            }
            RoundKind::Cylinder => DVec3::new(cos, sin, a),
            RoundKind::Sphere => {
                let r = (4.0 * a * (1.0 - a)).max(0.0).sqrt();
                DVec3::new(r * cos, r * sin, 1.0 - 2.0 * a)
            }
        }
    }

    /// False only if the ball around `centre` does not touch the surface.
    pub fn may_touch_ball(&self, centre: DVec3, radius: f64) -> bool {
        let x = self.from_place.transform_point3(centre);
        let r = x.truncate().length();
        let distance = match self.kind {
            RoundKind::Sphere => (x.length() - 1.0).abs(),
            RoundKind::Disk => x.z.hypot((r - 1.0).max(0.0)),
            RoundKind::Cylinder => (r - 1.0).hypot((-x.z).max(x.z - 1.0).max(0.0)),
        };
        distance <= radius * self.shrink()
    }
}

/// The solutions t of a·t² + 2·b·t + c = 0 in ascending order, for a circle or sphere of radius 1 around the origin:
/// c = |o|² − 1, b = o·d, a = |d|². `distance2(s)` is |o − s·d|²: the squared distance of a point of the line from the
/// origin, in which nothing large cancels as it does in b² − a·c.
#[inline]
fn roots(c: f64, b: f64, a: f64, distance2: impl Fn(f64) -> f64) -> Option<[f64; 2]> {
    let rest = 1.0 - distance2(b / a);
    // Not a number if the ray has no direction here.
    if rest.is_nan() || rest < 0.0 {
        return None;
    }
    // The two terms of q have one sign, and the smaller solution comes from the product of both.
    let q = -(b + (a * rest).sqrt().copysign(b));
    let (s, t) = (q / a, c / q);
    Some(if s < t { [s, t] } else { [t, s] })
}

#[cfg(test)]
mod tests;
