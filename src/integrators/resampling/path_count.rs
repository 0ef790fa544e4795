//! The number of light sub-paths of an iteration that is worth its time beside the eye sub-paths.
//!
//! All pixels share the M sub-paths: the error that these leave is one of whole regions. The mean of the variance of
//! pixels and that of 16 × 16 blocks, the latter as it would be with independent pixels, falls with M as A + B/M while
//! the cost of an iteration grows as P e + M l, where each of P eye sub-paths costs e and a light sub-path l. Their
//! product is least at M = √(B/A · P e/l).
//!
//! DEVIATION: Nabata et al. 2020, "Two-stage resampling", §6 takes M₁ = 10,000 for all scenes.

/// √(B/A), measured from two numbers M: 68 in a room behind a door, 64, 81 and 48 in three public scenes.
const VARIANCE_RATIO_SQRT: f64 = 64.0;
/// Cost of a ray of an eye sub-path with the work that belongs to it, in rays of light sub-paths.
pub(super) const EYE_COST: f64 = 3.5;
/// Cost of a light vertex besides its ray, in rays of light sub-paths.
pub(super) const VERTEX_COST: f64 = 2.0;
/// Bounds of the result, unless the picture has fewer pixels.
const BOUNDS: [f64; 2] = [1000.0, 100_000.0];

/// M for a picture of so many pixels, where an eye sub-path costs `eye` and a light sub-path `light`.
pub(super) fn best_path_count(pixels: f64, eye: f64, light: f64) -> u32 {
    let best = VARIANCE_RATIO_SQRT * (pixels * eye / light.max(f64::MIN_POSITIVE)).sqrt();
    // Where light sub-paths end at once, or nothing is known of them, a bound is taken.
    best.clamp(BOUNDS[0], BOUNDS[1]).min(pixels).max(1.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_number_has_the_least_product_of_variance_and_cost() {
        let (pixels, eye, light) = (1e5, 5.0, 8.0);
        let product = |m: f64| (1.0 + VARIANCE_RATIO_SQRT * VARIANCE_RATIO_SQRT / m) * (pixels * eye + m * light);
        let best = f64::from(best_path_count(pixels, eye, light));
        assert!((BOUNDS[0]..BOUNDS[1]).contains(&best));
        assert!([0.9, 1.1].iter().all(|f| product(best) < product(best * f)), "{best}");
    }

    #[test]
    fn the_number_has_bounds() {
        assert_eq!(best_path_count(40.0, 5.0, 8.0), 40);
        assert_eq!(best_path_count(2000.0, 0.0, 8.0), 1000);
        assert_eq!(best_path_count(1e9, 5.0, 0.0), 100_000);
        assert_eq!(best_path_count(1e9, 0.0, 0.0), 1000);
    }
}
