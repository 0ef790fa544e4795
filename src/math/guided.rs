//! Discrete distributions by cumulative sums, with a guide that makes the search for a random number's cell short.

/// Rows of cumulative sums over the same number of cells. A guide says for equal parts of the unit interval where to begin, so that a
/// search touches one cache line of the guide and, mostly, one of the sums.
///
/// Sums are single precision: their rounding moves the border between two cells by at most as much as the spacing of the numbers
/// that choose.
#[derive(Clone, Debug, Default)]
pub struct GuidedRows {
    cells: usize,
    /// Parts per row; a power of two, so that multiplying by it is exact.
    parts: usize,
    /// Per row, mass below each cell, from 0 to 1.
    cdf: Vec<f32>,
    /// Per row, the last cell that begins at or below the start of each part.
    guide: Vec<u32>,
}

/// Cells per part of the guide.
const CELLS_PER_PART: usize = 4;

impl GuidedRows {
    /// No rows yet of so many cells; `rows` is how many there will be.
    pub fn new(cells: usize, rows: usize) -> GuidedRows {
        let parts = (cells / CELLS_PER_PART).next_power_of_two();
        let (cdf, guide) = (Vec::with_capacity(rows * (cells + 1)), Vec::with_capacity(rows * (parts + 1)));
        GuidedRows { cells, parts, cdf, guide }
    }

    /// Appends a row and returns its mass. A row without mass, which is never asked for, is even.
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
        total
    }

    /// The cell of `row` that holds `u` in [0, 1), and how far inside. A cell without mass holds nothing.
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

    /// The probability with which uniform numbers find a cell of `row`.
    #[inline]
    pub fn probability(&self, row: usize, cell: usize) -> f32 {
        let k = row * (self.cells + 1) + cell;
        self.cdf[k + 1] - self.cdf[k]
    }

    /// What [`GuidedRows::find`] maps to a place `inside` a cell.
    pub fn invert(&self, row: usize, cell: usize, inside: f32) -> f32 {
        let k = row * (self.cells + 1) + cell;
        self.cdf[k] + inside * (self.cdf[k + 1] - self.cdf[k])
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
            let mut rows = GuidedRows::new(cells, 3);
            for row in 0..3 {
                // Many cells have no mass, and few have most of it.
                let masses: Vec<f64> = (0..cells)
                    .map(|i| {
                        let [u, v, ..] = rng.next_4().map(f64::from);
                        if v < 0.5 && i > 0 { 0.0 } else { u.powi(9) + 1e-6 }
                    })
                    .collect();
                let total = rows.push(|i| masses[i]);
                assert!((total - masses.iter().sum::<f64>()).abs() < 1e-9 * total);
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
        }
    }
}
