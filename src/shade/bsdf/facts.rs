//! What a BSDF can do at all: questions that save work.

use super::Bsdf;

impl Bsdf {
    /// True if nothing is scattered: a walk ends here and no light need be sampled.
    #[inline]
    pub fn is_black(&self) -> bool {
        match &self.lambert {
            Some(lambert) => lambert.reflectance.is_black(),
            None => self.leaves.is_empty(),
        }
    }

    /// True if light from the other side than `wo`'s may contribute.
    #[inline]
    pub fn transmits(&self) -> bool {
        self.leaves.iter().any(|leaf| leaf.active[0] && leaf.active[1])
    }
}
