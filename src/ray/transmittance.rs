//! The light that passes a segment.
//!
//! Interfaces (`null` materials) let all light straight through, and masks the share 1 − α of it, α being their
//! opacity at the point. Neither is a vertex of a path. A segment between two vertices x and y of a path has the
//! transmittance
//!
//! τ(x, y) = 0 if a surface without holes is between, else Π (1 − α) over the masks that the segment crosses.
//!
//! It is symmetric, and known without chance: [`Tracer::transmittance`] gathers the masks of a segment one after the
//! other. Queries leave interfaces out by themselves. Whether something without holes is between is a question of its
//! own, which goes out in packets and is asked first; in scenes without masks it is the only one.
//!
//! A walk that meets a mask goes straight on with the probability 1 − α, and otherwise has a vertex there. So the
//! density with which it makes the next vertex has the factor τ, and its throughput has none. The surface of the mask
//! scatters α f, f being the BSDF that the mask covers, and the walk stops there with the probability α, from whichever
//! end it comes: α is a factor of both the path's contribution and of its density by every technique, so that neither
//! throughputs nor weights have it, and the BSDF at the vertex is f. A surface that emits does so with all of its
//! emission, whatever its opacity is: a walk meets it also where it goes on.
//!
//! Masks that coincide are one mask, of which either may be met.

use super::offset::offset_point;
use super::{Hit, Ray, RayKind, Segment, SurfaceMask, T_MIN, Tracer};
use crate::math::{Rgb, Vec3};
use std::ops::{Mul, MulAssign};

/// Masks that a ray may cross. Every crossing moves on along the ray, so that only a scene with more masks than this
/// in a row has more; what is behind them is taken to be hidden, and the ray is counted with those that are not valid.
pub const MAX_CROSSINGS: u32 = 1 << 20;

/// The share of light that passes a segment, in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmittance(f32);

impl Transmittance {
    /// No light passes.
    pub const ZERO: Transmittance = Transmittance(0.0);
    /// All light passes.
    pub const ONE: Transmittance = Transmittance(1.0);

    /// The share.
    #[inline]
    pub fn share(self) -> f32 {
        self.0
    }

    /// All light passes.
    #[inline]
    pub fn is_one(self) -> bool {
        self.0 == 1.0
    }

    /// No light passes.
    #[inline]
    pub fn is_zero(self) -> bool {
        self.0 <= 0.0
    }
}

impl MulAssign<f32> for Transmittance {
    /// Passes another mask that lets this share through.
    #[inline]
    fn mul_assign(&mut self, share: f32) {
        self.0 *= share;
    }
}

impl Mul<Transmittance> for Rgb {
    type Output = Rgb;

    #[inline]
    fn mul(self, transmittance: Transmittance) -> Rgb {
        self * transmittance.0
    }
}

/// The point at which a ray meets a mask.
#[derive(Clone, Copy, Debug)]
pub struct MaskPoint {
    /// Position.
    pub p: Vec3,
    /// Bound on the error of any component of `p`.
    pub error: f32,
    /// Unit geometric normal, either side.
    pub ng: Vec3,
    /// 1 − α: the share of light that goes straight through.
    pub holes: f32,
}

/// Knows the opacity of masks.
pub trait MaskLookup: Sync {
    /// The mask at a hit.
    fn mask_point(&self, hit: &Hit) -> MaskPoint;
}

impl Tracer<'_> {
    /// The light that passes the masks on a segment on which nothing without holes is known to be.
    #[inline]
    pub fn transmittance(&mut self, segment: &Segment) -> Transmittance {
        match self.masks() {
            None => Transmittance::ONE,
            Some(masks) => self.gather(masks, segment),
        }
    }

    /// Multiplies the holes of all masks on a segment.
    #[cold]
    fn gather(&mut self, masks: &dyn MaskLookup, segment: &Segment) -> Transmittance {
        let mut transmittance = Transmittance::ONE;
        let mut rest = *segment;
        for _ in 0..MAX_CROSSINGS {
            let Some(hit) = self.closest_of(&rest.ray(), SurfaceMask::MASKS, RayKind::Mask) else {
                return transmittance;
            };
            let MaskPoint { p, error, ng, holes } = masks.mask_point(&hit);
            transmittance *= holes;
            if transmittance.is_zero() {
                return Transmittance::ZERO;
            }
            rest = segment.rest_from(offset_point(p, error, ng, rest.d));
        }
        self.stats.invalid += 1;
        Transmittance::ZERO
    }
}

/// A ray beyond a mask that it has met at `point`, `t` from its origin.
#[inline]
pub fn beyond(ray: &Ray, t: f32, point: &MaskPoint) -> Ray {
    let o = offset_point(point.p, point.error, point.ng, ray.d);
    Ray { o, d: ray.d, t_min: T_MIN, t_max: ray.t_max - t }
}
