//! Errors of regions: what all pixels of a block are wrong by together.
//!
//! A measure that looks at each pixel alone cannot tell grain from blotches. With independent pixels the relMSE of
//! means of blocks of n pixels is about 1/n of the pixels' own; light sub-paths that pixels share make it larger, up to
//! as large.

use super::metrics::{FLOOR, is_finite};
use serde::Serialize;

/// Errors of means of regions: mean of d² / (r² + 0.01), where d is the difference of a region's means in a channel and
/// r the reference's.
///
/// Blocks at the right and lower borders can be smaller; blocks count by their pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RegionErrors {
    /// Blocks of 8 × 8 pixels.
    pub relmse_8x8: f64,
    /// Blocks of 16 × 16 pixels.
    pub relmse_16x16: f64,
    /// Blocks of 32 × 32 pixels.
    pub relmse_32x32: f64,
    /// The whole picture.
    pub relmse_whole: f64,
}

/// The sums of a block's pixels in both pictures, and their number.
#[derive(Clone, Copy, Default)]
struct Block {
    image: [f64; 3],
    reference: [f64; 3],
    pixels: f64,
}

impl Block {
    fn add(&mut self, other: &Block) {
        for c in 0..3 {
            self.image[c] += other.image[c];
            self.reference[c] += other.reference[c];
        }
        self.pixels += other.pixels;
    }

    /// Squared relative error of the block's means, times its pixels and channels.
    fn weighted_error(&self) -> f64 {
        if self.pixels == 0.0 {
            return 0.0;
        }
        let error = |(a, b): (&f64, &f64)| {
            let (d, r) = ((a - b) / self.pixels, b / self.pixels);
            d * d / (r * r + FLOOR)
        };
        self.pixels * self.image.iter().zip(&self.reference).map(error).sum::<f64>()
    }
}

/// Blocks of equal size, row by row.
struct Blocks {
    columns: usize,
    blocks: Vec<Block>,
}

impl Blocks {
    /// Blocks of `side` × `side` of the given ones, which have `columns` in a row.
    fn merged(blocks: &[Block], columns: usize, side: usize) -> Blocks {
        let rows = blocks.len().div_ceil(columns.max(1));
        let merged_columns = columns.div_ceil(side);
        let mut merged = vec![Block::default(); merged_columns * rows.div_ceil(side)];
        for (i, block) in blocks.iter().enumerate() {
            let (x, y) = (i % columns / side, i / columns / side);
            merged[y * merged_columns + x].add(block);
        }
        Blocks { columns: merged_columns, blocks: merged }
    }

    fn relmse(&self) -> f64 {
        let pixels: f64 = self.blocks.iter().map(|b| b.pixels).sum();
        self.blocks.iter().map(Block::weighted_error).sum::<f64>() / (3.0 * pixels)
    }
}

/// Errors of the regions of a picture whose rows have `width` pixels. Pixels that are not finite in either picture are
/// left out; without any finite pixel the errors are NaN.
///
/// # Panics
/// If the pictures do not have equally many pixels.
pub fn region_errors(image: &[[f64; 3]], reference: &[[f64; 3]], width: usize) -> RegionErrors {
    assert_eq!(image.len(), reference.len());
    let pixel = |(image, reference): (&[f64; 3], &[f64; 3])| match is_finite(image) && is_finite(reference) {
        true => Block { image: *image, reference: *reference, pixels: 1.0 },
        false => Block::default(),
    };
    let pixels: Vec<Block> = image.iter().zip(reference).map(pixel).collect();
    let small = Blocks::merged(&pixels, width, 8);
    let medium = Blocks::merged(&small.blocks, small.columns, 2);
    let large = Blocks::merged(&medium.blocks, medium.columns, 2);
    let whole = Blocks::merged(&large.blocks, large.columns, usize::MAX);
    RegionErrors {
        relmse_8x8: small.relmse(),
        relmse_16x16: medium.relmse(),
        relmse_32x32: large.relmse(),
        relmse_whole: whole.relmse(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    /// The definition, block by block.
    fn slow(image: &[[f64; 3]], reference: &[[f64; 3]], width: usize, side: usize) -> f64 {
        let height = image.len() / width;
        let (mut sum, mut count) = (0.0, 0.0);
        for y0 in (0..height).step_by(side) {
            for x0 in (0..width).step_by(side) {
                let inside: Vec<usize> = (y0..(y0 + side).min(height))
                    .flat_map(|y| (x0..(x0 + side).min(width)).map(move |x| y * width + x))
                    .collect();
                let n = inside.len() as f64;
                for c in 0..3 {
                    let mean = |p: &[[f64; 3]]| inside.iter().map(|&i| p[i][c]).sum::<f64>() / n;
                    let (a, b) = (mean(image), mean(reference));
                    sum += n * (a - b) * (a - b) / (b * b + 0.01);
                }
                count += 3.0 * n;
            }
        }
        sum / count
    }

    fn noise(pixels: usize, seed: u64) -> Vec<[f64; 3]> {
        let mut rng = HashRng::new(seed, 0, 0, 0);
        (0..pixels).map(|_| std::array::from_fn(|_| 0.5 + f64::from(rng.next_f32()))).collect()
    }

    #[test]
    fn errors_are_those_of_the_definition() {
        let (width, height) = (75, 41);
        let (a, b) = (noise(width * height, 1), noise(width * height, 2));
        let found = region_errors(&a, &b, width);
        for (error, side) in
            [(found.relmse_8x8, 8), (found.relmse_16x16, 16), (found.relmse_32x32, 32), (found.relmse_whole, 75)]
        {
            let expected = slow(&a, &b, width, side);
            assert!((error - expected).abs() < 1e-12 * expected, "{side}: {error} {expected}");
        }
    }

    #[test]
    fn independent_noise_averages_out_and_shared_errors_do_not() {
        let reference = vec![[1.0; 3]; 128 * 128];
        let error = |image: &[[f64; 3]]| region_errors(image, &reference, 128).relmse_16x16;
        // Uniform on 0.5 … 1.5: variance 1/12.
        assert!((error(&noise(128 * 128, 3)) * 256.0 * 12.0 * 1.01 - 1.0).abs() < 0.2);
        let shared = vec![[1.1; 3]; 128 * 128];
        assert!((error(&shared) * 1.01 / 0.01 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn pixels_that_are_not_finite_are_left_out() {
        let reference = vec![[1.0; 3]; 64];
        let mut image = reference.clone();
        image[5] = [f64::NAN, 1.0, 1.0];
        assert_eq!(region_errors(&image, &reference, 8).relmse_8x8, 0.0);
        assert!(region_errors(&[[f64::NAN; 3]], &[[1.0; 3]], 1).relmse_whole.is_nan());
    }
}
