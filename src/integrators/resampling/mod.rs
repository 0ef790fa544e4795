//! Resampled connections: many light sub-paths are traced once per iteration, and every eye vertex is connected to one
//! that was resampled at the cache points around (probabilistic connections, Popov et al. 2015; resampling-aware
//! weights, Nabata et al. 2020; two-stage resampling, Nabata et al. 2020).
//!
//! `strategy` draws, `pmfs` and `cache_points` hold the probabilities, `models` tells weights what they know.

mod cache_points;
mod learned_visibility;
mod models;
mod params;
mod path_count;
mod pcbpt;
mod pmfs;
mod ris;
mod settings;
mod strategy;
mod two_stage;

pub use pcbpt::PCBPT;
pub use ris::RIS;
pub use two_stage::TWO_STAGE;

use super::fallback::with_fallback;
use super::params::presampled::{CONNECTIONS_PER_VERTEX, RR_SCALE};
use super::params::shared::{GUIDED_EMISSION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_RESAMPLED, TECHNIQUES};
use super::{Integrator, ParamSpec, Params, bidirectional};
use crate::bidir::Bidirectional;
use crate::mis::factors::{Balance, PerCacheFactor, RisFactor};
use crate::spatial::nearest::Metric;
use settings::{MAX_GROUP, ResamplingSettings};
use strategy::CacheStrategy;

/// Parameters of methods with one stage, but for the number of light sub-paths and the weights, which differ in their
/// defaults.
const ONE_STAGE: &[ParamSpec] = &[
    MAX_DEPTH,
    RR_DEPTH_RESAMPLED,
    RR_SCALE,
    HIDE_EMITTERS,
    TECHNIQUES,
    GUIDED_EMISSION,
    CONNECTIONS_PER_VERTEX,
    params::NEAREST_CACHES,
    params::CACHE_DENSITY,
    params::METRIC,
    params::TARGET,
    params::proposal_model("per-cache"),
    params::MIN_DENSITY_RATIO,
    params::MIN_UNSEEN_FRACTION,
    params::UNSEEN_MODEL,
];

/// The factor that the parameters ask weights to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FactorModel {
    Balance,
    Mixture,
    MixtureWithVisibility,
    PerCache,
}

impl FactorModel {
    fn new(params: &Params) -> FactorModel {
        let model = |word| params.is("proposal_model", word);
        if params.is("weights", "balance") {
            FactorModel::Balance
        } else if model("mixture-with-visibility") {
            FactorModel::MixtureWithVisibility
        } else if model("per-cache") {
            FactorModel::PerCache
        } else {
            FactorModel::Mixture
        }
    }
}

/// A method with one stage.
fn build_one_stage(params: &Params) -> Box<dyn Integrator> {
    build(params, params.int("presampled_paths") as u32, None)
}

/// A method of `paths` light sub-paths (0: decided by the scene).
fn build(params: &Params, paths: u32, second_stage: Option<u32>) -> Box<dyn Integrator> {
    let model = FactorModel::new(params);
    let asks_caches = matches!(model, FactorModel::MixtureWithVisibility | FactorModel::PerCache);
    let settings = ResamplingSettings {
        paths,
        second_stage,
        samples: params.int("connections_per_vertex") as u32,
        neighbors: params.int("nearest_caches") as usize,
        cache_fraction: params.float("cache_density"),
        group_size: second_stage.map_or(MAX_GROUP, |_| params.int("group_size") as usize),
        epsilon: params.float("min_density_ratio") as f32,
        min_unseen_fraction: params.float("min_unseen_fraction") as f32,
        trusted: params.is("unseen_model", "constant"),
        // Weights must find the same cache points from whichever side a technique looks at a surface.
        metric: if params.is("metric", "position") || asks_caches { Metric::Plain } else { Metric::Facing },
        radiance: params.is("target", "radiance") && model != FactorModel::PerCache,
        per_cache: model == FactorModel::PerCache,
        learned_visibility: second_stage.is_some() && params.is("first_stage", "learned-visibility"),
        two_stage_weights: second_stage.is_some() && params.is("weights", "two-stage"),
    };
    let common = bidirectional::resampled_settings(params, params.techniques("techniques"));
    let optimizer = bidirectional::optimizer(params);
    macro_rules! with_factor {
        ($factor:ty) => {
            with_fallback(
                params,
                Bidirectional::new(common, CacheStrategy::<$factor>::new(settings)).with_optimizer(optimizer),
            )
        };
    }
    match model {
        FactorModel::Balance => with_factor!(Balance),
        FactorModel::Mixture => with_factor!(RisFactor),
        FactorModel::MixtureWithVisibility | FactorModel::PerCache => with_factor!(PerCacheFactor),
    }
}
