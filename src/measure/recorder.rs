//! A backend that records its queries, so that the very same queries can be sent through bare backends afterwards,
//! with nothing of a renderer around them.

use crate::ray::{Hit, Ray, RayQuery, SegmentPacket, SurfaceMask};
use rayon::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Largest number of recorded queries; of an iteration with more only a part is recorded.
const MAX_QUERIES: usize = 4_000_000;

/// Queries of one thread, in their order.
#[derive(Default)]
struct Log {
    order: Vec<QueryKind>,
    rays: Vec<Ray>,
    packets: Vec<SegmentPacket>,
    /// Rays that were not kept.
    beyond: u64,
}

#[derive(Clone, Copy)]
enum QueryKind {
    Closest(SurfaceMask),
    Occluded(SurfaceMask),
    Packet,
}

/// All recorded queries, by thread.
#[derive(Default)]
pub struct Recording {
    logs: Vec<Log>,
}

/// Passes queries on and keeps a copy. All queries must come from the thread pool that it was made for.
pub struct Recorder {
    inner: Arc<dyn RayQuery>,
    logs: Arc<Vec<Mutex<Log>>>,
    max_per_thread: usize,
}

/// A shared backend is a backend, so that the one in use can go behind a recorder and come back.
impl RayQuery for Arc<dyn RayQuery> {
    fn describe(&self) -> String {
        (**self).describe()
    }

    #[cfg(any(embree3, embree4))]
    fn as_embree(&self) -> Option<&crate::ray::embree::EmbreeScene> {
        (**self).as_embree()
    }

    fn closest_of(&self, ray: &Ray, surfaces: SurfaceMask) -> Option<Hit> {
        (**self).closest_of(ray, surfaces)
    }

    fn occluded(&self, ray: &Ray, blockers: SurfaceMask) -> bool {
        (**self).occluded(ray, blockers)
    }

    fn occluded_packet(&self, packet: &SegmentPacket) -> (u16, u32) {
        (**self).occluded_packet(packet)
    }
}

/// The recorder's logs, to be taken when it has done its work.
pub struct Tape(Arc<Vec<Mutex<Log>>>);

impl Recorder {
    /// A recorder for so many threads, and its tape.
    pub fn new(inner: Arc<dyn RayQuery>, threads: usize) -> (Recorder, Tape) {
        let logs: Arc<Vec<Mutex<Log>>> = Arc::new((0..threads.max(1)).map(|_| Mutex::default()).collect());
        (Recorder { inner, logs: logs.clone(), max_per_thread: MAX_QUERIES / threads.max(1) }, Tape(logs))
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        let thread = rayon::current_thread_index().unwrap_or(0) % self.logs.len();
        // A log is whole between any two queries, whatever happened to the thread.
        self.logs[thread].lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn keep(&self, rays: u64, write: impl FnOnce(&mut Log)) {
        let mut log = self.log();
        if log.order.len() < self.max_per_thread { write(&mut log) } else { log.beyond += rays }
    }
}

impl RayQuery for Recorder {
    fn describe(&self) -> String {
        self.inner.describe()
    }

    fn closest_of(&self, ray: &Ray, surfaces: SurfaceMask) -> Option<Hit> {
        self.keep(1, |log| {
            log.order.push(QueryKind::Closest(surfaces));
            log.rays.push(*ray);
        });
        self.inner.closest_of(ray, surfaces)
    }

    fn occluded(&self, ray: &Ray, blockers: SurfaceMask) -> bool {
        self.keep(1, |log| {
            log.order.push(QueryKind::Occluded(blockers));
            log.rays.push(*ray);
        });
        self.inner.occluded(ray, blockers)
    }

    fn occluded_packet(&self, packet: &SegmentPacket) -> (u16, u32) {
        self.keep(packet.len as u64, |log| {
            log.order.push(QueryKind::Packet);
            log.packets.push(packet.clone());
        });
        self.inner.occluded_packet(packet)
    }
}

impl Tape {
    /// Takes the recording.
    pub fn take(self) -> Recording {
        let take = |log: &Mutex<Log>| std::mem::take(&mut *log.lock().unwrap_or_else(PoisonError::into_inner));
        Recording { logs: self.0.iter().map(take).collect() }
    }
}

impl Recording {
    /// Rays kept.
    pub fn rays(&self) -> u64 {
        let of = |log: &Log| log.rays.len() as u64 + log.packets.iter().map(|p| p.len as u64).sum::<u64>();
        self.logs.iter().map(of).sum()
    }

    /// Rays that were left out for lack of memory.
    pub fn beyond(&self) -> u64 {
        self.logs.iter().map(|l| l.beyond).sum()
    }

    /// Repeats all queries, those of each thread on one thread of the current pool; returns how many rays met
    /// something, which must not depend on the backend.
    pub fn play(&self, query: &dyn RayQuery) -> u64 {
        let one = |log: &Log| {
            let (mut rays, mut packets, mut met) = (log.rays.iter(), log.packets.iter(), 0u64);
            for kind in &log.order {
                met += match kind {
                    QueryKind::Packet => packets.next().map_or(0, |p| query.occluded_packet(p).0.count_ones().into()),
                    QueryKind::Closest(surfaces) => {
                        rays.next().map_or(0, |r| u64::from(query.closest_of(r, *surfaces).is_some()))
                    }
                    QueryKind::Occluded(blockers) => rays.next().map_or(0, |r| u64::from(query.occluded(r, *blockers))),
                };
            }
            met
        };
        self.logs.par_iter().with_max_len(1).map(one).sum()
    }
}
