//! A picture in memory: one, three or four channels, eight-bit or float. The colour space is decided once, on loading:
//! values read through [`Image::rgb`] and [`Image::value`] are linear.

use crate::math::Rgb;
use crate::math::hash::mix64;
use std::fmt;

/// Pixel values, row by row from the top, channels interleaved.
#[derive(Clone, PartialEq)]
pub enum Pixels {
    /// Eight bits, sRGB transfer: decoded on reading.
    Srgb8(Vec<u8>),
    /// Eight bits, linear.
    Linear8(Vec<u8>),
    /// Linear floats.
    F32(Vec<f32>),
}

/// How many values, and a hash of them: millions of numbers help nobody, and different pictures look different.
impl fmt::Debug for Pixels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Eight bytes to a word.
        let bytes = |v: &[u8]| {
            v.chunks(8)
                .fold(1, |h: u64, c| mix64(h.rotate_left(5) ^ c.iter().fold(0, |word, &b| word << 8 | u64::from(b))))
        };
        let floats = |v: &[f32]| v.iter().fold(1, |h: u64, x| mix64(h.rotate_left(5) ^ u64::from(x.to_bits())));
        let (name, count, hash) = match self {
            Pixels::Srgb8(v) => ("Srgb8", v.len(), bytes(v)),
            Pixels::Linear8(v) => ("Linear8", v.len(), bytes(v)),
            Pixels::F32(v) => ("F32", v.len(), floats(v)),
        };
        write!(f, "{name}({count} values, hash {hash:016x})")
    }
}

/// A picture.
///
/// ```
/// use lightsieve::image::{Image, Pixels};
///
/// // Two pixels of one grey channel, as an eight-bit file has them.
/// let image = Image { width: 2, height: 1, channels: 1, pixels: Pixels::Srgb8(vec![0, 188]) };
/// assert_eq!(image.value(0, 0, 0), 0.0);
/// // sRGB 188 is about half of the radiance of white.
/// assert!((image.rgb(1, 0).g - 0.5).abs() < 0.01);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Channels of a pixel: 1 grey, 3 colour, 4 colour and alpha (linear).
    pub channels: u32,
    /// Values.
    pub pixels: Pixels,
}

impl Image {
    /// Linear colour of a pixel.
    ///
    /// # Panics
    /// If the pixel is outside.
    pub fn rgb(&self, x: u32, y: u32) -> Rgb {
        let at = |c: u32| self.value(x, y, c);
        if self.channels < 3 { Rgb::grey(at(0)) } else { Rgb::new(at(0), at(1), at(2)) }
    }

    /// Linear value of one channel of a pixel.
    ///
    /// # Panics
    /// If the pixel or channel is outside.
    pub fn value(&self, x: u32, y: u32, channel: u32) -> f32 {
        assert!(x < self.width && channel < self.channels);
        let i = (y as usize * self.width as usize + x as usize) * self.channels as usize + channel as usize;
        match &self.pixels {
            Pixels::Srgb8(v) if channel < 3 => SRGB_TO_LINEAR[v[i] as usize],
            Pixels::Srgb8(v) | Pixels::Linear8(v) => f32::from(v[i]) * (1.0 / 255.0),
            Pixels::F32(v) => v[i],
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match &self.pixels {
            Pixels::Srgb8(v) | Pixels::Linear8(v) => v.len(),
            Pixels::F32(v) => v.len() * 4,
        }
    }
}

/// sRGB transfer (IEC 61966-2-1), encoded value in [0, 1] → linear.
pub fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Linear → sRGB transfer.
pub fn linear_to_srgb(v: f64) -> f64 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

static SRGB_TO_LINEAR: std::sync::LazyLock<[f32; 256]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f64 / 255.0) as f32));
