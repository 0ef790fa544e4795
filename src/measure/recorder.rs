//! A backend that writes down what it is asked, so that the very same questions can be put to bare backends afterwards, with nothing
//! of a renderer around them.

use crate::ray::{Hit, Ray, RayQuery, SegmentPacket};
use rayon::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Most questions that are kept; an iteration that asks more is kept in part.
const MOST: usize = 4_000_000;

/// What one thread asked, in its order.
#[derive(Default)]
struct Log {
    order: Vec<Question>,
    rays: Vec<Ray>,
    packets: Vec<SegmentPacket>,
    /// Rays that were not kept.
    beyond: u64,
}

#[derive(Clone, Copy)]
enum Question {
    Closest,
    Occluded,
    Packet,
}

/// Everything that was asked, by thread.
#[derive(Default)]
pub struct Recording {
    logs: Vec<Log>,
}

/// Passes questions on and keeps a copy. Must be asked from the thread pool that it was made for.
pub struct Recorder {
    inner: Arc<dyn RayQuery>,
    logs: Arc<Vec<Mutex<Log>>>,
    most: usize,
}

/// Backends that change places are shared.
impl RayQuery for Arc<dyn RayQuery> {
    fn describe(&self) -> String {
        (**self).describe()
    }

    #[cfg(any(embree3, embree4))]
    fn as_embree(&self) -> Option<&crate::ray::embree::EmbreeScene> {
        (**self).as_embree()
    }

    fn closest(&self, ray: &Ray) -> Option<Hit> {
        (**self).closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        (**self).occluded(ray)
    }

    fn occluded_packet(&self, packet: &SegmentPacket) -> (u16, u32) {
        (**self).occluded_packet(packet)
    }
}

/// The recorder's other end.
pub struct Tape(Arc<Vec<Mutex<Log>>>);

impl Recorder {
    /// A recorder for so many threads, and its tape.
    pub fn new(inner: Arc<dyn RayQuery>, threads: usize) -> (Recorder, Tape) {
        let logs: Arc<Vec<Mutex<Log>>> = Arc::new((0..threads.max(1)).map(|_| Mutex::default()).collect());
        (Recorder { inner, logs: logs.clone(), most: MOST / threads.max(1) }, Tape(logs))
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        let thread = rayon::current_thread_index().unwrap_or(0) % self.logs.len();
        // A log is whole between any two questions, whatever happened to the thread.
        self.logs[thread].lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn keep(&self, rays: u64, write: impl FnOnce(&mut Log)) {
        let mut log = self.log();
        if log.order.len() < self.most { write(&mut log) } else { log.beyond += rays }
    }
}

impl RayQuery for Recorder {
    fn describe(&self) -> String {
        self.inner.describe()
    }

    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.keep(1, |log| {
            log.order.push(Question::Closest);
            log.rays.push(*ray);
        });
        self.inner.closest(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.keep(1, |log| {
            log.order.push(Question::Occluded);
            log.rays.push(*ray);
        });
        self.inner.occluded(ray)
    }

    fn occluded_packet(&self, packet: &SegmentPacket) -> (u16, u32) {
        self.keep(packet.len as u64, |log| {
            log.order.push(Question::Packet);
            log.packets.push(packet.clone());
        });
        self.inner.occluded_packet(packet)
    }
}

impl Tape {
    /// Takes what was recorded.
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

    /// Rays that there was no room for.
    pub fn beyond(&self) -> u64 {
        self.logs.iter().map(|l| l.beyond).sum()
    }

    /// Asks it all again, each thread's questions on one thread of the current pool; returns how many rays met something, which must not
    /// depend on the backend.
    pub fn play(&self, query: &dyn RayQuery) -> u64 {
        let one = |log: &Log| {
            let (mut rays, mut packets, mut met) = (log.rays.iter(), log.packets.iter(), 0u64);
            for question in &log.order {
                met += match question {
                    Question::Packet => packets.next().map_or(0, |p| query.occluded_packet(p).0.count_ones().into()),
                    Question::Closest => rays.next().map_or(0, |r| u64::from(query.closest(r).is_some())),
                    Question::Occluded => rays.next().map_or(0, |r| u64::from(query.occluded(r))),
                };
            }
            met
        };
        self.logs.par_iter().with_max_len(1).map(one).sum()
    }
}
