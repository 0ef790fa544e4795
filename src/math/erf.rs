//! The error function and its inverse in single precision.

/// erf(x), absolute error below 3e-7 (Abramowitz & Stegun 1964, eq. 7.1.26 near and far from zero; a Taylor series
/// where its relative error would be large).
pub fn erf(x: f32) -> f32 {
    let ax = x.abs();
    if ax < 0.5 {
        // 2/√π Σ (−1)^n x^(2n+1) / (n! (2n+1)): the sixth term is below 1e-7.
        let x2 = x * x;
        let series = [-1.0 / 1320.0, 1.0 / 216.0, -1.0 / 42.0, 0.1, -1.0 / 3.0, 1.0];
        return std::f32::consts::FRAC_2_SQRT_PI * x * series.iter().fold(0.0, |s, c: &f32| s * x2 + c);
    }
    let t = 1.0 / (1.0 + 0.327_591_1 * ax);
    let p =
        [1.061_405_4, -1.453_152, 1.421_413_7, -0.284_496_74, 0.254_829_6].iter().fold(0.0, |s, c: &f32| s * t + c) * t;
    (1.0 - p * (-ax * ax).exp()).copysign(x)
}

/// erf⁻¹(y) for |y| < 1 (Giles 2010, "Approximating the erfinv function"); y is clamped to what single precision
/// resolves.
pub fn erf_inv(y: f32) -> f32 {
    let y = y.clamp(-1.0 + f32::EPSILON, 1.0 - f32::EPSILON);
    let w = -((1.0 - y) * (1.0 + y)).ln();
    let central = [
        2.810_226_4e-8,
        3.432_739_4e-7,
        -3.523_387_7e-6,
        -4.391_506_5e-6,
        0.000_218_580_87,
        -0.001_253_725,
        -0.004_177_681_6,
        0.246_640_73,
        1.501_409_4,
    ];
    let tail = [
        -0.000_200_214_26,
        0.000_100_950_56,
        0.001_349_343_2,
        -0.003_673_428_4,
        0.005_739_507_7,
        -0.007_622_461_3,
        0.009_438_87,
        1.001_674,
        2.832_976_8,
    ];
    let (coefficients, w) = if w < 5.0 { (&central, w - 2.5) } else { (&tail, w.sqrt() - 3.0) };
    y * coefficients.iter().fold(0.0, |s, c| s * w + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_a_double_precision_reference() {
        for i in -400..=400 {
            let x = i as f32 / 100.0;
            let exact = statrs::function::erf::erf(f64::from(x));
            assert!((f64::from(erf(x)) - exact).abs() < 4e-7, "{x}");
        }
        for i in -999..=999 {
            let y = i as f32 / 1000.0;
            let exact = statrs::function::erf::erf_inv(f64::from(y));
            assert!((f64::from(erf_inv(y)) - exact).abs() < 2e-6 * (1.0 + exact.abs()), "{y}");
        }
    }
}
