//! Triangles seen from a point: solid angle and uniform sampling of it.
//!
//! Arvo 1995, "Stratified Sampling of Spherical Triangles"; the solid angle by Van Oosterom & Strackee 1983, which keeps its precision
//! for small triangles. All in double precision: Arvo's formulas subtract angles that sum to nearly π.

use crate::math::{DVec3, Vec3};

/// Unit directions to the corners, and the solid angle between them.
pub(super) struct SphericalTriangle {
    corners: [DVec3; 3],
    /// In steradians, 0 … 2π.
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle `v` as seen from `from`; `None` from a corner.
    pub fn new(v: &[Vec3; 3], from: Vec3) -> Option<SphericalTriangle> {
        let from = from.as_dvec3();
        let unit = |i: usize| (v[i].as_dvec3() - from).try_normalize();
        let [a, b, c] = [unit(0)?, unit(1)?, unit(2)?];
        let volume = a.dot(b.cross(c)).abs();
        let solid_angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        Some(SphericalTriangle { corners: [a, b, c], solid_angle })
    }

    /// A direction uniform in the solid angle; `None` if the triangle has degenerated.
    pub fn sample(&self, u: [f64; 2]) -> Option<DVec3> {
        let [a, b, c] = self.corners;
        // The dihedral angle at a, from the normals of its two sides.
        let (side_b, side_c) = (a.cross(c).try_normalize()?, a.cross(b).try_normalize()?);
        let cos_alpha = side_b.dot(side_c).clamp(-1.0, 1.0);
        let sin_alpha = side_b.cross(side_c).length();
        if sin_alpha == 0.0 {
            return None;
        }
        let alpha = sin_alpha.atan2(cos_alpha);
        let cos_side = a.dot(b);
        // The third corner moves along the side a–c until the area is the wanted part.
        let (s, t) = (u[0] * self.solid_angle - alpha).sin_cos();
        let p = t - cos_alpha;
        let q = s + sin_alpha * cos_side;
        let numerator = (q * t - p * s) * cos_alpha - q;
        let denominator = (q * s + p * t) * sin_alpha;
        let cos_moved = if denominator == 0.0 { 1.0 } else { (numerator / denominator).clamp(-1.0, 1.0) };
        let moved = a * cos_moved + perpendicular(c, a)? * (1.0 - cos_moved * cos_moved).sqrt();
        // Then a point on the arc from b to it.
        let z = 1.0 - u[1] * (1.0 - moved.dot(b));
        let away = perpendicular(moved, b).unwrap_or(DVec3::ZERO);
        (b * z + away * (1.0 - z * z).max(0.0).sqrt()).try_normalize()
    }
}

/// The unit vector in the plane of `x` and the unit vector `n` that is perpendicular to `n`.
fn perpendicular(x: DVec3, n: DVec3) -> Option<DVec3> {
    (x - n * n.dot(x)).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octant_has_its_solid_angle_and_first_moment() {
        let t = SphericalTriangle::new(&[Vec3::X, Vec3::Y, Vec3::Z], Vec3::ZERO).unwrap();
        assert!((t.solid_angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let n = 200;
        let mut mean = DVec3::ZERO;
        for k in 0..n * n {
            let u = [(f64::from(k % n) + 0.5) / f64::from(n), (f64::from(k / n) + 0.5) / f64::from(n)];
            let d = t.sample(u).unwrap();
            assert!(d.min_element() > -1e-12);
            mean += d / f64::from(n * n);
        }
        // ∫ x over the octant is π/4, so the mean is one half in every component.
        assert!((mean - DVec3::splat(0.5)).length() < 1e-4, "{mean}");
    }

    #[test]
    fn small_triangle_keeps_its_precision() {
        let v = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(1e-3, 0.0, 1.0), Vec3::new(0.0, 1e-3, 1.0)];
        let t = SphericalTriangle::new(&v, Vec3::ZERO).unwrap();
        assert!((t.solid_angle / 5e-7 - 1.0).abs() < 1e-5, "{}", t.solid_angle);
    }
}
