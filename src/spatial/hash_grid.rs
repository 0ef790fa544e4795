//! Radius queries over many points, by a hash table of grid cells (Teschner et al. 2003, "Optimized Spatial Hashing for
//! Collision Detection of Deformable Objects").
//!
//! Cells are as long as the radius, so that a query looks at three cells along each axis. Neighbours along x have
//! neighbouring buckets: a query reads nine runs of points and not 27. Points are sorted by bucket, and by number
//! inside a bucket.
//!
//! Everything is exact. The cell of a coordinate is a monotone function of it, rounding included, so that no point is
//! missed between the cells of the two ends of a query's interval; and a point that another row of cells has put into
//! the same bucket is told by its cell.

use super::light_tree::Aabb;
use crate::math::Vec3;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Buckets per point: more of them hold fewer points of other cells, but take more memory.
const BUCKETS_PER_POINT: usize = 2;
/// Fewest buckets: more than the cells of a run along x (three, up to six where coordinates are rounded coarsely), so
/// that a run meets no bucket twice.
const MIN_BUCKETS: usize = 8;
/// Most cells along an axis.
const MAX_CELLS: f32 = (1 << 20) as f32;
/// Points that one thread sorts at a time.
const CHUNK: usize = 1 << 14;
/// Parts of the table that are sorted independently; at most the number of buckets.
const MAX_PARTS: usize = 256;

/// Points in the order of their buckets; answers which of them are within a fixed radius.
#[derive(Clone, Debug, Default)]
pub struct HashGrid {
    radius: f32,
    origin: Vec3,
    /// Cells per unit of length.
    scale: f32,
    /// Cell of the largest coordinate on each axis; that of the smallest is 0.
    last: [i32; 3],
    /// log₂ of the number of buckets.
    bits: u32,
    /// First point of each bucket, and the number of all.
    starts: Vec<u32>,
    points: Vec<GridPoint>,
    /// Bucket of each point, and points sorted by part of the table, while the grid is built; kept for their memory.
    point_buckets: Vec<u32>,
    half_sorted: Vec<HashedPoint>,
}

#[derive(Clone, Copy, Debug, Default)]
struct GridPoint {
    p: Vec3,
    /// Number of the point in the list that the grid was built from.
    index: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct HashedPoint {
    bucket: u32,
    point: GridPoint,
}

impl HashGrid {
    /// Builds the grid anew over `positions` (fewer than 2³², in scene units) for queries of the given radius. The
    /// result is the same for any number of threads. Points with a coordinate that is not finite are never found.
    ///
    /// # Panics
    /// If the radius is negative or not a number.
    pub fn build(&mut self, positions: &[Vec3], radius: f32) {
        assert!(radius >= 0.0, "the radius {radius} is negative");
        let bounds = Aabb::of(positions.iter().copied().filter(|p| p.is_finite()));
        let bounds = if bounds.min.is_finite() { bounds } else { Aabb { min: Vec3::ZERO, max: Vec3::ZERO } };
        self.radius = radius;
        self.origin = bounds.min;
        // A little longer than half of a query's interval, which therefore spans three cells and never four.
        let length = (self.margin() * 1.00001).max(bounds.extent().max_element() / MAX_CELLS);
        self.scale = 1.0 / length;
        self.last = [0, 1, 2].map(|axis| self.cell(bounds.max[axis], axis));
        let buckets = (positions.len() * BUCKETS_PER_POINT).next_power_of_two().max(MIN_BUCKETS);
        self.bits = buckets.ilog2();
        self.starts.resize(buckets + 1, 0);
        self.points.resize(positions.len(), GridPoint::default());
        self.half_sorted.resize(positions.len(), HashedPoint::default());
        self.sort(positions, buckets.min(MAX_PARTS));
    }

    /// Calls `visit` for every point within the radius of `centre` (squared distances are compared, in single
    /// precision), with its number in the list that the grid was built from and its squared distance. The order depends
    /// on nothing but the points and `centre`.
    #[inline]
    pub fn for_each_within(&self, centre: Vec3, mut visit: impl FnMut(usize, f32)) {
        let radius2 = self.radius * self.radius;
        let [xs, ys, zs] = [0, 1, 2].map(|axis| self.cells_around(centre[axis], axis));
        if self.points.is_empty() || xs.is_empty() {
            return;
        }
        for z in zs {
            for y in ys.clone() {
                let first = self.bucket_of_row(y, z) + *xs.start() as usize;
                self.for_each_in_run(first, (xs.end() - xs.start()) as usize + 1, |point| {
                    let distance2 = point.p.distance_squared(centre);
                    // Points of other rows of cells are in the same buckets by chance; their own row finds them.
                    if distance2 <= radius2 && self.cell(point.p.y, 1) == y && self.cell(point.p.z, 2) == z {
                        visit(point.index as usize, distance2);
                    }
                });
            }
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True if there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Radius of queries, in scene units.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Points of `length` buckets from `first` on, where the first bucket follows the last.
    #[inline]
    fn for_each_in_run(&self, first: usize, length: usize, mut visit: impl FnMut(&GridPoint)) {
        let buckets = 1 << self.bits;
        let first = first & (buckets - 1);
        let end = (first + length).min(buckets);
        self.points[self.starts[first] as usize..self.starts[end] as usize].iter().for_each(&mut visit);
        let wrapped = first + length - end;
        if wrapped > 0 {
            self.points[..self.starts[wrapped] as usize].iter().for_each(&mut visit);
        }
    }

    /// Largest difference of a coordinate between a point and a query that finds it. Squares of distances are rounded,
    /// and those of the smallest numbers are zero: a margin over the radius covers both.
    #[inline]
    fn margin(&self) -> f32 {
        (self.radius * (1.0 + 1e-6)).max(1e-22)
    }

    /// Cell of a coordinate: monotone in it.
    #[inline]
    fn cell(&self, coordinate: f32, axis: usize) -> i32 {
        ((coordinate - self.origin[axis]) * self.scale).floor() as i32
    }

    /// Cells that hold all points whose coordinate differs from `centre` by at most the radius.
    #[inline]
    fn cells_around(&self, centre: f32, axis: usize) -> RangeInclusive<i32> {
        let margin = self.margin();
        self.cell(centre - margin, axis).max(0)..=self.cell(centre + margin, axis).min(self.last[axis])
    }

    /// Bucket of cell 0 of a row of cells along x.
    #[inline]
    fn bucket_of_row(&self, y: i32, z: i32) -> usize {
        let row = u64::from(y as u32) | u64::from(z as u32) << 32;
        // The upper bits of the product depend on all bits of the row.
        (row.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - self.bits)) as usize
    }

    #[inline]
    fn bucket(&self, p: Vec3) -> u32 {
        let (x, y, z) = (self.cell(p.x, 0), self.cell(p.y, 1), self.cell(p.z, 2));
        (self.bucket_of_row(y, z).wrapping_add(x as usize) & ((1 << self.bits) - 1)) as u32
    }

    /// Sorts the points by bucket, in two stable passes: into `parts` runs of buckets, and inside of each.
    fn sort(&mut self, positions: &[Vec3], parts: usize) {
        let (mut point_buckets, mut half_sorted) =
            (std::mem::take(&mut self.point_buckets), std::mem::take(&mut self.half_sorted));
        positions.par_iter().map(|&p| self.bucket(p)).collect_into_vec(&mut point_buckets);
        let sizes = self.distribute(positions, &point_buckets, parts, &mut half_sorted);
        let (mut points, mut starts) = (std::mem::take(&mut self.points), std::mem::take(&mut self.starts));
        let buckets = (1 << self.bits) / parts;
        let mut runs = Vec::with_capacity(parts);
        let (mut from, mut to) = (&half_sorted[..], &mut points[..]);
        let mut first = 0;
        for (part, starts) in starts[..buckets * parts].chunks_exact_mut(buckets).enumerate() {
            let (own, rest) = from.split_at(sizes[part]);
            from = rest;
            let (own_to, rest) = std::mem::take(&mut to).split_at_mut(sizes[part]);
            to = rest;
            runs.push(Run { from: own, to: own_to, starts, first });
            first += own.len() as u32;
        }
        runs.into_par_iter().for_each(Run::sort);
        starts[buckets * parts] = positions.len() as u32;
        (self.points, self.starts) = (points, starts);
        (self.point_buckets, self.half_sorted) = (point_buckets, half_sorted);
    }

    /// Writes all points to `to`, sorted by the part of the table that their bucket belongs to, and returns the number
    /// of points of each part.
    fn distribute(&self, positions: &[Vec3], buckets: &[u32], parts: usize, to: &mut [HashedPoint]) -> Vec<usize> {
        let shift = self.bits - parts.ilog2();
        let count = |chunk: &[u32]| {
            let mut counts = vec![0usize; parts];
            chunk.iter().for_each(|&bucket| counts[(bucket >> shift) as usize] += 1);
            counts
        };
        let counts: Vec<Vec<usize>> = buckets.par_chunks(CHUNK).map(count).collect();
        // For each chunk, where its points of each part go: parts follow one another, and in each part the chunks.
        let mut targets: Vec<Vec<&mut [HashedPoint]>> = counts.iter().map(|_| Vec::with_capacity(parts)).collect();
        let mut rest = to;
        for part in 0..parts {
            for (targets, counts) in targets.iter_mut().zip(&counts) {
                let (own, after) = std::mem::take(&mut rest).split_at_mut(counts[part]);
                targets.push(own);
                rest = after;
            }
        }
        let chunks = positions.par_chunks(CHUNK).zip(buckets.par_chunks(CHUNK)).zip(targets).enumerate();
        chunks.for_each(|(number, ((positions, buckets), mut targets))| {
            let mut written = vec![0u32; parts];
            for (i, (&p, &bucket)) in positions.iter().zip(buckets).enumerate() {
                let part = (bucket >> shift) as usize;
                let point = GridPoint { p, index: (number * CHUNK + i) as u32 };
                targets[part][written[part] as usize] = HashedPoint { bucket, point };
                written[part] += 1;
            }
        });
        (0..parts).map(|part| counts.iter().map(|counts| counts[part]).sum()).collect()
    }
}

/// Points of one part of the table, to be sorted by bucket.
struct Run<'a> {
    from: &'a [HashedPoint],
    to: &'a mut [GridPoint],
    /// First point of each of its buckets.
    starts: &'a mut [u32],
    /// Number of points of the parts before.
    first: u32,
}

impl Run<'_> {
    /// A counting sort.
    fn sort(self) {
        // Parts have a power of two of buckets.
        let mask = self.starts.len() as u32 - 1;
        self.starts.fill(0);
        self.from.iter().for_each(|hashed| self.starts[(hashed.bucket & mask) as usize] += 1);
        let mut sum = 0;
        for start in self.starts.iter_mut() {
            sum += std::mem::replace(start, sum);
        }
        for hashed in self.from {
            let next = &mut self.starts[(hashed.bucket & mask) as usize];
            self.to[*next as usize] = hashed.point;
            *next += 1;
        }
        // Every start has moved to the end of its bucket, which is where the next one starts.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
        self.starts.iter_mut().for_each(|start| *start += self.first);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;
    use proptest::prelude::*;

    fn found(grid: &HashGrid, centre: Vec3) -> Vec<(usize, f32)> {
        let mut found = vec![];
        grid.for_each_within(centre, |i, d2| found.push((i, d2)));
        found
    }

    fn check(points: &[Vec3], radius: f32, centres: &[Vec3]) {
        let mut grid = HashGrid::default();
        grid.build(points, radius);
        assert_eq!((grid.len(), grid.is_empty(), grid.radius()), (points.len(), points.is_empty(), radius));
        for &centre in centres {
            let mut found = found(&grid, centre);
            found.sort_by_key(|&(i, _)| i);
            let near = |(i, p): (usize, &Vec3)| {
                let d2 = p.distance_squared(centre);
                (d2 <= radius * radius).then_some((i, d2))
            };
            let expected: Vec<_> = points.iter().enumerate().filter_map(near).collect();
            assert_eq!(found, expected, "centre {centre}, radius {radius}, {} points", points.len());
        }
    }

    fn random(n: usize, seed: u64) -> Vec<Vec3> {
        let mut rng = HashRng::new(seed, 3, 5, 7);
        let point = |i: usize| {
            let [x, y, z, _] = rng.next_4();
            // Many points lie in planes.
            Vec3::new(x, if i.is_multiple_of(2) { 0.5 } else { y }, if i.is_multiple_of(3) { 0.25 } else { z })
        };
        (0..n).map(point).collect()
    }

    proptest! {
        #[test]
        fn finds_what_brute_force_finds(
            n in 0usize..300,
            seed in 0u64..1000,
            radius in prop_oneof![Just(0.0f32), 1e-4f32..0.05, 0.05f32..3.0],
            size in prop_oneof![Just(1.0f32), Just(1e-6), Just(1e6)],
            offset in prop_oneof![Just(0.0f32), Just(1e3), Just(-1e7)],
        ) {
            let place = |p: Vec3| (p + offset) * size;
            let points: Vec<Vec3> = random(n, seed).into_iter().map(place).collect();
            let mut centres: Vec<Vec3> =
                random(20, seed + 1).into_iter().map(|p| place(p * 1.4 - 0.2)).collect();
            centres.extend(points.iter().take(20));
            check(&points, radius * size, &centres);
        }

        /// Points on a lattice with the radius as its constant: neighbours are exactly as far as the radius, up to
        /// rounding.
        #[test]
        fn finds_neighbours_at_exactly_the_radius(cell in 1e-3f32..10.0, offset in -100.0f32..100.0) {
            let points: Vec<Vec3> = (0..6 * 6 * 6)
                .map(|i| Vec3::new((i % 6) as f32, (i / 6 % 6) as f32, (i / 36) as f32) * cell + offset)
                .collect();
            check(&points, cell, &points);
        }
    }

    #[test]
    fn finds_what_brute_force_finds_among_many() {
        // Several chunks of points.
        let points = random(3 * CHUNK + 17, 8);
        check(&points, 0.01, &random(50, 9));
        check(&points, 0.1, &points[..20]);
    }

    #[test]
    fn degenerate_inputs() {
        check(&[], 1.0, &[Vec3::ZERO]);
        check(&[Vec3::ONE], 0.0, &[Vec3::ONE, Vec3::ZERO, Vec3::splat(f32::NAN)]);
        check(&[Vec3::splat(1e30); 100], 0.0, &[Vec3::splat(1e30), Vec3::splat(-1e30)]);
        check(&[Vec3::splat(-7.0); 1000], 0.5, &[Vec3::splat(-7.0), Vec3::splat(-6.9), Vec3::splat(f32::INFINITY)]);
        // A radius far below the spacing of floats, one beyond everything, and one whose square vanishes.
        let far = [Vec3::splat(1e8), Vec3::splat(1e8 + 8.0), Vec3::splat(2e8)];
        check(&far, 1e-3, &far);
        check(&far, f32::MAX, &far);
        check(&far, f32::INFINITY, &far);
        check(&[Vec3::splat(1e-25), Vec3::ZERO, Vec3::splat(1e-23)], 1e-30, &[Vec3::ZERO, Vec3::splat(1e-24)]);
        // One point far away makes cells coarser than the radius.
        check(&[Vec3::ZERO, Vec3::splat(1e-3), Vec3::splat(1e7)], 2e-3, &[Vec3::ZERO, Vec3::splat(1e7)]);
        let mut grid = HashGrid::default();
        grid.build(&[Vec3::splat(f32::NAN), Vec3::ZERO, Vec3::new(f32::INFINITY, 0.0, 0.0)], 1.0);
        assert_eq!(found(&grid, Vec3::ZERO), [(1, 0.0)]);
        // An empty grid answers as well, and one grid can be built again.
        assert_eq!(found(&HashGrid::default(), Vec3::ZERO), []);
        grid.build(&[Vec3::X], 2.0);
        assert_eq!(found(&grid, Vec3::ZERO), [(0, 1.0)]);
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let points = random(2 * CHUNK + 5, 12);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut grid = HashGrid::default();
                grid.build(&points, 0.05);
                points.iter().step_by(1000).map(|&p| found(&grid, p)).collect::<Vec<_>>()
            })
        };
        assert!(with(1) == with(3));
    }

    #[test]
    fn points_of_a_cell_come_in_their_order() {
        let mut grid = HashGrid::default();
        grid.build(&[Vec3::ONE, Vec3::ZERO, Vec3::ONE, Vec3::ONE], 0.1);
        assert_eq!(found(&grid, Vec3::ONE).iter().map(|f| f.0).collect::<Vec<_>>(), [0, 2, 3]);
    }
}
