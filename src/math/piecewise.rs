//! Continuous distributions over the unit interval and square whose density is interpolated linearly between nodes: exact
//! sampling, density and inverse. Unlike piecewise constant ones they are positive wherever an interpolated picture is.

use super::float::ONE_MINUS_EPSILON;

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
    integral: f64,
}

impl PiecewiseLinear {
    /// Through `values` at equidistant nodes, the first at 0 and the last at 1. Negative, NaN and infinite values count as zero.
    /// `None` for fewer than two nodes or no mass.
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
        Some(PiecewiseLinear { values, cdf, integral: sum })
    }

    /// Integral of the function that was given.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// A position in [0, 1] and its density.
    pub fn sample(&self, u: f32) -> (f32, f32) {
        let u = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON));
        let i = find_cell(self.values.len() - 1, u, |k| self.cdf[k]);
        let r = (u - self.cdf[i]) / (self.cdf[i + 1] - self.cdf[i]);
        let s = invert_linear(self.values[i], self.values[i + 1], r);
        let x = ((i as f64 + s) / (self.values.len() - 1) as f64) as f32;
        (x, self.pdf(x))
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

/// The cell i with cdf(i) ≤ target < cdf(i + 1), a cell with mass even if rounding puts the target beyond the last.
fn find_cell(cells: usize, target: f64, cdf: impl Fn(usize) -> f64) -> usize {
    let (mut low, mut high) = (0, cells);
    while high - low > 1 {
        let mid = (low + high) / 2;
        if cdf(mid) <= target { low = mid } else { high = mid }
    }
    while low > 0 && cdf(low + 1) <= cdf(low) {
        low -= 1;
    }
    low
}

/// A density on the unit square, bilinear between the nodes of a regular grid.
///
/// v is drawn from the marginal, u from the conditional of that v, which interpolates the two rows' cumulative sums.
#[derive(Clone, Debug)]
pub struct PiecewiseBilinear {
    /// Cells along u.
    cells_u: usize,
    /// Values at the nodes, row by row, normalised to integral one.
    values: Vec<f32>,
    /// Per row: mass below each node along u. In double precision: dark cells beside a bright one must keep their share.
    row_cdf: Vec<f64>,
    marginal: PiecewiseLinear,
}

impl PiecewiseBilinear {
    /// Through `values` at the nodes of a grid with `nodes_u` nodes in a row; the first node is at u = v = 0, the last at 1.
    /// Negative, NaN and infinite values count as zero. `None` without a cell or without mass.
    pub fn new(values: &[f32], nodes_u: usize) -> Option<PiecewiseBilinear> {
        let cells_u = nodes_u.checked_sub(1).filter(|&n| n > 0)?;
        if !values.len().is_multiple_of(nodes_u) {
            return None;
        }
        let integrals: Vec<f64> = values
            .chunks_exact(nodes_u)
            .map(|row| row.windows(2).map(|p| 0.5 * (clean(p[0]) + clean(p[1]))).sum::<f64>() / cells_u as f64)
            .collect();
        let marginal = PiecewiseLinear::from_f64(integrals)?;
        let scale = 1.0 / marginal.integral();
        let values: Vec<f32> = values.iter().map(|&v| (clean(v) * scale) as f32).collect();
        let mut row_cdf = Vec::with_capacity(values.len());
        for row in values.chunks_exact(nodes_u) {
            let mut sum = 0.0;
            row_cdf.push(0.0);
            for p in row.windows(2) {
                sum += 0.5 * (f64::from(p[0]) + f64::from(p[1])) / cells_u as f64;
                row_cdf.push(sum);
            }
        }
        Some(PiecewiseBilinear { cells_u, values, row_cdf, marginal })
    }

    /// Integral of the function that was given.
    pub fn integral(&self) -> f64 {
        self.marginal.integral()
    }

    fn cells_v(&self) -> usize {
        self.marginal.values.len() - 1
    }

    /// Value at column `i`, interpolated between the rows j and j + 1.
    fn column(&self, i: usize, j: usize, t: f64) -> f64 {
        let k = j * (self.cells_u + 1) + i;
        lerp(f64::from(self.values[k]), f64::from(self.values[k + self.cells_u + 1]), t)
    }

    /// Mass below column `i` of the row interpolated between j and j + 1.
    fn mass(&self, i: usize, j: usize, t: f64) -> f64 {
        let k = j * (self.cells_u + 1) + i;
        lerp(self.row_cdf[k], self.row_cdf[k + self.cells_u + 1], t)
    }

    /// A point (u, v) of the unit square and its density.
    pub fn sample(&self, xi: [f32; 2]) -> ([f32; 2], f32) {
        let (v, _) = self.marginal.sample(xi[1]);
        let (j, t) = locate(v, self.cells_v());
        let target = f64::from(xi[0].clamp(0.0, ONE_MINUS_EPSILON)) * self.mass(self.cells_u, j, t);
        let i = find_cell(self.cells_u, target, |k| self.mass(k, j, t));
        let (below, above) = (self.mass(i, j, t), self.mass(i + 1, j, t));
        let r = if above > below { (target - below) / (above - below) } else { 0.5 };
        let s = invert_linear(self.column(i, j, t), self.column(i + 1, j, t), r);
        let u = ((i as f64 + s) / self.cells_u as f64) as f32;
        ([u, v], self.pdf([u, v]))
    }

    /// Density at `p` = (u, v) per unit area of the square; coordinates outside are clamped.
    pub fn pdf(&self, p: [f32; 2]) -> f32 {
        let (i, s) = locate(p[0], self.cells_u);
        let (j, t) = locate(p[1], self.cells_v());
        lerp(self.column(i, j, t), self.column(i + 1, j, t), s) as f32
    }

    /// The numbers that [`PiecewiseBilinear::sample`] maps to `p`.
    pub fn invert(&self, p: [f32; 2]) -> [f32; 2] {
        let (j, t) = locate(p[1], self.cells_v());
        let (i, s) = locate(p[0], self.cells_u);
        let inside = linear_cdf(self.column(i, j, t), self.column(i + 1, j, t), s);
        let total = self.mass(self.cells_u, j, t);
        let below = lerp(self.mass(i, j, t), self.mass(i + 1, j, t), inside);
        [if total > 0.0 { (below / total) as f32 } else { p[0] }, self.marginal.cdf(p[1])]
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
            prop_assume!(d.marginal.pdf(p[1]) > 1e-3);
            prop_assert!((back[0] - x).abs() < 1e-2, "{back:?} {x} {y}");
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
