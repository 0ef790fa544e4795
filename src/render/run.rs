//! The run step: estimators are made or restored, iterate, are saved, and become one picture.

use super::error_target::{UntilError, half_seeds};
use super::files::write_or_rescue;
use super::iterations::{Outcome, Schedule, run_iterations};
use super::memory::{FilmMemory, check_light_subpaths};
use super::schedule::{Alternate, total_iterations};
use super::stats::ErrorEstimate;
use super::{CheckpointError, Estimator, JobError, Plan, RenderIdentity, Runtime};
use crate::film::{Film, Pyramid};
use crate::integrators::Integrator;
use crate::prepared::PreparedScene;
use std::borrow::Cow;
use std::path::Path;
use std::time::{Duration, Instant};

/// Result of a run.
pub struct Rendered {
    /// All iterations.
    pub film: Film,
    /// The integrators after their last iteration; each keeps a pyramid, if the plan has one.
    integrators: Vec<Box<dyn Integrator>>,
    /// Time, rays, reason for the end.
    pub outcome: Outcome,
    /// Estimated error, if the plan has an error target.
    pub error: Option<ErrorEstimate>,
    /// Failure of the last checkpoint.
    pub checkpoint_error: Option<JobError>,
}

impl Rendered {
    /// Pictures of every technique over all iterations, if the plan has them.
    pub fn pyramid(&self) -> Option<Cow<'_, Pyramid>> {
        let mut pyramids = self.integrators.iter().filter_map(|i| i.pyramid());
        let mut sum = Cow::Borrowed(pyramids.next()?);
        pyramids.for_each(|other| sum.to_mut().merge(other));
        Some(sum)
    }
}

/// Runs a plan: one estimator, or two halves if there is an error target.
///
/// # Errors
/// If there is not enough memory, a checkpoint cannot be resumed, or the run was interrupted before its first iteration: an earlier picture is
/// worth more than a black one.
pub fn run(scene: &PreparedScene, plan: &Plan, runtime: Runtime) -> Result<Rendered, JobError> {
    let films = if plan.error_target.is_some() { 2 } else { 1 };
    FilmMemory { window: scene.window, films, pyramid_edges: plan.pyramid_edges }.check()?;
    check_light_subpaths(&plan.method)?;
    runtime.pool.install(|| {
        let mut checkpoints = Checkpoints::new(scene, plan);
        let mut estimators = estimators(scene, plan, &checkpoints)?;
        let mut turns = Alternate { budget: plan.budget };
        let mut until_error =
            plan.error_target.map(|target| UntilError::new(target, plan.budget, total_iterations(&estimators)));
        let schedule: &mut dyn Schedule = match &mut until_error {
            Some(until_error) => until_error,
            None => &mut turns,
        };

        runtime.observer.run_begins();
        let outcome =
            run_iterations(scene, &mut estimators, schedule, runtime.interrupt, &mut |progress, estimators| {
                runtime.observer.progress(progress);
                checkpoints.save_if_due(estimators);
            });
        runtime.observer.run_ends();
        if total_iterations(&estimators) == 0 {
            return Err(JobError::Interrupted);
        }
        let checkpoint_error = checkpoints.save_last(&estimators);
        let error = plan.error_target.zip(until_error).map(|(target, until)| ErrorEstimate {
            measure: target.key,
            target: target.value,
            estimate: until.final_estimate(&estimators),
            seeds: half_seeds(plan.seed),
        });
        let mut film = Film::new(scene.window);
        estimators.iter().for_each(|e| film.add(&e.film));
        let integrators = estimators.into_iter().map(|e| e.integrator).collect();
        Ok(Rendered { film, integrators, outcome, error, checkpoint_error })
    })
}

/// The plan's estimators, empty or from a checkpoint.
fn estimators(scene: &PreparedScene, plan: &Plan, checkpoints: &Checkpoints) -> Result<Vec<Estimator>, JobError> {
    let seeds = if plan.error_target.is_some() { half_seeds(plan.seed).to_vec() } else { vec![plan.seed] };
    let mut estimators: Vec<Estimator> =
        seeds.into_iter().map(|seed| Estimator::new(plan.method.build(), scene.window, seed)).collect();
    let mut pyramids: Vec<Option<Pyramid>> =
        estimators.iter().map(|_| plan.pyramid_edges.map(|edges| Pyramid::new(scene.window, edges))).collect();
    if let (Some(path), Some(identity)) = (&plan.resume, &checkpoints.identity) {
        for ((estimator, pyramid), saved) in estimators.iter_mut().zip(&mut pyramids).zip(identity.load(path)?) {
            if !estimator.restore(scene, saved.film, &saved.state) {
                let reason = "the checkpoint does not hold what this integrator has learnt";
                return Err(JobError::Input(format!("{}: {reason}", path.display())));
            }
            *pyramid = saved.pyramid;
        }
    }
    for (estimator, pyramid) in estimators.iter_mut().zip(pyramids) {
        if let Some(pyramid) = pyramid
            && !estimator.integrator.keep_pyramid(pyramid)
        {
            return Err(JobError::Input(format!(
                "{} has no techniques to tell apart; --pyramid needs a bidirectional integrator",
                plan.method.spec.name
            )));
        }
    }
    Ok(estimators)
}

/// Checkpoints of a run.
struct Checkpoints<'a> {
    /// File to save them to.
    path: Option<&'a Path>,
    /// Identity of the render, if checkpoints are saved or resumed.
    identity: Option<RenderIdentity>,
    /// Least wall time between two of them.
    interval: Duration,
    last: Instant,
}

impl Checkpoints<'_> {
    fn new<'a>(scene: &PreparedScene, plan: &'a Plan) -> Checkpoints<'a> {
        let wanted = plan.checkpoint.is_some() || plan.resume.is_some();
        Checkpoints {
            path: plan.checkpoint.as_deref(),
            identity: wanted.then(|| RenderIdentity::new(scene, plan)),
            interval: plan.checkpoint_interval,
            last: Instant::now(),
        }
    }

    /// Saves if the last checkpoint is old enough. A failure is reported by the last one alone: until then the disk
    /// may have room again.
    fn save_if_due(&mut self, estimators: &[Estimator]) {
        if self.last.elapsed() >= self.interval {
            let _ = self.save(estimators);
            self.last = Instant::now();
        }
    }

    /// Saves, if the plan has checkpoints.
    fn save(&self, estimators: &[Estimator]) -> Result<(), CheckpointError> {
        match (self.path, &self.identity) {
            (Some(path), Some(identity)) => identity.save(path, estimators),
            _ => Ok(()),
        }
    }

    /// Saves at the end, to another place if the file cannot be written; returns the failure.
    fn save_last(&self, estimators: &[Estimator]) -> Option<JobError> {
        let (path, identity) = (self.path?, self.identity.as_ref()?);
        write_or_rescue(path, |path| identity.save(path, estimators)).err()
    }
}
