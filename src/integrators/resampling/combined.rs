//! Probabilities of importance caching: several distributions of light vertices at a site, combined into one (`distributions`).
//!
//! As published, light vertices are told apart by the length of their sub-paths, so that an eye vertex connects to one of each length, and at
//! nodes a vertex brings L/d² (Noël and Biri 2015, eq. 5); many lights are one class. Where all are drawn from together, few draws
//! go to what is long and dim; and what a vertex brings to a node is f_y ρ/d², the light that it sends there. At records it always is f_y ρ G.

use super::distributions::{Distribution, Sums, by_max, by_mixture};
use super::sites::Sites;
use super::store::LightStore;
use crate::math::Vec3;
use crate::math::guided::GuidedRows;
use crate::prepared::PreparedScene;
use crate::ray::offset::segment;
use crate::ray::{PACKET, RayKind, RayStats, SegmentPacket, Tracer};
use crate::shade::Transport;
use rayon::prelude::*;
use std::ops::Range;

/// How eye vertices draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrators) struct Draws {
    pub from: DrawsFrom,
    /// The only distribution that is combined with the uniform one, if others are off.
    pub only: Option<Distribution>,
}

/// Among which vertices one is drawn, and how distributions are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrators) enum DrawsFrom {
    /// Those of each length by themselves, by the max heuristic.
    Lengths,
    /// All, by the max heuristic.
    Many,
    /// All, by a mixture.
    Mixture,
}

/// Light vertices among which one is drawn.
#[derive(Clone, Debug)]
struct Class {
    /// In the list of all.
    range: Range<usize>,
    /// s of all of them; 0 if they differ.
    s: usize,
}

/// A drawn light vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    /// Place of the vertex in the store's order.
    pub vertex: usize,
    /// Its probability among those of its class.
    pub probability: f32,
}

/// Probabilities of an iteration's light vertices at all sites.
#[derive(Debug, Default)]
pub(super) struct CombinedPmfs {
    classes: Vec<Class>,
    /// Places in the store's order, class by class.
    vertices: Vec<u32>,
    groups: Vec<Group>,
}

/// A group of sites.
#[derive(Debug, Default)]
struct Group {
    /// For each class, probabilities of its vertices at each site.
    rows: Vec<GuidedRows>,
    /// For each site and class the sums of what seen, open and bounded go by.
    sums: Vec<Sums>,
}

/// What vertices bring to the sites of a group: for each site one after the other.
#[derive(Default)]
struct Brought {
    seen: Vec<f32>,
    open: Vec<f32>,
    bounded: Vec<f32>,
}

impl CombinedPmfs {
    /// Finds the probabilities of the vertices of `store`.
    pub fn find(&mut self, scene: &PreparedScene, sites: &Sites, store: &LightStore, draws: Draws) -> RayStats {
        self.classify(store, draws);
        let combine = if draws.from == DrawsFrom::Mixture { by_mixture } else { by_max };
        let groups: Vec<Range<usize>> = sites.groups().collect();
        self.groups.resize_with(groups.len(), Group::default);
        let (classes, vertices) = (&self.classes, &self.vertices);
        self.groups
            .par_iter_mut()
            .zip(&groups)
            .map_init(Brought::default, |brought, (Group { rows, sums }, group)| {
                let mut tracer = Tracer::new(&*scene.query);
                bring((sites, group), (store, vertices), draws, brought, &mut tracer);
                rows.clear();
                rows.extend(classes.iter().map(|class| GuidedRows::new(class.range.len(), group.len())));
                sums.clear();
                for site in 0..group.len() {
                    for (class, rows) in classes.iter().zip(&mut *rows) {
                        let at = |offset: &usize| site * vertices.len() + offset;
                        let range = at(&class.range.start)..at(&class.range.end);
                        let weights = [&brought.seen, &brought.open, &brought.bounded].map(|w| &w[range.clone()]);
                        sums.push(combine(weights, rows));
                    }
                }
                tracer.stats
            })
            .reduce(RayStats::default, |mut a, b| {
                a.merge(&b);
                a
            })
    }

    fn classify(&mut self, store: &LightStore, draws: Draws) {
        self.vertices.clear();
        self.vertices.extend(0..store.len() as u32);
        self.classes.clear();
        if store.is_empty() {
            return;
        }
        if draws.from != DrawsFrom::Lengths {
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

    /// For each site the classes' lengths, their numbers of vertices, and the sums of what seen, open and bounded go by.
    pub fn found(&self) -> impl Iterator<Item = impl Iterator<Item = (usize, usize, Sums)>> {
        let classes = self.classes.len();
        let sites = self.groups.iter().flat_map(move |group| group.sums.chunks_exact(classes.max(1)));
        sites.map(|sums| self.classes.iter().zip(sums).map(|(class, sums)| (class.s, class.range.len(), *sums)))
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

    /// Draws from a class by the mean of the probabilities at `found`, or uniformly if there are none.
    #[inline]
    pub fn draw(&self, class: usize, found: &[usize], u: [f32; 2]) -> Drawn {
        let Range { start, end } = self.classes[class].range;
        let drawn = |i: usize, probability: f32| Drawn { vertex: self.vertices[start + i] as usize, probability };
        let chosen = ((u[0] * found.len() as f32) as usize).min(found.len().saturating_sub(1));
        let row = |site: usize| (&self.groups[site / PACKET].rows[class], site % PACKET);
        let Some((rows, at)) = found.get(chosen).map(|&site| row(site)) else {
            let n = end - start;
            return drawn(((u[1] * n as f32) as usize).min(n - 1), 1.0 / n as f32);
        };
        let (i, _) = rows.find(at, u[1]);
        let probabilities = found.iter().map(|&site| {
            let (rows, at) = row(site);
            rows.probability(at, i)
        });
        drawn(i, probabilities.sum::<f32>() / found.len() as f32)
    }
}

/// What each vertex brings to each site of a group, by packets of shadow rays from all sites to one vertex.
fn bring(
    (sites, group): (&Sites, &Range<usize>),
    (store, vertices): (&LightStore, &[u32]),
    draws: Draws,
    brought: &mut Brought,
    tracer: &mut Tracer,
) {
    for list in [&mut brought.seen, &mut brought.open, &mut brought.bounded] {
        list.clear();
        list.resize(group.len() * vertices.len(), 0.0);
    }
    let wants = |distribution| draws.only.is_none_or(|only| only == distribution);
    let bounded = sites.normals.is_some() && draws.only.is_none() && draws.from != DrawsFrom::Mixture;
    for (v, &number) in vertices.iter().enumerate() {
        let y = store.vertex(number as usize);
        let (bsdf, end) = (store.bsdf(number as usize), y.end());
        let value = |to: Vec3| bsdf.eval(y.wo, to, Transport::Importance);
        let mut packet = SegmentPacket::default();
        let mut asked = [(0, 0.0); PACKET];
        for site in 0..group.len() {
            let at = site * vertices.len() + v;
            if bounded {
                brought.bounded[at] = y.throughput.luminance();
            }
            let reached = sites.reached(group.start + site, draws.from, y.p, value);
            let open = (y.throughput * reached).luminance();
            if open <= 0.0 || !open.is_finite() {
                continue;
            }
            if wants(Distribution::Open) {
                brought.open[at] = open;
            }
            if wants(Distribution::Seen) {
                asked[packet.len] = (at, open);
                packet.push(&segment(&sites.ends[group.start + site], &end));
            }
        }
        if packet.len == 0 {
            continue;
        }
        let blocked = tracer.occluded_packet(&packet, RayKind::ShadowPmf);
        for (i, &(at, open)) in asked[..packet.len].iter().enumerate() {
            if blocked >> i & 1 == 0 {
                brought.seen[at] = open;
            }
        }
    }
}
