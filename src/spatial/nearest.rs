//! Nearest neighbours of a point on a surface or in a medium among a fixed set of such points.
//!
//! Every vertex of every sub-path queries, so results are cached: space is divided into cells, each with one slot for
//! each of six directions that a surface may face, and one for points in media, and a slot is filled by a search from the
//! middle of its cell at its first query. The result is a function of cell and facing alone, whatever the order of queries.
//!
//! With [`Metric::Facing`] only points whose surface faces about the same way are found: a point on the other side of a
//! thin wall is near, but sees another room. The normal of a point in a medium is zero; it finds, and is found by, its
//! like alone.

use crate::math::Vec3;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Largest number of neighbours that a query returns.
pub const MAX_NEIGHBORS: usize = 3;
/// Directions that a surface may face.
const FACINGS: usize = 6;
/// Kind of points in media.
const IN_MEDIUM: usize = FACINGS;
/// Cells along the longest side of the box around the points.
const CELLS: usize = 96;
/// Bits of a point's number.
const BITS: u32 = 21;
/// Number in slots with fewer neighbours than [`MAX_NEIGHBORS`].
const NO_POINT: u64 = (1 << BITS) - 1;
/// Set in slots that have been filled.
const KNOWN: u64 = 1 << 63;
/// A slot without neighbours.
const NOTHING: u64 = KNOWN | ((1 << (BITS as usize * MAX_NEIGHBORS)) - 1);

/// Which points are candidates, by distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Points whose surface faces about the same way, or of a medium.
    Facing,
    /// All points.
    Plain,
}

impl Metric {
    /// Kind of points with the normal `n`; points of different kinds have different neighbours.
    #[inline]
    pub fn kind(self, n: Vec3) -> usize {
        match self {
            Metric::Facing if n == Vec3::ZERO => IN_MEDIUM,
            Metric::Facing => facing(n),
            Metric::Plain => 0,
        }
    }

    /// True if a point with the normal `n` is a candidate for points of a kind.
    fn finds(self, n: Vec3, kind: usize) -> bool {
        match kind {
            _ if self == Metric::Plain => true,
            IN_MEDIUM => n == Vec3::ZERO,
            facing => faces(n, facing),
        }
    }
}

/// A fixed set of oriented points.
#[derive(Debug)]
pub struct NearestPoints {
    metric: Metric,
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// For each kind: a left-balanced kd-tree of its candidates, as a list of numbers.
    trees: Vec<Vec<u32>>,
    lo: Vec3,
    per_cell: f32,
    cells: [usize; 3],
    slots: Vec<AtomicU64>,
    /// For each point its group, if all neighbours must be of one group.
    groups: Option<Vec<Range<usize>>>,
}

/// Number of the direction among ±x, ±y, ±z that is closest to `n`.
fn facing(n: Vec3) -> usize {
    let a = n.abs();
    let axis = if a.x >= a.y && a.x >= a.z {
        0
    } else if a.y >= a.z {
        1
    } else {
        2
    };
    2 * axis + usize::from(n[axis] < 0.0)
}

fn direction(facing: usize) -> Vec3 {
    let sign = if facing.is_multiple_of(2) { 1.0 } else { -1.0 };
    [Vec3::X, Vec3::Y, Vec3::Z][facing / 2] * sign
}

/// True if the normal `n` is within about 78° of the direction `facing`.
fn faces(n: Vec3, facing: usize) -> bool {
    n.dot(direction(facing)) > 0.2
}

/// Orders `numbers` so that the middle of every range splits it along the axis of its depth.
fn build_tree(points: &[Vec3], numbers: &mut [u32], axis: usize) {
    if numbers.len() <= 1 {
        return;
    }
    let middle = numbers.len() / 2;
    // Ties are broken by number: floors are full of equal coordinates.
    numbers.select_nth_unstable_by(middle, |&a, &b| {
        points[a as usize][axis].total_cmp(&points[b as usize][axis]).then(a.cmp(&b))
    });
    let (left, right) = numbers.split_at_mut(middle);
    build_tree(points, left, (axis + 1) % 3);
    build_tree(points, &mut right[1..], (axis + 1) % 3);
}

/// The nearest points so far, sorted by distance.
struct Best {
    distance2: [f32; MAX_NEIGHBORS],
    number: [u64; MAX_NEIGHBORS],
}

impl Best {
    fn offer(&mut self, distance2: f32, number: u32) {
        // Equal distances are ordered by number, so that the answer does not depend on the tree.
        let before = |i: usize, best: &Best| (distance2, u64::from(number)) < (best.distance2[i], best.number[i]);
        let Some(at) = (0..MAX_NEIGHBORS).find(|&i| before(i, self)) else { return };
        for i in (at + 1..MAX_NEIGHBORS).rev() {
            self.distance2[i] = self.distance2[i - 1];
            self.number[i] = self.number[i - 1];
        }
        self.distance2[at] = distance2;
        self.number[at] = u64::from(number);
    }
}

fn search(points: &[Vec3], tree: &[u32], axis: usize, p: Vec3, best: &mut Best) {
    let Some((left, rest)) = tree.split_at_checked(tree.len() / 2) else { return };
    let Some((&middle, right)) = rest.split_first() else { return };
    let q = points[middle as usize];
    best.offer(p.distance_squared(q), middle);
    let offset = p[axis] - q[axis];
    let (near, far) = if offset < 0.0 { (left, right) } else { (right, left) };
    search(points, near, (axis + 1) % 3, p, best);
    if offset * offset <= best.distance2[MAX_NEIGHBORS - 1] {
        search(points, far, (axis + 1) % 3, p, best);
    }
}

impl NearestPoints {
    /// An index of `points` with the unit normals of their surfaces' sides. At most 2²¹ − 1 points are indexed; later
    /// ones are never found.
    pub fn new(points: Vec<Vec3>, normals: Vec<Vec3>, metric: Metric) -> NearestPoints {
        let most = points.len().min(normals.len()).min(NO_POINT as usize);
        let tree_of = |kind: usize| {
            let mut tree: Vec<u32> = (0..most as u32).filter(|&i| metric.finds(normals[i as usize], kind)).collect();
            build_tree(&points, &mut tree, 0);
            tree
        };
        let kinds = match metric {
            Metric::Plain => 1,
            Metric::Facing if normals.contains(&Vec3::ZERO) => IN_MEDIUM + 1,
            Metric::Facing => FACINGS,
        };
        let trees: Vec<Vec<u32>> = (0..kinds).map(tree_of).collect();
        let lo = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let hi = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let size = if points.is_empty() { Vec3::ONE } else { hi - lo };
        let per_cell = CELLS as f32 / size.max_element().max(f32::MIN_POSITIVE);
        let cells = (size * per_cell).to_array().map(|s| (s.ceil() as usize).clamp(1, CELLS));
        let slots = (0..cells.iter().product::<usize>() * kinds).map(|_| AtomicU64::new(0)).collect();
        NearestPoints { metric, points, normals, trees, lo, per_cell, cells, slots, groups: None }
    }

    /// From now on only points of the nearest one's group are found; `groups` are ranges that have every point in one
    /// of them.
    pub fn within_groups(mut self, groups: &[Range<usize>]) -> NearestPoints {
        self.groups = Some(groups.iter().flat_map(|g| std::iter::repeat_n(g.clone(), g.len())).collect());
        self
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True if there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Positions.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// Normals.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Numbers of the points nearest to `p` (up to the size of a cell) among the candidates for points with the normal
    /// `n`, nearest first; fewer than [`MAX_NEIGHBORS`] where there are not so many.
    #[inline]
    pub fn find(&self, p: Vec3, n: Vec3) -> impl Iterator<Item = usize> + use<> {
        let cell = ((p - self.lo) * self.per_cell).to_array();
        // Negative numbers and NaN become zero.
        let cell: [usize; 3] = std::array::from_fn(|i| (cell[i] as usize).min(self.cells[i] - 1));
        let (kind, kinds) = (self.metric.kind(n), self.trees.len());
        let mut found = NOTHING;
        // No point is of a medium if that kind is not there.
        if kind < kinds {
            let slot = &self.slots[((cell[2] * self.cells[1] + cell[1]) * self.cells[0] + cell[0]) * kinds + kind];
            found = slot.load(Ordering::Relaxed);
            if found == 0 {
                found = self.search(cell, kind);
                // Threads that fill the same slot at once find the same.
                slot.store(found, Ordering::Relaxed);
            }
        }
        (0..MAX_NEIGHBORS as u32)
            .map(move |i| found >> (i * BITS) & NO_POINT)
            .filter(|&n| n != NO_POINT)
            .map(|n| n as usize)
    }

    #[cold]
    fn search(&self, cell: [usize; 3], kind: usize) -> u64 {
        let middle = self.lo + Vec3::from(cell.map(|c| c as f32 + 0.5)) / self.per_cell;
        let mut best = Best { distance2: [f32::INFINITY; MAX_NEIGHBORS], number: [NO_POINT; MAX_NEIGHBORS] };
        search(&self.points, &self.trees[kind], 0, middle, &mut best);
        if let Some(group) = self.groups.as_ref().and_then(|groups| groups.get(best.number[0] as usize)) {
            best = Best { distance2: [f32::INFINITY; MAX_NEIGHBORS], number: [NO_POINT; MAX_NEIGHBORS] };
            for i in group.clone().filter(|&i| self.metric.finds(self.normals[i], kind)) {
                best.offer(middle.distance_squared(self.points[i]), i as u32);
            }
        }
        best.number.iter().zip(0..).fold(KNOWN, |slot, (n, i)| slot | n << (i * BITS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    #[test]
    fn finds_what_brute_force_finds() {
        let mut rng = HashRng::new(1, 2, 3, 4);
        // Many points on planes, with equal coordinates.
        let points: Vec<Vec3> = (0..3000)
            .map(|i| {
                let [x, y, z, _] = rng.next_4();
                Vec3::new(x * 5.0, if i % 2 == 0 { 0.0 } else { y * 3.0 }, if i % 3 == 0 { 1.0 } else { z })
            })
            .collect();
        let normals: Vec<Vec3> = (0..3000)
            .map(|_| {
                let [x, y, z, _] = rng.next_4();
                (Vec3::new(x, y, z) - 0.5).normalize_or(Vec3::Z)
            })
            .collect();
        let index = NearestPoints::new(points.clone(), normals.clone(), Metric::Facing);
        let plain = NearestPoints::new(points.clone(), normals.clone(), Metric::Plain);
        let groups: Vec<Range<usize>> = (0..300).map(|g| g * 10..g * 10 + 10).collect();
        let grouped = NearestPoints::new(points.clone(), normals.clone(), Metric::Facing).within_groups(&groups);
        for _ in 0..500 {
            let [x, y, z, w] = rng.next_4();
            let (p, f) = (Vec3::new(x * 6.0 - 0.5, y * 4.0 - 0.5, z * 2.0 - 0.5), (w * 6.0) as usize);
            let cell = ((p - index.lo) * index.per_cell).to_array();
            let cell: [usize; 3] = std::array::from_fn(|i| (cell[i] as usize).min(index.cells[i] - 1));
            let middle = index.lo + Vec3::from(cell.map(|c| c as f32 + 0.5)) / index.per_cell;
            let mut by_distance: Vec<usize> = (0..3000).collect();
            by_distance.sort_by(|&a, &b| {
                let d = |i: usize| middle.distance_squared(points[i]);
                d(a).total_cmp(&d(b)).then(a.cmp(&b))
            });
            assert_eq!(plain.find(p, direction(f)).collect::<Vec<_>>(), by_distance[..MAX_NEIGHBORS]);
            let all: Vec<usize> = by_distance.into_iter().filter(|&i| normals[i].dot(direction(f)) > 0.2).collect();
            let of_group: Vec<usize> =
                all.iter().copied().filter(|i| i / 10 == all[0] / 10).take(MAX_NEIGHBORS).collect();
            for _ in 0..2 {
                assert_eq!(index.find(p, direction(f)).collect::<Vec<_>>(), all[..MAX_NEIGHBORS]);
                assert_eq!(grouped.find(p, direction(f)).collect::<Vec<_>>(), of_group);
            }
        }
    }

    #[test]
    fn few_points_or_none() {
        let none = NearestPoints::new(vec![], vec![], Metric::Facing);
        assert_eq!(none.find(Vec3::ONE, Vec3::X).count(), 0);
        let one = NearestPoints::new(vec![Vec3::ONE], vec![Vec3::Y], Metric::Facing);
        assert_eq!(one.find(Vec3::splat(f32::NAN), Vec3::Y).collect::<Vec<_>>(), [0]);
        assert_eq!(one.find(Vec3::splat(1e9), Vec3::NEG_Y).count(), 0);
        assert_eq!(one.find(Vec3::ONE, Vec3::ZERO).count(), 0);
    }

    #[test]
    fn points_in_media_find_each_other_alone() {
        let points: Vec<Vec3> = (0..8).map(|i| Vec3::X * i as f32).collect();
        let normals = vec![Vec3::Y, Vec3::ZERO, Vec3::Y, Vec3::ZERO, Vec3::ZERO, Vec3::Y, Vec3::ZERO, Vec3::Y];
        let index = NearestPoints::new(points.clone(), normals.clone(), Metric::Facing);
        assert_eq!(index.find(Vec3::ZERO, Vec3::ZERO).collect::<Vec<_>>(), [1, 3, 4]);
        assert_eq!(index.find(Vec3::ZERO, Vec3::Y).collect::<Vec<_>>(), [0, 2, 5]);
        assert_eq!(index.find(Vec3::ZERO, Vec3::X).count(), 0);
        let plain = NearestPoints::new(points, normals, Metric::Plain);
        assert_eq!(plain.find(Vec3::ZERO, Vec3::ZERO).collect::<Vec<_>>(), [0, 1, 2]);
    }
}
