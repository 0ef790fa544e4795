//! The light image: what light sub-paths bring to pixels anywhere in the picture.
//!
//! Workers collect splats in lists of their own. After the iteration they are sorted by pixel and, within a pixel, by
//! the light sub-path and vertex they come from, and only then added up: the same bits for any number of threads, in
//! any crop window.

use crate::math::Rgb;
use rayon::prelude::*;

/// Light for one pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Splat {
    /// Column, in pixels of the full picture.
    pub x: u32,
    /// Row, in pixels of the full picture.
    pub y: u32,
    /// Number of the light sub-path.
    pub path: u32,
    /// Number of the vertex on it.
    pub vertex: u32,
    /// Number of the contribution in a replay.
    pub replay_index: u32,
    /// Contribution to the pixel.
    pub value: Rgb,
}

/// One iteration's sums of splats in the part of the picture that is rendered.
#[derive(Clone, Debug)]
pub struct LightImage {
    window: [u32; 4],
    pixels: Vec<Rgb>,
}

impl LightImage {
    /// Adds up splats for the window x, y, width, height; those outside of it are left out.
    pub fn new(window: [u32; 4], lists: Vec<Vec<Splat>>) -> LightImage {
        let [x0, y0, width, height] = window;
        let mut pixels = vec![Rgb::BLACK; width as usize * height as usize];
        let inside = |s: &Splat| s.x.wrapping_sub(x0) < width && s.y.wrapping_sub(y0) < height;
        // Bands of rows are sorted and summed each by itself, so that what is sorted stays small.
        let rows = (height as usize).div_ceil(BANDS).max(1);
        let mut bands: Vec<Vec<Splat>> = vec![vec![]; (height as usize).div_ceil(rows)];
        for splat in lists.into_iter().flatten().filter(inside) {
            bands[(splat.y - y0) as usize / rows].push(splat);
        }
        pixels.par_chunks_mut(rows * width as usize).zip(bands).enumerate().for_each(|(band, (pixels, mut splats))| {
            splats.sort_unstable_by_key(|s| (s.y, s.x, s.path, s.vertex));
            let top = y0 + (band * rows) as u32;
            for s in splats {
                pixels[((s.y - top) * width + s.x - x0) as usize] += s.value;
            }
        });
        LightImage { window, pixels }
    }

    /// The sum at column `x` and row `y` of the full picture, which must be inside the window.
    #[inline]
    pub fn at(&self, x: u32, y: u32) -> Rgb {
        let [x0, y0, width, _] = self.window;
        self.pixels[((y - y0) * width + x - x0) as usize]
    }
}

/// Bands that a picture is cut into, about.
const BANDS: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_the_lists() {
        let splat = |i: u32| Splat {
            x: 3 + i % 5,
            y: 2 + i % 7,
            path: i.wrapping_mul(2_654_435_761) % 1000,
            vertex: i,
            replay_index: 0,
            value: Rgb::new(1.0 / (1 + i) as f32, (i as f32).sqrt(), 1e7 * (i % 3) as f32),
        };
        let all: Vec<Splat> = (0..5000).map(splat).collect();
        let window = [4, 3, 3, 5];
        let one = LightImage::new(window, vec![all.clone()]);
        let many = LightImage::new(window, all.rchunks(77).map(<[Splat]>::to_vec).collect());
        let mut total = 0.0;
        for y in 3..8 {
            for x in 4..7 {
                assert_eq!(one.at(x, y), many.at(x, y));
                total += f64::from(one.at(x, y).g);
            }
        }
        let inside = all.iter().filter(|s| (4..7).contains(&s.x) && (3..8).contains(&s.y));
        let expected: f64 = inside.map(|s| f64::from(s.value.g)).sum();
        assert!((total - expected).abs() < 1e-5 * expected);
    }
}
