//! The knowledge of the weights of importance caching: the connection factors of `mis::factors`, with the look-ups at
//! records that they need.
//!
//! A record sees a vertex if any light passes the masks between. How much passes counts in the pmfs, and not in the
//! factor, which need not be good for the result to be right.

use super::distributions::UNIFORM;
use super::strategy::{NearestRecords, RecordStructure};
use crate::math::{Rgb, Vec3};
use crate::mis::ConnectionFactor;
use crate::mis::factors::{
    Balance, LengthTerm, LengthTerms, PerLengthFactor, RecordMixtureFactor, RecordNormalization, Stages,
};
use crate::path::StoredPlace;
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{RayKind, SegmentPacket, Tracer};
use std::sync::Arc;

/// Lower bound of p/q in weights.
const EPSILON: f32 = 1e-3;
/// Fraction of the light that weights take to be unseen by a record.
const UNSEEN_FRACTION: f32 = 0.01;

/// A connection factor with its look-ups at records.
pub(super) trait RecordFactor: ConnectionFactor {
    /// See [`ConnectionStrategy::Lookup`](crate::bidir::ConnectionStrategy::Lookup).
    type Lookup: Copy + Default + Send + Sync;

    /// See [`ConnectionStrategy::NEEDS_LIGHT_VERTEX`](crate::bidir::ConnectionStrategy::NEEDS_LIGHT_VERTEX).
    const NEEDS_LIGHT_VERTEX: bool;

    /// The factor of the coming iteration.
    fn new(records: &RecordStructure) -> Self;

    /// Looks up the side of the direction `d` of an eye vertex.
    fn look_up(records: &RecordStructure, z: &StoredPlace, d: Vec3) -> Self::Lookup;

    /// Completes a look-up by the visibility of a light vertex.
    fn see(_records: &RecordStructure, _lookup: &mut Self::Lookup, _y: &SegmentEnd, _tracer: &mut Tracer) {}

    /// The argument of the factor of the edge from the light vertex at `y`, with the adjoint BSDF value `value`, to the
    /// eye vertex.
    fn edge(
        records: &RecordStructure,
        lookup: &Self::Lookup,
        y: &StoredPlace,
        value: impl Fn(Vec3) -> Rgb,
    ) -> Self::Edge;
}

impl RecordFactor for Balance {
    type Lookup = ();

    const NEEDS_LIGHT_VERTEX: bool = false;

    fn new(_records: &RecordStructure) -> Balance {
        Balance
    }

    #[inline]
    fn look_up(_records: &RecordStructure, _z: &StoredPlace, _d: Vec3) {}

    #[inline]
    fn edge(_records: &RecordStructure, (): &(), _y: &StoredPlace, _value: impl Fn(Vec3) -> Rgb) {}
}

impl RecordFactor for RecordMixtureFactor {
    type Lookup = RecordNormalization;

    const NEEDS_LIGHT_VERTEX: bool = false;

    fn new(records: &RecordStructure) -> RecordMixtureFactor {
        RecordMixtureFactor {
            stages: Stages {
                paths: records.paths as f32,
                second_stage: None,
                epsilon: EPSILON,
                vertices_per_path: records.counted.vertices_per_path() as f32,
            },
            uniform_share: UNIFORM as f32,
            unseen_fraction: UNSEEN_FRACTION,
        }
    }

    #[inline]
    fn look_up(records: &RecordStructure, z: &StoredPlace, d: Vec3) -> RecordNormalization {
        records.normalization(&records.nearest(z, d))
    }

    #[inline]
    fn edge(
        _records: &RecordStructure,
        lookup: &RecordNormalization,
        _y: &StoredPlace,
        _value: impl Fn(Vec3) -> Rgb,
    ) -> RecordNormalization {
        *lookup
    }
}

/// The records near an eye vertex, and those among them that see a light vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RecordVisibility {
    near: NearestRecords,
    /// Bit i set: light of the light vertex reaches record i.
    mask: u16,
}

impl RecordFactor for PerLengthFactor {
    type Lookup = RecordVisibility;

    const NEEDS_LIGHT_VERTEX: bool = true;

    fn new(records: &RecordStructure) -> PerLengthFactor {
        let numbers = records.share_of_length.iter().map(|share| share * records.paths as f32);
        PerLengthFactor { means: Arc::new(records.means.per_length(numbers.collect())), epsilon: EPSILON }
    }

    #[inline]
    fn look_up(records: &RecordStructure, z: &StoredPlace, d: Vec3) -> RecordVisibility {
        RecordVisibility { near: records.nearest(z, d), mask: 0 }
    }

    fn see(records: &RecordStructure, lookup: &mut RecordVisibility, y: &SegmentEnd, tracer: &mut Tracer) {
        let mut packet = SegmentPacket::default();
        for &record in lookup.near.records() {
            if let Some(end) = records.records.as_ref().and_then(|r| r.ends.get(record)) {
                packet.push(&segment(end, y));
            }
        }
        lookup.mask = tracer.visible_packet(&packet, RayKind::ShadowWeight);
    }

    fn edge(
        records: &RecordStructure,
        lookup: &RecordVisibility,
        y: &StoredPlace,
        value: impl Fn(Vec3) -> Rgb,
    ) -> LengthTerms {
        let near = lookup.near.records();
        let mut terms = LengthTerms { count: near.len(), ..LengthTerms::default() };
        let Some(all) = &records.records else { return terms };
        for (i, (term, &record)) in terms.terms.iter_mut().zip(near).enumerate() {
            let unoccluded = all.unoccluded(record, records.scheme.selection, y.position(), &value);
            let open = if unoccluded.luminance().is_finite() { unoccluded } else { Rgb::BLACK };
            let seen = if lookup.mask >> i & 1 == 1 { open } else { Rgb::BLACK };
            *term = LengthTerm { record: record as u32, seen, open };
        }
        terms
    }
}
