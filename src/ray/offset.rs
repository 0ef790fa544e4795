//! Where a ray leaves a surface from: outside the error bound of the hit point, never at a constant distance.
//!
//! A hit point is interpolated from the triangle's corners, so it is off the triangle's plane by at most γ(7)·Σ|b_i
//! v_i| (Pharr, Jakob, Humphreys, "Physically Based Rendering", §6.8). The largest component serves for all three.
//! Moving by that bound along the normal, with room for the rounding of the move itself, leaves no false self-hit and
//! no leak at any scale of a scene that is centred.

use super::Segment;
use crate::math::{Vec3, float::gamma};

const SQRT_3: f32 = 1.732_050_8;

/// Error bounds that hit points keep from the edges of their surface. A ray leaves its surface √3 bounds above it; beside
/// another surface that rises from the edge at an angle θ, a point √3 / tan(θ/2) bounds from the edge stays before both:
/// this margin is enough for angles of 25 degrees and more.
pub const EDGE_MARGIN: f32 = 8.0;

/// Error bound of a point Σ b_i v_i interpolated between three corners v_i with weights b_i that sum to one, and of
/// moving it off the surface: γ(7) for the point and two roundings for the move. `sum` is the largest component of Σ
/// |b_i v_i|.
#[inline]
pub fn interpolation_error(sum: f32) -> f32 {
    gamma(9) * sum
}

/// Moves `p` off its surface to the side to which `towards` points. A box of half width `error` reaches √3 of it along
/// a unit normal at most; that is less work than how far it reaches along `ng`. The sum is rounded as well, which the
/// bound has room for (see [`interpolation_error`]): no step to the next float is needed.
#[inline]
pub fn offset_point(p: Vec3, error: f32, ng: Vec3, towards: Vec3) -> Vec3 {
    p + ng * (error * SQRT_3).copysign(towards.dot(ng))
}

/// One end of a segment.
#[derive(Clone, Copy, Debug)]
pub enum SegmentEnd {
    /// On a surface.
    Surface {
        /// Position.
        p: Vec3,
        /// Its error bound.
        error: f32,
        /// Geometric normal, either side.
        ng: Vec3,
    },
    /// In space: a point light, a pinhole, a medium.
    Free(Vec3),
}

impl SegmentEnd {
    /// Its position.
    pub fn position(&self) -> Vec3 {
        match *self {
            SegmentEnd::Surface { p, .. } | SegmentEnd::Free(p) => p,
        }
    }

    /// Position off the surface, towards `direction`.
    #[inline]
    pub fn leaving(&self, direction: Vec3) -> Vec3 {
        match *self {
            SegmentEnd::Surface { p, error, ng } => offset_point(p, error, ng, direction),
            SegmentEnd::Free(p) => p,
        }
    }
}

/// The segment between two points, both moved off their surfaces: the same from either end up to its direction.
#[inline]
pub fn segment(a: &SegmentEnd, b: &SegmentEnd) -> Segment {
    let d = b.position() - a.position();
    Segment::between(a.leaving(d), b.leaving(-d))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_moved_point_is_on_its_side(scale in prop::sample::select(vec![1e-3f32, 1.0, 1e4]),
                                          c in prop::array::uniform9(-1.0f32..1.0), u in 0.01f32..0.49, v in 0.01f32..0.49) {
            let corners = [Vec3::new(c[0], c[1], c[2]) * scale, Vec3::new(c[3], c[4], c[5]) * scale, Vec3::new(c[6], c[7], c[8]) * scale];
            let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            prop_assume!(n.length() > 1e-2 * scale * scale);
            let b = [1.0 - u - v, u, v];
            let p = corners[0] * b[0] + corners[1] * b[1] + corners[2] * b[2];
            let sum = corners[0].abs() * b[0] + corners[1].abs() * b[1] + corners[2].abs() * b[2];
            let error = interpolation_error(sum.max_element());
            // The plane in double precision decides on which side the moved point is.
            let (n64, c0) = (((corners[1] - corners[0]).as_dvec3()).cross((corners[2] - corners[0]).as_dvec3()), corners[0].as_dvec3());
            for side in [1.0f32, -1.0] {
                let ng = n.normalize();
                let moved = offset_point(p, error, ng, ng * side);
                prop_assert!((moved.as_dvec3() - c0).dot(n64) * f64::from(side) > 0.0);
                prop_assert!((moved - p).length() <= 8.0 * error + 1e-30);
            }
        }
    }

    #[test]
    fn segments_are_symmetric() {
        let a = SegmentEnd::Surface { p: Vec3::ZERO, error: 1e-6, ng: Vec3::Z };
        let b = SegmentEnd::Surface { p: Vec3::new(1.0, 2.0, 3.0), error: 2e-6, ng: Vec3::X };
        let (ab, ba) = (segment(&a, &b), segment(&b, &a));
        assert_eq!(ab.d, -ba.d);
        assert_eq!(ab.o + ab.d, ba.o);
    }
}
