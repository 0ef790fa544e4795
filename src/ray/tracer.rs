//! A thread's way to the rays: counts them by kind and estimates the time spent in them.
//!
//! Every query would cost more in clock reads than it may, so one call in a prime number is timed and the mean stands for the rest;
//! the clock's own cost, measured once, is taken off.

use super::{Hit, PACKET, Phases, Ray, RayQuery, SegmentPacket};
use std::sync::LazyLock;
use std::time::Instant;

/// What a ray is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum RayKind {
    /// From the camera.
    Camera,
    /// The next edge of an eye sub-path.
    Bounce,
    /// Next-event estimation.
    ShadowDirect,
    /// The first edge of a light sub-path.
    Light,
    /// The next edge of a light sub-path.
    LightBounce,
    /// From a light sub-path to the lens.
    ShadowLens,
    /// Between two sub-paths.
    ShadowConnection,
}

impl RayKind {
    /// Every kind, in the order of their numbers.
    pub const ALL: [RayKind; 7] = [
        RayKind::Camera,
        RayKind::Bounce,
        RayKind::ShadowDirect,
        RayKind::Light,
        RayKind::LightBounce,
        RayKind::ShadowLens,
        RayKind::ShadowConnection,
    ];

    /// It asks only whether something is in the way.
    pub fn is_shadow(self) -> bool {
        matches!(self, RayKind::ShadowDirect | RayKind::ShadowLens | RayKind::ShadowConnection)
    }

    /// Name in statistics.
    pub fn name(self) -> &'static str {
        match self {
            RayKind::Camera => "camera",
            RayKind::Bounce => "bounce",
            RayKind::ShadowDirect => "shadow_direct",
            RayKind::Light => "light",
            RayKind::LightBounce => "light_bounce",
            RayKind::ShadowLens => "shadow_lens",
            RayKind::ShadowConnection => "shadow_connection",
        }
    }
}

const KINDS: usize = RayKind::ALL.len();
/// One query in this many is timed; a prime, so that it does not keep step with the bounces of a path.
const TIMED_ONE_IN: u32 = 61;

/// Counters of one kind of ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct KindStats {
    /// Rays traced.
    pub rays: u64,
    /// Of occlusion rays: those that were blocked.
    pub blocked: u64,
    /// Queries (a packet is one).
    calls: u64,
    timed_calls: u64,
    timed_ns: u64,
}

impl KindStats {
    /// Estimated seconds inside the backend.
    pub fn seconds(&self) -> f64 {
        if self.timed_calls == 0 {
            return 0.0;
        }
        let mean = self.timed_ns as f64 / self.timed_calls as f64 - *CLOCK_NS;
        mean.max(0.0) * self.calls as f64 * 1e-9
    }
}

/// Mean nanoseconds that two clock reads add to what lies between them.
static CLOCK_NS: LazyLock<f64> = LazyLock::new(|| {
    let mut total = 0u64;
    let n = 2000;
    for _ in 0..n {
        let start = Instant::now();
        total += start.elapsed().as_nanos() as u64;
    }
    total as f64 / f64::from(n)
});

/// Counters of all kinds.
#[derive(Clone, Copy, Debug, Default)]
pub struct RayStats {
    /// By kind.
    pub kinds: [KindStats; KINDS],
    /// Rays with a component that is not finite; they were not traced.
    pub invalid: u64,
    /// Wall seconds by phase.
    pub phases: Phases,
}

impl RayStats {
    /// Adds another thread's counters.
    pub fn merge(&mut self, o: &RayStats) {
        for (a, b) in self.kinds.iter_mut().zip(&o.kinds) {
            a.rays += b.rays;
            a.blocked += b.blocked;
            a.calls += b.calls;
            a.timed_calls += b.timed_calls;
            a.timed_ns += b.timed_ns;
        }
        self.invalid += o.invalid;
        self.phases.merge(&o.phases);
    }

    /// All rays.
    pub fn total(&self) -> u64 {
        self.kinds.iter().map(|k| k.rays).sum()
    }

    /// Estimated seconds inside the backend, summed over threads.
    pub fn seconds(&self) -> f64 {
        self.kinds.iter().map(KindStats::seconds).sum()
    }
}

/// One thread's access to the backend.
pub struct Tracer<'a> {
    query: &'a dyn RayQuery,
    /// Counters so far.
    pub stats: RayStats,
    until_timed: u32,
}

impl<'a> Tracer<'a> {
    /// A tracer with empty counters.
    pub fn new(query: &'a dyn RayQuery) -> Tracer<'a> {
        LazyLock::force(&CLOCK_NS);
        Tracer { query, stats: RayStats::default(), until_timed: TIMED_ONE_IN }
    }

    #[inline]
    fn timed<T>(&mut self, kind: RayKind, call: impl FnOnce(&dyn RayQuery) -> T) -> T {
        let stats = &mut self.stats.kinds[kind as usize];
        stats.calls += 1;
        self.until_timed -= 1;
        if self.until_timed > 0 {
            return call(self.query);
        }
        self.until_timed = TIMED_ONE_IN;
        let start = Instant::now();
        let out = call(self.query);
        stats.timed_ns += start.elapsed().as_nanos() as u64;
        stats.timed_calls += 1;
        out
    }

    /// The first thing the ray meets; a ray that is not valid meets nothing and is counted.
    #[inline]
    pub fn closest(&mut self, ray: &Ray, kind: RayKind) -> Option<Hit> {
        if !ray.is_valid() {
            self.stats.invalid += 1;
            return None;
        }
        self.stats.kinds[kind as usize].rays += 1;
        self.timed(kind, |q| q.closest(ray))
    }

    /// Bit `i` set: segment `i` is blocked. Segments that are not valid count as blocked.
    #[inline]
    pub fn occluded_packet(&mut self, packet: &SegmentPacket, kind: RayKind) -> u16 {
        debug_assert!(packet.len <= PACKET);
        let (mask, invalid) = self.timed(kind, |q| q.occluded_packet(packet));
        let stats = &mut self.stats.kinds[kind as usize];
        stats.rays += packet.len as u64;
        stats.blocked += u64::from(mask.count_ones());
        self.stats.invalid += u64::from(invalid);
        mask
    }
}
