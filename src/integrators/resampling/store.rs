//! The light vertices of an iteration, from which eye vertices draw.

use crate::integrators::Iteration;
use crate::integrators::bdpt::Bidirectional;
use crate::integrators::bdpt::light_path::{self, LightPath, LightVertex};
use crate::integrators::replay::{Replay, VertexRecord};
use crate::math::Vec3;
use crate::math::sampler::PathSampler;
use crate::mis::Node;
use crate::path::Origin;
use crate::ray::{RayStats, Tracer};
use crate::shade::Transport;
use crate::spatial::morton;
use rayon::prelude::*;

/// The random stream of light sub-paths to draw from.
const STORE_STREAM: u64 = 5;
/// Sub-paths in a piece of work.
const AT_ONCE: u32 = 64;

/// One light sub-path of a set of an iteration.
fn trace_one(
    this: &Bidirectional,
    iteration: &Iteration,
    (set, path): (u64, u32),
    tracer: &mut Tracer,
    record: Option<&mut Replay>,
) -> LightPath {
    let mut out = LightPath::default();
    let stream = STORE_STREAM | set << 32;
    let mut sampler = PathSampler::new(iteration.seed, stream, iteration.index, u64::from(path));
    light_path::trace(this, iteration.scene, &mut sampler, tracer, &mut out, None, record, true);
    out
}

/// Light sub-paths, cut at every vertex that can be connected to.
#[derive(Debug, Default)]
pub(in crate::integrators) struct LightStore {
    /// M, with those that ended at once.
    pub paths_traced: u32,
    paths: Vec<StoredPath>,
    nodes: Vec<Node>,
    /// In an order that keeps neighbours together.
    pub vertices: Vec<StoredVertex>,
}

#[derive(Clone, Copy, Debug)]
struct StoredPath {
    number: u32,
    first_node: usize,
    next_event: f32,
    light_can_be_hit: bool,
    origin: Option<Origin>,
}

/// A vertex, and the sub-path it ends.
#[derive(Clone, Debug)]
pub(in crate::integrators) struct StoredVertex {
    pub vertex: LightVertex,
    path: u32,
}

impl LightVertex {
    /// q̂/p: luminance of what the sub-path that ends here brings to a surface at `p` on the side `n`, per unit area, as if nothing were
    /// in the way.
    #[inline]
    pub fn brings(&self, p: Vec3, n: Vec3) -> f32 {
        let to = p - self.point.p;
        let dist2 = to.length_squared();
        let towards = to * (1.0 / dist2.sqrt());
        let cos = -n.dot(towards);
        // A point on the light vertex itself has no direction to it: not a number, and not above its horizon.
        if cos.is_nan() || cos <= 0.0 {
            return 0.0;
        }
        let value = self.bsdf.eval(self.wo, towards, Transport::Importance);
        (self.throughput * value).luminance() * cos / dist2
    }
}

impl LightStore {
    /// Traces `paths` light sub-paths of the iteration; `set` tells those of the same iteration apart.
    pub fn trace(this: &Bidirectional, iteration: &Iteration, paths: u32, set: u64) -> (LightStore, RayStats) {
        let scene = iteration.scene;
        let pieces: Vec<(Vec<LightPath>, RayStats)> = (0..paths.div_ceil(AT_ONCE))
            .into_par_iter()
            .map(|piece| {
                let mut tracer = Tracer::new(&*scene.query);
                let trace = |path: u32| trace_one(this, iteration, (set, path), &mut tracer, None);
                let range = piece * AT_ONCE..paths.min((piece + 1) * AT_ONCE);
                (range.map(trace).collect(), tracer.stats)
            })
            .collect();
        let mut store = LightStore { paths_traced: paths, ..LightStore::default() };
        let mut stats = RayStats::default();
        for (number, path) in pieces
            .into_iter()
            .flat_map(|(paths, s)| {
                stats.merge(&s);
                paths
            })
            .enumerate()
        {
            store.add((number as u32, path));
        }
        store.sort();
        (store, stats)
    }

    /// The surface vertices of sub-path `number` of the iteration, written down.
    pub fn retrace(this: &Bidirectional, iteration: &Iteration, number: u32) -> Vec<VertexRecord> {
        let mut replay = Replay::default();
        let mut tracer = Tracer::new(&*iteration.scene.query);
        trace_one(this, iteration, (0, number), &mut tracer, Some(&mut replay));
        replay.light
    }

    fn add(&mut self, (sub_path, path): (u32, LightPath)) {
        let number = self.paths.len() as u32;
        if path.vertices.is_empty() {
            return;
        }
        self.paths.push(StoredPath {
            number: sub_path,
            first_node: self.nodes.len(),
            next_event: path.next_event,
            light_can_be_hit: path.light_can_be_hit,
            origin: path.origin,
        });
        self.nodes.extend_from_slice(path.side.nodes());
        self.vertices.extend(path.vertices.into_iter().map(|vertex| StoredVertex { vertex, path: number }));
    }

    fn sort(&mut self) {
        let positions: Vec<Vec3> = self.vertices.iter().map(|v| v.vertex.point.p).collect();
        let mut vertices: Vec<Option<StoredVertex>> =
            std::mem::take(&mut self.vertices).into_iter().map(Some).collect();
        let order = morton::order(&positions);
        self.vertices = order.into_iter().filter_map(|i| vertices[i as usize].take()).collect();
    }

    /// The sub-path that ends in vertex `v`, as a candidate for a connection that counts `scale` times.
    #[inline]
    pub fn candidate(&self, v: usize, scale: f32) -> crate::integrators::bdpt::eye_path::Candidate<'_> {
        let StoredVertex { vertex, path } = &self.vertices[v];
        let path = &self.paths[*path as usize];
        crate::integrators::bdpt::eye_path::Candidate {
            vertex,
            nodes: &self.nodes[path.first_node..path.first_node + vertex.s],
            next_event: path.next_event,
            light_can_be_hit: path.light_can_be_hit,
            origin: path.origin,
            number: Some(path.number),
            scale,
        }
    }
}
