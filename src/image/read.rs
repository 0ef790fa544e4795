//! Picture files into memory: PNG, JPEG, BMP, WebP, TGA, Radiance HDR, OpenEXR, PFM, PGM and PPM.
//!
//! The format is recognised by the first bytes, not by the ending (only TGA has no such bytes). Sizes are checked
//! against the length of the file before anything is allocated, and no input makes this module panic.

use super::buffer::{Image, Pixels, srgb_to_linear};
use super::{exr_in, netpbm, read_regular};
use image::{DynamicImage, ImageFormat};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// The meaning of the numbers in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// sRGB in integer files (PNG, JPEG, BMP, WebP, TGA, PGM, PPM), linear in float files (EXR, HDR, PFM).
    #[default]
    Auto,
    /// sRGB transfer (alpha excepted).
    Srgb,
    /// Linear, as normal maps and roughness need it.
    Linear,
}

/// A picture that could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct ImageError {
    /// The file.
    pub path: PathBuf,
    /// The fault.
    #[source]
    pub fault: ImageFault,
}

/// Faults of picture files.
#[derive(Debug, thiserror::Error)]
pub enum ImageFault {
    /// The file could not be opened or read.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// Not a picture, or of a kind not known here.
    #[error("not a picture in a known format (known: png, jpg, bmp, webp, tga, hdr, exr, pfm, pgm, ppm)")]
    UnknownFormat,
    /// The contents contradict themselves or end too early.
    #[error("the {format} data is damaged: {reason}")]
    Damaged {
        /// Name of the format.
        format: &'static str,
        /// The decoder's message.
        reason: String,
    },
    /// A sound file that uses something not supported here.
    #[error("the {format} file uses something that is not supported: {what}")]
    Unsupported {
        /// Name of the format.
        format: &'static str,
        /// The feature.
        what: String,
    },
    /// More pixels than the program takes, or than a file of this length can hold.
    #[error("{width} x {height} pixels are too many for this file or this program")]
    TooLarge {
        /// Columns claimed.
        width: u64,
        /// Rows claimed.
        height: u64,
    },
}

impl ImageFault {
    pub(super) fn damaged(format: &'static str, reason: impl Into<String>) -> ImageFault {
        ImageFault::Damaged { format, reason: reason.into() }
    }

    pub(super) fn unsupported(format: &'static str, what: impl Into<String>) -> ImageFault {
        ImageFault::Unsupported { format, what: what.into() }
    }
}

/// Longest file taken, and most bytes a decoded picture may hold.
const MAX_BYTES: u64 = 1 << 32;

/// How many times larger than its file a picture may be. Deflate shrinks at most 1032 times, JPEG needs a bit per
/// block, which comes to 1365 times, and the pixels of all the formats at most triple when decoded.
const MAX_EXPANSION: u64 = 1 << 12;

/// Reads a picture. Eight-bit files stay eight-bit; everything else becomes linear floats, row 0 at the top.
///
/// Grey stays one channel; grey with alpha becomes four. Of an EXR file the nameless layer is taken if it has colours,
/// else the first layer that has.
///
/// # Errors
/// [`ImageError`], with the file's name, for anything that is not a sound picture of a known format.
pub fn read_image(path: &Path, encoding: Encoding) -> Result<Image, ImageError> {
    let is_tga = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"));
    read_file(path)
        .and_then(|bytes| decode(&bytes, is_tga, encoding))
        .map_err(|fault| ImageError { path: path.to_owned(), fault })
}

pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, ImageFault> {
    Ok(read_regular(path, MAX_BYTES)?)
}

/// Decodes a picture held in memory; `is_tga` says what to make of bytes that no other format claims.
///
/// # Errors
/// [`ImageFault`] for anything that is not a sound picture of a known format.
pub fn decode(bytes: &[u8], is_tga: bool, encoding: Encoding) -> Result<Image, ImageFault> {
    // A decoder that panics has a bug of its own; whoever has a damaged file should still get an error that names it.
    let decoded = std::panic::catch_unwind(|| decode_by_magic(bytes, is_tga, encoding));
    decoded.unwrap_or_else(|_| Err(ImageFault::damaged("image", "its decoder gave up")))
}

fn decode_by_magic(bytes: &[u8], is_tga: bool, encoding: Encoding) -> Result<Image, ImageFault> {
    let is = |magic: &[u8]| bytes.starts_with(magic);
    if is(b"\x89PNG") {
        decode_common(bytes, ImageFormat::Png, "PNG", encoding)
    } else if is(b"\xff\xd8") {
        if !jpeg_is_complete(bytes) {
            return Err(ImageFault::damaged("JPEG", "the file ends before the picture does"));
        }
        decode_common(bytes, ImageFormat::Jpeg, "JPEG", encoding)
    } else if is(b"BM") {
        decode_common(bytes, ImageFormat::Bmp, "BMP", encoding)
    } else if is(b"RIFF") && bytes.get(8..12) == Some(b"WEBP".as_slice()) {
        decode_common(bytes, ImageFormat::WebP, "WebP", encoding)
    } else if is(b"#?") {
        decode_common(bytes, ImageFormat::Hdr, "HDR", encoding)
    } else if is(b"\x76\x2f\x31\x01") {
        Ok(transfer_floats(exr_in::decode(bytes)?, encoding == Encoding::Srgb))
    } else if is(b"PF") || is(b"Pf") {
        Ok(transfer_floats(netpbm::decode_pfm(bytes)?, encoding == Encoding::Srgb))
    } else if bytes.len() > 2 && bytes[0] == b'P' && bytes[1].is_ascii_digit() {
        netpbm::decode_pnm(bytes, encoding)
    } else if is_tga {
        decode_common(bytes, ImageFormat::Tga, "TGA", encoding)
    } else {
        Err(ImageFault::UnknownFormat)
    }
}

/// Formats of the `image` crate.
fn decode_common(
    bytes: &[u8],
    format: ImageFormat,
    name: &'static str,
    encoding: Encoding,
) -> Result<Image, ImageFault> {
    use image::ImageDecoder;
    let fault = |e: image::ImageError| match e {
        image::ImageError::Unsupported(e) => ImageFault::unsupported(name, e.to_string()),
        e => ImageFault::damaged(name, e.to_string()),
    };
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(2 * MAX_BYTES);
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(fault)?;
    let (width, height) = decoder.dimensions();
    let pixel_bytes = u64::from(decoder.color_type().bytes_per_pixel());
    check_size(width.into(), height.into(), pixel_bytes, bytes.len() as u64)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(fault)?;

    let srgb = encoding != Encoding::Linear;
    let eight = |v: Vec<u8>| if srgb { Pixels::Srgb8(v) } else { Pixels::Linear8(v) };
    let floats = |v: Vec<u16>| Pixels::F32(v.into_iter().map(|x| f32::from(x) / 65535.0).collect());
    let sixteen = |channels, v| transfer_floats(Image { width, height, channels, pixels: floats(v) }, srgb);
    let image = |channels, pixels| Image { width, height, channels, pixels };
    Ok(match picture {
        DynamicImage::ImageLuma8(p) => image(1, eight(p.into_raw())),
        DynamicImage::ImageRgb8(p) => image(3, eight(p.into_raw())),
        DynamicImage::ImageRgba8(p) => image(4, eight(p.into_raw())),
        p @ DynamicImage::ImageLumaA8(_) => image(4, eight(p.into_rgba8().into_raw())),
        DynamicImage::ImageLuma16(p) => sixteen(1, p.into_raw()),
        DynamicImage::ImageRgb16(p) => sixteen(3, p.into_raw()),
        DynamicImage::ImageRgba16(p) => sixteen(4, p.into_raw()),
        p @ DynamicImage::ImageLumaA16(_) => sixteen(4, p.into_rgba16().into_raw()),
        p @ DynamicImage::ImageRgb32F(_) => {
            transfer_floats(image(3, Pixels::F32(p.into_rgb32f().into_raw())), encoding == Encoding::Srgb)
        }
        p => transfer_floats(image(4, Pixels::F32(p.into_rgba32f().into_raw())), encoding == Encoding::Srgb),
    })
}

/// Refuses empty pictures and sizes that the program or a file of this length cannot hold.
pub(super) fn check_size(width: u64, height: u64, bytes_per_pixel: u64, file_bytes: u64) -> Result<(), ImageFault> {
    let too_large = ImageFault::TooLarge { width, height };
    let Some(bytes) = width.checked_mul(height).and_then(|n| n.checked_mul(bytes_per_pixel)) else {
        return Err(too_large);
    };
    let bound = file_bytes.saturating_add(256).saturating_mul(MAX_EXPANSION).min(MAX_BYTES);
    if bytes > bound || width.max(height) > u64::from(u32::MAX >> 1) {
        return Err(too_large);
    }
    if bytes == 0 {
        return Err(ImageFault::damaged("image", "it has no pixels"));
    }
    Ok(())
}

/// Applies the sRGB transfer to float values, except alpha.
pub(super) fn transfer_floats(mut image: Image, srgb: bool) -> Image {
    if let (true, Pixels::F32(values)) = (srgb, &mut image.pixels) {
        for pixel in values.chunks_exact_mut(image.channels as usize) {
            for value in pixel.iter_mut().take(3) {
                *value = srgb_to_linear(f64::from(*value)) as f32;
            }
        }
    }
    image
}

/// True if an end marker follows the first scan. The decoder fills what is missing with grey, silently.
fn jpeg_is_complete(bytes: &[u8]) -> bool {
    // Segments are skipped by their length, since a thumbnail inside one has an end marker of its own.
    let mut at = 2;
    while let Some(&[0xff, marker]) = bytes.get(at..at + 2) {
        match marker {
            0xff => at += 1,
            0x01 | 0xd0..=0xd8 => at += 2,
            _ => {
                let Some(&[high, low]) = bytes.get(at + 2..at + 4) else { return false };
                at += 2 + usize::from(u16::from_be_bytes([high, low]));
                if marker == 0xda {
                    // Inside entropy-coded data a byte FF is always followed by 00 or a restart marker.
                    return bytes.get(at..).is_some_and(|rest| rest.windows(2).any(|w| w == [0xff, 0xd9]));
                }
            }
        }
    }
    false
}
