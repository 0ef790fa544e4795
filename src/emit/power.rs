//! Power of surfaces with a radiance from a texture. It weighs the choice of a light, so that it need not be exact, but
//! must not be zero.

use super::triangle::RadianceTexture;
use crate::math::Rgb;

/// Part of its texture's mean that a surface is credited with at least: a grid may miss its bright texels, but the
/// surface must keep a probability.
const FLOOR: f32 = 0.01;

/// Mean radiance of a surface over the middles of a grid of n × n cells of the unit square; `radiance` is that of the
/// surface point which belongs to a point of the square.
pub fn mean_radiance(n: u32, texture: &dyn RadianceTexture, radiance: impl Fn([f32; 2]) -> Rgb) -> Rgb {
    let at = |i: u32| [i % n, i / n].map(|i| (i as f32 + 0.5) / n as f32);
    let sum: Rgb = (0..n * n).map(|i| radiance(at(i))).sum();
    let (mean, floor) = (sum / (n * n) as f32, texture.mean() * FLOOR);
    if mean.luminance() > floor.luminance() { mean } else { floor }
}

/// Luminance of the flux of a diffuse emitter, at least zero and finite.
pub fn diffuse_power(area: f32, mean_radiance: Rgb) -> f32 {
    let power = std::f32::consts::PI * area * mean_radiance.luminance();
    if power.is_finite() { power.max(0.0) } else { 0.0 }
}
