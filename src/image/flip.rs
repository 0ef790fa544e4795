//! ꟻLIP: how different two pictures look to somebody who flips between them, 0 (equal) to 1 per pixel.
//!
//! LDR-ꟻLIP: Andersson et al., "ꟻLIP: A Difference Evaluator for Alternating Images", HPG 2020. HDR-ꟻLIP: Andersson et
//! al., "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics Short Papers 2021: the largest
//! LDR-ꟻLIP over a range of exposures.

use rayon::prelude::*;
use std::f64::consts::PI;

/// Linear Rec. 709 colour.
type Colour = [f64; 3];

/// Pixels per degree of the papers' default viewer: 0.7 m from a display 0.7 m wide with 3840 pixels in a row.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Exponent of the colour difference, and the knee (p_c, p_t) of its remapping.
const Q_C: f64 = 0.7;
const P_C: f64 = 0.4;
const P_T: f64 = 0.95;
/// Width of the feature detectors in degrees, and exponent of the feature difference.
const FEATURE_WIDTH: f64 = 0.082;
const Q_F: f64 = 0.5;

/// Contrast sensitivity as sums of Gaussians: weights a and widths b of the achromatic, red-green and blue-yellow
/// channels.
const SENSITIVITY: [[(f64, f64); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// A map of per-pixel differences, row by row from the top.
pub struct FlipMap {
    /// Differences, each in [0, 1].
    pub values: Vec<f64>,
}

/// LDR-ꟻLIP of two pictures in linear Rec. 709 colour, as a display of sRGB shows them: values are clipped to [0, 1].
///
/// # Panics
/// If the pictures do not both have `width` times a whole number of rows.
pub fn ldr_flip(image: &[Colour], reference: &[Colour], width: usize) -> FlipMap {
    assert!(image.len() == reference.len() && image.len().is_multiple_of(width));
    let clip = |pixels: &[Colour]| pixels.iter().map(|p| p.map(clip)).collect();
    FlipMap { values: differences(clip(image), clip(reference), width) }
}

/// HDR-ꟻLIP of two pictures in linear Rec. 709 colour, tone mapped with the ACES curve; negative values count as 0.
///
/// # Panics
/// If the pictures do not both have `width` times a whole number of rows.
pub fn hdr_flip(image: &[Colour], reference: &[Colour], width: usize) -> FlipMap {
    assert!(image.len() == reference.len() && image.len().is_multiple_of(width));
    let mut worst = vec![0.0_f64; image.len()];
    for exposure in exposures(reference) {
        let gain = exposure.exp2();
        let expose = |pixels: &[Colour]| pixels.iter().map(|p| p.map(|v| clip(aces(v.max(0.0) * gain)))).collect();
        let found = differences(expose(image), expose(reference), width);
        worst.iter_mut().zip(found).for_each(|(worst, found)| *worst = worst.max(found));
    }
    FlipMap { values: worst }
}

fn clip(v: f64) -> f64 {
    v.clamp(0.0, 1.0)
}

/// Coefficients of Narkowicz's fit of the ACES curve, (k0 x² + k1 x + k2) / (k3 x² + k4 x + k5), with its exposure
/// factor 0.6 multiplied in (2021 paper).
const ACES: [f64; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

fn aces(x: f64) -> f64 {
    let [k0, k1, k2, k3, k4, k5] = ACES;
    // Both polynomials are divided by x² where x² would overflow or lose the constants anyway.
    if x > 1e8 { k0 / k3 } else { ((k0 * x + k1) * x + k2) / ((k3 * x + k4) * x + k5) }
}

/// Exposures in stops that bring the reference's brightest and its median luminance to 85 % of the tone mapper's range,
/// and steps of at most one stop between them (2021 paper).
fn exposures(reference: &[Colour]) -> Vec<f64> {
    const TARGET: f64 = 0.85;
    let [k0, k1, k2, k3, k4, k5] = ACES;
    let (a, b, c) = (k0 - TARGET * k3, k1 - TARGET * k4, k2 - TARGET * k5);
    let bright = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);

    let mut luminances: Vec<f64> = reference.iter().map(|p| to_xyz(p.map(|v| v.max(0.0)))[1]).collect();
    luminances.sort_by(f64::total_cmp);
    let Some(&largest) = luminances.last() else { return Vec::new() };
    let n = luminances.len();
    let median = 0.5 * (luminances[(n - 1) / 2] + luminances[n / 2]);
    // A reference that is black, or half black, has no exposure of its own: the smallest luminance stands in.
    const DARKEST: f64 = 1e-5;
    let start = (bright / largest.max(DARKEST)).log2();
    let stop = (bright / median.max(DARKEST)).log2();
    let count = (stop - start).ceil().max(2.0);
    (0..count as usize).map(|i| start + (stop - start) * i as f64 / (count - 1.0)).collect()
}

/// LDR-ꟻLIP of pictures within [0, 1].
fn differences(image: Vec<Colour>, reference: Vec<Colour>, width: usize) -> Vec<f64> {
    let seen = |pixels: Vec<Colour>| {
        let opponent: Vec<Colour> = pixels.into_par_iter().map(|p| to_ycxcz(to_xyz(p))).collect();
        (perceived(&opponent, width), features(&opponent, width))
    };
    let ((colour_a, feature_a), (colour_b, feature_b)) = (seen(image), seen(reference));

    let largest = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(Q_C);
    let difference = |i: usize| {
        let colour = remap(hyab(colour_a[i], colour_b[i]).powf(Q_C), largest);
        let edge = (feature_a[i].edge - feature_b[i].edge).abs();
        let point = (feature_a[i].point - feature_b[i].point).abs();
        let feature = (edge.max(point) * std::f64::consts::FRAC_1_SQRT_2).powf(Q_F);
        colour.powf(1.0 - feature)
    };
    (0..colour_a.len()).into_par_iter().map(difference).collect()
}

/// Two linear pieces: small differences take up [0, p_t], large ones the rest.
fn remap(difference: f64, largest: f64) -> f64 {
    let knee = P_C * largest;
    if difference < knee { P_T / knee * difference } else { P_T + (difference - knee) / (largest - knee) * (1.0 - P_T) }
}

/// The picture as far as the eye resolves it, in Hunt-adjusted L*a*b*.
fn perceived(opponent: &[Colour], width: usize) -> Vec<Colour> {
    let widest = SENSITIVITY.iter().flatten().map(|&(_, b)| b).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i64;
    let channels: Vec<Vec<f64>> = (0..3)
        .map(|c| {
            let plane: Vec<f64> = opponent.iter().map(|p| p[c]).collect();
            // Each Gaussian is separable; their sum is not, but convolution is linear.
            let mut sum = vec![0.0; plane.len()];
            let mut total = 0.0;
            for (a, b) in SENSITIVITY[c].into_iter().filter(|&(a, _)| a > 0.0) {
                let kernel: Vec<f64> =
                    (-radius..=radius).map(|x| (-(PI * x as f64 / PIXELS_PER_DEGREE).powi(2) / b).exp()).collect();
                let factor = a * (PI / b).sqrt();
                total += factor * kernel.iter().sum::<f64>().powi(2);
                let part = convolve(&plane, width, &kernel, &kernel);
                sum.iter_mut().zip(part).for_each(|(s, p)| *s += factor * p);
            }
            sum.iter_mut().for_each(|s| *s /= total);
            sum
        })
        .collect();
    (0..opponent.len())
        .into_par_iter()
        .map(|i| hunt_lab(from_xyz(from_ycxcz([channels[0][i], channels[1][i], channels[2][i]])).map(clip)))
        .collect()
}

/// Strength of edges and of points at a pixel.
struct Feature {
    edge: f64,
    point: f64,
}

/// Gradient and second derivative of the achromatic channel by Gaussian derivatives.
fn features(opponent: &[Colour], width: usize) -> Vec<Feature> {
    let grey: Vec<f64> = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
    let sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i64;
    let taps = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (-radius..=radius).map(|x| f(x as f64) * (-(x as f64).powi(2) / (2.0 * sigma * sigma)).exp()).collect()
    };
    let mut smooth = taps(&|_| 1.0);
    let total: f64 = smooth.iter().sum();
    smooth.iter_mut().for_each(|w| *w /= total);
    let first = balance(taps(&|x| -x));
    let second = balance(taps(&|x| x * x / (sigma * sigma) - 1.0));

    let magnitude = |derivative: &[f64]| -> Vec<f64> {
        let across = convolve(&grey, width, derivative, &smooth);
        let down = convolve(&grey, width, &smooth, derivative);
        across.into_iter().zip(down).map(|(x, y)| x.hypot(y)).collect()
    };
    magnitude(&first).into_iter().zip(magnitude(&second)).map(|(edge, point)| Feature { edge, point }).collect()
}

/// Scales positive weights to the sum 1 and negative ones to the sum -1.
fn balance(weights: Vec<f64>) -> Vec<f64> {
    let positive: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative: f64 = -weights.iter().filter(|w| **w < 0.0).sum::<f64>();
    weights.into_iter().map(|w| w / if w > 0.0 { positive } else { negative }).collect()
}

/// Correlates with `across` along rows, then with `down` along columns; the border pixels go on outside.
fn convolve(plane: &[f64], width: usize, across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = plane.len() / width;
    let shifted = |i: usize, k: usize, radius: usize, size: usize| (i + k).saturating_sub(radius).min(size - 1);
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        for (x, out) in out.iter_mut().enumerate() {
            let tap = |(k, w): (usize, &f64)| w * row[shifted(x, k, across.len() / 2, width)];
            *out = across.iter().enumerate().map(tap).sum();
        }
    });
    let mut result = vec![0.0; plane.len()];
    result.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (k, w) in down.iter().enumerate() {
            let from = shifted(y, k, down.len() / 2, height) * width;
            out.iter_mut().zip(&rows[from..from + width]).for_each(|(out, v)| *out += w * v);
        }
    });
    result
}

/// Rec. 709 primaries and D65 white as exact fractions: rows X, Y, Z.
const TO_XYZ: [Colour; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

fn to_xyz(rgb: Colour) -> Colour {
    TO_XYZ.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
}

fn from_xyz(xyz: Colour) -> Colour {
    // Cramer's rule: columns of the inverse are cross products of rows.
    let cross =
        |a: Colour, b: Colour| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let [x, y, z] = TO_XYZ;
    let (yz, zx, xy) = (cross(y, z), cross(z, x), cross(x, y));
    let determinant = x[0] * yz[0] + x[1] * yz[1] + x[2] * yz[2];
    std::array::from_fn(|i| (yz[i] * xyz[0] + zx[i] * xyz[1] + xy[i] * xyz[2]) / determinant)
}

fn white() -> Colour {
    to_xyz([1.0; 3])
}

/// Linearised L*a*b*, in which filtering is meaningful.
fn to_ycxcz(xyz: Colour) -> Colour {
    let w = white();
    let [x, y, z] = [xyz[0] / w[0], xyz[1] / w[1], xyz[2] / w[2]];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_ycxcz(c: Colour) -> Colour {
    let w = white();
    let y = (c[0] + 16.0) / 116.0;
    [(y + c[1] / 500.0) * w[0], y * w[1], (y - c[2] / 200.0) * w[2]]
}

/// CIE L*a*b* with a* and b* scaled by lightness, as saturation fades in the dark (Hunt effect).
fn hunt_lab(rgb: Colour) -> Colour {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |t: f64| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let (xyz, w) = (to_xyz(rgb), white());
    let [x, y, z] = [f(xyz[0] / w[0]), f(xyz[1] / w[1]), f(xyz[2] / w[2])];
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// City-block in lightness plus Euclidean in chroma.
fn hyab(a: Colour, b: Colour) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}
