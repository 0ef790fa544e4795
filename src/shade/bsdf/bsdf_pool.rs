//! BSDFs that are kept: only the lobes that there are, side by side with those of others.

use super::link::Link;
use super::{Bsdf, BsdfOf, Leaf, Scattering};
use crate::math::Vec3;

/// A BSDF whose lobes are elsewhere.
pub type BsdfView<'a> = BsdfOf<&'a [Leaf], &'a [Link]>;

/// Lobes and frames of many BSDFs.
#[derive(Clone, Debug, Default)]
pub struct BsdfPool {
    leaves: Vec<Leaf>,
    links: Vec<Link>,
}

/// A BSDF in a pool.
#[derive(Clone, Copy, Debug)]
pub struct StoredBsdf {
    scattering: Scattering,
    first_leaf: u32,
    first_link: u32,
    leaves: u8,
    links: u8,
}

/// How far lobes went when their pool was appended to another.
#[derive(Clone, Copy, Debug)]
pub struct PoolOffset {
    leaves: u32,
    links: u32,
}

impl StoredBsdf {
    /// The same in the pool that its own was appended to.
    #[inline]
    #[must_use]
    pub fn offset_by(self, by: PoolOffset) -> StoredBsdf {
        StoredBsdf { first_leaf: self.first_leaf + by.leaves, first_link: self.first_link + by.links, ..self }
    }
}

impl BsdfPool {
    /// Takes in a BSDF.
    #[inline]
    pub fn store(&mut self, bsdf: &Bsdf) -> StoredBsdf {
        self.store_parts(bsdf.scattering, &bsdf.leaves, &bsdf.links)
    }

    /// Takes in a BSDF that `other` keeps.
    #[inline]
    pub fn store_from(&mut self, kept: &StoredBsdf, other: &BsdfPool) -> StoredBsdf {
        self.store_parts(kept.scattering, other.leaves(kept), other.links(kept))
    }

    #[inline]
    fn store_parts(&mut self, scattering: Scattering, leaves: &[Leaf], links: &[Link]) -> StoredBsdf {
        let kept = StoredBsdf {
            scattering,
            first_leaf: self.leaves.len() as u32,
            first_link: self.links.len() as u32,
            leaves: leaves.len() as u8,
            links: links.len() as u8,
        };
        // Nearly always there is nothing.
        if let Scattering::Lobes { .. } = scattering {
            self.leaves.extend_from_slice(leaves);
            self.links.extend_from_slice(links);
        }
        kept
    }

    #[inline]
    fn leaves(&self, kept: &StoredBsdf) -> &[Leaf] {
        &self.leaves[kept.first_leaf as usize..][..usize::from(kept.leaves)]
    }

    #[inline]
    fn links(&self, kept: &StoredBsdf) -> &[Link] {
        &self.links[kept.first_link as usize..][..usize::from(kept.links)]
    }

    /// A BSDF that was kept, at a point with the geometric normal `ng`.
    #[inline]
    pub fn get(&self, kept: &StoredBsdf, ng: Vec3) -> BsdfView<'_> {
        BsdfOf { ng, scattering: kept.scattering, leaves: self.leaves(kept), links: self.links(kept) }
    }

    /// Takes in all that `other` keeps; BSDFs kept there are to be [moved](StoredBsdf::offset_by) by what is returned.
    pub fn append(&mut self, other: &BsdfPool) -> PoolOffset {
        let moved = PoolOffset { leaves: self.leaves.len() as u32, links: self.links.len() as u32 };
        self.leaves.extend_from_slice(&other.leaves);
        self.links.extend_from_slice(&other.links);
        moved
    }

    /// Forgets all, but not its memory.
    #[inline]
    pub fn clear(&mut self) {
        self.leaves.clear();
        self.links.clear();
    }
}
