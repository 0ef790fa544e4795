//! `light`: light tracing (Dutré, Lafortune & Willems 1993; Veach 1997, §8.3.4): every vertex of every light sub-path is connected to
//! the lens. It is bidirectional path tracing with the techniques t = 1 alone.
//!
//! A pinhole or lens that looks at the world through a mirror or a pane is never reached: such paths are missing.

use super::IntegratorSpec;
use super::bdpt::{Bidirectional, HIDE_EMITTERS, MAX_DEPTH, RR_DEPTH};
use crate::mis::{Heuristic, Techniques};
use crate::prepared::Features;

/// The registry's line.
pub static SPEC: IntegratorSpec = IntegratorSpec {
    name: "light",
    aliases: &["ptracer"],
    about: "Light tracing: sub-paths from the lights, each vertex connected to the lens",
    params: &[MAX_DEPTH, RR_DEPTH, HIDE_EMITTERS],
    unbiased: true,
    refuses: |_| None,
    cannot: |features| {
        (features.contains(Features::SPECULAR) || features.contains(Features::MASKS)).then(|| {
            "what the camera sees in mirrors, and through glass or masks, stays black: no connection from a light can reach it".into()
        })
    },
    build: |params| {
        let mut techniques = Techniques::none();
        techniques.switch(0..usize::MAX, 1..2, true);
        Box::new(Bidirectional::new(params, Heuristic::Balance, techniques))
    },
};
