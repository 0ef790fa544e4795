//! A tile of the film and the samples of one iteration on their way into it.

use super::{KEPT_PLACES, LightImage, NonFinite};
use crate::math::Rgb;

/// Sums of a rectangle of pixels.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
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

    /// Sum over pixels of the variance of one sample, the mean of the channels, from `n` samples of each pixel.
    pub fn sample_variance(&self, n: u64) -> f64 {
        let n = n as f64;
        let sums = self.sums.iter().flatten().zip(self.squares.iter().flatten());
        sums.map(|(s, q)| (q - s * s / n).max(0.0) / (n - 1.0) / 3.0).sum()
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
                    let source = samples.non_finite_source(i, splats);
                    self.places.push(NonFinite { x, y, iteration, source });
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

/// The group of techniques that made a contribution to the sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum ContributionKind {
    /// s = 0: an eye sub-path met a light.
    Hit,
    /// s = 1: next event.
    NextEvent,
    /// s ≥ 2: a connection of two sub-paths.
    Connection,
}

/// Kind of technique that brought a non-finite contribution to a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NonFiniteSource {
    /// A walk that met light.
    Hit,
    /// Next event.
    NextEvent,
    /// A connection of two sub-paths.
    Connection,
    /// A light sub-path that was connected to the camera.
    LightImage,
    /// All contributions were finite, but not their sum.
    Sum,
}

impl NonFiniteSource {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            NonFiniteSource::Hit => "hit",
            NonFiniteSource::NextEvent => "next event",
            NonFiniteSource::Connection => "connection",
            NonFiniteSource::LightImage => "light image",
            NonFiniteSource::Sum => "sum of finite contributions",
        }
    }
}

/// One sample of every pixel of a tile, collected while its shadow rays are under way.
///
/// When a shadow ray is answered depends on its neighbours in the packet, and with them on the tile and on a crop
/// window. What waits in different queues is therefore summed apart, each part in an order of the pixel's own: the
/// same bits in any window.
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
    pub fn add(&mut self, part: ContributionKind, i: u32, value: Rgb) {
        self.parts[part as usize][i as usize] += value;
    }

    /// Where the sample of pixel `i` stops being finite; `splats` is what the light image adds to it.
    fn non_finite_source(&self, i: u32, splats: Rgb) -> NonFiniteSource {
        let part = |part: ContributionKind| self.parts[part as usize][i as usize];
        let contributions = [
            (part(ContributionKind::Hit), NonFiniteSource::Hit),
            (part(ContributionKind::NextEvent), NonFiniteSource::NextEvent),
            (part(ContributionKind::Connection), NonFiniteSource::Connection),
            (splats, NonFiniteSource::LightImage),
        ];
        contributions.into_iter().find(|(v, _)| !v.is_finite()).map_or(NonFiniteSource::Sum, |(_, source)| source)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Film, Splat};

    #[test]
    fn the_source_of_a_non_finite_sample_is_told() {
        let nan = Rgb::new(f32::NAN, 0.0, 0.0);
        let large = Rgb::new(0.6 * f32::MAX, 0.0, 0.0);
        let source = |contributions: &[(ContributionKind, Rgb)], splat: Rgb| {
            let window = [0, 0, 3, 2];
            let (mut film, mut buffer) = (Film::new(window), SampleBuffer::default());
            let iteration = film.begin_iteration();
            buffer.clear(film.tiles[0].pixels());
            contributions.iter().for_each(|&(part, value)| buffer.add(part, 4, value));
            let splat = Splat { x: 1, y: 1, value: splat, ..Splat::default() };
            film.tiles[0].commit(&buffer, Some(&LightImage::new(window, vec![vec![splat]])), iteration);
            let (count, places) = film.non_finite();
            places.first().map(|p| (count, p.x, p.y, p.source))
        };
        let at = |source| Some((1, 1, 1, source));
        assert_eq!(source(&[(ContributionKind::Hit, Rgb::WHITE)], Rgb::WHITE), None);
        assert_eq!(source(&[(ContributionKind::Hit, nan)], Rgb::WHITE), at(NonFiniteSource::Hit));
        assert_eq!(
            source(&[(ContributionKind::NextEvent, nan), (ContributionKind::Hit, Rgb::WHITE)], Rgb::WHITE),
            at(NonFiniteSource::NextEvent)
        );
        assert_eq!(source(&[(ContributionKind::Connection, nan)], Rgb::WHITE), at(NonFiniteSource::Connection));
        assert_eq!(source(&[], nan), at(NonFiniteSource::LightImage));
        assert_eq!(
            source(&[(ContributionKind::Hit, large), (ContributionKind::NextEvent, large)], Rgb::BLACK),
            at(NonFiniteSource::Sum)
        );
    }
}
