//! Pixel sums and the guard at their door.
//!
//! The film is cut into tiles that one worker owns at a time, so nothing is locked, nothing is summed in an order
//! that depends on the number of threads, and the sums are double precision. Nothing that is not finite is ever
//! added: it is counted, and where it came from is kept.

pub mod pyramid;
pub mod splat;
pub mod tile;

pub use pyramid::Pyramid;
pub use splat::{LightImage, Splat};
pub use tile::{ContributionKind, FilmTile, NonFiniteSource, SampleBuffer};

use crate::math::Rgb;

/// Pixels along a tile's side.
pub const TILE: u32 = 16;
/// Largest number of iterations: beyond, sums of double precision would not grow by a sample any more.
pub const MAX_ITERATIONS: u64 = 1 << 53;
/// Places of non-finite samples that are kept; the count goes on.
const KEPT_PLACES: usize = 16;

/// A sample that was not a finite number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct NonFinite {
    /// Column of the full picture.
    pub x: u32,
    /// Row of the full picture.
    pub y: u32,
    /// Iteration.
    pub iteration: u64,
    /// The first contribution to it that was not finite.
    pub source: NonFiniteSource,
}

/// The part of the picture that is rendered, with its sums.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Film {
    /// Left edge, in pixels of the full picture.
    pub x0: u32,
    /// Upper edge, in pixels of the full picture.
    pub y0: u32,
    /// Width of the rendered part.
    pub width: u32,
    /// Height of the rendered part.
    pub height: u32,
    /// Tiles, row by row.
    pub tiles: Vec<FilmTile>,
    iterations: u64,
}

/// Number of tiles of a film for a part of the picture: x, y, width, height.
pub fn tile_count([_, _, width, height]: [u32; 4]) -> usize {
    width.div_ceil(TILE) as usize * height.div_ceil(TILE) as usize
}

impl Film {
    /// An empty film for a part of the picture: x, y, width, height.
    pub fn new([x0, y0, width, height]: [u32; 4]) -> Film {
        let mut tiles = Vec::new();
        for y in (0..height).step_by(TILE as usize) {
            for x in (0..width).step_by(TILE as usize) {
                tiles.push(FilmTile::new(x0 + x, y0 + y, TILE.min(width - x), TILE.min(height - y)));
            }
        }
        Film { x0, y0, width, height, tiles, iterations: 0 }
    }

    /// Begins the next iteration and returns its index, from zero on. From now on it counts as one of
    /// [`Film::iterations`]; all its samples are added before the next begins.
    pub fn begin_iteration(&mut self) -> u64 {
        self.iterations += 1;
        self.iterations - 1
    }

    /// Iterations in the film, the running one included: samples per pixel.
    pub fn iterations(&self) -> u64 {
        self.iterations
    }

    /// Calls `f(x, y, sum, sum of squares)` for every pixel; x and y count from the rendered part's corner.
    pub fn for_each_pixel(&self, mut f: impl FnMut(u32, u32, [f64; 3], [f64; 3])) {
        for tile in &self.tiles {
            for (i, (sum, squares)) in tile.sums.iter().zip(&tile.squares).enumerate() {
                let i = i as u32;
                f(tile.x0 - self.x0 + i % tile.width, tile.y0 - self.y0 + i / tile.width, *sum, *squares);
            }
        }
    }

    /// The picture: mean radiance per pixel, row by row, in double precision; black before the first iteration.
    pub fn mean_f64(&self) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.width as usize * self.height as usize];
        let scale = 1.0 / self.iterations.max(1) as f64;
        self.for_each_pixel(|x, y, sum, _| out[(y * self.width + x) as usize] = sum.map(|s| s * scale));
        out
    }

    /// [`Film::mean_f64`], rounded to single precision.
    pub fn mean(&self) -> Vec<Rgb> {
        self.mean_f64().into_iter().map(|p| Rgb::from(p.map(|v| v as f32))).collect()
    }

    /// Variance of each pixel's mean, estimated from its samples; zero before the second iteration.
    pub fn variance_of_mean(&self) -> Vec<Rgb> {
        let mut out = vec![Rgb::BLACK; self.width as usize * self.height as usize];
        let n = self.iterations as f64;
        if self.iterations < 2 {
            return out;
        }
        self.for_each_pixel(|x, y, sum, squares| {
            let variance: [f32; 3] =
                std::array::from_fn(|c| (((squares[c] - sum[c] * sum[c] / n) / (n - 1.0)).max(0.0) / n) as f32);
            out[(y * self.width + x) as usize] = Rgb::from(variance);
        });
        out
    }

    /// Adds the iterations of another film of the same part of the picture.
    ///
    /// # Panics
    /// If it is of another part.
    pub fn add(&mut self, other: &Film) {
        let window = |f: &Film| [f.x0, f.y0, f.width, f.height];
        assert_eq!(window(self), window(other));
        self.iterations += other.iterations;
        for (tile, more) in self.tiles.iter_mut().zip(&other.tiles) {
            let into = |a: &mut [[f64; 3]], b: &[[f64; 3]]| {
                a.as_flattened_mut().iter_mut().zip(b.as_flattened()).for_each(|(a, b)| *a += b);
            };
            into(&mut tile.sums, &more.sums);
            into(&mut tile.squares, &more.squares);
            tile.non_finite += more.non_finite;
            tile.places.extend(&more.places);
        }
    }

    /// True if its tiles are those of an empty film for the window: a film that was read from a file is whole then.
    pub fn is_of_window(&self, window: [u32; 4]) -> bool {
        let expected = Film::new(window);
        let layout = |t: &FilmTile| ([t.x0, t.y0, t.width, t.height], t.sums.len(), t.squares.len());
        [self.x0, self.y0, self.width, self.height] == window
            && self.tiles.iter().map(layout).eq(expected.tiles.iter().map(layout))
    }

    /// True if iterations can have made the sums: all are finite, no square of a sum exceeds the iterations times the
    /// sum of squares (Cauchy and Schwarz, up to rounding), and the counts fit the number of samples.
    pub fn is_plausible(&self) -> bool {
        let (n, rounding) = (self.iterations as f64, 1.0 + 1e-9);
        let possible = |sum: &f64, squares: &f64| {
            sum.is_finite() && squares.is_finite() && *squares >= 0.0 && sum * sum <= n * squares * rounding
        };
        let tile = |t: &FilmTile| {
            let samples = self.iterations.saturating_mul(u64::from(t.width) * u64::from(t.height));
            t.non_finite <= samples
                && t.places.len() as u64 <= t.non_finite
                && t.sums.as_flattened().iter().zip(t.squares.as_flattened()).all(|(s, q)| possible(s, q))
        };
        self.iterations <= MAX_ITERATIONS && self.tiles.iter().all(tile)
    }

    /// How many samples were not finite, and where the first of them were.
    pub fn non_finite(&self) -> (u64, Vec<NonFinite>) {
        let count = self.tiles.iter().map(|t| t.non_finite).sum();
        let mut places: Vec<NonFinite> = self.tiles.iter().flat_map(|t| t.places.iter().copied()).collect();
        places.sort_by_key(|p| (p.iteration, p.y, p.x));
        places.truncate(KEPT_PLACES);
        (count, places)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        let mut film = Film::new([5, 7, 37, 21]);
        let mut buffer = SampleBuffer::default();
        assert_eq!((film.begin_iteration(), film.iterations()), (0, 1));
        for tile in &mut film.tiles {
            buffer.clear(tile.pixels());
            for i in 0..tile.pixels() {
                let (x, y) = tile.pixel(i);
                buffer.add(ContributionKind::Hit, i, Rgb::new(x as f32, y as f32, 1.0));
            }
            tile.commit(&buffer, None, 0);
        }
        let mean = film.mean();
        for y in 0..21 {
            for x in 0..37 {
                assert_eq!(mean[y * 37 + x].to_array(), [x as f32 + 5.0, y as f32 + 7.0, 1.0]);
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_counted_located_and_left_out() {
        let mut film = Film::new([0, 0, 4, 4]);
        let mut buffer = SampleBuffer::default();
        for _ in 0..2 {
            let iteration = film.begin_iteration();
            let tile = &mut film.tiles[0];
            buffer.clear(tile.pixels());
            for i in 0..16 {
                buffer.add(ContributionKind::Hit, i, Rgb::WHITE);
            }
            if iteration == 1 {
                buffer.add(ContributionKind::Hit, 6, Rgb::new(0.0, f32::NAN, 0.0));
            }
            tile.commit(&buffer, None, iteration);
        }
        assert_eq!(film.non_finite(), (1, vec![NonFinite { x: 2, y: 1, iteration: 1, source: NonFiniteSource::Hit }]));
        assert_eq!(film.mean()[0], Rgb::WHITE);
        assert_eq!(film.mean()[6], Rgb::grey(0.5));
    }
}
