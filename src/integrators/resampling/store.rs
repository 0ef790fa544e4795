//! The light vertices of an iteration, from which eye vertices draw.

use crate::integrators::Iteration;
use crate::integrators::bdpt::Bidirectional;
use crate::integrators::bdpt::eye_path::Candidate;
use crate::integrators::bdpt::light_path::{self, LightPath, LightVertex};
use crate::integrators::replay::{Replay, VertexRecord};
use crate::math::Vec3;
use crate::math::sampler::PathSampler;
use crate::mis::{Node, Targets};
use crate::path::Origin;
use crate::ray::{RayStats, Tracer};
use crate::shade::{BsdfPool, BsdfRef, Transport};
use crate::spatial::{PointTree, morton};
use rayon::prelude::*;

/// The random stream of light sub-paths that estimate normalisations before the first iteration.
const WARM_UP_STREAM: u64 = 5;
/// Sub-paths in a piece of work.
const AT_ONCE: u32 = 64;

/// Light sub-paths, cut at every vertex that can be connected to.
#[derive(Debug, Default)]
pub(in crate::integrators) struct LightStore {
    /// M, with those that ended at once.
    pub paths_traced: u32,
    nodes: Vec<Node>,
    /// When finished, in an order that keeps neighbours together.
    vertices: Vec<StoredVertex>,
    /// The same before that: kept for its memory.
    unsorted: Vec<StoredVertex>,
    bsdfs: BsdfPool,
    /// Tree over the vertices, weighed by the luminance of f_y/p.
    pub tree: PointTree,
}

/// A vertex, and what is to be known of the sub-path it ends: all that a connection reads but the densities.
#[derive(Clone, Copy, Debug)]
struct StoredVertex {
    vertex: LightVertex,
    /// Number of the sub-path among those of the iteration.
    number: u32,
    /// The first of its densities.
    first_node: u32,
    next_event: f32,
    light_can_be_hit: bool,
}

impl LightVertex {
    /// What the sub-path that ends here, where the BSDF is `bsdf`, brings to a surface at `p` on the side `n`, as if nothing were in the way: q̂₂/p and q̂₁/p.
    #[inline]
    pub fn brings(&self, bsdf: &BsdfRef, p: Vec3, n: Vec3) -> Targets {
        let to = p - self.p;
        let dist2 = to.length_squared();
        let towards = to * (1.0 / dist2.sqrt());
        let cos = -n.dot(towards);
        // A point on the light vertex itself has no direction to it: not a number, and not above its horizon.
        if cos.is_nan() || cos <= 0.0 {
            return Targets::default();
        }
        let value = bsdf.eval(self.wo, towards, Transport::Importance);
        let spread = cos / dist2;
        let targets = Targets {
            scattered: (self.throughput * value).luminance() * spread,
            unscattered: self.throughput.luminance() * self.ng.dot(towards).abs() * spread,
        };
        if targets.scattered.is_finite() && targets.unscattered.is_finite() { targets } else { Targets::default() }
    }
}

impl LightStore {
    /// Traces light sub-paths, of which `set` tells one set from another, before the first iteration.
    pub fn trace(
        this: &Bidirectional,
        iteration: &Iteration,
        (paths, set): (u32, u64),
        with_tree: bool,
    ) -> (LightStore, RayStats) {
        let scene = iteration.scene;
        let stream = WARM_UP_STREAM | set << 32;
        let pieces: Vec<(LightStore, RayStats)> = (0..paths.div_ceil(AT_ONCE))
            .into_par_iter()
            .map(|piece| {
                let (mut tracer, mut path) = (Tracer::new(&*scene.query), LightPath::default());
                let mut store = LightStore::default();
                for number in piece * AT_ONCE..paths.min((piece + 1) * AT_ONCE) {
                    let mut sampler = PathSampler::new(iteration.seed, stream, iteration.index, u64::from(number));
                    light_path::trace(this, scene, &mut sampler, &mut tracer, &mut path, None, None, true);
                    store.keep(number, &path);
                }
                (store, tracer.stats)
            })
            .collect();
        let mut store = LightStore::default();
        let mut stats = RayStats::default();
        for (piece, s) in pieces {
            store.append(&piece);
            stats.merge(&s);
        }
        store.finish(with_tree);
        (store, stats)
    }

    /// The surface vertices of sub-path `number` of the iteration, written down, and its origin.
    pub fn retrace(this: &Bidirectional, iteration: &Iteration, number: u32) -> (Vec<VertexRecord>, Option<Origin>) {
        let mut replay = Replay::default();
        let mut tracer = Tracer::new(&*iteration.scene.query);
        let mut sampler = this.light_sampler(iteration, number);
        let mut path = LightPath::default();
        light_path::trace(this, iteration.scene, &mut sampler, &mut tracer, &mut path, None, Some(&mut replay), true);
        (replay.light, path.origin)
    }

    /// Takes in sub-path `number`.
    pub fn keep(&mut self, number: u32, path: &LightPath) {
        self.paths_traced += 1;
        if path.vertices.is_empty() {
            return;
        }
        let first_node = self.nodes.len() as u32;
        self.nodes.extend_from_slice(path.side.nodes());
        let bsdfs = &mut self.bsdfs;
        self.vertices.extend(path.vertices.iter().map(|v| StoredVertex {
            vertex: LightVertex { bsdf: bsdfs.keep_from(&v.bsdf, &path.bsdfs), ..*v },
            number,
            first_node,
            next_event: path.next_event,
            light_can_be_hit: path.light_can_be_hit,
        }));
    }

    /// Takes in everything of `other`.
    pub fn append(&mut self, other: &LightStore) {
        let first_node = self.nodes.len() as u32;
        self.paths_traced += other.paths_traced;
        self.nodes.extend_from_slice(&other.nodes);
        let moved = self.bsdfs.append(&other.bsdfs);
        self.vertices.extend(other.vertices.iter().map(|v| {
            let vertex = LightVertex { bsdf: v.vertex.bsdf.moved(moved), ..v.vertex };
            StoredVertex { vertex, first_node: v.first_node + first_node, ..*v }
        }));
    }

    /// Puts the vertices in order, when all are there, and builds the tree over them if a first stage wants it.
    pub fn finish(&mut self, with_tree: bool) {
        let positions: Vec<Vec3> = self.vertices.iter().map(|v| v.vertex.p).collect();
        let order = morton::order(&positions);
        // The memory of the last iteration takes the vertices of this one.
        std::mem::swap(&mut self.vertices, &mut self.unsorted);
        let unsorted = &self.unsorted;
        order.par_iter().map(|&i| unsorted[i as usize]).collect_into_vec(&mut self.vertices);
        if !with_tree {
            return;
        }
        let sorted: Vec<Vec3> = order.iter().map(|&i| positions[i as usize]).collect();
        self.tree.build(
            &sorted,
            self.vertices.iter().map(|v| {
                let weight = v.vertex.throughput.luminance();
                if weight.is_finite() { weight } else { 0.0 }
            }),
        );
    }

    /// Forgets everything but its memory.
    pub fn clear(&mut self) {
        self.paths_traced = 0;
        self.nodes.clear();
        self.vertices.clear();
        self.bsdfs.clear();
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// For each number of vertices, how many sub-paths can be connected to by their vertex of that number; one more is zero.
    pub fn lengths(&self) -> Vec<u32> {
        let most = self.vertices.iter().map(|v| v.vertex.length()).max().unwrap_or(0);
        let mut counts = vec![0; most + 2];
        self.vertices.iter().for_each(|v| counts[v.vertex.length()] += 1);
        counts
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// A vertex, by its place in the order.
    #[inline]
    pub fn vertex(&self, v: usize) -> &LightVertex {
        &self.vertices[v].vertex
    }

    /// The BSDF of one of its vertices.
    #[inline]
    pub fn bsdf(&self, vertex: &LightVertex) -> BsdfRef<'_> {
        self.bsdfs.get(&vertex.bsdf, vertex.ng)
    }

    /// The sub-path that ends in vertex `v`, as a candidate for a connection that counts `scale` times.
    #[inline]
    pub fn candidate(&self, v: usize, scale: f32) -> Candidate<'_> {
        let StoredVertex { vertex, number, first_node, next_event, light_can_be_hit } = &self.vertices[v];
        Candidate {
            vertex,
            bsdf: self.bsdf(vertex),
            nodes: &self.nodes[*first_node as usize..][..vertex.length()],
            next_event: *next_event,
            light_can_be_hit: *light_can_be_hit,
            origin: None,
            number: Some(*number),
            scale,
        }
    }
}
