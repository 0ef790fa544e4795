//! A whole path, seen from neither end: v_0 on a light, v_1 … v_{k−1} between, v_k on the lens.
//!
//! Renders never need it. Slow definitions are written for it, in tests and where a single sample is explained.

use super::vertex::{Scatter, StoredPlace};
use crate::emit::{EmitterVertex, LightId};
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use crate::media::MediumNumber;
use crate::shade::Bsdf;

/// A vertex between the two ends.
#[derive(Clone, Debug)]
pub struct Interior {
    /// The place.
    pub place: StoredPlace,
    /// The media on the side of the geometric normal and on the other one.
    pub media: [MediumNumber; 2],
    /// The scattering function there, resolved for either of the two directions of the path.
    pub bsdf: Bsdf,
    /// The normal that the choice of a light may use here.
    pub light_choice_normal: Option<Vec3>,
    /// Delta events only: the discrete probabilities of going on towards the lens when coming from the light, and the
    /// reverse; and the value for light that goes on towards the lens.
    pub delta: Option<([SolidAnglePdf; 2], Rgb)>,
}

impl Interior {
    /// The scattering function.
    pub fn scatter(&self) -> Scatter<'_> {
        Scatter(&self.bsdf)
    }

    /// Position.
    pub fn position(&self) -> Vec3 {
        self.place.position()
    }

    /// The medium in the direction `d`.
    pub fn medium_towards(&self, d: Vec3) -> MediumNumber {
        self.media[usize::from(self.place.cosine(d) < 0.0)]
    }
}

/// The light's end of a path.
#[derive(Clone, Copy, Debug)]
pub struct Origin {
    /// The light that v_0 is on.
    pub light: LightId,
    /// v_0.
    pub end: EmitterVertex,
    /// Unit direction that leaves v_0.
    pub direction: Vec3,
    /// β_L at v_1 of a light sub-path that begins like this: emission and its cosine over the densities of v_0 and of
    /// the direction.
    pub throughput: Rgb,
}

/// A path of k edges.
#[derive(Clone, Debug)]
pub struct FullPath {
    /// v_0.
    pub origin: Origin,
    /// v_1 … v_{k−1}.
    pub interior: Vec<Interior>,
    /// v_k, a point of the lens.
    pub lens: Vec3,
}

impl FullPath {
    /// k.
    pub fn edges(&self) -> usize {
        self.interior.len() + 1
    }

    /// Position of v_i; `None` at infinity.
    pub fn position(&self, i: usize) -> Option<Vec3> {
        if i == 0 {
            match self.origin.end {
                EmitterVertex::Surface { p, .. } | EmitterVertex::Point { p } => Some(p),
                EmitterVertex::Infinite => None,
            }
        } else {
            Some(self.interior.get(i - 1).map_or(self.lens, Interior::position))
        }
    }

    /// Unit direction from v_i to v_{i+1}, and their distance (infinite if v_i is at infinity).
    pub fn edge(&self, i: usize) -> (Vec3, f32) {
        match (self.position(i), self.position(i + 1)) {
            (Some(a), Some(b)) => {
                let d = b - a;
                let length = d.length();
                (d / length, length)
            }
            _ => (self.origin.direction, f32::INFINITY),
        }
    }
}
