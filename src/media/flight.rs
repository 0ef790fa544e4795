//! Free flight: the way of light until it collides.

use crate::math::Rgb;

/// Where a flight is to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightTarget {
    /// The channel by which it goes.
    pub channel: usize,
    /// The optical depth in that channel at which light collides, what was passed before taken off.
    pub depth: f32,
}

impl FlightTarget {
    /// Draws a target; `u` = [channel, depth] in [0, 1).
    #[inline]
    pub fn sample(u: [f32; 2]) -> FlightTarget {
        FlightTarget { channel: ((3.0 * u[0]) as usize).min(2), depth: -(-u[1]).ln_1p() }
    }

    /// The target that remains after a way of this optical depth.
    #[inline]
    #[must_use]
    pub fn after(self, depth: Rgb) -> FlightTarget {
        FlightTarget { depth: self.depth - depth.to_array()[self.channel], ..self }
    }
}

/// A collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// Length of the way.
    pub t: f32,
    /// Optical depth of the way, per channel.
    pub depth: Rgb,
}

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flight {
    /// By a collision.
    Collided(Collision),
    /// At the end of the way.
    Passed {
        /// Optical depth of the way, per channel.
        depth: Rgb,
    },
}
