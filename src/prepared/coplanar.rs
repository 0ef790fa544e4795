//! Emitting surfaces in the plane of another surface, as a lamp that is modelled in the plane of a ceiling.
//!
//! Rays cannot tell such surfaces apart: which of them is met is a matter of rounding, and a light that is sampled but
//! not met is a light that techniques weigh differently. The emitting surface is therefore moved out of the other one,
//! to the side on which it emits, by a small multiple of the error bound of hit points ([`TOLERANCE`]). Surfaces that do
//! not overlap, as neighbours in one plane, stay where they are.

use super::MeshShading;
use super::facet::{Facet, MAX_CORNERS};
use super::placing::PlacedScene;
use crate::math::{DVec3, Vec3, float::gamma};
use crate::ray::{Geometry, MeshBuffers, NONE, VertexBuffer};
use crate::scene::{Diagnostic, Diagnostics, RoundKind};
use arrayvec::ArrayVec;
use glam::{Affine3A, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Surfaces nearer to each other than this many error bounds of their points are in one plane.
const TOLERANCE: f64 = 4.0;
/// Heights that rays from across the scene tell apart, relative to the radius of the scene.
const DISTANT: f64 = 1e-6;
/// A surface is moved for the sake of such rays by this share of its size at most.
const MAX_SHARE: f64 = 1e-4;
/// Triangles from which on a mesh is searched by several threads.
const PARALLEL_FROM: usize = 1 << 13;

/// An emitting facet lies in another facet.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Contact {
    /// Number of the emitting facet.
    emitter: usize,
    /// The other one if it emits to the same side.
    above: Option<usize>,
    /// Distance within which the two are in one plane.
    tolerance: f64,
}

/// The flat parts of all emitting surfaces of the world.
struct Emitters {
    facets: Vec<Facet>,
    /// Number of the first facet of each surface that emits.
    first: HashMap<u32, usize>,
    tree: Bvh2,
}

impl Boundable for &Facet {
    fn aabb(&self) -> Aabb {
        box_around(&self.corners, self.tolerance())
    }
}

impl Facet {
    /// Distance from the plane within which a point of the facet may be met.
    fn tolerance(&self) -> f64 {
        TOLERANCE * f64::from(gamma(9)) * self.reach
    }
}

fn box_around(corners: &[DVec3], margin: f64) -> Aabb {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (lo, hi) = corners.iter().fold(empty, |(lo, hi), &p| (lo.min(p), hi.max(p)));
    // The margin is many units in the last place of single precision.
    let single = |v: DVec3| Vec3A::from(v.as_vec3());
    Aabb { min: single(lo - margin), max: single(hi + margin) }
}

/// The triangle `triangle` of a mesh placed by `to_world`; `None` if it has no area.
fn triangle_facet(buffers: &MeshBuffers, triangle: u32, to_world: Option<&Affine3A>) -> Option<Facet> {
    let corners = buffers.corners(triangle).map(|p| to_world.map_or(p, |m| m.transform_point3(p)).as_dvec3());
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize()?;
    Some(Facet::new(corners.into_iter().collect(), normal))
}

/// The disk with the given axes as a polygon.
fn disk_facet(shape: &crate::ray::RoundShape) -> Facet {
    let [x, y, _] = shape.axes();
    let corner = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / MAX_CORNERS as f64).sin_cos();
        shape.origin() + x * cos + y * sin
    };
    let normal = shape.point_of(DVec3::ZERO).ng.as_dvec3();
    Facet::new((0..MAX_CORNERS).map(corner).collect(), normal)
}

impl Emitters {
    /// `None` if nothing flat emits.
    fn find(placed: &PlacedScene) -> Option<Emitters> {
        let geometry = &placed.geometry;
        let (mut facets, mut first) = (vec![], HashMap::new());
        for &surface in &geometry.world {
            if placed.emission[surface as usize].is_none() {
                continue;
            }
            first.insert(surface, facets.len());
            match geometry.round_shape(surface) {
                Some(shape) if shape.kind == RoundKind::Disk => facets.push(disk_facet(shape)),
                Some(_) => _ = first.remove(&surface),
                None => {
                    let buffers = &geometry.meshes[surface as usize];
                    // Preparing has removed triangles without area; one facet a triangle keeps their numbers.
                    let none = || Facet::new(ArrayVec::new(), DVec3::Z);
                    let facet = |i| triangle_facet(buffers, i, None).unwrap_or_else(none);
                    facets.extend((0..buffers.triangles.len() as u32).map(facet));
                }
            }
        }
        if facets.is_empty() {
            return None;
        }
        let mut time = std::time::Duration::ZERO;
        let tree = build_bvh2(&facets.iter().collect::<Vec<_>>(), BvhBuildParams::fast_build(), &mut time);
        Some(Emitters { facets, first, tree })
    }

    /// Adds the contacts of emitting facets with `other`, which is the emitting facet number `own` if it emits itself.
    fn contacts_with(&self, other: &Facet, own: Option<usize>, out: &mut Vec<Contact>) {
        self.tree.aabb_traverse(box_around(&other.corners, other.tolerance()), |tree, node| {
            let node = &tree.nodes[node as usize];
            for i in node.first_index..node.first_index + node.prim_count {
                let emitter = tree.primitive_indices[i as usize] as usize;
                let facet = &self.facets[emitter];
                let tolerance = facet.tolerance().max(other.tolerance());
                let above = own.filter(|_| facet.normal.dot(other.normal) > 0.0);
                // Two that emit to one side: the later one moves.
                if own == Some(emitter) || above.is_some_and(|a| a > emitter) || !facet.lies_in(other, tolerance) {
                    continue;
                }
                out.push(Contact { emitter, above, tolerance });
            }
            true
        });
    }

    /// All contacts, in the order of the emitting facets.
    fn contacts(&self, geometry: &Geometry) -> Vec<Contact> {
        let mut all = vec![];
        geometry.for_each_placed_mesh(|mesh, instance, to_world| {
            let buffers = &geometry.meshes[mesh as usize];
            let first = if instance == NONE { self.first.get(&mesh) } else { None };
            let of = |mut found: Vec<Contact>, triangle: u32| {
                if let Some(facet) = self.near(buffers, triangle, to_world) {
                    self.contacts_with(&facet, first.map(|f| f + triangle as usize), &mut found);
                }
                found
            };
            let triangles = 0..buffers.triangles.len() as u32;
            if buffers.triangles.len() < PARALLEL_FROM {
                all = triangles.fold(std::mem::take(&mut all), of);
            } else {
                let parts = triangles.into_par_iter().fold(Vec::new, of).collect::<Vec<_>>();
                all.extend(parts.into_iter().flatten());
            }
        });
        geometry.for_each_placed_round(|surface, instance, shape| {
            if shape.kind == RoundKind::Disk {
                let own = if instance == NONE { self.first.get(&surface).copied() } else { None };
                self.contacts_with(&disk_facet(&shape), own, &mut all);
            }
        });
        all.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        all
    }

    /// The triangle's facet if its box meets that of all emitting facets.
    fn near(&self, buffers: &MeshBuffers, triangle: u32, to_world: Option<&Affine3A>) -> Option<Facet> {
        let root = self.tree.nodes.first()?.aabb();
        let corners = buffers.corners(triangle).map(|p| Vec3A::from(to_world.map_or(p, |m| m.transform_point3(p))));
        let (lo, hi) = corners.iter().fold((corners[0], corners[0]), |(lo, hi), &p| (lo.min(p), hi.max(p)));
        let margin = Vec3A::splat(TOLERANCE as f32 * gamma(9) * lo.abs().max(hi.abs()).max_element());
        let apart = (lo - margin).cmpgt(root.max).any() || (hi + margin).cmplt(root.min).any();
        if apart { None } else { triangle_facet(buffers, triangle, to_world) }
    }

    /// Distances by which the emitting facets are moved along their normals.
    fn heights(&self, placed: &PlacedScene, contacts: &[Contact]) -> Vec<f64> {
        let size_of = |surfaces: &[u32]| placed.geometry.bounds_of(surfaces).map_or(0.0, |(lo, hi)| (hi - lo).length());
        let radius = placed.geometry.bounds().map_or(0.0, |(lo, hi)| f64::from(lo.abs().max(hi.abs()).length()));
        let mut sizes = HashMap::new();
        let mut heights = vec![0.0; self.facets.len()];
        for contact in contacts {
            let surface = self.surface(contact.emitter);
            let size = *sizes.entry(surface).or_insert_with(|| f64::from(size_of(&[surface])));
            let step = (2.0 * contact.tolerance).max((DISTANT * radius).min(MAX_SHARE * size));
            let height = step + contact.above.map_or(0.0, |above| heights[above]);
            heights[contact.emitter] = height.max(heights[contact.emitter]);
        }
        heights
    }

    /// The surface that has the facet.
    fn surface(&self, facet: usize) -> u32 {
        let before = self.first.iter().filter(|&(_, &first)| first <= facet);
        before.max_by_key(|&(_, &first)| first).map_or(0, |(&surface, _)| surface)
    }
}

/// Moves emitting facets that lie in other surfaces out of these; a note says which.
pub(super) fn raise_emitters(placed: &mut PlacedScene, diagnostics: &mut Diagnostics) {
    let Some(emitters) = Emitters::find(placed) else { return };
    let contacts = emitters.contacts(&placed.geometry);
    if contacts.is_empty() {
        return;
    }
    let heights = emitters.heights(placed, &contacts);
    let mut surfaces: Vec<(u32, usize)> = emitters.first.iter().map(|(&surface, &first)| (surface, first)).collect();
    surfaces.sort_unstable();
    for (surface, first) in surfaces {
        let count = placed.geometry.meshes.get(surface as usize).map_or(1, |mesh| mesh.triangles.len());
        let shift = |i: usize| emitters.facets[first + i].normal * heights[first + i];
        let raised: Vec<(u32, DVec3)> =
            (0..count).map(|i| (i as u32, shift(i))).filter(|(_, shift)| *shift != DVec3::ZERO).collect();
        if raised.is_empty() {
            continue;
        }
        let farthest = raised.iter().map(|(_, shift)| shift.length()).fold(0.0, f64::max);
        match (surface as usize).checked_sub(placed.geometry.meshes.len()) {
            Some(round) => placed.geometry.round[round] = placed.geometry.round[round].moved(raised[0].1),
            None => {
                let (buffers, shading) =
                    (&mut placed.geometry.meshes[surface as usize], &mut placed.meshes[surface as usize]);
                raise_triangles(buffers, shading, &raised);
            }
        }
        let message = format!(
            "this emitting surface lies in the plane of another surface: it was moved by {farthest:.1e} to the side on \
             which it emits"
        );
        let span = placed.emission[surface as usize].as_ref().and_then(|emission| emission.span.clone());
        diagnostics.push(Diagnostic::note("scene::coplanar-emitter", message).at(span));
    }
}

/// A vertex that moves.
struct Moved {
    /// Its number.
    vertex: u32,
    shift: DVec3,
}

/// Moves triangles by the vectors that stand beside their numbers. Triangles that share a vertex stay joined, except
/// those that move to opposite sides.
fn raise_triangles(buffers: &mut MeshBuffers, shading: &mut MeshShading, raised: &[(u32, DVec3)]) {
    let mut positions = buffers.positions.to_vec();
    // By the vertex of the file: the vertex itself, then copies of it.
    let mut moved: HashMap<u32, Vec<Moved>> = HashMap::new();
    for &(triangle, shift) in raised {
        for index in &mut buffers.triangles[triangle as usize] {
            let copies = moved.entry(*index).or_default();
            let length = shift.length();
            let along = |m: &Moved| m.shift.dot(shift) / length;
            match copies.iter_mut().find(|m| along(m) > -0.5 * length) {
                Some(copy) => {
                    copy.shift += shift * ((length - along(copy)).max(0.0) / length);
                    *index = copy.vertex;
                }
                None => {
                    let vertex = if copies.is_empty() { *index } else { positions.len() as u32 };
                    if !copies.is_empty() {
                        positions.push(positions[*index as usize]);
                        shading.repeat_vertex(*index as usize);
                    }
                    copies.push(Moved { vertex, shift });
                    *index = vertex;
                }
            }
        }
    }
    for Moved { vertex, shift } in moved.into_values().flatten() {
        let p: &mut Vec3 = &mut positions[vertex as usize];
        *p = (p.as_dvec3() + shift).as_vec3();
    }
    buffers.positions = VertexBuffer::new(positions);
}
