//! Connections drawn by the pmfs at the importance records of an eye vertex: its skeleton node, or the nearest records
//! on surfaces.

use super::models::RecordFactor;
use super::record_pmfs::{RecordPmfs, Selection, SelectionScheme};
use super::records::ImportanceRecords;
use super::running_means::RunningMeans;
use crate::bidir::{Candidate, ConnectionStrategy, EyeVertex, LightSubpaths, VertexCount, VertexStore, WarmUp};
use crate::math::sampler::{PathSampler, SampleSlot, systematic};
use crate::math::{Rgb, Vec3};
use crate::mis::ConnectionFactor;
use crate::mis::factors::RecordNormalization;
use crate::path::{Iteration, StoredPlace};
use crate::ray::offset::SegmentEnd;
use crate::ray::{RayStats, Tracer};
use crate::spatial::nearest::MAX_NEIGHBORS;
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// The fraction of the golden ratio: its multiples fill a circle evenly.
const GOLDEN: f32 = 0.618_034;

/// Where the records are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RecordPlaces {
    /// Vertices of eye sub-paths.
    Surfaces {
        /// Eye sub-paths, per pixel.
        fraction: f64,
        /// Records that an eye vertex mixes.
        neighbors: usize,
    },
    /// Nodes of the skeleton of empty space.
    Nodes {
        /// Voxels along the longest side of the scene, if not decided by the scene.
        cells: Option<usize>,
        /// Nodes with no more than this multiple of the mean number of eye vertices are left out.
        acceptance: f64,
    },
}

/// Settings that users decide.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordSettings {
    /// N, light sub-paths of an iteration.
    pub paths: u32,
    /// Draws of an eye vertex, for each class of light vertices.
    pub samples: u32,
    pub places: RecordPlaces,
    pub scheme: SelectionScheme,
}

/// The records of an eye vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NearestRecords {
    count: usize,
    records: [usize; MAX_NEIGHBORS],
}

impl NearestRecords {
    /// Their numbers.
    #[inline]
    pub fn records(&self) -> &[usize] {
        &self.records[..self.count]
    }
}

/// Records with the pmfs of an iteration's light vertices and the knowledge of weights.
#[derive(Debug)]
pub(super) struct RecordStructure {
    /// `None` until they are placed.
    pub records: Option<ImportanceRecords>,
    pub pmfs: RecordPmfs,
    pub means: RunningMeans,
    pub scheme: SelectionScheme,
    /// N.
    pub paths: u32,
    /// For each s the fraction of light sub-paths that have at least s vertices, where one of each length is drawn.
    pub share_of_length: Vec<f32>,
    neighbors: usize,
    pub counted: VertexCount,
}

impl RecordStructure {
    fn new(settings: &RecordSettings) -> RecordStructure {
        RecordStructure {
            records: None,
            pmfs: RecordPmfs::default(),
            means: RunningMeans::default(),
            scheme: settings.scheme,
            paths: settings.paths,
            share_of_length: vec![],
            neighbors: match settings.places {
                RecordPlaces::Surfaces { neighbors, .. } => neighbors,
                RecordPlaces::Nodes { .. } => 1,
            },
            counted: VertexCount::default(),
        }
    }

    /// The records of a place, on the side of the direction `d`.
    #[inline]
    pub fn nearest(&self, place: &StoredPlace, d: Vec3) -> NearestRecords {
        let mut near = NearestRecords::default();
        if let Some(records) = &self.records {
            let (p, n) = (place.position(), place.side_normal(d));
            near.count = records.find(p, n, self.neighbors, &mut near.records);
        }
        near
    }

    /// Q at an eye vertex with these records, where all light vertices are drawn from together.
    #[inline]
    pub fn normalization(&self, near: &NearestRecords) -> RecordNormalization {
        let Some(records) = &self.records else { return RecordNormalization::default() };
        let near = near.records();
        let per_light = near.iter().map(|&r| self.means.probability_per_light(r)).sum::<f64>() / near.len() as f64;
        let q = self.counted.vertices_per_path() * records.mean_cosine() / per_light;
        RecordNormalization(if q.is_finite() { q as f32 } else { 0.0 })
    }

    /// Fraction of light sub-paths with at least s vertices, as far as is known; never zero.
    fn share_of_length(&self, s: usize) -> f32 {
        let last = self.share_of_length.last().copied().unwrap_or(1.0);
        self.share_of_length.get(s).copied().unwrap_or(last)
    }
}

/// A saved state.
#[derive(Serialize, Deserialize)]
struct SavedRecords {
    means: RunningMeans,
    counted: VertexCount,
}

/// The strategy, with weights by the factor `F`.
#[derive(Debug)]
pub(super) struct RecordStrategy<F> {
    settings: RecordSettings,
    structure: RecordStructure,
    factor: PhantomData<F>,
}

impl<F: RecordFactor> RecordStrategy<F> {
    /// Without records yet.
    pub fn new(settings: RecordSettings) -> RecordStrategy<F> {
        RecordStrategy { settings, structure: RecordStructure::new(&settings), factor: PhantomData }
    }

    /// Draws from one class of light vertices.
    fn draw_class<'a>(
        &'a self,
        class: usize,
        near: &NearestRecords,
        eye: &EyeVertex<'a, '_>,
        sampler: &mut PathSampler,
        mut drawn: impl FnMut(Candidate<'a, F::Lookup>),
    ) {
        let (pmfs, samples) = (&self.structure.pmfs, self.settings.samples);
        // Long sub-paths are rare and dim: no more of them are connected to than a pixel's own sub-path would have. A
        // sub-path is then as likely to be met as by the pixel's own: in weights, such connections count as one.
        let share = pmfs.length(class).map_or(1.0, |s| self.structure.share_of_length(s));
        let fraction = eye.fraction * share;
        // Next event leaves the last of its numbers. Classes have offsets of their own, or their draws would be alike.
        let [.., offset] = sampler.vertex(eye.vertex.index, SampleSlot::Emitter);
        let offset = (offset + class as f32 * GOLDEN).fract();
        for number in 0..samples {
            let [record, present, ..] = sampler.rng().next_4();
            if present >= fraction {
                continue;
            }
            let selection = pmfs.draw(class, near.records(), [record, systematic(number, samples, offset)]);
            let draws = self.settings.paths as f32 * samples as f32;
            drawn(eye.store.candidate(selection.vertex, 1.0 / (selection.probability * draws * fraction)));
        }
    }
}

impl<F: RecordFactor> ConnectionStrategy for RecordStrategy<F> {
    type Factor = F;
    type Lookup = F::Lookup;

    const NEEDS_LIGHT_VERTEX: bool = F::NEEDS_LIGHT_VERTEX;

    fn light_subpaths(&self) -> LightSubpaths {
        LightSubpaths::Shared { count: self.settings.paths, tree: false }
    }

    fn samples(&self) -> f32 {
        self.settings.samples as f32
    }

    fn factor(&self) -> F {
        F::new(&self.structure)
    }

    fn place(&mut self, warm_up: &WarmUp) -> RayStats {
        let (records, mut stats) = match self.settings.places {
            RecordPlaces::Surfaces { fraction, .. } => ImportanceRecords::on_surfaces(warm_up, fraction),
            RecordPlaces::Nodes { cells, acceptance } => ImportanceRecords::at_nodes(warm_up, cells, acceptance),
        };
        let (structure, scheme) = (&mut self.structure, self.settings.scheme);
        if scheme.selection == Selection::PerLength {
            let (store, s) = warm_up.light_vertices(WarmUp::MAX_PATHS, 1, false);
            stats.merge(&s);
            // A length that was not met is not impossible.
            let share = |&n: &u32| (n as f32).max(0.5) / WarmUp::MAX_PATHS as f32;
            structure.share_of_length = store.lengths().iter().map(share).collect();
        }
        if !F::IS_ONE {
            let paths = self.settings.paths.min(WarmUp::MAX_PATHS);
            for set in 1..=WarmUp::SETS {
                let (store, s) = warm_up.light_vertices(paths, set, false);
                stats.merge(&s);
                let mut pmfs = RecordPmfs::default();
                stats.merge(&pmfs.find(&warm_up.iteration, &records, &store, scheme));
                structure.means.learn(&pmfs);
                structure.counted.add(&store);
            }
        }
        structure.records = Some(records);
        stats
    }

    fn prepare(&mut self, iteration: &Iteration, store: &VertexStore) -> RayStats {
        let RecordStructure { records, pmfs, scheme, .. } = &mut self.structure;
        records.as_ref().map_or_else(RayStats::default, |records| pmfs.find(iteration, records, store, *scheme))
    }

    fn learn(&mut self, store: &VertexStore) {
        if !F::IS_ONE {
            self.structure.means.learn(&self.structure.pmfs);
            self.structure.counted.add(store);
        }
    }

    fn reset(&mut self) {
        *self = RecordStrategy::new(self.settings);
    }

    #[inline]
    fn draw<'a>(
        &'a self,
        eye: &EyeVertex<'a, '_>,
        sampler: &mut PathSampler,
        wanted: impl Fn(usize) -> bool,
        mut connect: impl FnMut(Candidate<'a, F::Lookup>),
    ) {
        if eye.store.is_empty() {
            return;
        }
        let near = self.structure.nearest(&eye.vertex.place.stored(), eye.vertex.wo);
        for class in 0..self.structure.pmfs.classes() {
            if self.structure.pmfs.length(class).is_some_and(|s| !wanted(s)) {
                continue;
            }
            self.draw_class(class, &near, eye, sampler, |candidate| {
                if wanted(candidate.vertex.length()) {
                    connect(candidate);
                }
            });
        }
    }

    #[inline]
    fn look_up(&self, z: &StoredPlace, d: Vec3) -> F::Lookup {
        F::look_up(&self.structure, z, d)
    }

    #[inline]
    fn see(&self, lookup: &mut F::Lookup, y: &SegmentEnd, tracer: &mut Tracer) {
        F::see(&self.structure, lookup, y, tracer);
    }

    #[inline]
    fn edge(&self, lookup: &F::Lookup, y: &StoredPlace, value: impl Fn(Vec3) -> Rgb) -> <F as ConnectionFactor>::Edge {
        F::edge(&self.structure, lookup, y, value)
    }

    fn note(&self) -> Option<String> {
        let records = self.structure.records.as_ref()?;
        Some(format!("{}, {} light sub-paths", records.note(), self.settings.paths))
    }

    fn save(&self) -> Vec<u8> {
        if self.structure.means.is_empty() {
            return vec![];
        }
        let saved = SavedRecords { means: self.structure.means.clone(), counted: self.structure.counted };
        postcard::to_allocvec(&saved).unwrap_or_default()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        if state.is_empty() {
            return self.structure.means.is_empty();
        }
        let Ok(SavedRecords { means, counted }) = postcard::from_bytes(state) else { return false };
        let fits = self.structure.means.fits(&means);
        if fits {
            (self.structure.means, self.structure.counted) = (means, counted);
        }
        fits
    }
}
