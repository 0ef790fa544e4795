//! `importance-caching`: many-light rendering (Georgiev et al. 2012).

use super::record_pmfs::{Selection, SelectionScheme};
use super::strategy::{RecordSettings, RecordStrategy};
use super::{params, surfaces};
use crate::bidir::Bidirectional;
use crate::integrators::params::shared::{GUIDED_EMISSION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL};
use crate::integrators::{IntegratorSpec, bidirectional};
use crate::mis::Techniques;
use crate::mis::factors::Balance;
use crate::prepared::Features;

/// The registry's line.
pub static IMPORTANCE_CACHING: IntegratorSpec = IntegratorSpec {
    name: "importance-caching",
    aliases: &[],
    short: "Many-light rendering with importance caching",
    long: "What the camera sees is connected to virtual lights, the vertices of many light sub-paths, drawn by probabilities that \
        are computed at importance records on surfaces. There are no other techniques, so that the 1/d^2 of near virtual lights \
        shows as noise.\n\n\
        Georgiev, Křivánek, Popov and Slusallek 2012, \"Importance caching for complex illumination\".",
    params: &[
        &[MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, HIDE_EMITTERS, GUIDED_EMISSION],
        &[params::VIRTUAL_LIGHT_PATHS, params::LIGHTS_PER_VERTEX],
        &[params::RECORD_DENSITY, params::NEAREST_RECORDS],
    ],
    unbiased: true,
    limitations: |features| {
        let specular = features.contains(Features::SPECULAR).then(|| {
            "what the camera sees in mirrors and through glass stays black: only its first hit is connected to lights".into()
        });
        bidirectional::with_narrow_lobes(features, specular)
    },
    build: |params| {
        let mut techniques = Techniques::none();
        techniques.switch(0..usize::MAX, 2..3, true);
        let settings = RecordSettings {
            paths: params.int("presampled_paths") as u32,
            samples: params.int("connections_per_vertex") as u32,
            places: surfaces(params),
            scheme: SelectionScheme { selection: Selection::ManyLights, only: None },
        };
        Box::new(Bidirectional::new(
            bidirectional::settings(params, techniques),
            RecordStrategy::<Balance>::new(settings),
        ))
    },
};
