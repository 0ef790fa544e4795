//! Memory for many BSDFs: only the lobes that exist, side by side.

use super::Bsdf;
use super::nested_frame::NestedFrame;
use super::view::{BsdfView, Scattering, WeightedLobe};
use crate::math::Vec3;

/// Lobes and frames of many BSDFs.
#[derive(Clone, Debug, Default)]
pub struct BsdfPool {
    lobes: Vec<WeightedLobe>,
    frames: Vec<NestedFrame>,
}

/// A BSDF in a pool.
#[derive(Clone, Copy, Debug)]
pub struct StoredBsdf {
    scattering: Scattering,
    first_lobe: u32,
    first_frame: u32,
    lobes: u8,
    frames: u8,
}

/// Index offsets of the lobes and frames of a pool that was appended to another.
#[derive(Clone, Copy, Debug)]
pub struct PoolOffset {
    lobes: u32,
    frames: u32,
}

impl StoredBsdf {
    /// The BSDF in the pool to which its own was appended.
    #[inline]
    #[must_use]
    pub fn offset_by(self, by: PoolOffset) -> StoredBsdf {
        StoredBsdf { first_lobe: self.first_lobe + by.lobes, first_frame: self.first_frame + by.frames, ..self }
    }
}

impl BsdfPool {
    /// Copies a BSDF into the pool.
    #[inline]
    pub fn store(&mut self, bsdf: &Bsdf) -> StoredBsdf {
        self.store_parts(bsdf.scattering, &bsdf.lobes, &bsdf.frames)
    }

    /// Copies a BSDF of the pool `other` into this one.
    #[inline]
    pub fn store_from(&mut self, stored: &StoredBsdf, other: &BsdfPool) -> StoredBsdf {
        self.store_parts(stored.scattering, other.lobes(stored), other.frames(stored))
    }

    #[inline]
    fn store_parts(&mut self, scattering: Scattering, lobes: &[WeightedLobe], frames: &[NestedFrame]) -> StoredBsdf {
        let stored = StoredBsdf {
            scattering,
            first_lobe: self.lobes.len() as u32,
            first_frame: self.frames.len() as u32,
            lobes: lobes.len() as u8,
            frames: frames.len() as u8,
        };
        // Most BSDFs are Lambertian and have no lobes.
        if let Scattering::Lobes(_) = scattering {
            self.lobes.extend_from_slice(lobes);
            self.frames.extend_from_slice(frames);
        }
        stored
    }

    #[inline]
    fn lobes(&self, stored: &StoredBsdf) -> &[WeightedLobe] {
        &self.lobes[stored.first_lobe as usize..][..usize::from(stored.lobes)]
    }

    #[inline]
    fn frames(&self, stored: &StoredBsdf) -> &[NestedFrame] {
        &self.frames[stored.first_frame as usize..][..usize::from(stored.frames)]
    }

    /// A stored BSDF, at a point with the geometric normal `ng`.
    #[inline]
    pub fn get<'a>(&'a self, stored: &'a StoredBsdf, ng: Vec3) -> BsdfView<'a> {
        BsdfView { ng, scattering: &stored.scattering, lobes: self.lobes(stored), frames: self.frames(stored) }
    }

    /// Copies all BSDFs of `other` into this pool; those stored there are to be [offset](StoredBsdf::offset_by) by the
    /// result.
    pub fn append(&mut self, other: &BsdfPool) -> PoolOffset {
        let offset = PoolOffset { lobes: self.lobes.len() as u32, frames: self.frames.len() as u32 };
        self.lobes.extend_from_slice(&other.lobes);
        self.frames.extend_from_slice(&other.frames);
        offset
    }

    /// Removes all BSDFs; the memory is kept for reuse.
    #[inline]
    pub fn clear(&mut self) {
        self.lobes.clear();
        self.frames.clear();
    }
}
