//! Visibility rays on their way: contributions wait here until sixteen segments fill a packet.
//!
//! A contribution never steers the walk, so it may arrive late. Each entry knows where it goes; entries leave in the
//! order they came, so sums do not depend on how packets were filled.

use crate::emit::DirectSample;
use crate::ray::offset::{SegmentEnd, segment};
use crate::ray::{PACKET, RayKind, Segment, SegmentPacket, Tracer, Transmittance};

/// The segment from the place `from` to a sampled point of a light.
#[inline]
pub fn direct_segment(from: &SegmentEnd, light: &DirectSample) -> Segment {
    match light.end.segment_end() {
        Some(end) => segment(from, &end),
        None => Segment::to_infinity(from.leaving(light.wi), light.wi),
    }
}

/// A queue of segments, each with a payload.
pub struct ShadowQueue<T> {
    kind: RayKind,
    packet: SegmentPacket,
    payloads: [T; PACKET],
}

impl<T: Copy + Default> ShadowQueue<T> {
    /// An empty queue for rays of one kind.
    pub fn new(kind: RayKind) -> ShadowQueue<T> {
        ShadowQueue { kind, packet: SegmentPacket::default(), payloads: [T::default(); PACKET] }
    }

    /// Queues a segment with its payload; sends the packet off when it is full. `arrived` gets the payloads of segments
    /// that some light passes, with the transmittance of the segment.
    #[inline(always)]
    pub fn push(&mut self, segment: &Segment, payload: T, tracer: &mut Tracer, arrived: impl FnMut(T, Transmittance)) {
        self.payloads[self.packet.len] = payload;
        self.packet.push(segment);
        if self.packet.len == PACKET {
            self.flush(tracer, arrived);
        }
    }

    /// Sends off the queued segments.
    pub fn flush(&mut self, tracer: &mut Tracer, mut arrived: impl FnMut(T, Transmittance)) {
        if self.packet.len == 0 {
            return;
        }
        let blocked = tracer.occluded_packet(&self.packet, self.kind);
        for (i, &payload) in self.payloads[..self.packet.len].iter().enumerate() {
            if blocked >> i & 1 == 0 {
                let transmittance = tracer.transmittance(&self.packet.get(i));
                if !transmittance.is_zero() {
                    arrived(payload, transmittance);
                }
            }
        }
        self.packet.len = 0;
    }
}
