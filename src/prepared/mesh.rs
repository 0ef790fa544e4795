//! Data of surfaces for shading: the material and, of meshes, per-vertex data and its interpolation.

use super::media::SurfaceInterface;
use crate::math::{Rgb, Vec2, Vec3};
use crate::scene::BsdfId;
use crate::shade::SurfacePoint;

/// Data of a surface for shading, beside its place.
#[derive(Debug, Default)]
pub struct MeshShading {
    /// Unit normals per vertex, or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex, or empty.
    pub uvs: Vec<Vec2>,
    /// Colours per vertex, or empty.
    pub colors: Vec<Rgb>,
    /// The material; the default one if the file names none.
    pub material: Option<BsdfId>,
    /// Number of the light that is the first triangle, if a mesh emits; the others follow. A round shape is one light.
    pub first_light: Option<u32>,
    /// The media on its sides, if the surface separates media.
    pub interface: Option<SurfaceInterface>,
    /// The material depends on the direction of dp/du.
    pub wants_tangents: bool,
    /// The material or the emission looks something up by texture coordinates.
    pub wants_uvs: bool,
}

impl MeshShading {
    /// Nothing to interpolate.
    #[inline]
    pub fn is_plain(&self) -> bool {
        self.normals.is_empty() && self.uvs.is_empty() && self.colors.is_empty() && !self.wants_tangents
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.normals.len() * 12 + self.uvs.len() * 8 + self.colors.len() * 12
    }

    /// Appends a copy of the data of vertex `i`.
    pub(super) fn repeat_vertex(&mut self, i: usize) {
        self.normals.extend(self.normals.get(i).copied());
        self.uvs.extend(self.uvs.get(i).copied());
        self.colors.extend(self.colors.get(i).copied());
    }

    /// Fills in the shading normal (as `frame.n`), texture coordinates, their derivatives and the colour of the point
    /// with barycentrics `b` on the triangle with vertex indices `i`. The point holds the triangle's edges v1 − v0 and
    /// v2 − v0 as derivatives.
    #[inline]
    pub fn interpolate(&self, i: &[usize; 3], b: [f32; 3], point: &mut SurfacePoint) {
        if !self.normals.is_empty() {
            let n = self.normals[i[0]] * b[0] + self.normals[i[1]] * b[1] + self.normals[i[2]] * b[2];
            let length2 = n.length_squared();
            // Opposite normals may cancel: the geometric normal serves then.
            if length2 > 1e-12 && length2.is_finite() {
                point.frame.n = n / length2.sqrt();
            }
        }
        if !self.uvs.is_empty() {
            let uv = i.map(|i| self.uvs[i]);
            point.uv = uv[0] * b[0] + uv[1] * b[1] + uv[2] * b[2];
            if self.wants_tangents {
                let (e1, e2) = (point.dpdu, point.dpdv);
                let (d1, d2) = (uv[1] - uv[0], uv[2] - uv[0]);
                let det = d1.x * d2.y - d1.y * d2.x;
                if det != 0.0 {
                    let dpdu = (e1 * d2.y - e2 * d1.y) / det;
                    let dpdv = (e2 * d1.x - e1 * d2.x) / det;
                    if dpdu.is_finite() && dpdv.is_finite() {
                        (point.dpdu, point.dpdv) = (dpdu, dpdv);
                    }
                }
            }
        }
        if !self.colors.is_empty() {
            point.color = self.colors[i[0]] * b[0] + self.colors[i[1]] * b[1] + self.colors[i[2]] * b[2];
        }
    }
}
