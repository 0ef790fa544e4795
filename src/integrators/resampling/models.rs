//! The knowledge of the weights of resampled connections: the connection factors of `mis::factors`, with the look-ups
//! at cache points that they need.
//!
//! A weight is wanted before its path's own shadow ray is sent, so the rays between cache points and vertices are
//! traced at once and not queued. Those to a vertex that was drawn are not traced at all: the pmfs at the cache points
//! know their answers.
//!
//! A cache point sees a vertex if any light passes the masks between. How much passes counts in the pmfs, and not in the
//! factor, which need not be good for the result to be right.

use super::settings::ResamplingSettings;
use super::strategy::{CacheStructure, NearestCaches};
use crate::math::{Rgb, Vec3};
use crate::mis::ConnectionFactor;
use crate::mis::factors::{Balance, CacheTerm, CacheTerms, NormalizationEstimate, PerCacheFactor, RisFactor, Stages};
use crate::path::StoredPlace;
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{RayKind, SegmentPacket, Tracer};

/// A connection factor with its look-ups at cache points.
pub(super) trait CacheFactor: ConnectionFactor {
    /// See [`ConnectionStrategy::Lookup`](crate::bidir::ConnectionStrategy::Lookup).
    type Lookup: Copy + Default + Send + Sync;

    /// See [`ConnectionStrategy::NEEDS_LIGHT_VERTEX`](crate::bidir::ConnectionStrategy::NEEDS_LIGHT_VERTEX).
    const NEEDS_LIGHT_VERTEX: bool;

    /// The factor of the coming iteration.
    fn new(settings: &ResamplingSettings, stages: Stages) -> Self;

    /// Looks up the side of the direction `d` of an eye vertex.
    fn look_up(caches: &CacheStructure, z: &StoredPlace, d: Vec3) -> Self::Lookup;

    /// The look-up of an eye vertex whose candidate has been drawn by `near`: entry `entry` of the pmfs.
    fn drawn(_caches: &CacheStructure, _near: &NearestCaches, _entry: usize) -> Option<Self::Lookup> {
        None
    }

    /// Completes a look-up by the visibility of a light vertex.
    fn see(_caches: &CacheStructure, _lookup: &mut Self::Lookup, _y: &SegmentEnd, _tracer: &mut Tracer) {}

    /// The argument of the factor of the edge from the light vertex at `y`, with the adjoint BSDF value `value`, to the
    /// eye vertex.
    fn edge(caches: &CacheStructure, lookup: &Self::Lookup, y: &StoredPlace, value: impl Fn(Vec3) -> Rgb)
    -> Self::Edge;
}

impl CacheFactor for Balance {
    type Lookup = ();

    const NEEDS_LIGHT_VERTEX: bool = false;

    fn new(_settings: &ResamplingSettings, _stages: Stages) -> Balance {
        Balance
    }

    #[inline]
    fn look_up(_caches: &CacheStructure, _z: &StoredPlace, _d: Vec3) {}

    #[inline]
    fn edge(_caches: &CacheStructure, (): &(), _y: &StoredPlace, _value: impl Fn(Vec3) -> Rgb) {}
}

impl CacheFactor for RisFactor {
    type Lookup = NormalizationEstimate;

    const NEEDS_LIGHT_VERTEX: bool = false;

    fn new(settings: &ResamplingSettings, stages: Stages) -> RisFactor {
        RisFactor {
            stages,
            uniform_share: 1.0 / (settings.neighbors + 1) as f32,
            min_unseen_fraction: settings.min_unseen_fraction,
        }
    }

    #[inline]
    fn look_up(caches: &CacheStructure, z: &StoredPlace, d: Vec3) -> NormalizationEstimate {
        caches.points.as_ref().map_or_else(NormalizationEstimate::default, |points| points.normalization_at(z, d))
    }

    #[inline]
    fn edge(
        _caches: &CacheStructure,
        lookup: &NormalizationEstimate,
        _y: &StoredPlace,
        _value: impl Fn(Vec3) -> Rgb,
    ) -> NormalizationEstimate {
        *lookup
    }
}

/// The cache points near an eye vertex, and those among them that see a light vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CacheVisibility {
    near: NearestCaches,
    /// Bit i set: light of the light vertex reaches cache point i.
    mask: u16,
}

impl CacheFactor for PerCacheFactor {
    type Lookup = CacheVisibility;

    const NEEDS_LIGHT_VERTEX: bool = true;

    fn new(settings: &ResamplingSettings, stages: Stages) -> PerCacheFactor {
        PerCacheFactor { stages, per_cache: settings.per_cache }
    }

    #[inline]
    fn look_up(caches: &CacheStructure, z: &StoredPlace, d: Vec3) -> CacheVisibility {
        CacheVisibility { near: caches.nearest(z, d), mask: 0 }
    }

    #[inline]
    fn drawn(caches: &CacheStructure, near: &NearestCaches, entry: usize) -> Option<CacheVisibility> {
        Some(CacheVisibility { near: *near, mask: caches.pmfs.seen(near.caches(), entry) })
    }

    fn see(caches: &CacheStructure, lookup: &mut CacheVisibility, y: &SegmentEnd, tracer: &mut Tracer) {
        let mut packet = SegmentPacket::default();
        for &cache in lookup.near.caches() {
            if let Some(points) = &caches.points {
                packet.push(&segment(points.end(cache), y));
            }
        }
        lookup.mask = tracer.visible_packet(&packet, RayKind::ShadowWeight);
    }

    fn edge(
        caches: &CacheStructure,
        lookup: &CacheVisibility,
        y: &StoredPlace,
        value: impl Fn(Vec3) -> Rgb,
    ) -> CacheTerms {
        let near = lookup.near.caches();
        let mut terms = CacheTerms { count: near.len(), ..CacheTerms::default() };
        let Some(points) = &caches.points else { return terms };
        for (i, (term, &cache)) in terms.terms.iter_mut().zip(near).enumerate() {
            term.q = points.q(cache);
            let Some((towards, jacobian)) = points.direction_from(y.position(), cache) else { continue };
            let full = if lookup.mask >> i & 1 == 1 { value(towards) * jacobian } else { Rgb::BLACK };
            let first_stage = y.cosine(towards).abs() * jacobian;
            if full.luminance().is_finite() && first_stage.is_finite() {
                *term = CacheTerm { full, first_stage, ..*term };
            }
        }
        terms
    }
}
