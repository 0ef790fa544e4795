//! Densities that carry their measure in the type, so that adding a solid-angle density to an area density does not
//! compile.
//!
//! The only conversions are [`SolidAnglePdf::to_area`] and [`AreaPdf::to_solid_angle`], and [`area_jacobian`] where one
//! factor serves several densities (Veach 1997, eq. 8.8: p_A(x') = p_σ(ω) |cos θ'| / d²).
//!
//! ```
//! use lightsieve::math::{Pmf, SolidAnglePdf};
//!
//! // A direction, drawn with a density of 0.5 per steradian by a strategy that is taken half of the time, meets a surface at a distance
//! // of 2 at 60 degrees to its normal.
//! let direction = SolidAnglePdf(0.5) * Pmf(0.5);
//! let position = direction.to_area(0.5, 4.0);
//! assert_eq!(position.0, 0.5 * 0.5 * 0.5 / 4.0);
//! assert_eq!(position.to_solid_angle(0.5, 4.0), direction);
//! ```

/// Density per steradian.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct SolidAnglePdf(pub f32);

/// Density per unit area of a surface. For a vertex at infinity it is, by convention, the density per steradian of its
/// direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct AreaPdf(pub f32);

/// Probability of one of finitely many choices.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct Pmf(pub f32);

/// dσ/dA = |cos θ'| / d²: the factor from a density per steradian to one per unit area at the far point, whose normal
/// makes `cos` with the direction; `dist2` is the squared distance in scene units.
#[inline]
pub fn area_jacobian(cos: f32, dist2: f32) -> f32 {
    cos.abs() / dist2
}

impl SolidAnglePdf {
    /// Density at the surface point a distance √`dist2` away whose normal makes `cos` with the direction.
    pub fn to_area(self, cos: f32, dist2: f32) -> AreaPdf {
        AreaPdf(self.0 * cos.abs() / dist2)
    }
}

impl AreaPdf {
    /// Density per steradian as seen from a distance √`dist2`; infinite when the surface is seen edge-on.
    pub fn to_solid_angle(self, cos: f32, dist2: f32) -> SolidAnglePdf {
        SolidAnglePdf(self.0 * dist2 / cos.abs())
    }
}

impl std::ops::Mul<Pmf> for AreaPdf {
    type Output = AreaPdf;
    fn mul(self, p: Pmf) -> AreaPdf {
        AreaPdf(self.0 * p.0)
    }
}

impl std::ops::Mul<Pmf> for SolidAnglePdf {
    type Output = SolidAnglePdf;
    fn mul(self, p: Pmf) -> SolidAnglePdf {
        SolidAnglePdf(self.0 * p.0)
    }
}

impl std::ops::Mul for Pmf {
    type Output = Pmf;
    fn mul(self, p: Pmf) -> Pmf {
        Pmf(self.0 * p.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conversions_are_inverse() {
        let p = SolidAnglePdf(0.7);
        let back = p.to_area(-0.3, 4.0).to_solid_angle(0.3, 4.0);
        assert!((back.0 - p.0).abs() < 1e-6);
    }
}
