//! How several pmfs of light vertices at a record become one.
//!
//! * *Seen*: in proportion to the light that a vertex brings to the record, visibility included (V of Noël and Biri 2015, eq. 6; F of
//!   Georgiev et al. 2012);
//! * *open*: the same without visibility (U, eq. 7);
//! * *bounded*: in proportion to f_y/p alone, without a geometry term that may be huge (B; records on surfaces only);
//! * *uniform* (C, eq. 8).
//!
//! *By the max heuristic*, as published, one of them is chosen with equal probability, and produces only the vertices
//! to which it gives the largest probability. Since they share no vertex then, all of them together are one pmf: each
//! vertex has the probability of its winner, normalised over the vertices that it wins, over the number of pmfs that
//! win any (§4.3, premultiplied).
//!
//! DEVIATION: *as a mixture* they keep their vertices: P = ⅖ P_seen + ⅖ P_open + ⅕ P_uniform. A vertex that two of them
//! produce is then drawn more often instead of being left to one, and most draws go where the light is. These shares
//! were the best of six in three scenes; others near them cost up to a fifth more time for the same error.
//!
//! All but the uniform one, which alone reaches everything, can be switched off.

use crate::math::cdf::CdfRows;

/// Pmfs that are combined.
const DISTRIBUTIONS: usize = 4;

/// Sums over vertices of the weights of seen, open and bounded.
pub(super) type Sums = [f64; DISTRIBUTIONS - 1];

/// Shares of the mixture.
const SEEN: f64 = 0.4;
const OPEN: f64 = 0.4;
pub(super) const UNIFORM: f64 = 0.2;

/// A pmf that can be the only one beside the uniform one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Distribution {
    Visible,
    Unoccluded,
    Uniform,
}

fn sums_of(weights: [&[f32]; DISTRIBUTIONS - 1]) -> Sums {
    weights.map(|w| w.iter().map(|v| f64::from(*v)).sum::<f64>())
}

/// 1/sum, or nothing of a distribution that does not exist.
fn scale(sum: f64) -> f64 {
    if sum > 0.0 && sum.is_finite() { 1.0 / sum } else { 0.0 }
}

/// Combines pmfs, each given up to a factor, by the max heuristic into a new row of probabilities.
pub(super) fn by_max(weights: [&[f32]; DISTRIBUTIONS - 1], rows: &mut CdfRows) -> Sums {
    let n = weights[0].len();
    let sums = sums_of(weights);
    let scales = sums.map(scale);
    let uniform = 1.0 / n as f64;
    let winner = |i: usize| {
        let mut best = (DISTRIBUTIONS - 1, uniform);
        for (d, w) in weights.iter().enumerate() {
            let p = f64::from(w[i]) * scales[d];
            if p > best.1 {
                best = (d, p);
            }
        }
        best
    };
    let mut won = [0.0; DISTRIBUTIONS];
    for i in 0..n {
        let (d, p) = winner(i);
        won[d] += p;
    }
    let winners = won.iter().filter(|&&w| w > 0.0).count() as f64;
    rows.push(|i| {
        let (d, p) = winner(i);
        p / (won[d] * winners)
    });
    sums
}

/// Factors from the weights of seen and open to their parts of a mixture's probability. Where one of them has no
/// weight, the other gets its share; where both have none, all of the mixture is uniform, and both factors are zero.
pub(super) fn mixture([seen, open, _]: Sums) -> [f64; 2] {
    match [seen, open].map(scale) {
        [seen, 0.0] => [(SEEN + OPEN) * seen, 0.0],
        [0.0, open] => [0.0, (SEEN + OPEN) * open],
        [seen, open] => [SEEN * seen, OPEN * open],
    }
}

/// Combines them as a mixture.
pub(super) fn by_mixture(weights: [&[f32]; DISTRIBUTIONS - 1], rows: &mut CdfRows) -> Sums {
    let sums = sums_of(weights);
    let shares = mixture(sums);
    let [seen, open, _] = weights;
    let uniform = if shares != [0.0; 2] { UNIFORM } else { 1.0 } / seen.len() as f64;
    rows.push(|i| f64::from(seen[i]) * shares[0] + f64::from(open[i]) * shares[1] + uniform);
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    type Combine = fn([&[f32]; 3], &mut CdfRows) -> Sums;

    fn probabilities(combine: Combine, weights: [&[f32]; 3]) -> Vec<f32> {
        let n = weights[0].len();
        let mut rows = CdfRows::new(n, 1);
        combine(weights, &mut rows);
        (0..n).map(|i| rows.probability(0, i)).collect()
    }

    fn are(probabilities: &[f32], expected: &[f32]) {
        for (p, expected) in probabilities.iter().zip(expected) {
            assert!((p - expected).abs() < 1e-6, "{p} {expected}");
        }
    }

    #[test]
    fn the_largest_probability_wins() {
        // Seen: 0.8 0.2 0 0; open: 0.1 0.1 0.7 0.1; uniform: 0.25. The first two are won by seen and uniform, then open
        // and uniform.
        let p = probabilities(by_max, [&[8.0, 2.0, 0.0, 0.0], &[1.0, 1.0, 7.0, 1.0], &[0.0; 4]]);
        are(&p, &[1.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0, 1.0 / 6.0]);
    }

    #[test]
    fn a_mixture_adds_up_its_parts() {
        let open = [1.0, 1.0, 7.0, 1.0];
        let p = probabilities(by_mixture, [&[8.0, 2.0, 0.0, 0.0], &open, &[0.0; 4]]);
        are(&p, &[0.32 + 0.04 + 0.05, 0.08 + 0.04 + 0.05, 0.28 + 0.05, 0.04 + 0.05]);
        // Nothing is seen, only what is seen is asked for, or nothing comes near.
        let p = probabilities(by_mixture, [&[0.0; 4], &open, &[0.0; 4]]);
        are(&p, &[0.08 + 0.05, 0.08 + 0.05, 0.56 + 0.05, 0.08 + 0.05]);
        let p = probabilities(by_mixture, [&[8.0, 2.0, 0.0, 0.0], &[0.0; 4], &[0.0; 4]]);
        are(&p, &[0.64 + 0.05, 0.16 + 0.05, 0.05, 0.05]);
        are(&probabilities(by_mixture, [&[0.0; 4]; 3]), &[0.25; 4]);
    }

    #[test]
    fn everything_can_be_drawn() {
        for weights in [[[0.0; 5]; 3], [[1e30, 0.0, 1e-30, 1.0, 0.0], [1e-20; 5], [0.0, 0.0, 0.0, 0.0, 1.0]]] {
            for (combine, least) in [(by_max as Combine, 0.24), (by_mixture as Combine, 0.19)] {
                let p = probabilities(combine, [&weights[0], &weights[1], &weights[2]]);
                assert!((p.iter().sum::<f32>() - 1.0).abs() < 1e-6);
                assert!(p.iter().all(|&p| p >= least / 5.0), "{p:?}");
            }
        }
    }
}
