//! The skeleton of empty space: few nodes in the middle of rooms and passages, and a map from any point to its node.
//!
//! Visibility from a node is much like visibility from the surfaces around it, so that knowledge about visibility
//! can be kept at nodes and shared by all points that belong to them (Noël and Biri 2015). Steps of the construction:
//! [`voxels`] makes the scene solid cubes, [`reachable_space`] fills parts that no path reaches, [`distance`] computes
//! each empty cube's distance to solid ones, [`thinning`] reduces empty space to curves, [`graph`] selects few nodes on
//! them, [`map`] assigns a node to every empty cube.

pub mod distance;
pub mod floating_components;
pub mod graph;
pub mod map;
pub mod reachable_space;
pub mod simple;
pub mod thinning;
pub mod voxels;

pub use reachable_space::Places;
pub use voxels::VoxelGrid;

use crate::math::Vec3;
use crate::prepared::PreparedScene;
use crate::ray::Geometry;
use map::NodeMap;

/// Cubes along the longest side of a scene, unless told otherwise; see also [`VoxelGrid::suggested_cells`].
pub const DEFAULT_CELLS: usize = 120;

/// A place in the middle of empty space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Position, in the space of the prepared scene.
    pub position: Vec3,
    /// Radius of the largest empty ball around it, in scene units: the distance to the middle of the nearest solid
    /// cube.
    pub radius: f32,
}

/// Nodes, which of them are neighbours, and which parts of space are theirs.
#[derive(Debug)]
pub struct Skeleton {
    /// Nodes, largest ball first.
    pub nodes: Vec<Node>,
    /// Pairs of neighbouring nodes, the smaller number first, sorted.
    pub edges: Vec<[u32; 2]>,
    /// Cubes on the curves before the filtering: the nodes that there were.
    pub unfiltered: usize,
    map: NodeMap,
}

impl Skeleton {
    /// The skeleton of the empty space of `scene`: of the parts that hold the camera, what it sees, or a light, and
    /// without far surroundings ([`reachable_space`]). `cells`: cubes along the longest side; if not given,
    /// [`DEFAULT_CELLS`], or more for flat scenes ([`VoxelGrid::suggested_cells`]). Empty if there is nothing, or
    /// nothing empty. The same for any number of threads.
    pub fn of_scene(scene: &PreparedScene, cells: Option<usize>) -> Skeleton {
        let places = reachable_space::places(scene);
        let Some(bounds) = scene.geometry.bounds() else { return Skeleton::of(&scene.geometry, DEFAULT_CELLS) };
        let region = reachable_space::region(bounds, &places);
        let cells = cells.unwrap_or_else(|| VoxelGrid::suggested_cells(region, DEFAULT_CELLS));
        Skeleton::of_grid(&VoxelGrid::of_region(&scene.geometry, region, cells), &places)
    }

    /// The skeleton of all that `geometry` leaves empty, cavities included.
    pub fn of(geometry: &Geometry, cells: usize) -> Skeleton {
        Skeleton::of_grid(&VoxelGrid::of_geometry(geometry, cells), &Places::default())
    }

    /// The skeleton of the empty cubes of `grid`, whose outermost layer must be solid: of the parts that hold one of
    /// `places`, or of all if none does.
    pub fn of_grid(grid: &VoxelGrid, places: &Places) -> Skeleton {
        let space = reachable_space::closed_off(grid, places);
        let squared = distance::squared_distances(&space);
        let curve = thinning::curves(&space, &squared);
        let graph = graph::filtered(&space, &squared, &curve);
        let map = NodeMap::new(grid, &space, &graph.cubes);
        Skeleton { nodes: graph.nodes, edges: graph.edges, unfiltered: curve.len(), map }
    }

    /// The node that the point `p` of a surface belongs to, seen from the side to which the unit vector `normal`
    /// points; a zero `normal` for a point that is on no surface. Constant time. `None` where no empty space with a
    /// node is near.
    #[inline]
    pub fn node_of(&self, p: Vec3, normal: Vec3) -> Option<usize> {
        self.map.node_of(p, normal)
    }

    /// Cubes of the grid along x, y, z, and the side of one in scene units.
    pub fn resolution(&self) -> ([usize; 3], f32) {
        (self.map.dims(), self.map.cell())
    }

    /// Bytes of the map from cubes to nodes.
    pub fn map_bytes(&self) -> usize {
        self.map.bytes()
    }

    /// Bytes of everything.
    pub fn bytes(&self) -> usize {
        self.map_bytes() + size_of_val(self.nodes.as_slice()) + size_of_val(self.edges.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    #[test]
    fn two_rooms_have_two_skeletons_and_every_empty_cube_a_node_of_its_own() {
        let grid = VoxelGrid::of([40, 16, 13], |[x, y, _]| x == 20 || (x < 20 && y == 8 && x != 6));
        let skeleton = Skeleton::of_grid(&grid, &Places::default());
        for i in (0..grid.len()).filter(|&i| !grid.solid[i]) {
            let node = skeleton.node_of(grid.centre(i), Vec3::ZERO).unwrap();
            assert_eq!(grid.centre(i).x < 20.0, skeleton.nodes[node].position.x < 20.0);
        }
        let across = |e: &&[u32; 2]| e.map(|k| skeleton.nodes[k as usize].position.x < 20.0) == [true, false];
        assert_eq!(skeleton.edges.iter().find(across), None);
        assert!(skeleton.nodes.len() >= 3 && skeleton.nodes.len() < 12, "{}", skeleton.nodes.len());
        assert!(skeleton.nodes.len() < skeleton.unfiltered);
        assert!(skeleton.bytes() > skeleton.map_bytes());
    }

    #[test]
    fn a_room_that_nobody_visits_has_no_nodes_and_takes_those_nearby() {
        let grid = VoxelGrid::of([40, 16, 13], |[x, ..]| x == 20);
        let skeleton = Skeleton::of_grid(&grid, &Places { ends: vec![(Vec3::splat(6.0), Vec3::ZERO)], seen: vec![] });
        assert!(!skeleton.nodes.is_empty() && skeleton.nodes.iter().all(|n| n.position.x < 20.0));
        for i in (0..grid.len()).filter(|&i| !grid.solid[i]) {
            assert!(skeleton.node_of(grid.centre(i), Vec3::ZERO).is_some());
        }
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let grid = VoxelGrid::of([40, 30, 25], |[x, y, z]| (x * 7 + y * 5 + z * 3) % 41 == 0 || (x == 20 && y > 4));
        let with = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            format!("{:?}", pool.install(|| Skeleton::of_grid(&grid, &Places::default())))
        };
        assert!(with(1) == with(3));
    }

    #[test]
    fn every_empty_cube_has_a_node_whatever_the_scene() {
        for seed in 0..6 {
            let mut rng = HashRng::new(seed, 0, 0, 0);
            // Few solid cubes; or so many that no space is wide.
            let share = [0.003, 0.5, 0.7][seed as usize % 3];
            let random: Vec<bool> = (0..20 * 21 * 22).map(|_| rng.next_f32() < share).collect();
            let grid = VoxelGrid::of([20, 21, 22], |[x, y, z]| random[x + 20 * (y + 21 * z)]);
            let skeleton = Skeleton::of_grid(&grid, &Places::default());
            for i in (0..grid.len()).filter(|&i| !grid.solid[i]) {
                assert!(skeleton.node_of(grid.centre(i), Vec3::ZERO).is_some_and(|n| n < skeleton.nodes.len()));
            }
        }
    }

    #[test]
    fn no_empty_space_is_an_empty_skeleton() {
        for skeleton in [
            Skeleton::of(&Geometry::default(), 120),
            Skeleton::of_grid(&VoxelGrid::of([8, 8, 8], |_| true), &Places::default()),
        ] {
            assert!(skeleton.nodes.is_empty() && skeleton.edges.is_empty());
            assert_eq!(skeleton.node_of(Vec3::ZERO, Vec3::Z), None);
        }
    }
}
