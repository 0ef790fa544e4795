//! The pure-Rust backend: an eight-wide compressed tree (Ylitie et al. 2017, crate `obvhs`) around our own triangle
//! test.
//!
//! The crate's node test has absolute epsilons, so it works in a private space: the scene is centred and scaled by a
//! power of two (exact in floating point) to a diagonal near 2¹², and directions are normalised. Leaf boxes are
//! inflated by 2⁻²¹ of their largest coordinate, and the triangle test uses edge functions that are shared by
//! neighbours (Plücker, Davidovič et al. 2012), so that a ray through a shared edge never slips between two triangles.
//! Instances are flattened.

use super::geometry::Geometry;
use super::{Hit, QueryError, Ray, RayQuery, SurfaceMask};
use crate::math::Vec3;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as TreeRay, RayHit};
use obvhs::{Boundable, BvhBuildParams};

/// log2 of the private diagonal.
const PRIVATE_DIAGONAL_LOG2: i32 = 12;

/// A triangle in the private space.
struct Corners([Vec3A; 3]);

impl Boundable for Corners {
    fn aabb(&self) -> Aabb {
        let [a, b, c] = self.0;
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let margin = lo.abs().max(hi.abs()).max_element() * (-21f32).exp2();
        Aabb { min: lo - margin, max: hi + margin }
    }
}

#[derive(Clone, Copy)]
struct Identity {
    triangle: u32,
    mesh: u32,
    instance: u32,
    surface: SurfaceMask,
}

/// A flattened scene.
pub struct ObvhsScene {
    tree: Option<CwBvh>,
    /// In the tree's leaf order.
    corners: Vec<Corners>,
    identities: Vec<Identity>,
    centre: Vec3,
    scale: f32,
}

impl ObvhsScene {
    /// Builds the tree.
    ///
    /// # Errors
    /// If there are more triangles than the tree can number.
    pub fn build(geometry: &Geometry) -> Result<ObvhsScene, QueryError> {
        let count = geometry.triangle_count();
        if u32::try_from(count).is_err() {
            return Err(QueryError(format!("{count} triangles are more than the obvhs backend can hold")));
        }
        let (lo, hi) = geometry.bounds().unwrap_or((Vec3::ZERO, Vec3::ZERO));
        let centre = 0.5 * (lo + hi);
        let diagonal = (hi - lo).length();
        let log2 = if diagonal > 0.0 { PRIVATE_DIAGONAL_LOG2 - diagonal.log2().round() as i32 } else { 0 };
        let scale = (log2.clamp(-100, 100) as f32).exp2();

        let (mut corners, mut identities) = (Vec::with_capacity(count), Vec::with_capacity(count));
        geometry.for_each_placed(|mesh, instance, to_world| {
            let buffers = &geometry.meshes[mesh as usize];
            for triangle in 0..buffers.triangles.len() as u32 {
                let placed = buffers.corners(triangle).map(|p| to_world.map_or(p, |m| m.transform_point3(p)));
                corners.push(Corners(placed.map(|p| Vec3A::from((p - centre) * scale))));
                identities.push(Identity { triangle, mesh, instance, surface: buffers.surface });
            }
        });
        if corners.is_empty() {
            return Ok(ObvhsScene { tree: None, corners, identities, centre, scale });
        }
        let mut time = std::time::Duration::ZERO;
        let mut tree = build_cwbvh(&corners, BvhBuildParams::medium_build(), &mut time);
        // Triangles in leaf order: no look-up between the leaf and its triangle.
        let order = std::mem::take(&mut tree.primitive_indices);
        let ordered = order.iter().map(|&i| Corners(corners[i as usize].0)).collect();
        let identities = order.iter().map(|&i| identities[i as usize]).collect();
        Ok(ObvhsScene { tree: Some(tree), corners: ordered, identities, centre, scale })
    }

    /// The ray in the private space with a unit direction, and the length of `d` there: private t = t · length.
    fn enter(&self, ray: &Ray) -> Option<(TreeRay, f32)> {
        let d = ray.d * self.scale;
        let length = d.length();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let o = (ray.o - self.centre) * self.scale;
        Some((TreeRay::new(o.into(), (d / length).into(), ray.t_min * length, ray.t_max * length), length))
    }
}

/// (t, u, v) of a hit in the ray's interval, else nothing. Edge functions are products of the edges' ends alone, so two
/// triangles that share an edge compute the same number for it (with opposite sign), and none leaks between them.
#[inline]
fn intersect(corners: &Corners, ray: &TreeRay) -> Option<(f32, f32, f32)> {
    let (o, d) = (ray.origin, ray.direction);
    let [v0, v1, v2] = corners.0.map(|v| v - o);
    let (e0, e1, e2) = (v2 - v0, v0 - v1, v1 - v2);
    let w0 = e0.cross(v2 + v0).dot(d);
    let w1 = e1.cross(v0 + v1).dot(d);
    let w2 = e2.cross(v1 + v2).dot(d);
    let sum = w0 + w1 + w2;
    // The tolerance is relative to the sum, as the rounding of the edge functions is.
    let slack = f32::EPSILON * sum.abs();
    if w0.min(w1).min(w2) < -slack && w0.max(w1).max(w2) > slack {
        return None;
    }
    let n = e1.cross(e0);
    let den = n.dot(d);
    if den == 0.0 || sum == 0.0 {
        return None;
    }
    let t = v0.dot(n) / den;
    if !(t >= ray.tmin && t < ray.tmax) {
        return None;
    }
    // The edge opposite to a corner carries its weight: e0 = v2 − v0 is opposite to v1, e1 = v0 − v1 to v2.
    Some((t, (w0 / sum).clamp(0.0, 1.0), (w1 / sum).clamp(0.0, 1.0)))
}

impl RayQuery for ObvhsScene {
    fn describe(&self) -> String {
        "obvhs (CWBVH, pure Rust)".into()
    }

    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let (tree, (inner, length)) = (self.tree.as_ref()?, self.enter(ray)?);
        let mut best = (0.0, 0.0);
        let mut nearest = f32::INFINITY;
        let mut hit = RayHit::none();
        let found = tree.ray_traverse(inner, &mut hit, |ray, id| match intersect(&self.corners[id], ray) {
            Some((t, u, v)) => {
                if t < nearest {
                    (nearest, best) = (t, (u, v));
                }
                t
            }
            None => f32::INFINITY,
        });
        found.then(|| {
            let id = &self.identities[hit.primitive_id as usize];
            let Identity { triangle, mesh, instance, .. } = *id;
            Hit { t: hit.t / length, u: best.0, v: best.1, triangle, mesh, instance }
        })
    }

    fn occluded(&self, ray: &Ray, blockers: SurfaceMask) -> bool {
        let Some(tree) = &self.tree else { return false };
        let Some((inner, _)) = self.enter(ray) else { return false };
        !tree.ray_traverse_miss(inner, |ray, id| match intersect(&self.corners[id], ray) {
            Some((t, ..)) if self.identities[id].surface.intersects(blockers) => t,
            _ => f32::INFINITY,
        })
    }
}
