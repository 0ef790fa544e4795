//! Bidirectional methods as integrators: the engine of `bidir` behind the trait, and the settings that their parameters
//! have in common.

use super::{Integrator, Iteration, Params, Replay, fallback};
use crate::bidir::allocation::combinations;
use crate::bidir::{AllocationOptimizer, BidirSettings, Bidirectional, ConnectionStrategy, RayCosts};
use crate::film::{Film, Pyramid};
use crate::mis::{Heuristic, LightSharing, Techniques};
use crate::path::PathLimits;
use crate::prepared::Features;
use crate::ray::RayStats;

/// The settings that all bidirectional methods have parameters for, with the balance heuristic.
pub fn settings(params: &Params, techniques: Techniques) -> BidirSettings {
    settings_with(params, techniques, params.int("rr_depth") as u32)
}

/// [`settings`] with another `rr_depth`.
pub fn settings_with(params: &Params, techniques: Techniques, rr_depth: u32) -> BidirSettings {
    let max_edges = u32::try_from(params.int("max_depth")).unwrap_or(u32::MAX);
    let limits = PathLimits { max_edges, rr_depth, rr_scale: 1.0 };
    BidirSettings {
        techniques,
        heuristic: Heuristic::Balance,
        eye_limits: limits,
        light_limits: limits,
        hide_emitters: params.bool("hide_emitters"),
        guided_emission: params.bool("guided_emission"),
    }
}

/// The limitation of a method that lights what the camera sees by connections alone, with the limitation `other`.
///
/// The expectation is right, but samples that meet a lobe of roughness α have about the probability α²: what is missing
/// without them is not in the estimated variance either. With α = 0.003 light tracing of a small picture brings 97 % of
/// the light after 1,000 iterations and 99.5 % after 49,000.
pub fn with_narrow_lobes(features: Features, other: Option<String>) -> Option<String> {
    let narrow = features.contains(Features::NEARLY_SPECULAR).then(|| {
        "surfaces of a roughness up to 0.01, and rough glass of an index near 1, are too dark until very many samples \
         are taken: connections hardly ever meet their narrow lobes"
            .to_owned()
    });
    let all: Vec<String> = other.into_iter().chain(narrow).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// [`settings`] of methods that draw connections from many light sub-paths, where eye sub-paths may end sooner at
/// Lambertian surfaces.
pub fn resampled_settings(params: &Params, techniques: Techniques) -> BidirSettings {
    let mut settings = settings(params, techniques);
    // By way of percent, so that the rounding is that of checkpoints and pictures that exist.
    settings.eye_limits.rr_scale = (params.float("rr_scale") * 100.0) as f32 * 0.01;
    settings
}

/// Decides the allocation of a method that draws connections from many light sub-paths, if the parameters ask for it.
pub fn optimizer(params: &Params) -> Option<AllocationOptimizer> {
    let candidates = || combinations(&[1.0, 0.25, 0.0625, 0.015_625], &[1.0, 0.5, 0.25, 0.125, 0.0625]);
    let new = || AllocationOptimizer::new(candidates(), RayCosts::SHARED_SUBPATHS, LightSharing::OfIteration);
    let optimizer = params.is("allocation", "auto").then(new)?;
    Some(if fallback::is_allowed(params) { optimizer.predicting_eye_only() } else { optimizer })
}

impl<S: ConnectionStrategy> Integrator for Bidirectional<S> {
    fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats {
        Bidirectional::iterate(self, iteration, film)
    }

    fn state(&self) -> Vec<u8> {
        self.save()
    }

    fn restore(&mut self, iteration: &Iteration, state: &[u8]) -> bool {
        Bidirectional::restore(self, iteration, state)
    }

    fn notes(&self) -> Vec<String> {
        Bidirectional::notes(self)
    }

    fn keep_pyramid(&mut self, pyramid: Pyramid) -> bool {
        Bidirectional::keep_pyramid(self, pyramid);
        true
    }

    fn pyramid(&self) -> Option<&Pyramid> {
        Bidirectional::pyramid(self)
    }

    fn replay(&mut self, iteration: &Iteration, pixel: (u32, u32)) -> Replay {
        Bidirectional::replay(self, iteration, pixel)
    }
}
