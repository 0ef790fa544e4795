//! Walks through the holes of masks.
//!
//! A walk that meets a mask goes straight on with the probability of a hole there, and has a vertex there otherwise (see
//! `ray::transmittance`). What it passes is no vertex: it counts neither for the limit on edges nor for Russian
//! roulette.

use super::vertex::{Edge, Place, Scatter, Vertex};
use super::walk::WalkHooks;
use crate::math::Rgb;
use crate::math::hash::HashRng;
use crate::media::MediumNumber;
use crate::prepared::PreparedScene;
use crate::ray::transmittance::{MAX_CROSSINGS, beyond};
use crate::ray::{Hit, MaskPoint, Ray, RayKind, Tracer};
use crate::shade::{Bsdf, Material, SurfacePoint};

/// An edge of a walk that has met a surface.
pub(super) struct Passage<'s, 'a> {
    pub scene: &'s PreparedScene,
    /// The ray that met the surface.
    pub ray: Ray,
    pub edge: &'a mut Edge,
    /// The hit of the surface, and its point.
    pub hit: Hit,
    pub point: &'a mut SurfacePoint,
}

impl<'s> Passage<'s, '_> {
    /// Goes on through holes until a surface stops the walk, and returns its hit and material; `None` if the walk leaves
    /// the scene. `material` is that of the first surface; `passed` looks at what the walk passes.
    #[inline]
    pub fn go_on(
        &mut self,
        material: &'s Material,
        kind: RayKind,
        tracer: &mut Tracer,
        rng: &mut HashRng,
        passed: impl FnMut(&Passage),
    ) -> Option<(Hit, &'s Material)> {
        match material.features().passes_through {
            true => self.pass(material, kind, tracer, rng, passed),
            false => Some((self.hit, material)),
        }
    }

    #[cold]
    fn pass(
        &mut self,
        mut material: &'s Material,
        kind: RayKind,
        tracer: &mut Tracer,
        rng: &mut HashRng,
        mut passed: impl FnMut(&Passage),
    ) -> Option<(Hit, &'s Material)> {
        for _ in 0..MAX_CROSSINGS {
            let holes = material.holes(self.point);
            // Numbers in [0, 1) are below one, and none is below zero.
            if holes <= 0.0 || holes < 1.0 && rng.next_f32() >= holes {
                return Some((self.hit, material));
            }
            passed(self);
            self.edge.transmittance *= holes;
            let SurfacePoint { p, error, ng, .. } = *self.point;
            self.ray = beyond(&self.ray, self.hit.t, &MaskPoint { p, error, ng, holes });
            let Some(hit) = tracer.closest(&self.ray, kind) else {
                self.edge.distance = f32::INFINITY;
                return None;
            };
            self.hit = hit;
            material = self.scene.surface_point_into(&hit, self.point);
            self.edge.distance = (self.point.p - self.edge.from).length();
        }
        tracer.stats.invalid += 1;
        None
    }

    /// Shows a surface that emits, and that the walk passes, to the hooks, as the vertex `index`.
    pub fn show_emission(&self, index: u32, throughput: Rgb, hooks: &mut impl WalkHooks) {
        if self.scene.light_of(&self.hit).is_none() {
            return;
        }
        let bsdf = Bsdf::empty(self.point);
        let place = Place::Surface { point: self.point, hit: &self.hit };
        let scatter = Scatter(&bsdf);
        // The path ends there: media beside the surface do not matter.
        let media = [MediumNumber::VACUUM; 2];
        let wo = -self.ray.d;
        hooks.passing(&Vertex {
            index,
            place,
            scatter,
            wo,
            throughput,
            unattenuated: throughput,
            media,
            edge: self.edge,
        });
    }
}

/// The first surface that a camera ray does not pass by chance: its hit, its point and its material.
pub fn first_seen<'s>(
    scene: &'s PreparedScene,
    ray: &Ray,
    tracer: &mut Tracer,
    rng: &mut HashRng,
) -> Option<(Hit, SurfacePoint, &'s Material)> {
    let hit = tracer.closest(ray, RayKind::Camera)?;
    let mut point = SurfacePoint::default();
    let material = scene.surface_point_into(&hit, &mut point);
    let mut edge = Edge::new(ray.o, crate::math::SolidAnglePdf(1.0));
    edge.distance = hit.t;
    let mut passage = Passage { scene, ray: *ray, edge: &mut edge, hit, point: &mut point };
    let (hit, material) = passage.go_on(material, RayKind::Camera, tracer, rng, |_| {})?;
    Some((Hit { t: edge.distance, ..hit }, point, material))
}
