//! Bidirectional scattering distribution functions.
//!
//! A [`Material`] is a tree (two-sided, masks, blends, bump maps …) over scattering models; [`Material::resolve`] looks
//! up its textures at a point and flattens it into a [`Bsdf`]: up to [`MAX_LOBES`] weighted lobes, each in its own
//! frame. The models have one file each and implement the trait of `model.rs`, which also says how a model is added;
//! their list is the table `scene::bsdf_models!`.

mod bsdf_pool;
mod builder;
mod conductor;
mod dielectric;
mod diffuse;
mod features;
mod lobe;
mod material;
mod microfacet;
mod model;
mod nested_frame;
mod node;
mod phong;
mod plastic;
mod pplastic;
mod principled;
mod rough_dielectric;
mod rough_plastic;
mod view;
mod ward;

#[cfg(test)]
mod tests;

pub use bsdf_pool::{BsdfPool, PoolOffset, StoredBsdf};
pub use features::Features;
pub use material::{Material, MaterialSet};
pub use view::BsdfView;

use super::{PhaseScattering, SurfacePoint, Transport};
use crate::math::{Rgb, SolidAnglePdf, Vec3};
use arrayvec::ArrayVec;
use nested_frame::NestedFrame;
use view::{LobeSum, Scattering, WeightedLobe};

/// Most lobes a material may have at a point (a two-sided material counts both sides if its tree lets light through).
pub const MAX_LOBES: usize = 8;
/// Most nested frames (bump maps, normal maps, backs of two-sided materials) in a material.
const MAX_FRAMES: usize = 8;

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Direction in which the walk continues; world space, unit length.
    pub wi: Vec3,
    /// Cosine weighted value, f · |cos θ_i| (for a delta event: the value whose ratio to `pdf` is the throughput).
    pub value: Rgb,
    /// Density per steradian of `wi` given `wo`; of a delta event the discrete probability.
    pub pdf: SolidAnglePdf,
    /// For a delta event: the discrete probability of the reverse event (`wo` given `wi`); otherwise unused.
    pub pdf_reverse_delta: SolidAnglePdf,
    /// For a delta event drawn for radiance: the value of the reverse event for importance; otherwise unused.
    pub reverse_delta: Rgb,
    /// The direction is one of finitely many.
    pub delta: bool,
    /// Relative refractive index crossed: transmitted side / incident side; 1 for reflection.
    pub eta: f32,
}

/// The BSDF at one point: every texture looked up, seen from `wo`. It is valid for the `wo` it was resolved with, for
/// any other direction on the same side and, in materials that let light through, on either side.
///
/// Under bump and normal maps the normal is turned towards the eye where it would face away (as Mitsuba does), so light
/// that is traced from the other end may find it turned differently: there the adjoint can be positive where the
/// density is zero. All densities are still functions of the two directions alone, so combinations of techniques stay
/// consistent.
///
/// A `Bsdf` is a plain value without heap memory, cheap to make but large. Its functions are those of its
/// [view](Bsdf::view).
#[derive(Clone, Debug)]
pub struct Bsdf {
    ng: Vec3,
    scattering: Scattering,
    lobes: ArrayVec<WeightedLobe, MAX_LOBES>,
    frames: ArrayVec<NestedFrame, MAX_FRAMES>,
}

impl Bsdf {
    /// Scatters nothing at `point`.
    #[inline]
    pub fn empty(point: &SurfacePoint) -> Bsdf {
        Bsdf {
            ng: point.ng,
            scattering: Scattering::Lobes(LobeSum::new(point.frame)),
            lobes: ArrayVec::new(),
            frames: ArrayVec::new(),
        }
    }

    /// Makes it the scattering function of a point of a medium.
    #[inline]
    pub fn set_phase(&mut self, phase: PhaseScattering) {
        self.ng = Vec3::ZERO;
        self.scattering = Scattering::Phase(phase);
        self.lobes.clear();
        self.frames.clear();
    }

    /// Starts over at `point`, without lobes.
    #[inline]
    fn begin(&mut self, point: &SurfacePoint, scattering: Scattering) {
        self.ng = point.ng;
        self.scattering = scattering;
        self.lobes.clear();
        self.frames.clear();
    }

    /// Normalises the choice of lobes; called once all lobes are in.
    #[inline]
    fn normalise_selection(&mut self) {
        let scales = if let [lobe] = self.lobes.as_mut_slice() {
            lobe.selection_weight = 1.0;
            lobe.active.map(|a| if a { 1.0 } else { 0.0 })
        } else {
            std::array::from_fn(|s| {
                let sum: f32 = self.lobes.iter().filter(|l| l.active[s]).map(|l| l.selection_weight).sum();
                if sum > 0.0 { 1.0 / sum } else { 0.0 }
            })
        };
        if let Scattering::Lobes(sum) = &mut self.scattering {
            sum.selection_scale = scales;
        }
    }

    /// Borrows the lobes.
    #[inline]
    pub fn view(&self) -> BsdfView<'_> {
        BsdfView { ng: self.ng, scattering: &self.scattering, lobes: &self.lobes, frames: &self.frames }
    }

    /// See [`BsdfView::eval`].
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: Transport) -> Rgb {
        self.view().eval(wo, wi, mode)
    }

    /// See [`BsdfView::eval_and_pdf`].
    #[inline]
    pub fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> (Rgb, SolidAnglePdf) {
        self.view().eval_and_pdf(wo, wi, mode)
    }

    /// See [`BsdfView::pdf`].
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: Transport) -> SolidAnglePdf {
        self.view().pdf(wo, wi, mode)
    }

    /// See [`BsdfView::sample`].
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 3], mode: Transport) -> Option<BsdfSample> {
        self.view().sample(wo, u, mode)
    }

    /// See [`BsdfView::albedo`].
    #[inline]
    pub fn albedo(&self) -> Rgb {
        self.view().albedo()
    }

    /// See [`BsdfView::is_lambertian`].
    #[inline]
    pub fn is_lambertian(&self) -> bool {
        self.view().is_lambertian()
    }

    /// See [`BsdfView::connectable`].
    #[inline]
    pub fn connectable(&self) -> bool {
        self.view().connectable()
    }

    /// See [`BsdfView::is_black`].
    #[inline]
    pub fn is_black(&self) -> bool {
        self.view().is_black()
    }

    /// See [`BsdfView::transmits`].
    #[inline]
    pub fn transmits(&self) -> bool {
        self.view().transmits()
    }
}
