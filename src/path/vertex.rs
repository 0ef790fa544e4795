//! A vertex of a sub-path.

use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::ray::Hit;
use crate::shade::{Bsdf, SurfacePoint};

/// How a vertex was reached.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Where the walk was before (a lens point, a light's point, a surface).
    pub from: Vec3,
    /// Shading normal of the vertex before, if it was on a surface that reflects only (light choice may use it).
    pub from_normal: Option<Vec3>,
    /// Density per steradian with which the direction was drawn; of a delta event its discrete probability.
    pub pdf: SolidAnglePdf,
    /// The direction was drawn from a delta lobe (or through a pinhole): no other technique finds this edge.
    pub delta: bool,
    /// Probability with which Russian roulette let the walk go on into this edge.
    pub survival: f32,
    /// Length.
    pub distance: f32,
}

/// A vertex on a surface, as hooks see it: what is large is borrowed from the walk, which makes it in place.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceVertex<'a> {
    /// Number of the vertex, counted from the sub-path's origin: the first hit is 1.
    pub index: u32,
    /// What was hit.
    pub hit: &'a Hit,
    /// The point.
    pub point: &'a SurfacePoint,
    /// The BSDF there, seen from `wo`.
    pub bsdf: &'a Bsdf,
    /// Unit direction back to the vertex before.
    pub wo: Vec3,
    /// Throughput up to this vertex: everything of the measurement contribution that the walk has passed, divided by its density.
    pub throughput: Rgb,
    /// How it was reached.
    pub edge: &'a Edge,
    /// Normal that the choice of a light may use here: none where light from behind contributes, or where the scene's choice
    /// does not depend on the place.
    pub light_normal: Option<Vec3>,
}
