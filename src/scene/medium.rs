//! Participating media as scene files describe them.

use super::desc::MediumId;
use super::diag::Span;
use crate::math::Rgb;
use glam::DMat4;
use half::f16;
use std::sync::Arc;

/// A participating medium.
#[derive(Clone, Debug)]
pub struct MediumDesc {
    /// Extinction coefficient σ_t per unit of length, before `scale`. Where it is a grid, the medium ends at the box along
    /// the world's axes that holds the grid's unit cube.
    pub sigma_t: VolumeDesc,
    /// Single-scattering albedo σ_s / σ_t, in [0, 1].
    pub albedo: VolumeDesc,
    /// Multiplies the extinction.
    pub scale: f32,
    /// Phase function.
    pub phase: PhaseDesc,
    /// Where it stands.
    pub span: Option<Span>,
}

/// A quantity that may change from point to point.
#[derive(Clone, Debug)]
pub enum VolumeDesc {
    /// Uniform in space.
    Constant(Rgb),
    /// Given on a grid.
    Grid(GridDesc),
}

/// A grid with its place.
#[derive(Clone, Debug)]
pub struct GridDesc {
    /// The values.
    pub grid: Arc<VolumeGrid>,
    /// Unit cube [0, 1]³, which the grid fills → world.
    pub to_world: DMat4,
    /// How values are looked up between samples.
    pub filter: VolumeFilter,
    /// Values outside of the grid.
    pub wrap: VolumeWrap,
}

/// Values on a grid: x runs fastest, then y, then z; the channels of a sample are side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeGrid {
    /// Samples along x, y and z.
    pub size: [u32; 3],
    /// Values of a sample: 1, or 3 for RGB.
    pub channels: u32,
    /// The values: finite and not negative.
    pub values: GridValues,
}

/// The values of a grid, in the type that their file has.
#[derive(Clone, Debug, PartialEq)]
pub enum GridValues {
    /// Single precision.
    Float32(Vec<f32>),
    /// Half precision.
    Float16(Vec<f16>),
    /// Shares of 255.
    Unorm8(Vec<u8>),
}

impl GridValues {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            GridValues::Float32(v) => v.len(),
            GridValues::Float16(v) => v.len(),
            GridValues::Unorm8(v) => v.len(),
        }
    }

    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value `index`, which must be below [`GridValues::len`].
    pub fn get(&self, index: usize) -> f32 {
        match self {
            GridValues::Float32(v) => v[index].value(),
            GridValues::Float16(v) => v[index].value(),
            GridValues::Unorm8(v) => v[index].value(),
        }
    }
}

/// A value in one of the types that a grid can have.
pub trait GridValue: Copy + Send + Sync {
    /// The number that it stands for.
    fn value(self) -> f32;
}

impl GridValue for f32 {
    #[inline]
    fn value(self) -> f32 {
        self
    }
}

impl GridValue for f16 {
    #[inline]
    fn value(self) -> f32 {
        self.to_f32()
    }
}

impl GridValue for u8 {
    #[inline]
    fn value(self) -> f32 {
        f32::from(self) / 255.0
    }
}

/// How a grid is looked up between its samples, which stand in the middle of their cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeFilter {
    /// The value of the cell.
    Nearest,
    /// Linear in x, y and z between the eight samples around.
    Trilinear,
}

/// Values outside of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeWrap {
    /// The nearest values of the border.
    Clamp,
    /// The grid again.
    Repeat,
    /// The grid again, every other time mirrored.
    Mirror,
    /// Nothing: the grid ends at its outermost samples (Mitsuba 0.6).
    Empty,
}

/// A phase function.
#[derive(Clone, Debug, PartialEq)]
pub enum PhaseDesc {
    /// Equal in all directions.
    Isotropic,
    /// Henyey and Greenstein 1941.
    HenyeyGreenstein {
        /// Mean cosine of the scattering angle, in (−1, 1).
        g: f32,
    },
    /// Scattering by particles much smaller than the wavelength.
    Rayleigh,
    /// A mixture.
    Blend {
        /// Share of the second, in [0, 1].
        weight: f32,
        /// The two phase functions.
        phases: Box<[PhaseDesc; 2]>,
    },
}

/// The media on both sides of a surface. `None` is vacuum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InterfaceDesc {
    /// On the side away from the geometric normal.
    pub interior: Option<MediumId>,
    /// On the side of the geometric normal.
    pub exterior: Option<MediumId>,
}
