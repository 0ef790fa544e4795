//! Evaluation of runs: mean curves over seeds, the time to reach an error, and speed-ups over a baseline.

use super::converge::{Point, Run};
use serde::Serialize;

/// A measure of error that has a curve.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Key in files and on the command line.
    pub key: &'static str,
    /// Name for people.
    pub name: &'static str,
    of: fn(&Point) -> f64,
}

/// Every measure that has a curve.
pub const MEASURES: [Measure; 9] = [
    Measure { key: "relmse", name: "relMSE", of: |p| p.relmse },
    Measure { key: "relmse_trimmed", name: "relMSE trimmed", of: |p| p.relmse_trimmed },
    Measure { key: "relmse_8x8", name: "relMSE of 8x8 blocks", of: |p| p.regions.relmse_8x8 },
    Measure { key: "relmse_16x16", name: "relMSE of 16x16 blocks", of: |p| p.regions.relmse_16x16 },
    Measure { key: "relmse_32x32", name: "relMSE of 32x32 blocks", of: |p| p.regions.relmse_32x32 },
    Measure { key: "relmse_whole", name: "relMSE of the whole picture", of: |p| p.regions.relmse_whole },
    Measure { key: "mape", name: "MAPE", of: |p| p.mape },
    Measure { key: "l1", name: "L1", of: |p| p.l1 },
    Measure { key: "flip", name: "FLIP", of: |p| p.flip },
];

impl Measure {
    /// Its value at a point.
    pub fn of(&self, point: &Point) -> f64 {
        (self.of)(point)
    }

    /// The measure of that key.
    pub fn find(key: &str) -> Option<Measure> {
        MEASURES.into_iter().find(|m| m.key == key)
    }
}

/// Error against time, mean over seeds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Step {
    /// Samples per pixel (mean over seeds at the end of the budget).
    pub iterations: f64,
    /// Seconds, mean over seeds.
    pub seconds: f64,
    /// Error, mean over seeds.
    pub error: f64,
    /// Smallest error of a seed.
    pub low: f64,
    /// Largest error of a seed.
    pub high: f64,
}

/// Runs of one method.
pub fn runs_of<'a>(runs: &'a [Run], method: &str) -> Vec<&'a Run> {
    runs.iter().filter(|r| r.method == method && !r.points.is_empty()).collect()
}

/// The method's mean curve: every doubling that all seeds reached, then the end.
pub fn mean_curve(runs: &[&Run], measure: Measure) -> Vec<Step> {
    let step = |points: &[&Point]| {
        let n = points.len() as f64;
        let errors = || points.iter().map(|p| measure.of(p));
        Step {
            iterations: points.iter().map(|p| p.iterations as f64).sum::<f64>() / n,
            seconds: points.iter().map(|p| p.seconds).sum::<f64>() / n,
            error: errors().sum::<f64>() / n,
            low: errors().fold(f64::INFINITY, f64::min),
            high: errors().fold(f64::NEG_INFINITY, f64::max),
        }
    };
    let Some(first) = runs.first() else { return vec![] };
    let shared = first.points.iter().filter(|p| p.iterations.is_power_of_two()).filter_map(|p| {
        let same: Vec<&Point> =
            runs.iter().filter_map(|r| r.points.iter().find(|q| q.iterations == p.iterations)).collect();
        (same.len() == runs.len()).then(|| step(&same))
    });
    let mut curve: Vec<Step> = shared.collect();
    let ends: Vec<&Point> = runs.iter().filter_map(|r| r.points.last()).collect();
    let end = step(&ends);
    if curve.last().is_none_or(|s| end.iterations > s.iterations) {
        curve.push(end);
    }
    curve
}

/// Seconds after which the error stays below `target`, on straight lines between the points in logarithms. None if
/// that was not reached; the first point's time if it was below from the beginning on.
pub fn time_to_reach(curve: &[(f64, f64)], target: f64) -> Option<f64> {
    let last_above = curve.iter().rposition(|(_, e)| e.is_nan() || *e > target);
    let Some(i) = last_above else { return curve.first().map(|p| p.0) };
    let (t0, e0) = curve[i];
    let &(t1, e1) = curve.get(i + 1)?;
    let share = (e0.ln() - target.ln()) / (e0.ln() - e1.ln());
    let log = t0.ln() + share * (t1.ln() - t0.ln());
    Some(if log.is_finite() { log.exp() } else { t1 })
}

/// Speed-up of a method over the baseline: how much sooner it reaches an error.
#[derive(Clone, Debug, Serialize)]
pub struct SpeedUp {
    /// Method.
    pub method: String,
    /// Measure's key.
    pub measure: &'static str,
    /// The error that is to be reached.
    pub target: f64,
    /// Seconds of the method, of the mean curve; none if it does not get there.
    pub seconds: Option<f64>,
    /// Seconds of the baseline.
    pub baseline_seconds: Option<f64>,
    /// Baseline's seconds over the method's.
    pub ratio: Option<f64>,
    /// Smallest and largest of `ratio` and the ratios of the seeds, each with its own error to reach if there is no
    /// target; none if not all get there.
    pub spread: Option<[f64; 2]>,
}

/// Speed-ups of all methods over `baseline`. Without a target it is, for each pair, the smallest error that both
/// reach: the larger of the two errors at the end.
pub fn speed_ups(
    runs: &[Run],
    methods: &[String],
    baseline: &str,
    measure: Measure,
    target: Option<f64>,
) -> Vec<SpeedUp> {
    let pairs = |run: &Run| run.points.iter().map(|p| (p.seconds, measure.of(p))).collect::<Vec<_>>();
    let means = |method: &str| -> Vec<(f64, f64)> {
        mean_curve(&runs_of(runs, method), measure).iter().map(|s| (s.seconds, s.error)).collect()
    };
    let base = means(baseline);
    let one = |method: &String| {
        let own = means(method);
        let end = |curve: &[(f64, f64)]| curve.last().map_or(f64::NAN, |p| p.1);
        let error = target.unwrap_or_else(|| end(&own).max(end(&base)));
        let (seconds, baseline_seconds) = (time_to_reach(&own, error), time_to_reach(&base, error));
        let of_seeds: Option<Vec<f64>> = runs_of(runs, method)
            .iter()
            .zip(runs_of(runs, baseline))
            .map(|(own, base)| {
                let (own, base) = (pairs(own), pairs(base));
                // A seed of its own has its own smallest error that both reach.
                let error = target.unwrap_or_else(|| end(&own).max(end(&base)));
                Some(time_to_reach(&base, error)? / time_to_reach(&own, error)?)
            })
            .collect();
        let ratio = baseline_seconds.zip(seconds).map(|(b, s)| b / s);
        // The mean curve need not lie between the curves of the seeds at an error that is not theirs.
        let spread = of_seeds.filter(|r| !r.is_empty()).map(|ratios| {
            let all = || ratios.iter().copied().chain(ratio);
            [all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max)]
        });
        SpeedUp {
            method: method.clone(),
            measure: measure.key,
            target: error,
            seconds,
            baseline_seconds,
            ratio,
            spread,
        }
    };
    methods.iter().map(one).collect()
}

/// All points as comma-separated values, one row each. Quotes protect labels.
pub fn csv<'a>(scenes: impl Iterator<Item = (&'a str, &'a [Run])>) -> String {
    let mut out = String::from("scene,method,seed,iterations,seconds,mean_ratio,mse");
    for m in MEASURES {
        out.push(',');
        out.push_str(m.key);
    }
    out.push('\n');
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    for (scene, runs) in scenes {
        for (run, p) in runs.iter().flat_map(|r| r.points.iter().map(move |p| (r, p))) {
            let (scene, method) = (quoted(scene), quoted(&run.method));
            out.push_str(&format!("{scene},{method},{},{},{:.6}", run.seed, p.iterations, p.seconds));
            for v in [p.mean_ratio, p.mse].into_iter().chain(MEASURES.iter().map(|m| m.of(p))) {
                out.push_str(&format!(",{v:e}"));
            }
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::regions::RegionErrors;

    fn run(method: &str, seed: u64, error: impl Fn(f64) -> f64, rate: f64) -> Run {
        let points = [1, 2, 4, 8, 16, 23].map(|n| {
            let e = error(n as f64);
            Point {
                iterations: n,
                seconds: n as f64 / rate,
                mape: e,
                relmse: e,
                relmse_trimmed: e,
                regions: RegionErrors { relmse_8x8: e, relmse_16x16: e, relmse_32x32: e, relmse_whole: e },
                l1: e,
                mse: e,
                flip: e,
                mean_ratio: 1.0,
            }
        });
        Run { method: method.into(), seed, points: points.into(), rays: 0, non_finite: 0, picture: vec![] }
    }

    #[test]
    fn times_are_interpolated_in_logarithms() {
        let curve: Vec<(f64, f64)> = [1.0, 2.0, 4.0, 8.0].map(|t| (t, 0.5 / t)).into();
        for t in [1.0, 1.7, 3.3, 8.0] {
            assert!((time_to_reach(&curve, 0.5 / t).unwrap() - t).abs() < 1e-12);
        }
        assert_eq!(time_to_reach(&curve, 0.9), Some(1.0));
        assert_eq!(time_to_reach(&curve, 0.01), None);
        // A firefly late on: the early times below the target do not count.
        assert!((time_to_reach(&[(1.0, 0.1), (2.0, 4.0), (3.0, 1.0)], 1.0).unwrap() - 3.0).abs() < 1e-12);
        assert_eq!(time_to_reach(&[], 1.0), None);
    }

    #[test]
    fn a_range_contains_its_mean() {
        // The two seeds end at very different errors, and so does the mean of their curves.
        let runs = [
            run("a", 1, |n| 1.0 / n, 1.0),
            run("a", 2, |n| 100.0 / n, 1.0),
            run("b", 1, |n| 0.3 / n.sqrt(), 2.0),
            run("b", 2, |n| 90.0 / (n * n), 2.0),
        ];
        let found = speed_ups(&runs, &["b".to_owned()], "a", MEASURES[0], None).remove(0);
        let ([low, high], ratio) = (found.spread.unwrap(), found.ratio.unwrap());
        assert!(low <= ratio && ratio <= high, "{low} {ratio} {high}");
    }

    #[test]
    fn a_method_of_twice_the_rate_is_twice_as_fast() {
        let runs = [
            run("a", 1, |n| 1.0 / n, 1.0),
            run("a", 2, |n| 1.2 / n, 1.0),
            run("b", 1, |n| 1.0 / n, 2.0),
            run("b", 2, |n| 1.2 / n, 2.0),
            run("c", 1, |n| 4.0 / n, 1.0),
            run("c", 2, |n| 4.0 / n, 1.0),
        ];
        let methods = ["a", "b", "c"].map(String::from);
        let found = speed_ups(&runs, &methods, "a", MEASURES[0], None);
        assert_eq!(found[0].ratio, Some(1.0));
        assert!((found[1].ratio.unwrap() - 2.0).abs() < 1e-9);
        assert!((found[1].spread.unwrap()[0] - 2.0).abs() < 1e-9 && (found[1].spread.unwrap()[1] - 2.0).abs() < 1e-9);
        assert!((found[2].ratio.unwrap() - 1.1 / 4.0).abs() < 1e-9, "{:?}", found[2]);
        let far = speed_ups(&runs, &methods, "a", MEASURES[0], Some(1e-6));
        assert!(far.iter().all(|s| s.ratio.is_none()));
        let curve = mean_curve(&runs_of(&runs, "a"), MEASURES[0]);
        assert_eq!(curve.len(), 6);
        assert_eq!((curve[1].low, curve[1].high), (0.5, 0.6));
        let text = csv([("s,t", &runs[..])].into_iter());
        assert_eq!(text.lines().count(), 37);
        assert!(text.lines().nth(1).unwrap().starts_with("\"s,t\",\"a\",1,1,1.000000,1e0,"), "{text}");
    }
}
