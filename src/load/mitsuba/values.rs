//! Numbers and lists of numbers as they stand in attributes.

use glam::DVec3;

/// A number.
pub(super) fn number(text: &str) -> Result<f64, String> {
    let trimmed = text.trim();
    match trimmed.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        Ok(_) => Err(format!("`{trimmed}` is not finite")),
        Err(_) => Err(format!("`{trimmed}` is not a number")),
    }
}

/// Numbers separated by commas or blanks.
pub(super) fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty()).map(number).collect()
}

/// Three numbers.
pub(super) fn triple(text: &str) -> Result<DVec3, String> {
    match numbers(text)?.as_slice() {
        &[x, y, z] => Ok(DVec3::new(x, y, z)),
        other => Err(format!("expected three numbers, found {}", other.len())),
    }
}
