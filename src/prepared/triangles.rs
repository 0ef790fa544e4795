//! Triangles as hits look them up: one cache line each, found without going through the index and vertex buffers.
//!
//! A ray meets triangles in no order that a cache could learn, so what counts is the number of lines that a hit touches
//! and how many of them must arrive one after the other. The corners and the normal of a triangle fill exactly one
//! line.

use super::MeshShading;
use crate::math::Vec3;
use crate::ray::offset::interpolation_error;
use crate::ray::{Geometry, Hit};
use crate::scene::BsdfId;
use glam::Vec3A;

/// Corners and normal of one triangle, in the space of its mesh.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Triangle {
    corners: [Vec3A; 3],
    ng: Vec3A,
}

impl Triangle {
    /// Stands where a round shape has no triangle, so that hits on triangles need not ask.
    const PLACEHOLDER: Triangle = Triangle { corners: [Vec3A::ZERO, Vec3A::X, Vec3A::Y], ng: Vec3A::Z };

    fn new(corners: [Vec3; 3]) -> Triangle {
        let ng = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        Triangle { corners: corners.map(Vec3A::from), ng: ng.into() }
    }

    /// Unit normal.
    #[inline]
    pub fn ng(&self) -> Vec3 {
        self.ng.into()
    }

    /// The edges v1 − v0 and v2 − v0.
    #[inline]
    pub fn edges(&self) -> [Vec3; 2] {
        [(self.corners[1] - self.corners[0]).into(), (self.corners[2] - self.corners[0]).into()]
    }

    /// The point with barycentrics `b` and its error bound.
    #[inline]
    pub fn at(&self, b: [f32; 3]) -> (Vec3, f32) {
        let [a, b, c] = [self.corners[0] * b[0], self.corners[1] * b[1], self.corners[2] * b[2]];
        let bound = (a.abs() + b.abs() + c.abs()).max_element();
        ((a + b + c).into(), interpolation_error(bound))
    }
}

/// Facts about the surface of a hit, in a form so small that the whole table stays in the cache.
#[derive(Clone, Copy, Debug)]
pub struct MeshEntry {
    /// Number of the mesh's first triangle in the table; of a round shape, that of a placeholder.
    first_triangle: u32,
    /// Number of the light that is its first triangle, or [`MeshEntry::DARK`].
    first_light: u32,
    /// The material; the default one if the file names none.
    pub material: Option<BsdfId>,
    /// It is a mesh, and there is nothing to interpolate: see [`MeshShading::is_plain`].
    pub plain: bool,
}

impl MeshEntry {
    const DARK: u32 = u32::MAX;

    /// Number of the light that is the mesh's triangle `triangle`, if the mesh emits.
    #[inline]
    pub fn light(&self, triangle: u32) -> Option<u32> {
        (self.first_light != MeshEntry::DARK).then(|| self.first_light.wrapping_add(triangle))
    }
}

/// All triangles of a scene, those of each mesh in a row.
#[derive(Debug, Default)]
pub struct TriangleTable {
    meshes: Vec<MeshEntry>,
    triangles: Vec<Triangle>,
}

impl TriangleTable {
    /// For the surfaces of `geometry`, in their order.
    pub fn new(geometry: &Geometry, shading: &[MeshShading]) -> TriangleTable {
        let mut table = TriangleTable::default();
        let placeholders = usize::from(!geometry.round.is_empty());
        let count: usize = geometry.meshes.iter().map(|m| m.triangles.len()).sum();
        table.triangles.reserve_exact(count + placeholders);
        for (buffers, shading) in geometry.meshes.iter().zip(shading) {
            table.meshes.push(MeshEntry {
                first_triangle: table.triangles.len() as u32,
                first_light: shading.first_light.unwrap_or(MeshEntry::DARK),
                material: shading.material,
                plain: shading.is_plain(),
            });
            table.triangles.extend((0..buffers.triangles.len()).map(|i| Triangle::new(buffers.corners(i as u32))));
        }
        let placeholder = table.triangles.len() as u32;
        for shading in shading.iter().skip(geometry.meshes.len()) {
            table.meshes.push(MeshEntry {
                first_triangle: placeholder,
                first_light: shading.first_light.unwrap_or(MeshEntry::DARK),
                material: shading.material,
                plain: false,
            });
        }
        if !geometry.round.is_empty() {
            table.triangles.push(Triangle::PLACEHOLDER);
        }
        table
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(&self.meshes[..]) + std::mem::size_of_val(&self.triangles[..])
    }

    /// Facts about the surface that was hit.
    #[inline]
    pub fn mesh(&self, hit: &Hit) -> &MeshEntry {
        &self.meshes[hit.mesh as usize]
    }

    /// The triangle that was hit, on the mesh with the entry `mesh`.
    #[inline]
    pub fn triangle(&self, mesh: &MeshEntry, hit: &Hit) -> &Triangle {
        &self.triangles[mesh.first_triangle.wrapping_add(hit.triangle) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_one_cache_line() {
        assert_eq!((size_of::<Triangle>(), align_of::<Triangle>()), (64, 64));
        assert_eq!(size_of::<MeshEntry>(), 20);
    }
}
