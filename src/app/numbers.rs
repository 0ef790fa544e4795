//! Numbers as people write them.

/// Significant digits.
const DIGITS: i32 = 5;

/// A number with five significant digits: plain from 0.0001 to 99999, with a power of ten beyond.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    // The exponent is that of the rounded number, so that 9.99999 is 10.000.
    let scientific = format!("{value:.*e}", (DIGITS - 1) as usize);
    let exponent = scientific.split_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
    if (-4..DIGITS).contains(&exponent) { format!("{value:.*}", (DIGITS - 1 - exponent) as usize) } else { scientific }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_numbers_have_no_power_of_ten() {
        for (value, text) in [
            (0.0, "0"),
            (1.019185, "1.0192"),
            (-0.5, "-0.50000"),
            (9.999_999, "10.000"),
            (12_345.6, "12346"),
            (0.000_123_456, "0.00012346"),
            (0.000_012_345_6, "1.2346e-5"),
            (123_456.0, "1.2346e5"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
