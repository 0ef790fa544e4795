//! Connection factors against the empirical density of the light sub-paths that are drawn.
//!
//! Any weights that sum to one are unbiased, so no picture can show a wrong factor. Here light sub-paths are toys:
//! prefix v occurs with the known density p(v), sets of M sub-paths are drawn many times, and one prefix is resampled
//! from each set as the method does. The number of draws of v over N p(v) is the true c(v).
//!
//! The factors of the papers replace the sum over the other sub-paths of a set by its mean (Nabata et al. 2020,
//! "Resampling-aware weighting functions", eq. 14). The tolerances are that approximation's errors for these toys:
//! measured, rounded up. They go to zero as M grows.

use lightsieve::math::Rgb;
use lightsieve::math::hash::HashRng;
use lightsieve::mis::factors::per_length::{DISTRIBUTIONS, LENGTHS};
use lightsieve::mis::factors::{
    CacheTerm, CacheTerms, LengthTerm, LengthTerms, NormalizationEstimate, PerCacheFactor, PerLengthFactor,
    PerLengthMeans, RecordMixtureFactor, RecordNormalization, RisFactor, Stages, UniformFactor,
};
use lightsieve::mis::{ConnectionFactor, IncidentSubpath, ResamplingTarget};
use std::sync::Arc;

/// Sets of sub-paths that are drawn.
const SETS: usize = 60_000;
/// Number of different sub-paths, each of one connectable vertex.
const KINDS: usize = 6;
/// Probability of each.
const P: [f64; KINDS] = [0.3, 0.25, 0.2, 0.12, 0.08, 0.05];
/// q̂₂/p of each.
const FULL: [f64; KINDS] = [0.6, 1.0, 0.8, 1.6, 2.4, 1.2];
/// q̂₁/p of each.
const FIRST: [f64; KINDS] = [1.0, 0.8, 1.4, 1.2, 1.6, 2.0];

fn mean(of: [f64; KINDS]) -> f64 {
    P.iter().zip(of).map(|(p, value)| p * value).sum()
}

/// Draws an index in proportion to `weights`.
fn draw(weights: &[f64], rng: &mut HashRng) -> usize {
    let mut u = f64::from(rng.next_f32()) * weights.iter().sum::<f64>();
    let found = weights.iter().position(|w| {
        u -= w;
        u < 0.0
    });
    found.unwrap_or(weights.len() - 1)
}

/// The true c of each kind: `select` draws the number of one sub-path of a set, of which it is given the kinds.
fn true_factors(m: usize, mut select: impl FnMut(&[usize], &mut HashRng) -> Option<usize>) -> [f64; KINDS] {
    let mut rng = HashRng::new(3, 1, 4, m as u64);
    let mut counts = [0usize; KINDS];
    for _ in 0..SETS {
        let set: Vec<usize> = (0..m).map(|_| draw(&P, &mut rng)).collect();
        if let Some(i) = select(&set, &mut rng) {
            counts[set[i]] += 1;
        }
    }
    std::array::from_fn(|k| counts[k] as f64 / (SETS as f64 * P[k]))
}

/// Largest relative error of `c` against the true factors.
fn error(truth: [f64; KINDS], c: impl Fn(usize) -> f64) -> f64 {
    (0..KINDS).map(|k| (c(k) / truth[k] - 1.0).abs()).fold(0.0, f64::max)
}

/// Checks a factor, and that wrong ones would be found: no factor, that of infinitely many sub-paths, and that of half
/// as many.
fn check(what: &str, truth: [f64; KINDS], tolerance: f64, c: impl Fn(usize, f64) -> f64, m: f64) {
    let own = error(truth, |k| c(k, m));
    println!("{what}: c is off by {own:.4}, allowed {tolerance}");
    assert!(own < tolerance, "{what}: c is off by {own} where {tolerance} is allowed, truth {truth:?}");
    let none = error(truth, |_| 1.0);
    assert!(none > 1.5 * tolerance, "{what}: c = 1 would pass with {none}");
    let inverse = error(truth, |k| 1.0 / c(k, m));
    assert!(inverse > 1.5 * tolerance, "{what}: 1/c would pass with {inverse}");
    if m < 4.0 {
        let limit = error(truth, |k| c(k, 1e9));
        assert!(limit > 1.5 * tolerance, "{what}: c of infinitely many would pass with {limit}");
    }
}

const STAGES: Stages = Stages { paths: 1.0, second_stage: None, epsilon: 1e-3, vertices_per_path: 1.0 };

fn incident(k: usize) -> IncidentSubpath {
    let target_over_pdf = ResamplingTarget { full: FULL[k] as f32, first_stage: FIRST[k] as f32 };
    IncidentSubpath { s: 2, throughput: Rgb::WHITE, target_over_pdf, distance2: 1.0 }
}

fn q() -> ResamplingTarget {
    ResamplingTarget { full: mean(FULL) as f32, first_stage: mean(FIRST) as f32 }
}

/// P = (1 − u) P_target + u P_uniform.
fn mixture(target: &[f64], u: f64) -> Vec<f64> {
    let (sum, n) = (target.iter().sum::<f64>(), target.len() as f64);
    target.iter().map(|w| if sum > 0.0 { (1.0 - u) * w / sum + u / n } else { 1.0 / n }).collect()
}

#[test]
fn one_stage_drawn_by_a_mixture() {
    for (m, tolerance) in [(2, 0.06), (8, 0.04), (64, 0.025)] {
        let truth = true_factors(m, |set, rng| {
            let target: Vec<f64> = set.iter().map(|&k| FULL[k]).collect();
            Some(draw(&mixture(&target, 0.25), rng))
        });
        let at = NormalizationEstimate { q: q(), ..NormalizationEstimate::default() };
        let c = |k: usize, m: f64| {
            let stages = Stages { paths: m as f32, ..STAGES };
            let factor = RisFactor { stages, uniform_share: 0.25, min_unseen_fraction: 0.0 };
            f64::from(factor.c(&incident(k), &at))
        };
        check(&format!("mixture, M = {m}"), truth, tolerance, c, m as f64);
    }
}

#[test]
fn two_stages_drawn_by_a_mixture() {
    for (m, m2, tolerance) in [(8, 2, 0.08), (64, 2, 0.06), (64, 16, 0.035)] {
        let truth = true_factors(m, |set, rng| {
            let first: Vec<f64> = set.iter().map(|&k| FIRST[k]).collect();
            let kept: Vec<usize> = (0..m2).map(|_| draw(&first, rng)).collect();
            // q̂₂/(p P₁) is proportional to q̂₂/q̂₁.
            let second: Vec<f64> = kept.iter().map(|&i| FULL[set[i]] / FIRST[set[i]]).collect();
            Some(kept[draw(&mixture(&second, 0.25), rng)])
        });
        let at = NormalizationEstimate { q: q(), ..NormalizationEstimate::default() };
        let c = |k: usize, m: f64| {
            let stages = Stages { paths: m as f32, second_stage: Some(m2 as f32), ..STAGES };
            let factor = RisFactor { stages, uniform_share: 0.25, min_unseen_fraction: 0.0 };
            f64::from(factor.c(&incident(k), &at))
        };
        check(&format!("two stages, M = {m}, M2 = {m2}"), truth, tolerance, c, m as f64);
    }
}

/// Two cache points, the second of which does not see two of the sub-paths, and the virtual one.
const SEEN: [[f64; KINDS]; 2] = [[1.0; KINDS], [1.0, 0.0, 1.0, 1.0, 0.0, 1.0]];

fn cache_terms(k: usize) -> CacheTerms {
    let mut terms = CacheTerms { count: 2, ..CacheTerms::default() };
    for (term, seen) in terms.terms.iter_mut().zip(&SEEN) {
        let q = mean(std::array::from_fn(|k| FULL[k] * seen[k]));
        *term = CacheTerm {
            full: Rgb::grey((FULL[k] * seen[k]) as f32),
            first_stage: FIRST[k] as f32,
            q: ResamplingTarget { full: q as f32, first_stage: mean(FIRST) as f32 },
        };
    }
    terms
}

fn visible(set: &[usize], cache: usize) -> Vec<f64> {
    set.iter().map(|&k| FULL[k] * SEEN[cache][k]).collect()
}

#[test]
fn cache_points_with_visibility() {
    for (m, tolerance) in [(2, 0.165), (8, 0.11), (64, 0.05)] {
        let factor =
            |per_cache: bool, m: f64| PerCacheFactor { stages: Stages { paths: m as f32, ..STAGES }, per_cache };
        // One technique: a mixture of both cache points and a uniform pmf.
        let truth = true_factors(m, |set, rng| {
            let parts = [mixture(&visible(set, 0), 0.0), mixture(&visible(set, 1), 0.0)];
            let uniform = 1.0 / m as f64;
            let p: Vec<f64> = (0..m).map(|i| (parts[0][i] + parts[1][i] + uniform) / 3.0).collect();
            Some(draw(&p, rng))
        });
        let c = |k: usize, m: f64| f64::from(factor(false, m).c(&incident(k), &cache_terms(k)));
        check(&format!("mixture with visibility, M = {m}"), truth, tolerance, c, m as f64);
        // Three techniques: the factor of the first cache point, which is chosen with probability 1/3.
        let truth = true_factors(m, |set, rng| {
            let target = visible(set, 0);
            (rng.next_f32() < 1.0 / 3.0).then(|| draw(&target, rng))
        });
        let c = |k: usize, m: f64| {
            let (c, share) = factor(true, m).c_and_share(&incident(k), &cache_terms(k), 0);
            f64::from(c * share)
        };
        check(&format!("per cache, M = {m}"), truth, tolerance, c, m as f64);
    }
}

#[test]
fn records_drawn_by_a_mixture_of_pmfs() {
    for (m, tolerance) in [(2, 0.06), (8, 0.04), (64, 0.03)] {
        // ⅖ seen + ⅖ open, here both of the same weights, + ⅕ uniform.
        let truth = true_factors(m, |set, rng| {
            let target: Vec<f64> = set.iter().map(|&k| FULL[k]).collect();
            Some(draw(&mixture(&target, 0.2), rng))
        });
        let c = |k: usize, m: f64| {
            let stages = Stages { paths: m as f32, ..STAGES };
            let factor = RecordMixtureFactor { stages, uniform_share: 0.2, unseen_fraction: 0.0 };
            f64::from(factor.c(&incident(k), &RecordNormalization(mean(FULL) as f32)))
        };
        check(&format!("record mixture, M = {m}"), truth, tolerance, c, m as f64);
    }
}

/// The max combination of k pmfs differs by at most a factor of k from their mean, which stands for it; over all
/// sub-paths both sum up to one. k = 2 here: one by the light, and the uniform one.
#[test]
fn lengths_drawn_by_the_max_heuristic() {
    for m in [2usize, 8, 64] {
        let truth = true_factors(m, |set, rng| {
            let target: Vec<f64> = set.iter().map(|&k| FULL[k]).collect();
            let (by_light, uniform) = (mixture(&target, 0.0), 1.0 / m as f64);
            let won = |light: bool| -> f64 {
                let wins = |p: &&f64| (**p > uniform) == light;
                by_light.iter().filter(wins).map(|p| p.max(uniform)).sum()
            };
            let sums = [won(false), won(true)];
            let winners = sums.iter().filter(|s| **s > 0.0).count() as f64;
            let p = |p: &f64| p.max(uniform) / (sums[usize::from(*p > uniform)] * winners);
            Some(draw(&by_light.iter().map(p).collect::<Vec<_>>(), rng))
        });
        let mut means = [[0.0; DISTRIBUTIONS]; LENGTHS];
        means[2] = [mean(FULL) as f32, 0.0, 0.0];
        let means = Arc::new(PerLengthMeans { means: vec![means], numbers: vec![m as f32] });
        let factor = PerLengthFactor { means, epsilon: 1e-3 };
        let c: [f64; KINDS] = std::array::from_fn(|k| {
            let mut terms = LengthTerms { count: 1, ..LengthTerms::default() };
            let light = Rgb::grey(FULL[k] as f32);
            terms.terms[0] = LengthTerm { record: 0, seen: light, open: light };
            f64::from(factor.c(&incident(k), &terms))
        });
        let off = error(truth, |k| c[k]);
        println!("per length, M = {m}: c is off by {off:.4}, sums up to {:.4}", mean(c));
        assert!(off < 0.4, "M = {m}: off by {off}, truth {truth:?}, c {c:?}");
        assert!((mean(c) - 1.0).abs() < 0.05, "M = {m}: sums up to {}", mean(c));
        let wrong = error(truth, |k| 1.0 / c[k]);
        println!("per length, M = {m}: 1/c is off by {wrong:.4}");
        assert!(m < 8 || wrong > 2.0 * off, "M = {m}: 1/c would pass with {wrong}");
    }
}

/// Sub-paths of one to three vertices, from all of which one is drawn uniformly.
#[test]
fn vertices_drawn_uniformly() {
    const VERTICES: [usize; KINDS] = [1, 2, 3, 1, 2, 3];
    let mut rng = HashRng::new(2, 7, 1, 8);
    let vertices_per_path = mean(VERTICES.map(|n| n as f64));
    for (m, tolerance) in [(8, 0.11), (64, 0.04)] {
        let mut counts = [0usize; KINDS];
        for _ in 0..SETS {
            let set: Vec<usize> = (0..m).map(|_| draw(&P, &mut rng)).collect();
            let all: Vec<usize> = set.iter().flat_map(|&k| std::iter::repeat_n(k, VERTICES[k])).collect();
            counts[all[(rng.next_f32() * all.len() as f32) as usize]] += 1;
        }
        // For each vertex of a sub-path.
        let truth = std::array::from_fn(|k| counts[k] as f64 / (SETS as f64 * P[k] * VERTICES[k] as f64));
        let factor = UniformFactor { vertices_per_path: vertices_per_path as f32 };
        let c = f64::from(factor.c(&incident(0), &()));
        let off = error(truth, |_| c);
        println!("uniform, M = {m}: c is off by {off:.4}, allowed {tolerance}");
        assert!(off < tolerance && error(truth, |_| 1.0) > 1.5 * tolerance, "M = {m}: {c} {truth:?}");
    }
}
