//! Triangles as hits look them up: one cache line each, found without going through the index and vertex buffers.
//!
//! A ray meets triangles in no order that a cache could learn, so what counts is the number of lines that a hit touches
//! and how many of them must arrive one after the other. The corners and the normal of a triangle, and the inverses of
//! its heights, fill exactly one line.
//!
//! A point that is met within its rounding error of an edge may be behind the surface that is joined there: the next ray
//! would start outside of a closed body. Such a point is moved into its triangle, to [`EDGE_MARGIN`] times its error bound
//! from the edge. Edges inside of flat regions (`flat_edges`) join no other surface: points stay on them.

use super::MeshShading;
use super::flat_edges::flat_edges;
use crate::math::Vec3;
use crate::ray::offset::{EDGE_MARGIN, interpolation_error};
use crate::ray::{Geometry, Hit};
use crate::scene::BsdfId;
use glam::{Vec3A, Vec4};
use rayon::prelude::*;

/// A point is moved into its triangle by this many margins at most, however thin the triangle is.
const FARTHEST: f32 = 2.0;

/// Stands for the inverse of the height over an edge that points need not keep off: all are far from it.
const FAR: f32 = -1e38;

/// Corners and normal of one triangle, in the space of its mesh.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Triangle {
    /// Corners, with the inverse of the height over the opposite edge as fourth component.
    corners: [Vec4; 3],
    ng: Vec3A,
}

impl Triangle {
    /// Stands where a round shape has no triangle, so that hits on triangles need not ask.
    const PLACEHOLDER: Triangle = Triangle {
        corners: [Vec4::new(0.0, 0.0, 0.0, FAR), Vec4::new(1.0, 0.0, 0.0, FAR), Vec4::new(0.0, 1.0, 0.0, FAR)],
        ng: Vec3A::Z,
    };

    /// Bit `i` of `flat`: the edge opposite to corner `i` is inside of a flat region.
    fn new(corners: [Vec3; 3], flat: u8) -> Triangle {
        let [a, b, c] = corners;
        let cross = (b - a).cross(c - a);
        let twice_area = cross.length();
        let opposite = [c - b, c - a, b - a];
        let inverse_height = |i: usize| {
            let inverse = opposite[i].length() / twice_area;
            match flat >> i & 1 {
                1 => FAR,
                _ if inverse.is_finite() => inverse,
                _ => f32::MAX,
            }
        };
        let corners = std::array::from_fn(|i| corners[i].extend(inverse_height(i)));
        Triangle { corners, ng: cross.normalize().into() }
    }

    /// Unit normal.
    #[inline]
    pub fn ng(&self) -> Vec3 {
        self.ng.into()
    }

    /// The edges v1 − v0 and v2 − v0.
    #[inline]
    pub fn edges(&self) -> [Vec3; 2] {
        let [a, b, c] = self.corners();
        [(b - a).into(), (c - a).into()]
    }

    /// Corners without what stands beside them. Not by `map`, which is not always inlined.
    #[inline]
    fn corners(&self) -> [Vec3A; 3] {
        let [a, b, c] = self.corners;
        [Vec3A::from_vec4(a), Vec3A::from_vec4(b), Vec3A::from_vec4(c)]
    }

    /// The point with barycentrics `b`, moved off the edges, and its error bound.
    #[inline]
    pub fn at(&self, b: [f32; 3]) -> (Vec3, f32) {
        let (p, error) = self.interpolate(b);
        let margin = EDGE_MARGIN * error;
        if self.is_inside(b, margin) { (p, error) } else { self.off_edges(b, p, margin) }
    }

    /// The point with barycentrics `b`, off the edges by the margin for points with the error bound `error`, which is
    /// larger than that of the interpolation; `None` if it is so as it is.
    pub fn moved_off_edges(&self, b: [f32; 3], error: f32) -> Option<Vec3> {
        let margin = EDGE_MARGIN * error;
        (!self.is_inside(b, margin)).then(|| self.off_edges(b, self.interpolate(b).0, margin).0)
    }

    #[inline(always)]
    fn interpolate(&self, b: [f32; 3]) -> (Vec3, f32) {
        let [p, q, r] = self.corners();
        let [a, b, c] = [p * b[0], q * b[1], r * b[2]];
        let bound = (a.abs() + b.abs() + c.abs()).max_element();
        ((a + b + c).into(), interpolation_error(bound))
    }

    /// No edge is nearer than `margin`.
    #[inline(always)]
    fn is_inside(&self, b: [f32; 3], margin: f32) -> bool {
        let [p, q, r] = &self.corners;
        b[0] >= margin * p.w && b[1] >= margin * q.w && b[2] >= margin * r.w
    }

    /// The point `p` with barycentrics `b`, moved away from edges that are nearer than `margin`.
    #[cold]
    #[inline(never)]
    fn off_edges(&self, b: [f32; 3], p: Vec3, margin: f32) -> (Vec3, f32) {
        // In a triangle thinner than three margins the middle is the farthest from all edges.
        let least: [f32; 3] = std::array::from_fn(|i| match self.corners[i].w {
            FAR => b[i].min(0.0),
            inverse => (margin * inverse).min(1.0 / 3.0),
        });
        let spare: [f32; 3] = std::array::from_fn(|i| (b[i] - least[i]).max(0.0));
        let (all, free) = (spare.iter().sum::<f32>(), 1.0 - least.iter().sum::<f32>());
        let share = if all > 0.0 { free.max(0.0) / all } else { 0.0 };
        let (inside, error) = self.interpolate(std::array::from_fn(|i| least[i] + spare[i] * share));
        let (shift, farthest) = (inside - p, FARTHEST * margin);
        let length = shift.length();
        if length > farthest { (p + shift * (farthest / length), error) } else { (inside, error) }
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
        let flat: Vec<Vec<u8>> = geometry.meshes.par_iter().map(flat_edges).collect();
        for ((buffers, shading), flat) in geometry.meshes.iter().zip(shading).zip(flat) {
            table.meshes.push(MeshEntry {
                first_triangle: table.triangles.len() as u32,
                first_light: shading.first_light.unwrap_or(MeshEntry::DARK),
                material: shading.material,
                plain: shading.is_plain(),
            });
            let triangles = (0u32..).zip(flat).map(|(i, flat)| Triangle::new(buffers.corners(i), flat));
            table.triangles.extend(triangles);
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
