//! Rules that divide a set of light sources in two.

use super::bounds::{Aabb, LightBounds, LightCluster, Power};
use super::{LightSource, OrientedSource, WeightedPoint};
use crate::math::Vec3;

/// A rule that divides a set of light sources in two.
pub trait SplitRule<S: LightSource> {
    /// Orders `sources`, which are at least two, and returns the number of those in the first half; neither half is
    /// empty. `first` is the index of the first source among all of the tree, `depth` the number of splits above.
    fn split(&self, sources: &mut [S], first: usize, depth: u32) -> usize;
}

/// Splits points in Morton order where the highest differing bit of their codes changes, or in the middle if all codes
/// are equal.
#[derive(Clone, Copy, Debug)]
pub struct MortonSplit<'a> {
    /// Morton codes of all points, sorted ([`crate::spatial::morton`]).
    pub codes: &'a [u32],
}

impl SplitRule<WeightedPoint> for MortonSplit<'_> {
    fn split(&self, points: &mut [WeightedPoint], first: usize, _depth: u32) -> usize {
        let codes = &self.codes[first..first + points.len()];
        let (low, high) = (codes[0], codes[codes.len() - 1]);
        if low == high {
            return codes.len() / 2;
        }
        let bit = 31 - (low ^ high).leading_zeros();
        let upper = high >> bit << bit;
        codes.partition_point(|&c| c < upper)
    }
}

/// Splits at the cheapest bucket boundary of the surface area orientation heuristic (Conty Estevez & Kulla 2018, §4.4),
/// or in the middle if there is none or the tree is deep.
#[derive(Clone, Copy, Debug)]
pub struct SaohSplit {
    /// From this depth on sets are halved by count, so that the depth of the tree is bounded.
    pub max_depth: u32,
}

/// Buckets per axis between which splits are tried.
const BUCKETS: usize = 12;

/// Boxes of a set of sources.
struct Extents {
    /// Box around the centres of the sources' boxes.
    centres: Aabb,
    /// Lengths of the sides of that box.
    extent: Vec3,
    /// Lengths of the sides of the box around all sources.
    whole: Vec3,
    /// Length that is added to all sides of boxes ([`LightBounds::cost`]).
    thickness: f32,
}

impl Extents {
    fn of<P: Power>(sources: &[OrientedSource<P>]) -> Extents {
        let centres = Aabb::of(sources.iter().map(|s| s.bounds.aabb.centre()));
        let whole = sources.iter().fold(Aabb::EMPTY, |all, s| all.union(s.bounds.aabb)).extent();
        Extents { centres, extent: centres.extent(), whole, thickness: 1e-3 * whole.max_element() }
    }

    fn bucket<P: Power>(&self, bounds: &LightBounds<P>, axis: usize) -> usize {
        let offset = (bounds.aabb.centre()[axis] - self.centres.min[axis]) / self.extent[axis];
        ((offset * BUCKETS as f32) as usize).min(BUCKETS - 1)
    }

    /// Least cost of a split across `axis`, and the first bucket of the upper half.
    fn cheapest<P: Power>(&self, sources: &[OrientedSource<P>], axis: usize) -> Option<(f32, usize)> {
        let mut buckets: [Option<LightBounds<P>>; BUCKETS] = [None; BUCKETS];
        for s in sources {
            let bucket = &mut buckets[self.bucket(&s.bounds, axis)];
            *bucket = join(*bucket, Some(s.bounds));
        }
        let cost = |b: Option<LightBounds<P>>| b.map(|b| b.cost(self.thickness));
        let mut above = [None; BUCKETS];
        let mut sum = None;
        for k in (1..BUCKETS).rev() {
            sum = join(sum, buckets[k]);
            above[k] = cost(sum);
        }
        // Long thin sets should be cut across their length.
        let shape = self.whole.max_element() / self.whole[axis].max(self.thickness);
        let mut below = None;
        let mut best: Option<(f32, usize)> = None;
        for k in 1..BUCKETS {
            below = join(below, buckets[k - 1]);
            if let (Some(a), Some(b)) = (cost(below), above[k]) {
                let c = shape * (a + b);
                if c.is_finite() && best.is_none_or(|(lowest, _)| c < lowest) {
                    best = Some((c, k));
                }
            }
        }
        best
    }
}

fn join<P: Power>(a: Option<LightBounds<P>>, b: Option<LightBounds<P>>) -> Option<LightBounds<P>> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(b)),
        (a, b) => a.or(b),
    }
}

impl<P: Power> SplitRule<OrientedSource<P>> for SaohSplit {
    fn split(&self, sources: &mut [OrientedSource<P>], _first: usize, depth: u32) -> usize {
        let extents = Extents::of(sources);
        let mut best: Option<(f32, usize, usize)> = None;
        for axis in (0..3).filter(|&axis| depth < self.max_depth && extents.extent[axis] > 0.0) {
            if let Some((cost, cut)) = extents.cheapest(sources, axis)
                && best.is_none_or(|(lowest, ..)| cost < lowest)
            {
                best = Some((cost, axis, cut));
            }
        }
        if let Some((_, axis, cut)) = best {
            sources.sort_unstable_by_key(|s| (extents.bucket(&s.bounds, axis) >= cut, s.index));
            return sources.partition_point(|s| extents.bucket(&s.bounds, axis) < cut);
        }
        let axis = extents.extent.max_position();
        let centre = |s: &OrientedSource<P>| s.bounds.aabb.centre()[axis];
        sources.sort_unstable_by(|a, b| centre(a).total_cmp(&centre(b)).then(a.index.cmp(&b.index)));
        sources.len() / 2
    }
}
