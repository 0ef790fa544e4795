//! The light vertices of an iteration, from which eye vertices draw.

use super::light_subpath::LightSubpath;
use super::strategy::Candidate;
use super::vertex::LightVertex;
use crate::math::Vec3;
use crate::mis::{EmitterFactors, VertexPdfs};
use crate::shade::{BsdfPool, BsdfView};
use crate::spatial::light_tree::WeightedPoint;
use crate::spatial::{VplTree, morton};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Light sub-paths, cut at every vertex that can be connected to.
#[derive(Debug, Default)]
pub struct VertexStore {
    /// M, sub-paths that ended at once included.
    pub paths_traced: u32,
    /// The sub-paths as they were traced. The memory of one iteration is the next one's.
    chunks: Vec<StoreChunk>,
    /// When finished, all vertices in an order that keeps neighbours in space together.
    vertices: Vec<StoredVertex>,
    /// Tree over the vertices, weighed by the luminance of f_y/p.
    pub tree: VplTree,
    order: SpatialOrder,
}

/// Working memory of putting vertices in order, kept from one iteration to the next.
#[derive(Debug, Default)]
struct SpatialOrder {
    positions: Vec<Vec3>,
    /// For each vertex its chunk, and its number there.
    sources: Vec<(u16, u32)>,
    /// Morton codes with numbers of vertices, and codes alone.
    keys: Vec<(u32, u32)>,
    codes: Vec<u32>,
    /// Positions in Morton order, with weights.
    points: Vec<WeightedPoint>,
}

/// The light sub-paths of one piece of work.
#[derive(Debug, Default)]
pub struct StoreChunk {
    pdfs: Vec<VertexPdfs>,
    vertices: Vec<StoredVertex>,
    bsdfs: BsdfPool,
}

/// A vertex with the facts about its sub-path that a connection reads, but for the densities.
#[derive(Clone, Copy, Debug)]
struct StoredVertex {
    vertex: LightVertex,
    /// Number of the sub-path among those of the iteration.
    number: u32,
    /// The first of its densities.
    first_pdf: u32,
    /// c_1.
    next_event: f32,
    /// The chunk that has its densities and its BSDF.
    chunk: u16,
    /// c_0 = 1.
    can_be_hit: bool,
}

/// Stored light vertices and the sub-paths that they come from, summed over stores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VertexCount {
    /// Vertices.
    pub vertices: u64,
    /// Sub-paths, those that ended at once included.
    pub paths: u64,
}

impl VertexCount {
    /// Counts what a store has.
    pub fn add(&mut self, store: &VertexStore) {
        self.vertices += store.len() as u64;
        self.paths += u64::from(store.paths_traced);
    }

    /// L, an estimate of the mean number of stored vertices of a light sub-path; 0 if nothing is known yet.
    pub fn vertices_per_path(&self) -> f64 {
        if self.paths > 0 { self.vertices as f64 / self.paths as f64 } else { 0.0 }
    }
}

impl VertexStore {
    /// Forgets everything but the memory; the sub-paths to come are written into so many chunks, of which vertices can
    /// number 2¹⁶.
    pub fn begin(&mut self, chunks: u32) -> &mut [StoreChunk] {
        debug_assert!(chunks <= 1 << 16, "{chunks}");
        self.vertices.clear();
        self.chunks.resize_with(chunks as usize, StoreChunk::default);
        self.chunks.iter_mut().for_each(StoreChunk::clear);
        &mut self.chunks
    }

    /// Puts the vertices of all `paths` sub-paths in order, and builds the tree over them if a first stage wants it.
    pub fn finish(&mut self, paths: u32, with_tree: bool) {
        self.paths_traced = paths;
        let (chunks, SpatialOrder { positions, sources, keys, codes, points }) = (&self.chunks, &mut self.order);
        positions.clear();
        sources.clear();
        for (number, chunk) in chunks.iter().enumerate() {
            positions.extend(chunk.vertices.iter().map(|v| v.vertex.place.position()));
            sources.extend((0..chunk.vertices.len()).map(|i| (number as u16, i as u32)));
        }
        morton::sort(positions, keys);
        let of_source = |&(_, i): &(u32, u32)| {
            let (chunk, i) = sources[i as usize];
            StoredVertex { chunk, ..chunks[usize::from(chunk)].vertices[i as usize] }
        };
        keys.par_iter().map(of_source).collect_into_vec(&mut self.vertices);
        if with_tree {
            keys.par_iter().map(|&(code, _)| code).collect_into_vec(codes);
            let weighed = |v: &StoredVertex| {
                let weight = v.vertex.throughput.luminance();
                let weight = if weight.is_finite() { weight } else { 0.0 };
                WeightedPoint { p: v.vertex.place.position(), weight }
            };
            self.vertices.par_iter().map(weighed).collect_into_vec(points);
            self.tree.build_morton(codes, points);
        }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// For each number s, how many sub-paths can be connected to by their vertex y_{s−1}; one entry more is zero.
    pub fn lengths(&self) -> Vec<u32> {
        let most = self.vertices.iter().map(|v| v.vertex.length()).max().unwrap_or(0);
        let mut counts = vec![0; most + 2];
        self.vertices.iter().for_each(|v| counts[v.vertex.length()] += 1);
        counts
    }

    /// A vertex, by its place in the order.
    #[inline]
    pub fn vertex(&self, v: usize) -> &LightVertex {
        &self.vertices[v].vertex
    }

    /// The BSDF of a vertex, by its place in the order.
    #[inline]
    pub fn bsdf(&self, v: usize) -> BsdfView<'_> {
        let StoredVertex { vertex, chunk, .. } = &self.vertices[v];
        vertex.bsdf_in(&self.chunks[usize::from(*chunk)].bsdfs)
    }

    /// The sub-path that ends in vertex `v`, as a candidate that counts `scale` times.
    #[inline]
    pub fn candidate<L>(&self, v: usize, scale: f32) -> Candidate<'_, L> {
        let StoredVertex { vertex, number, first_pdf, next_event, chunk, can_be_hit } = &self.vertices[v];
        Candidate {
            vertex,
            bsdf: self.bsdf(v),
            pdfs: &self.chunks[usize::from(*chunk)].pdfs[*first_pdf as usize..][..vertex.length()],
            emitter: EmitterFactors { can_be_hit: *can_be_hit, next_event: *next_event },
            origin: None,
            number: Some(*number),
            scale,
            selected: None,
            lookup: None,
        }
    }
}

impl StoreChunk {
    fn clear(&mut self) {
        self.pdfs.clear();
        self.vertices.clear();
        self.bsdfs.clear();
    }

    /// Stores sub-path `number`.
    pub fn push(&mut self, number: u32, path: &LightSubpath) {
        if path.vertices.is_empty() {
            return;
        }
        let first_pdf = self.pdfs.len() as u32;
        self.pdfs.extend_from_slice(path.pdfs.all());
        let bsdfs = &mut self.bsdfs;
        self.vertices.extend(path.vertices.iter().map(|v| StoredVertex {
            vertex: LightVertex { bsdf: bsdfs.store_from(&v.bsdf, &path.bsdfs), ..*v },
            number,
            first_pdf,
            next_event: path.emitter.next_event,
            chunk: 0,
            can_be_hit: path.emitter.can_be_hit,
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Connections to stored vertices are bound by memory traffic: growth must be a decision. (Four bytes tell places on
    /// surfaces from those in media.)
    #[test]
    fn a_stored_vertex_has_140_bytes() {
        assert_eq!(size_of::<StoredVertex>(), 140);
    }
}
