//! Cache points: places on surfaces where the question "which light sub-path matters here?" is answered for their surroundings.
//!
//! They are the vertices of a few eye sub-paths (a fixed share of the number of pixels), traced once. Those that are near each other
//! and face the same way form groups of up to sixteen, which share packets of shadow rays and, where there are two stages, the
//! candidates of the second. Each keeps running means of what there is to find at it: its normalisations Q.

use super::Settings;
use crate::math::sampler::PathSampler;
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::mis::{Targets, There};
use crate::path::{Edge, Limits, SurfaceVertex, WalkHooks, WalkStart, walk};
use crate::prepared::PreparedScene;
use crate::ray::offset::SegmentEnd;
use crate::ray::{PACKET, Ray, RayKind, RayStats, Tracer};
use crate::shade::{BsdfPool, KeptBsdf, Transport};
use crate::spatial::NearestPoints;
use crate::spatial::nearest::MOST;
use crate::spatial::point_tree::Viewpoint;
use rayon::prelude::*;
use std::ops::Range;

/// The random stream of the eye sub-paths that make cache points.
const CACHE_STREAM: u64 = 4;

/// Radii of a group beyond which its points say nothing about visibility.
const FAR: f32 = 3.0;
/// What surfaces at right angles may miss of each other's light.
const TILT: f32 = 0.25;

/// A cache point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cache {
    pub p: Vec3,
    /// Unit normal on the side that the eye sub-path saw.
    pub side: Vec3,
    pub error: f32,
    pub ng: Vec3,
    /// Unit direction towards the vertex before.
    wo: Vec3,
    bsdf: KeptBsdf,
}

/// What a cache point found: the two targets (scattered first), and what it alone found of the first.
pub(super) type Found = [f64; 3];

/// What is known at a cache point, in one line of the processor's cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Known {
    p: Vec3,
    /// One over the squared distance at which nothing is like here any more.
    unlike_at: f32,
    side: Vec3,
    /// Means of [`Found`] over all iterations so far.
    means: [f32; 3],
}

/// A fixed set of cache points with their estimates.
#[derive(Debug)]
pub(in crate::integrators) struct Caches {
    pub index: NearestPoints,
    ends: Vec<SegmentEnd>,
    /// Ranges of points.
    pub groups: Vec<Range<usize>>,
    /// For each point, three others of its group that are nearest: bits of their places in the group.
    pub companions: Vec<u16>,
    /// How each point looks to the eye, where that matters.
    looks: Option<Looks>,
    /// What is asked of each point at every vertex, in one piece.
    known: Vec<Known>,
    trusted: bool,
    /// Sum over iterations of what each point found, and their number.
    sums: Vec<Found>,
    iterations: u64,
}

/// How cache points look to the eye sub-paths that made them.
#[derive(Debug)]
struct Looks {
    each: Vec<(Vec3, KeptBsdf)>,
    bsdfs: BsdfPool,
}

/// Collects the connectable vertices of a walk.
#[derive(Default)]
struct Collect {
    caches: Vec<Cache>,
    bsdfs: BsdfPool,
}

impl WalkHooks for Collect {
    fn surface(&mut self, v: &SurfaceVertex, _tracer: &mut Tracer, _sampler: &mut PathSampler) -> bool {
        if v.bsdf.is_black() {
            return false;
        }
        if v.bsdf.connectable() {
            let ng = v.point.ng;
            let side = if ng.dot(v.wo) < 0.0 { -ng } else { ng };
            let bsdf = self.bsdfs.keep(v.bsdf);
            self.caches.push(Cache { p: v.point.p, side, error: v.point.error, ng, wo: v.wo, bsdf });
        }
        true
    }

    fn escaped(&mut self, _index: u32, _direction: Vec3, _throughput: Rgb, _edge: &Edge) {}
}

/// Cuts a range of points in two along the longest side of the box around them, at a multiple of the size of a packet, until it fits
/// into one.
fn group(points: &mut [Cache], first: usize, groups: &mut Vec<Range<usize>>) {
    if points.len() <= PACKET {
        groups.push(first..first + points.len());
        return;
    }
    let lo = points.iter().fold(Vec3::INFINITY, |lo, c| lo.min(c.p));
    let hi = points.iter().fold(Vec3::NEG_INFINITY, |hi, c| hi.max(c.p));
    let size = hi - lo;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = points.len().div_ceil(2).next_multiple_of(PACKET).min(points.len() - 1);
    points.select_nth_unstable_by(middle, |a, b| a.p[axis].total_cmp(&b.p[axis]));
    let (left, right) = points.split_at_mut(middle);
    group(left, first, groups);
    group(right, first + middle, groups);
}

impl Caches {
    /// For each point, which three others of its group are nearest.
    fn companions(points: &[Cache], groups: &[Range<usize>]) -> Vec<u16> {
        let nearest = |group: &Range<usize>, own: usize| {
            let mut others: Vec<usize> = group.clone().filter(|&i| i != own).collect();
            let distance = |i: &usize| points[own].p.distance_squared(points[*i].p);
            others.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
            others.iter().take(MOST).fold(0, |bits, i| bits | 1 << (i - group.start))
        };
        groups.iter().flat_map(|group| group.clone().map(move |own| nearest(group, own))).collect()
    }

    /// The vertices of eye sub-paths, as many as `settings` say. If there are two stages, all neighbours of a place are of one group.
    pub fn new(scene: &PreparedScene, seed: u64, settings: &Settings, limits: &Limits) -> (Caches, RayStats) {
        let (mut all, bsdfs, stats) = place(scene, seed, settings.cache_fraction, limits);
        let metric = settings.metric;
        // Stable sorts and selections on equal input: the same for any number of threads.
        all.sort_by_key(|c| metric.kind(c.side));
        let mut groups = vec![];
        let mut first = 0;
        while first < all.len() {
            let own = metric.kind(all[first].side);
            let count = all[first..].iter().take_while(|c| metric.kind(c.side) == own).count();
            group(&mut all[first..first + count], first, &mut groups);
            first += count;
        }
        let (points, sides) = (all.iter().map(|c| c.p).collect(), all.iter().map(|c| c.side).collect());
        let index = NearestPoints::new(points, sides, metric);
        let index = if settings.second_stage.is_some() { index.within_groups(&groups) } else { index };
        let ends = all.iter().map(|c| SegmentEnd::Surface { p: c.p, error: c.error, ng: c.ng }).collect();
        let companions = Self::companions(&all, &groups);
        let unlike_at = groups.iter().flat_map(|group| {
            let centre = all[group.clone()].iter().map(|c| c.p).sum::<Vec3>() / group.len() as f32;
            let sum: f32 = all[group.clone()].iter().map(|c| c.p.distance_squared(centre)).sum();
            let far = FAR * FAR * sum / group.len() as f32;
            std::iter::repeat_n((1.0 / far).min(f32::MAX), group.len())
        });
        let know = |(c, unlike_at): (&Cache, f32)| Known { p: c.p, unlike_at, side: c.side, means: [0.0; 3] };
        let known = all.iter().zip(unlike_at).map(know).collect();
        let sums = vec![[0.0; 3]; all.len()];
        let looks = settings.radiance.then(|| Looks { each: all.iter().map(|c| (c.wo, c.bsdf)).collect(), bsdfs });
        (Caches { index, ends, groups, companions, looks, known, trusted: settings.trust, sums, iterations: 0 }, stats)
    }

    /// A cache point's end of a shadow ray.
    #[inline]
    pub fn end(&self, cache: usize) -> &SegmentEnd {
        &self.ends[cache]
    }

    /// What probabilities at a cache point aim at, for light from the point `y` that brings `irradiance` there.
    #[inline]
    pub fn aim(&self, cache: usize, y: Vec3, irradiance: f32) -> f32 {
        let Some(Looks { each, bsdfs }) = &self.looks else { return irradiance };
        let (wo, bsdf) = &each[cache];
        let Known { p, side, .. } = self.known[cache];
        let from = (y - p).normalize_or_zero();
        let SegmentEnd::Surface { ng, .. } = self.ends[cache] else { return irradiance };
        // The cosine is part of the irradiance, and of the value again.
        let aim = bsdfs.get(bsdf, ng).eval(*wo, from, Transport::Radiance).luminance() * irradiance / side.dot(from);
        if aim.is_finite() { aim } else { 0.0 }
    }

    /// The ball around a group of cache points.
    pub fn viewpoint(&self, group: &Range<usize>) -> Viewpoint {
        let (points, sides) = (&self.index.points()[group.clone()], &self.index.normals()[group.clone()]);
        let count = group.len().max(1) as f32;
        let centre = points.iter().sum::<Vec3>() / count;
        let radius = (points.iter().map(|p| p.distance_squared(centre)).sum::<f32>() / count).sqrt();
        // Sides that differ much have no horizon in common.
        let mean = sides.iter().sum::<Vec3>() / count;
        let normal = if mean.length_squared() > 0.98 { mean.normalize() } else { Vec3::ZERO };
        Viewpoint { centre, radius, normal }
    }

    /// Means over iterations so far of what the cache points around `p` whose side is `n` found.
    #[inline]
    pub fn there(&self, p: Vec3, n: Vec3) -> There {
        if self.iterations == 0 {
            return There::default();
        }
        let (mut sum, mut count, mut unlike, mut blur2) = ([0.0; 3], 0.0, 1.0f32, 0.0f32);
        for i in self.index.find(p, n) {
            let known = &self.known[i];
            sum = std::array::from_fn(|k| sum[k] + known.means[k]);
            count += 1.0;
            blur2 = blur2.max(1.0 / (known.unlike_at * (FAR * FAR)));
            unlike = unlike.min(p.distance_squared(known.p) * known.unlike_at + TILT * (1.0 - n.dot(known.side)));
        }
        if count == 0.0 {
            return There::default();
        }
        let all = Targets { scattered: sum[0] / count, unscattered: sum[1] / count };
        if self.trusted {
            return There { all, ..There::default() };
        }
        let missed = if sum[0] > 0.0 { sum[2] / sum[0] } else { 0.0 };
        There { all, missed: missed.max(unlike), blur2 }
    }

    /// Means over iterations so far of what a cache point found: its Q of both targets.
    #[inline]
    pub fn all(&self, cache: usize) -> Targets {
        let [scattered, unscattered, _] = self.known[cache].means;
        Targets { scattered, unscattered }
    }

    /// Adds what an iteration found to the means.
    pub fn learn<'a>(&mut self, found: impl Iterator<Item = &'a Found>) {
        for (sum, own) in self.sums.iter_mut().zip(found) {
            *sum = std::array::from_fn(|k| sum[k] + own[k]);
        }
        self.iterations += 1;
        self.know();
    }

    fn know(&mut self) {
        let n = self.iterations as f64;
        for (known, sums) in self.known.iter_mut().zip(&self.sums) {
            known.means = sums.map(|sum| if n > 0.0 { (sum / n) as f32 } else { 0.0 });
        }
    }

    /// What must be saved to go on later: the sums, and the number of iterations behind them.
    pub fn state(&self) -> (&[Found], u64) {
        (&self.sums, self.iterations)
    }

    /// Goes on from a saved state; false if it is of other cache points.
    pub fn restore(&mut self, sums: Vec<Found>, iterations: u64) -> bool {
        let fits = sums.len() == self.sums.len();
        if fits {
            (self.sums, self.iterations) = (sums, iterations);
            self.know();
        }
        fits
    }
}

/// The vertices of `fraction` times as many eye sub-paths as the full picture has pixels, with their BSDFs.
pub(super) fn place(
    scene: &PreparedScene,
    seed: u64,
    fraction: f64,
    limits: &Limits,
) -> (Vec<Cache>, BsdfPool, RayStats) {
    let [width, height] = scene.film_size.map(f64::from);
    let scale = fraction.sqrt();
    let [columns, rows] = [width, height].map(|s| ((s * scale).round() as u64).max(1));
    let pieces: Vec<(Collect, RayStats)> = (0..columns * rows)
        .into_par_iter()
        .map(|i| {
            let mut sampler = PathSampler::new(seed, CACHE_STREAM, i, 0);
            let u = sampler.origin();
            let at = [(i % columns) as f32 + u[0], (i / columns) as f32 + u[1]];
            let raster = [at[0] / columns as f32 * width as f32, at[1] / rows as f32 * height as f32];
            let eye = scene.camera.sample_ray(raster, [u[2], u[3]]);
            let start = WalkStart {
                ray: Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far },
                throughput: Rgb::WHITE,
                pdf: SolidAnglePdf(1.0),
                delta: false,
                kind: RayKind::Cache,
            };
            let (mut collect, mut tracer) = (Collect::default(), Tracer::new(&*scene.query));
            walk(scene, start, limits, Transport::Radiance, &mut tracer, &mut sampler, &mut collect);
            (collect, tracer.stats)
        })
        .collect();
    let mut stats = RayStats::default();
    let (mut all, mut bsdfs) = (vec![], BsdfPool::default());
    for (collect, s) in pieces {
        stats.merge(&s);
        let moved = bsdfs.append(&collect.bsdfs);
        all.extend(collect.caches.into_iter().map(|c| Cache { bsdf: c.bsdf.moved(moved), ..c }));
    }
    (all, bsdfs, stats)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;
    use crate::shade::{Bsdf, SurfacePoint};

    #[test]
    fn groups_are_full_and_near() {
        let (mut rng, mut pool) = (HashRng::new(5, 6, 7, 8), BsdfPool::default());
        let mut points: Vec<Cache> = (0..1000)
            .map(|_| {
                let [x, y, z, _] = rng.next_4();
                let (p, n) = (Vec3::new(x, y, z), Vec3::Z);
                Cache { p, side: n, error: 0.0, ng: n, wo: n, bsdf: pool.keep(&Bsdf::empty(&SurfacePoint::default())) }
            })
            .collect();
        let mut groups = vec![];
        group(&mut points, 0, &mut groups);
        assert!(groups.iter().map(ExactSizeIterator::len).eq(std::iter::repeat_n(16, 62).chain([8])));
        assert!(groups.windows(2).all(|w| w[0].end == w[1].start) && groups[0].start == 0);
        for g in &groups {
            let centre = points[g.clone()].iter().map(|c| c.p).sum::<Vec3>() / g.len() as f32;
            assert!(points[g.clone()].iter().all(|c| c.p.distance(centre) < 0.4));
        }
        group(&mut [], 3, &mut groups);
        assert_eq!(groups.pop(), Some(3..3));
    }
}
