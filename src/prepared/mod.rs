//! `SceneDesc` → [`PreparedScene`]: immutable, shared by all threads, in world space around the scene's centre.
//!
//! Preparing ([`build`]) places and cleans the triangles, moves everything so that the scene's centre is the origin (in
//! double precision: far from the origin no single precision policy works), builds materials, lights and the ray-query
//! backend, and notes which [`features`] the scene has, so that nobody pays for what it lacks.

pub mod build;
mod coplanar;
mod facet;
pub mod features;
mod flat_edges;
mod lights;
mod limits;
pub mod media;
pub mod mesh;
mod placing;
pub mod triangles;
mod units;

pub use build::{PrepareError, PrepareOptions};
pub use features::Features;
pub use media::{SurfaceInterface, Surroundings};
pub use mesh::MeshShading;
pub use triangles::TriangleTable;

use crate::emit::{Camera, LightId, LightSet, PixelFilter};
use crate::math::{DVec3, Frame, Rgb, Vec2, Vec3};
use crate::media::MediumSet;
use crate::ray::round::RoundUv;
use crate::ray::{Geometry, Hit, MaskLookup, MaskPoint, NONE, RayQuery, RoundPoint, Tracer};
use crate::shade::{Material, MaterialSet, SurfacePoint};
use glam::{Affine3A, Mat3A};
use std::sync::Arc;

/// A scene ready to render.
pub struct PreparedScene {
    /// Surfaces.
    pub geometry: Arc<Geometry>,
    /// Who answers questions about rays.
    pub query: Box<dyn RayQuery>,
    /// Data of each surface of `geometry` for shading.
    pub meshes: Vec<MeshShading>,
    /// The triangles of `geometry` once more, as hits look them up.
    pub triangles: TriangleTable,
    /// Inverse transposes of the instances' maps.
    pub instance_normals: Vec<Mat3A>,
    /// Materials.
    pub materials: MaterialSet,
    /// Participating media.
    pub media: MediumSet,
    /// The media around camera and lights.
    pub surroundings: Surroundings,
    /// Lights.
    pub lights: LightSet,
    /// Camera.
    pub camera: Camera,
    /// Pixel filter.
    pub filter: PixelFilter,
    /// Width and height of the full picture in pixels.
    pub film_size: [u32; 2],
    /// The part to render, in pixels of the full picture: x, y, width, height.
    pub window: [u32; 4],
    /// The position in the file that is the origin here.
    pub centre: DVec3,
    /// The length in units of the file that is 1 here; 1 unless the scene is very small or very large.
    pub unit: f64,
    /// Radius of a sphere around the origin that holds every surface.
    pub radius: f32,
    /// Features of the scene.
    pub features: Features,
    /// Seconds that the backend's tree took.
    pub tree_seconds: f64,
}

impl PreparedScene {
    /// The position in the file of the point `p`.
    pub fn position_in_file(&self, p: Vec3) -> DVec3 {
        p.as_dvec3() * self.unit + self.centre
    }

    /// Everything that shading needs of a hit.
    #[inline]
    pub fn surface_point(&self, hit: &Hit) -> (SurfacePoint, &Material) {
        let mut point = SurfacePoint::default();
        let material = self.surface_point_into(hit, &mut point);
        (point, material)
    }

    /// [`PreparedScene::surface_point`] in place, for loops: moving what has just been written in pieces stalls the
    /// processor.
    #[inline(always)]
    pub fn surface_point_into(&self, hit: &Hit, point: &mut SurfacePoint) -> &Material {
        let mesh = self.triangles.mesh(hit);
        let triangle = self.triangles.triangle(mesh, hit);
        (point.p, point.error) = triangle.at([1.0 - hit.u - hit.v, hit.u, hit.v]);
        point.ng = triangle.ng();
        [point.dpdu, point.dpdv] = triangle.edges();
        point.uv = Vec2::new(hit.u, hit.v);
        point.color = Rgb::WHITE;
        point.frame = Frame::from_normal(triangle.ng());
        if !(mesh.plain && hit.instance == NONE) {
            self.refine(*hit, point);
        }
        self.materials.get(mesh.material)
    }

    /// Interpolated vertex data or a point of a round shape, and the place of an instance.
    #[inline(never)]
    fn refine(&self, hit: Hit, point: &mut SurfacePoint) {
        let mesh = &self.meshes[hit.mesh as usize];
        if let Some(shape) = self.geometry.round_shape(hit.mesh) {
            let code = [hit.u, hit.v];
            let RoundPoint { p, error, ng } = shape.point_off_edges(code, 0.0);
            (point.p, point.error, point.ng, point.frame.n) = (p, error, ng, ng);
            if mesh.wants_uvs {
                let RoundUv { uv, dpdu, dpdv } = shape.parametrise(code);
                (point.uv, point.dpdu, point.dpdv) = (uv, dpdu, dpdv);
            }
        } else if !mesh.is_plain() {
            let indices = self.geometry.meshes[hit.mesh as usize].triangles[hit.triangle as usize].map(|i| i as usize);
            mesh.interpolate(&indices, [1.0 - hit.u - hit.v, hit.u, hit.v], point);
        }
        if hit.instance != NONE {
            self.place(point, &hit);
        }
        point.frame = if mesh.wants_tangents {
            Frame::from_normal_tangent(point.frame.n, point.dpdu)
        } else {
            Frame::from_normal(point.frame.n)
        };
    }

    /// From group space to the world; `frame.n` carries the shading normal.
    #[cold]
    fn place(&self, point: &mut SurfacePoint, hit: &Hit) {
        let m: &Affine3A = &self.geometry.instances[hit.instance as usize].to_world;
        let normals = &self.instance_normals[hit.instance as usize];
        // The bound grows with the map's absolute values, and the map itself rounds; the backend rounds the ray into
        // group space as well, which the last factor covers.
        let linear = m.matrix3;
        let absolute = Mat3A::from_cols(linear.x_axis.abs(), linear.y_axis.abs(), linear.z_axis.abs()) * point.p.abs();
        let gain = (linear.x_axis.abs() + linear.y_axis.abs() + linear.z_axis.abs()).max_element();
        let rounding = crate::math::float::gamma(6) * (absolute + Vec3::from(m.translation).abs()).max_element();
        point.error = 2.0 * (gain * point.error + rounding);
        // The edges of group space keep off by what the error is there: lengths shrink by the norm of the inverse at most.
        let shrink =
            normals.x_axis.length_squared() + normals.y_axis.length_squared() + normals.z_axis.length_squared();
        let (code, in_group) = ([hit.u, hit.v], point.error * shrink.sqrt());
        let moved = match self.geometry.round_shape(hit.mesh) {
            Some(shape) => Some(shape.point_off_edges(code, in_group).p),
            None => {
                let triangle = self.triangles.triangle(self.triangles.mesh(hit), hit);
                triangle.moved_off_edges([1.0 - hit.u - hit.v, hit.u, hit.v], in_group)
            }
        };
        point.p = moved.unwrap_or(point.p);
        point.p = m.transform_point3(point.p);
        point.ng = (*normals * point.ng).normalize();
        point.frame.n = (*normals * point.frame.n).normalize();
        point.dpdu = m.transform_vector3(point.dpdu);
        point.dpdv = m.transform_vector3(point.dpdv);
    }

    /// A tracer of rays through the scene, with empty counters.
    #[inline]
    pub fn tracer(&self) -> Tracer<'_> {
        // With media, the light that passes a segment is known before its ray is traced (`path::flight`).
        let asks_masks = self.features.contains(Features::MASKS) && self.media.is_empty();
        Tracer::new(&*self.query, asks_masks.then_some(self))
    }

    /// The light that the surface hit belongs to.
    #[inline]
    pub fn light_of(&self, hit: &Hit) -> Option<LightId> {
        self.triangles.mesh(hit).light(hit.triangle).map(LightId)
    }
}

impl MaskLookup for PreparedScene {
    fn mask_point(&self, hit: &Hit) -> MaskPoint {
        let (point, material) = self.surface_point(hit);
        MaskPoint { p: point.p, error: point.error, ng: point.ng, holes: material.holes(&point) }
    }
}
