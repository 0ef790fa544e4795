//! Cache points: points of surfaces and media at which the pmfs of light vertices are found for the eye vertices around.
//!
//! They are the vertices of a few eye sub-paths (a fixed fraction of the number of pixels), traced once. Those that are
//! near each other and face the same way form groups of up to sixteen, which share, where there are two stages, the
//! candidates of the second. Each keeps running means of the light found at it: its normalisations Q.

use super::settings::ResamplingSettings;
use crate::bidir::WarmUp;
use crate::bidir::eye_vertices::{EyeSubpathVertex, EyeSubpathVertices};
use crate::bidir::vertex::direction_to;
use crate::math::Vec3;
use crate::mis::ResamplingTarget;
use crate::mis::factors::NormalizationEstimate;
use crate::path::StoredPlace;
use crate::ray::RayStats;
use crate::ray::offset::SegmentEnd;
use crate::shade::{BsdfPool, StoredBsdf, Transport};
use crate::spatial::NearestPoints;
use crate::spatial::light_tree::ReceiverBounds;
use crate::spatial::nearest::MAX_NEIGHBORS;
use std::ops::Range;

/// Radii of a group beyond which its points say nothing about visibility.
const TRUST_RADII: f32 = 3.0;
/// Fraction of light that surfaces at right angles may miss of each other's.
const TILT: f32 = 0.25;

/// The light that a cache point found in an iteration: the two targets (the full one first), and the part of the full
/// one that none of its neighbours found.
pub(super) type FoundLight = [f64; 3];

/// The state of a cache point, in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct CacheState {
    p: Vec3,
    /// One over the squared distance at which the light is taken to be unrelated.
    inv_trust_radius2: f32,
    side: Vec3,
    /// Means of [`FoundLight`] over all iterations so far.
    means: [f32; 3],
}

/// A fixed set of cache points with their estimates.
#[derive(Debug)]
pub(super) struct CachePoints {
    /// Finds the cache points near a point.
    pub index: NearestPoints,
    ends: Vec<SegmentEnd>,
    /// Ranges of cache points.
    pub groups: Vec<Range<usize>>,
    /// For each cache point, the three others of its group that are nearest: bits of their places in the group.
    pub leave_one_out_neighbors: Vec<u16>,
    /// BSDFs of the cache points, where pmfs count them.
    bsdfs: Option<CacheBsdfs>,
    states: Vec<CacheState>,
    /// Weights assume that no light is unseen.
    trusted: bool,
    /// Sum over iterations of the light that each point found, and their number.
    sums: Vec<FoundLight>,
    iterations: u64,
}

/// BSDFs of cache points, as the eye sub-paths that made them see them.
#[derive(Debug)]
struct CacheBsdfs {
    each: Vec<(Vec3, StoredBsdf)>,
    pool: BsdfPool,
}

/// Cuts a range of points in two along the longest side of the box around them, at a multiple of the size of a group,
/// until it fits into one.
fn group(points: &mut [EyeSubpathVertex], size: usize, first: usize, groups: &mut Vec<Range<usize>>) {
    if points.len() <= size {
        groups.push(first..first + points.len());
        return;
    }
    let lo = points.iter().fold(Vec3::INFINITY, |lo, c| lo.min(c.position()));
    let hi = points.iter().fold(Vec3::NEG_INFINITY, |hi, c| hi.max(c.position()));
    let sides = hi - lo;
    let axis = if sides.x >= sides.y && sides.x >= sides.z {
        0
    } else if sides.y >= sides.z {
        1
    } else {
        2
    };
    let middle = points.len().div_ceil(2).next_multiple_of(size).min(points.len() - 1);
    points.select_nth_unstable_by(middle, |a, b| a.position()[axis].total_cmp(&b.position()[axis]));
    let (left, right) = points.split_at_mut(middle);
    group(left, size, first, groups);
    group(right, size, first + middle, groups);
}

/// For each point, the three others of its group that are nearest.
fn leave_one_out_neighbors(points: &[EyeSubpathVertex], groups: &[Range<usize>]) -> Vec<u16> {
    let nearest = |group: &Range<usize>, own: usize| {
        let mut others: Vec<usize> = group.clone().filter(|&i| i != own).collect();
        let distance = |i: &usize| points[own].position().distance_squared(points[*i].position());
        others.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        others.iter().take(MAX_NEIGHBORS).fold(0, |bits, i| bits | 1 << (i - group.start))
    };
    groups.iter().flat_map(|group| group.clone().map(move |own| nearest(group, own))).collect()
}

/// Initial states of the points.
fn states(points: &[EyeSubpathVertex], groups: &[Range<usize>]) -> Vec<CacheState> {
    let inv_trust_radius2 = groups.iter().flat_map(|group| {
        let centre = points[group.clone()].iter().map(EyeSubpathVertex::position).sum::<Vec3>() / group.len() as f32;
        let sum: f32 = points[group.clone()].iter().map(|c| c.position().distance_squared(centre)).sum();
        let radius2 = TRUST_RADII * TRUST_RADII * sum / group.len() as f32;
        std::iter::repeat_n((1.0 / radius2).min(f32::MAX), group.len())
    });
    let state = |(c, inv_trust_radius2): (&EyeSubpathVertex, f32)| CacheState {
        p: c.position(),
        inv_trust_radius2,
        side: c.side,
        means: [0.0; 3],
    };
    points.iter().zip(inv_trust_radius2).map(state).collect()
}

impl CachePoints {
    /// The vertices of eye sub-paths, as many as `settings` say. If there are two stages, all neighbours of a point are
    /// of one group.
    pub fn place(warm_up: &WarmUp, settings: &ResamplingSettings) -> (CachePoints, RayStats) {
        let (EyeSubpathVertices { vertices: mut all, bsdfs: pool }, stats) =
            warm_up.eye_vertices(settings.cache_fraction);
        let metric = settings.metric;
        // Stable sorts and selections on equal input: the same for any number of threads.
        all.sort_by_key(|c| metric.kind(c.side));
        let mut groups = vec![];
        let mut first = 0;
        while first < all.len() {
            let own = metric.kind(all[first].side);
            let count = all[first..].iter().take_while(|c| metric.kind(c.side) == own).count();
            group(&mut all[first..first + count], settings.group_size, first, &mut groups);
            first += count;
        }
        let (points, sides) =
            (all.iter().map(EyeSubpathVertex::position).collect(), all.iter().map(|c| c.side).collect());
        let index = NearestPoints::new(points, sides, metric);
        let index = if settings.second_stage.is_some() { index.within_groups(&groups) } else { index };
        let each = || all.iter().map(|c| (c.wo, c.bsdf)).collect();
        let caches = CachePoints {
            index,
            ends: all.iter().map(|c| c.place.segment_end()).collect(),
            leave_one_out_neighbors: leave_one_out_neighbors(&all, &groups),
            bsdfs: settings.radiance.then(|| CacheBsdfs { each: each(), pool }),
            states: states(&all, &groups),
            groups,
            trusted: settings.trusted,
            sums: vec![[0.0; 3]; all.len()],
            iterations: 0,
        };
        (caches, stats)
    }

    /// Number of cache points.
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// A cache point's end of a segment.
    #[inline]
    pub fn end(&self, cache: usize) -> &SegmentEnd {
        &self.ends[cache]
    }

    /// Pmfs at cache points count the BSDFs there.
    #[inline]
    pub fn pmfs_count_bsdfs(&self) -> bool {
        self.bsdfs.is_some()
    }

    /// Radiance that a cache point scatters to the eye, of light from the point `y` that causes the
    /// irradiance `irradiance` there. Without BSDFs at cache points it is the irradiance.
    #[inline]
    pub fn scattered(&self, cache: usize, y: Vec3, irradiance: f32) -> f32 {
        let Some(CacheBsdfs { each, pool }) = &self.bsdfs else { return irradiance };
        let (wo, bsdf) = &each[cache];
        let CacheState { p, side, .. } = self.states[cache];
        let from = (y - p).normalize_or_zero();
        // The cosine is a factor of the irradiance, and of the value on a surface again.
        let (ng, cosine) = match self.ends[cache] {
            SegmentEnd::Surface { ng, .. } => (ng, side.dot(from)),
            SegmentEnd::Free(_) => (Vec3::ZERO, 1.0),
        };
        let weight = pool.get(bsdf, ng).eval(*wo, from, Transport::Radiance).luminance() * irradiance / cosine;
        if weight.is_finite() { weight } else { 0.0 }
    }

    /// The ball around a group of cache points, with their common normal.
    pub fn receiver_bounds(&self, group: &Range<usize>) -> ReceiverBounds {
        let (points, sides) = (&self.index.points()[group.clone()], &self.index.normals()[group.clone()]);
        let count = group.len().max(1) as f32;
        let centre = points.iter().sum::<Vec3>() / count;
        let radius = (points.iter().map(|p| p.distance_squared(centre)).sum::<f32>() / count).sqrt();
        // Sides that differ much have no horizon in common.
        let mean = sides.iter().sum::<Vec3>() / count;
        let normal = if mean.length_squared() > 0.98 { mean.normalize() } else { Vec3::ZERO };
        ReceiverBounds { centre, radius, normal }
    }

    /// Means over iterations so far of the light that the cache points around a place found, on the side of the
    /// direction `d`.
    #[inline]
    pub fn normalization_at(&self, place: &StoredPlace, d: Vec3) -> NormalizationEstimate {
        if self.iterations == 0 {
            return NormalizationEstimate::default();
        }
        let (p, n) = (place.position(), place.side_normal(d));
        let (mut sum, mut count, mut unrelated, mut cache_radius2) = ([0.0; 3], 0.0, 1.0f32, 0.0f32);
        for i in self.index.find(p, n) {
            let state = &self.states[i];
            sum = std::array::from_fn(|k| sum[k] + state.means[k]);
            count += 1.0;
            cache_radius2 = cache_radius2.max(1.0 / (state.inv_trust_radius2 * (TRUST_RADII * TRUST_RADII)));
            let distance = p.distance_squared(state.p) * state.inv_trust_radius2;
            // Points in media have no tilt.
            let tilt = if n == Vec3::ZERO { 0.0 } else { 1.0 - n.dot(state.side) };
            unrelated = unrelated.min(distance + TILT * tilt);
        }
        if count == 0.0 {
            return NormalizationEstimate::default();
        }
        let q = ResamplingTarget { full: sum[0] / count, first_stage: sum[1] / count };
        if self.trusted {
            return NormalizationEstimate { q, ..NormalizationEstimate::default() };
        }
        let unseen = if sum[0] > 0.0 { sum[2] / sum[0] } else { 0.0 };
        NormalizationEstimate { q, unseen_fraction: unseen.max(unrelated), cache_radius2 }
    }

    /// Q of both targets at a cache point: means over iterations so far.
    #[inline]
    pub fn q(&self, cache: usize) -> ResamplingTarget {
        let [full, first_stage, _] = self.states[cache].means;
        ResamplingTarget { full, first_stage }
    }

    /// Unit direction from `p` to a cache point, and the area Jacobian there; none if `p` is not in front of it.
    #[inline]
    pub fn direction_from(&self, p: Vec3, cache: usize) -> Option<(Vec3, f32)> {
        direction_to(p, self.index.points()[cache], self.index.normals()[cache])
    }

    /// Adds the light that an iteration found to the means.
    pub fn learn<'a>(&mut self, found: impl Iterator<Item = &'a FoundLight>) {
        for (sum, own) in self.sums.iter_mut().zip(found) {
            *sum = std::array::from_fn(|k| sum[k] + own[k]);
        }
        self.iterations += 1;
        self.update_means();
    }

    fn update_means(&mut self) {
        let n = self.iterations as f64;
        for (state, sums) in self.states.iter_mut().zip(&self.sums) {
            state.means = sums.map(|sum| if n > 0.0 { (sum / n) as f32 } else { 0.0 });
        }
    }

    /// The sums, and the number of iterations behind them.
    pub fn sums(&self) -> (&[FoundLight], u64) {
        (&self.sums, self.iterations)
    }

    /// Goes on from saved sums; false if they are of other cache points.
    pub fn restore(&mut self, sums: Vec<FoundLight>, iterations: u64) -> bool {
        let fits = sums.len() == self.sums.len();
        if fits {
            (self.sums, self.iterations) = (sums, iterations);
            self.update_means();
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;
    use crate::shade::{Bsdf, SurfacePoint};

    #[test]
    fn a_cache_state_is_one_cache_line() {
        assert_eq!(size_of::<CacheState>(), 64);
    }

    #[test]
    fn groups_are_full_and_near() {
        let (mut rng, mut pool) = (HashRng::new(5, 6, 7, 8), BsdfPool::default());
        let mut points: Vec<EyeSubpathVertex> = (0..1000)
            .map(|_| {
                let [x, y, z, _] = rng.next_4();
                let (p, n) = (Vec3::new(x, y, z), Vec3::Z);
                let bsdf = pool.store(&Bsdf::empty(&SurfacePoint::default()));
                EyeSubpathVertex { place: StoredPlace::Surface { p, error: 0.0, ng: n }, side: n, wo: n, bsdf }
            })
            .collect();
        for size in [16, 8, 3, 1] {
            let mut groups = vec![];
            group(&mut points, size, 0, &mut groups);
            let rest = Some(1000 % size).filter(|rest| *rest > 0);
            let sizes = std::iter::repeat_n(size, 1000 / size).chain(rest);
            assert!(groups.iter().map(ExactSizeIterator::len).eq(sizes), "{size}");
            assert!(groups.windows(2).all(|w| w[0].end == w[1].start) && groups[0].start == 0);
            for g in &groups {
                let centre = points[g.clone()].iter().map(EyeSubpathVertex::position).sum::<Vec3>() / g.len() as f32;
                assert!(points[g.clone()].iter().all(|c| c.position().distance(centre) < 0.4));
            }
        }
        let mut groups = vec![];
        group(&mut [], 16, 3, &mut groups);
        assert_eq!(groups.pop(), Some(3..3));
    }
}
