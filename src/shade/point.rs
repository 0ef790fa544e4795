//! A point on a surface with all that shading needs of it.

use crate::math::{Frame, Rgb, Vec2, Vec3};

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position (world, relative to the scene's centre).
    pub p: Vec3,
    /// Bound on the error of any component of `p`.
    pub error: f32,
    /// Unit geometric normal; its side is the surface's front.
    pub ng: Vec3,
    /// Shading frame: interpolated normal, first tangent along dp/du. `frame.n · ng > 0` except on wild meshes.
    pub frame: Frame,
    /// Texture coordinates.
    pub uv: Vec2,
    /// ∂p/∂u.
    pub dpdu: Vec3,
    /// ∂p/∂v.
    pub dpdv: Vec3,
    /// Interpolated vertex colour (white where the mesh has none).
    pub color: Rgb,
}

impl Default for SurfacePoint {
    /// The origin, facing +z.
    fn default() -> SurfacePoint {
        SurfacePoint {
            p: Vec3::ZERO,
            error: 0.0,
            ng: Vec3::Z,
            frame: Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z },
            uv: Vec2::ZERO,
            dpdu: Vec3::X,
            dpdv: Vec3::Y,
            color: Rgb::WHITE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One is written for every vertex of every path.
    #[test]
    fn a_surface_point_has_no_padding() {
        assert_eq!(size_of::<SurfacePoint>(), 27 * size_of::<f32>());
    }
}
