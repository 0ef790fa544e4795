//! Doubt about a reference: unbiased methods that agree with each other and not with it.

use super::converge::Run;
use super::curve::runs_of;

/// Standard errors by which two means differ at most by chance.
const CHANCE: f64 = 4.0;
/// Relative differences of means that are none, whatever the standard errors say.
const TOLERANCE: f64 = 0.02;

/// Mean of the pictures of one method.
struct MethodMean<'a> {
    label: &'a str,
    mean: f64,
    /// Standard error of the mean over seeds.
    error: f64,
}

/// A warning if at least two of the methods, which are unbiased and render all of the scene, agree with each other and
/// not with the reference, in the means of their pictures. It takes at least two seeds to tell.
pub fn doubt(runs: &[Run], methods: &[&str], reference: &[[f64; 3]]) -> Option<String> {
    let expected = mean(reference);
    let means: Vec<MethodMean> =
        methods.iter().filter_map(|label| MethodMean::new(label, &runs_of(runs, label))).collect();
    let against: Vec<&MethodMean> = means.iter().filter(|m| differ(m.mean, expected, m.error)).collect();
    let agree = |a: &MethodMean, b: &MethodMean| !differ(a.mean, b.mean, a.error.hypot(b.error));
    let others = |a: &MethodMean| against.iter().filter(|b| agree(a, b)).map(|b| b.label).collect::<Vec<_>>();
    let group = against.iter().map(|a| (a.mean, others(a))).max_by_key(|(_, group)| group.len());
    let (mean, group) = group.filter(|(_, group)| group.len() > 1)?;
    Some(format!(
        "{} agree with each other and not with the reference: the means of their pictures are about {:.3} of its; do \
         not trust errors against this reference",
        group.join(", "),
        mean / expected,
    ))
}

impl<'a> MethodMean<'a> {
    fn new(label: &'a str, runs: &[&Run]) -> Option<MethodMean<'a>> {
        let means: Vec<f64> = runs.iter().map(|run| mean(&run.picture)).collect();
        let n = means.len() as f64;
        let mean = means.iter().sum::<f64>() / n;
        let squares: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
        (means.len() > 1).then(|| MethodMean { label, mean, error: (squares / (n * (n - 1.0))).sqrt() })
    }
}

/// True if the difference of two means is beyond chance.
fn differ(a: f64, b: f64, error: f64) -> bool {
    (a - b).abs() > CHANCE * error + TOLERANCE * a.abs().max(b.abs())
}

/// Mean over the pixels and channels that are finite.
fn mean(picture: &[[f64; 3]]) -> f64 {
    let finite = || picture.as_flattened().iter().filter(|v| v.is_finite());
    finite().sum::<f64>() / finite().count().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::converge::Point;

    /// Runs of a method with two seeds whose pictures have these values.
    fn runs(method: &str, values: [f64; 2]) -> Vec<Run> {
        let run = |(seed, value): (usize, f64)| Run {
            method: method.into(),
            seed: seed as u64,
            points: vec![Point::default()],
            rays: 0,
            non_finite: 0,
            picture: vec![[value; 3]; 4],
        };
        values.into_iter().enumerate().map(run).collect()
    }

    #[test]
    fn methods_that_agree_against_the_reference_raise_doubt() {
        let all = [runs("path", [0.0, 0.0]), runs("a", [1.0, 1.01]), runs("b", [1.01, 1.0])].concat();
        let doubt = |methods: &[&str], reference: f64| doubt(&all, methods, &[[reference; 3]; 4]);
        let black = doubt(&["path", "a", "b"], 0.0).expect("a and b see light");
        assert!(black.starts_with("a, b agree"), "{black}");
        assert!(doubt(&["path", "a", "b"], 0.8).is_some_and(|text| text.contains("1.256 of its")));
        assert!(doubt(&["path", "a", "b"], 1.0).is_none(), "path is alone");
        assert!(doubt(&["a"], 0.0).is_none(), "one method may be wrong");
    }
}
