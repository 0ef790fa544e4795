//! The pmfs of an iteration's light vertices at cache points.
//!
//! A group of cache points has *entries*: the light vertices that its points choose from. With one stage these are all
//! vertices of the iteration. With two stages the vertices are cut into M₂ clusters that look like one point from the
//! group, and one is drawn from each: Y_j of cluster C_j with P₁ = (f_y/p)(Y_j) / S_j, S_j = Σ over C_j of f_y/p
//! (Nabata et al. 2020, "Two-stage resampling", §5.1).
//!
//! The cut splits clusters by the range of 1/d² over them, and by the share of their vertices that the group has seen
//! in earlier iterations (`learned_visibility`).
//!
//! DEVIATION: the first stage there ignores visibility. Of the M₂ candidates behind a door few are seen through it.
//! Weights still take q₁ of eq. 17 there without visibility.
//!
//! Every cache point then has a pmf P₂(j) of its entries, proportional to q̂₂/(p P₁): the light that the entry brings
//! to the cache point, visibility included, times the number of vertices that the entry represents.
//!
//! DEVIATION: eq. 15 there divides by M₂, which is right for M₂ independent draws from one P₁. One drawn per cluster,
//! the entries sum up to the whole by themselves: there is no 1/M₂, and P₂ has the factor S_j, which eq. 16 leaves out.
//!
//! Shadow rays go out in packets, from the points of a group to one light vertex after the other.

use super::cache_points::{CachePoints, FoundLight};
use super::learned_visibility::{Octree, SeenCells};
use crate::bidir::VertexStore;
use crate::math::cdf::CdfRows;
use crate::math::hash::HashRng;
use crate::path::{Iteration, ShadowQueue, streams};
use crate::ray::offset::segment;
use crate::ray::{RayKind, RayStats, Tracer, Transmittance};
use crate::spatial::light_tree::{Aabb, CutLimits, CutScratch, ReceiverBounds};
use rayon::prelude::*;
use std::ops::Range;

/// A light vertex that a group of cache points chooses from.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Its place in the store's order.
    vertex: u32,
    /// 1/P₁: the number of vertices like itself that it represents.
    inv_p1: f32,
}

/// Probabilities of one group of cache points.
#[derive(Debug, Default)]
pub(super) struct GroupPmf {
    /// First of its cache points.
    first: usize,
    /// Entries of the second stage.
    entries: Vec<Entry>,
    /// Entries of each cache point: of `entries` or, with one stage, all vertices.
    count: usize,
    /// P₂ for each cache point.
    rows: CdfRows,
    /// For each entry, the cache points of the group that it brings light to: a bit for each.
    seen: Vec<u16>,
    /// For each cache point, the light that it found.
    found: Vec<FoundLight>,
    ranges: Vec<Range<usize>>,
    /// Visibility of light vertices by cell, from earlier iterations.
    seen_cells: SeenCells,
}

/// Light of an entry that arrives at a cache point if nothing is between.
#[derive(Clone, Copy, Debug, Default)]
struct UnshadowedLight {
    entry: u32,
    /// Place of the cache point in its group.
    cache: u32,
    /// q̂₂/(p P₁).
    full: f32,
}

impl UnshadowedLight {
    /// The light behind the masks on the way.
    #[inline]
    fn through(self, transmittance: Transmittance) -> UnshadowedLight {
        UnshadowedLight { full: self.full * transmittance.share(), ..self }
    }

    /// Adds it to the light by cache point and entry, and to the cache points that see the entry.
    #[inline]
    fn add_to(self, light: &mut [f32], seen: &mut [u16]) {
        let UnshadowedLight { entry, cache, full } = self;
        light[cache as usize * seen.len() + entry as usize] = full;
        seen[entry as usize] |= 1 << cache;
    }
}

/// How candidates are drawn from the light vertices of an iteration.
#[derive(Clone, Copy)]
struct FirstStage<'a> {
    store: &'a VertexStore,
    /// M₂.
    clusters: usize,
    /// Cells of learned visibility, if the cut goes by it.
    octree: Option<&'a Octree>,
}

/// Memory of one thread, to be used again.
#[derive(Default)]
struct Scratch {
    cut: CutScratch,
    /// For each cache point of a group the light of all entries.
    light: Vec<f32>,
}

/// A choice among entries.
#[derive(Clone, Copy, Debug)]
pub(super) struct Selection {
    /// Its number among the entries it was chosen from.
    pub entry: usize,
    /// Place of the light vertex in the store's order.
    pub vertex: usize,
    /// Probability of the vertex among all: P₁ P₂.
    pub probability: f32,
}

/// Every cache point's probabilities of an iteration's light vertices.
#[derive(Debug, Default)]
pub(super) struct Pmfs {
    groups: Vec<GroupPmf>,
    /// Cells of learned visibility, if cuts go by it.
    octree: Option<Octree>,
    /// For each cache point its group.
    group_of: Vec<u32>,
}

/// Entry `e` of the second stage; with one stage there are no `entries`, and it is vertex `e`.
#[inline]
fn entry(entries: &[Entry], e: usize) -> Entry {
    entries.get(e).copied().unwrap_or(Entry { vertex: e as u32, inv_p1: 1.0 })
}

impl GroupPmf {
    /// Number of a cache point's row of probabilities, if any light arrives there.
    #[inline]
    fn row(&self, cache: usize) -> Option<usize> {
        let row = cache - self.first;
        (self.rows.total(row) > 0.0).then_some(row)
    }

    /// Entry `e`, drawn with the probability `p` among all entries.
    #[inline]
    fn selection(&self, e: usize, p: f32) -> Selection {
        match self.entries.get(e) {
            Some(entry) => Selection { entry: e, vertex: entry.vertex as usize, probability: p / entry.inv_p1 },
            None => Selection { entry: e, vertex: e, probability: p },
        }
    }

    /// The first stage: draws one vertex of each cluster of a cut.
    fn draw_entries(
        &mut self,
        stage: &FirstStage,
        receivers: &ReceiverBounds,
        rng: &mut HashRng,
        cut: &mut CutScratch,
    ) {
        let FirstStage { store, clusters, octree } = *stage;
        let limits = CutLimits { max_clusters: clusters, max_error: 0.0 };
        let importance = |cluster: &Aabb| match octree {
            Some(octree) => self.seen_cells.importance(octree.cell_around(cluster)),
            None => 1.0,
        };
        store.tree.cut(receivers, limits, importance, cut, &mut self.ranges);
        self.entries.clear();
        self.entries.extend(self.ranges.iter().filter_map(|cluster| {
            let (vertex, p) = store.tree.sample_in(cluster, rng.next_f32())?;
            Some(Entry { vertex: vertex as u32, inv_p1: (1.0 / p) as f32 })
        }));
    }

    /// The last stage: the light that every entry brings to every cache point of the group.
    fn fill(
        &mut self,
        caches: &CachePoints,
        group: &Range<usize>,
        store: &VertexStore,
        tracer: &mut Tracer,
        light: &mut Vec<f32>,
    ) {
        self.first = group.start;
        let count = self.count;
        light.clear();
        light.resize(group.len() * count, 0.0);
        self.seen.clear();
        self.seen.resize(count, 0);
        self.found.clear();
        self.found.resize(group.len(), [0.0; 3]);
        self.find_light(caches, group, store, tracer, light);
        self.rows.reset(count, group.len());
        for c in 0..group.len() {
            let light = &mut light[c * count..(c + 1) * count];
            self.sum_up(c, caches.leave_one_out_neighbors[group.start + c], light);
            if caches.pmfs_count_bsdfs() {
                self.count_bsdf(caches, group.start + c, store, light);
            }
            self.rows.push(|e| f64::from(light[e]));
        }
        if count > 0 {
            self.found.iter_mut().for_each(|found| *found = found.map(|sum| sum / f64::from(store.paths_traced)));
        }
    }

    /// Leaves the light of every entry, for each cache point of the group, in `light`, as far as shadow rays find it
    /// visible; adds up the light of the first stage.
    fn find_light(
        &mut self,
        caches: &CachePoints,
        group: &Range<usize>,
        store: &VertexStore,
        tracer: &mut Tracer,
        light: &mut [f32],
    ) {
        let (points, sides) = (&caches.index.points()[group.clone()], &caches.index.normals()[group.clone()]);
        let count = self.count;
        let mut queue = ShadowQueue::<UnshadowedLight>::new(RayKind::ShadowPmf);
        for e in 0..count {
            let entry = entry(&self.entries, e);
            let y = store.vertex(entry.vertex as usize);
            let (bsdf, end) = (store.bsdf(entry.vertex as usize), y.place.segment_end());
            for c in 0..group.len() {
                let target = y.target_over_pdf(&bsdf, points[c], sides[c]);
                self.found[c][1] += f64::from(target.first_stage * entry.inv_p1);
                let full = target.full * entry.inv_p1; // [two-stage eq. 16, with S_j]
                if full > 0.0 && full.is_finite() {
                    let unshadowed = UnshadowedLight { entry: e as u32, cache: c as u32, full };
                    let seen = &mut self.seen;
                    queue.push(
                        &segment(caches.end(group.start + c), &end),
                        unshadowed,
                        tracer,
                        |arriving, transmittance| {
                            arriving.through(transmittance).add_to(light, seen);
                        },
                    );
                }
            }
        }
        queue.flush(tracer, |arriving, transmittance| {
            arriving.through(transmittance).add_to(light, &mut self.seen);
        });
    }

    /// Multiplies the light of every entry by the share that the surface at the cache point scatters to the eye.
    fn count_bsdf(&self, caches: &CachePoints, cache: usize, store: &VertexStore, light: &mut [f32]) {
        for (e, light) in light.iter_mut().enumerate().filter(|(_, light)| **light > 0.0) {
            let y = store.vertex(entry(&self.entries, e).vertex as usize);
            *light = caches.scattered(cache, y.place.position(), *light);
        }
    }

    /// Adds up the visible light at cache point `c` of the group, and the part of it that its neighbours miss.
    fn sum_up(&mut self, c: usize, neighbors: u16, light: &[f32]) {
        let [full, _, missed] = &mut self.found[c];
        for (&light, seen_by) in light.iter().zip(&self.seen) {
            *full += f64::from(light);
            if neighbors & seen_by == 0 {
                *missed += f64::from(light);
            }
        }
    }
}

impl Pmfs {
    /// Finds the pmfs of the vertices of `store`. `second_stage` is M₂, if there are two stages; the random numbers of
    /// the first stage are those of the seed and of `set`.
    pub fn find(
        &mut self,
        iteration: &Iteration,
        caches: &CachePoints,
        store: &VertexStore,
        second_stage: Option<usize>,
        set: u64,
    ) -> RayStats {
        self.groups.resize_with(caches.groups.len(), GroupPmf::default);
        let octree = self.octree.as_ref();
        if self.group_of.len() != caches.len() {
            let number = |(g, range): (usize, &Range<usize>)| std::iter::repeat_n(g as u32, range.len());
            self.group_of = caches.groups.iter().enumerate().flat_map(number).collect();
        }
        let of_group = |scratch: &mut Scratch, (number, (pmf, group)): (usize, (&mut GroupPmf, &Range<usize>))| {
            let mut tracer = iteration.tracer();
            match second_stage {
                None => pmf.count = store.len(),
                Some(clusters) => {
                    let mut rng = HashRng::new(iteration.seed, streams::FIRST_STAGE, number as u64, set);
                    let stage = FirstStage { store, clusters, octree };
                    pmf.draw_entries(&stage, &caches.receiver_bounds(group), &mut rng, &mut scratch.cut);
                    pmf.count = pmf.entries.len();
                }
            }
            pmf.fill(caches, group, store, &mut tracer, &mut scratch.light);
            tracer.stats
        };
        let groups = self.groups.par_iter_mut().zip(&caches.groups).enumerate();
        groups.map_init(Scratch::default, of_group).reduce(RayStats::default, |mut a, b| {
            a.merge(&b);
            a
        })
    }

    /// Cuts of the first stage go by learned visibility, in a scene of this radius.
    pub fn learn_visibility(&mut self, radius: f32) {
        self.octree = Some(Octree::new(radius));
    }

    /// Adds the visibility of the entries of `store`, whose pmfs were found last, to the counts of all groups.
    pub fn learn(&mut self, caches: &CachePoints, store: &VertexStore) {
        let Some(octree) = &self.octree else { return };
        self.groups.par_iter_mut().zip(&caches.groups).for_each(|(group, range)| {
            for (entry, seen) in group.entries.iter().zip(&group.seen) {
                let cell = octree.cell(store.vertex(entry.vertex as usize).place.position());
                group.seen_cells.add(cell, range.len() as u32, seen.count_ones());
            }
        });
    }

    /// Visibility of light vertices by cell, for each group.
    pub fn seen_cells(&self) -> impl Iterator<Item = &SeenCells> {
        self.groups.iter().map(|group| &group.seen_cells)
    }

    /// Goes on from the counts of an earlier run; false if they are of other groups.
    pub fn restore(&mut self, seen: Vec<SeenCells>) -> bool {
        let fits = seen.len() == self.groups.len() && seen.iter().all(SeenCells::is_whole);
        if fits {
            self.groups.iter_mut().zip(seen).for_each(|(group, seen)| group.seen_cells = seen);
        }
        fits
    }

    /// For every cache point, the light found in this iteration.
    pub fn found(&self) -> impl Iterator<Item = &FoundLight> {
        self.groups.iter().flat_map(|g| &g.found)
    }

    /// For every group of cache points, the light found in this iteration, visibility included.
    pub fn found_by_group(&self) -> impl Iterator<Item = f64> {
        self.groups.iter().map(|g| g.found.iter().map(|[full, ..]| full).sum())
    }

    /// Draws from the mixture of the probabilities at `n` cache points, all of one group if there are two stages, and
    /// an equal share of all entries; `None` if there are no entries. There is at least one cache point.
    #[inline]
    pub fn draw(&self, caches: &[usize], u: [f32; 2]) -> Option<Selection> {
        let group = &self.groups[*self.group_of.get(*caches.first()?)? as usize];
        let entries = group.count;
        if entries == 0 {
            return None;
        }
        let n = caches.len().min(3);
        let mut rows: [Option<(&CdfRows, usize)>; 3] = [None; 3];
        for (row, &cache) in rows.iter_mut().zip(caches) {
            let group = &self.groups[self.group_of[cache] as usize];
            *row = group.row(cache).map(|row| (&group.rows, row));
        }
        let uniform = 1.0 / entries as f32;
        let share = 1.0 / (n + 1) as f32;
        let chosen = ((u[0] * (n + 1) as f32) as usize).min(n);
        let e = match rows.get(chosen) {
            Some(Some((rows, row))) if chosen < n => rows.find(*row, u[1]).0,
            // A cache point that no light vertex reaches draws uniformly, as the last component of the mixture does.
            _ => (u[1] * entries as f32) as usize,
        }
        .min(entries - 1);
        let mut p = share * uniform;
        for row in &rows[..n] {
            p += share * row.map_or(uniform, |(rows, row)| rows.probability(row, e));
        }
        Some(group.selection(e, p))
    }

    /// Bit `i` set: entry `e`, from which cache points `near` choose, brings light to number `i` of them.
    #[inline]
    pub fn seen(&self, near: &[usize], e: usize) -> u16 {
        let mut bits = 0;
        for (i, &cache) in near.iter().enumerate() {
            let group = &self.groups[self.group_of[cache] as usize];
            bits |= (group.seen[e] >> (cache - group.first) & 1) << i;
        }
        bits
    }

    fn group(&self, cache: usize) -> Option<&GroupPmf> {
        self.group_of.get(cache).map(|&g| &self.groups[g as usize])
    }

    /// Draws by the probabilities at one cache point alone; `None` if nothing is brought there.
    pub fn draw_at(&self, cache: usize, u: f32) -> Option<Selection> {
        let group = self.group(cache)?;
        let row = group.row(cache)?;
        let (e, _) = group.rows.find(row, u);
        Some(group.selection(e, group.rows.probability(row, e)))
    }

    /// Draws one of all entries of the cache point's group; `None` if there are none.
    pub fn draw_uniformly(&self, cache: usize, u: f32) -> Option<Selection> {
        let group = self.group(cache).filter(|group| group.count > 0)?;
        let e = ((u * group.count as f32) as usize).min(group.count - 1);
        Some(group.selection(e, 1.0 / group.count as f32))
    }
}
