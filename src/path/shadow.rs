//! Shadow rays on their way: contributions wait here until sixteen segments fill a packet.
//!
//! A contribution never steers the walk, so it may arrive late. Each entry knows where it goes; entries leave in the order they came,
//! so sums do not depend on how packets were filled.

use crate::math::Rgb;
use crate::ray::{PACKET, RayKind, Segment, SegmentPacket, Tracer};

/// A queue of segments with what they carry.
pub struct ShadowQueue {
    kind: RayKind,
    packet: SegmentPacket,
    carried: [(u32, Rgb); PACKET],
}

impl ShadowQueue {
    /// An empty queue for rays of one kind.
    pub fn new(kind: RayKind) -> ShadowQueue {
        ShadowQueue { kind, packet: SegmentPacket::default(), carried: [(0, Rgb::BLACK); PACKET] }
    }

    /// Queues a segment that carries `contribution` to `destination`; sends the packet off when it is full.
    #[inline]
    pub fn push(
        &mut self,
        segment: &Segment,
        contribution: Rgb,
        destination: u32,
        tracer: &mut Tracer,
        arrived: impl FnMut(u32, Rgb),
    ) {
        self.carried[self.packet.len] = (destination, contribution);
        self.packet.push(segment);
        if self.packet.len == PACKET {
            self.flush(tracer, arrived);
        }
    }

    /// Sends off what is queued.
    pub fn flush(&mut self, tracer: &mut Tracer, mut arrived: impl FnMut(u32, Rgb)) {
        if self.packet.len == 0 {
            return;
        }
        let blocked = tracer.occluded_packet(&self.packet, self.kind);
        for (i, &(destination, contribution)) in self.carried[..self.packet.len].iter().enumerate() {
            if blocked >> i & 1 == 0 {
                arrived(destination, contribution);
            }
        }
        self.packet.len = 0;
    }
}
