//! Discrete distributions as cumulative sums: [`CdfRows`] for fast look-ups in many distributions over equally many
//! choices, [`PrefixSums`] for distributions over any sub-range of a list of weights.

use std::ops::Range;

/// Normalised cumulative sums of many discrete distributions (rows) over the same number of cells. A guide table
/// stores, for equal parts of the unit interval, the cell where a search begins, so that a look-up touches one cache
/// line of the guide and, mostly, one of the sums (Chen and Asau 1974).
///
/// Sums are single precision: their rounding moves the border between two cells by at most as much as the spacing of
/// the random numbers.
#[derive(Clone, Debug, Default)]
pub struct CdfRows {
    cells: usize,
    /// Parts per row; a power of two, so that multiplying by it is exact.
    parts: usize,
    /// Per row, the probability of all cells before each cell, and 1: `cells + 1` numbers.
    cdf: Vec<f32>,
    /// Per row, the last cell that begins at or below the start of each part: `parts + 1` numbers.
    guide: Vec<u32>,
    /// Per row, the sum of its masses before normalisation.
    totals: Vec<f64>,
}

/// Cells per part of the guide.
const CELLS_PER_PART: usize = 4;

impl CdfRows {
    /// No rows yet of `cells` cells each, with memory for `rows` of them.
    pub fn new(cells: usize, rows: usize) -> CdfRows {
        let mut empty = CdfRows::default();
        empty.reset(cells, rows);
        empty
    }

    /// Removes all rows; new ones will have `cells` cells each. Keeps the memory, or reserves it for `rows` rows.
    pub fn reset(&mut self, cells: usize, rows: usize) {
        self.cells = cells;
        self.parts = (cells / CELLS_PER_PART).next_power_of_two();
        self.cdf.clear();
        self.guide.clear();
        self.totals.clear();
        self.cdf.reserve(rows * (cells + 1));
        self.guide.reserve(rows * (self.parts + 1));
        self.totals.reserve(rows);
    }

    /// Appends a row whose cell `i` has the mass `mass(i)` ≥ 0 and returns the sum of its masses. A row without mass is
    /// uniform.
    pub fn push(&mut self, mass: impl Fn(usize) -> f64) -> f64 {
        let total: f64 = (0..self.cells).map(&mass).sum();
        let start = self.cdf.len();
        let mut sum = 0.0;
        for i in 0..self.cells {
            self.cdf.push(if total > 0.0 { sum / total } else { i as f64 / self.cells as f64 } as f32);
            sum += mass(i);
        }
        self.cdf.push(1.0);
        let row = &self.cdf[start..];
        let mut i = 0;
        for k in 0..=self.parts {
            let at = k as f32 / self.parts as f32;
            while i + 1 < self.cells && row[i + 1] <= at {
                i += 1;
            }
            self.guide.push(i as u32);
        }
        self.totals.push(total);
        total
    }

    /// Number of cells of every row.
    #[inline]
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Number of rows.
    #[inline]
    pub fn rows(&self) -> usize {
        self.totals.len()
    }

    /// Sum of the masses of `row` before normalisation; zero if the row has no mass.
    #[inline]
    pub fn total(&self, row: usize) -> f64 {
        self.totals[row]
    }

    /// The cell of `row` that holds `u` in [0, 1), and the relative position of `u` inside the cell. A cell without
    /// mass is never found in a row with mass.
    #[inline]
    pub fn find(&self, row: usize, u: f32) -> (usize, f32) {
        let guide = &self.guide[row * (self.parts + 1)..][..self.parts + 1];
        let cdf = &self.cdf[row * (self.cells + 1)..][..self.cells + 1];
        let part = ((u * self.parts as f32) as usize).min(self.parts - 1);
        let (mut low, mut high) = (guide[part] as usize, guide[part + 1] as usize + 1);
        while high - low > 1 {
            let mid = (low + high) / 2;
            if cdf[mid] <= u { low = mid } else { high = mid }
        }
        (low, (u - cdf[low]) / (cdf[low + 1] - cdf[low]))
    }

    /// Probability of `cell` in `row`: that of the numbers for which [`CdfRows::find`] returns it.
    #[inline]
    pub fn probability(&self, row: usize, cell: usize) -> f32 {
        let k = row * (self.cells + 1) + cell;
        self.cdf[k + 1] - self.cdf[k]
    }

    /// Inverse of [`CdfRows::find`]: the number that maps to the relative position `inside` of `cell`.
    pub fn invert(&self, row: usize, cell: usize, inside: f32) -> f32 {
        let k = row * (self.cells + 1) + cell;
        self.cdf[k] + inside * (self.cdf[k + 1] - self.cdf[k])
    }
}

/// Sums of the weights before each item of a list: the weight of any range in constant time, and draws from any range
/// in proportion to weight. Double precision, not normalised.
#[derive(Clone, Debug, Default)]
pub struct PrefixSums {
    /// The sum of the weights before each item, and of all; empty if nothing was ever summed.
    sums: Vec<f64>,
}

impl PrefixSums {
    /// Sums of `weights`, which are finite and not negative.
    pub fn new(weights: impl Iterator<Item = f32>) -> PrefixSums {
        let mut sums = PrefixSums::default();
        sums.rebuild(weights);
        sums
    }

    /// [`PrefixSums::new`] in the memory of earlier sums.
    pub fn rebuild(&mut self, weights: impl Iterator<Item = f32>) {
        let mut sum = 0.0;
        self.sums.clear();
        self.sums.push(sum);
        self.sums.extend(weights.map(|weight| {
            sum += f64::from(weight);
            sum
        }));
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.sums.len().saturating_sub(1)
    }

    /// True if there are no items.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Weight of all items.
    pub fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// Weight of the items in `range`.
    #[inline]
    pub fn weight(&self, range: &Range<usize>) -> f64 {
        self.sums[range.end] - self.sums[range.start]
    }

    /// Probability of `item` in draws from `range`; zero if the range has no weight.
    #[inline]
    pub fn pmf(&self, range: &Range<usize>, item: usize) -> f64 {
        let total = self.weight(range);
        if total > 0.0 { (self.sums[item + 1] - self.sums[item]) / total } else { 0.0 }
    }

    /// Draws an item of `range` in proportion to weight with the random number `u` in [0, 1); `None` if the range has
    /// no weight.
    #[inline]
    pub fn sample(&self, range: &Range<usize>, u: f64) -> Option<usize> {
        let total = self.weight(range);
        if total <= 0.0 {
            return None;
        }
        let target = self.sums[range.start] + u * total;
        let mut item = self.search(range, target, u);
        // Rounding may have put the target behind the last item with weight.
        while item > range.start && self.sums[item + 1] <= self.sums[item] {
            item -= 1;
        }
        Some(item)
    }

    /// The last item of `range` whose prefix sum is at most `target`. The search gallops from the place where the item
    /// is if all weights are equal: those of the triangles of one tessellated emitter often are.
    #[inline]
    fn search(&self, &Range { start, end }: &Range<usize>, target: f64, u: f64) -> usize {
        let guess = (start + (u * (end - start) as f64) as usize).min(end - 1);
        let (mut low, mut high) = (start, end);
        let mut step = 1;
        if self.sums[guess] <= target {
            low = guess;
            while low + step < end && self.sums[low + step] <= target {
                low += step;
                step *= 2;
            }
            high = (low + step).min(end);
        } else {
            high = high.min(guess);
            while high > start + step && self.sums[high - step] > target {
                high -= step;
                step *= 2;
            }
            low = low.max(high.saturating_sub(step));
        }
        while high - low > 1 {
            let mid = (low + high) / 2;
            if self.sums[mid] <= target { low = mid } else { high = mid }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    #[test]
    fn a_guided_search_finds_what_a_plain_one_finds() {
        let mut rng = HashRng::new(5, 4, 3, 2);
        for cells in [1usize, 2, 3, 7, 64, 1000] {
            let mut rows = CdfRows::new(cells, 3);
            for row in 0..3 {
                // Many cells have no mass, and few have most of it.
                let masses: Vec<f64> = (0..cells)
                    .map(|i| {
                        let [u, v, ..] = rng.next_4().map(f64::from);
                        if v < 0.5 && i > 0 { 0.0 } else { u.powi(9) + 1e-6 }
                    })
                    .collect();
                let total = rows.push(|i| masses[i]);
                assert!(total == rows.total(row) && (total - masses.iter().sum::<f64>()).abs() < 1e-9 * total);
                let sum: f32 = (0..cells).map(|i| rows.probability(row, i)).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{sum}");
                for _ in 0..200 {
                    let u = rng.next_f32();
                    let (found, inside) = rows.find(row, u);
                    let below: f64 = masses[..found].iter().sum::<f64>() / total;
                    let up_to = below + masses[found] / total;
                    assert!(below < f64::from(u) + 1e-6 && f64::from(u) < up_to + 1e-6, "{below} {u} {up_to}");
                    assert!(masses[found] > 0.0 && rows.probability(row, found) > 0.0);
                    assert!((rows.invert(row, found, inside) - u).abs() < 1e-6);
                }
            }
            assert_eq!(rows.rows(), 3);
        }
    }

    #[test]
    fn rows_without_mass_are_uniform_and_memory_can_be_used_again() {
        let mut rows = CdfRows::new(7, 1);
        rows.push(|_| 3.0);
        rows.reset(4, 2);
        assert_eq!((rows.rows(), rows.cells()), (0, 4));
        assert_eq!(rows.push(|_| 0.0), 0.0);
        rows.push(|i| if i == 2 { 1.0 } else { 0.0 });
        assert_eq!((0..4).map(|i| rows.probability(0, i)).collect::<Vec<_>>(), [0.25; 4]);
        assert_eq!((0..4).map(|i| rows.probability(1, i)).collect::<Vec<_>>(), [0.0, 0.0, 1.0, 0.0]);
        assert_eq!([0.0, 0.5, 0.999].map(|u| rows.find(1, u).0), [2; 3]);
    }

    #[test]
    fn draws_from_ranges_follow_weights() {
        let mut rng = HashRng::new(1, 2, 3, 9);
        let weights: Vec<f32> = (0..40).map(|i| if i % 5 == 0 { 0.0 } else { rng.next_f32().powi(4) }).collect();
        let sums = PrefixSums::new(weights.iter().copied());
        for range in [7..29, 0..40, 5..7, 39..40, 0..6] {
            let total: f64 = weights[range.clone()].iter().map(|w| f64::from(*w)).sum();
            const N: u32 = 20_000;
            let mut counts = [0u32; 40];
            for i in 0..N {
                let item = sums.sample(&range, (f64::from(i) + 0.5) / f64::from(N)).unwrap();
                assert!((sums.pmf(&range, item) - f64::from(weights[item]) / total).abs() < 1e-12);
                counts[item] += 1;
            }
            for (i, &count) in counts.iter().enumerate() {
                let expected = if range.contains(&i) { f64::from(weights[i]) / total * f64::from(N) } else { 0.0 };
                assert!((f64::from(count) - expected).abs() < 3.0, "{i}: {count} {expected}");
            }
            for u in [0.0, 1.0 - f64::EPSILON / 2.0] {
                let item = sums.sample(&range, u).unwrap();
                assert!(weights[item] > 0.0 && range.contains(&item));
            }
        }
    }

    #[test]
    fn ranges_without_weight_give_nothing() {
        let sums = PrefixSums::new([0.0, 0.0, 2.0].into_iter());
        assert_eq!((sums.sample(&(0..2), 0.5), sums.sample(&(1..1), 0.5)), (None, None));
        assert_eq!((sums.pmf(&(0..2), 1), sums.weight(&(0..3)), sums.total()), (0.0, 2.0, 2.0));
        assert_eq!(sums.sample(&(0..3), 0.0), Some(2));
        let empty = PrefixSums::default();
        assert!(empty.is_empty() && empty.total() == 0.0 && PrefixSums::new(std::iter::empty()).is_empty());
    }
}
