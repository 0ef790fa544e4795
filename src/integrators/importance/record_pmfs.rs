//! The pmfs of light vertices at importance records: several pmfs at each, combined into one (`distributions`).
//!
//! As published, light vertices are told apart by the length of their sub-paths, so that an eye vertex is connected to
//! one of each length, and at nodes the weight of a vertex is L/d² (Noël and Biri 2015, eq. 5); many lights are one
//! class.
//!
//! DEVIATION: with [`Selection::Mixture`] all lengths are one class: few draws go to sub-paths that are long and dim;
//! and the weight of a vertex at a node is f_y ρ/d², the light that it sends there. At records on surfaces it always is
//! f_y ρ G.

use super::distributions::{Distribution, Sums, by_max, by_mixture};
use super::records::ImportanceRecords;
use crate::bidir::VertexStore;
use crate::math::Vec3;
use crate::math::cdf::CdfRows;
use crate::path::{Iteration, ShadowQueue};
use crate::ray::offset::segment;
use crate::ray::{PACKET, RayKind, RayStats, Tracer};
use crate::shade::Transport;
use rayon::prelude::*;
use std::ops::Range;

/// How eye vertices draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SelectionScheme {
    pub selection: Selection,
    /// The only pmf that is combined with the uniform one, if others are off.
    pub only: Option<Distribution>,
}

/// The vertices from which one is drawn, and how pmfs are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Selection {
    /// One of each length, by the max heuristic.
    PerLength,
    /// One of all, by the max heuristic.
    ManyLights,
    /// One of all, by a mixture.
    Mixture,
}

/// Light vertices from which one is drawn.
#[derive(Clone, Debug)]
struct Class {
    /// In the list of all.
    range: Range<usize>,
    /// s of all of them; 0 if they differ.
    s: usize,
}

/// The vertices of a class at one record.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassSums {
    /// s of all of them; 0 if they differ.
    pub s: usize,
    /// Their number.
    pub vertices: usize,
    /// Sums of the weights of seen, open and bounded.
    pub sums: Sums,
}

/// A drawn light vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    /// Place of the vertex in the store's order.
    pub vertex: usize,
    /// Its probability among those of its class.
    pub probability: f32,
}

/// The pmfs of an iteration's light vertices at all records.
#[derive(Debug, Default)]
pub(super) struct RecordPmfs {
    classes: Vec<Class>,
    /// Places in the store's order, class by class.
    vertices: Vec<u32>,
    groups: Vec<Group>,
}

/// A group of records.
#[derive(Debug, Default)]
struct Group {
    /// For each class, the pmf of its vertices at each record.
    rows: Vec<CdfRows>,
    /// For each record and class the sums of the weights of seen, open and bounded.
    sums: Vec<Sums>,
}

/// Weights of vertices at the records of a group, record by record.
#[derive(Default)]
struct Weights {
    seen: Vec<f32>,
    open: Vec<f32>,
    bounded: Vec<f32>,
}

impl RecordPmfs {
    /// Finds the pmfs of the vertices of `store`.
    pub fn find(
        &mut self,
        iteration: &Iteration,
        records: &ImportanceRecords,
        store: &VertexStore,
        scheme: SelectionScheme,
    ) -> RayStats {
        self.classify(store, scheme.selection);
        let combine = if scheme.selection == Selection::Mixture { by_mixture } else { by_max };
        let groups: Vec<Range<usize>> = records.groups().collect();
        self.groups.resize_with(groups.len(), Group::default);
        let (classes, vertices) = (&self.classes, &self.vertices);
        let of_group = |weights: &mut Weights, (Group { rows, sums }, group): (&mut Group, &Range<usize>)| {
            let mut tracer = iteration.tracer();
            weights.find(&Source { records, group, store, vertices, scheme }, &mut tracer);
            rows.clear();
            rows.extend(classes.iter().map(|class| CdfRows::new(class.range.len(), group.len())));
            sums.clear();
            for record in 0..group.len() {
                for (class, rows) in classes.iter().zip(&mut *rows) {
                    let at = |offset: &usize| record * vertices.len() + offset;
                    let range = at(&class.range.start)..at(&class.range.end);
                    let of_class = [&weights.seen, &weights.open, &weights.bounded].map(|w| &w[range.clone()]);
                    sums.push(combine(of_class, rows));
                }
            }
            tracer.stats
        };
        let groups = self.groups.par_iter_mut().zip(&groups);
        groups.map_init(Weights::default, of_group).reduce(RayStats::default, |mut a, b| {
            a.merge(&b);
            a
        })
    }

    fn classify(&mut self, store: &VertexStore, selection: Selection) {
        self.vertices.clear();
        self.vertices.extend(0..store.len() as u32);
        self.classes.clear();
        if store.is_empty() {
            return;
        }
        if selection != Selection::PerLength {
            self.classes.push(Class { range: 0..store.len(), s: 0 });
            return;
        }
        let length = |v: &u32| store.vertex(*v as usize).length();
        // Stable: neighbours stay together.
        self.vertices.sort_by_key(length);
        let mut start = 0;
        for same in self.vertices.chunk_by(|a, b| length(a) == length(b)) {
            self.classes.push(Class { range: start..start + same.len(), s: length(&same[0]) });
            start += same.len();
        }
    }

    /// For each record its classes, with the sums of the weights of their vertices.
    pub fn weight_sums(&self) -> impl Iterator<Item = impl Iterator<Item = ClassSums>> {
        let classes = self.classes.len();
        let records = self.groups.iter().flat_map(move |group| group.sums.chunks_exact(classes.max(1)));
        records.map(|sums| {
            let of_class =
                |(class, sums): (&Class, &Sums)| ClassSums { s: class.s, vertices: class.range.len(), sums: *sums };
            self.classes.iter().zip(sums).map(of_class)
        })
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes.len()
    }

    /// s of a class's vertices; `None` if they differ.
    #[inline]
    pub fn length(&self, class: usize) -> Option<usize> {
        let s = self.classes[class].s;
        (s > 0).then_some(s)
    }

    /// Draws from a class by the mean of the pmfs at the records `found`, or uniformly if there are none.
    #[inline]
    pub fn draw(&self, class: usize, found: &[usize], u: [f32; 2]) -> Drawn {
        let Range { start, end } = self.classes[class].range;
        let drawn = |i: usize, probability: f32| Drawn { vertex: self.vertices[start + i] as usize, probability };
        let chosen = ((u[0] * found.len() as f32) as usize).min(found.len().saturating_sub(1));
        let row = |record: usize| (&self.groups[record / PACKET].rows[class], record % PACKET);
        let Some((rows, at)) = found.get(chosen).map(|&record| row(record)) else {
            let n = end - start;
            return drawn(((u[1] * n as f32) as usize).min(n - 1), 1.0 / n as f32);
        };
        let (i, _) = rows.find(at, u[1]);
        let probabilities = found.iter().map(|&record| {
            let (rows, at) = row(record);
            rows.probability(at, i)
        });
        drawn(i, probabilities.sum::<f32>() / found.len() as f32)
    }
}

/// Light vertices and the records of a group.
struct Source<'a> {
    records: &'a ImportanceRecords,
    group: &'a Range<usize>,
    store: &'a VertexStore,
    /// Places of the vertices in the store's order.
    vertices: &'a [u32],
    scheme: SelectionScheme,
}

/// Light of a vertex that arrives at a record if nothing is between.
#[derive(Clone, Copy, Default)]
struct UnshadowedLight {
    /// Place in the list of weights.
    at: usize,
    light: f32,
}

impl Weights {
    /// Finds the weights of all vertices at all records of a group, by packets of shadow rays from the records to one
    /// vertex after the other.
    fn find(&mut self, source: &Source, tracer: &mut Tracer) {
        let (records, vertices) = (source.group.len(), source.vertices.len());
        for list in [&mut self.seen, &mut self.open, &mut self.bounded] {
            list.clear();
            list.resize(records * vertices, 0.0);
        }
        let mut queue = ShadowQueue::new(RayKind::ShadowPmf);
        for v in 0..vertices {
            self.find_vertex(source, v, tracer, &mut queue);
        }
        queue.flush(tracer, |arriving, transmittance| self.seen[arriving.at] = arriving.light * transmittance.share());
    }

    /// Finds the weights of one vertex; those that count visibility arrive by `queue`, which has their places.
    fn find_vertex(
        &mut self,
        source: &Source,
        v: usize,
        tracer: &mut Tracer,
        queue: &mut ShadowQueue<UnshadowedLight>,
    ) {
        let &Source { records, group, store, vertices, scheme } = source;
        let number = vertices[v] as usize;
        let wants = |distribution| scheme.only.is_none_or(|only| only == distribution);
        let bounded = records.normals.is_some() && scheme.only.is_none() && scheme.selection != Selection::Mixture;
        let y = store.vertex(number);
        let (bsdf, end) = (store.bsdf(number), y.place.segment_end());
        let value = |to: Vec3| bsdf.eval(y.wo, to, Transport::Importance);
        for record in 0..group.len() {
            let at = record * vertices.len() + v;
            if bounded {
                self.bounded[at] = y.throughput.luminance();
            }
            let unoccluded = records.unoccluded(group.start + record, scheme.selection, y.place.position(), value);
            let open = (y.throughput * unoccluded).luminance();
            if open <= 0.0 || !open.is_finite() {
                continue;
            }
            if wants(Distribution::Unoccluded) {
                self.open[at] = open;
            }
            if wants(Distribution::Visible) {
                let (segment, seen) = (segment(&records.ends[group.start + record], &end), &mut self.seen);
                queue.push(&segment, UnshadowedLight { at, light: open }, tracer, |arriving, transmittance| {
                    seen[arriving.at] = arriving.light * transmittance.share();
                });
            }
        }
    }
}
