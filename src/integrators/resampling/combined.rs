//! Probabilities of importance caching: several distributions of light vertices at a site, combined into one.
//!
//! * *Seen*: in proportion to what a vertex brings to the site, visibility included (V of Noël and Biri 2015, eq. 6; F of Georgiev
//!   et al. 2012);
//! * *open*: the same, as if nothing were in the way (U, eq. 7);
//! * *bounded*: in proportion to f_y/p alone, without a geometry term that may be huge (B; records only);
//! * *uniform* (C, eq. 8).
//!
//! One of them is chosen with equal probability, and the max heuristic says which may produce which vertex: the one that gives it
//! the largest probability. Since they share no vertex then, all of them together are one distribution: each vertex has the probability of its
//! winner, normalised over what that wins, over the number of distributions that win anything (§4.3, premultiplied).
//!
//! At nodes a vertex brings L/d² (eq. 5), at records f_y ρ G. Light vertices are told apart by the length of their sub-paths, so that an
//! eye vertex connects to one of each; many lights are one class.

use super::sites::Sites;
use super::store::LightStore;
use crate::prepared::PreparedScene;
use crate::ray::offset::segment;
use crate::ray::{PACKET, RayKind, RayStats, SegmentPacket, Tracer};
use crate::spatial::nearest::MOST;
use rayon::prelude::*;
use std::ops::Range;

/// Distributions that are combined.
const DISTRIBUTIONS: usize = 4;

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
    /// For each site and vertex the probability of the vertices of its class up to it.
    cdf: Vec<f32>,
    /// For each site and class the sums of what seen, open and bounded go by.
    sums: Vec<[f64; DISTRIBUTIONS - 1]>,
}

/// What vertices bring to the sites of a group: for each site one after the other.
#[derive(Default)]
struct Brought {
    seen: Vec<f32>,
    open: Vec<f32>,
    bounded: Vec<f32>,
}

/// Combines distributions over one class, each given up to a factor, into cumulative probabilities; returns their sums.
fn combine(weights: [&[f32]; DISTRIBUTIONS - 1], cdf: &mut [f32]) -> [f64; DISTRIBUTIONS - 1] {
    let n = cdf.len();
    let sums = weights.map(|w| w.iter().map(|v| f64::from(*v)).sum::<f64>());
    let scales = sums.map(|sum| if sum > 0.0 && sum.is_finite() { 1.0 / sum } else { 0.0 });
    let uniform = 1.0 / n as f64;
    let winner = |i: usize| {
        let mut best = (DISTRIBUTIONS - 1, uniform);
        for (d, w) in weights.iter().enumerate() {
            let p = f64::from(w[i]) * scales[d];
            if p > best.1 {
                best = (d, p);
            }
        }
        best
    };
    let mut won = [0.0; DISTRIBUTIONS];
    for i in 0..n {
        let (d, p) = winner(i);
        won[d] += p;
    }
    let winners = won.iter().filter(|&&w| w > 0.0).count() as f64;
    let mut sum = 0.0;
    for (i, c) in cdf.iter_mut().enumerate() {
        let (d, p) = winner(i);
        sum += p / (won[d] * winners);
        *c = sum as f32;
    }
    if let Some(last) = cdf.last_mut() {
        *last = 1.0;
    }
    sums
}

impl CombinedPmfs {
    /// Finds the probabilities of the vertices of `store`, one class for each length or, if `pooled`, one of all.
    pub fn find(&mut self, scene: &PreparedScene, sites: &Sites, store: &LightStore, pooled: bool) -> RayStats {
        self.classify(store, pooled);
        let groups: Vec<Range<usize>> = sites.groups().collect();
        self.groups.resize_with(groups.len(), Group::default);
        let (classes, vertices) = (&self.classes, &self.vertices);
        self.groups
            .par_iter_mut()
            .zip(&groups)
            .map_init(Brought::default, |brought, (Group { cdf, sums }, group)| {
                let mut tracer = Tracer::new(&*scene.query);
                bring(sites, group, store, vertices, brought, &mut tracer);
                cdf.clear();
                cdf.resize(group.len() * vertices.len(), 0.0);
                sums.clear();
                for site in 0..group.len() {
                    for class in classes {
                        let at = |offset: &usize| site * vertices.len() + offset;
                        let range = at(&class.range.start)..at(&class.range.end);
                        let weights = [&brought.seen, &brought.open, &brought.bounded].map(|w| &w[range.clone()]);
                        sums.push(combine(weights, &mut cdf[range]));
                    }
                }
                tracer.stats
            })
            .reduce(RayStats::default, |mut a, b| {
                a.merge(&b);
                a
            })
    }

    fn classify(&mut self, store: &LightStore, pooled: bool) {
        self.vertices.clear();
        self.vertices.extend(0..store.len() as u32);
        self.classes.clear();
        if store.is_empty() {
            return;
        }
        if pooled {
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
    pub fn found(&self) -> impl Iterator<Item = impl Iterator<Item = (usize, usize, [f64; DISTRIBUTIONS - 1])>> {
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
        let range = &self.classes[class].range;
        let n = range.len();
        let mut rows: [&[f32]; MOST] = [&[]; MOST];
        for (row, site) in rows.iter_mut().zip(found) {
            let cdf = &self.groups[site / PACKET].cdf;
            *row = &cdf[site % PACKET * self.vertices.len()..][range.clone()];
        }
        let rows = &rows[..found.len().min(MOST)];
        let chosen = ((u[0] * rows.len() as f32) as usize).min(rows.len().saturating_sub(1));
        let Some(cdf) = rows.get(chosen) else {
            let i = ((u[1] * n as f32) as usize).min(n - 1);
            return Drawn { vertex: self.vertices[range.start + i] as usize, probability: 1.0 / n as f32 };
        };
        let i = cdf.partition_point(|&c| c <= u[1]).min(n - 1);
        let sum: f32 = rows.iter().map(|cdf| cdf[i] - if i == 0 { 0.0 } else { cdf[i - 1] }).sum();
        Drawn { vertex: self.vertices[range.start + i] as usize, probability: sum / rows.len() as f32 }
    }
}

/// What each vertex brings to each site of a group, by packets of shadow rays from all sites to one vertex.
fn bring(
    sites: &Sites,
    group: &Range<usize>,
    store: &LightStore,
    vertices: &[u32],
    brought: &mut Brought,
    tracer: &mut Tracer,
) {
    for list in [&mut brought.seen, &mut brought.open, &mut brought.bounded] {
        list.clear();
        list.resize(group.len() * vertices.len(), 0.0);
    }
    for (v, &number) in vertices.iter().enumerate() {
        let y = store.vertex(number as usize);
        let (bsdf, end) = (store.bsdf(number as usize), y.end());
        let mut packet = SegmentPacket::default();
        let mut asked = [0usize; PACKET];
        for site in 0..group.len() {
            let at = &sites.ends[group.start + site];
            let open = match &sites.normals {
                Some(normals) => {
                    brought.bounded[site * vertices.len() + v] = y.throughput.luminance();
                    y.brings(&bsdf, at.position(), normals[group.start + site]).scattered
                }
                None => y.throughput.luminance() / y.p.distance_squared(at.position()),
            };
            if open > 0.0 && open.is_finite() {
                brought.open[site * vertices.len() + v] = open;
                asked[packet.len] = site;
                packet.push(&segment(at, &end));
            }
        }
        if packet.len == 0 {
            continue;
        }
        let blocked = tracer.occluded_packet(&packet, RayKind::ShadowPmf);
        for (i, site) in asked[..packet.len].iter().enumerate() {
            if blocked >> i & 1 == 0 {
                let at = site * vertices.len() + v;
                brought.seen[at] = brought.open[at];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probabilities(weights: [&[f32]; 3]) -> Vec<f32> {
        let mut cdf = vec![0.0; weights[0].len()];
        combine(weights, &mut cdf);
        cdf.iter().enumerate().map(|(i, c)| c - if i == 0 { 0.0 } else { cdf[i - 1] }).collect()
    }

    #[test]
    fn the_largest_probability_wins() {
        // Seen: 0.8 0.2 0 0; open: 0.1 0.1 0.7 0.1; uniform: 0.25. The first two are won by seen and uniform, then open and uniform.
        let p = probabilities([&[8.0, 2.0, 0.0, 0.0], &[1.0, 1.0, 7.0, 1.0], &[0.0; 4]]);
        for (p, expected) in p.iter().zip([1.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0, 1.0 / 6.0]) {
            assert!((p - expected).abs() < 1e-6, "{p} {expected}");
        }
    }

    #[test]
    fn everything_can_be_drawn() {
        for weights in [[[0.0; 5]; 3], [[1e30, 0.0, 1e-30, 1.0, 0.0], [1e-20; 5], [0.0, 0.0, 0.0, 0.0, 1.0]]] {
            let p = probabilities([&weights[0], &weights[1], &weights[2]]);
            assert!((p.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(p.iter().all(|&p| p >= 0.24 / 5.0), "{p:?}");
        }
    }
}
