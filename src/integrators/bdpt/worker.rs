//! What workers keep from one sub-path to the next, and what they bring back.

use super::eye_path::Arrival;
use super::light_path::LightPath;
use super::{Bidirectional, Found};
use crate::film::{FilmTile, Part, SampleBuffer, Splat};
use crate::mis::Side;
use crate::path::ShadowQueue;
use crate::ray::{RayKind, RayStats, Tracer};

/// What a worker keeps from one pixel to the next.
pub(super) struct Worker {
    pub light: LightPath,
    pub eye: Side,
    pub direct: ShadowQueue<Found>,
    pub connection: ShadowQueue<Found>,
    pub lens: ShadowQueue<Found>,
    pub splats: Vec<Splat>,
    /// Visible contributions that are wanted by themselves.
    pub found: Vec<Found>,
}

/// What a worker brings back from a piece of work.
#[derive(Default)]
pub(in crate::integrators) struct Piece {
    pub stats: RayStats,
    pub splats: Vec<Splat>,
    pub found: Vec<Found>,
}

impl Worker {
    pub fn new() -> Worker {
        Worker {
            light: LightPath::default(),
            eye: Side::default(),
            direct: ShadowQueue::new(RayKind::ShadowDirect),
            connection: ShadowQueue::new(RayKind::ShadowConnection),
            lens: ShadowQueue::new(RayKind::ShadowLens),
            splats: vec![],
            found: vec![],
        }
    }

    /// Sends off what is queued for the lens and hands over all that was found.
    pub fn finish(&mut self, this: &Bidirectional, mut tracer: Tracer) -> Piece {
        let (splats, all) = (&mut self.splats, &mut self.found);
        self.lens.flush(&mut tracer, |f| {
            splats.push(splat(f));
            if this.wants(f.path) {
                all.push(f);
            }
        });
        Piece { stats: tracer.stats, splats: std::mem::take(splats), found: std::mem::take(all) }
    }
}

/// Adds up what a tile's own eye sub-paths find.
pub(super) fn add_to(samples: &mut SampleBuffer, tile: &FilmTile, arrival: Arrival, found: &Found) {
    let part = match arrival {
        Arrival::Hit => Part::AtOnce,
        Arrival::Direct => Part::Direct,
        Arrival::Connection => Part::Connection,
    };
    samples.add(part, tile.index(found.x, found.y), found.raw * found.weight.own);
}

pub(super) fn splat(found: Found) -> Splat {
    let Found { x, y, path, note, s, .. } = found;
    Splat { x, y, path, vertex: u32::from(s), note, value: found.raw * found.weight.own }
}

/// Everything that all pieces of work brought back, in their order.
#[derive(Default)]
pub(super) struct Harvest {
    pub stats: RayStats,
    pub splats: Vec<Vec<Splat>>,
    pub found: Vec<Vec<Found>>,
}

impl Harvest {
    pub fn add(&mut self, pieces: Vec<Piece>) {
        for piece in pieces {
            self.stats.merge(&piece.stats);
            self.splats.push(piece.splats);
            self.found.push(piece.found);
        }
    }
}
