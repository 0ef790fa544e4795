//! Alias tables. Distributions as cumulative sums are in [`super::cdf`].

use super::measure::Pmf;

/// Constant-time choice with given probabilities (Walker 1974; built by Vose's method, 1991).
///
/// One random number serves for both the column and the coin. A float has 24 random bits, so with n entries a
/// probability is met to about n·2^-24: good to four digits up to a thousand entries, to one percent up to some hundred
/// thousand.
#[derive(Clone, Debug, Default)]
pub struct AliasTable {
    columns: Vec<Column>,
    pmf: Vec<f32>,
    total: f64,
}

#[derive(Clone, Copy, Debug)]
struct Column {
    /// Chance to stay in the column.
    threshold: f32,
    /// Where to go otherwise.
    alias: u32,
    /// Probability of this choice and of the other, here so that a choice touches nothing else.
    pmf: f32,
    alias_pmf: f32,
}

impl AliasTable {
    /// A table for `weights`; negative, NaN and infinite weights count as zero.
    pub fn new(weights: &[f32]) -> AliasTable {
        let clean = |w: f32| if w.is_finite() && w > 0.0 { f64::from(w) } else { 0.0 };
        let total: f64 = weights.iter().map(|&w| clean(w)).sum();
        if total <= 0.0 {
            return AliasTable { columns: Vec::new(), pmf: vec![0.0; weights.len()], total: 0.0 };
        }
        let n = weights.len();
        let mut scaled: Vec<f64> = weights.iter().map(|&w| clean(w) / total * n as f64).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
        let heaviest = (0..n).max_by(|&a, &b| scaled[a].total_cmp(&scaled[b])).unwrap_or(0);
        let column = |threshold, i: usize| Column { threshold, alias: i as u32, pmf: 0.0, alias_pmf: 0.0 };
        let mut columns: Vec<Column> = (0..n).map(|i| column(1.0, i)).collect();
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            columns[s] = column(scaled[s] as f32, l);
            scaled[l] -= 1.0 - scaled[s];
            if scaled[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // Rounding can leave columns that should hold exactly one. An impossible entry among them must stay impossible.
        for &s in small.iter().filter(|&&s| clean(weights[s]) == 0.0) {
            columns[s] = column(0.0, heaviest);
        }
        let pmf: Vec<f32> = weights.iter().map(|&w| (clean(w) / total) as f32).collect();
        for (column, &pmf_here) in columns.iter_mut().zip(&pmf) {
            (column.pmf, column.alias_pmf) = (pmf_here, pmf[column.alias as usize]);
        }
        AliasTable { columns, pmf, total }
    }

    /// Number of choices, impossible ones included.
    pub fn len(&self) -> usize {
        self.pmf.len()
    }

    /// True if there is nothing to choose.
    pub fn is_empty(&self) -> bool {
        self.pmf.is_empty()
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// A choice for `u` in [0, 1) and its probability; `None` if all weights are zero.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<(usize, Pmf)> {
        // Held below the last column: the product may round up to the next one.
        let x = u * self.columns.len() as f32;
        let i = (x as u32 as usize).min(self.columns.len().wrapping_sub(1));
        let column = self.columns.get(i)?;
        let stay = x - (i as f32) < column.threshold;
        Some(if stay { (i, Pmf(column.pmf)) } else { (column.alias as usize, Pmf(column.alias_pmf)) })
    }

    /// Probability of choice `i`; zero outside.
    pub fn pmf(&self, i: usize) -> Pmf {
        Pmf(self.pmf.get(i).copied().unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// On a regular grid the share of each choice is its probability up to the grid's resolution.
        #[test]
        fn frequencies_are_the_probabilities(weights in prop::collection::vec(prop_oneof![Just(0.0f32), 0.0f32..10.0], 1..20)) {
            let alias = AliasTable::new(&weights);
            let total: f32 = weights.iter().sum();
            prop_assume!(total > 0.0);
            let n = 20_000;
            let mut count = vec![0u32; weights.len()];
            for k in 0..n {
                let u = (k as f32 + 0.5) / n as f32;
                let (i, p) = alias.sample(u).unwrap();
                count[i] += 1;
                prop_assert!((p.0 - weights[i] / total).abs() < 1e-6);
            }
            for (i, &w) in weights.iter().enumerate() {
                prop_assert_eq!(alias.pmf(i).0 == 0.0, w == 0.0);
                prop_assert!((count[i] as f32 / n as f32 - w / total).abs() < 40.0 / n as f32);
                prop_assert!(w > 0.0 || count[i] == 0);
            }
        }
    }

    #[test]
    fn hopeless_weights_give_nothing() {
        for weights in [vec![], vec![0.0], vec![f32::NAN, -1.0, f32::INFINITY]] {
            assert!(AliasTable::new(&weights).sample(0.3).is_none());
            assert_eq!(AliasTable::new(&weights).pmf(0), Pmf(0.0));
        }
    }
}
