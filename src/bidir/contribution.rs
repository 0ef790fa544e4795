//! Contributions of bidirectional techniques on their way to the film.

pub use crate::film::ContributionKind;
use crate::film::Splat;
use crate::math::Rgb;
use crate::mis::{Heuristic, MisWeight};
use crate::ray::Transmittance;

/// A contribution of the technique (s, t).
#[derive(Clone, Copy, Debug, Default)]
pub struct Contribution {
    /// Column of its pixel in the full picture.
    pub x: u32,
    /// Row of its pixel in the full picture.
    pub y: u32,
    /// Number of the light sub-path, if it is a splat (t = 1).
    pub path: u32,
    /// Number of the contribution in a replay.
    pub replay_index: u32,
    /// Light vertices.
    pub s: u16,
    /// Eye vertices.
    pub t: u16,
    /// Value of the technique by itself.
    pub raw: Rgb,
    /// Its weight, with those of groups of techniques.
    pub weight: MisWeight,
}

impl Contribution {
    /// The value times the weight.
    #[inline]
    pub fn weighted(&self) -> Rgb {
        self.raw * self.weight.own
    }

    /// The contribution after a visibility ray has passed.
    #[inline]
    pub fn through(self, transmittance: Transmittance, heuristic: Heuristic) -> Contribution {
        if transmittance.is_one() {
            return self;
        }
        let technique = (usize::from(self.s), usize::from(self.t));
        let weight = self.weight.through(transmittance, heuristic, technique);
        Contribution { raw: self.raw * transmittance, weight, ..self }
    }

    /// As a splat of the light image.
    #[inline]
    pub fn splat(&self) -> Splat {
        let Contribution { x, y, path, replay_index, s, .. } = *self;
        Splat { x, y, path, vertex: u32::from(s), replay_index, value: self.weighted() }
    }
}
