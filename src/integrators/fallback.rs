//! A bidirectional method that leaves a render to a simpler one where that is more efficient.
//!
//! In a well-lit scene next event finds all light, and what a bidirectional method spends on light sub-paths, on pmfs
//! and on weights that count them is lost. Elsewhere connections matter, but light sub-paths that all pixels share
//! leave more error in regions than choosing among them saves in pixels: then pixels had better have sub-paths of
//! their own. The first two iterations of the method, which are part of the picture, predict error and cost of the
//! allocation that it chose (`mis::allocation`). A few samples of the path tracer and two iterations of bidirectional
//! path tracing, which are not part of the picture, tell theirs. The smallest product of relative variance, of pixels
//! and of 16 × 16 blocks alike, and cost gets all later iterations.
//!
//! Every iteration is unbiased whatever was decided, since the decision depends on the first two alone and on samples
//! that no picture has. It counts rays instead of times, so that it is the same on any machine.
//!
//! A path tracer may miss in its few samples what it finds rarely. The method has found such light: its own samples
//! predict the variance of hits and next event with a thousandth of the light sub-paths and connections
//! ([`SampleAllocation::EYE_ONLY`]), and with eye sub-paths that end as soon as its own do, which is too pessimistic by
//! a factor. Path tracing is trusted with no less than that variance over `PREDICTION_EXCESS`. Bidirectional path tracing
//! may miss light, too; it is not trusted if its picture is darker than the method's.
//!
//! [`SampleAllocation::EYE_ONLY`]: crate::mis::SampleAllocation::EYE_ONLY

use super::bdpt::{self, OwnSubpath};
use super::path::{PathProbe, PathTracer};
use super::{Integrator, Iteration, Params, Replay};
use crate::bidir::{Bidirectional, ConnectionStrategy, ProbedEfficiency};
use crate::film::{Film, Pyramid};
use crate::mis::Techniques;
use crate::ray::RayStats;
use serde::{Deserialize, Serialize};

/// By how much the prediction may exceed the variance of path tracing: it was 4 to 47 times as large in scenes where
/// path tracing does well. Where it does not, the prediction was 37 to 600 times the variance of `two-stage`.
const PREDICTION_EXCESS: f64 = 36.0;

/// Bidirectional path tracing is probed where path tracing's product of variance and cost is less than this many times
/// the method's. Where it is more, next event and short connections find so little that sharing light sub-paths pays.
const HOPELESS: f64 = 16.0;

/// Bidirectional path tracing is not probed where path tracing's product is so many times less than the method's: then
/// connections gain little, and two iterations of it would cost more than they could save.
const CLEARLY_BETTER: f64 = 2.0;

/// Bidirectional path tracing is trusted if its picture is no darker than this, relative to the method's.
const LEAST_BRIGHTNESS: f64 = 0.9;

/// Who renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Choice {
    /// The method, until its first iterations have told more.
    Undecided,
    /// The method.
    Method,
    /// Bidirectional path tracing.
    Bdpt,
    /// The path tracer.
    Path,
}

/// A method beside simpler ones.
pub struct Fallback<S: ConnectionStrategy> {
    method: Bidirectional<S>,
    /// `None` beside itself.
    bdpt: Option<Bidirectional<OwnSubpath>>,
    path: PathTracer,
    choice: Choice,
}

/// A saved state.
#[derive(Serialize, Deserialize)]
struct SavedState {
    choice: Choice,
    method: Vec<u8>,
}

/// `method`, which may leave the render to bidirectional path tracing and to path tracing if the parameters allow it.
pub fn with_fallback<S: ConnectionStrategy + 'static>(
    params: &Params,
    method: Bidirectional<S>,
) -> Box<dyn Integrator> {
    beside(params, method, Some(bdpt::beside(params)))
}

/// Bidirectional path tracing, which may leave the render to path tracing if the parameters allow it.
pub fn with_path_tracing(params: &Params, bdpt: Bidirectional<OwnSubpath>) -> Box<dyn Integrator> {
    beside(params, bdpt, None)
}

fn beside<S: ConnectionStrategy + 'static>(
    params: &Params,
    method: Bidirectional<S>,
    bdpt: Option<Bidirectional<OwnSubpath>>,
) -> Box<dyn Integrator> {
    match is_allowed(params) {
        true => Box::new(Fallback { method, bdpt, path: PathTracer::beside(params), choice: Choice::Undecided }),
        false => Box::new(method),
    }
}

/// The parameters leave the choice of method and of techniques to the scene.
pub fn is_allowed(params: &Params) -> bool {
    let mut usual = Techniques::all();
    usual.switch(1..2, 1..2, false);
    params.bool("fallback") && params.is("allocation", "auto") && params.techniques("techniques") == usual
}

impl<S: ConnectionStrategy> Fallback<S> {
    /// Decides as soon as the method has told its efficiency.
    fn decide(&mut self, iteration: &Iteration) -> RayStats {
        let Some(method) = self.method.take_efficiency() else { return RayStats::default() };
        self.choice = Choice::Method;
        if self.method.pyramid().is_some() {
            return RayStats::default();
        }
        let probe = self.path.probe(iteration);
        let measured = measured_variance(&probe, &method) * probe.rays;
        // Path tracing that sees all light, with no less than the variance that `predicted` allows.
        let is_blind = PathTracer::is_blind(iteration.scene.features);
        let path_product = |predicted: Option<f64>| match predicted {
            Some(variance) if !is_blind => measured.max(variance / PREDICTION_EXCESS * probe.rays),
            _ => f64::INFINITY,
        };
        let (mut stats, mut least, mut predicted) = (probe.stats, method.product(), method.errors.eye_only);
        let path_excels = CLEARLY_BETTER * path_product(predicted) < least;
        if measured < HOPELESS * least
            && !path_excels
            && let Some(bdpt) = self.probe_bdpt(iteration, &mut stats)
            && finds_as_much(&bdpt, &method)
        {
            predicted = predicted.zip(bdpt.errors.eye_only).map(|(a, b)| a.min(b));
            if bdpt.product() < least {
                (self.choice, least) = (Choice::Bdpt, bdpt.product());
            }
        }
        if path_product(predicted) < least {
            self.choice = Choice::Path;
        }
        stats
    }

    /// Error and cost of bidirectional path tracing, from its first two iterations in a film of their own.
    fn probe_bdpt(&mut self, iteration: &Iteration, stats: &mut RayStats) -> Option<ProbedEfficiency> {
        let bdpt = self.bdpt.as_mut()?;
        bdpt.share_emission(&self.method);
        let mut film = Film::new(iteration.scene.window);
        loop {
            let index = film.begin_iteration();
            stats.merge(&bdpt.iterate(&iteration.with_index(index), &mut film));
            let efficiency = bdpt.take_efficiency();
            if efficiency.is_some() || film.iterations() >= 2 {
                return efficiency;
            }
        }
    }
}

/// Relative variance of path tracing as measured.
fn measured_variance(probe: &PathProbe, method: &ProbedEfficiency) -> f64 {
    let relative = |(variance, scale): (&f64, &f64)| if *scale > 0.0 { variance / scale } else { 0.0 };
    probe.variances.iter().zip(&method.errors.scales).map(relative).sum()
}

/// Regions are nearly as bright as the method made them: no light was missed by rare chance.
fn finds_as_much(bdpt: &ProbedEfficiency, method: &ProbedEfficiency) -> bool {
    let pairs = bdpt.errors.scales.iter().zip(&method.errors.scales).filter(|(_, scale)| **scale > 0.0);
    // Scales are squares of brightness. One bright sample must not hide that others are missing.
    let (sum, regions) = pairs.fold((0.0, 0.0), |(sum, n), (a, b)| (sum + (a / b).sqrt().min(2.0), n + 1.0));
    sum >= LEAST_BRIGHTNESS * regions
}

impl<S: ConnectionStrategy> Integrator for Fallback<S> {
    fn iterate(&mut self, iteration: &Iteration, film: &mut Film) -> RayStats {
        match (self.choice, &mut self.bdpt) {
            (Choice::Path, _) => return self.path.iterate(iteration, film),
            (Choice::Bdpt, Some(bdpt)) => return bdpt.iterate(iteration, film),
            _ => {}
        }
        let mut stats = self.method.iterate(iteration, film);
        if self.choice == Choice::Undecided {
            stats.merge(&self.decide(iteration));
        }
        stats
    }

    fn state(&self) -> Vec<u8> {
        let method = match (self.choice, &self.bdpt) {
            (Choice::Path, _) => vec![],
            (Choice::Bdpt, Some(bdpt)) => bdpt.save(),
            _ => self.method.save(),
        };
        postcard::to_allocvec(&SavedState { choice: self.choice, method }).unwrap_or_default()
    }

    fn restore(&mut self, iteration: &Iteration, state: &[u8]) -> bool {
        if state.is_empty() {
            return true;
        }
        let Ok(SavedState { choice, method }) = postcard::from_bytes(state) else { return false };
        self.choice = choice;
        match (choice, &mut self.bdpt) {
            (Choice::Bdpt, Some(bdpt)) => bdpt.restore(iteration, &method),
            (Choice::Bdpt, None) => false,
            _ => self.method.restore(iteration, &method),
        }
    }

    fn notes(&self) -> Vec<String> {
        let takes_over =
            |name: &str| format!("{name} is more efficient in this scene: it renders all but two iterations");
        match (self.choice, &self.bdpt) {
            (Choice::Path, _) => vec![takes_over("path tracing")],
            (Choice::Bdpt, Some(bdpt)) => {
                [takes_over("bidirectional path tracing")].into_iter().chain(bdpt.notes()).collect()
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
        match (self.choice, &mut self.bdpt) {
            (Choice::Path, _) => self.path.replay(iteration, pixel),
            (Choice::Bdpt, Some(bdpt)) => bdpt.replay(iteration, pixel),
            _ => self.method.replay(iteration, pixel),
        }
    }
}
