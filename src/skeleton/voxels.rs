//! A scene as cubes: those that a surface passes through are solid, all others are empty space.
//!
//! The voxelisation is conservative: a cube is solid if a triangle touches it at all (separating axes, Akenine-Möller
//! 2001; columns along the triangle's main axis, after Schwarz and Seidel 2010), so that no path from neighbour to
//! neighbour, not even over the corners of cubes, passes through a surface. The outermost layer of cubes is solid as
//! well: an open scene ends there, as if the box around it were a room.

use crate::math::Vec3;
use crate::ray::{Geometry, RoundShape, SurfaceMask};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// How much larger a cube counts than it is, in cubes: more than single precision loses over the largest grid.
const INFLATION: f32 = 2e-3;
/// Most cubes along one side.
const MOST_ALONG: usize = 1024;
/// Triangles that one thread takes at a time.
const CHUNK: usize = 256;

/// Cubes side by side; number = x + width · (y + height · z).
#[derive(Clone, Debug, Default)]
pub struct VoxelGrid {
    /// Corner with the smallest coordinates, in scene units.
    pub lo: Vec3,
    /// Side of a cube in scene units.
    pub cell: f32,
    /// Cubes along x, y, z.
    pub dims: [usize; 3],
    /// Which cubes are solid.
    pub solid: Vec<bool>,
}

impl VoxelGrid {
    /// A grid with `dims` cubes of side 1 from the origin on; the outermost layer and what `solid` says is solid.
    pub fn of(dims: [usize; 3], solid: impl Fn([usize; 3]) -> bool) -> VoxelGrid {
        let mut grid = VoxelGrid { lo: Vec3::ZERO, cell: 1.0, dims, solid: vec![true; dims.iter().product()] };
        for i in 0..grid.solid.len() {
            let at = grid.place(i);
            grid.solid[i] = grid.is_rim(at) || solid(at);
        }
        grid
    }

    /// Voxelises everything that a ray can meet, with about `cells` cubes along the longest side; fewer where the grid
    /// would hold more than five sixths of `cells`³ cubes. No geometry gives a grid without cubes.
    pub fn of_geometry(geometry: &Geometry, cells: usize) -> VoxelGrid {
        geometry.bounds().map(|bounds| VoxelGrid::of_region(geometry, bounds, cells)).unwrap_or_default()
    }

    /// [`VoxelGrid::of_geometry`] for what is in the box from `lo` to `hi`.
    pub fn of_region(geometry: &Geometry, (lo, hi): (Vec3, Vec3), cells: usize) -> VoxelGrid {
        let Some(mut grid) = frame(lo, hi, cells) else { return VoxelGrid::default() };
        let count = grid.dims.iter().product();
        let marks: Vec<AtomicBool> = (0..count).map(|_| AtomicBool::new(false)).collect();
        geometry.for_each_placed_mesh(|mesh, _, to_world| {
            let buffers = &geometry.meshes[mesh as usize];
            // Interfaces are part of the empty space.
            if !buffers.surface.intersects(SurfaceMask::VISIBLE) {
                return;
            }
            buffers.triangles.par_iter().with_min_len(CHUNK).for_each(|corners| {
                let corners = corners.map(|i| {
                    let p = buffers.positions[i as usize];
                    (to_world.map_or(p, |m| m.transform_point3(p)) - grid.lo) / grid.cell
                });
                // Marks are only ever set: the result is the same in any order.
                mark_triangle(corners, grid.dims, |i| marks[i].store(true, Ordering::Relaxed));
            });
        });
        geometry.for_each_placed_round(|_, _, shape| {
            if shape.surface.intersects(SurfaceMask::VISIBLE) {
                mark_round(&grid, &shape, |i| marks[i].store(true, Ordering::Relaxed));
            }
        });
        grid.solid = marks.into_iter().map(AtomicBool::into_inner).collect();
        for i in 0..count {
            grid.solid[i] |= grid.is_rim(grid.place(i));
        }
        grid
    }

    /// A good number of `cells` for a box: `base`, or more where it is flat, as far as the grid then still is no larger
    /// than `base`³ / 2 cubes and `2 · base` long. Low buildings would be a few cubes high otherwise.
    pub fn suggested_cells((lo, hi): (Vec3, Vec3), base: usize) -> usize {
        let fits = |cells: usize| {
            frame(lo, hi, cells).is_some_and(|g| g.dims.iter().product::<usize>() <= base * base * base / 2)
        };
        (base..=2 * base).step_by((base / 20).max(1)).take_while(|&c| c == base || fits(c)).last().unwrap_or(base)
    }

    /// Cubes in all.
    pub fn len(&self) -> usize {
        self.solid.len()
    }

    /// True if there are no cubes at all.
    pub fn is_empty(&self) -> bool {
        self.solid.is_empty()
    }

    /// Number of the cube at `at`, which must be inside.
    #[inline]
    pub fn index(&self, at: [usize; 3]) -> usize {
        at[0] + self.dims[0] * (at[1] + self.dims[1] * at[2])
    }

    /// Column, row and layer of cube `i`.
    #[inline]
    pub fn place(&self, i: usize) -> [usize; 3] {
        [i % self.dims[0], i / self.dims[0] % self.dims[1], i / (self.dims[0] * self.dims[1])]
    }

    /// Middle of cube `i` in scene units.
    #[inline]
    pub fn centre(&self, i: usize) -> Vec3 {
        self.lo + (Vec3::from(self.place(i).map(|c| c as f32)) + 0.5) * self.cell
    }

    /// The cube that holds `p` (scene units); `None` outside.
    #[inline]
    pub fn cell_of(&self, p: Vec3) -> Option<usize> {
        let at = (p - self.lo) / self.cell;
        let inside = at.cmpge(Vec3::ZERO).all() && at.cmplt(Vec3::from(self.dims.map(|d| d as f32))).all();
        inside.then(|| self.index([at.x as usize, at.y as usize, at.z as usize]))
    }

    /// Is `at` in the outermost layer?
    pub fn is_rim(&self, at: [usize; 3]) -> bool {
        at.into_iter().zip(self.dims).any(|(c, n)| c == 0 || c + 1 == n)
    }

    /// Steps in numbers from a cube to its 26 neighbours, in the order of [`OFFSETS`]; valid for cubes that are not in
    /// the rim.
    pub fn steps(&self) -> [isize; 26] {
        let [nx, ny, _] = self.dims.map(|d| d as isize);
        OFFSETS.map(|[x, y, z]| x + nx * (y + ny * z))
    }
}

/// The 26 neighbours of a cube, in the order of their numbers.
pub const OFFSETS: [[isize; 3]; 26] = {
    let mut list = [[0; 3]; 26];
    let (mut k, mut n) = (0, 0);
    while k < 27 {
        if k != 13 {
            list[n] = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            n += 1;
        }
        k += 1;
    }
    list
};

/// A grid around a box, with one layer to spare. The faces of the longest side go through the middle of cubes: on the
/// border between two, they would make both solid.
fn frame(lo: Vec3, hi: Vec3, cells: usize) -> Option<VoxelGrid> {
    let size = hi - lo;
    let longest = size.max_element();
    if !(longest.is_finite() && longest > 0.0) {
        return None;
    }
    let cells = cells.clamp(4, MOST_ALONG);
    let most = cells * cells * cells / 6 * 5;
    let mut cell = longest / (cells - 1) as f32;
    loop {
        let dims = size.to_array().map(|s| (s / cell - 1e-3).ceil().max(0.0) as usize + 3);
        if dims.iter().product::<usize>() <= most.max(343) || dims.iter().all(|&d| d <= 7) {
            let lo = 0.5 * (lo + hi) - Vec3::from(dims.map(|d| d as f32)) * (0.5 * cell);
            return Some(VoxelGrid { lo, cell, dims, solid: Vec::new() });
        }
        cell *= 1.01;
    }
}

/// Calls `mark` for every cube that the round shape touches, and for some next to it.
fn mark_round(grid: &VoxelGrid, shape: &RoundShape, mut mark: impl FnMut(usize)) {
    let (lo, hi) = shape.bounds();
    let range = |axis: usize| {
        let cube = |x: f32, offset: f32| ((x - grid.lo[axis]) / grid.cell + offset).floor().max(0.0) as usize;
        (cube(lo[axis], -INFLATION), cube(hi[axis], INFLATION).min(grid.dims[axis] - 1))
    };
    let [(x0, x1), (y0, y1), (z0, z1)] = [0, 1, 2].map(range);
    // The ball around a cube.
    let radius = f64::from(grid.cell) * f64::from(0.5 + INFLATION) * 3f64.sqrt();
    for (z, y) in (z0..=z1).flat_map(|z| (y0..=y1).map(move |y| (z, y))) {
        for x in x0..=x1 {
            let centre = grid.lo + Vec3::new(x as f32 + 0.5, y as f32 + 0.5, z as f32 + 0.5) * grid.cell;
            if shape.may_touch_ball(centre.as_dvec3(), radius) {
                mark(x + grid.dims[0] * (y + grid.dims[1] * z));
            }
        }
    }
}

/// Calls `mark` for every cube that the triangle touches; `corners` in cubes from the grid's corner.
fn mark_triangle(corners: [Vec3; 3], dims: [usize; 3], mut mark: impl FnMut(usize)) {
    let half = 0.5 + INFLATION;
    let (lo, hi) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
    let range = |axis: usize, lo: f32, hi: f32| {
        let first = (lo - INFLATION).floor().max(0.0) as usize;
        (first, ((hi + INFLATION).floor().max(0.0) as usize).min(dims[axis] - 1))
    };
    // The plane in double precision: slivers are common, and the cross product of theirs is all rounding in single.
    let exact = corners.map(Vec3::as_dvec3);
    let normal = (exact[1] - exact[0]).cross(exact[2] - exact[0]);
    let w = normal.abs().max_position();
    let (u, v) = ((w + 1) % 3, (w + 2) % 3);
    // In a column along the main axis w, the plane stays within `reach` of where it crosses the middle.
    let slope = [normal[u] / normal[w], normal[v] / normal[w]];
    let reach = half * (slope[0].abs() + slope[1].abs()) as f32 + INFLATION;
    let ((u0, u1), (v0, v1)) = (range(u, lo[u], hi[u]), range(v, lo[v], hi[v]));
    for cv in v0..=v1 {
        for cu in u0..=u1 {
            let across = [cu as f64 + 0.5 - exact[0][u], cv as f64 + 0.5 - exact[0][v]];
            let middle = (exact[0][w] - across[0] * slope[0] - across[1] * slope[1]) as f32;
            // A triangle without area has no plane; the comparisons then leave the whole box.
            let (low, high) = if middle.is_finite() {
                (lo[w].max(middle - reach), hi[w].min(middle + reach))
            } else {
                (lo[w], hi[w])
            };
            let (w0, w1) = range(w, low, high);
            for cw in w0..=w1 {
                let mut at = [0; 3];
                (at[u], at[v], at[w]) = (cu, cv, cw);
                let centre = Vec3::from(at.map(|c| c as f32 + 0.5));
                if touches(corners.map(|c| c - centre), half) {
                    mark(at[0] + dims[0] * (at[1] + dims[1] * at[2]));
                }
            }
        }
    }
}

/// Does the triangle touch the cube around the origin? True if no axis separates them: three of the cube, the
/// triangle's normal, nine cross products of edges. An axis of length zero separates nothing.
fn touches(c: [Vec3; 3], half: f32) -> bool {
    let separates = |axis: Vec3| {
        let p = c.map(|c| c.dot(axis));
        let radius = half * axis.abs().element_sum();
        p[0].min(p[1]).min(p[2]) > radius || p[0].max(p[1]).max(p[2]) < -radius
    };
    let edges = [c[1] - c[0], c[2] - c[1], c[0] - c[2]];
    !([Vec3::X, Vec3::Y, Vec3::Z].into_iter().any(separates)
        || separates(edges[0].cross(edges[1]))
        || edges.into_iter().any(|e| {
            separates(Vec3::new(0.0, -e.z, e.y))
                || separates(Vec3::new(e.z, 0.0, -e.x))
                || separates(Vec3::new(-e.y, e.x, 0.0))
        }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;
    use crate::ray::{Instance, MeshBuffers, VertexBuffer};
    use glam::Affine3A;

    /// Random triangles, small and large, and some of them again as a turned and stretched instance.
    fn geometry(seed: u64) -> Geometry {
        let mut rng = HashRng::new(seed, 0, 0, 0);
        let mut point = |scale: f32| {
            let [x, y, z, _] = rng.next_4();
            (Vec3::new(x, y, z) - 0.5) * scale
        };
        let mut mesh = |n: usize| {
            let mut positions = Vec::new();
            for k in 0..n {
                let (at, scale) = (point(10.0), if k % 3 == 0 { 9.0 } else { 0.7 });
                positions.extend((0..3).map(|_| at + point(scale)));
            }
            // One that lies exactly on borders of cubes, and one without area.
            positions.extend([Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, Vec3::ONE, Vec3::ONE * 2.0, Vec3::ONE * 3.0]);
            let triangles = (0..n as u32 + 2).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            MeshBuffers { positions: VertexBuffer::new(positions), triangles, surface: SurfaceMask::BLOCKERS }
        };
        let meshes = vec![mesh(20), mesh(10)];
        let to_world = Affine3A::from_rotation_y(0.7) * Affine3A::from_scale(Vec3::new(1.0, 2.0, 0.5));
        let instances = vec![Instance { group: 0, to_world }];
        Geometry { meshes, world: vec![0], groups: vec![vec![1]], instances, ..Geometry::default() }
    }

    #[test]
    fn every_point_of_a_triangle_is_solid_and_far_cubes_are_not() {
        for seed in 0..4 {
            let geometry = geometry(seed);
            let grid = VoxelGrid::of_geometry(&geometry, 40);
            let mut near = vec![false; grid.len()];
            let mut rng = HashRng::new(seed, 1, 0, 0);
            geometry.for_each_placed_mesh(|mesh, _, to_world| {
                let mesh = &geometry.meshes[mesh as usize];
                for t in 0..mesh.triangles.len() as u32 {
                    let c = mesh.corners(t).map(|p| to_world.map_or(p, |m| m.transform_point3(p)));
                    let area = (c[1] - c[0]).cross(c[2] - c[0]).length() / (grid.cell * grid.cell);
                    let length = (c[0].distance(c[1]) + c[1].distance(c[2])) / grid.cell;
                    for _ in 0..100 + (40.0 * (area + length)) as usize {
                        let [u, v, ..] = rng.next_4();
                        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                        let cell = grid.cell_of(c[0] + (c[1] - c[0]) * u + (c[2] - c[0]) * v).unwrap();
                        assert!(grid.solid[cell]);
                        let at = grid.place(cell);
                        assert!(!grid.is_rim(at), "one layer to spare");
                        near[cell] = true;
                        for step in grid.steps() {
                            near[cell.wrapping_add_signed(step)] = true;
                        }
                    }
                }
            });
            for (i, near) in near.iter().enumerate() {
                assert!(*near || !grid.solid[i] || grid.is_rim(grid.place(i)), "{:?} is far from all", grid.place(i));
            }
        }
    }

    #[test]
    fn a_box_is_hollow_and_its_walls_are_one_cube_thick() {
        let p: Vec<Vec3> = (0..8u8).map(|k| Vec3::new((k & 1).into(), (k >> 1 & 1).into(), (k >> 2).into())).collect();
        let quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = MeshBuffers { positions: VertexBuffer::new(p), triangles, surface: SurfaceMask::BLOCKERS };
        let geometry = Geometry { meshes: vec![mesh], world: vec![0], ..Geometry::default() };
        let grid = VoxelGrid::of_geometry(&geometry, 12);
        assert!(grid.dims.iter().all(|&d| d == grid.dims[0]), "{:?}", grid.dims);
        assert_eq!(grid.solid.iter().filter(|&&s| !s).count(), (grid.dims[0] - 4).pow(3));
        for i in 0..grid.len() {
            assert_eq!(grid.cell_of(grid.centre(i)), Some(i));
        }
    }

    #[test]
    fn thin_flat_or_missing_scenes_have_sane_grids() {
        assert!(VoxelGrid::of_geometry(&Geometry::default(), 120).is_empty());
        let grid = frame(Vec3::ZERO, Vec3::new(1000.0, 0.001, 0.0), 120).unwrap();
        assert_eq!(grid.dims, [122, 3, 3]);
        let grid = frame(Vec3::ZERO, Vec3::ONE, 120).unwrap();
        assert!(grid.dims.iter().product::<usize>() * 2 <= 3_000_000);
        let flat = |h: f32| VoxelGrid::suggested_cells((Vec3::ZERO, Vec3::new(1.0, h, 1.0)), 120);
        assert_eq!((flat(1.0), flat(0.5), flat(0.001)), (120, 120, 240));
        assert!((150..240).contains(&flat(0.15)), "{}", flat(0.15));
        assert!(frame(Vec3::ZERO, Vec3::ZERO, 120).is_none());
        assert!(frame(Vec3::ZERO, Vec3::splat(f32::INFINITY), 120).is_none());
        assert!(frame(Vec3::ZERO, Vec3::splat(1e30), 0).is_some_and(|g| g.dims.iter().all(|&d| d <= 7)));
    }
}
