//! The formats with a text header: PGM and PPM (plain and binary, up to 16 bits), and PFM (floats, bottom row first).
//!
//! The crate `image` reads PGM and PPM too, but rounds samples whose maximum is neither 255 nor 65535 to 8 or 16 bits,
//! and reads no PFM, whose header is the same. So all three are read here, and its feature `pnm` is off.

use super::buffer::{Image, Pixels};
use super::read::{Encoding, ImageFault, check_size, transfer_floats};

/// Reads white-space separated words and remembers the place.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    format: &'static str,
    /// A `#` comments the rest of its line (not in PFM).
    comments: bool,
}

impl<'a> Words<'a> {
    fn next(&mut self) -> Result<&'a str, ImageFault> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let mut skip = 0;
        let mut in_comment = false;
        for &b in rest {
            in_comment = (in_comment || (self.comments && b == b'#')) && b != b'\n' && b != b'\r';
            if !in_comment && !b.is_ascii_whitespace() {
                break;
            }
            skip += 1;
        }
        let word = &rest[skip..];
        let length = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.at += skip + length;
        std::str::from_utf8(&word[..length])
            .ok()
            .filter(|w| !w.is_empty())
            .ok_or_else(|| ImageFault::damaged(self.format, "it ends early or holds no text where a number should be"))
    }

    fn number<T: std::str::FromStr>(&mut self) -> Result<T, ImageFault> {
        let format = self.format;
        let word = self.next()?;
        word.parse().map_err(|_| ImageFault::damaged(format, format!("expected a number, found \"{}\"", excerpt(word))))
    }

    /// The bytes after the one white-space byte that ends the last word.
    fn body(&self) -> &'a [u8] {
        self.bytes.get(self.at + 1..).unwrap_or_default()
    }
}

/// A word of a hostile file may be megabytes long.
fn excerpt(word: &str) -> String {
    word.chars().take(20).flat_map(char::escape_default).collect()
}

/// PFM, grey (`Pf`) or colour (`PF`); a negative scale says little-endian, its magnitude multiplies the values.
pub(super) fn decode_pfm(bytes: &[u8]) -> Result<Image, ImageFault> {
    const NAME: &str = "PFM";
    let mut words = Words { bytes, at: 0, format: NAME, comments: false };
    let channels = match words.next()? {
        "PF" => 3,
        "Pf" => 1,
        other => return Err(ImageFault::unsupported(NAME, format!("the kind \"{}\"", excerpt(other)))),
    };
    let (width, height): (u32, u32) = (words.number()?, words.number()?);
    let scale: f32 = words.number()?;
    if !scale.is_finite() || scale == 0.0 {
        return Err(ImageFault::damaged(NAME, "the scale must be a number other than 0"));
    }
    check_size(width.into(), height.into(), 4 * u64::from(channels), bytes.len() as u64)?;
    let row = width as usize * channels as usize * 4;
    let body = complete(NAME, words.body(), row * height as usize)?;
    let value = |b: &[u8]| {
        let four = [b[0], b[1], b[2], b[3]];
        scale.abs() * if scale < 0.0 { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) }
    };
    let rows_from_top = body.chunks_exact(row).rev();
    let values = rows_from_top.flat_map(|row| row.chunks_exact(4).map(value)).collect();
    Ok(Image { width, height, channels, pixels: Pixels::F32(values) })
}

/// PGM and PPM. The maximum value 255 gives eight-bit pixels, any other gives floats.
pub(super) fn decode_pnm(bytes: &[u8], encoding: Encoding) -> Result<Image, ImageFault> {
    let mut words = Words { bytes, at: 0, format: "PNM", comments: true };
    let (format, channels, plain) = match words.next()? {
        "P2" => ("PGM", 1, true),
        "P3" => ("PPM", 3, true),
        "P5" => ("PGM", 1, false),
        "P6" => ("PPM", 3, false),
        other => return Err(ImageFault::unsupported("PNM", format!("the kind \"{}\"", excerpt(other)))),
    };
    words.format = format;
    let (width, height): (u32, u32) = (words.number()?, words.number()?);
    let max: u16 = words.number()?;
    if max == 0 {
        return Err(ImageFault::damaged(format, "the maximum value is 0"));
    }
    let sample_bytes = if max > 255 { 2 } else { 1 };
    check_size(width.into(), height.into(), u64::from(channels) * sample_bytes, bytes.len() as u64)?;
    let samples = width as usize * height as usize * channels as usize;

    let values: Vec<u16> = if plain {
        // A plain sample takes two bytes at least, so that this cannot allocate more than the file is long.
        complete(format, words.body(), samples)?;
        (0..samples).map(|_| words.number()).collect::<Result<_, _>>()?
    } else if max > 255 {
        let body = complete(format, words.body(), samples * 2)?;
        body.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect()
    } else {
        complete(format, words.body(), samples)?.iter().map(|&b| u16::from(b)).collect()
    };
    if values.iter().any(|&v| v > max) {
        return Err(ImageFault::damaged(format, "a value is above the maximum"));
    }

    let srgb = encoding != Encoding::Linear;
    if max == 255 {
        let values = values.into_iter().map(|v| v as u8).collect();
        let pixels = if srgb { Pixels::Srgb8(values) } else { Pixels::Linear8(values) };
        Ok(Image { width, height, channels, pixels })
    } else {
        let values = values.into_iter().map(|v| f32::from(v) / f32::from(max)).collect();
        Ok(transfer_floats(Image { width, height, channels, pixels: Pixels::F32(values) }, srgb))
    }
}

fn complete<'a>(format: &'static str, body: &'a [u8], needed: usize) -> Result<&'a [u8], ImageFault> {
    body.get(..needed).ok_or_else(|| {
        ImageFault::damaged(format, format!("{needed} bytes of pixels announced, {} present", body.len()))
    })
}
