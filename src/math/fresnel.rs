//! Reflection at smooth interfaces (unpolarised), and the fits for its diffuse average.
//!
//! Dielectrics: Fresnel's equations; conductors: the same with a complex index (Moeller 1988, "Optics"). Refractive
//! indices are relative, interior / exterior, where the normal points to the exterior.

use super::{Rgb, Vec3};

/// Reflection and refraction of light at a smooth dielectric interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Fraction reflected; 1 for total internal reflection.
    pub reflectance: f32,
    /// Signed cosine of the transmitted direction to the normal, on the other side than the incident one.
    pub cos_t: f32,
    /// Index of the transmitted side / index of the incident side.
    pub eta: f32,
}

/// Reflection and refraction at an interface of relative index `eta` for a direction whose signed cosine to the normal
/// is `cos_i` (positive: outside).
#[inline]
pub fn dielectric(cos_i: f32, eta: f32) -> Interface {
    let eta_it = if cos_i >= 0.0 { eta } else { 1.0 / eta };
    let cos = cos_i.abs().min(1.0);
    let cos_t2 = 1.0 - (1.0 - cos * cos) / (eta_it * eta_it);
    let cos_t = cos_t2.max(0.0).sqrt();
    let reflectance = if eta == 1.0 {
        0.0
    } else if cos == 0.0 {
        1.0
    } else {
        let s = (cos - eta_it * cos_t) / (cos + eta_it * cos_t);
        let p = (cos_t - eta_it * cos) / (cos_t + eta_it * cos);
        0.5 * (s * s + p * p)
    };
    Interface { reflectance, cos_t: if cos_i >= 0.0 { -cos_t } else { cos_t }, eta: eta_it }
}

/// Fraction reflected by a conductor of index `eta` + i `k` for a direction with cosine `cos` ≥ 0 to the normal.
#[inline]
pub fn conductor(cos: f32, eta: Rgb, k: Rgb) -> Rgb {
    let at = |c: usize| conductor_channel(cos, eta[c], k[c]);
    Rgb::new(at(0), at(1), at(2))
}

fn conductor_channel(cos: f32, eta: f32, k: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let cos2 = cos * cos;
    let sin2 = 1.0 - cos2;
    let d = eta * eta - k * k - sin2;
    let a2_b2 = (d * d + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (a2_b2 + d)).max(0.0).sqrt();
    let (sum, cross) = (a2_b2 + cos2, 2.0 * cos * a);
    // Both denominators vanish only at grazing incidence on a non-absorbing, index-matched medium.
    let s = if sum + cross > 0.0 { (sum - cross) / (sum + cross) } else { 1.0 };
    let (sum, cross) = (a2_b2 * cos2 + sin2 * sin2, cross * sin2);
    let p = if sum + cross > 0.0 { s * (sum - cross) / (sum + cross) } else { s };
    0.5 * (s + p)
}

/// Fraction of diffuse light that an interface of relative index `eta` reflects: fits by Egan & Hilgeman 1973 (η < 1)
/// and d'Eon & Irving 2011 (η ≥ 1), both within 0.6 % for usual indices.
pub fn diffuse_reflectance(eta: f32) -> f32 {
    let inv = 1.0 / eta;
    if eta < 1.0 {
        -1.4399 * eta * eta + 0.7099 * eta + 0.6681 + 0.0636 * inv
    } else {
        [-1.368_81, 4.985_54, -7.809_89, 6.753_35, -3.4793, 0.919_317].iter().fold(0.0, |sum, c| sum * inv + c)
    }
}

/// Mean of Schlick's approximation over a hemisphere for a reflectance of `f0` at normal incidence.
pub fn schlick_average(f0: f32) -> f32 {
    f0 + (1.0 - f0) / 21.0
}

/// Reflectance at normal incidence; the same from both sides.
pub fn normal_incidence(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// Mirrors `v` in the normal `m` (both leave the point).
#[inline]
pub fn reflect(v: Vec3, m: Vec3) -> Vec3 {
    m * (2.0 * v.dot(m)) - v
}

/// Refracts `v` at a surface of normal `m`, given the [`Interface`] for the cosine `v · m`.
#[inline]
pub fn refract(v: Vec3, m: Vec3, interface: &Interface) -> Vec3 {
    let inv = 1.0 / interface.eta;
    m * (v.dot(m) * inv + interface.cos_t) - v * inv
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interface_is_reversible_and_refraction_obeys_snell() {
        for &eta in &[1.5f32, 1.33, 0.7, 2.4] {
            for i in 1..=20 {
                let cos = i as f32 / 20.0;
                let out = dielectric(cos, eta);
                if out.cos_t == 0.0 {
                    assert!((out.reflectance - 1.0).abs() < 1e-6, "total reflection");
                    continue;
                }
                let back = dielectric(out.cos_t, eta);
                assert!((out.reflectance - back.reflectance).abs() < 1e-5, "{eta} {cos}");
                assert!((out.eta * back.eta - 1.0).abs() < 1e-6);
                let v = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                let t = refract(v, Vec3::Z, &out);
                assert!((t.length() - 1.0).abs() < 1e-5 && (t.z - out.cos_t).abs() < 1e-6);
                assert!((t.x * out.eta + v.x).abs() < 1e-6);
            }
        }
        assert_eq!(dielectric(0.3, 1.0).reflectance, 0.0);
    }

    #[test]
    fn conductor_limits() {
        // A mirror (eta = 0, k = 1), and at k = 0 the dielectric formula.
        for i in 0..=10 {
            let cos = i as f32 / 10.0;
            let mirror = conductor(cos, Rgb::BLACK, Rgb::WHITE);
            assert!((mirror.r - 1.0).abs() < 1e-6);
            if i > 0 {
                let glass = conductor(cos, Rgb::grey(1.5), Rgb::BLACK).g;
                assert!((glass - dielectric(cos, 1.5).reflectance).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn diffuse_average_matches_quadrature() {
        for &eta in &[1.0 / 1.5f32, 1.0 / 1.3, 1.3, 1.5, 1.8] {
            let n = 20_000;
            let sum: f64 = (0..n)
                .map(|i| {
                    let cos2 = (f64::from(i) + 0.5) / f64::from(n);
                    f64::from(dielectric(cos2.sqrt() as f32, eta).reflectance)
                })
                .sum();
            let exact = sum / f64::from(n);
            assert!((f64::from(diffuse_reflectance(eta)) / exact - 1.0).abs() < 0.02, "{eta} {exact}");
        }
    }
}
