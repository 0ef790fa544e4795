//! Flat convex polygons, and whether one lies in another.

use crate::math::DVec3;
use arrayvec::ArrayVec;

/// Corners of a polygon at most.
pub(super) const MAX_CORNERS: usize = 24;
/// Cosine between the normals of polygons in one plane at least.
const PARALLEL: f64 = 0.99;

/// A convex polygon in the world.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Corners in a row.
    pub corners: ArrayVec<DVec3, MAX_CORNERS>,
    /// Unit normal on the front.
    pub normal: DVec3,
    /// Largest coordinate, which bounds the rounding of points of it.
    pub reach: f64,
}

impl Facet {
    /// The polygon with the given corners and unit normal.
    pub fn new(corners: ArrayVec<DVec3, MAX_CORNERS>, normal: DVec3) -> Facet {
        let reach = corners.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        Facet { corners, normal, reach }
    }

    /// The polygons have an area in common, and there they are nearer to each other than `tolerance`. Polygons that
    /// touch or overlap by less than `tolerance` have none in common.
    pub fn lies_in(&self, other: &Facet, tolerance: f64) -> bool {
        if self.normal.dot(other.normal).abs() < PARALLEL {
            return false;
        }
        // The smaller one lies in the plane of the larger one, whose normal is known better.
        (self.is_in_plane_of(other, tolerance) || other.is_in_plane_of(self, tolerance))
            && !self.has_edge_between(other, tolerance)
            && !other.has_edge_between(self, tolerance)
    }

    fn is_in_plane_of(&self, other: &Facet, tolerance: f64) -> bool {
        let Some(&origin) = other.corners.first() else { return false };
        self.corners.iter().all(|&p| (p - origin).dot(other.normal).abs() <= tolerance)
    }

    /// Some edge has all of `other` on its outer side, up to `tolerance` (the theorem of the separating axis).
    fn has_edge_between(&self, other: &Facet, tolerance: f64) -> bool {
        let middle = self.corners.iter().sum::<DVec3>() / self.corners.len().max(1) as f64;
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).any(|(&a, &b)| {
            let Some(axis) = (b - a).cross(self.normal).try_normalize() else { return false };
            let outwards = if (a - middle).dot(axis) < 0.0 { -axis } else { axis };
            other.corners.iter().all(|&p| (p - a).dot(outwards) >= -tolerance)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f64; 3]; 3]) -> Facet {
        let corners = corners.map(DVec3::from_array);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        Facet::new(corners.into_iter().collect(), normal)
    }

    #[test]
    fn polygons_lie_in_each_other_if_they_share_an_area() {
        let big = triangle([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let lies = |corners: [[f64; 3]; 3]| {
            let other = triangle(corners);
            let both = [big.lies_in(&other, 1e-6), other.lies_in(&big, 1e-6)];
            assert_eq!(both[0], both[1]);
            both[0]
        };
        assert!(lies([[1.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.0, 1.5, 0.0]]), "inside");
        assert!(lies([[1.0, 1.0, 0.0], [1.0, 1.5, 0.0], [1.5, 1.0, 0.0]]), "inside, facing the other way");
        assert!(lies([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]), "in part");
        assert!(lies([[1.0, 1.0, 5e-7], [1.5, 1.0, 0.0], [1.0, 1.5, -5e-7]]), "within rounding");
        assert!(lies([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]), "the same");
        assert!(!lies([[4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]]), "neighbour along an edge");
        assert!(!lies([[4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [-1e-7, 4.0, 0.0]]), "neighbour up to rounding");
        assert!(!lies([[2.5, 2.5, 0.0], [4.0, 2.5, 0.0], [2.5, 4.0, 0.0]]), "in the box, beside the triangle");
        assert!(!lies([[1.0, 1.0, 1e-4], [1.5, 1.0, 1e-4], [1.0, 1.5, 1e-4]]), "above");
        assert!(!lies([[1.0, 1.0, 0.0], [1.0, 1.5, 0.0], [1.0, 1.0, 1.0]]), "upright");
    }
}
