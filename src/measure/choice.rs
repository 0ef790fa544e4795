//! The method of a reference that nobody has named: short renders of all candidates, with several seeds, tell which of
//! them agree and which of these is the best.
//!
//! A method that finds light rarely has a dark picture of small variance until it finds some, so that its own variance
//! says nothing of its error. Light that is not found makes a picture darker, hence the candidate whose mean is
//! certainly largest leaves the least out. Those that agree with it by a Z-test of the means of pictures are trusted,
//! and of these the one with the least variance in equal time is taken.

use crate::math::hash::mix64;
use crate::prepared::PreparedScene;
use crate::render::schedule::Alternate;
use crate::render::{Budget, Estimator, JobError, Method, Runtime, run_iterations};
use std::sync::atomic::Ordering;

/// Short renders of each candidate.
pub const PILOTS: u64 = 4;
/// Standard errors by which two means differ at most by chance.
const AGREEMENT: f64 = 3.0;
/// Relative differences of means that are none, whatever the standard errors say.
const TOLERANCE: f64 = 0.01;

/// Method of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Index of the candidate.
    pub best: usize,
    /// Index of another candidate that agrees with it by a Z-test; none if no other does.
    pub confirmed_by: Option<usize>,
}

/// Outcome of the short renders of one candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pilot {
    /// Mean of the picture over pixels, channels and seeds.
    mean: f64,
    /// Standard error of that mean, from the seeds.
    error: f64,
    /// Relative variance of pixels over seeds, times the seconds that they took.
    variance_seconds: f64,
}

/// Renders the candidates shortly, each [`PILOTS`] times within `budget`, and chooses.
///
/// # Errors
/// If interrupted.
pub fn choose(
    scene: &PreparedScene,
    candidates: &[Method],
    budget: Budget,
    runtime: Runtime,
) -> Result<Choice, JobError> {
    let mut pilots = vec![];
    for method in candidates {
        let pilot = runtime.pool.install(|| pilot(scene, method, budget, runtime));
        if runtime.interrupt.load(Ordering::Relaxed) {
            return Err(JobError::Interrupted);
        }
        pilots.push(pilot);
    }
    Ok(choose_from(&pilots))
}

fn pilot(scene: &PreparedScene, method: &Method, budget: Budget, runtime: Runtime) -> Pilot {
    let (mut pictures, mut seconds) = (vec![], 0.0);
    for k in 0..PILOTS {
        let mut estimators =
            [Estimator::new(method.build(), scene.window, mix64(super::reference::REFERENCE_SEED + k))];
        let mut schedule = Alternate { budget };
        let outcome = run_iterations(scene, &mut estimators, &mut schedule, runtime.interrupt, &mut |_, _| {});
        seconds += outcome.wall.as_secs_f64();
        pictures.push(estimators[0].film.mean_f64());
    }
    Pilot::new(&pictures, seconds)
}

impl Pilot {
    /// From the pictures of all seeds and the seconds that they took together.
    fn new(pictures: &[Vec<[f64; 3]>], seconds: f64) -> Pilot {
        let mean_of = |p: &Vec<[f64; 3]>| p.as_flattened().iter().sum::<f64>() / p.as_flattened().len().max(1) as f64;
        let means: Vec<f64> = pictures.iter().map(mean_of).collect();
        let (mean, variance) = moments(means.iter().copied());
        let values = pictures.first().map_or(0, |p| p.as_flattened().len());
        let relative = |i: usize| {
            let (mean, variance) = moments(pictures.iter().map(|p| p.as_flattened()[i]));
            variance / (mean * mean + 0.01)
        };
        let relative_variance = (0..values).map(relative).sum::<f64>() / values.max(1) as f64;
        let n = pictures.len().max(1) as f64;
        Pilot { mean, error: (variance / n).sqrt(), variance_seconds: relative_variance * seconds }
    }

    fn agrees_with(&self, other: &Pilot) -> bool {
        let error = self.error.hypot(other.error);
        (self.mean - other.mean).abs() <= AGREEMENT * error + TOLERANCE * self.mean.abs().max(other.mean.abs())
    }
}

/// Mean and variance of some values.
fn moments(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let squares: f64 = values.map(|v| (v - mean).powi(2)).sum();
    (mean, squares / (n - 1.0).max(1.0))
}

/// The choice between candidates, of which there is at least one.
fn choose_from(pilots: &[Pilot]) -> Choice {
    let by = |key: fn(&Pilot) -> f64, of: &[usize]| {
        of.iter().copied().min_by(|&a, &b| key(&pilots[a]).total_cmp(&key(&pilots[b]))).unwrap_or(0)
    };
    let all: Vec<usize> = (0..pilots.len()).collect();
    let brightest = by(|p| AGREEMENT * p.error - p.mean, &all);
    let trusted: Vec<usize> =
        all.into_iter().filter(|&i| i == brightest || pilots[i].agrees_with(&pilots[brightest])).collect();
    let best = by(|p| p.variance_seconds, &trusted);
    let others: Vec<usize> =
        trusted.into_iter().filter(|&i| i != best && pilots[i].agrees_with(&pilots[best])).collect();
    let confirmed_by = (!others.is_empty()).then(|| by(|p| p.variance_seconds, &others));
    Choice { best, confirmed_by }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pilot(mean: f64, error: f64, variance_seconds: f64) -> Pilot {
        Pilot { mean, error, variance_seconds }
    }

    #[test]
    fn a_method_that_sees_nothing_is_not_the_best() {
        let black = pilot(0.0, 0.0, 0.0);
        let nearly_black = pilot(0.01, 0.002, 0.1);
        let [good, better] = [pilot(1.0, 0.05, 4.0), pilot(1.04, 0.02, 1.0)];
        let firefly = pilot(3.0, 2.5, 1e6);
        let choice = choose_from(&[black, nearly_black, good, better, firefly]);
        assert_eq!(choice, Choice { best: 3, confirmed_by: Some(2) });
        // Nothing else sees the light: the choice is made, and not confirmed.
        assert_eq!(choose_from(&[black, nearly_black, good]), Choice { best: 2, confirmed_by: None });
        assert_eq!(choose_from(&[good]), Choice { best: 0, confirmed_by: None });
        // All black: they agree.
        assert_eq!(choose_from(&[black, black]), Choice { best: 0, confirmed_by: Some(1) });
    }

    #[test]
    fn pilots_have_the_moments_of_their_pictures() {
        let pictures = [[1.0; 3], [3.0; 3], [1.0; 3], [3.0; 3]].map(|p| vec![p, [0.0; 3]]);
        let found = Pilot::new(&pictures, 2.0);
        assert_eq!(found.mean, 1.0);
        // Means .5, 1.5, .5, 1.5 have the variance 1/3.
        assert!((found.error - (1.0f64 / 12.0).sqrt()).abs() < 1e-12);
        assert!((found.variance_seconds - 2.0 * 0.5 * (4.0 / 3.0) / 4.01).abs() < 1e-12);
    }
}
