//! Distributions of microfacet normals: GGX and Beckmann, anisotropic (Walter et al. 2007; Heitz 2014), with sampling
//! of all or of the visible normals.
//!
//! GGX draws visible normals by spherical caps (Dupuy & Benyoub 2023). Beckmann inverts the distribution of visible
//! slopes (Heitz & d'Eon 2014) numerically. Its shadowing follows the rational fit of Walter et al. 2007, eq. 27 where
//! values are concerned, as Mitsuba does, and the exact function where the *density* of visible normals is: the fit is
//! off by up to 0.35 %, and a density must integrate to one.

use super::model::AtPoint;
use crate::math::erf::{erf, erf_inv};
use crate::math::{Vec2, Vec3};
use crate::scene::{Distribution, Roughness};
use std::f32::consts::PI;

const INV_SQRT_PI: f32 = std::f32::consts::FRAC_2_SQRT_PI * 0.5;
/// Smaller roughness is indistinguishable from a mirror in single precision.
const MIN_ALPHA: f32 = 1e-4;
/// Densities below this (times the cosine) are zero: their products would underflow.
const MIN_DENSITY: f32 = 1e-20;

/// A distribution of microfacet normals around +z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Microfacets {
    pub distribution: Distribution,
    pub visible: bool,
    alpha_u: f32,
    alpha_v: f32,
}

impl Microfacets {
    pub fn new(distribution: Distribution, alpha_u: f32, alpha_v: f32, visible: bool) -> Microfacets {
        // max() also turns NaN from a broken texture into the minimum.
        Microfacets { distribution, visible, alpha_u: alpha_u.max(MIN_ALPHA), alpha_v: alpha_v.max(MIN_ALPHA) }
    }

    /// Microfacets of the roughness at a point.
    pub fn from_roughness(r: &Roughness<AtPoint>) -> Microfacets {
        Microfacets::new(r.distribution, r.alpha_u, r.alpha_v, r.sample_visible)
    }

    /// Microfacets with both roughnesses multiplied.
    pub fn scaled(&self, factor: f32) -> Microfacets {
        Microfacets { alpha_u: self.alpha_u * factor, alpha_v: self.alpha_v * factor, ..*self }
    }

    /// D(m): microfacet area per projected area and steradian.
    pub fn d(&self, m: Vec3) -> f32 {
        let (x, y) = (m.x / self.alpha_u, m.y / self.alpha_v);
        let area = PI * self.alpha_u * self.alpha_v;
        let z2 = m.z * m.z;
        let d = match self.distribution {
            Distribution::Ggx => {
                let s = x * x + y * y + z2;
                1.0 / (area * s * s)
            }
            Distribution::Beckmann => (-(x * x + y * y) / z2).exp() / (area * z2 * z2),
        };
        // The comparison is also false for NaN (m in the surface).
        if d * m.z > MIN_DENSITY { d } else { 0.0 }
    }

    /// cot θ / α towards `v`; infinite for a view along the normal.
    fn reduced_cotangent(&self, v: Vec3) -> f32 {
        let x = self.alpha_u * v.x;
        let y = self.alpha_v * v.y;
        v.z.abs() / (x * x + y * y).sqrt()
    }

    /// G1: fraction of the microfacets of normal `m` that `v` sees; 0 if it is on their other side.
    pub fn g1(&self, v: Vec3, m: Vec3) -> f32 {
        if v.dot(m) * v.z <= 0.0 {
            return 0.0;
        }
        let a = self.reduced_cotangent(v);
        match self.distribution {
            Distribution::Ggx => ggx_g1(a),
            Distribution::Beckmann if a >= 1.6 => 1.0,
            Distribution::Beckmann => (3.535 + 2.181 * a) * a / (1.0 + 2.276 * a + 2.577 * a * a),
        }
    }

    /// Exact G1 of Smith's model, for densities.
    fn g1_exact(&self, v: Vec3) -> f32 {
        let a = self.reduced_cotangent(v);
        match self.distribution {
            Distribution::Ggx => ggx_g1(a),
            Distribution::Beckmann if a > 4.0 => 1.0,
            Distribution::Beckmann => 2.0 * a / (a * (1.0 + erf(a)) + INV_SQRT_PI * (-a * a).exp()),
        }
    }

    /// Density per steradian of [`Microfacets::sample`] divided by |v · m|, given `d` = D(m): the factor that Jacobians
    /// multiply. `v` must be on the front and see `m`.
    pub fn pdf_over_dot(&self, v: Vec3, m: Vec3, d: f32) -> f32 {
        if self.visible { d * self.g1_exact(v) / v.z } else { d * m.z / v.dot(m).abs() }
    }

    /// Draws a normal for a view from `v` on the front.
    pub fn sample(&self, v: Vec3, u: [f32; 2]) -> Vec3 {
        match (self.visible, self.distribution) {
            (true, Distribution::Ggx) => self.sample_visible_ggx(v, u),
            (true, Distribution::Beckmann) => self.sample_visible_beckmann(v, u),
            (false, _) => self.sample_all(u),
        }
    }

    /// Density D(m) cos θ: slopes of an isotropic distribution of unit roughness, stretched.
    fn sample_all(&self, u: [f32; 2]) -> Vec3 {
        let tan2 = match self.distribution {
            Distribution::Ggx => u[0] / (1.0 - u[0]),
            Distribution::Beckmann => -(1.0 - u[0]).ln(),
        };
        let (sin, cos) = (2.0 * PI * u[1]).sin_cos();
        let r = tan2.sqrt();
        Vec3::new(self.alpha_u * r * cos, self.alpha_v * r * sin, 1.0).normalize_or(Vec3::Z)
    }

    /// Dupuy & Benyoub 2023, listing 3: the visible half sphere mirrors v into a spherical cap, which is sampled
    /// uniformly.
    fn sample_visible_ggx(&self, v: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.alpha_u * v.x, self.alpha_v * v.y, v.z).normalize_or(Vec3::Z);
        let (sin, cos) = (2.0 * PI * u[0]).sin_cos();
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let r = (1.0 - z * z).clamp(0.0, 1.0).sqrt();
        let h = Vec3::new(r * cos, r * sin, z) + stretched;
        Vec3::new(self.alpha_u * h.x, self.alpha_v * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }

    fn sample_visible_beckmann(&self, v: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.alpha_u * v.x, self.alpha_v * v.y, v.z).normalize_or(Vec3::Z);
        let slope = Vec2::new(visible_beckmann_slope(stretched.z, u[0]), erf_inv(2.0 * u[1] - 1.0));
        let sin = stretched.x.hypot(stretched.y);
        let (cos_phi, sin_phi) = if sin > 0.0 { (stretched.x / sin, stretched.y / sin) } else { (1.0, 0.0) };
        let x = cos_phi * slope.x - sin_phi * slope.y;
        let y = sin_phi * slope.x + cos_phi * slope.y;
        Vec3::new(-self.alpha_u * x, -self.alpha_v * y, 1.0).normalize_or(Vec3::Z)
    }
}

/// 2 / (1 + √(1 + tan² α²)) with a = cot / α.
fn ggx_g1(a: f32) -> f32 {
    2.0 / (1.0 + (1.0 + 1.0 / (a * a)).sqrt())
}

/// The slope x (in the plane of the view, unit roughness) whose share of the visible slopes below it is `u`.
///
/// Slopes x have density ∝ (cos θ − x sin θ)⁺ exp(−x²); its integral, times 2, is
/// cos θ (1 + erf x) + sin θ exp(−x²)/√π, increasing up to cot θ. Newton's method inside a shrinking bracket.
fn visible_beckmann_slope(cos: f32, u: f32) -> f32 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let integral = |x: f32| cos * (1.0 + erf(x)) + sin * INV_SQRT_PI * (-x * x).exp();
    // Beyond ±4 the density is below what single precision can weigh.
    let (mut low, mut high) = (-4.0f32, if sin * 4.0 > cos { cos / sin } else { 4.0 });
    let target = u * integral(high);
    let mut x = erf_inv(u * (1.0 + erf(high)) - 1.0).clamp(low, high);
    for _ in 0..16 {
        let error = integral(x) - target;
        if error > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let derivative = 2.0 * INV_SQRT_PI * (cos - x * sin) * (-x * x).exp();
        let next = x - error / derivative;
        // The comparison is also false for a step of 0/0. A step that changes nothing ends on the bracket.
        let next = if next >= low && next <= high { next } else { 0.5 * (low + high) };
        if (next - x).abs() <= 1e-6 * (1.0 + x.abs()) {
            return next;
        }
        x = next;
    }
    x
}

/// A facet between two directions.
pub(super) struct Facet {
    /// The half vector.
    pub m: Vec3,
    /// D(m).
    pub d: f32,
}

/// The facet that mirrors `a` into `b`; `None` unless both are in front of surface and facet and there are such facets.
pub(super) fn half_vector(distribution: &Microfacets, a: Vec3, b: Vec3) -> Option<Facet> {
    if a.z <= 0.0 || b.z <= 0.0 {
        return None;
    }
    let m = (a + b).try_normalize()?;
    let d = distribution.d(m);
    (d > 0.0 && a.dot(m) > 0.0 && b.dot(m) > 0.0).then_some(Facet { m, d })
}

impl Facet {
    /// D G / (4 cos θ_a): value (cosine weighted) of a mirror of these facets.
    pub fn value(&self, distribution: &Microfacets, a: Vec3, b: Vec3) -> f32 {
        self.d * distribution.g1(a, self.m) * distribution.g1(b, self.m) / (4.0 * a.z)
    }

    /// Density of `b` when the facet is drawn for `a`.
    pub fn pdf(&self, distribution: &Microfacets, a: Vec3) -> f32 {
        distribution.pdf_over_dot(a, self.m, self.d) * 0.25
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projected_area_is_one() {
        // ∫ D(m) cos θ_m dω = 1 in slope space, midpoint rule.
        for distribution in [Distribution::Ggx, Distribution::Beckmann] {
            let f = Microfacets::new(distribution, 0.5, 0.2, true);
            let n = 400;
            let mut sum = 0.0f64;
            for i in 0..n {
                for j in 0..n {
                    let cos = (i as f32 + 0.5) / n as f32;
                    let (s, c) = (2.0 * PI * (j as f32 + 0.5) / n as f32).sin_cos();
                    let r = (1.0 - cos * cos).sqrt();
                    sum += f64::from(f.d(Vec3::new(r * c, r * s, cos)) * cos);
                }
            }
            let integral = sum * f64::from(2.0 * PI) / f64::from(n * n);
            assert!((integral - 1.0).abs() < 2e-3, "{distribution:?} {integral}");
        }
    }

    #[test]
    fn visible_slopes_invert_their_integral() {
        for &cos in &[1.0f32, 0.9, 0.5, 0.1, 1e-3, 1e-6] {
            let sin = (1.0 - cos * cos).sqrt();
            let integral = |x: f64| {
                f64::from(cos) * (1.0 + statrs::function::erf::erf(x))
                    + f64::from(sin) / std::f64::consts::PI.sqrt() * (-x * x).exp()
            };
            let top = f64::from(cos / sin.max(1e-9)).min(9.0);
            for i in 1..100 {
                let u = i as f32 / 100.0;
                let x = visible_beckmann_slope(cos, u);
                assert!((integral(f64::from(x)) / integral(top) - f64::from(u)).abs() < 2e-5, "{cos} {u} {x}");
            }
        }
    }
}
