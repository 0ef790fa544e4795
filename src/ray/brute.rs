//! The oracle: every surface against every ray, in double precision. Slow on purpose; nothing here is approximate but
//! f64 itself.

use super::geometry::Geometry;
use super::{Hit, Ray, RayQuery, RoundShape, SurfaceMask};
use glam::DVec3;

struct Triangle {
    corners: [DVec3; 3],
    triangle: u32,
    mesh: u32,
    instance: u32,
    surface: SurfaceMask,
}

/// A round shape in world space.
struct Round {
    shape: RoundShape,
    surface: u32,
    instance: u32,
}

/// All surfaces in world space.
pub struct BruteScene {
    triangles: Vec<Triangle>,
    round: Vec<Round>,
}

impl BruteScene {
    /// Copies every surface, instances placed.
    pub fn build(geometry: &Geometry) -> BruteScene {
        let mut triangles = Vec::with_capacity(geometry.triangle_count());
        geometry.for_each_placed_mesh(|mesh, instance, to_world| {
            let buffers = &geometry.meshes[mesh as usize];
            for triangle in 0..buffers.triangles.len() as u32 {
                let corners = buffers.corners(triangle).map(|p| match to_world {
                    // The product in double precision of the single precision map that the other backends get.
                    Some(m) => {
                        glam::DMat3::from_cols(
                            m.matrix3.x_axis.as_dvec3(),
                            m.matrix3.y_axis.as_dvec3(),
                            m.matrix3.z_axis.as_dvec3(),
                        ) * p.as_dvec3()
                            + m.translation.as_dvec3()
                    }
                    None => p.as_dvec3(),
                });
                triangles.push(Triangle { corners, triangle, mesh, instance, surface: buffers.surface });
            }
        });
        let mut round = vec![];
        geometry.for_each_placed_round(|surface, instance, shape| round.push(Round { shape, surface, instance }));
        BruteScene { triangles, round }
    }
}

/// (t, u, v) of the plane's hit if it is inside the triangle, edges included (Möller & Trumbore 1997).
fn intersect(c: &[DVec3; 3], o: DVec3, d: DVec3) -> Option<(f64, f64, f64)> {
    let (e1, e2) = (c[1] - c[0], c[2] - c[0]);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = o - c[0];
    let q = s.cross(e1);
    let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
    // Rounding of f64 alone: a ray through a shared edge must hit one of the two triangles.
    let slack = 1e-12;
    (u >= -slack && v >= -slack && u + v <= 1.0 + slack).then_some((t, u, v))
}

impl RayQuery for BruteScene {
    fn describe(&self) -> String {
        "brute force in double precision".into()
    }

    fn closest_of(&self, ray: &Ray, surfaces: SurfaceMask) -> Option<Hit> {
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let mut nearest = f64::from(ray.t_max);
        let mut best = None;
        for tri in self.triangles.iter().filter(|tri| tri.surface.intersects(surfaces)) {
            if let Some((t, u, v)) = intersect(&tri.corners, o, d)
                && t >= f64::from(ray.t_min)
                && t < nearest
            {
                nearest = t;
                best = Some(Hit {
                    t: t as f32,
                    u: u as f32,
                    v: v as f32,
                    triangle: tri.triangle,
                    mesh: tri.mesh,
                    instance: tri.instance,
                });
            }
        }
        for Round { shape, surface, instance } in &self.round {
            if shape.surface.intersects(surfaces)
                && let Some((t, [u, v])) = shape.intersect(ray.o, ray.d, [ray.t_min, ray.t_max])
                && t < nearest
            {
                nearest = t;
                best = Some(Hit { t: t as f32, u, v, triangle: 0, mesh: *surface, instance: *instance });
            }
        }
        best
    }

    fn occluded(&self, ray: &Ray, blockers: SurfaceMask) -> bool {
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let inside = f64::from(ray.t_min)..f64::from(ray.t_max);
        let met = |tri: &Triangle| intersect(&tri.corners, o, d).is_some_and(|(t, ..)| inside.contains(&t));
        let interval = [ray.t_min, ray.t_max];
        self.triangles.iter().any(|tri| tri.surface.intersects(blockers) && met(tri))
            || self.round.iter().any(|Round { shape, .. }| {
                shape.surface.intersects(blockers) && shape.intersect(ray.o, ray.d, interval).is_some()
            })
    }
}
