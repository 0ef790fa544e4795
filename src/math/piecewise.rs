//! Continuous distributions over the unit interval and square whose density is interpolated linearly between nodes:
//! exact sampling, density and inverse. Unlike piecewise constant ones they are positive wherever an interpolated
//! picture is.

use super::cdf::CdfRows;
use super::float::ONE_MINUS_EPSILON;
use std::ops::Range;

/// The s in [0, 1] below which the fraction `r` of the mass under a linear density from `a` to `b` lies.
fn invert_linear(a: f64, b: f64, r: f64) -> f64 {
    let sum = a + b;
    if sum <= 0.0 {
        return r;
    }
    // Where the density begins at zero, the formula below is 0/0.
    if r <= 0.0 {
        return 0.0;
    }
    // The root of (b − a) s²/2 + a s = r (a + b)/2, in the form that does not cancel when a ≈ b.
    (r * sum / (a + (a * a + r * (b * b - a * a)).max(0.0).sqrt())).clamp(0.0, 1.0)
}

/// Fraction of the mass under a linear density from `a` to `b` that lies below s.
fn linear_cdf(a: f64, b: f64, s: f64) -> f64 {
    let sum = a + b;
    if sum <= 0.0 { s } else { s * (2.0 * a + s * (b - a)) / sum }
}

fn clean(v: f32) -> f64 {
    if v.is_finite() && v > 0.0 { f64::from(v) } else { 0.0 }
}

/// Cell and position inside it of `x` in [0, 1] among `cells` equal cells.
fn locate(x: f32, cells: usize) -> (usize, f64) {
    let x = f64::from(x.clamp(0.0, 1.0)) * cells as f64;
    let i = (x as usize).min(cells - 1);
    (i, x - i as f64)
}

fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// A density on [0, 1], linear between equidistant nodes.
#[derive(Clone, Debug)]
pub struct PiecewiseLinear {
    /// Values at the nodes, normalised to integral one.
    values: Vec<f64>,
    /// Mass below each node.
    cdf: Vec<f64>,
    /// For as many equal parts of the unit interval as there are cells, the last cell that begins at or below the
    /// part's start.
    guide: Vec<u32>,
    integral: f64,
}

impl PiecewiseLinear {
    /// Through `values` at equidistant nodes, the first at 0 and the last at 1. Negative, NaN and infinite values count
    /// as zero. `None` for fewer than two nodes or no mass.
    pub fn new(values: &[f32]) -> Option<PiecewiseLinear> {
        PiecewiseLinear::from_f64(values.iter().map(|&v| clean(v)).collect())
    }

    fn from_f64(mut values: Vec<f64>) -> Option<PiecewiseLinear> {
        let cells = values.len().checked_sub(1).filter(|&n| n > 0)? as f64;
        let mut sum = 0.0;
        let mut cdf = vec![0.0];
        for pair in values.windows(2) {
            sum += 0.5 * (pair[0] + pair[1]) / cells;
            cdf.push(sum);
        }
        if sum <= 0.0 {
            return None;
        }
        cdf.iter_mut().chain(values.iter_mut()).for_each(|v| *v /= sum);
        let cells = values.len() - 1;
        let start = |part: usize| cdf[1..cells].partition_point(|&c| c <= part as f64 / cells as f64) as u32;
        let guide = (0..=cells).map(start).collect();
        Some(PiecewiseLinear { values, cdf, guide, integral: sum })
    }

    /// Integral of the function that was given.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// A position in [0, 1] and its density.
    pub fn sample(&self, u: f32) -> (f32, f32) {
        let x = self.place(u);
        (x, self.pdf(x))
    }

    /// The position of [`PiecewiseLinear::sample`].
    pub fn place(&self, u: f32) -> f32 {
        let u = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON));
        let cells = self.values.len() - 1;
        let part = ((u * cells as f64) as usize).min(cells - 1);
        let i = find_cell(self.guide[part] as usize..self.guide[part + 1] as usize + 1, u, |k| self.cdf[k]);
        let r = (u - self.cdf[i]) / (self.cdf[i + 1] - self.cdf[i]);
        let s = invert_linear(self.values[i], self.values[i + 1], r);
        ((i as f64 + s) / cells as f64) as f32
    }

    /// Density at `x`; zero outside of [0, 1].
    pub fn pdf(&self, x: f32) -> f32 {
        if !(0.0..=1.0).contains(&x) {
            return 0.0;
        }
        let (i, s) = locate(x, self.values.len() - 1);
        lerp(self.values[i], self.values[i + 1], s) as f32
    }

    /// The number that [`PiecewiseLinear::sample`] maps to `x`: the mass below it.
    pub fn cdf(&self, x: f32) -> f32 {
        let (i, s) = locate(x, self.values.len() - 1);
        lerp(self.cdf[i], self.cdf[i + 1], linear_cdf(self.values[i], self.values[i + 1], s)) as f32
    }
}

/// The cell i of `cells` with cdf(i) ≤ target < cdf(i + 1), a cell with mass even if rounding puts the target beyond
/// the last.
fn find_cell(cells: Range<usize>, target: f64, cdf: impl Fn(usize) -> f64) -> usize {
    let (mut low, mut high) = (cells.start, cells.end);
    while high - low > 1 {
        let mid = (low + high) / 2;
        if cdf(mid) <= target { low = mid } else { high = mid }
    }
    while low > 0 && cdf(low + 1) <= cdf(low) {
        low -= 1;
    }
    low
}

/// Choice of a cell of a regular grid over the unit square: first its row, then its place in the row. Every cell gets a
/// rectangle of the random numbers, so that stratified numbers give stratified cells.
#[derive(Clone, Debug)]
pub struct CellGrid {
    rows: CdfRows,
    columns: CdfRows,
    total: f64,
}

impl CellGrid {
    /// A grid of `cells` = [along u, along v] whose cell (i, j) has the mass `mass(i, j)` ≥ 0. `None` without mass.
    pub fn new(cells: [usize; 2], mass: impl Fn(usize, usize) -> f64) -> Option<CellGrid> {
        if cells[0] == 0 || cells[1] == 0 {
            return None;
        }
        let mut columns = CdfRows::new(cells[0], cells[1]);
        let masses: Vec<f64> = (0..cells[1]).map(|j| columns.push(|i| mass(i, j))).collect();
        let mut rows = CdfRows::new(cells[1], 1);
        let total = rows.push(|j| masses[j]);
        (total > 0.0).then_some(CellGrid { rows, columns, total })
    }

    /// Sum of the masses.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// A cell (i, j) and new random numbers for a place inside it.
    #[inline]
    pub fn choose(&self, xi: [f32; 2]) -> ([usize; 2], [f32; 2]) {
        let [x, y] = xi.map(|x| x.clamp(0.0, ONE_MINUS_EPSILON));
        let (j, y) = self.rows.find(0, y);
        let (i, x) = self.columns.find(j, x);
        ([i, j], [x, y])
    }

    /// The numbers from which [`CellGrid::choose`] makes `inside` in the cell (i, j).
    pub fn invert(&self, [i, j]: [usize; 2], inside: [f32; 2]) -> [f32; 2] {
        [self.columns.invert(j, i, inside[0]), self.rows.invert(0, j, inside[1])]
    }
}

/// A place (s, t) in a cell with density in proportion to the bilinear interpolation of the values `w` at its corners
/// (row by row).
#[inline]
pub fn sample_in_cell([a, b, c, d]: [f32; 4], xi: [f32; 2]) -> [f32; 2] {
    let t = invert_linear_f32(a + b, c + d, xi[1]);
    [invert_linear_f32(a + (c - a) * t, b + (d - b) * t, xi[0]), t]
}

/// The numbers that [`sample_in_cell`] maps to the place (s, t).
pub fn invert_in_cell(corners: [f32; 4], [s, t]: [f32; 2]) -> [f32; 2] {
    let ([a, b, c, d], [s, t]) = (corners.map(f64::from), [f64::from(s), f64::from(t)]);
    [linear_cdf(lerp(a, c, t), lerp(b, d, t), s) as f32, linear_cdf(a + b, c + d, t) as f32]
}

/// [`invert_linear`] in single precision, for places inside of one cell.
#[inline]
fn invert_linear_f32(a: f32, b: f32, r: f32) -> f32 {
    let sum = a + b;
    if sum <= 0.0 || r <= 0.0 {
        return r.max(0.0);
    }
    // Scaled so that squares neither overflow nor vanish.
    let (a, b) = (a / sum, b / sum);
    (r / (a + (a * a + r * (b * b - a * a)).max(0.0).sqrt())).min(1.0)
}

/// A density on the unit square, bilinear between the nodes of a regular grid: a cell is drawn by its mass, then a
/// place inside it.
#[derive(Clone, Debug)]
pub struct PiecewiseBilinear {
    /// Values at the nodes, row by row, normalised to integral one.
    values: Vec<f32>,
    cells: [usize; 2],
    grid: CellGrid,
    integral: f64,
}

impl PiecewiseBilinear {
    /// Through `values` at the nodes of a grid with `nodes_u` nodes in a row; the first node is at u = v = 0, the last
    /// at 1. Negative, NaN and infinite values count as zero. `None` without a cell or without mass.
    pub fn new(values: &[f32], nodes_u: usize) -> Option<PiecewiseBilinear> {
        let cells_u = nodes_u.checked_sub(1).filter(|&n| n > 0)?;
        if !values.len().is_multiple_of(nodes_u) {
            return None;
        }
        let cells = [cells_u, (values.len() / nodes_u).checked_sub(1)?];
        let at = |i: usize, j: usize| clean(values[j * nodes_u + i]);
        let mass = |i, j| 0.25 * (at(i, j) + at(i + 1, j) + at(i, j + 1) + at(i + 1, j + 1));
        let grid = CellGrid::new(cells, mass)?;
        let integral = grid.total() / (cells[0] * cells[1]) as f64;
        let values = values.iter().map(|&v| (clean(v) / integral) as f32).collect();
        Some(PiecewiseBilinear { values, cells, grid, integral })
    }

    /// Integral of the function that was given.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Values at the corners of a cell.
    #[inline]
    fn corners(&self, [i, j]: [usize; 2]) -> [f32; 4] {
        let k = j * (self.cells[0] + 1) + i;
        let below = k + self.cells[0] + 1;
        [self.values[k], self.values[k + 1], self.values[below], self.values[below + 1]]
    }

    /// A point (u, v) of the unit square and its density.
    pub fn sample(&self, xi: [f32; 2]) -> ([f32; 2], f32) {
        let (cell, xi) = self.grid.choose(xi);
        let place = sample_in_cell(self.corners(cell), xi);
        let p = std::array::from_fn(|k| ((cell[k] as f64 + f64::from(place[k])) / self.cells[k] as f64) as f32);
        (p, self.pdf(p))
    }

    /// The cell around `p` and the place inside it; coordinates outside are clamped.
    #[inline]
    fn place(&self, p: [f32; 2]) -> ([usize; 2], [f32; 2]) {
        let ((i, s), (j, t)) = (locate(p[0], self.cells[0]), locate(p[1], self.cells[1]));
        ([i, j], [s as f32, t as f32])
    }

    /// Density at `p` = (u, v) per unit area of the square; coordinates outside are clamped.
    pub fn pdf(&self, p: [f32; 2]) -> f32 {
        let (cell, [s, t]) = self.place(p);
        let [a, b, c, d] = self.corners(cell);
        let (top, bottom) = (a + (b - a) * s, c + (d - c) * s);
        top + (bottom - top) * t
    }

    /// The numbers that [`PiecewiseBilinear::sample`] maps to `p`.
    pub fn invert(&self, p: [f32; 2]) -> [f32; 2] {
        let (cell, place) = self.place(p);
        self.grid.invert(cell, invert_in_cell(self.corners(cell), place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn node() -> impl Strategy<Value = f32> {
        prop_oneof![Just(0.0f32), 0.0f32..5.0, Just(1000.0f32)]
    }

    proptest! {
        #[test]
        fn linear_round_trip_and_integral(values in prop::collection::vec(node(), 2..20), u in 0.0f32..1.0) {
            prop_assume!(values.iter().any(|&v| v > 0.0));
            let d = PiecewiseLinear::new(&values).unwrap();
            let (x, p) = d.sample(u);
            prop_assert!((0.0..=1.0).contains(&x) && p == d.pdf(x));
            // Where the density is low the position is known to 2^-24 but the mass below it even better.
            prop_assert!((d.cdf(x) - u).abs() < 1e-6 * p.max(1.0) + 1e-6, "{} {u}", d.cdf(x));
            let n = 4000;
            let integral: f64 = (0..n).map(|k| f64::from(d.pdf((k as f32 + 0.5) / n as f32))).sum::<f64>() / f64::from(n);
            prop_assert!((integral - 1.0).abs() < 1e-2, "{integral}");
        }

        #[test]
        fn bilinear_round_trip(values in prop::collection::vec(node(), 30), x in 0.0f32..1.0, y in 0.0f32..1.0) {
            prop_assume!(values.iter().any(|&v| v > 0.0));
            let d = PiecewiseBilinear::new(&values, 6).unwrap();
            let (p, pdf) = d.sample([x, y]);
            prop_assert!(pdf == d.pdf(p) && pdf >= 0.0);
            let back = d.invert(p);
            prop_assert!((back[1] - y).abs() < 1e-4, "{back:?} {x} {y}");
            // Where the marginal vanishes the conditional is undefined.
            let (cell, [_, t]) = d.place(p);
            let [a, b, c, e] = d.corners(cell);
            prop_assume!((a + b) * (1.0 - t) + (c + e) * t > 1e-3);
            prop_assert!((back[0] - x).abs() < 1e-2, "{back:?} {x} {y}");
        }
    }

    /// A sun that outshines all else, rows and cells without mass, and more cells than parts of the guide.
    #[test]
    fn cells_are_chosen_by_their_mass() {
        let mass = |i: usize, j: usize| match (i, j) {
            (17, 3) => 300.0,
            (_, 5) | (0 | 99, _) => 0.0,
            _ => ((i * 7 + j * 3) % 5) as f64,
        };
        let grid = CellGrid::new([100, 7], mass).unwrap();
        let (nu, nv) = (2000u32, 200u32);
        let mut count = vec![0u32; 700];
        for k in 0..nu * nv {
            let xi = [((k % nu) as f32 + 0.5) / nu as f32, ((k / nu) as f32 + 0.5) / nv as f32];
            let (cell, inside) = grid.choose(xi);
            assert!(inside.iter().all(|x| (0.0..=1.0).contains(x)));
            let back = grid.invert(cell, inside);
            assert!((back[0] - xi[0]).abs() < 1e-6 && (back[1] - xi[1]).abs() < 1e-6, "{xi:?} {back:?}");
            count[cell[1] * 100 + cell[0]] += 1;
        }
        for (k, &n) in count.iter().enumerate() {
            let (i, j) = (k % 100, k / 100);
            let row: f64 = (0..100).map(|i| mass(i, j)).sum();
            // A cell is a rectangle of random numbers: its count is off by at most one grid line on either side.
            let (width, height) = (mass(i, j) / row.max(1e-9) * f64::from(nu), row / grid.total() * f64::from(nv));
            let slack = width + height + 1.0;
            assert!((f64::from(n) - width * height).abs() <= slack, "{i} {j}: {n}, {}", width * height);
            assert!(mass(i, j) > 0.0 || n == 0);
        }
        for u in [0.0, ONE_MINUS_EPSILON] {
            let ([i, j], _) = grid.choose([u, u]);
            assert!(mass(i, j) > 0.0);
        }
    }

    /// Moments of the sampled points against quadrature of the density.
    #[test]
    fn bilinear_moments() {
        let values = [0.0, 3.0, 1.0, 0.0, 7.0, 0.5, 0.0, 0.0, 2.0, 4.0, 0.1, 6.0];
        let d = PiecewiseBilinear::new(&values, 4).unwrap();
        let n = 400;
        let (mut by_sample, mut by_density, mut mass) = ([0.0f64; 3], [0.0f64; 3], 0.0f64);
        for k in 0..n * n {
            let u = [((k % n) as f32 + 0.5) / n as f32, ((k / n) as f32 + 0.5) / n as f32];
            let f = |p: [f32; 2]| [p[0], p[1], p[0] * p[1]].map(f64::from);
            let (p, _) = d.sample(u);
            let pdf = f64::from(d.pdf(u));
            mass += pdf;
            for c in 0..3 {
                by_sample[c] += f(p)[c];
                by_density[c] += f(u)[c] * pdf;
            }
        }
        let scale = 1.0 / f64::from((n * n) as u32);
        assert!((mass * scale - 1.0).abs() < 1e-4);
        for c in 0..3 {
            assert!((by_sample[c] - by_density[c]).abs() * scale < 1e-3, "{by_sample:?} {by_density:?}");
        }
    }

    #[test]
    fn hopeless_grids_give_nothing() {
        assert!(PiecewiseLinear::new(&[1.0]).is_none() && PiecewiseLinear::new(&[0.0, f32::NAN]).is_none());
        assert!(PiecewiseBilinear::new(&[0.0; 6], 3).is_none() && PiecewiseBilinear::new(&[1.0; 5], 3).is_none());
        assert!(PiecewiseBilinear::new(&[1.0; 3], 3).is_none() && PiecewiseBilinear::new(&[], 0).is_none());
    }
}
