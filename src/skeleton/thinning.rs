//! Thinning: empty space shrinks, layer by layer, to curves in its middle.
//!
//! Cubes go in the order of their distance to what is solid, so that what is left is centred; only simple cubes go, so
//! that every room stays in one piece and every way around something stays a loop; and a cube that holds two parts
//! together when its turn comes (an *isthmus* of dimension one, Bertrand and Couprie 2014) stays for ever, so that
//! curves are left and not points. Sheets are not kept: they are eaten from their borders until they are curves as
//! well. Nor are isthmuses in gaps a cube or two wide: curves run through them only where they lead somewhere.
//!
//! One pass takes one layer of cubes: those that are simple when it begins. They are removed in eight turns, each of
//! cubes whose coordinates have the same parities. Two of those never touch, so that a turn is decided in parallel and
//! its result does not depend on any order.

use super::floating_components::bridge;
use super::simple::{CENTRE, is_border, is_simple, pieces};
use super::voxels::VoxelGrid;
use rayon::prelude::*;

/// Layers for each cube of distance. Finer layers would see the steps of slanted walls as ridges.
const LAYERS_PER_CUBE: f64 = 1.0;
/// Squared distance to what is solid from which isthmuses are kept: that of the middle of a passage three cubes wide.
pub const WIDE: u32 = 4;
/// Cubes that one thread takes at a time.
const CHUNK: usize = 2048;

/// Cubes of the curves, in ascending order of their numbers. `squared` are the squared distances to what is solid, in
/// cubes.
pub fn curves(grid: &VoxelGrid, squared: &[u32]) -> Vec<usize> {
    let mut object = bridge(grid, squared);
    let layers: Vec<u16> = squared.iter().map(|&d| (f64::from(d).sqrt() * LAYERS_PER_CUBE).floor() as u16).collect();
    thin(grid, &mut object, &layers, |i| squared[i] >= WIDE);
    (0..object.len()).filter(|&i| object[i]).collect()
}

/// Takes cubes away from `object`, lower layers first; isthmuses for which `keeps` holds stay, and are returned.
/// Nothing of `object` may be in the rim of the grid.
fn thin(grid: &VoxelGrid, object: &mut [bool], layers: &[u16], keeps: impl Fn(usize) -> bool + Sync) -> Vec<bool> {
    let around = Around::new(grid);
    let mut by_layer: Vec<Vec<usize>> = Vec::new();
    for (i, _) in object.iter().enumerate().filter(|(_, is)| **is) {
        let layer = usize::from(layers[i]);
        if by_layer.len() <= layer {
            by_layer.resize(layer + 1, Vec::new());
        }
        by_layer[layer].push(i);
    }
    let mut kept = vec![false; object.len()];
    for (layer, mut cubes) in by_layer.into_iter().enumerate() {
        while !cubes.is_empty() {
            let removed = pass(&around, object, &mut kept, &keeps, &cubes);
            // Only next to where something went can anything have changed. Cubes of later layers wait for their turn.
            cubes = removed.iter().flat_map(|&i| around.steps.iter().map(move |s| i.wrapping_add_signed(*s))).collect();
            cubes.retain(|&i| object[i] && !kept[i] && usize::from(layers[i]) <= layer);
            cubes.par_sort_unstable();
            cubes.dedup();
        }
    }
    tidy(&around, object, &kept);
    kept
}

/// Neighbourhood of a cube.
struct Around {
    steps: [isize; 26],
    width: usize,
    layer: usize,
}

impl Around {
    fn new(grid: &VoxelGrid) -> Around {
        Around { steps: grid.steps(), width: grid.dims[0], layer: grid.dims[0] * grid.dims[1] }
    }

    /// Neighbourhood of cube `i` in 27 bits, for [`is_simple`].
    #[inline]
    fn mask(&self, object: &[bool], i: usize) -> u32 {
        let mut mask = 0;
        for z in 0..3 {
            for y in 0..3 {
                let first = i + z * self.layer + y * self.width - self.layer - self.width - 1;
                if let [a, b, c] = object[first..first + 3] {
                    mask |= (u32::from(a) | u32::from(b) << 1 | u32::from(c) << 2) << (9 * z + 3 * y);
                }
            }
        }
        mask | CENTRE
    }

    /// Which of eight turns cube `i` has.
    #[inline]
    fn turn(&self, i: usize) -> usize {
        i % self.width % 2 + 2 * (i / self.width % (self.layer / self.width) % 2) + 4 * (i / self.layer % 2)
    }

    /// Removes those of `cubes` that are simple when their turn comes and for which `wanted` holds, and returns them.
    fn remove(&self, object: &mut [bool], cubes: &[usize], wanted: impl Fn(u32) -> bool + Sync) -> Vec<usize> {
        let mut turns: [Vec<usize>; 8] = Default::default();
        for &i in cubes {
            turns[self.turn(i)].push(i);
        }
        let mut removed = Vec::new();
        for turn in turns {
            let seen: &[bool] = object;
            let goes = |i: &usize| {
                let mask = self.mask(seen, *i);
                wanted(mask) && is_simple(mask)
            };
            let gone: Vec<usize> = turn.into_par_iter().with_min_len(CHUNK).filter(goes).collect();
            for &i in &gone {
                object[i] = false;
            }
            removed.extend(gone);
        }
        removed
    }
}

/// One pass over `cubes`: notes isthmuses in `kept`, removes what is simple now and when its turn comes. Returns what
/// went.
fn pass(
    around: &Around,
    object: &mut [bool],
    kept: &mut [bool],
    keeps: &(impl Fn(usize) -> bool + Sync),
    cubes: &[usize],
) -> Vec<usize> {
    let seen: &[bool] = object;
    let judge = |&i: &usize| {
        let mask = around.mask(seen, i);
        // Most cubes are inside, where neither can be.
        let border = is_border(mask);
        (i, border && is_simple(mask), border && keeps(i) && pieces(mask) > 1)
    };
    let judged: Vec<(usize, bool, bool)> = cubes.par_iter().with_min_len(CHUNK).map(judge).collect();
    for &(i, _, isthmus) in &judged {
        kept[i] |= isthmus;
    }
    let simple: Vec<usize> = judged.into_iter().filter(|(_, simple, _)| *simple).map(|(i, ..)| i).collect();
    around.remove(object, &simple, |_| true)
}

/// Isthmuses may lie side by side: those that are no isthmuses any more go, but not from the ends of curves.
fn tidy(around: &Around, object: &mut [bool], kept: &[bool]) {
    loop {
        let cubes: Vec<usize> = (0..object.len()).filter(|&i| object[i] && kept[i]).collect();
        let is_end = |mask: u32| (mask & !CENTRE).count_ones() == 1;
        if around.remove(object, &cubes, |mask| !is_end(mask)).is_empty() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::distance::squared_distances;
    use super::*;
    use crate::math::hash::HashRng;

    fn layers_of(squared: &[u32]) -> Vec<u16> {
        squared.iter().map(|&d| f64::from(d).sqrt() as u16).collect()
    }

    /// Invariants of thinning: pieces of the object (26 neighbours), pieces of the background (6), Euler
    /// characteristic.
    fn topology(grid: &VoxelGrid, object: &[bool]) -> (usize, usize, i64) {
        let count = |of: bool, axes: i64| {
            let mut seen = vec![false; object.len()];
            let (mut count, mut stack) = (0, Vec::new());
            for start in 0..object.len() {
                if object[start] != of || seen[start] {
                    continue;
                }
                count += 1;
                seen[start] = true;
                stack.push(start);
                while let Some(i) = stack.pop() {
                    for offset in super::super::voxels::OFFSETS {
                        let at: [isize; 3] = std::array::from_fn(|c| grid.place(i)[c] as isize + offset[c]);
                        let inside = (0..3).all(|c| at[c] >= 0 && at[c] < grid.dims[c] as isize);
                        let n = grid.index(at.map(|c| c as usize % 1000));
                        if inside
                            && offset.iter().map(|c| c.abs() as i64).sum::<i64>() <= axes
                            && object[n] == of
                            && !seen[n]
                        {
                            seen[n] = true;
                            stack.push(n);
                        }
                    }
                }
            }
            count
        };
        // Corners, edges and faces of the cubes, each counted once: places on a lattice twice as fine.
        let mut cells = std::collections::HashSet::new();
        for i in (0..object.len()).filter(|&i| object[i]) {
            let at = grid.place(i).map(|c| 2 * c + 1);
            for offset in super::super::voxels::OFFSETS.into_iter().chain([[0; 3]]) {
                cells.insert([0, 1, 2].map(|c| at[c].wrapping_add_signed(offset[c])));
            }
        }
        let sign = |c: &[usize; 3]| if c.iter().filter(|v| *v % 2 == 1).count() % 2 == 0 { 1 } else { -1 };
        (count(true, 3), count(false, 1), cells.iter().map(sign).sum())
    }

    /// Thins the empty part of a grid without tying anything; checks what holds for every result.
    fn thinned(grid: &VoxelGrid, least: u32) -> Vec<bool> {
        let before: Vec<bool> = grid.solid.iter().map(|s| !s).collect();
        let mut object = before.clone();
        let squared = squared_distances(grid);
        let kept = thin(grid, &mut object, &layers_of(&squared), |i| squared[i] >= least);
        assert_eq!(topology(grid, &before), topology(grid, &object));
        let around = Around::new(grid);
        for i in (0..object.len()).filter(|&i| object[i]) {
            let mask = around.mask(&object, i);
            let end = (mask & !CENTRE).count_ones() == 1;
            assert!(before[i] && (!is_simple(mask) || kept[i] && end), "{:?} could go", grid.place(i));
        }
        object
    }

    fn has_block(grid: &VoxelGrid, object: &[bool]) -> bool {
        let [nx, ny, _] = grid.dims;
        let corners = [0, 1, nx, nx + 1].into_iter().flat_map(|k| [k, k + nx * ny]).collect::<Vec<_>>();
        (0..object.len()).any(|i| corners.iter().all(|k| object.get(i + k) == Some(&true)))
    }

    fn torus(at: [usize; 3], centre: [f32; 3], axes: [usize; 3], radii: [f32; 2]) -> bool {
        let d: [f32; 3] = std::array::from_fn(|c| at[c] as f32 - centre[c]);
        let ring = d[axes[0]].hypot(d[axes[1]]) - radii[0];
        ring.hypot(d[axes[2]]) < radii[1]
    }

    #[test]
    fn shapes_become_thin_curves_of_the_same_topology() {
        let count = |o: &[bool]| o.iter().filter(|o| **o).count();
        let grid = VoxelGrid::of([20, 14, 11], |_| false);
        let thin = thinned(&grid, WIDE);
        assert!((1..=10).contains(&count(&thin)), "a box: {}", count(&thin));

        let grid = VoxelGrid::of([30, 31, 13], |at| !torus(at, [14.5, 15.0, 6.0], [0, 1, 2], [9.0, 4.3]));
        let ring = thinned(&grid, WIDE);
        assert!((40..=70).contains(&count(&ring)), "a ring: {}", count(&ring));
        for at in (0..ring.len()).filter(|&i| ring[i]).map(|i| grid.place(i)) {
            assert!(torus(at, [14.5, 15.0, 6.0], [0, 1, 2], [9.0, 1.8]), "{at:?} is not in the middle of the ring");
        }

        let links = |at| {
            torus(at, [12.0, 12.0, 12.0], [0, 1, 2], [8.0, 2.6]) || torus(at, [20.0, 12.0, 12.0], [0, 2, 1], [8.0, 2.6])
        };
        let grid = VoxelGrid::of([36, 26, 26], |at| !links(at));
        let linked = thinned(&grid, WIDE);
        assert_eq!(topology(&grid, &linked), (2, 1, 0));
        for object in [thin, ring, linked] {
            let grid = [[20, 14, 11], [30, 31, 13], [36, 26, 26]];
            let dims = *grid.iter().find(|d| d.iter().product::<usize>() == object.len()).unwrap();
            assert!(!has_block(&VoxelGrid::of(dims, |_| false), &object));
        }
    }

    #[test]
    fn random_sets_keep_their_topology() {
        for seed in 0..12 {
            let mut rng = HashRng::new(seed, 0, 0, 0);
            let share = [0.02, 0.1, 0.3, 0.6][seed as usize % 4];
            let random: Vec<bool> = (0..16 * 15 * 14).map(|_| rng.next_f32() < share).collect();
            for least in [0, WIDE] {
                thinned(&VoxelGrid::of([16, 15, 14], |[x, y, z]| random[x + 16 * (y + 15 * z)]), least);
            }
        }
    }

    #[test]
    fn straight_tubes_have_straight_middles() {
        for axis in 0..3 {
            for (a, b) in [(1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (6, 7), (8, 8), (9, 9), (4, 9), (9, 4)] {
                let mut dims = [a + 2, b + 2, 0];
                dims[2] = 40;
                dims.rotate_right(axis);
                let grid = VoxelGrid::of(dims, |_| false);
                let (u, v, w) = (axis % 3, (axis + 1) % 3, (axis + 2) % 3);
                let squared = squared_distances(&grid);
                let curve: Vec<[usize; 3]> = curves(&grid, &squared).into_iter().map(|i| grid.place(i)).collect();
                let least = if a.min(b) < 3 { 1 } else { 34 - a.max(b) };
                assert!(curve.len() >= least && curve.len() <= 38, "{a} x {b}: {}", curve.len());
                for at in curve {
                    let off = |c: usize| (at[c] as f32 - (grid.dims[c] as f32 - 1.0) / 2.0).abs();
                    assert!(off(u) <= 1.0 && off(v) <= 1.0, "{a} x {b} along {w}: {at:?}");
                }
            }
        }
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let grid = VoxelGrid::of([50, 40, 30], |at| torus(at, [24.0, 20.0, 15.0], [0, 2, 1], [11.0, 4.0]));
        let squared = squared_distances(&grid);
        let with =
            |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| curves(&grid, &squared));
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn a_floating_thing_is_surrounded_by_curves() {
        // A cube in a room: without a thread, a closed sheet would be left.
        let grid = VoxelGrid::of([31, 31, 31], |at| at.iter().all(|c| (13..18).contains(c)));
        let left = curves(&grid, &squared_distances(&grid));
        assert!((1..=90).contains(&left.len()), "{}", left.len());
    }

    #[test]
    fn nothing_empty_gives_nothing() {
        for grid in [VoxelGrid::default(), VoxelGrid::of([9, 9, 9], |_| true), VoxelGrid::of([2, 1, 3], |_| false)] {
            assert!(curves(&grid, &squared_distances(&grid)).is_empty());
        }
    }
}
