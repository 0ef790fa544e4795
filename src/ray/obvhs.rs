//! The pure-Rust backend: an eight-wide compressed tree (Ylitie et al. 2017, crate `obvhs`) around our own triangle
//! test.
//!
//! The crate's node test has absolute epsilons, so it works in a private space: the scene is centred and scaled by a
//! power of two (exact in floating point) to a diagonal near 2¹², and directions are normalised. Leaf boxes are
//! inflated by 2⁻²¹ of their largest coordinate, and the triangle test uses edge functions that are shared by
//! neighbours (Plücker, Davidovič et al. 2012), so that a ray through a shared edge never slips between two triangles.
//! Instances are flattened. Round shapes have a tree of their own, so that triangles pay nothing for them.

use super::geometry::Geometry;
use super::{Hit, QueryError, Ray, RayQuery, RoundShape, SurfaceMask};
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

/// Box of a round shape in the private space.
struct ShapeBox {
    lo: Vec3A,
    hi: Vec3A,
}

impl Boundable for ShapeBox {
    fn aabb(&self) -> Aabb {
        let margin = self.lo.abs().max(self.hi.abs()).max_element() * (-21f32).exp2();
        Aabb { min: self.lo - margin, max: self.hi + margin }
    }
}

/// A round shape in the world.
#[derive(Clone)]
struct Round {
    shape: RoundShape,
    surface: u32,
    instance: u32,
}

/// The tree over the round shapes, which are in its leaf order.
struct RoundTree {
    tree: CwBvh,
    round: Vec<Round>,
}

impl RoundTree {
    /// `None` if there are no round shapes; `enter` moves a point into the private space.
    fn build(geometry: &Geometry, enter: impl Fn(Vec3) -> Vec3A) -> Option<RoundTree> {
        let mut round = vec![];
        geometry.for_each_placed_round(|surface, instance, shape| round.push(Round { shape, surface, instance }));
        if round.is_empty() {
            return None;
        }
        let box_of = |r: &Round| {
            let (lo, hi) = r.shape.bounds();
            ShapeBox { lo: enter(lo), hi: enter(hi) }
        };
        let boxes: Vec<ShapeBox> = round.iter().map(box_of).collect();
        let mut time = std::time::Duration::ZERO;
        let mut tree = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut time);
        let order = std::mem::take(&mut tree.primitive_indices);
        Some(RoundTree { tree, round: order.iter().map(|&i| round[i as usize].clone()).collect() })
    }

    /// The first round shape of the kinds `surfaces` in the ray's interval; `inner` is the ray in the private space, `length` as from
    /// [`ObvhsScene::enter`].
    fn closest(&self, ray: &Ray, inner: TreeRay, length: f32, surfaces: SurfaceMask) -> Option<Hit> {
        let (mut best, mut nearest) = (None, f64::INFINITY);
        let mut hit = RayHit::none();
        self.tree.ray_traverse(inner, &mut hit, |_, id| {
            let Round { shape, surface, instance } = &self.round[id];
            match shape.intersect(ray.o, ray.d, [ray.t_min, ray.t_max]) {
                Some((t, [u, v])) if shape.surface.intersects(surfaces) => {
                    if t < nearest {
                        nearest = t;
                        best = Some(Hit { t: t as f32, u, v, triangle: 0, mesh: *surface, instance: *instance });
                    }
                    t as f32 * length
                }
                _ => f32::INFINITY,
            }
        });
        best
    }

    fn occluded(&self, ray: &Ray, inner: TreeRay, blockers: SurfaceMask) -> bool {
        !self.tree.ray_traverse_miss(inner, |inner, id| {
            let shape = &self.round[id].shape;
            let met =
                shape.surface.intersects(blockers) && shape.intersect(ray.o, ray.d, [ray.t_min, ray.t_max]).is_some();
            // The interval is that of the ray itself: whatever is met is before the end of the private one.
            if met { inner.tmin } else { f32::INFINITY }
        })
    }
}

/// A flattened scene.
pub struct ObvhsScene {
    tree: Option<CwBvh>,
    round: Option<RoundTree>,
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
        let count = geometry.triangle_count() + geometry.round_count();
        if u32::try_from(count).is_err() {
            return Err(QueryError(format!("{count} surfaces are more than the obvhs backend can hold")));
        }
        let (lo, hi) = geometry.bounds().unwrap_or((Vec3::ZERO, Vec3::ZERO));
        let centre = 0.5 * (lo + hi);
        let diagonal = (hi - lo).length();
        let log2 = if diagonal > 0.0 { PRIVATE_DIAGONAL_LOG2 - diagonal.log2().round() as i32 } else { 0 };
        let scale = (log2.clamp(-100, 100) as f32).exp2();

        let (mut corners, mut identities) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let round = RoundTree::build(geometry, |p| Vec3A::from((p - centre) * scale));
        geometry.for_each_placed_mesh(|mesh, instance, to_world| {
            let buffers = &geometry.meshes[mesh as usize];
            for triangle in 0..buffers.triangles.len() as u32 {
                let placed = buffers.corners(triangle).map(|p| to_world.map_or(p, |m| m.transform_point3(p)));
                corners.push(Corners(placed.map(|p| Vec3A::from((p - centre) * scale))));
                identities.push(Identity { triangle, mesh, instance, surface: buffers.surface });
            }
        });
        if corners.is_empty() {
            return Ok(ObvhsScene { tree: None, round, corners, identities, centre, scale });
        }
        let mut time = std::time::Duration::ZERO;
        let mut tree = build_cwbvh(&corners, BvhBuildParams::medium_build(), &mut time);
        // Triangles in leaf order: no look-up between the leaf and its triangle.
        let order = std::mem::take(&mut tree.primitive_indices);
        let ordered = order.iter().map(|&i| Corners(corners[i as usize].0)).collect();
        let identities = order.iter().map(|&i| identities[i as usize]).collect();
        Ok(ObvhsScene { tree: Some(tree), round, corners: ordered, identities, centre, scale })
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

    fn closest_of(&self, ray: &Ray, surfaces: SurfaceMask) -> Option<Hit> {
        let (inner, length) = self.enter(ray)?;
        let Some(round) = &self.round else { return self.closest_triangle(inner, length, surfaces) };
        let triangle = self.closest_triangle(inner, length, surfaces);
        let nearest = Ray { t_max: triangle.map_or(ray.t_max, |hit| hit.t), ..*ray };
        round.closest(&nearest, self.enter(&nearest)?.0, length, surfaces).or(triangle)
    }

    fn occluded(&self, ray: &Ray, blockers: SurfaceMask) -> bool {
        let Some((inner, _)) = self.enter(ray) else { return false };
        self.occluded_by_triangle(inner, blockers)
            || self.round.as_ref().is_some_and(|round| round.occluded(ray, inner, blockers))
    }
}

impl ObvhsScene {
    /// The first triangle of the kinds `surfaces` in the interval of the ray `inner` in the private space, where a unit of the ray parameter is
    /// `length` long.
    fn closest_triangle(&self, inner: TreeRay, length: f32, surfaces: SurfaceMask) -> Option<Hit> {
        let tree = self.tree.as_ref()?;
        let mut best = (0.0, 0.0);
        let mut nearest = f32::INFINITY;
        let mut hit = RayHit::none();
        let found = tree.ray_traverse(inner, &mut hit, |ray, id| match intersect(&self.corners[id], ray) {
            Some((t, u, v)) if self.identities[id].surface.intersects(surfaces) => {
                if t < nearest {
                    (nearest, best) = (t, (u, v));
                }
                t
            }
            _ => f32::INFINITY,
        });
        found.then(|| {
            let id = &self.identities[hit.primitive_id as usize];
            let Identity { triangle, mesh, instance, .. } = *id;
            Hit { t: hit.t / length, u: best.0, v: best.1, triangle, mesh, instance }
        })
    }

    fn occluded_by_triangle(&self, inner: TreeRay, blockers: SurfaceMask) -> bool {
        let Some(tree) = &self.tree else { return false };
        !tree.ray_traverse_miss(inner, |ray, id| match intersect(&self.corners[id], ray) {
            Some((t, ..)) if self.identities[id].surface.intersects(blockers) => t,
            _ => f32::INFINITY,
        })
    }
}
