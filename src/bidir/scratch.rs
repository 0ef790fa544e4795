//! Memory that a thread keeps from one sub-path to the next, and the results of a piece of work.

use super::contribution::{Contribution, ContributionKind};
use super::light_subpath::LightSubpath;
use crate::film::{FilmTile, SampleBuffer, Splat};
use crate::mis::{ConnectionFactor, EyeSubpathPdfs, Heuristic};
use crate::path::ShadowQueue;
use crate::ray::{RayKind, RayStats, Tracer};

/// Which sub-paths are probed: their contributions are also kept one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ProbeStride(pub Option<u32>);

impl ProbeStride {
    /// Sub-path `number` is probed.
    #[inline]
    pub fn probes(self, number: u32) -> bool {
        self.0.is_some_and(|n| number.is_multiple_of(n))
    }
}

/// Connections to the lens on their way to the light image.
pub struct SplatQueue {
    queue: ShadowQueue<Contribution>,
    /// Visible splats.
    pub splats: Vec<Splat>,
    /// Visible splats of probed light sub-paths.
    probed: Vec<Contribution>,
    stride: ProbeStride,
    heuristic: Heuristic,
}

impl SplatQueue {
    fn new(stride: ProbeStride, heuristic: Heuristic) -> SplatQueue {
        SplatQueue { queue: ShadowQueue::new(RayKind::ShadowLens), splats: vec![], probed: vec![], stride, heuristic }
    }

    /// Queues a splat, which arrives if nothing blocks `segment`.
    pub fn push(&mut self, segment: &crate::ray::Segment, splat: Contribution, tracer: &mut Tracer) {
        let SplatQueue { queue, splats, probed, stride, heuristic } = self;
        queue.push(segment, splat, tracer, |c, t| Self::arrive(splats, probed, *stride, c.through(t, *heuristic)));
    }

    /// Sends off the queued rays.
    pub fn flush(&mut self, tracer: &mut Tracer) {
        let SplatQueue { queue, splats, probed, stride, heuristic } = self;
        queue.flush(tracer, |c, t| Self::arrive(splats, probed, *stride, c.through(t, *heuristic)));
    }

    fn arrive(
        splats: &mut Vec<Splat>,
        probed: &mut Vec<Contribution>,
        stride: ProbeStride,
        contribution: Contribution,
    ) {
        splats.push(contribution.splat());
        if stride.probes(contribution.path) {
            probed.push(contribution);
        }
    }
}

/// Visibility rays of an eye sub-path on their way.
pub struct EyeQueues {
    /// Next event.
    pub next_event: ShadowQueue<Contribution>,
    /// Connections to light sub-paths.
    pub connection: ShadowQueue<Contribution>,
    heuristic: Heuristic,
}

impl EyeQueues {
    /// Sends off the queued rays.
    pub fn flush(&mut self, tracer: &mut Tracer, sink: &mut impl ContributionSink) {
        let heuristic = self.heuristic;
        self.next_event.flush(tracer, |c, t| sink.add(ContributionKind::NextEvent, c.through(t, heuristic)));
        self.connection.flush(tracer, |c, t| sink.add(ContributionKind::Connection, c.through(t, heuristic)));
    }
}

/// Memory that a thread keeps from one sub-path to the next.
pub struct ThreadScratch<F: ConnectionFactor> {
    /// The light sub-path at work.
    pub light: LightSubpath,
    /// Densities of the eye sub-path at work.
    pub eye: EyeSubpathPdfs<F>,
    /// Visibility rays of eye sub-paths.
    pub queues: EyeQueues,
    /// Visibility rays to the lens.
    pub splats: SplatQueue,
}

/// The results of a piece of work.
#[derive(Default)]
pub struct TileOutput {
    /// Counts of rays.
    pub stats: RayStats,
    /// Visible splats.
    pub splats: Vec<Splat>,
    /// Visible contributions of probed sub-paths.
    pub probed: Vec<Contribution>,
}

impl<F: ConnectionFactor> ThreadScratch<F> {
    /// Empty memory of a thread that probes sub-paths by `stride`, for weights by `heuristic`.
    pub fn new(stride: ProbeStride, heuristic: Heuristic) -> ThreadScratch<F> {
        ThreadScratch {
            light: LightSubpath::default(),
            eye: EyeSubpathPdfs::default(),
            queues: EyeQueues {
                next_event: ShadowQueue::new(RayKind::ShadowDirect),
                connection: ShadowQueue::new(RayKind::ShadowConnection),
                heuristic,
            },
            splats: SplatQueue::new(stride, heuristic),
        }
    }

    /// Sends off the queued rays to the lens and hands over the results, after the contributions `probed` of eye
    /// sub-paths.
    pub fn finish(&mut self, mut tracer: Tracer, probed: Vec<Contribution>) -> TileOutput {
        self.splats.probed.extend(probed);
        self.splats.flush(&mut tracer);
        TileOutput {
            stats: tracer.stats,
            splats: std::mem::take(&mut self.splats.splats),
            probed: std::mem::take(&mut self.splats.probed),
        }
    }
}

/// Takes the contributions of eye sub-paths.
pub trait ContributionSink {
    /// Takes a visible contribution.
    fn add(&mut self, kind: ContributionKind, contribution: Contribution);
}

/// Adds contributions to the samples of a tile.
pub struct TileSink<'a> {
    /// Sums of the tile's pixels.
    pub samples: &'a mut SampleBuffer,
    /// The tile.
    pub tile: &'a FilmTile,
    /// Width of the full picture, by which pixels are numbered.
    pub film_width: u32,
    /// Which pixels are probed.
    pub stride: ProbeStride,
    /// Contributions to probed pixels.
    pub probed: Vec<Contribution>,
}

impl ContributionSink for TileSink<'_> {
    #[inline]
    fn add(&mut self, kind: ContributionKind, contribution: Contribution) {
        self.samples.add(kind, self.tile.index(contribution.x, contribution.y), contribution.weighted());
        if self.stride.probes(contribution.y * self.film_width + contribution.x) {
            self.probed.push(contribution);
        }
    }
}

/// The numbers in a replay of visible contributions.
impl ContributionSink for Vec<u32> {
    fn add(&mut self, _kind: ContributionKind, contribution: Contribution) {
        self.push(contribution.replay_index);
    }
}

/// The results of all pieces of work of an iteration, in their order.
#[derive(Default)]
pub struct PassOutput {
    /// Counts of rays.
    pub stats: RayStats,
    /// Visible splats of each piece.
    pub splats: Vec<Vec<Splat>>,
    /// Visible contributions of probed sub-paths, of each piece.
    pub probed: Vec<Vec<Contribution>>,
}

impl PassOutput {
    /// Adds the next pieces.
    pub fn add(&mut self, pieces: Vec<TileOutput>) {
        for piece in pieces {
            self.stats.merge(&piece.stats);
            self.splats.push(piece.splats);
            self.probed.push(piece.probed);
        }
    }
}
