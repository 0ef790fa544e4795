//! `light`: light tracing (Dutré, Lafortune & Willems 1993; Veach 1997, §8.3.4): every vertex of every light sub-path
//! is connected to the lens. It is bidirectional path tracing with the techniques t = 1 alone.
//!
//! A pinhole or lens that looks at the world through a mirror or a pane is never reached: such paths are missing.

use super::params::shared::{GUIDED_EMISSION, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL};
use super::{IntegratorSpec, bidirectional};
use crate::bidir::{Bidirectional, NoConnections};
use crate::mis::Techniques;
use crate::prepared::Features;

/// The registry's line.
pub static SPEC: IntegratorSpec = IntegratorSpec {
    name: "light",
    aliases: &["ptracer"],
    short: "Light tracing: sub-paths from the lights, each vertex connected to the lens",
    long: "It renders caustics well, and nothing that the camera sees in a mirror or through glass. It is bidirectional path \
        tracing with the techniques t = 1 alone.\n\n\
        Dutré, Lafortune and Willems 1993, \"Monte Carlo light tracing with direct computation of pixel intensities\"; Veach \
        1997, section 8.3.4.",
    params: &[&[MAX_DEPTH, RR_DEPTH_BIDIRECTIONAL, HIDE_EMITTERS, GUIDED_EMISSION]],
    unbiased: true,
    limitations: |features| {
        let specular = features.contains(Features::SPECULAR).then(|| {
            "what the camera sees in mirrors and through glass stays black: no connection from a light can reach it"
                .into()
        });
        bidirectional::with_narrow_lobes(features, specular)
    },
    build: |params| {
        let mut techniques = Techniques::none();
        techniques.switch(0..usize::MAX, 1..2, true);
        Box::new(Bidirectional::new(bidirectional::settings(params, techniques), NoConnections))
    },
};
