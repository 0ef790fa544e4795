//! Participating media: how far light gets in them, where it collides, and what it scatters into there.
//!
//! A [`Medium`] has an extinction σ_t and a scattering coefficient σ_s per channel and unit of length, and a phase
//! function. Light passes a segment with the transmittance T = exp(−τ), τ = ∫ σ_t the optical depth. Both are known
//! without chance for every kind of medium, since the densities with which walks of either direction make a vertex, and
//! so the weights of all techniques, contain them.
//!
//! # Free flight
//!
//! A walk draws one channel c evenly and lets light collide where τ_c reaches −ln(1 − ξ). The density per unit of
//! length of the next vertex is then the mean over the channels, and the probability of getting as far as a surface the
//! mean of the transmittances:
//!
//! p(t) = ⅓ Σ_c σ_t,c(t) exp(−τ_c(t)),   P(t) = ⅓ Σ_c exp(−τ_c(t)).
//!
//! The throughput is multiplied by T / p or T / P. With E = ⅓ Σ_c T_c, which is the same from either end, both are E
//! times the *collision rate* κ of the end: ⅓ Σ_c σ_t,c T_c / E in a medium, one on a surface ([`collision_rate`]).

pub mod build;
pub mod flight;
pub mod grid;
mod lattice;

pub use build::MediumFault;
pub use flight::{Collision, Flight, FlightTarget};
pub use grid::GridMedium;

use crate::math::{Rgb, Vec3};
use crate::shade::phase::{Phase, PhaseScattering};

/// Number of a medium of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MediumNumber(u16);

impl MediumNumber {
    /// No medium.
    pub const VACUUM: MediumNumber = MediumNumber(u16::MAX);

    /// The medium `index` of a [`MediumSet`]; `None` beyond what numbers can name.
    pub fn new(index: usize) -> Option<MediumNumber> {
        u16::try_from(index).ok().filter(|&n| n < u16::MAX).map(MediumNumber)
    }

    /// No medium.
    #[inline]
    pub fn is_vacuum(self) -> bool {
        self == MediumNumber::VACUUM
    }
}

impl Default for MediumNumber {
    fn default() -> MediumNumber {
        MediumNumber::VACUUM
    }
}

/// The media of a scene.
#[derive(Debug, Default)]
pub struct MediumSet {
    media: Vec<Medium>,
}

impl MediumSet {
    /// Media in the order of their numbers.
    pub fn new(media: Vec<Medium>) -> MediumSet {
        MediumSet { media }
    }

    /// The medium of a number; `None` in vacuum.
    #[inline]
    pub fn get(&self, number: MediumNumber) -> Option<&Medium> {
        self.media.get(usize::from(number.0))
    }

    /// Number of media.
    pub fn len(&self) -> usize {
        self.media.len()
    }

    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.media.is_empty()
    }
}

/// Coefficients of a point, per unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coefficients {
    /// Extinction.
    pub sigma_t: Rgb,
    /// Scattering.
    pub sigma_s: Rgb,
}

/// A point inside a medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MediumPoint {
    /// Position.
    pub p: Vec3,
    /// σ_t there, per channel and unit of length.
    pub sigma_t: Rgb,
    /// The medium.
    pub medium: MediumNumber,
}

/// A medium.
#[derive(Debug)]
pub struct Medium {
    /// Composition.
    pub content: MediumContent,
    /// How it scatters.
    pub phase: Phase,
}

/// Composition of a medium.
#[derive(Debug)]
pub enum MediumContent {
    /// Uniform in space.
    Homogeneous(Coefficients),
    /// Given on grids.
    Grid(Box<GridMedium>),
}

impl Medium {
    /// The coefficients at a point.
    #[inline]
    pub fn coefficients(&self, p: Vec3) -> Coefficients {
        match &self.content {
            MediumContent::Homogeneous(coefficients) => *coefficients,
            MediumContent::Grid(grid) => grid.coefficients(p),
        }
    }

    /// The scattering function of a point.
    #[inline]
    pub fn scattering(&self, p: Vec3) -> PhaseScattering {
        let Coefficients { sigma_t, sigma_s } = self.coefficients(p);
        let share = |s: f32, t: f32| if t > 0.0 { s / t } else { 0.0 };
        let albedo = Rgb::new(share(sigma_s.r, sigma_t.r), share(sigma_s.g, sigma_t.g), share(sigma_s.b, sigma_t.b));
        PhaseScattering { sigma_s, albedo: albedo.max_component().min(1.0), phase: self.phase }
    }

    /// τ of each channel on the way of length `length` from `o` in the unit direction `d`.
    #[inline]
    pub fn optical_depth(&self, o: Vec3, d: Vec3, length: f32) -> Rgb {
        match &self.content {
            MediumContent::Homogeneous(c) => depth_of(c.sigma_t, length),
            MediumContent::Grid(grid) => grid.optical_depth(o, d, length),
        }
    }

    /// Flies from `o` in the unit direction `d` over `length` at most.
    #[inline]
    pub fn fly(&self, o: Vec3, d: Vec3, length: f32, target: FlightTarget) -> Flight {
        match &self.content {
            MediumContent::Homogeneous(c) => fly_through(c.sigma_t, length, target),
            MediumContent::Grid(grid) => grid.fly(o, d, length, target),
        }
    }
}

/// τ of a way through a constant extinction. Without extinction, an infinite way has no depth.
#[inline]
fn depth_of(sigma_t: Rgb, length: f32) -> Rgb {
    sigma_t.map(|s| if s > 0.0 { s * length } else { 0.0 })
}

/// A flight through a constant extinction.
#[inline]
fn fly_through(sigma_t: Rgb, length: f32, target: FlightTarget) -> Flight {
    let sigma = sigma_t.to_array()[target.channel];
    let t = target.depth / sigma;
    // Without extinction the quotient is infinite or, of two zeros, no number.
    match t < length {
        true => Flight::Collided(Collision { t, depth: sigma_t * t }),
        false => Flight::Passed { depth: depth_of(sigma_t, length) },
    }
}

/// The transmittance of an optical depth.
#[inline]
pub fn transmittance(depth: Rgb) -> Rgb {
    depth.map(|d| (-d).exp())
}

/// κ of an end of a segment with the transmittance `passing` where the extinction is `sigma_t`: the density per unit of
/// length of a collision there over the mean transmittance; see the module's head.
#[inline]
pub fn collision_rate(sigma_t: Rgb, passing: Rgb) -> f32 {
    let Rgb { r, g, b } = sigma_t;
    // In a grey medium, and where nothing passes in any channel, the transmittance does not matter.
    if (r == g && g == b) || passing.is_black() {
        return sigma_t.mean();
    }
    (sigma_t * passing).mean() / passing.mean()
}

#[cfg(test)]
mod tests;
