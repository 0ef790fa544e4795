//! Media of which the extinction, the albedo or both are given on grids.
//!
//! The optical depth of a ray is the sum over the grid's cells that it passes. Inside of a cell a density interpolated
//! between eight samples is a cubic polynomial of the distance, and Gauss's rule with two points integrates it exactly,
//! by a sum of values that are not negative. Nothing is left to chance, and no digits cancel.
//!
//! The work on a cell is inlined: calls that hand over cells and their samples take as long as the rest.

use super::flight::{Collision, Flight, FlightTarget};
use super::lattice::{Blocks, Cells, Lattice, Stretch, Way, clipped};
use super::{Coefficients, MediumFault};
use crate::math::{DVec3, Rgb, Vec3};
use crate::scene::{GridDesc, GridValue, GridValues, VolumeDesc, VolumeFilter, VolumeGrid, VolumeWrap};
use glam::IVec3;
use half::f16;
use std::sync::Arc;

/// Nodes of Gauss's rule with two points on [0, 1].
const NODES: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];

/// Steps after which the search for a collision inside of a cell ends; each at least halves what is left.
const MAX_STEPS: u32 = 60;

/// Grids that go on beyond their unit cube may be repeated so often along an axis inside of their medium.
const MAX_REPETITIONS: f64 = 64.0;

/// A medium with grids.
#[derive(Debug)]
pub struct GridMedium {
    extinction: Field,
    albedo: Field,
    /// Multiplies the extinction.
    scale: f32,
    /// The box relative to the scene's centre beyond which there is nothing; `None` if the extinction is constant.
    bounds: Option<[DVec3; 2]>,
}

/// A quantity in space.
#[derive(Debug)]
enum Field {
    Constant(Rgb),
    Grid(Box<GridField>),
}

#[derive(Debug)]
struct GridField {
    grid: Arc<VolumeGrid>,
    lattice: Lattice,
    /// Empty for fields that are looked up at points alone.
    blocks: Blocks,
}

impl GridMedium {
    /// A medium of the extinction `sigma_t` times `scale`; `centre` is the scene's centre in the world of the description.
    pub(super) fn new(
        [sigma_t, albedo]: [&VolumeDesc; 2],
        scale: f32,
        centre: DVec3,
    ) -> Result<GridMedium, MediumFault> {
        let bounds = match sigma_t {
            VolumeDesc::Constant(_) => None,
            VolumeDesc::Grid(desc) => Some(bounds_of(desc, centre)?),
        };
        let albedo = match albedo {
            VolumeDesc::Constant(value) => Field::Constant(*value),
            VolumeDesc::Grid(desc) => Field::Grid(Box::new(GridField::new(desc, centre))),
        };
        let extinction = match sigma_t {
            VolumeDesc::Constant(value) => Field::Constant(*value),
            VolumeDesc::Grid(desc) => Field::Grid(Box::new(GridField::new(desc, centre).with_blocks())),
        };
        Ok(GridMedium { extinction, albedo, scale, bounds })
    }

    /// The coefficients at a point.
    pub(super) fn coefficients(&self, p: Vec3) -> Coefficients {
        if let Some([lower, upper]) = self.bounds {
            let p = p.as_dvec3();
            if !(p.cmpge(lower).all() && p.cmple(upper).all()) {
                return Coefficients::default();
            }
        }
        let sigma_t = self.extinction.at(p) * self.scale;
        Coefficients { sigma_t, sigma_s: sigma_t * self.albedo.at(p) }
    }

    /// The part of a ray on which there is something.
    fn way(&self, o: Vec3, d: Vec3, length: f32) -> Way {
        let stretch = [0.0, f64::from(length)];
        let [begin, end] = match self.bounds {
            Some(bounds) => clipped(stretch, o.as_dvec3(), d.as_dvec3(), bounds),
            None => stretch,
        };
        Way { o, d, begin, end }
    }

    /// τ of each channel on the way of length `length` from `o` in the unit direction `d`.
    pub(super) fn optical_depth(&self, o: Vec3, d: Vec3, length: f32) -> Rgb {
        match &self.extinction {
            Field::Constant(c) => super::depth_of(*c * self.scale, length),
            Field::Grid(field) => field.depth(&self.way(o, d, length)) * self.scale,
        }
    }

    /// Flies from `o` in the unit direction `d` over `length` at most.
    pub(super) fn fly(&self, o: Vec3, d: Vec3, length: f32, target: FlightTarget) -> Flight {
        match &self.extinction {
            Field::Constant(c) => super::fly_through(*c * self.scale, length, target),
            Field::Grid(field) => {
                let unscaled = FlightTarget { depth: target.depth / self.scale, ..target };
                match field.fly(&self.way(o, d, length), unscaled) {
                    Flight::Collided(at) => Flight::Collided(Collision {
                        // The end belongs to what is there.
                        t: if at.t < length { at.t } else { length.next_down() },
                        depth: at.depth * self.scale,
                    }),
                    Flight::Passed { depth } => Flight::Passed { depth: depth * self.scale },
                }
            }
        }
    }
}

/// The box along the world's axes around the unit cube of a grid, relative to the scene's centre.
fn bounds_of(desc: &GridDesc, centre: DVec3) -> Result<[DVec3; 2], MediumFault> {
    let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| DVec3::from_array([0, 1, 2].map(|axis| f64::from(i >> axis & 1))));
    let around = |points: [DVec3; 8]| {
        points.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lower, upper], p| [lower.min(*p), upper.max(*p)])
    };
    let bounds = around(corners.map(|c| desc.to_world.transform_point3(c)));
    if matches!(desc.wrap, VolumeWrap::Repeat | VolumeWrap::Mirror) {
        let from_world = desc.to_world.inverse();
        let [lower, upper] = bounds;
        let [lower, upper] = around(corners.map(|c| from_world.transform_point3(lower + c * (upper - lower))));
        if (upper - lower).max_element() > MAX_REPETITIONS {
            return Err(MediumFault::Oblique);
        }
    }
    Ok(bounds.map(|corner| corner - centre))
}

impl Field {
    fn at(&self, p: Vec3) -> Rgb {
        match self {
            Field::Constant(value) => *value,
            Field::Grid(field) => field.at(p),
        }
    }
}

/// Evaluates an expression for the type of a grid's values and for its number of channels.
macro_rules! with_samples {
    ($grid:expr, |$samples:ident| $result:expr) => {
        match (&$grid.values, $grid.channels) {
            (GridValues::Float32(v), 3) => with_samples!(f32, 3, v, |$samples| $result),
            (GridValues::Float32(v), _) => with_samples!(f32, 1, v, |$samples| $result),
            (GridValues::Float16(v), 3) => with_samples!(f16, 3, v, |$samples| $result),
            (GridValues::Float16(v), _) => with_samples!(f16, 1, v, |$samples| $result),
            (GridValues::Unorm8(v), 3) => with_samples!(u8, 3, v, |$samples| $result),
            (GridValues::Unorm8(v), _) => with_samples!(u8, 1, v, |$samples| $result),
        }
    };
    ($type:ty, $channels:literal, $values:ident, |$samples:ident| $result:expr) => {{
        let $samples = Samples::<$type, $channels>($values);
        $result
    }};
}

impl GridField {
    fn new(desc: &GridDesc, centre: DVec3) -> GridField {
        GridField { grid: desc.grid.clone(), lattice: Lattice::new(desc, centre), blocks: Blocks::default() }
    }

    /// With the blocks in which nothing is.
    fn with_blocks(mut self) -> GridField {
        let size = self.lattice.size;
        self.blocks = with_samples!(self.grid, |samples| {
            Blocks::new(&self.lattice, |lower, upper| samples.are_zero(size, lower, upper))
        });
        self
    }

    /// The value at a point; zero beyond a grid that ends.
    fn at(&self, p: Vec3) -> Rgb {
        let Some(place) = self.lattice.place(p) else { return Rgb::BLACK };
        with_samples!(self.grid, |samples| Rgb::from(Channels(
            samples.cell(&self.lattice, place.cell).at(place.inside)
        )))
    }

    fn depth(&self, way: &Way) -> Rgb {
        with_samples!(self.grid, |samples| depth(self, samples, way))
    }

    fn fly(&self, way: &Way, target: FlightTarget) -> Flight {
        with_samples!(self.grid, |samples| fly(self, samples, way, target))
    }
}

/// Values of one or three channels.
struct Channels<const C: usize>([f32; C]);

impl<const C: usize> From<Channels<C>> for Rgb {
    #[inline]
    fn from(Channels(v): Channels<C>) -> Rgb {
        Rgb::from([0, 1, 2].map(|channel| v[channel.min(C - 1)]))
    }
}

/// The samples of a grid with `C` channels.
#[derive(Clone, Copy)]
struct Samples<'g, T, const C: usize>(&'g [T]);

/// The density in one cell.
enum CellDensity<const C: usize> {
    Constant([f32; C]),
    /// Samples at the corners: x runs fastest, then y, then z.
    Interpolated([[f32; 8]; C]),
}

impl<T: GridValue, const C: usize> Samples<'_, T, C> {
    #[inline(always)]
    fn cell(self, lattice: &Lattice, cell: [i32; 3]) -> CellDensity<C> {
        let [x, y, z] = lattice.corners(cell);
        let [nx, ny] = [lattice.size.x as usize, lattice.size.y as usize];
        let sample = |x: usize, y: usize, z: usize| ((z * ny + y) * nx + x) * C;
        match lattice.filter {
            VolumeFilter::Nearest => {
                let mut out = [0.0; C];
                let begin = sample(x[0], y[0], z[0]);
                out.iter_mut().zip(&self.0[begin..]).for_each(|(out, v)| *out = v.value());
                CellDensity::Constant(out)
            }
            VolumeFilter::Trilinear => {
                let mut out = [[0.0; 8]; C];
                for corner in 0..8 {
                    let begin = sample(x[corner & 1], y[corner >> 1 & 1], z[corner >> 2]);
                    out.iter_mut().zip(&self.0[begin..]).for_each(|(out, v)| out[corner] = v.value());
                }
                CellDensity::Interpolated(out)
            }
        }
    }

    /// All samples from `lower` to `upper`, which belongs to them, are zero.
    fn are_zero(self, size: IVec3, lower: IVec3, upper: IVec3) -> bool {
        let [nx, ny] = [size.x as usize, size.y as usize];
        let rows =
            (lower.z..=upper.z).flat_map(|z| (lower.y..=upper.y).map(move |y| (z as usize * ny + y as usize) * nx));
        rows.map(|row| &self.0[(row + lower.x as usize) * C..(row + upper.x as usize + 1) * C])
            .all(|row| row.iter().all(|v| v.value() == 0.0))
    }
}

impl<const C: usize> CellDensity<C> {
    /// The density at a place in the cell.
    #[inline(always)]
    fn at(&self, f: [f32; 3]) -> [f32; C] {
        match self {
            CellDensity::Constant(v) => *v,
            CellDensity::Interpolated(corners) => {
                let mut out = [0.0; C];
                out.iter_mut().zip(corners).for_each(|(out, corners)| *out = interpolated(corners, f));
                out
            }
        }
    }

    /// ∫ density from the distance `begin` to `end`, both in the cell.
    #[inline(always)]
    fn depth(&self, cells: &Cells<'_>, cell: [i32; 3], begin: f64, end: f64) -> [f64; C] {
        let length = end - begin;
        let mut out = [0.0; C];
        match self {
            CellDensity::Constant(v) => out.iter_mut().zip(v).for_each(|(out, v)| *out = f64::from(*v) * length),
            CellDensity::Interpolated(corners) => {
                let [a, b] =
                    [cells.inside(cell, begin + NODES[0] * length), cells.inside(cell, begin + NODES[1] * length)];
                for (out, corners) in out.iter_mut().zip(corners) {
                    let sum = f64::from(interpolated(corners, a)) + f64::from(interpolated(corners, b));
                    *out = sum * (0.5 * length);
                }
            }
        }
        out
    }
}

/// Linear in x, y and z between values at the corners of a cell.
#[inline(always)]
fn interpolated(corners: &[f32; 8], [x, y, z]: [f32; 3]) -> f32 {
    let mix = |a: f32, b: f32, f: f32| a * (1.0 - f) + b * f;
    let [a, b, c, d, e, f, g, h] = *corners;
    mix(mix(mix(a, b, x), mix(c, d, x), y), mix(mix(e, f, x), mix(g, h, x), y), z)
}

#[inline]
fn depth<T: GridValue, const C: usize>(field: &GridField, samples: Samples<'_, T, C>, way: &Way) -> Rgb {
    let mut sum = [0.0; C];
    let mut cells = field.lattice.cells(way, &field.blocks);
    while let Some(Stretch { cell, begin, end }) = cells.next() {
        let part = samples.cell(&field.lattice, cell).depth(&cells, cell, begin, end);
        sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
    }
    Rgb::from(Channels(sum.map(|v| v as f32)))
}

#[inline]
fn fly<T: GridValue, const C: usize>(
    field: &GridField,
    samples: Samples<'_, T, C>,
    way: &Way,
    target: FlightTarget,
) -> Flight {
    let (channel, wanted) = (target.channel.min(C - 1), f64::from(target.depth));
    let mut sum = [0.0; C];
    let mut cells = field.lattice.cells(way, &field.blocks);
    while let Some(stretch) = cells.next() {
        let density = samples.cell(&field.lattice, stretch.cell);
        let mut part = density.depth(&cells, stretch.cell, stretch.begin, stretch.end);
        let collides = part[channel] > 0.0 && sum[channel] + part[channel] > wanted;
        let mut end = stretch.end;
        if collides {
            end = collision_in(&density, &cells, stretch, channel, (wanted - sum[channel]) / part[channel]);
            part = density.depth(&cells, stretch.cell, stretch.begin, end);
        }
        sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        if collides {
            let depth = Channels(sum.map(|v| v as f32)).into();
            return Flight::Collided(Collision { t: end as f32, depth });
        }
    }
    Flight::Passed { depth: Channels(sum.map(|v| v as f32)).into() }
}

/// The distance in a cell up to which the share `share` of the depth of its stretch is passed: Newton's method between
/// bounds, since the depth grows with the distance.
fn collision_in<const C: usize>(
    density: &CellDensity<C>,
    cells: &Cells<'_>,
    Stretch { cell, begin, end }: Stretch,
    channel: usize,
    share: f64,
) -> f64 {
    let share = share.max(0.0);
    let mut t = begin + share * (end - begin);
    if matches!(density, CellDensity::Constant(_)) {
        return t;
    }
    let wanted = share * density.depth(cells, cell, begin, end)[channel];
    let [mut lower, mut upper] = [begin, end];
    for _ in 0..MAX_STEPS {
        let excess = density.depth(cells, cell, begin, t)[channel] - wanted;
        if excess > 0.0 {
            upper = t;
        } else {
            lower = t;
        }
        let step = excess / f64::from(density.at(cells.inside(cell, t))[channel]);
        let next = t - step;
        let next = if next > lower && next < upper { next } else { 0.5 * (lower + upper) };
        let moved = (next - t).abs();
        t = next;
        if moved <= 1e-7 * (end - begin) {
            break;
        }
    }
    t
}
