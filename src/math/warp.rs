//! Warps of the unit square, each with its density and its inverse.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI};

/// Unit square → unit disk, equal areas, low distortion (Shirley & Chiu 1997). Density 1/π per unit area.
#[inline]
pub fn square_to_disk(u: [f32; 2]) -> Vec2 {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    // Both halves of the map are one, with the axes exchanged. Which half it is is random, so a branch would be guessed
    // wrong half of the time: the radius is the larger coordinate, the angle comes from the ratio, and the exchange is
    // an exchange of bits.
    let swap = 0u32.wrapping_sub(u32::from(b.abs() > a.abs()));
    let (r, other) = exchange(swap, a, b);
    let (sin, cos) = sin_cos_quarter(FRAC_PI_4 * (other / (r + f32::MIN_POSITIVE.copysign(r))));
    let (x, y) = exchange(swap, r * cos, r * sin);
    Vec2::new(x, y)
}

/// (a, b) if the mask is all zeros, (b, a) if it is all ones.
#[inline]
fn exchange(mask: u32, a: f32, b: f32) -> (f32, f32) {
    let (a, b) = (a.to_bits(), b.to_bits());
    let difference = (a ^ b) & mask;
    (f32::from_bits(a ^ difference), f32::from_bits(b ^ difference))
}

/// Sine and cosine of an angle in [−π/4, π/4] by their series, to a unit in the last place; the general functions spend
/// most of their time on reducing the angle.
#[inline]
fn sin_cos_quarter(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = x + x * x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    (sin, cos)
}

/// Inverse of [`square_to_disk`].
pub fn disk_to_square(p: Vec2) -> [f32; 2] {
    let r = p.length();
    if r == 0.0 {
        return [0.5, 0.5];
    }
    let (a, b) = if p.x.abs() > p.y.abs() {
        let r = r.copysign(p.x);
        (r, r * (p.y / p.x).atan() / FRAC_PI_4)
    } else {
        let r = r.copysign(p.y);
        (r * (p.x / p.y).atan() / FRAC_PI_4, r)
    };
    [0.5 * (a + 1.0), 0.5 * (b + 1.0)]
}

/// Unit square → hemisphere around +z, density cos θ / π per steradian.
#[inline]
pub fn square_to_cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = square_to_disk(u);
    // 1 − |d|² can round below zero at the rim.
    Vec3::new(d.x, d.y, (1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`square_to_cosine_hemisphere`] per steradian.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Inverse of [`square_to_cosine_hemisphere`].
pub fn cosine_hemisphere_to_square(v: Vec3) -> [f32; 2] {
    disk_to_square(Vec2::new(v.x, v.y))
}

/// Unit square → sphere, density 1/(4π) per steradian.
pub fn square_to_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (4.0 * u[0] * (1.0 - u[0])).max(0.0).sqrt();
    let (sin, cos) = (2.0 * PI * u[1]).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Density of [`square_to_sphere`] per steradian.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Inverse of [`square_to_sphere`].
pub fn sphere_to_square(v: Vec3) -> [f32; 2] {
    let phi = v.y.atan2(v.x) / (2.0 * PI);
    [0.5 * (1.0 - v.z), if phi < 0.0 { phi + 1.0 } else { phi }]
}

/// 1 − cos of an angle in radians, without cancellation for small angles.
pub fn versine(angle: f64) -> f64 {
    2.0 * (0.5 * angle).sin().powi(2)
}

/// Unit square → cone around +z, uniform in solid angle. `versine_max` is 1 − cos of the half angle (see [`versine`]).
pub fn square_to_cone(u: [f32; 2], versine_max: f32) -> Vec3 {
    // 1 − z is sampled rather than z: it keeps its precision for narrow cones.
    let one_minus_z = u[0] * versine_max;
    let r = (one_minus_z * (2.0 - one_minus_z)).max(0.0).sqrt();
    let (sin, cos) = (2.0 * PI * u[1]).sin_cos();
    Vec3::new(r * cos, r * sin, 1.0 - one_minus_z)
}

/// Density of [`square_to_cone`] per steradian inside the cone.
pub fn cone_pdf(versine_max: f32) -> f32 {
    1.0 / (2.0 * PI * versine_max)
}

/// Inverse of [`square_to_cone`].
pub fn cone_to_square(v: Vec3, versine_max: f32) -> [f32; 2] {
    let phi = v.y.atan2(v.x) / (2.0 * PI);
    [(1.0 - v.z) / versine_max, if phi < 0.0 { phi + 1.0 } else { phi }]
}

/// Unit square → barycentrics (b1, b2) of a triangle, uniform in area, low distortion (Heitz 2019).
#[inline]
pub fn square_to_triangle(u: [f32; 2]) -> [f32; 2] {
    // Half of the smaller number goes to either side: no branch that would be guessed wrong half of the time.
    let half = 0.5 * if u[0] < u[1] { u[0] } else { u[1] };
    [u[0] - half, u[1] - half]
}

/// Inverse of [`square_to_triangle`].
pub fn triangle_to_square(b: [f32; 2]) -> [f32; 2] {
    if b[0] < b[1] { [2.0 * b[0], b[1] + b[0]] } else { [b[0] + b[1], 2.0 * b[1]] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(a: [f32; 2], b: [f32; 2]) -> bool {
        (a[0] - b[0]).abs() < 2e-3 && (a[1] - b[1]).abs() < 2e-3
    }

    proptest! {
        #[test]
        fn inverses_round_trip(x in 0.01f32..0.99, y in 0.01f32..0.99, c in -0.9f32..0.99) {
            let u = [x, y];
            prop_assert!(close(disk_to_square(square_to_disk(u)), u));
            prop_assert!(close(cosine_hemisphere_to_square(square_to_cosine_hemisphere(u)), u));
            prop_assert!(close(sphere_to_square(square_to_sphere(u)), u));
            prop_assert!(close(cone_to_square(square_to_cone(u, 1.0 - c), 1.0 - c), u));
            prop_assert!(close(triangle_to_square(square_to_triangle(u)), u));
            prop_assert!((square_to_sphere(u).length() - 1.0).abs() < 1e-5);
            prop_assert!((square_to_cone(u, 1.0 - c).length() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn quarter_turn_sines_are_accurate() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            let (sin, cos) = sin_cos_quarter(x);
            assert!((f64::from(sin) - f64::from(x).sin()).abs() < 1.2e-7, "{x}");
            assert!((f64::from(cos) - f64::from(x).cos()).abs() < 1.2e-7, "{x}");
        }
    }

    /// Moments of the warped points against the integrals of their densities, on a regular grid.
    #[test]
    fn densities_match_their_warps() {
        let n = 256;
        let (mut cos2, mut z_sphere, mut z_cone, mut bary) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for i in 0..n * n {
            let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
            cos2 += f64::from(square_to_cosine_hemisphere(u).z);
            z_sphere += f64::from(square_to_sphere(u).z.powi(2));
            z_cone += f64::from(square_to_cone(u, 0.5).z);
            bary += f64::from(square_to_triangle(u)[0]);
        }
        let mean = |s: f64| s / f64::from(n * n);
        assert!((mean(cos2) - 2.0 / 3.0).abs() < 1e-3);
        assert!((mean(z_sphere) - 1.0 / 3.0).abs() < 1e-3);
        assert!((mean(z_cone) - 0.75).abs() < 1e-3);
        assert!((mean(bary) - 1.0 / 3.0).abs() < 1e-3);
        assert!((cone_pdf(2.0) - SPHERE_PDF).abs() < 1e-6);
    }
}
