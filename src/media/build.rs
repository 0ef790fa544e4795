//! Media from their descriptions.

use super::grid::GridMedium;
use super::{Coefficients, Medium, MediumContent};
use crate::math::DVec3;
use crate::scene::{MediumDesc, PhaseDesc, VolumeDesc};
use crate::shade::phase::{Phase, PhaseLobe};

/// Why a medium cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MediumFault {
    /// A mixture of mixtures of phase functions.
    #[error("a mixture of phase functions that are mixtures themselves is not supported")]
    NestedMixture,
    /// A repeated grid would be passed very often.
    #[error("the transform of a repeated grid is so oblique that its bounding box holds the grid more than 64 times")]
    Oblique,
}

impl Medium {
    /// The medium of a description, for positions relative to `centre`, which is given in the world of the description.
    ///
    /// # Errors
    /// See [`MediumFault`].
    pub fn build(desc: &MediumDesc, centre: DVec3) -> Result<Medium, MediumFault> {
        let content = match (&desc.sigma_t, &desc.albedo) {
            (VolumeDesc::Constant(sigma_t), VolumeDesc::Constant(albedo)) => {
                let sigma_t = *sigma_t * desc.scale;
                MediumContent::Homogeneous(Coefficients { sigma_t, sigma_s: sigma_t * *albedo })
            }
            (sigma_t, albedo) => MediumContent::Grid(Box::new(GridMedium::new([sigma_t, albedo], desc.scale, centre)?)),
        };
        Ok(Medium { content, phase: phase(&desc.phase)? })
    }
}

fn phase(desc: &PhaseDesc) -> Result<Phase, MediumFault> {
    match desc {
        PhaseDesc::Blend { weight, phases } => {
            let [first, second] = phases.as_ref();
            Ok(Phase { lobes: [lobe(first)?, lobe(second)?], second: *weight })
        }
        plain => Ok(Phase::single(lobe(plain)?)),
    }
}

fn lobe(desc: &PhaseDesc) -> Result<PhaseLobe, MediumFault> {
    match *desc {
        PhaseDesc::Isotropic => Ok(PhaseLobe::Isotropic),
        PhaseDesc::HenyeyGreenstein { g } => Ok(PhaseLobe::HenyeyGreenstein(g)),
        PhaseDesc::Rayleigh => Ok(PhaseLobe::Rayleigh),
        PhaseDesc::Blend { .. } => Err(MediumFault::NestedMixture),
    }
}
