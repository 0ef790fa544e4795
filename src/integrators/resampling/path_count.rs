//! The number of light sub-paths of an iteration that is worth its time beside the eye sub-paths.
//!
//! All pixels share the M sub-paths: the error that these leave is one of whole regions. The mean of the variance of
//! pixels and that of 16 × 16 blocks, the latter as it would be with independent pixels, falls with M as A + B/M while
//! the cost of an iteration grows as P e + M l, where each of P eye sub-paths costs e and a light sub-path l. Their
//! product is least at M = √(B/A · P e/l).
//!
//! B differs from scene to scene by orders of magnitude: of sub-paths from the sky few come through a window. It is
//! estimated from several sets of sub-paths. Groups of cache points choose their candidates by random numbers of their
//! own, so that what two neighbouring groups have in common is the variance of the sub-paths: b = M cov(Q, Q′) / (Q Q′)
//! for the light Q and Q′ that they find. B/A was found to be about [`VARIANCE_RATIO`] b.
//!
//! DEVIATION: Nabata et al. 2020, "Two-stage resampling", §6 takes M₁ = 10,000 for all scenes.

/// B/A over b, measured in a room behind a door: √(B/A) is 68 there, from two numbers M, and √b is 13. With √b of 30 to
/// 100 in three other rooms, the numbers M that follow had less error in equal time than those for √b of 13.
const VARIANCE_RATIO: f64 = 30.0;
/// Lower bound of √(B/A): few sets do not show rare light.
const LEAST_VARIANCE_RATIO_SQRT: f64 = 40.0;
/// Cost of a ray of an eye sub-path with the work that belongs to it, in rays of light sub-paths.
pub(super) const EYE_COST: f64 = 3.5;
/// Cost of a light vertex besides its ray, in rays of light sub-paths.
pub(super) const VERTEX_COST: f64 = 2.0;
/// Bounds of the result, unless the picture is small.
const BOUNDS: [f64; 2] = [1000.0, 400_000.0];
/// Upper bound of the result per pixel.
const MOST_PER_PIXEL: f64 = 4.0;

/// M for a picture of so many pixels, where an eye sub-path costs `eye` and a light sub-path `light`, and where light
/// sub-paths have the relative variance `b` each.
pub(super) fn best_path_count(pixels: f64, eye: f64, light: f64, b: f64) -> u32 {
    let ratio = (VARIANCE_RATIO * b.max(0.0)).sqrt().max(LEAST_VARIANCE_RATIO_SQRT);
    let best = ratio * (pixels * eye / light.max(f64::MIN_POSITIVE)).sqrt();
    // Where light sub-paths end at once, or nothing is known of them, a bound is taken.
    best.clamp(BOUNDS[0], BOUNDS[1]).min(MOST_PER_PIXEL * pixels).max(1.0) as u32
}

/// b, from the light that each group of cache points found in several sets of `paths` light sub-paths. Neighbouring
/// groups have neighbouring numbers.
pub(super) fn variance_of_paths(sets: &[Vec<f64>], paths: u32) -> f64 {
    let n = sets.len() as f64;
    let groups = sets.iter().map(Vec::len).min().unwrap_or(0);
    let mean = |g: usize| sets.iter().map(|set| set[g]).sum::<f64>() / n;
    let (mut sum, mut pairs) = (0.0, 0u32);
    for g in 1..groups {
        let (a, b) = (mean(g - 1), mean(g));
        if a > 0.0 && b > 0.0 {
            let products = sets.iter().map(|set| (set[g - 1] / a - 1.0) * (set[g] / b - 1.0));
            sum += products.sum::<f64>() / (n - 1.0);
            pairs += 1;
        }
    }
    let covariance = sum / f64::from(pairs.max(1));
    if covariance.is_finite() { covariance * f64::from(paths) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    #[test]
    fn the_best_number_has_the_least_product_of_variance_and_cost() {
        let (pixels, eye, light) = (1e5, 5.0, 8.0);
        for b in [0.0f64, 100.0, 1000.0] {
            let ratio = (VARIANCE_RATIO * b).max(LEAST_VARIANCE_RATIO_SQRT.powi(2));
            let product = |m: f64| (1.0 + ratio / m) * (pixels * eye + m * light);
            let best = f64::from(best_path_count(pixels, eye, light, b));
            assert!((BOUNDS[0]..BOUNDS[1]).contains(&best));
            assert!([0.9, 1.1].iter().all(|f| product(best) < product(best * f)), "{best}");
        }
    }

    #[test]
    fn the_number_has_bounds() {
        assert_eq!(best_path_count(40.0, 5.0, 8.0, 9.0), 160);
        assert_eq!(best_path_count(2000.0, 0.0, 8.0, 9.0), 1000);
        assert_eq!(best_path_count(1e9, 5.0, 0.0, 9.0), 400_000);
        assert_eq!(best_path_count(1e9, 0.0, 0.0, 9.0), 1000);
    }

    /// Groups that share a part of relative variance 50/M and have one of their own.
    #[test]
    fn the_variance_of_paths_is_what_neighbours_share() {
        let mut rng = HashRng::new(1, 2, 3, 4);
        // Uniform random numbers of mean zero and variance one.
        let mut noise = || (f64::from(rng.next_f32()) - 0.5) * 12f64.sqrt();
        let sets: Vec<Vec<f64>> = (0..400)
            .map(|_| {
                let shared = 1.0 + (50.0f64 / 4000.0).sqrt() * noise();
                (0..50).map(|g| f64::from(g) * shared * (1.0 + 0.2 * noise())).collect()
            })
            .collect();
        let b = variance_of_paths(&sets, 4000);
        assert!((b / 50.0 - 1.0).abs() < 0.15, "{b}");
        assert_eq!(variance_of_paths(&[], 4000), 0.0);
        assert_eq!(variance_of_paths(&[vec![0.0; 3], vec![0.0; 3]], 4000), 0.0);
        assert_eq!(variance_of_paths(&[vec![1.0; 3]], 4000), 0.0);
    }
}
