//! Surfaces as the backends and the shading code share them: one copy, never moved while a scene lives.
//!
//! A surface is a mesh or a round shape. Both are numbered together, the meshes first.

use super::RoundShape;
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
    /// Surfaces that let no light straight through.
    pub const BLOCKERS: SurfaceMask = SurfaceMask(1);
    /// Surfaces with holes: they let a known share of the light straight through, which may differ from point to point.
    pub const MASKS: SurfaceMask = SurfaceMask(2);
    /// Surfaces that light passes unchanged and in its direction: `null` materials, which bound media and nothing else.
    pub const INTERFACES: SurfaceMask = SurfaceMask(4);
    /// Surfaces that can be seen: all but interfaces.
    pub const VISIBLE: SurfaceMask = SurfaceMask(3);
    /// All surfaces.
    pub const ALL: SurfaceMask = SurfaceMask(7);

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
    /// All meshes; those of the world come first.
    pub meshes: Vec<MeshBuffers>,
    /// All round shapes; those of the world come first, and those of a group in a row.
    pub round: Vec<RoundShape>,
    /// Numbers of the surfaces that stand in the world itself: its meshes in a row from 0, then its round shapes.
    pub world: Vec<u32>,
    /// Sets of surfaces that only instances show, in group space: first meshes, then round shapes in a row.
    pub groups: Vec<Vec<u32>>,
    /// Placed groups.
    pub instances: Vec<Instance>,
}

impl Geometry {
    /// Triangles that a ray can meet, instances counted each time.
    pub fn triangle_count(&self) -> usize {
        let of = |&m: &u32| self.meshes.get(m as usize).map_or(0, |mesh| mesh.triangles.len());
        self.count(|surfaces| surfaces.iter().map(of).sum())
    }

    /// Round shapes that a ray can meet, instances counted each time.
    pub fn round_count(&self) -> usize {
        self.count(|surfaces| surfaces.len() - self.meshes_of(surfaces).len())
    }

    /// There are surfaces of the kinds `surfaces`.
    pub fn has_any_of(&self, surfaces: SurfaceMask) -> bool {
        let kinds = self.meshes.iter().map(|mesh| mesh.surface).chain(self.round.iter().map(|shape| shape.surface));
        kinds.into_iter().any(|kind| kind.intersects(surfaces))
    }

    /// Sum of a number over the world and the group of every instance.
    fn count(&self, of: impl Fn(&[u32]) -> usize) -> usize {
        of(&self.world) + self.instances.iter().map(|i| of(&self.groups[i.group as usize])).sum::<usize>()
    }

    /// The surface `surface` if it is a round shape.
    #[inline]
    pub fn round_shape(&self, surface: u32) -> Option<&RoundShape> {
        self.round.get((surface as usize).wrapping_sub(self.meshes.len()))
    }

    /// The meshes among the surfaces of the world or of a group.
    pub fn meshes_of<'a>(&self, surfaces: &'a [u32]) -> &'a [u32] {
        &surfaces[..surfaces.partition_point(|&s| (s as usize) < self.meshes.len())]
    }

    /// Bytes of vertices, indices and round shapes.
    pub fn bytes(&self) -> usize {
        let meshes: usize = self.meshes.iter().map(|m| m.positions.len() * 12 + m.triangles.len() * 12).sum();
        meshes + std::mem::size_of_val(&self.round[..])
    }

    /// Calls `f(mesh, instance, to_world)` for every mesh that stands somewhere.
    pub fn for_each_placed_mesh(&self, mut f: impl FnMut(u32, u32, Option<&Affine3A>)) {
        self.for_each_placed(|surface, instance, to_world| {
            if (surface as usize) < self.meshes.len() {
                f(surface, instance, to_world);
            }
        });
    }

    /// Calls `f(surface, instance, shape)` for every round shape that stands somewhere, in the world.
    pub fn for_each_placed_round(&self, mut f: impl FnMut(u32, u32, RoundShape)) {
        self.for_each_placed(|surface, instance, to_world| {
            if let Some(shape) = self.round_shape(surface) {
                f(surface, instance, to_world.map_or_else(|| shape.clone(), |m| shape.placed(m)));
            }
        });
    }

    fn for_each_placed(&self, mut f: impl FnMut(u32, u32, Option<&Affine3A>)) {
        for &surface in &self.world {
            f(surface, super::NONE, None);
        }
        for (i, instance) in self.instances.iter().enumerate() {
            for &surface in &self.groups[instance.group as usize] {
                f(surface, i as u32, Some(&instance.to_world));
            }
        }
    }

    /// Smallest box around the surfaces `surfaces` in their own space; `None` if nothing is there.
    pub fn bounds_of(&self, surfaces: &[u32]) -> Option<(Vec3, Vec3)> {
        union(surfaces.iter().filter_map(|&surface| match self.round_shape(surface) {
            Some(shape) => Some(shape.bounds()),
            None => union(self.meshes[surface as usize].positions.iter().map(|&p| (p, p))),
        }))
    }

    /// Smallest box around everything; `None` if there is nothing.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds: Option<(Vec3, Vec3)> = None;
        self.for_each_placed_mesh(|mesh, _, to_world| {
            for &p in self.meshes[mesh as usize].positions.iter() {
                let p = to_world.map_or(p, |m| m.transform_point3(p));
                let (lo, hi) = bounds.unwrap_or((p, p));
                bounds = Some((lo.min(p), hi.max(p)));
            }
        });
        self.for_each_placed_round(|_, _, shape| bounds = union(bounds.into_iter().chain([shape.bounds()])));
        bounds
    }
}

/// Smallest box around all of `boxes`.
fn union(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Option<(Vec3, Vec3)> {
    boxes.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}
