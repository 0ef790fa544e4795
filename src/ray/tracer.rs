//! A thread's way to the rays: counts them by kind and estimates the time spent in them.
//!
//! Every query would cost more in clock reads than it may, so one call in a prime number is timed and the mean stands
//! for the rest; the clock's own cost, measured once, is taken off.
//!
//! The measured time is that of a query by itself: a reading of the clock waits for all that was begun before it, and
//! nothing that comes later may begin. Between queries a processor overlaps both, so the sum is more than a profiler
//! finds inside the backend (path tracing a Cornell box, 0.65 of the time against 0.43). The rays of `profile`'s
//! replay, which overlap with each other alone, give the smaller number.

#[cfg(any(embree3, embree4))]
use super::embree::EmbreeScene;
use super::{Hit, MaskLookup, PACKET, Phases, Ray, RayQuery, SegmentPacket, SurfaceMask};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

/// The purpose of a ray.
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
    /// An edge of a sub-path that makes cache points.
    Cache,
    /// Between a cache point and a light vertex.
    ShadowPmf,
    /// Between a cache point and a light vertex, for a weight.
    ShadowWeight,
    /// To the next mask on a segment that nothing else blocks.
    Mask,
}

impl RayKind {
    /// Every kind, in the order of their numbers.
    pub const ALL: [RayKind; 11] = [
        RayKind::Camera,
        RayKind::Bounce,
        RayKind::ShadowDirect,
        RayKind::Light,
        RayKind::LightBounce,
        RayKind::ShadowLens,
        RayKind::ShadowConnection,
        RayKind::Cache,
        RayKind::ShadowPmf,
        RayKind::ShadowWeight,
        RayKind::Mask,
    ];

    /// It asks only whether something is in the way.
    pub fn is_shadow(self) -> bool {
        use RayKind::{ShadowConnection, ShadowDirect, ShadowLens, ShadowPmf, ShadowWeight};
        matches!(self, ShadowDirect | ShadowLens | ShadowConnection | ShadowPmf | ShadowWeight)
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
            RayKind::Cache => "cache",
            RayKind::ShadowPmf => "shadow_pmf",
            RayKind::ShadowWeight => "shadow_weight",
            RayKind::Mask => "mask",
        }
    }
}

const KINDS: usize = RayKind::ALL.len();
/// One query in this many is timed; a prime, so that it does not keep step with the bounces of a path.
const TIMED_ONE_IN: u32 = 509;

/// Tracers made so far. Most make few queries: each begins to count elsewhere, so that all of their queries get their
/// turn.
static TRACERS: AtomicU32 = AtomicU32::new(0);

/// Counters of one kind of ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct KindStats {
    /// Rays traced.
    pub rays: u64,
    /// Occlusion rays that were blocked.
    pub blocked: u64,
    /// Packets, if they went in packets.
    packets: u64,
    timed: Timed,
}

impl KindStats {
    /// Estimated seconds inside the backend.
    pub fn seconds(&self) -> f64 {
        self.timed.seconds_of(if self.packets > 0 { self.packets } else { self.rays })
    }
}

/// The time, from a clock that has just been read once before: so rarely used, its code and data are in no cache, and
/// the first reading takes as long as a ray.
#[inline]
fn warm_clock() -> Instant {
    std::hint::black_box(Instant::now());
    Instant::now()
}

/// Calls on the clock.
#[derive(Clone, Copy, Debug, Default)]
struct Timed {
    calls: u64,
    ns: u64,
}

/// A query that takes longer, in nanoseconds, was interrupted by another program and says nothing.
const INTERRUPTED: u64 = 100_000;

impl Timed {
    #[cold]
    fn stop_clock(&mut self, start: Instant) {
        let ns = start.elapsed().as_nanos() as u64;
        if ns < INTERRUPTED {
            self.ns += ns;
            self.calls += 1;
        }
    }

    /// Estimated seconds of so many calls like these.
    fn seconds_of(&self, calls: u64) -> f64 {
        if self.calls == 0 {
            return 0.0;
        }
        (self.ns as f64 / self.calls as f64 - *CLOCK_NS).max(0.0) * calls as f64 * 1e-9
    }

    fn merge(&mut self, other: Timed) {
        self.calls += other.calls;
        self.ns += other.ns;
    }
}

/// Work that is too fine-grained and too interwoven for a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Work {
    /// Eye vertices draw light sub-paths and are connected to them, weights included.
    Connections,
    /// Weights of all techniques.
    Weights,
}

impl Work {
    /// Every kind, in the order of their numbers.
    pub const ALL: [Work; 2] = [Work::Connections, Work::Weights];

    /// Name in statistics.
    pub fn name(self) -> &'static str {
        match self {
            Work::Connections => "connections",
            Work::Weights => "weights",
        }
    }
}

/// How often some work was done, and some of it on the clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct WorkStats {
    /// Times.
    pub calls: u64,
    timed: Timed,
}

impl WorkStats {
    /// Estimated seconds, ray queries in between included, summed over threads.
    pub fn seconds(&self) -> f64 {
        self.timed.seconds_of(self.calls)
    }
}

/// Mean nanoseconds that two clock reads add to what lies between them.
static CLOCK_NS: LazyLock<f64> = LazyLock::new(|| {
    let mut timed = Timed::default();
    (0..2000).for_each(|_| timed.stop_clock(Instant::now()));
    timed.ns as f64 / timed.calls.max(1) as f64
});

/// Counters of all kinds.
#[derive(Clone, Copy, Debug, Default)]
pub struct RayStats {
    /// By kind.
    pub kinds: [KindStats; KINDS],
    /// By kind of work.
    pub work: [WorkStats; Work::ALL.len()],
    /// Rays with a component that is not finite, which were not traced, and rays that would have crossed more masks than
    /// [`MAX_CROSSINGS`](super::transmittance::MAX_CROSSINGS).
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
            a.packets += b.packets;
            a.timed.merge(b.timed);
        }
        for (a, b) in self.work.iter_mut().zip(&o.work) {
            a.calls += b.calls;
            a.timed.merge(b.timed);
        }
        self.invalid += o.invalid;
        self.phases.merge(&o.phases);
    }

    /// All rays.
    pub fn total(&self) -> u64 {
        self.kinds.iter().map(|k| k.rays).sum()
    }

    /// Rays of some kinds.
    pub fn rays(&self, kinds: &[RayKind]) -> f64 {
        kinds.iter().map(|k| self.kinds[*k as usize].rays as f64).sum()
    }

    /// Rays of some kinds, with those that found the masks on their segments: all segments are taken to cross as many.
    pub fn rays_with_masks(&self, kinds: &[RayKind]) -> f64 {
        let of = |kind: &RayKind| self.kinds[*kind as usize].rays as f64;
        let crossings = of(&RayKind::Mask);
        if crossings == 0.0 {
            return self.rays(kinds);
        }
        let sum = |kinds: &[RayKind]| kinds.iter().filter(|kind| kind.is_shadow()).map(of).sum::<f64>();
        self.rays(kinds) + crossings * sum(kinds) / sum(&RayKind::ALL)
    }

    /// Estimated seconds inside the backend, summed over threads.
    pub fn seconds(&self) -> f64 {
        self.kinds.iter().map(KindStats::seconds).sum()
    }
}

/// The closest hit of the ray with these numbers by a virtual call.
#[inline(never)]
fn closest_virtual(
    query: &dyn RayQuery,
    [o, d]: [[f32; 3]; 2],
    [t_min, t_max]: [f32; 2],
    surfaces: SurfaceMask,
) -> Option<Hit> {
    query.closest_of(&Ray { o: o.into(), d: d.into(), t_min, t_max }, surfaces)
}

/// One thread's access to the backend.
pub struct Tracer<'a> {
    query: &'a dyn RayQuery,
    /// The query if it is Embree, which is called directly: a ray then goes from the registers it was made in to where
    /// Embree reads it, and the hit comes back into registers.
    #[cfg(any(embree3, embree4))]
    embree: Option<&'a EmbreeScene>,
    /// Opacities, if the scene has masks.
    masks: Option<&'a dyn MaskLookup>,
    /// Counters so far.
    pub stats: RayStats,
    until_timed: u32,
    until_timed_work: u32,
}

impl<'a> Tracer<'a> {
    /// A tracer with empty counters; `masks` knows the opacities of a scene's masks, if there are any.
    pub fn new(query: &'a dyn RayQuery, masks: Option<&'a dyn MaskLookup>) -> Tracer<'a> {
        LazyLock::force(&CLOCK_NS);
        let first = 1 + TRACERS.fetch_add(1, Ordering::Relaxed).wrapping_mul(97) % TIMED_ONE_IN;
        Tracer {
            query,
            #[cfg(any(embree3, embree4))]
            embree: query.as_embree(),
            masks,
            stats: RayStats::default(),
            until_timed: first,
            until_timed_work: first,
        }
    }

    /// Opacities, if the scene has masks.
    #[inline]
    pub(super) fn masks(&self) -> Option<&'a dyn MaskLookup> {
        self.masks
    }

    /// It is the next query's turn to be timed.
    #[inline(always)]
    fn should_time(&mut self) -> bool {
        self.until_timed -= 1;
        self.until_timed == 0
    }

    /// Makes a query on the clock.
    #[inline]
    fn timed<T>(&mut self, kind: RayKind, query: impl FnOnce(&dyn RayQuery) -> T) -> T {
        self.until_timed = TIMED_ONE_IN;
        let start = warm_clock();
        let answer = query(self.query);
        self.stats.kinds[kind as usize].timed.stop_clock(start);
        answer
    }

    /// Counts a piece of work that begins; what is returned goes to [`Tracer::end`].
    #[inline]
    pub fn begin(&mut self, work: Work) -> Option<Instant> {
        self.stats.work[work as usize].calls += 1;
        self.until_timed_work -= 1;
        if self.until_timed_work > 0 {
            return None;
        }
        self.until_timed_work = TIMED_ONE_IN;
        Some(warm_clock())
    }

    /// The piece of work is done.
    #[inline]
    pub fn end(&mut self, work: Work, started: Option<Instant>) {
        if let Some(start) = started {
            self.stats.work[work as usize].timed.stop_clock(start);
        }
    }

    /// The closest hit when it is its turn to be timed. Apart and part by part, so that the way of all other rays stays
    /// in registers.
    #[cold]
    #[inline(never)]
    fn closest_timed(&mut self, line: [[f32; 3]; 2], t: [f32; 2], surfaces: SurfaceMask, kind: RayKind) -> Option<Hit> {
        self.timed(kind, |query| closest_virtual(query, line, t, surfaces))
    }

    /// The first surface that the ray meets, interfaces apart; a ray that is not valid meets nothing and is counted.
    #[inline(always)]
    pub fn closest(&mut self, ray: &Ray, kind: RayKind) -> Option<Hit> {
        self.closest_of(ray, SurfaceMask::VISIBLE, kind)
    }

    /// The first surface of the kinds `surfaces` that the ray meets; a ray that is not valid meets nothing and is
    /// counted.
    // Out of line, ray and hit would go through memory.
    #[inline(always)]
    pub fn closest_of(&mut self, ray: &Ray, surfaces: SurfaceMask, kind: RayKind) -> Option<Hit> {
        if !ray.is_valid() {
            self.stats.invalid += 1;
            return None;
        }
        self.stats.kinds[kind as usize].rays += 1;
        // Part by part both ways: what is only ever passed by reference on this way must not be kept in memory on the
        // other.
        let (line, t) = ([[ray.o.x, ray.o.y, ray.o.z], [ray.d.x, ray.d.y, ray.d.z]], [ray.t_min, ray.t_max]);
        let hit = if self.should_time() {
            self.closest_timed(line, t, surfaces, kind)
        } else {
            #[cfg(any(embree3, embree4))]
            if let Some(embree) = self.embree {
                return embree.first_hit(ray, surfaces);
            }
            closest_virtual(self.query, line, t, surfaces)
        }?;
        Some(Hit { t: hit.t, u: hit.u, v: hit.v, triangle: hit.triangle, mesh: hit.mesh, instance: hit.instance })
    }

    /// Bit `i` set: segment `i` is blocked. Segments that are not valid count as blocked.
    #[inline]
    pub fn occluded_packet(&mut self, packet: &SegmentPacket, kind: RayKind) -> u16 {
        debug_assert!(packet.len <= PACKET);
        let (mask, invalid) = if self.should_time() {
            self.timed(kind, |query| query.occluded_packet(packet))
        } else {
            self.query.occluded_packet(packet)
        };
        let stats = &mut self.stats.kinds[kind as usize];
        stats.rays += packet.len as u64;
        stats.packets += 1;
        stats.blocked += u64::from(mask.count_ones());
        self.stats.invalid += u64::from(invalid);
        mask
    }

    /// Bit `i` set: some light passes segment `i`.
    pub fn visible_packet(&mut self, packet: &SegmentPacket, kind: RayKind) -> u16 {
        if packet.len == 0 {
            return 0;
        }
        let blocked = self.occluded_packet(packet, kind);
        (0..packet.len)
            .filter(|i| blocked >> i & 1 == 0 && !self.transmittance(&packet.get(*i)).is_zero())
            .fold(0, |seen, i| seen | 1 << i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_counted_with_the_segments_that_cross_them() {
        let mut stats = RayStats::default();
        for (kind, rays) in [(RayKind::Bounce, 50), (RayKind::ShadowLens, 30), (RayKind::ShadowConnection, 10)] {
            stats.kinds[kind as usize].rays = rays;
        }
        let both = [RayKind::Bounce, RayKind::ShadowLens];
        assert_eq!(stats.rays_with_masks(&both), 80.0);
        stats.kinds[RayKind::Mask as usize].rays = 20;
        assert_eq!(stats.rays_with_masks(&both), 80.0 + 15.0);
        assert_eq!(stats.rays_with_masks(&[RayKind::ShadowConnection]), 10.0 + 5.0);
        assert_eq!(stats.rays(&both), 80.0);
    }
}
