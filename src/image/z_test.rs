//! Do two noisy pictures have the same expectation? Every pixel's difference in units of its own standard error.

use serde::Serialize;

/// The outcome of [`z_test`]. Variances that come from samples that are stratified over iterations are too large, so
/// that `rms` is below one for equal expectations; few samples make the tails heavier than the normal distribution's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ZTest {
    /// Values (pixels times channels) that have a variance and were tested.
    pub values: u64,
    /// Root of the mean of z²; one for equal expectations and right variances.
    pub rms: f64,
    /// Share of |z| above 2 (a normal distribution has 0.0455).
    pub beyond_2: f64,
    /// Share of |z| above 3 (a normal distribution has 0.0027).
    pub beyond_3: f64,
    /// Largest |z|.
    pub worst: f64,
    /// The |z| that is passed with the probability 0.001 in any of so many independent tests (Šidák 1967).
    pub threshold: f64,
    /// z of the mean of the picture; the channels of a pixel count as one, different pixels as independent.
    pub whole: f64,
    /// Differences of blocks of pixels, in units of their spread.
    pub blocks: Option<BlockTest>,
}

/// A test by blocks of 16 × 16 pixels, which may share light sub-paths: variances of single pixels leave out how they go
/// together. None of pictures of fewer than two blocks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BlockTest {
    /// Variance of the differences of blocks over the variance that independent pixels would give them. Where it is
    /// above one, pixels are correlated (or expectations differ from block to block), and shares of |z| and z of the mean
    /// say less than they seem to.
    pub variance_ratio: f64,
    /// z of the mean of the picture, with the spread of the blocks' differences as its error.
    pub whole: f64,
}

/// Chance of an alarm where there is nothing.
const SIGNIFICANCE: f64 = 1e-3;

/// Pixels along a side of a block.
const BLOCK: usize = 16;

/// Difference of a block of pixels.
#[derive(Clone, Copy, Default)]
struct BlockDifference {
    pixels: f64,
    /// Sum over pixels and channels.
    difference: f64,
    /// Its variance, if pixels are independent.
    variance: f64,
}

impl BlockTest {
    fn new(blocks: &[BlockDifference]) -> Option<BlockTest> {
        let sum = |of: fn(&BlockDifference) -> f64| blocks.iter().map(of).sum::<f64>();
        let (pixels, difference, variance) = (sum(|b| b.pixels), sum(|b| b.difference), sum(|b| b.variance));
        let count = blocks.iter().filter(|block| block.pixels > 0.0).count() as f64;
        let spread: f64 = blocks.iter().map(|b| (b.difference - difference / pixels * b.pixels).powi(2)).sum();
        let spread = spread * count / (count - 1.0);
        let whole = difference / spread.sqrt();
        (count > 1.0 && whole.is_finite()).then(|| BlockTest { variance_ratio: spread / variance, whole })
    }
}

/// Tests two pictures of the given width with the variances of their pixels' means. A picture without variance is taken
/// as exact. None if no value has a variance.
pub fn z_test(
    width: usize,
    image: (&[[f64; 3]], Option<&[[f64; 3]]>),
    reference: (&[[f64; 3]], Option<&[[f64; 3]]>),
) -> Option<ZTest> {
    let variance = |v: Option<&[[f64; 3]]>, i: usize, c: usize| v.map_or(0.0, |v| v[i][c]);
    let (mut n, mut squares, mut beyond, mut worst) = (0u64, 0.0, [0u64; 2], 0.0_f64);
    let columns = width.div_ceil(BLOCK);
    let mut blocks = vec![BlockDifference::default(); columns * image.0.len().div_ceil(width.max(1)).div_ceil(BLOCK)];
    for (i, (a, b)) in image.0.iter().zip(reference.0).enumerate() {
        let v: [f64; 3] = std::array::from_fn(|c| variance(image.1, i, c) + variance(reference.1, i, c));
        if !a.iter().chain(b).chain(&v).all(|x| x.is_finite()) {
            continue;
        }
        let block = &mut blocks[i / width / BLOCK * columns + i % width / BLOCK];
        block.pixels += 1.0;
        // Channels share their paths: their errors add up rather than their variances.
        block.variance += v.iter().map(|v| v.sqrt()).sum::<f64>().powi(2);
        for c in 0..3 {
            block.difference += a[c] - b[c];
            if v[c] > 0.0 {
                let z = (a[c] - b[c]).abs() / v[c].sqrt();
                n += 1;
                squares += z * z;
                beyond[0] += u64::from(z > 2.0);
                beyond[1] += u64::from(z > 3.0);
                worst = worst.max(z);
            }
        }
    }
    let difference: f64 = blocks.iter().map(|block| block.difference).sum();
    let variance: f64 = blocks.iter().map(|block| block.variance).sum();
    (n > 0).then(|| ZTest {
        values: n,
        rms: (squares / n as f64).sqrt(),
        beyond_2: beyond[0] as f64 / n as f64,
        beyond_3: beyond[1] as f64 / n as f64,
        worst,
        threshold: two_sided_quantile(1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / n as f64)),
        whole: difference / variance.sqrt(),
        blocks: BlockTest::new(&blocks),
    })
}

/// The z that a normal variable's absolute value exceeds with the probability p.
pub fn two_sided_quantile(p: f64) -> f64 {
    // Bisection of the tail; Mills' ratio as a continued fraction where the tail is thin (Abramowitz & Stegun 1964, eq.
    // 26.2.14).
    let tail = |z: f64| {
        let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
        if z > 2.0 {
            let fraction = (1..=60).rev().fold(z, |f, k| z + f64::from(k) / f);
            2.0 * density / fraction
        } else {
            // Φ(z) − 1/2 = φ(z) Σ z^(2k+1) / (1·3·5…(2k+1)), eq. 26.2.11.
            let (mut term, mut sum) = (z, z);
            for k in 1..60 {
                term *= z * z / f64::from(2 * k + 1);
                sum += term;
            }
            1.0 - 2.0 * density * sum
        }
    };
    let (mut lo, mut hi) = (0.0, 40.0);
    for _ in 0..100 {
        let mid = 0.5 * (lo + hi);
        if tail(mid) > p { lo = mid } else { hi = mid }
    }
    0.5 * (lo + hi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (p, z) in [(0.05, 1.959_963_985), (0.0455, 2.000_002_4), (0.01, 2.575_829_304), (1e-9, 6.109_410_2)] {
            assert!((two_sided_quantile(p) - z).abs() < 1e-5, "{p}: {}", two_sided_quantile(p));
        }
    }

    #[test]
    fn differences_are_counted_in_standard_errors() {
        let (image, reference) = (vec![[1.0, 2.0, 3.0]; 10], vec![[1.0, 2.0, 1.0]; 10]);
        let variance = vec![[0.25, 0.0, 0.25]; 10];
        let z = z_test(5, (&image, Some(&variance)), (&reference, None)).unwrap();
        assert!(z.blocks.is_none());
        assert_eq!((z.values, z.worst, z.beyond_2, z.beyond_3), (20, 4.0, 0.5, 0.5));
        assert!((z.rms - 8.0_f64.sqrt()).abs() < 1e-12);
        assert!((z.whole - 20.0 / 10.0_f64.sqrt()).abs() < 1e-12);
        assert!(z_test(5, (&image, None), (&reference, None)).is_none());
        let nan = vec![[f64::NAN; 3]; 10];
        assert!(z_test(5, (&nan, Some(&variance)), (&reference, None)).is_none());
    }

    /// Pictures of normal errors: of each pixel by itself, and of blocks of 4 x 4 pixels.
    #[test]
    fn correlated_pixels_are_found() {
        let (width, height) = (160, 96);
        let mut rng = HashRng::from_key(11);
        let mut normal = || (0..12).map(|_| f64::from(rng.next_f32())).sum::<f64>() - 6.0;
        let shared: Vec<f64> = (0..width / 4 * (height / 4)).map(|_| normal()).collect();
        let own: Vec<[f64; 3]> = (0..width * height).map(|_| [normal(); 3]).collect();
        let common: Vec<[f64; 3]> =
            (0..width * height).map(|i| [shared[i / width / 4 * (width / 4) + i % width / 4]; 3]).collect();
        let exact = vec![[0.0; 3]; width * height];
        let variance = vec![[1.0; 3]; width * height];
        let test = |image: &[[f64; 3]]| z_test(width, (image, Some(&variance)), (&exact, None)).unwrap();
        let (own, common) = (test(&own), test(&common));
        let [own_blocks, common_blocks] = [own, common].map(|z| z.blocks.unwrap());
        assert!((own_blocks.variance_ratio - 1.0).abs() < 0.6, "{own_blocks:?}");
        assert!((own_blocks.whole / own.whole - 1.0).abs() < 0.3, "{own:?}");
        // 16 pixels of one error each: sixteen times the variance, a quarter of z.
        assert!((8.0..24.0).contains(&common_blocks.variance_ratio), "{common_blocks:?}");
        assert!((common_blocks.whole / common.whole - 0.25).abs() < 0.08, "{common:?}");
    }
}
