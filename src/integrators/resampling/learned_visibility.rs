//! Visibility of light vertices from groups of cache points, learned over iterations, for the cut of the first stage.
//!
//! Space is divided into the cells of an octree. For every group and every cell, pairs of a cache point and a light
//! vertex in the cell are counted, and visible pairs: light of the vertex reaches the cache point. The cut of the first
//! stage then splits clusters where visible light is, and leaves those together that a wall hides. Only the division of
//! an iteration's vertices depends on these counts, which are of earlier iterations: every division is unbiased.
//!
//! The visible share of a cell is a mean of its own pairs and, counted for [`PRIOR`] pairs, the share of the cell
//! around it; the share of all space is one before anything is known.

use crate::math::Vec3;
use crate::spatial::light_tree::Aabb;
use crate::spatial::morton;
use serde::{Deserialize, Serialize};

/// Levels of the octree below its root.
const LEVELS: u32 = 3;
/// Pairs that the share of the cell around a cell counts for: those of one light vertex.
const PRIOR: f32 = 16.0;
/// Importance of clusters that were never seen, relative to those that always are: what was not seen may be seen later.
const UNSEEN: f32 = 0.05;

/// Cells of a level and all levels above.
const fn cells(level: u32) -> usize {
    ((1 << (3 * (level + 1))) - 1) / 7
}

/// The octree, a cube within which cells are told apart by Morton codes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Octree {
    /// Half of the length of the cube's sides; the origin is its centre.
    radius: f32,
}

/// A cell of the octree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    /// Level, 0 for the cube of the whole scene.
    level: u32,
    /// Morton code among the 8^level cells of the level.
    code: u32,
}

impl Cell {
    /// Number of the cell among the cells of all levels.
    #[inline]
    fn number(self) -> usize {
        self.level.checked_sub(1).map_or(0, cells) + self.code as usize
    }

    /// The cell itself and the cells around it, ever larger.
    #[inline]
    fn ancestry(self) -> impl Iterator<Item = Cell> {
        (0..=self.level).map(move |up| Cell { level: self.level - up, code: self.code >> (3 * up) })
    }
}

impl Octree {
    /// Around the ball of this radius around the origin.
    pub fn new(radius: f32) -> Octree {
        Octree { radius }
    }

    /// The smallest cell that holds a point; points outside belong to the nearest cells.
    #[inline]
    pub fn cell(&self, p: Vec3) -> Cell {
        let code = morton::code(p, Vec3::splat(-self.radius), Vec3::splat(self.radius));
        Cell { level: LEVELS, code: code >> (morton::BITS - 3 * LEVELS) }
    }

    /// The smallest cell that holds a box.
    #[inline]
    pub fn cell_around(&self, aabb: &Aabb) -> Cell {
        let (min, max) = (self.cell(aabb.min).code, self.cell(aabb.max).code);
        let up = (u32::BITS - (min ^ max).leading_zeros()).div_ceil(3);
        Cell { level: LEVELS - up, code: min >> (3 * up) }
    }
}

/// Pairs of a cache point of a group and a light vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Pairs {
    all: u32,
    /// Visible pairs.
    seen: u32,
}

/// Pairs of one group by the cell of the light vertex.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct SeenCells {
    /// By [`Cell::number`]; empty before the first pair.
    pairs: Vec<Pairs>,
}

impl SeenCells {
    /// Adds `all` pairs with a light vertex in `cell`, of which `seen` are visible.
    pub fn add(&mut self, cell: Cell, all: u32, seen: u32) {
        self.pairs.resize(cells(LEVELS), Pairs::default());
        for cell in cell.ancestry() {
            let pairs = &mut self.pairs[cell.number()];
            // Beyond what fits, nothing more is to be learnt.
            if let Some(sum) = pairs.all.checked_add(all) {
                *pairs = Pairs { all: sum, seen: pairs.seen + seen };
            }
        }
    }

    /// Estimated visible share of the pairs with light vertices in `cell`.
    #[inline]
    fn share(&self, cell: Cell) -> f32 {
        if self.pairs.is_empty() {
            return 1.0;
        }
        let mut around = [Pairs::default(); LEVELS as usize + 1];
        for cell in cell.ancestry() {
            around[cell.level as usize] = self.pairs[cell.number()];
        }
        let mean = |share: f32, p: &Pairs| (p.seen as f32 + PRIOR * share) / (p.all as f32 + PRIOR);
        around[..=cell.level as usize].iter().fold(1.0, mean)
    }

    /// Importance of splitting a cluster of light vertices in `cell`, at most one.
    #[inline]
    pub fn importance(&self, cell: Cell) -> f32 {
        UNSEEN + (1.0 - UNSEEN) * self.share(cell)
    }

    /// The counts are of all cells, or there are none yet: a saved state may be of something else.
    pub fn is_whole(&self) -> bool {
        [0, cells(LEVELS)].contains(&self.pairs.len()) && self.pairs.iter().all(|p| p.seen <= p.all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    const OCTREE: fn() -> Octree = || Octree::new(2.0);

    #[test]
    fn cells_have_numbers_of_their_own() {
        let mut numbers = std::collections::BTreeSet::new();
        for level in 0..=LEVELS {
            (0..1 << (3 * level)).for_each(|code| assert!(numbers.insert(Cell { level, code }.number())));
        }
        assert!(numbers.into_iter().eq(0..cells(LEVELS)));
    }

    #[test]
    fn the_cell_around_a_box_is_the_smallest_that_holds_its_corners() {
        let mut rng = HashRng::new(1, 2, 3, 4);
        let mut point = |size: f32| {
            let [x, y, z, _] = rng.next_4();
            (Vec3::new(x, y, z) - 0.5) * size
        };
        for i in 0..2000 {
            let (a, b) = (point(4.0), point([4.0, 1.0, 0.1][i % 3]));
            let aabb = Aabb::of([a, a + b]);
            let holding = OCTREE().cell_around(&aabb);
            let [p, q] = [a, a + b].map(|p| OCTREE().cell(p).ancestry().collect::<Vec<_>>());
            assert_eq!(p.iter().find(|cell| q.contains(cell)), Some(&holding));
        }
        assert_eq!(OCTREE().cell(Vec3::splat(f32::NAN)).code, 0);
        assert_eq!(OCTREE().cell(Vec3::splat(9.0)).code, (1 << (3 * LEVELS)) - 1);
    }

    #[test]
    fn shares_tend_to_what_was_seen_and_begin_with_the_cell_around() {
        let mut seen = SeenCells::default();
        let octree = OCTREE();
        let (a, b) = (octree.cell(Vec3::splat(-1.9)), octree.cell(Vec3::splat(-1.1)));
        assert_eq!(seen.importance(a), 1.0);
        for _ in 0..1000 {
            seen.add(a, 16, 12);
            seen.add(octree.cell(Vec3::splat(1.9)), 16, 0);
        }
        assert!((seen.share(a) - 0.75).abs() < 1e-3, "{}", seen.share(a));
        // Nothing is known of b, but of the cells around it.
        assert!((seen.share(b) - 0.75).abs() < 2e-2, "{}", seen.share(b));
        assert!((seen.importance(octree.cell(Vec3::splat(1.9))) - UNSEEN).abs() < 1e-3);
        let root = Cell { level: 0, code: 0 };
        assert!((seen.share(root) - 0.375).abs() < 1e-3);
        assert!(seen.is_whole());
    }
}
