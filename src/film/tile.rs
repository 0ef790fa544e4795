//! A tile of the film and the samples of one iteration on their way into it.

use super::{KEPT_PLACES, NonFinite};
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

    /// Adds one sample per pixel. A sample that is not finite is counted instead.
    pub fn commit(&mut self, samples: &SampleBuffer, iteration: u64) {
        for (i, (&at_once, &late)) in samples.at_once.iter().zip(&samples.late).enumerate() {
            let value = at_once + late;
            if !value.is_finite() {
                self.non_finite += 1;
                if self.places.len() < KEPT_PLACES {
                    let (x, y) = self.pixel(i as u32);
                    self.places.push(NonFinite { x, y, iteration });
                }
                continue;
            }
            for (c, v) in value.to_array().into_iter().map(f64::from).enumerate() {
                self.sums[i][c] += v;
                self.squares[i][c] += v * v;
            }
        }
    }
}

/// One sample of every pixel of a tile, collected while its shadow rays are under way.
///
/// When a shadow ray is answered depends on its neighbours in the packet, and with them on the tile and on a crop window. What comes
/// at once and what comes late is therefore summed apart, each in an order of the pixel's own: the same bits in any window.
#[derive(Clone, Debug, Default)]
pub struct SampleBuffer {
    at_once: Vec<Rgb>,
    late: Vec<Rgb>,
}

impl SampleBuffer {
    /// All black, for the pixels of `tile`.
    pub fn clear(&mut self, tile: &FilmTile) {
        for sums in [&mut self.at_once, &mut self.late] {
            sums.clear();
            sums.resize(tile.pixels() as usize, Rgb::BLACK);
        }
    }

    /// Adds light to the sample of pixel `i`.
    #[inline]
    pub fn add(&mut self, i: u32, value: Rgb) {
        self.at_once[i as usize] += value;
    }

    /// Adds light whose shadow ray has been answered; in the order in which they were queued.
    #[inline]
    pub fn add_late(&mut self, i: u32, value: Rgb) {
        self.late[i as usize] += value;
    }
}
