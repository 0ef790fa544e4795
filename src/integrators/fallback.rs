//! A bidirectional method that leaves a render to path tracing where that is the more efficient one.
//!
//! In a well-lit scene next event finds all light, and what a bidirectional method spends on light sub-paths, on pmfs
//! and on weights that count them is lost. Its first two iterations, which are part of the picture, predict error and
//! cost of the allocation that it chose (`mis::allocation`). A few samples of the path tracer, which are not part of
//! the picture, tell its own. The smaller product of relative variance, of pixels and of 16 × 16 blocks alike, and cost
//! gets all later iterations.
//!
//! Every iteration is unbiased whatever was decided, since the decision depends on the first two alone and on samples
//! that no picture has. It counts rays instead of times, so that it is the same on any machine.
//!
//! A path tracer may miss in its few samples what it finds rarely. The method has found such light: its own samples
//! predict the variance of hits and next event with a thousandth of the light sub-paths and connections
//! ([`SampleAllocation::EYE_ONLY`]), and with eye sub-paths that end as soon as its own do, which is too pessimistic by
//! a factor. Path tracing is trusted with no less than that variance over `PREDICTION_EXCESS`.
//!
//! [`SampleAllocation::EYE_ONLY`]: crate::mis::SampleAllocation::EYE_ONLY

use super::path::{PathProbe, PathTracer};
use super::{Integrator, Iteration, Params, Replay};
use crate::bidir::{Bidirectional, ConnectionStrategy, ProbedEfficiency};
use crate::film::{Film, Pyramid};
use crate::mis::Techniques;
use crate::prepared::Features;
use crate::ray::RayStats;
use serde::{Deserialize, Serialize};

/// By how much the prediction may exceed the variance of path tracing: it was 4 to 47 times as large in scenes where
/// path tracing does well. Where it does not, the prediction was 37 to 600 times the variance of `two-stage`.
const PREDICTION_EXCESS: f64 = 36.0;

/// Who renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Choice {
    /// The method, until its first iterations have told more.
    Undecided,
    /// The method.
    Method,
    /// The path tracer.
    Path,
}

/// A method beside the path tracer.
pub struct PathFallback<S: ConnectionStrategy> {
    method: Bidirectional<S>,
    path: PathTracer,
    choice: Choice,
}

/// A saved state.
#[derive(Serialize, Deserialize)]
struct SavedState {
    choice: Choice,
    method: Vec<u8>,
}

/// `method`, which may leave the render to path tracing if the parameters allow it.
pub fn with_path_fallback<S: ConnectionStrategy + 'static>(
    params: &Params,
    method: Bidirectional<S>,
) -> Box<dyn Integrator> {
    match is_allowed(params) {
        true => Box::new(PathFallback { method, path: PathTracer::beside(params), choice: Choice::Undecided }),
        false => Box::new(method),
    }
}

/// The parameters leave the choice of method and of techniques to the scene.
pub fn is_allowed(params: &Params) -> bool {
    let mut usual = Techniques::all();
    usual.switch(1..2, 1..2, false);
    params.bool("path_fallback") && params.is("allocation", "auto") && params.techniques("techniques") == usual
}

impl<S: ConnectionStrategy> PathFallback<S> {
    /// Decides as soon as the method has told its efficiency.
    fn decide(&mut self, iteration: &Iteration) -> RayStats {
        let Some(efficiency) = self.method.take_efficiency() else { return RayStats::default() };
        self.choice = Choice::Method;
        if self.choice_is_open(iteration.scene.features) {
            let probe = self.path.probe(iteration);
            if is_better(&probe, &efficiency) {
                self.choice = Choice::Path;
            }
            return probe.stats;
        }
        RayStats::default()
    }

    fn choice_is_open(&self, features: Features) -> bool {
        !PathTracer::is_blind(features) && self.method.pyramid().is_none()
    }
}

/// Path tracing has the smaller product of variance and cost.
fn is_better(probe: &PathProbe, method: &ProbedEfficiency) -> bool {
    let relative = |(variance, scale): (&f64, &f64)| if *scale > 0.0 { variance / scale } else { 0.0 };
    let probed: f64 = probe.variances.iter().zip(&method.errors.scales).map(relative).sum();
    let predicted = method.errors.eye_only.map_or(f64::INFINITY, |variance| variance / PREDICTION_EXCESS);
    probed.max(predicted) * probe.rays < method.errors.variance * method.cost
}

impl<S: ConnectionStrategy> Integrator for PathFallback<S> {
    fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats {
        if self.choice == Choice::Path {
            return self.path.iterate(iteration, film);
        }
        let mut stats = self.method.iterate(iteration, film);
        if self.choice == Choice::Undecided {
            stats.merge(&self.decide(iteration));
        }
        stats
    }

    fn state(&self) -> Vec<u8> {
        let method = if self.choice == Choice::Path { vec![] } else { self.method.save() };
        postcard::to_allocvec(&SavedState { choice: self.choice, method }).unwrap_or_default()
    }

    fn restore(&mut self, iteration: &Iteration, state: &[u8]) -> bool {
        if state.is_empty() {
            return true;
        }
        let Ok(SavedState { choice, method }) = postcard::from_bytes(state) else { return false };
        self.choice = choice;
        self.method.restore(iteration, &method)
    }

    fn notes(&self) -> Vec<String> {
        match self.choice {
            Choice::Path => {
                vec!["path tracing is more efficient in this scene: it renders all but two iterations".into()]
            }
            _ => self.method.notes(),
        }
    }

    fn keep_pyramid(&mut self, pyramid: Pyramid) -> bool {
        self.method.keep_pyramid(pyramid);
        true
    }

    fn pyramid(&self) -> Option<&Pyramid> {
        self.method.pyramid()
    }

    fn replay(&mut self, iteration: &Iteration, pixel: (u32, u32)) -> Replay {
        if self.choice == Choice::Undecided && self.method.missing_before(iteration.index) >= 2 {
            let mut film = Film::new(iteration.scene.window);
            for _ in 0..self.method.missing_before(iteration.index) {
                let index = film.begin_iteration();
                self.iterate(&iteration.with_index(index), &mut film);
            }
        }
        match self.choice {
            Choice::Path => self.path.replay(iteration, pixel),
            _ => self.method.replay(iteration, pixel),
        }
    }
}
