//! Pictures of errors: where is a picture wrong, and by how much?

use crate::math::Rgb;

/// How an error becomes a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorView {
    /// d² / (r² + 0.01), mean of the channels, on a logarithmic scale of colours from [`DECADES`].
    Relative,
    /// d / (r + 0.01): too bright is red, too dark is blue, right is white; full colour at ±1.
    Signed,
}

/// Exponents of ten at the two ends of the colour scale.
pub const DECADES: [f64; 2] = [-5.0, 1.0];

/// The scale's colours from small to large errors: black, blue, magenta, orange, yellow, white, each lighter than the
/// one before.
const SCALE: [[f64; 3]; 6] =
    [[0.0, 0.0, 0.0], [0.05, 0.03, 0.35], [0.45, 0.02, 0.4], [0.9, 0.2, 0.1], [0.98, 0.75, 0.1], [1.0, 1.0, 0.95]];

/// Relative squared error of a pixel, mean of its channels.
pub fn relative_error(image: &[f64; 3], reference: &[f64; 3]) -> f64 {
    image.iter().zip(reference).map(|(a, b)| (a - b) * (a - b) / (b * b + 0.01)).sum::<f64>() / 3.0
}

/// Place of an error on the colour scale, 0 … 1.
pub fn scale_position(error: f64) -> f64 {
    let [lo, hi] = DECADES;
    if error > 0.0 { ((error.log10() - lo) / (hi - lo)).clamp(0.0, 1.0) } else { 0.0 }
}

/// Colour (linear) of a place on the scale.
pub fn scale_colour(position: f64) -> Rgb {
    let at = position.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let i = (at as usize).min(SCALE.len() - 2);
    let t = at - i as f64;
    Rgb::from(std::array::from_fn::<f32, 3, _>(|c| {
        // Blended as the eye sees them, then made linear.
        let v = SCALE[i][c] * (1.0 - t) + SCALE[i + 1][c] * t;
        super::buffer::srgb_to_linear(v) as f32
    }))
}

/// The picture of the errors, linear; pixels that are not finite are green.
///
/// # Panics
/// If the pictures do not have equally many pixels.
pub fn error_image(image: &[[f64; 3]], reference: &[[f64; 3]], view: ErrorView) -> Vec<Rgb> {
    assert_eq!(image.len(), reference.len());
    let colour = |(a, b): (&[f64; 3], &[f64; 3])| {
        if !a.iter().chain(b).all(|v| v.is_finite()) {
            return Rgb::new(0.0, 1.0, 0.0);
        }
        match view {
            ErrorView::Relative => scale_colour(scale_position(relative_error(a, b))),
            ErrorView::Signed => {
                let signed = a.iter().zip(b).map(|(a, b)| (a - b) / (b + 0.01)).sum::<f64>() / 3.0;
                let rest = (1.0 - signed.abs()).clamp(0.0, 1.0) as f32;
                if signed > 0.0 { Rgb::new(1.0, rest, rest) } else { Rgb::new(rest, rest, 1.0) }
            }
        }
    };
    image.iter().zip(reference).map(colour).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_errors_are_lighter() {
        let light = |e: f64| scale_colour(scale_position(e)).luminance();
        let errors = [0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0];
        assert!(errors.windows(2).all(|e| light(e[0]) < light(e[1])));
        assert_eq!(light(1e-9), light(0.0));
    }

    #[test]
    fn signs_have_their_colours() {
        let grey = [[1.0; 3]; 4];
        let image = [[1.0; 3], [1.5; 3], [0.2; 3], [f64::NAN; 3]];
        let found = error_image(&image, &grey, ErrorView::Signed);
        assert_eq!(found[0], Rgb::WHITE);
        assert!(found[1].r > found[1].b && found[2].b > found[2].r);
        assert_eq!(found[3], Rgb::new(0.0, 1.0, 0.0));
    }
}
