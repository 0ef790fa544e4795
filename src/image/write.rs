//! Rendered pictures out of memory: EXR (all layers and metadata), PFM (the main layer) and PNG (the main layer, for
//! eyes).

use super::atomic::atomic_write;
use super::buffer::linear_to_srgb;
use super::exr_out;
use std::io;
use std::path::{Path, PathBuf};

/// Some channels that belong together.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Empty for the main picture, else what stands before the dot in an EXR channel (`albedo` of `albedo.R`).
    pub name: String,
    /// Name (`R`, `X`, …) and linear values, row by row from the top, of each channel.
    pub channels: Vec<(&'static str, Vec<f32>)>,
}

/// A picture to be written: a main layer of `R`, `G`, `B` (or one channel, for grey) and any others.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The main layer (nameless) and others, in any order.
    pub layers: Vec<Layer>,
    /// Names and values for the header of an EXR file; other formats have no place for them.
    pub metadata: Vec<(String, String)>,
}

/// A kind of picture file that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputFormat {
    /// OpenEXR: all layers, 32-bit floats, lossless.
    Exr,
    /// Portable float map: the main layer, 32-bit floats.
    Pfm,
    /// Eight bits, sRGB, clipped after exposure: the main layer.
    Png,
}

/// A picture that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The ending says nothing known.
    #[error("{}: the ending does not name a known format (known: .exr, .pfm, .png)", .0.display())]
    UnknownEnding(PathBuf),
    /// The file system refused.
    #[error("{}: cannot be written: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The picture contradicts itself or the format.
    #[error("{}: {reason}", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
}

impl OutputFormat {
    /// The format that a file's ending names, so that a bad one is found before hours of rendering.
    ///
    /// # Errors
    /// [`WriteError::UnknownEnding`].
    pub fn of(path: &Path) -> Result<OutputFormat, WriteError> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match ending.as_str() {
            "exr" => Ok(OutputFormat::Exr),
            "pfm" => Ok(OutputFormat::Pfm),
            "png" => Ok(OutputFormat::Png),
            _ => Err(WriteError::UnknownEnding(path.to_owned())),
        }
    }
}

/// Writes `picture` in the format that the ending names, atomically. `exposure`, in stops, brightens PNG only.
///
/// The bytes depend on the picture alone, so that equal renders give equal files.
///
/// # Errors
/// [`WriteError`]; a file that was there before is then as it was.
pub fn write_picture(path: &Path, picture: &Picture, exposure: f32) -> Result<(), WriteError> {
    let format = OutputFormat::of(path)?;
    let bytes = encode_picture(picture, format, exposure)
        .map_err(|reason| WriteError::Picture { path: path.to_owned(), reason })?;
    atomic_write(path, |w| w.write_all(&bytes)).map_err(|source| WriteError::Io { path: path.to_owned(), source })
}

fn encode_picture(picture: &Picture, format: OutputFormat, exposure: f32) -> Result<Vec<u8>, String> {
    check(picture)?;
    match format {
        OutputFormat::Exr => exr_out::encode(picture),
        OutputFormat::Pfm => Ok(encode_pfm(picture, &main_channels(picture)?)),
        OutputFormat::Png => encode_png(picture, &main_channels(picture)?, exposure),
    }
}

fn check(picture: &Picture) -> Result<(), String> {
    let pixels = picture.width as usize * picture.height as usize;
    if pixels == 0 {
        return Err("the picture has no pixels".into());
    }
    for layer in &picture.layers {
        for (name, values) in &layer.channels {
            if values.len() != pixels {
                let layer = &layer.name;
                return Err(format!("channel {name} of layer \"{layer}\" has {} of {pixels} pixels", values.len()));
            }
        }
    }
    Ok(())
}

/// Red, green and blue, or a lone channel, of the nameless layer.
fn main_channels(picture: &Picture) -> Result<Vec<&[f32]>, String> {
    let main = picture.layers.iter().find(|l| l.name.is_empty()).ok_or("the picture has no main layer")?;
    let find = |wanted: &str| main.channels.iter().find(|(name, _)| *name == wanted).map(|(_, v)| v.as_slice());
    let colours: Option<Vec<&[f32]>> = ["R", "G", "B"].into_iter().map(find).collect();
    match (colours, main.channels.as_slice()) {
        (Some(colours), _) => Ok(colours),
        (None, [(_, grey)]) => Ok(vec![grey]),
        _ => Err("the main layer has neither R, G and B nor one lone channel".into()),
    }
}

fn encode_pfm(picture: &Picture, channels: &[&[f32]]) -> Vec<u8> {
    let kind = if channels.len() == 3 { "PF" } else { "Pf" };
    // A negative scale announces little-endian.
    let mut out = format!("{kind}\n{} {}\n-1.0\n", picture.width, picture.height).into_bytes();
    let width = picture.width as usize;
    for y in (0..picture.height as usize).rev() {
        for i in y * width..(y + 1) * width {
            for channel in channels {
                out.extend_from_slice(&channel[i].to_le_bytes());
            }
        }
    }
    out
}

fn encode_png(picture: &Picture, channels: &[&[f32]], exposure: f32) -> Result<Vec<u8>, String> {
    use image::ImageEncoder;
    let gain = f64::from(exposure).exp2();
    let pixels = picture.width as usize * picture.height as usize;
    let mut bytes = Vec::with_capacity(pixels * channels.len());
    for i in 0..pixels {
        for channel in channels {
            bytes.push(to_srgb8(f64::from(channel[i]) * gain));
        }
    }
    let colour = if channels.len() == 3 { image::ExtendedColorType::Rgb8 } else { image::ExtendedColorType::L8 };
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(&bytes, picture.width, picture.height, colour)
        .map_err(|e| e.to_string())?;
    Ok(out)
}

/// Nearest eight-bit sRGB code of a linear value; NaN and negative values become black.
fn to_srgb8(linear: f64) -> u8 {
    // The conversion to an integer saturates and takes NaN to 0.
    (linear_to_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}
