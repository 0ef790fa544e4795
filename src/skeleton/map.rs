//! From any point to its node in constant time: every empty cube knows the node that is nearest to it through empty
//! space.
//!
//! Distances count steps to the 26 neighbours with 3 over a face, 4 over an edge and 5 over a corner (Borgefors 1986),
//! close to three times the Euclidean length. Whole numbers make ties exact; they go to the node with the smaller
//! number. Since solid surfaces are closed against steps over corners, no cube gets a node on the other side of a wall;
//! only pockets without any node, which the filter leaves, take that of their neighbours.

use super::voxels::{OFFSETS, VoxelGrid};
use crate::math::Vec3;

/// How far from a surface its cube is looked up, in cubes. The surface's own cube is solid, and so may be the next.
const STEPS_OFF: [f32; 3] = [0.75, 1.5, 2.5];
/// Longest step.
const LONGEST: usize = 5;

/// Length of a step to a neighbour.
pub fn step_length(offset: [isize; 3]) -> u32 {
    2 + offset.iter().filter(|c| **c != 0).count() as u32
}

/// One number for each cube, as small as they allow; the largest means none.
#[derive(Debug)]
enum Labels {
    Short(Vec<u16>),
    Long(Vec<u32>),
}

/// Cubes and their nodes.
#[derive(Debug)]
pub struct NodeMap {
    lo: Vec3,
    cell: f32,
    dims: [usize; 3],
    labels: Labels,
}

impl NodeMap {
    /// Spreads the nodes, which stand in the cubes `nodes`, through the empty cubes of `space`, and then to all other
    /// empty cubes of `grid`, the same or a grid with more of them.
    pub fn new(grid: &VoxelGrid, space: &VoxelGrid, nodes: &[usize]) -> NodeMap {
        let (_, mut labels) = spread(space, nodes);
        fill_pockets(grid, &mut labels);
        let labels = if nodes.len() < usize::from(u16::MAX) {
            Labels::Short(labels.into_iter().map(|k| u16::try_from(k).unwrap_or(u16::MAX)).collect())
        } else {
            Labels::Long(labels)
        };
        NodeMap { lo: grid.lo, cell: grid.cell, dims: grid.dims, labels }
    }

    /// Cubes along x, y, z.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Side of a cube in scene units.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// Bytes of the labels.
    pub fn bytes(&self) -> usize {
        match &self.labels {
            Labels::Short(labels) => size_of_val(labels.as_slice()),
            Labels::Long(labels) => size_of_val(labels.as_slice()),
        }
    }

    /// The node of the cube at `at`, in cubes from the corner.
    #[inline]
    fn label(&self, at: Vec3) -> Option<usize> {
        let inside = at.cmpge(Vec3::ZERO).all() && at.cmplt(Vec3::from(self.dims.map(|d| d as f32))).all();
        if !inside {
            return None;
        }
        let i = at.x as usize + self.dims[0] * (at.y as usize + self.dims[1] * at.z as usize);
        match &self.labels {
            Labels::Short(labels) => labels.get(i).filter(|&&k| k != u16::MAX).map(|&k| k.into()),
            Labels::Long(labels) => labels.get(i).filter(|&&k| k != u32::MAX).map(|&k| k as usize),
        }
    }

    /// The node for the point `p` of a surface seen from the side of the unit vector `normal` (zero for a point in the
    /// air).
    #[inline]
    pub fn node_of(&self, p: Vec3, normal: Vec3) -> Option<usize> {
        let at = (p - self.lo) / self.cell;
        STEPS_OFF.iter().find_map(|&s| self.label(at + normal * s)).or_else(|| self.near(at, normal))
    }

    /// The nearest of the cubes around that has a node: of the 26 neighbours, or else of those one further out.
    /// Nearness is counted from off the surface.
    #[cold]
    fn near(&self, at: Vec3, normal: Vec3) -> Option<usize> {
        [1.0, 2.0].into_iter().find_map(|scale| {
            let mut best: Option<(f32, usize)> = None;
            for offset in OFFSETS {
                let cube = at.floor() + Vec3::from(offset.map(|c| c as f32)) * scale;
                let distance = (cube + 0.5 - at - normal).length_squared();
                if best.is_none_or(|(d, _)| distance < d)
                    && let Some(node) = self.label(cube)
                {
                    best = Some((distance, node));
                }
            }
            best.map(|(_, node)| node)
        })
    }
}

/// Distance to and number of the nearest node for every empty cube; the largest numbers where there is none.
fn spread(grid: &VoxelGrid, nodes: &[usize]) -> (Vec<u32>, Vec<u32>) {
    let mut distances = vec![u32::MAX; grid.len()];
    let mut labels = vec![u32::MAX; grid.len()];
    let mut seeds = Vec::new();
    for (&i, k) in nodes.iter().zip(0..) {
        if !grid.solid[i] {
            (distances[i], labels[i]) = (0, k);
            seeds.push(i);
        }
    }
    flow(grid, seeds, &mut distances, &mut labels, |i| !grid.solid[i]);
    (distances, labels)
}

/// Gives the empty cubes that no node reaches (pockets behind a cushion, in a plant) to the node nearest to them
/// through solid cubes. `labels` as [`spread`] leaves them.
fn fill_pockets(grid: &VoxelGrid, labels: &mut [u32]) {
    let reached: Vec<usize> = (0..grid.len()).filter(|&i| labels[i] != u32::MAX).collect();
    let unreached = |labels: &[u32], i: usize| labels[i] == u32::MAX;
    if !(0..grid.len()).any(|i| !grid.solid[i] && unreached(labels, i)) {
        return;
    }
    let mut distances = vec![u32::MAX; grid.len()];
    for &i in &reached {
        distances[i] = 0;
    }
    flow(grid, reached, &mut distances, labels, |i| !grid.is_rim(grid.place(i)));
    for (label, _) in labels.iter_mut().zip(&grid.solid).filter(|(_, solid)| **solid) {
        *label = u32::MAX;
    }
}

/// Lets labels flow from the `seeds`, whose distance is zero, through the cubes that are `open`. Dijkstra's algorithm
/// with a ring of lists, one for each distance that may be waiting (Dial 1969).
fn flow(grid: &VoxelGrid, seeds: Vec<usize>, distances: &mut [u32], labels: &mut [u32], open: impl Fn(usize) -> bool) {
    let steps: Vec<(isize, u32)> = grid.steps().into_iter().zip(OFFSETS.map(step_length)).collect();
    let mut waiting = seeds.len();
    let mut lists: [Vec<usize>; LONGEST + 1] = Default::default();
    lists[0] = seeds;
    let mut distance = 0;
    while waiting > 0 {
        let list = std::mem::take(&mut lists[distance as usize % (LONGEST + 1)]);
        waiting -= list.len();
        for i in list {
            // Settled nearer already.
            if distances[i] != distance {
                continue;
            }
            for &(step, length) in &steps {
                let n = i.wrapping_add_signed(step);
                let offer = distance + length;
                if offer > distances[n] || !open(n) {
                    continue;
                }
                if offer < distances[n] {
                    (distances[n], labels[n]) = (offer, labels[i]);
                    lists[offer as usize % (LONGEST + 1)].push(n);
                    waiting += 1;
                } else {
                    // Every cube that is nearer to a node has its final label by now: lengths are positive.
                    labels[n] = labels[n].min(labels[i]);
                }
            }
        }
        distance += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    /// Distances from one cube, by trying again until nothing changes.
    fn from_one(grid: &VoxelGrid, start: usize) -> Vec<u32> {
        let mut d = vec![u32::MAX; grid.len()];
        d[start] = 0;
        loop {
            let before = d.clone();
            for i in (0..grid.len()).filter(|&i| !grid.solid[i]) {
                for (step, offset) in grid.steps().into_iter().zip(OFFSETS) {
                    d[i] = d[i].min(d[i.wrapping_add_signed(step)].saturating_add(step_length(offset)));
                }
            }
            if d == before {
                return d;
            }
        }
    }

    #[test]
    fn distances_in_mazes_are_those_of_brute_force_and_ties_go_to_the_first() {
        for seed in 0..4 {
            let mut rng = HashRng::new(seed, 0, 0, 0);
            let random: Vec<bool> = (0..12 * 11 * 10).map(|_| rng.next_f32() < 0.55).collect();
            let grid = VoxelGrid::of([12, 11, 10], |[x, y, z]| random[x + 12 * (y + 11 * z)]);
            let empty: Vec<usize> = (0..grid.len()).filter(|&i| !grid.solid[i]).collect();
            let nodes: Vec<usize> = (0..7).map(|_| empty[(rng.next_f32() * empty.len() as f32) as usize]).collect();
            let single: Vec<Vec<u32>> = nodes.iter().map(|&n| from_one(&grid, n)).collect();
            let (distances, labels) = spread(&grid, &nodes);
            for &i in &empty {
                let best = single.iter().map(|d| d[i]).min().unwrap();
                assert_eq!(distances[i], best);
                if best < u32::MAX {
                    // Two nodes may stand in one cube: the last then has it.
                    let node = nodes[labels[i] as usize];
                    let first = nodes[single.iter().position(|d| d[i] == best).unwrap()];
                    assert_eq!(node, first);
                } else {
                    assert_eq!(labels[i], u32::MAX);
                }
            }
        }
    }

    #[test]
    fn pockets_take_the_node_of_their_neighbours() {
        // A node in the large room; the small one beyond the wall, and a crack in the far wall, have none.
        let grid = VoxelGrid::of([20, 9, 9], |[x, y, _]| x == 12 || (x > 15 && !(x == 17 && y == 4)));
        let map = NodeMap::new(&grid, &grid, &[grid.index([5, 4, 4])]);
        for i in (0..grid.len()).filter(|&i| !grid.is_rim(grid.place(i))) {
            let node = map.label(Vec3::from(grid.place(i).map(|c| c as f32)));
            assert_eq!(node, (!grid.solid[i]).then_some(0));
        }
    }

    #[test]
    fn points_on_walls_belong_to_the_room_they_face() {
        // A wall two cubes thick between two rooms.
        let grid = VoxelGrid::of([24, 12, 12], |[x, ..]| x == 11 || x == 12);
        let nodes = [grid.index([5, 5, 5]), grid.index([18, 5, 5])];
        let map = NodeMap::new(&grid, &grid, &nodes);
        let wall = |x: f32, nx: f32| map.node_of(Vec3::new(x, 6.0, 6.0), Vec3::X * nx);
        assert_eq!((wall(11.5, -1.0), wall(12.5, 1.0)), (Some(0), Some(1)));
        // Seen from the far surface, the way out is longer.
        assert_eq!((wall(12.4, -1.0), wall(11.6, 1.0)), (Some(0), Some(1)));
        // In the air; outside; not a number.
        assert_eq!(map.node_of(Vec3::splat(4.0), Vec3::ZERO), Some(0));
        assert_eq!(map.node_of(Vec3::splat(-40.0), Vec3::X), None);
        assert_eq!(map.node_of(Vec3::NAN, Vec3::X), None);
        // A surface that faces out of the grid falls back on what is near.
        assert_eq!(map.node_of(Vec3::new(0.9, 1.5, 1.5), -Vec3::X), Some(0));
        assert_eq!(map.bytes(), 2 * grid.len());
    }
}
