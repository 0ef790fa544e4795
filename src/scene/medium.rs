//! Participating media as scene files describe them.

use super::desc::MediumId;
use super::diag::Span;
use crate::math::Rgb;
use glam::DMat4;
use std::sync::Arc;

/// A participating medium.
#[derive(Clone, Debug)]
pub struct MediumDesc {
    /// Extinction coefficient σ_t per unit of length, before `scale`.
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
    /// The same everywhere.
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
    /// What is outside of the grid.
    pub wrap: VolumeWrap,
}

/// Values on a grid: x runs fastest, then y, then z; the channels of a sample are side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeGrid {
    /// Samples along x, y and z.
    pub size: [u32; 3],
    /// Values of a sample: 1, or 3 for RGB.
    pub channels: u32,
    /// The values, all finite.
    pub values: Vec<f32>,
}

/// How a grid is looked up between its samples, which stand in the middle of their cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeFilter {
    /// The value of the cell.
    Nearest,
    /// Linear in x, y and z between the eight samples around.
    Trilinear,
}

/// What is outside of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeWrap {
    /// The nearest values of the border.
    Clamp,
    /// The grid again.
    Repeat,
    /// The grid again, every other time mirrored.
    Mirror,
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
