//! Triangles as the backends and the shading code share them: one copy, never moved while a scene lives.

use crate::math::Vec3;
use glam::Affine3A;
use std::ops::Deref;

/// Vertex positions with one spare element behind the last: Embree reads four floats a vertex, and without the padding
/// the last read leaves the allocation.
#[derive(Debug)]
pub struct VertexBuffer {
    padded: Vec<Vec3>,
}

impl VertexBuffer {
    /// Takes the positions over; grows them by the padding.
    pub fn new(mut positions: Vec<Vec3>) -> VertexBuffer {
        positions.reserve_exact(1);
        positions.push(Vec3::ZERO);
        VertexBuffer { padded: positions }
    }
}

impl Deref for VertexBuffer {
    type Target = [Vec3];
    fn deref(&self) -> &[Vec3] {
        &self.padded[..self.padded.len() - 1]
    }
}

/// A set of kinds of surfaces, told apart by what they do to light on a straight segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceMask(u32);

impl SurfaceMask {
    /// Surfaces that scatter or absorb light, wholly or in part.
    pub const BLOCKERS: SurfaceMask = SurfaceMask(1);
    /// Surfaces that light passes unchanged and in its direction: `null` materials, which bound media and nothing else.
    pub const INTERFACES: SurfaceMask = SurfaceMask(2);
    /// All surfaces.
    pub const ALL: SurfaceMask = SurfaceMask(3);

    /// The bits.
    #[inline]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The sets have a kind in common.
    #[inline]
    pub fn intersects(self, other: SurfaceMask) -> bool {
        self.0 & other.0 != 0
    }
}

/// One mesh.
#[derive(Debug)]
pub struct MeshBuffers {
    /// The kind of its surface.
    pub surface: SurfaceMask,
    /// Vertices, all finite.
    pub positions: VertexBuffer,
    /// Vertex indices, all in range.
    pub triangles: Vec<[u32; 3]>,
}

impl MeshBuffers {
    /// The three corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }
}

/// A placed group of meshes.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`Geometry::groups`].
    pub group: u32,
    /// Group → world; any invertible affine map.
    pub to_world: Affine3A,
}

/// Everything a ray can meet.
#[derive(Debug, Default)]
pub struct Geometry {
    /// All meshes; those of the world come first, in the order of `world`.
    pub meshes: Vec<MeshBuffers>,
    /// Meshes that stand in the world itself.
    pub world: Vec<u32>,
    /// Sets of meshes that only instances show, in group space.
    pub groups: Vec<Vec<u32>>,
    /// Placed groups.
    pub instances: Vec<Instance>,
}

impl Geometry {
    /// Triangles that a ray can meet, instances counted each time.
    pub fn triangle_count(&self) -> usize {
        let count = |meshes: &[u32]| meshes.iter().map(|&m| self.meshes[m as usize].triangles.len()).sum::<usize>();
        count(&self.world) + self.instances.iter().map(|i| count(&self.groups[i.group as usize])).sum::<usize>()
    }

    /// Bytes of vertices and indices.
    pub fn bytes(&self) -> usize {
        self.meshes.iter().map(|m| m.positions.len() * 12 + m.triangles.len() * 12).sum()
    }

    /// Calls `f(mesh, instance, to_world)` for every mesh that stands somewhere.
    pub fn for_each_placed(&self, mut f: impl FnMut(u32, u32, Option<&Affine3A>)) {
        for &mesh in &self.world {
            f(mesh, super::NONE, None);
        }
        for (i, instance) in self.instances.iter().enumerate() {
            for &mesh in &self.groups[instance.group as usize] {
                f(mesh, i as u32, Some(&instance.to_world));
            }
        }
    }

    /// Smallest box around the mesh `mesh` in its own space; `None` if it has no vertices.
    pub fn mesh_bounds(&self, mesh: u32) -> Option<(Vec3, Vec3)> {
        union(self.meshes[mesh as usize].positions.iter().map(|&p| (p, p)))
    }

    /// Smallest box around the meshes `meshes` in their own space; `None` if they have no vertices.
    pub fn bounds_of(&self, meshes: &[u32]) -> Option<(Vec3, Vec3)> {
        union(meshes.iter().filter_map(|&mesh| self.mesh_bounds(mesh)))
    }

    /// Smallest box around everything; `None` if there is nothing.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds: Option<(Vec3, Vec3)> = None;
        self.for_each_placed(|mesh, _, to_world| {
            for &p in self.meshes[mesh as usize].positions.iter() {
                let p = to_world.map_or(p, |m| m.transform_point3(p));
                let (lo, hi) = bounds.unwrap_or((p, p));
                bounds = Some((lo.min(p), hi.max(p)));
            }
        });
        bounds
    }
}

/// Smallest box around all of `boxes`.
fn union(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Option<(Vec3, Vec3)> {
    boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}
