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
    /// As they were traced. The memory of one iteration is the next one's.
    parts: Vec<Part>,
    /// When finished, all vertices in an order that keeps neighbours together.
    vertices: Vec<StoredVertex>,
    /// Tree over the vertices, weighed by the luminance of f_y/p.
    pub tree: PointTree,
    order: Order,
}

/// What is written down to put vertices in order; kept for its memory.
#[derive(Debug, Default)]
struct Order {
    positions: Vec<Vec3>,
    /// Of each vertex its part, and its number there.
    sources: Vec<(u16, u32)>,
    /// Morton codes with numbers of vertices, and codes alone.
    keys: Vec<(u32, u32)>,
    codes: Vec<u32>,
    /// Positions in Morton order, with weights.
    points: Vec<(Vec3, f32)>,
}

/// The light sub-paths of one piece of work.
#[derive(Debug, Default)]
pub(in crate::integrators) struct Part {
    nodes: Vec<Node>,
    vertices: Vec<StoredVertex>,
    bsdfs: BsdfPool,
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
    /// The part that has its densities and its BSDF.
    part: u16,
    light_can_be_hit: bool,
}

/// Unit direction from `from` to a surface at `p` on the side `n`, and |cos| / distance² there; none if it arrives from below.
#[inline]
pub(super) fn direction_to(from: Vec3, p: Vec3, n: Vec3) -> Option<(Vec3, f32)> {
    let to = p - from;
    let dist2 = to.length_squared();
    let towards = to * (1.0 / dist2.sqrt());
    let cos = -n.dot(towards);
    // A point has no direction to itself: not a number, and not above the horizon.
    (cos > 0.0).then_some((towards, cos / dist2))
}

impl LightVertex {
    /// What the sub-path that ends here, where the BSDF is `bsdf`, brings to a surface at `p` on the side `n`, as if nothing were in the way: q̂₂/p and q̂₁/p.
    #[inline]
    pub fn brings(&self, bsdf: &BsdfRef, p: Vec3, n: Vec3) -> Targets {
        let Some((towards, spread)) = direction_to(self.p, p, n) else { return Targets::default() };
        let value = bsdf.eval(self.wo, towards, Transport::Importance);
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
        let mut store = LightStore::default();
        let trace_part = |(number, part): (usize, &mut Part)| {
            let (mut tracer, mut path) = (Tracer::new(&*scene.query), LightPath::default());
            let first = number as u32 * AT_ONCE;
            for number in first..paths.min(first + AT_ONCE) {
                let mut sampler = PathSampler::new(iteration.seed, stream, iteration.index, u64::from(number));
                light_path::trace(this, scene, &mut sampler, &mut tracer, &mut path, None, None, true);
                part.keep(number, &path);
            }
            tracer.stats
        };
        let stats: Vec<RayStats> =
            store.begin(paths.div_ceil(AT_ONCE)).par_iter_mut().enumerate().map(trace_part).collect();
        store.finish(paths, with_tree);
        let mut all = RayStats::default();
        stats.iter().for_each(|s| all.merge(s));
        (store, all)
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

    /// Forgets everything but its memory; what there will be comes into so many parts, of which vertices can number 2¹⁶.
    pub fn begin(&mut self, parts: u32) -> &mut [Part] {
        debug_assert!(parts <= 1 << 16, "{parts}");
        self.vertices.clear();
        self.parts.resize_with(parts as usize, Part::default);
        self.parts.iter_mut().for_each(Part::clear);
        &mut self.parts
    }

    /// Puts the vertices of all `paths` sub-paths in order, and builds the tree over them if a first stage wants it.
    pub fn finish(&mut self, paths: u32, with_tree: bool) {
        self.paths_traced = paths;
        let (parts, Order { positions, sources, keys, codes, points }) = (&self.parts, &mut self.order);
        positions.clear();
        sources.clear();
        for (number, part) in parts.iter().enumerate() {
            positions.extend(part.vertices.iter().map(|v| v.vertex.p));
            sources.extend((0..part.vertices.len()).map(|i| (number as u16, i as u32)));
        }
        morton::sort(positions, keys);
        let of_source = |&(_, i): &(u32, u32)| {
            let (part, i) = sources[i as usize];
            StoredVertex { part, ..parts[usize::from(part)].vertices[i as usize] }
        };
        keys.par_iter().map(of_source).collect_into_vec(&mut self.vertices);
        if with_tree {
            keys.par_iter().map(|&(code, _)| code).collect_into_vec(codes);
            let weighed = |v: &StoredVertex| {
                let weight = v.vertex.throughput.luminance();
                (v.vertex.p, if weight.is_finite() { weight } else { 0.0 })
            };
            self.vertices.par_iter().map(weighed).collect_into_vec(points);
            self.tree.build(codes, points);
        }
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

    /// The BSDF of a vertex, by its place in the order.
    #[inline]
    pub fn bsdf(&self, v: usize) -> BsdfRef<'_> {
        let StoredVertex { vertex, part, .. } = &self.vertices[v];
        self.parts[usize::from(*part)].bsdfs.get(&vertex.bsdf, vertex.ng)
    }

    /// The sub-path that ends in vertex `v`, as a candidate for a connection that counts `scale` times.
    #[inline]
    pub fn candidate(&self, v: usize, scale: f32) -> Candidate<'_> {
        let StoredVertex { vertex, number, first_node, next_event, part, light_can_be_hit } = &self.vertices[v];
        Candidate {
            vertex,
            bsdf: self.bsdf(v),
            nodes: &self.parts[usize::from(*part)].nodes[*first_node as usize..][..vertex.length()],
            next_event: *next_event,
            light_can_be_hit: *light_can_be_hit,
            origin: None,
            number: Some(*number),
            proposal: None,
            near: None,
            scale,
        }
    }
}

impl Part {
    fn clear(&mut self) {
        self.nodes.clear();
        self.vertices.clear();
        self.bsdfs.clear();
    }

    /// Takes in sub-path `number`.
    pub fn keep(&mut self, number: u32, path: &LightPath) {
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
            part: 0,
            light_can_be_hit: path.light_can_be_hit,
        }));
    }
}
