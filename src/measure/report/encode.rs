//! Bytes for a page: pixels in four bytes, errors in one, both as base64.

use crate::image::error_image::scale_position;

/// A colour in 32 bits: three mantissas of nine bits and a shared exponent of five (as `GL_RGB9_E5`; largest value
/// 65408, steps of at most 1/256 of the largest channel). Negative values become zero, and pixels that are not finite
/// the brightest magenta.
pub fn shared_exponent(pixel: [f64; 3]) -> u32 {
    const BIAS: i32 = 15;
    const MANTISSA: i32 = 9;
    const LARGEST: f64 = 65408.0;
    if !pixel.iter().all(|v| v.is_finite()) {
        return shared_exponent([LARGEST, 0.0, LARGEST]);
    }
    let c = pixel.map(|v| v.clamp(0.0, LARGEST));
    let largest = c[0].max(c[1]).max(c[2]);
    let floor = if largest > 0.0 { largest.log2().floor() as i32 } else { -BIAS - 1 };
    let mut exponent = floor.max(-BIAS - 1) + 1 + BIAS;
    let unit = |exponent: i32| f64::from(exponent - BIAS - MANTISSA).exp2();
    if (largest / unit(exponent)).round() >= f64::from(1 << MANTISSA) {
        exponent += 1;
    }
    let m = c.map(|v| (v / unit(exponent)).round() as u32);
    m[0] | m[1] << 9 | m[2] << 18 | (exponent as u32) << 27
}

/// Its inverse, which the page does in JavaScript.
pub fn from_shared_exponent(bits: u32) -> [f64; 3] {
    let unit = f64::from((bits >> 27) as i32 - 24).exp2();
    [bits & 511, bits >> 9 & 511, bits >> 18 & 511].map(|m| f64::from(m) * unit)
}

/// Pixels for the page.
pub fn pixels(pixels: &[[f64; 3]]) -> String {
    base64(&pixels.iter().flat_map(|p| shared_exponent(*p).to_le_bytes()).collect::<Vec<u8>>())
}

/// Errors for the page, as places on the colour scale: 0 … 254, and 255 for what is not finite.
pub fn errors(errors: impl Iterator<Item = f64>) -> String {
    let code = |e: f64| if e.is_finite() { (scale_position(e) * 254.0).round() as u8 } else { 255 };
    base64(&errors.map(code).collect::<Vec<u8>>())
}

/// RFC 4648.
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i)) as usize & 63];
            out.push(if i > chunk.len() { '=' } else { char::from(digit) });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_the_standards() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn colours_survive() {
        let mut x = 1e-4;
        while x < 6e4 {
            let pixel = [x, 0.37 * x, 0.0];
            for (a, b) in from_shared_exponent(shared_exponent(pixel)).into_iter().zip(pixel) {
                assert!((a - b).abs() <= x / 500.0, "{a} {b}");
            }
            x *= 1.0137;
        }
        assert_eq!(from_shared_exponent(shared_exponent([0.0; 3])), [0.0; 3]);
        assert_eq!(from_shared_exponent(shared_exponent([1.0, 0.5, 1e9])), [0.0, 0.0, 65408.0]);
        assert_eq!(from_shared_exponent(shared_exponent([-1.0, 0.25, 1.0])), [0.0, 0.25, 1.0]);
        assert_eq!(from_shared_exponent(shared_exponent([f64::NAN, 1.0, 1.0])), [65408.0, 0.0, 65408.0]);
    }
}
