//! What a BSDF can do at all: questions that save work.

use super::link::Link;
use super::{BsdfOf, Leaf, Scattering};
use std::ops::Deref;

impl<L: Deref<Target = [Leaf]>, K: Deref<Target = [Link]>> BsdfOf<L, K> {
    /// True if nothing is scattered: a walk ends here and no light need be sampled.
    #[inline]
    pub fn is_black(&self) -> bool {
        match &self.scattering {
            Scattering::Lambertian(lambert) => lambert.reflectance.is_black(),
            Scattering::Lobes { .. } => self.leaves.is_empty(),
        }
    }

    /// True if light from the other side than `wo`'s may contribute.
    #[inline]
    pub fn transmits(&self) -> bool {
        self.leaves.iter().any(|leaf| leaf.active[0] && leaf.active[1])
    }
}
