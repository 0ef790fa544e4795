//! A tile of the film and the samples of one iteration on their way into it.

use super::{KEPT_PLACES, LightImage, NonFinite};
use crate::math::Rgb;

/// Sums of a rectangle of pixels.
#[derive(Clone, Debug)]
pub struct FilmTile {
    /// Left edge, in pixels of the full picture.
    pub x0: u32,
    /// Upper edge, in pixels of the full picture.
    pub y0: u32,
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
    /// Sum of samples per pixel and channel.
    pub sums: Vec<[f64; 3]>,
    /// Sum of squared samples.
    pub squares: Vec<[f64; 3]>,
    /// Samples that were not finite.
    pub non_finite: u64,
    /// The first of them.
    pub places: Vec<NonFinite>,
}

impl FilmTile {
    pub(super) fn new(x0: u32, y0: u32, width: u32, height: u32) -> FilmTile {
        let n = (width * height) as usize;
        FilmTile {
            x0,
            y0,
            width,
            height,
            sums: vec![[0.0; 3]; n],
            squares: vec![[0.0; 3]; n],
            non_finite: 0,
            places: vec![],
        }
    }

    /// Pixels in the tile.
    pub fn pixels(&self) -> u32 {
        self.width * self.height
    }

    /// Column and row of pixel `i`, in pixels of the full picture.
    pub fn pixel(&self, i: u32) -> (u32, u32) {
        (self.x0 + i % self.width, self.y0 + i / self.width)
    }

    /// Number of the pixel at a column and row of the full picture, which must be in the tile.
    #[inline]
    pub fn index(&self, x: u32, y: u32) -> u32 {
        (y - self.y0) * self.width + x - self.x0
    }

    /// Adds one sample per pixel, and what the light image has for it.
    /// A sample that is not finite is counted instead.
    pub fn commit(&mut self, samples: &SampleBuffer, light_image: Option<&LightImage>, iteration: u64) {
        for i in 0..self.pixels() {
            let (x, y) = self.pixel(i);
            let splats = light_image.map_or(Rgb::BLACK, |image| image.at(x, y));
            let value = samples.parts.iter().fold(splats, |sum, part| sum + part[i as usize]);
            if !value.is_finite() {
                self.non_finite += 1;
                if self.places.len() < KEPT_PLACES {
                    self.places.push(NonFinite { x, y, iteration });
                }
                continue;
            }
            let i = i as usize;
            for (c, v) in value.to_array().into_iter().map(f64::from).enumerate() {
                self.sums[i][c] += v;
                self.squares[i][c] += v * v;
            }
        }
    }
}

/// Where a contribution to a sample comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Part {
    /// Known at once: the walk met light.
    AtOnce,
    /// After a shadow ray of next event.
    Direct,
    /// After a shadow ray of a connection.
    Connection,
}

/// One sample of every pixel of a tile, collected while its shadow rays are under way.
///
/// When a shadow ray is answered depends on its neighbours in the packet, and with them on the tile and on a crop window. What
/// waits in different queues is therefore summed apart, each part in an order of the pixel's own: the same bits in any window.
#[derive(Clone, Debug, Default)]
pub struct SampleBuffer {
    parts: [Vec<Rgb>; 3],
}

impl SampleBuffer {
    /// All black, for so many pixels.
    pub fn clear(&mut self, pixels: u32) {
        for sums in &mut self.parts {
            sums.clear();
            sums.resize(pixels as usize, Rgb::BLACK);
        }
    }

    /// Adds light to the sample of pixel `i`; within a part in the order in which it was found.
    #[inline]
    pub fn add(&mut self, part: Part, i: u32, value: Rgb) {
        self.parts[part as usize][i as usize] += value;
    }
}
