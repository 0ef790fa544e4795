//! The cells of a grid along a ray.
//!
//! In *index space* a sample with the indices (i, j, k) is at the point (i, j, k) if values are interpolated, and fills
//! the cell from there to (i + 1, j + 1, k + 1) if they are not. In both cases the grid's cells have integer corners:
//! inside of one the density along a ray is a cubic polynomial, or constant.

use crate::math::{DVec3, Vec3};
use crate::scene::{GridDesc, VolumeFilter, VolumeWrap};
use glam::{DMat3, IVec3};

/// Side in cells of the blocks that are skipped where nothing is in them.
const BLOCK: i32 = 8;

/// Where the samples of a grid are.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// World, relative to the scene's centre → index space: linear part and translation.
    linear: DMat3,
    translation: DVec3,
    pub filter: VolumeFilter,
    wrap: VolumeWrap,
    /// Samples along each axis.
    pub size: IVec3,
    /// Outermost cells: those beyond are as they are (`Clamp`), or do not exist (`Empty`).
    first: IVec3,
    last: IVec3,
}

/// A ray from `o` in the unit direction `d` between two distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    pub o: Vec3,
    pub d: Vec3,
    pub begin: f64,
    pub end: f64,
}

/// Samples of a cell along one axis: the lower and the upper one.
type Pair = [usize; 2];

/// The cell that a point is in, and its place in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub cell: [i32; 3],
    /// In [0, 1]³.
    pub inside: [f32; 3],
}

impl Lattice {
    /// The lattice of a grid; `centre` is that of the scene.
    pub(super) fn new(desc: &GridDesc, centre: DVec3) -> Lattice {
        let size = IVec3::from_array(desc.grid.size.map(|n| n as i32));
        let interpolated = desc.filter == VolumeFilter::Trilinear;
        let from_world = desc.to_world.inverse();
        let resolution = size.as_dvec3();
        let shift = if interpolated { 0.5 } else { 0.0 };
        let linear = DMat3::from_diagonal(resolution) * DMat3::from_mat4(from_world);
        let translation = from_world.transform_point3(centre) * resolution - shift;
        let (first, last) = match (interpolated, desc.wrap) {
            (false, _) => (IVec3::ZERO, size - 1),
            // No cell reaches beyond the outermost samples.
            (true, VolumeWrap::Empty) => (IVec3::ZERO, (size - 2).max(IVec3::ZERO)),
            (true, _) => (IVec3::NEG_ONE, size - 1),
        };
        Lattice { linear, translation, filter: desc.filter, wrap: desc.wrap, size, first, last }
    }

    fn is_endless(&self) -> bool {
        matches!(self.wrap, VolumeWrap::Repeat | VolumeWrap::Mirror)
    }

    fn position(&self, p: Vec3) -> DVec3 {
        self.linear * p.as_dvec3() + self.translation
    }

    /// The box in index space beyond which there is nothing (`Empty`).
    fn extent(&self) -> Option<[DVec3; 2]> {
        let samples = if self.filter == VolumeFilter::Trilinear { self.size - 1 } else { self.size };
        (self.wrap == VolumeWrap::Empty).then(|| [DVec3::ZERO, samples.as_dvec3()])
    }

    fn cell_of(&self, g: DVec3) -> IVec3 {
        // Conversions of numbers saturate.
        let cell = g.floor().as_ivec3();
        if self.is_endless() { cell } else { cell.clamp(self.first, self.last) }
    }

    /// Where a point of the world is; `None` where there is nothing.
    pub(super) fn place(&self, p: Vec3) -> Option<Place> {
        let g = self.position(p);
        if let Some([lower, upper]) = self.extent()
            && !(g.cmpge(lower).all() && g.cmple(upper).all())
        {
            return None;
        }
        let cell = self.cell_of(g);
        let inside = (g - cell.as_dvec3()).as_vec3().clamp(Vec3::ZERO, Vec3::ONE);
        Some(Place { cell: cell.to_array(), inside: inside.to_array() })
    }

    /// The sample that stands for the index `i` along the axis `axis`.
    fn wrapped(&self, i: i32, axis: usize) -> usize {
        let n = self.size[axis];
        let inside = match self.wrap {
            VolumeWrap::Clamp | VolumeWrap::Empty => i.clamp(0, n - 1),
            VolumeWrap::Repeat => i.rem_euclid(n),
            VolumeWrap::Mirror => {
                let i = i.rem_euclid(2 * n);
                i.min(2 * n - 1 - i)
            }
        };
        inside as usize
    }

    /// Samples of a cell along x, y and z.
    #[inline(always)]
    pub(super) fn corners(&self, cell: [i32; 3]) -> [Pair; 3] {
        let upper = i32::from(self.filter == VolumeFilter::Trilinear);
        let mut corners = [[0; 2]; 3];
        for axis in 0..3 {
            let i = cell[axis];
            corners[axis] = if i >= 0 && i < self.size[axis] - upper {
                [i as usize, (i + upper) as usize]
            } else {
                [self.wrapped(i, axis), self.wrapped(i.saturating_add(upper), axis)]
            };
        }
        corners
    }

    /// The cells along a ray, without those of blocks in which nothing is.
    pub(super) fn cells<'l>(&'l self, way: &Way, blocks: &'l Blocks) -> Cells<'l> {
        let (o, d) = (self.position(way.o), self.linear * way.d.as_dvec3());
        let mut stretch = [way.begin, way.end];
        if let Some(extent) = self.extent() {
            stretch = clipped(stretch, o, d, extent);
        }
        let [begin, end] = stretch;
        let mut axes = [Axis { o: 0.0, d: 0.0, inverse: 0.0, step: 1, outermost: 0 }; 3];
        for (i, axis) in axes.iter_mut().enumerate() {
            let moves_up = d[i] > 0.0;
            let outermost = match (self.is_endless(), moves_up) {
                (true, true) => i32::MAX,
                (true, false) => i32::MIN,
                (false, true) => self.last[i],
                (false, false) => self.first[i],
            };
            // So small steps cross no cell.
            let inverse = if d[i].abs() < 1e-290 { f64::INFINITY } else { 1.0 / d[i] };
            *axis = Axis { o: o[i], d: d[i], inverse, step: if moves_up { 1 } else { -1 }, outermost };
        }
        let mut cells =
            Cells { lattice: self, blocks, axes, cell: [0; 3], exits: [0.0; 3], t: begin, end, is_new: true };
        cells.enter(self.cell_of(o + d * begin).to_array());
        cells
    }
}

/// The part of a stretch of a ray inside of a box; it ends before it begins if there is none.
pub(super) fn clipped([mut begin, mut end]: [f64; 2], o: DVec3, d: DVec3, [lower, upper]: [DVec3; 2]) -> [f64; 2] {
    for axis in 0..3 {
        if d[axis] == 0.0 {
            if !(lower[axis]..=upper[axis]).contains(&o[axis]) {
                return [0.0, -1.0];
            }
            continue;
        }
        let [a, b] = [lower, upper].map(|corner| (corner[axis] - o[axis]) / d[axis]);
        begin = begin.max(a.min(b));
        end = end.min(a.max(b));
    }
    [begin, end]
}

/// A ray's way through one cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub cell: [i32; 3],
    /// Distances along the ray.
    pub begin: f64,
    pub end: f64,
}

/// A ray along one axis of index space.
#[derive(Clone, Copy, Debug)]
struct Axis {
    o: f64,
    d: f64,
    /// 1 / d; infinite if the ray does not move.
    inverse: f64,
    /// From one cell to the next.
    step: i32,
    /// The last cell in the ray's direction.
    outermost: i32,
}

impl Axis {
    /// The distance at which the ray leaves a cell.
    #[inline(always)]
    fn exit(&self, cell: i32) -> f64 {
        if cell == self.outermost || self.inverse.is_infinite() {
            return f64::INFINITY;
        }
        (f64::from(cell) + f64::from(self.step > 0) - self.o) * self.inverse
    }
}

/// The cells along a ray in their order.
pub(super) struct Cells<'l> {
    lattice: &'l Lattice,
    blocks: &'l Blocks,
    axes: [Axis; 3],
    cell: [i32; 3],
    /// Where the ray leaves the cell along each axis.
    exits: [f64; 3],
    t: f64,
    end: f64,
    /// The cell is the first one of its block.
    is_new: bool,
}

impl Cells<'_> {
    /// The place in a cell of the point at the distance `t`.
    #[inline(always)]
    pub(super) fn inside(&self, cell: [i32; 3], t: f64) -> [f32; 3] {
        let mut out = [0.0; 3];
        for i in 0..3 {
            out[i] = ((self.axes[i].o + self.axes[i].d * t - f64::from(cell[i])) as f32).clamp(0.0, 1.0);
        }
        out
    }

    fn enter(&mut self, cell: [i32; 3]) {
        self.cell = cell;
        for ((exit, axis), &i) in self.exits.iter_mut().zip(&self.axes).zip(&cell) {
            *exit = axis.exit(i);
        }
    }

    /// Goes to the next cell, or to the end of the ray.
    #[inline(always)]
    fn step(&mut self) {
        let [x, y, z] = self.exits;
        let i = if x < y {
            if x < z { 0 } else { 2 }
        } else if y < z {
            1
        } else {
            2
        };
        let exit = self.exits[i];
        if exit >= self.end {
            self.t = self.end;
            return;
        }
        self.t = self.t.max(exit);
        let axis = &self.axes[i];
        let cell = self.cell[i] + axis.step;
        self.cell[i] = cell;
        self.exits[i] = axis.exit(cell);
        self.is_new = cell & (BLOCK - 1) == if axis.step > 0 { 0 } else { BLOCK - 1 };
    }

    /// Goes to the cell behind the block of the cells from `lower` up to `lower + BLOCK`, or to the end of the ray.
    fn leave_block(&mut self, lower: [i32; 3]) {
        let (mut exit, mut first) = (self.end, None);
        for (i, axis) in self.axes.iter().enumerate() {
            let edge =
                if axis.step > 0 { (lower[i] + (BLOCK - 1)).min(axis.outermost) } else { lower[i].max(axis.outermost) };
            let t = axis.exit(edge);
            if t < exit {
                (exit, first) = (t, Some((i, edge + axis.step)));
            }
        }
        self.t = self.t.max(exit);
        let Some((i, next)) = first else { return };
        let mut g = [0.0; 3];
        for (g, axis) in g.iter_mut().zip(&self.axes) {
            *g = axis.o + axis.d * self.t;
        }
        // Rounding must not lead out of the block sideways.
        let lower = IVec3::from_array(lower);
        let mut cell = self.lattice.cell_of(DVec3::from_array(g)).clamp(lower, lower + (BLOCK - 1)).to_array();
        cell[i] = next;
        self.enter(cell);
    }
}

impl Iterator for Cells<'_> {
    type Item = Stretch;

    #[inline(always)]
    fn next(&mut self) -> Option<Stretch> {
        while self.t < self.end {
            if self.is_new
                && let Some(lower) = self.blocks.empty_around(self.cell)
            {
                self.leave_block(lower);
                continue;
            }
            self.is_new = false;
            let (cell, begin) = (self.cell, self.t);
            self.step();
            if self.t > begin {
                return Some(Stretch { cell, begin, end: self.t });
            }
        }
        None
    }
}

/// Blocks of cells in which nothing is.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    /// Blocks along each axis.
    count: IVec3,
    /// x runs fastest.
    empty: Vec<bool>,
}

impl Blocks {
    /// Finds the blocks of the cells from zero up to the number of samples; `is_empty` tells whether all samples from
    /// a lower to an upper one (which belongs to them) are zero.
    pub(super) fn new(lattice: &Lattice, is_empty: impl Fn(IVec3, IVec3) -> bool + Sync) -> Blocks {
        use rayon::prelude::*;
        let count = (lattice.size + (BLOCK - 1)) / BLOCK;
        let [nx, ny] = [count.x as usize, count.y as usize];
        let reach = i32::from(lattice.filter == VolumeFilter::Trilinear);
        let number = nx * ny * count.z as usize;
        let block = |i: usize| {
            let block = IVec3::new((i % nx) as i32, (i / nx % ny) as i32, (i / nx / ny) as i32);
            let upper = (block + 1) * BLOCK - 1 + reach;
            // Cells beyond the last sample of a grid that goes on hold other samples as well.
            let wraps = lattice.is_endless() && upper.cmpge(lattice.size).any();
            !wraps && is_empty(block * BLOCK, upper.min(lattice.size - 1))
        };
        Blocks { count, empty: (0..number).into_par_iter().map(block).collect() }
    }

    /// The lowest cell of the block around a cell, if nothing is in it.
    #[inline]
    fn empty_around(&self, cell: [i32; 3]) -> Option<[i32; 3]> {
        let count = self.count.to_array();
        let mut index = 0;
        for i in [2, 1, 0] {
            let block = cell[i].div_euclid(BLOCK);
            if !(0..count[i]).contains(&block) {
                return None;
            }
            index = index * count[i] as usize + block as usize;
        }
        self.empty[index].then(|| cell.map(|i| i.div_euclid(BLOCK) * BLOCK))
    }
}
