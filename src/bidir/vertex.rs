//! Vertices of light sub-paths that eye vertices can be connected to.

use crate::math::{Rgb, Vec3};
use crate::mis::ResamplingTarget;
use crate::path::StoredPlace;
use crate::shade::{BsdfPool, BsdfView, StoredBsdf, Transport};

/// A vertex y_{s−1} of a light sub-path, s ≥ 2. There are many of them: they hold only what a connection reads.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex {
    /// Place of the vertex.
    pub place: StoredPlace,
    /// Unit direction towards y_{s−2}.
    pub wo: Vec3,
    /// β_L: all factors of the measurement contribution up to the vertex, over its density.
    pub throughput: Rgb,
    /// Survival of Russian roulette of a light sub-path here.
    pub survival: f32,
    /// s: the vertices of the sub-path up to this one.
    pub s: u32,
    /// The BSDF, resolved for `wo`; its lobes are in the pool of the vertex's sub-path or store.
    pub bsdf: StoredBsdf,
}

impl LightVertex {
    /// Number of vertices of the sub-path up to this one.
    #[inline]
    pub fn length(&self) -> usize {
        self.s as usize
    }

    /// The vertex's BSDF, which `pool` holds.
    #[inline]
    pub fn bsdf_in<'a>(&'a self, pool: &'a BsdfPool) -> BsdfView<'a> {
        let ng = match self.place {
            StoredPlace::Surface { ng, .. } => ng,
            StoredPlace::Medium(_) => Vec3::ZERO,
        };
        pool.get(&self.bsdf, ng)
    }

    /// q̂₂/p and q̂₁/p at a point `p` of a surface, on the side of the unit normal `n`, or of a medium, where `n` is zero;
    /// visibility taken for granted. `bsdf` is the vertex's BSDF.
    #[inline]
    pub fn target_over_pdf(&self, bsdf: &BsdfView, p: Vec3, n: Vec3) -> ResamplingTarget {
        let Some((towards, jacobian)) = direction_to(self.place.position(), p, n) else {
            return ResamplingTarget::default();
        };
        let value = bsdf.eval(self.wo, towards, Transport::Importance);
        let target = ResamplingTarget {
            full: (self.throughput * value).luminance() * jacobian, // [RISBPT eq. 15, without V]
            first_stage: self.throughput.luminance() * self.place.cosine(towards).abs() * jacobian, // [two-stage §5.1]
        };
        if target.full.is_finite() && target.first_stage.is_finite() { target } else { ResamplingTarget::default() }
    }
}

/// Unit direction from `from` to a surface at `p` on the side of the unit normal `n`, and the area Jacobian |cos| / d²
/// there; none if it arrives from below. In a medium `n` is zero, and the Jacobian 1 / d².
#[inline]
pub fn direction_to(from: Vec3, p: Vec3, n: Vec3) -> Option<(Vec3, f32)> {
    let to = p - from;
    let dist2 = to.length_squared();
    let towards = to * (1.0 / dist2.sqrt());
    let cos = -n.dot(towards);
    // A point has no direction to itself: NaN is not above the horizon.
    if cos > 0.0 {
        return Some((towards, cos / dist2));
    }
    (n == Vec3::ZERO && dist2 > 0.0).then(|| (towards, 1.0 / dist2))
}
