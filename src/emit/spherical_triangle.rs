//! Triangles seen from a point: solid angle and uniform sampling of it.
//!
//! Arvo 1995, "Stratified Sampling of Spherical Triangles"; the solid angle by Van Oosterom & Strackee 1983, which
//! keeps its precision for small triangles. All in double precision: Arvo's formulas subtract angles that sum to nearly
//! π.

use crate::math::trig::atan2;
use crate::math::{DVec3, Vec3};

/// A triangle projected to the unit sphere around a point.
///
/// It keeps what its solid angle is computed from; sampling and the way back to barycentrics take it from there.
pub(super) struct SphericalTriangle {
    /// Unit directions to the corners.
    corners: [DVec3; 3],
    /// One over the distances of the corners.
    inverse_lengths: [f64; 3],
    /// Products b × c, c × a, a × b of the corners a, b, c.
    sides: [DVec3; 3],
    /// In steradians, 0 … 2π.
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle `v` as seen from `from`; `None` from a corner.
    #[inline]
    pub fn new(v: &[Vec3; 3], from: Vec3) -> Option<SphericalTriangle> {
        let from = from.as_dvec3();
        let to = v.map(|v| v.as_dvec3() - from);
        let inverse_lengths = to.map(DVec3::length_recip);
        if !inverse_lengths.iter().all(|x| x.is_finite() && *x > 0.0) {
            return None;
        }
        let [a, b, c]: [DVec3; 3] = std::array::from_fn(|i| to[i] * inverse_lengths[i]);
        let sides = [b.cross(c), c.cross(a), a.cross(b)];
        let volume = a.dot(sides[0]).abs();
        let solid_angle = 2.0 * f64::from(atan2(volume as f32, (1.0 + a.dot(b) + b.dot(c) + c.dot(a)) as f32));
        Some(SphericalTriangle { corners: [a, b, c], inverse_lengths, sides, solid_angle })
    }

    /// A direction uniform in the solid angle, of unit length up to rounding; `None` if the triangle has degenerated.
    #[inline]
    pub fn sample(&self, u: [f64; 2]) -> Option<DVec3> {
        let [a, b, c] = self.corners;
        let [_, side_b, side_c] = self.sides;
        // The dihedral angle α at a, from the normals of its two sides.
        let (length_b, length_c) = (side_b.length(), side_c.length());
        let scale = 1.0 / (length_b * length_c);
        let cos_alpha = -side_b.dot(side_c) * scale;
        // (c × a) × (a × b) = a (a · b × c).
        let sin_alpha = a.dot(self.sides[0]).abs() * scale;
        if !(sin_alpha > 0.0 && sin_alpha.is_finite()) {
            return None;
        }
        let cos_side = a.dot(b);
        // The third corner moves along the side a–c until the area is the wanted part; s and t are sine and cosine of
        // that area − α.
        let (sin, cos) = (u[0] * self.solid_angle).sin_cos();
        let (s, t) = (sin * cos_alpha - cos * sin_alpha, cos * cos_alpha + sin * sin_alpha);
        let p = t - cos_alpha;
        let q = s + sin_alpha * cos_side;
        let numerator = (q * t - p * s) * cos_alpha - q;
        let denominator = (q * s + p * t) * sin_alpha;
        let cos_moved = if denominator == 0.0 { 1.0 } else { (numerator / denominator).clamp(-1.0, 1.0) };
        // The part of c that is perpendicular to a is as long as c × a.
        let moved = a * cos_moved + (c - a * a.dot(c)) * ((1.0 - cos_moved * cos_moved).sqrt() / length_b);
        // Then a point on the arc from b to it.
        let along = moved.dot(b);
        let z = 1.0 - u[1] * (1.0 - along);
        let away = moved - b * along;
        let length2 = away.length_squared();
        let reach = if length2 > 0.0 { ((1.0 - z * z).max(0.0) / length2).sqrt() } else { 0.0 };
        Some(b * z + away * reach)
    }

    /// Barycentrics (b1, b2) of the point of the triangle in the direction `d`, pulled onto the triangle where rounding
    /// left it.
    #[inline]
    pub fn barycentrics(&self, d: DVec3) -> [f32; 2] {
        let volume: [f64; 3] = std::array::from_fn(|i| d.dot(self.sides[i]) * self.inverse_lengths[i]);
        // Over the product of all three distances; signs agree inside, whichever way the triangle turns.
        let sign = (volume[0] + volume[1] + volume[2]).signum();
        let b = volume.map(|x| (x * sign).max(0.0));
        let sum = b[0] + b[1] + b[2];
        if sum > 0.0 { [(b[1] / sum) as f32, (b[2] / sum) as f32] } else { [1.0 / 3.0; 2] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octant_has_its_solid_angle_and_first_moment() {
        let t = SphericalTriangle::new(&[Vec3::X, Vec3::Y, Vec3::Z], Vec3::ZERO).unwrap();
        assert!((t.solid_angle - std::f64::consts::FRAC_PI_2).abs() < 5e-7);
        let n = 200;
        let mut mean = DVec3::ZERO;
        for k in 0..n * n {
            let u = [(f64::from(k % n) + 0.5) / f64::from(n), (f64::from(k / n) + 0.5) / f64::from(n)];
            let d = t.sample(u).unwrap();
            assert!(d.min_element() > -1e-6);
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
