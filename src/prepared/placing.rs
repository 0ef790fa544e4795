//! Surfaces in their places: moved to the scene's centre in double precision, cleaned, and cut into what rays and what
//! shading need.

use super::MeshShading;
use super::media::SurfaceInterface;
use crate::math::{DVec3, Vec3};
use crate::ray::{Geometry, Instance, MeshBuffers, RoundShape, SurfaceMask, VertexBuffer};
use crate::scene::{
    AreaEmission, BsdfId, ColorDesc, Diagnostic, Diagnostics, InstanceDesc, MeshDesc, MeshId, RoundKind, SceneDesc,
    ShapeDesc, ShapeGeometry,
};
use crate::shade::MaterialSet;
use glam::{Affine3A, DMat3, DMat4, Mat3A};
use rayon::prelude::*;

/// The surfaces of a scene in their places. Positions are relative to the scene's centre.
pub(super) struct PlacedScene {
    pub geometry: Geometry,
    /// Data of each surface of `geometry` for shading.
    pub meshes: Vec<MeshShading>,
    /// Emission of each surface of `geometry`.
    pub emission: Vec<Option<AreaEmission>>,
    /// Inverse transposes of the instances' maps.
    pub instance_normals: Vec<Mat3A>,
}

impl PlacedScene {
    /// Places the shapes, groups and instances of a scene, whose meshes are used up.
    pub fn new(
        desc: &mut SceneDesc,
        centre: DVec3,
        materials: &MaterialSet,
        diagnostics: &mut Diagnostics,
    ) -> PlacedScene {
        let mut placer = Placer::new(desc, materials);
        let to_origin = DMat4::from_translation(-centre);
        let mut geometry = Geometry { world: placer.place_all(&desc.shapes, to_origin, true), ..Geometry::default() };
        for group in &desc.groups {
            for shape in group.shapes.iter().filter(|s| s.emission.is_some()) {
                diagnostics.push(emitter_in_group().at(shape.span.clone()));
            }
            geometry.groups.push(placer.place_all(&group.shapes, DMat4::IDENTITY, false));
        }
        let mut instance_normals = vec![];
        for instance in &desc.instances {
            let (to_world, normals) = affine(to_origin * instance.to_world);
            geometry.instances.push(Instance { group: instance.group.0, to_world });
            instance_normals.push(normals);
        }
        let Placer { parts, round, round_shading, mut emission, round_emission, .. } = placer;
        let (placed, removed): (Vec<_>, Vec<_>) = finish(parts);
        warn_of_flat_triangles(removed, diagnostics);
        let mut meshes: Vec<MeshShading>;
        (geometry.meshes, meshes) = placed.into_iter().unzip();
        geometry.round = round;
        meshes.extend(round_shading);
        emission.extend(round_emission);
        PlacedScene { geometry, meshes, emission, instance_normals }
    }
}

fn emitter_in_group() -> Diagnostic {
    Diagnostic::warning("scene::emitter-in-group", "a shape of a shapegroup cannot emit; its light is ignored")
}

/// Names meshes of which triangles were removed. Validation names triangles that are flat in their file; here are those
/// that were flattened by their place.
fn warn_of_flat_triangles(removed: Vec<(String, usize)>, diagnostics: &mut Diagnostics) {
    if diagnostics.list.iter().any(|d| d.code == "scene::flat-triangles") {
        return;
    }
    for (name, count) in removed.into_iter().filter(|&(_, n)| n > 0) {
        let message = format!("{count} triangles of {name} have no area and were removed");
        diagnostics.push(Diagnostic::warning("mesh::degenerate", message));
    }
}

/// Box around everything, in double precision; `None` if nothing is there.
pub(super) fn bounds(desc: &SceneDesc) -> Option<(DVec3, DVec3)> {
    let group = |i: &InstanceDesc| desc.groups.get(i.group.index()).map_or(&[][..], |g| &g.shapes);
    let instanced = desc.instances.iter().flat_map(|i| group(i).iter().map(|shape| (shape, i.to_world)));
    bounds_of(desc, desc.shapes.iter().map(|shape| (shape, DMat4::IDENTITY)).chain(instanced))
}

/// Box around shapes that are placed by the maps beside them.
pub(super) fn bounds_of<'a>(
    desc: &SceneDesc,
    shapes: impl Iterator<Item = (&'a ShapeDesc, DMat4)>,
) -> Option<(DVec3, DVec3)> {
    let mut bounds: Option<(DVec3, DVec3)> = None;
    for (shape, outer) in shapes {
        // The corners of the object's box bound the placed object; tightness does not matter for a centre.
        let Some((lo, hi)) = object_box(desc, shape.geometry) else { continue };
        for i in 0..8 {
            let pick = |bit: u32, lo: f32, hi: f32| f64::from(if i >> bit & 1 == 0 { lo } else { hi });
            let corner = DVec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z));
            let p = (outer * shape.to_world).transform_point3(corner);
            if p.is_finite() {
                let (lo, hi) = bounds.unwrap_or((p, p));
                bounds = Some((lo.min(p), hi.max(p)));
            }
        }
    }
    bounds
}

/// Box around a shape in its own space; `None` if nothing is there.
fn object_box(desc: &SceneDesc, geometry: ShapeGeometry) -> Option<(Vec3, Vec3)> {
    let mesh = match geometry {
        ShapeGeometry::Mesh(mesh) => desc.meshes.get(mesh.index())?,
        ShapeGeometry::Round(RoundKind::Sphere) => return Some((Vec3::splat(-1.0), Vec3::ONE)),
        ShapeGeometry::Round(RoundKind::Disk) => return Some((Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0))),
        ShapeGeometry::Round(RoundKind::Cylinder) => return Some((Vec3::new(-1.0, -1.0, 0.0), Vec3::ONE)),
    };
    let empty = || (Vec3::INFINITY, Vec3::NEG_INFINITY);
    (!mesh.positions.is_empty()).then(|| {
        mesh.positions
            .par_iter()
            .fold(empty, |(lo, hi), p| (lo.min(*p), hi.max(*p)))
            .reduce(empty, |a, b| (a.0.min(b.0), a.1.max(b.1)))
    })
}

fn affine(m: DMat4) -> (Affine3A, Mat3A) {
    let linear = DMat3::from_mat4(m);
    let single =
        |m: DMat3| Mat3A::from_cols(m.x_axis.as_vec3().into(), m.y_axis.as_vec3().into(), m.z_axis.as_vec3().into());
    let to_world = Affine3A { matrix3: single(linear), translation: m.w_axis.truncate().as_vec3().into() };
    (to_world, single(linear.inverse().transpose()))
}

/// A mesh in its place, cut into what rays and what shading need.
type PlacedMesh = (MeshBuffers, MeshShading);

/// A mesh on its way to its place.
struct Part {
    mesh: MeshDesc,
    to_place: DMat4,
    flip: bool,
    material: Option<BsdfId>,
    interface: Option<SurfaceInterface>,
    wants: Wants,
}

/// Properties of a surface's material and emission that decide which data it needs.
struct Wants {
    surface: SurfaceMask,
    tangents: bool,
    uvs: bool,
    colors: bool,
}

impl Wants {
    fn new(shape: &ShapeDesc, materials: &MaterialSet) -> Wants {
        let wants = materials.get(shape.bsdf).features();
        let emission_textured = shape.emission.as_ref().is_some_and(|e| matches!(e.radiance, ColorDesc::Texture(_)));
        Wants {
            surface: match (wants.passes_through, wants.scatters || shape.emission.is_some()) {
                (false, _) => SurfaceMask::BLOCKERS,
                (true, false) if shape.interface.is_none() => SurfaceMask::INTERFACES,
                // Walks must meet emission, and the borders of media.
                (true, _) => SurfaceMask::MASKS,
            },
            tangents: wants.oriented,
            uvs: wants.textured || wants.oriented || emission_textured,
            colors: wants.textured,
        }
    }
}

/// Numbers and collects the surfaces of a scene. Hands out meshes: the last user of a mesh takes it over, earlier ones
/// copy it.
struct Placer<'a> {
    materials: &'a MaterialSet,
    meshes: Vec<MeshDesc>,
    uses: Vec<u32>,
    parts: Vec<Part>,
    /// Emission of each part.
    emission: Vec<Option<AreaEmission>>,
    /// Number of the first round shape: they follow on all meshes.
    first_round: u32,
    round: Vec<RoundShape>,
    round_shading: Vec<MeshShading>,
    round_emission: Vec<Option<AreaEmission>>,
}

impl<'a> Placer<'a> {
    fn new(desc: &mut SceneDesc, materials: &'a MaterialSet) -> Placer<'a> {
        let meshes = std::mem::take(&mut desc.meshes);
        let mut uses = vec![0; meshes.len()];
        let mut first_round = 0;
        for shape in desc.shapes.iter().chain(desc.groups.iter().flat_map(|g| &g.shapes)) {
            if let Some(mesh) = shape.geometry.mesh() {
                first_round += 1;
                if let Some(n) = uses.get_mut(mesh.index()) {
                    *n += 1;
                }
            }
        }
        Placer {
            materials,
            meshes,
            uses,
            first_round,
            parts: vec![],
            emission: vec![],
            round: vec![],
            round_shading: vec![],
            round_emission: vec![],
        }
    }

    /// Places shapes that stand together; returns their numbers, meshes first. Their emission counts only if `emits`.
    fn place_all(&mut self, shapes: &[ShapeDesc], outer: DMat4, emits: bool) -> Vec<u32> {
        let (mut numbers, mut round) = (vec![], vec![]);
        for shape in shapes {
            let emission = if emits { shape.emission.clone() } else { None };
            match shape.geometry {
                ShapeGeometry::Mesh(mesh) => {
                    numbers.push(self.parts.len() as u32);
                    self.place_mesh(mesh, shape, outer * shape.to_world);
                    self.emission.push(emission);
                }
                ShapeGeometry::Round(kind) => {
                    round.push(self.first_round + self.round.len() as u32);
                    self.place_round(kind, shape, outer * shape.to_world);
                    self.round_emission.push(emission);
                }
            }
        }
        numbers.append(&mut round);
        numbers
    }

    fn place_round(&mut self, kind: RoundKind, shape: &ShapeDesc, to_place: DMat4) {
        let wants = Wants::new(shape, self.materials);
        self.round.push(RoundShape::new(kind, to_place, shape.flip_normals, wants.surface));
        self.round_shading.push(MeshShading {
            material: shape.bsdf,
            interface: shape.interface.as_ref().map(SurfaceInterface::new),
            wants_tangents: wants.tangents,
            wants_uvs: wants.uvs,
            ..MeshShading::default()
        });
    }

    fn place_mesh(&mut self, mesh: MeshId, shape: &ShapeDesc, to_place: DMat4) {
        let i = mesh.index();
        let mesh = match self.uses.get_mut(i) {
            Some(1) => std::mem::take(&mut self.meshes[i]),
            Some(n) => {
                *n -= 1;
                self.meshes[i].clone()
            }
            None => MeshDesc::default(),
        };
        let wants = Wants::new(shape, self.materials);
        let interface = shape.interface.as_ref().map(SurfaceInterface::new);
        self.parts.push(Part { mesh, to_place, flip: shape.flip_normals, material: shape.bsdf, interface, wants });
    }
}

/// Every mesh in its place, and how many triangles of which mesh had no area.
fn finish(parts: Vec<Part>) -> (Vec<PlacedMesh>, Vec<(String, usize)>) {
    parts
        .into_par_iter()
        .map(|part| {
            let name = part.mesh.name.clone();
            let (placed, removed) = place(part);
            (placed, (name, removed))
        })
        .unzip()
}

/// Moves a mesh to its place, drops triangles without area, and turns triangles so that their winding agrees with the
/// vertex normals (the side of a surface is the side of its geometric normal everywhere after this).
fn place(part: Part) -> (PlacedMesh, usize) {
    let Part { mut mesh, to_place, flip, material, interface, wants } = part;
    if to_place != DMat4::IDENTITY {
        mesh.positions.par_iter_mut().for_each(|p| *p = to_place.transform_point3(p.as_dvec3()).as_vec3());
        let normal_map = DMat3::from_mat4(to_place).inverse().transpose();
        mesh.normals.par_iter_mut().for_each(|n| *n = (normal_map * n.as_dvec3()).normalize_or_zero().as_vec3());
    }
    if flip {
        mesh.normals.par_iter_mut().for_each(|n| *n = -*n);
        mesh.triangles.par_iter_mut().for_each(|t| t.swap(1, 2));
    }
    let before = mesh.triangles.len();
    let (positions, normals) = (&mesh.positions, &mesh.normals);
    let cross = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        (b - a).cross(c - a)
    };
    // Shading normalises this single precision cross product: a triangle for which that fails has no area.
    let has_area = |t: &[u32; 3]| {
        let length2 = cross(t).length_squared();
        length2.is_finite() && length2 > f32::MIN_POSITIVE
    };
    let mut triangles = std::mem::take(&mut mesh.triangles);
    if !triangles.par_iter().all(has_area) {
        triangles.retain(has_area);
    }
    let mut flat = true;
    if !normals.is_empty() {
        flat = triangles
            .par_iter_mut()
            .map(|t| {
                let n = t.map(|i| normals[i as usize]);
                let mut ng = cross(t).normalize();
                if ng.dot(n[0] + n[1] + n[2]) < 0.0 {
                    t.swap(1, 2);
                    ng = -ng;
                }
                // Normals that only repeat the face's own tell nothing.
                n.iter().all(|n| n.dot(ng) > 1.0 - 1e-6)
            })
            .reduce(|| true, |a, b| a && b);
    }
    let removed = before - triangles.len();
    let shading = MeshShading {
        normals: if flat { vec![] } else { mesh.normals },
        uvs: if wants.uvs { mesh.uvs } else { vec![] },
        colors: if wants.colors { mesh.colors } else { vec![] },
        material,
        first_light: None,
        interface,
        wants_tangents: wants.tangents,
        wants_uvs: wants.uvs,
    };
    (
        (MeshBuffers { surface: wants.surface, positions: VertexBuffer::new(mesh.positions), triangles }, shading),
        removed,
    )
}
