//! Importance caching: pmfs of light vertices are kept at few places, as a combination of cautious and daring ones
//! (`distributions`).
//!
//! * `skeleton` (SkelBPT, Noël and Biri 2015): at nodes in the middle of empty space. Every eye vertex belongs to a node, which is found in
//!   constant time.
//! * `ic-bdpt` (ICBPT, ibid. §5): at records on surfaces, of which an eye vertex mixes the three nearest.
//! * `importance-caching` (Georgiev et al. 2012): many-light rendering. Points that the camera sees are connected to virtual lights, the
//!   vertices of all light sub-paths; there are no other techniques, so the 1/d² of near ones shows.
//!
//! As published, the first two connect an eye vertex to one light sub-path of each length, with the weights of
//! bidirectional path tracing. Balance weights do not count how much likelier than others the sub-paths are drawn that
//! matter, so that other techniques keep most of the light, and noise.
//!
//! DEVIATION: by default eye vertices draw from all lengths together, and weights count the density of drawing as those
//! of `ris` do, from means of earlier iterations at the same records (`mis::factors::record_mixture`). They are wrong
//! where an eye vertex sees light that its record does not, and cost no rays.

mod distributions;
mod ic_bdpt;
mod importance_caching;
mod models;
mod params;
mod record_pmfs;
mod records;
mod running_means;
mod skeleton;
mod strategy;

pub use ic_bdpt::IC_BDPT;
pub use importance_caching::IMPORTANCE_CACHING;
pub use skeleton::SKELETON;

use super::fallback::with_fallback;
use super::params::presampled::RR_SCALE;
use super::params::shared::{
    ALLOCATION, FALLBACK, GUIDED_EMISSION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_RESAMPLED, TECHNIQUES,
};
use super::{Integrator, ParamSpec, Params, bidirectional};
use crate::bidir::Bidirectional;
use crate::mis::factors::{Balance, PerLengthFactor, RecordMixtureFactor};
use distributions::Distribution;
use record_pmfs::{Selection, SelectionScheme};
use strategy::{RecordPlaces, RecordSettings, RecordStrategy};

/// Parameters of methods with several techniques, before those of their records.
const CANDIDATES: &[ParamSpec] = &[
    MAX_DEPTH,
    RR_DEPTH_RESAMPLED,
    RR_SCALE,
    HIDE_EMITTERS,
    TECHNIQUES,
    GUIDED_EMISSION,
    params::PRESAMPLED_PATHS,
    params::CONNECTIONS_PER_VERTEX,
];
/// Parameters of methods with several techniques, after those of their records.
const SELECTION: &[ParamSpec] = &[params::SELECTION, params::DISTRIBUTIONS, params::WEIGHTS, ALLOCATION, FALLBACK];

fn scheme(params: &Params) -> SelectionScheme {
    SelectionScheme {
        selection: if params.is("selection", "per-length") { Selection::PerLength } else { Selection::Mixture },
        only: [
            ("visible", Distribution::Visible),
            ("unoccluded", Distribution::Unoccluded),
            ("uniform", Distribution::Uniform),
        ]
        .into_iter()
        .find_map(|(word, distribution)| params.is("distributions", word).then_some(distribution)),
    }
}

/// Records on surfaces, as the parameters say.
fn surfaces(params: &Params) -> RecordPlaces {
    RecordPlaces::Surfaces {
        fraction: params.float("record_density"),
        neighbors: params.int("nearest_records") as usize,
    }
}

/// A method with several techniques.
fn build(params: &Params, places: RecordPlaces) -> Box<dyn Integrator> {
    let settings = RecordSettings {
        paths: params.int("presampled_paths") as u32,
        samples: params.int("connections_per_vertex") as u32,
        places,
        scheme: scheme(params),
    };
    let common = bidirectional::resampled_settings(params, params.techniques("techniques"));
    let optimizer = bidirectional::optimizer(params);
    macro_rules! with_factor {
        ($factor:ty) => {
            with_fallback(
                params,
                Bidirectional::new(common, RecordStrategy::<$factor>::new(settings)).with_optimizer(optimizer),
            )
        };
    }
    match (params.is("weights", "balance"), settings.scheme.selection) {
        (true, _) => with_factor!(Balance),
        (_, Selection::PerLength) => with_factor!(PerLengthFactor),
        _ => with_factor!(RecordMixtureFactor),
    }
}
