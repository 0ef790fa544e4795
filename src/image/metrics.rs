//! How far a picture is from its reference: one number per measure, all in f64.

use super::buffer::Image;
use super::flip;
use super::regions::{RegionErrors, region_errors};

/// The measures that [`compare`] takes. d is the difference of a channel, r its reference; means go over channels and
/// pixels. A measure without a value (no finite pixel, or a black reference for the ratio) is NaN.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Report {
    /// Mean of d².
    pub mse: f64,
    /// Square root of the mean of d².
    pub rmse: f64,
    /// Mean of |d|.
    pub mae: f64,
    /// Mean of |d| / (r + 0.01).
    pub mape: f64,
    /// Mean of d² / (r² + 0.01).
    pub relmse: f64,
    /// relMSE without the worst 0.1 % of the pixels (rounded down), so that a few fireflies do not decide.
    pub relmse_trimmed: f64,
    /// relMSE of means of regions.
    #[serde(flatten)]
    pub regions: RegionErrors,
    /// Mean LDR-ꟻLIP of the pictures clipped to [0, 1]; see [`flip::ldr_flip`].
    pub flip: f64,
    /// Mean HDR-ꟻLIP; see [`flip::hdr_flip`].
    pub hdr_flip: f64,
    /// Mean of the picture over mean of the reference.
    pub mean_ratio: f64,
    /// Pixels that are NaN or infinite in either picture; every measure leaves them out.
    pub non_finite: u64,
}

/// The pictures cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the sizes differ: {} x {} against {} x {} pixels", image.0, image.1, reference.0, reference.1)]
pub struct SizeMismatch {
    /// Width and height of the picture.
    pub image: (u32, u32),
    /// Width and height of the reference.
    pub reference: (u32, u32),
}

/// The part of a [`Report`] that needs no filters; cheap enough for every iteration of a render.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PictureErrors {
    /// See [`Report::mse`].
    pub mse: f64,
    /// See [`Report::mae`].
    pub mae: f64,
    /// See [`Report::mape`].
    pub mape: f64,
    /// See [`Report::relmse`].
    pub relmse: f64,
    /// See [`Report::relmse_trimmed`].
    pub relmse_trimmed: f64,
    /// See [`Report::regions`].
    #[serde(flatten)]
    pub regions: RegionErrors,
    /// See [`Report::mean_ratio`].
    pub mean_ratio: f64,
    /// See [`Report::non_finite`].
    pub non_finite: u64,
}

/// Keeps MAPE and relMSE finite where the reference is black.
pub(super) const FLOOR: f64 = 0.01;

/// One pixel in this many is left out of the trimmed relMSE.
const TRIM: usize = 1000;

/// Compares a picture with its reference, by colour (grey counts as three equal channels, alpha does not count).
///
/// # Errors
/// [`SizeMismatch`].
pub fn compare(image: &Image, reference: &Image) -> Result<Report, SizeMismatch> {
    let (image, reference, width) = colours(image, reference)?;
    let e = picture_errors(&image, &reference, width);

    // Equal black in both pictures keeps a non-finite pixel from spreading through ꟻLIP's filters.
    let sound: Vec<bool> = image.iter().zip(&reference).map(|(a, b)| is_finite(a) && is_finite(b)).collect();
    let patched = |pixels: Vec<[f64; 3]>| -> Vec<[f64; 3]> {
        pixels.into_iter().zip(&sound).map(|(p, &sound)| if sound { p } else { [0.0; 3] }).collect()
    };
    let (image, reference) = (patched(image), patched(reference));
    let mean = |map: flip::FlipMap| {
        let kept = map.values.iter().zip(&sound).filter(|(_, sound)| **sound);
        kept.map(|(v, _)| v).sum::<f64>() / sound.iter().filter(|s| **s).count() as f64
    };
    Ok(Report {
        mse: e.mse,
        rmse: e.mse.sqrt(),
        mae: e.mae,
        mape: e.mape,
        relmse: e.relmse,
        relmse_trimmed: e.relmse_trimmed,
        regions: e.regions,
        flip: mean(flip::ldr_flip(&image, &reference, width)),
        hdr_flip: mean(flip::hdr_flip(&image, &reference, width)),
        mean_ratio: e.mean_ratio,
        non_finite: e.non_finite,
    })
}

/// Pixels in linear colour.
pub type Colours = Vec<[f64; 3]>;

/// Linear colours of both pictures, row by row, and their width.
///
/// # Errors
/// [`SizeMismatch`].
pub fn colours(image: &Image, reference: &Image) -> Result<(Colours, Colours, usize), SizeMismatch> {
    let size = |i: &Image| (i.width, i.height);
    if size(image) != size(reference) {
        return Err(SizeMismatch { image: size(image), reference: size(reference) });
    }
    let all = |i: &Image| {
        let row = |y| (0..i.width).map(move |x| i.rgb(x, y).to_array().map(f64::from));
        (0..i.height).flat_map(row).collect()
    };
    Ok((all(image), all(reference), image.width as usize))
}

pub(super) fn is_finite(pixel: &[f64; 3]) -> bool {
    pixel.iter().all(|v| v.is_finite())
}

/// The measures that need no filters, of pictures in linear colour whose rows have `width` pixels.
///
/// # Panics
/// If the pictures do not have equally many pixels.
pub fn picture_errors(image: &[[f64; 3]], reference: &[[f64; 3]], width: usize) -> PictureErrors {
    assert_eq!(image.len(), reference.len());
    let (mut squares, mut absolutes, mut percentages) = (0.0, 0.0, 0.0);
    let (mut image_sum, mut reference_sum) = (0.0, 0.0);
    let mut relative = Vec::with_capacity(image.len());
    for (a, b) in image.iter().zip(reference).filter(|(a, b)| is_finite(a) && is_finite(b)) {
        let mut of_pixel = 0.0;
        for (a, b) in a.iter().zip(b) {
            let d = a - b;
            squares += d * d;
            absolutes += d.abs();
            percentages += d.abs() / (b + FLOOR);
            of_pixel += d * d / (b * b + FLOOR);
            image_sum += a;
            reference_sum += b;
        }
        relative.push(of_pixel);
    }
    let pixels = relative.len();
    let samples = 3.0 * pixels as f64;
    relative.sort_by(f64::total_cmp);
    let kept = &relative[..pixels - pixels / TRIM];
    PictureErrors {
        mse: squares / samples,
        mae: absolutes / samples,
        mape: percentages / samples,
        relmse: relative.iter().sum::<f64>() / samples,
        relmse_trimmed: kept.iter().sum::<f64>() / (3.0 * kept.len() as f64),
        regions: region_errors(image, reference, width),
        mean_ratio: image_sum / reference_sum,
        non_finite: (image.len() - pixels) as u64,
    }
}
