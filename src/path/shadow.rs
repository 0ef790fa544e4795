//! Shadow rays on their way: contributions wait here until sixteen segments fill a packet.
//!
//! A contribution never steers the walk, so it may arrive late. Each entry knows where it goes; entries leave in the order they came,
//! so sums do not depend on how packets were filled.

use crate::emit::DirectSample;
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{PACKET, RayKind, Segment, SegmentPacket, Tracer};
use crate::shade::SurfacePoint;

/// From a surface point to a sampled point of a light.
#[inline]
pub fn direct_segment(point: &SurfacePoint, light: &DirectSample) -> Segment {
    let from = SegmentEnd::Surface { p: point.p, error: point.error, ng: point.ng };
    match light.end.segment_end() {
        Some(end) => segment(&from, &end),
        None => Segment::to_infinity(from.leaving(light.wi), light.wi),
    }
}

/// A queue of segments, each with what it carries.
pub struct ShadowQueue<T> {
    kind: RayKind,
    packet: SegmentPacket,
    carried: [T; PACKET],
}

impl<T: Copy + Default> ShadowQueue<T> {
    /// An empty queue for rays of one kind.
    pub fn new(kind: RayKind) -> ShadowQueue<T> {
        ShadowQueue { kind, packet: SegmentPacket::default(), carried: [T::default(); PACKET] }
    }

    /// Queues a segment with what it carries; sends the packet off when it is full. `arrived` gets what segments carry that nothing
    /// blocks.
    #[inline]
    pub fn push(&mut self, segment: &Segment, carried: T, tracer: &mut Tracer, arrived: impl FnMut(T)) {
        self.carried[self.packet.len] = carried;
        self.packet.push(segment);
        if self.packet.len == PACKET {
            self.flush(tracer, arrived);
        }
    }

    /// Sends off what is queued.
    pub fn flush(&mut self, tracer: &mut Tracer, mut arrived: impl FnMut(T)) {
        if self.packet.len == 0 {
            return;
        }
        let blocked = tracer.occluded_packet(&self.packet, self.kind);
        for (i, &carried) in self.carried[..self.packet.len].iter().enumerate() {
            if blocked >> i & 1 == 0 {
                arrived(carried);
            }
        }
        self.packet.len = 0;
    }
}
