//! Pixel filters by importance sampling (Ernst et al. 2006): a film sample is drawn around the pixel's centre with
//! density ∝ |f| and weighted by the sign of f. Definitions and radii are Mitsuba 3's.

use crate::math::piecewise::PiecewiseLinear;
use crate::scene::FilterDesc;

/// A separable pixel filter.
#[derive(Clone, Debug)]
pub struct PixelFilter {
    radius: f32,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Box,
    Tent,
    Tabulated(Box<Table>),
}

/// A filter as a table: what lies between its nodes is interpolated, for samples and splats alike, so that exponentials
/// are computed once and for all. Of a Gaussian this is off by no more than 4e-5 of its peak.
#[derive(Clone, Debug)]
struct Table {
    /// f at equidistant nodes from −radius to radius, per pixel: its integral is 1.
    nodes: Vec<f32>,
    /// Cells per pixel.
    scale: f32,
    /// |f| over the unit interval.
    density: PiecewiseLinear,
    /// f is nowhere negative, so that the density is f itself.
    positive: bool,
}

/// Nodes of the table; even, so that the peak is inside a cell as flat as the filter is there.
const NODES: usize = 512;

/// Half width in pixels, as Mitsuba's; at least that of half a pixel's rounding.
fn radius_of(desc: FilterDesc) -> f32 {
    let r = match desc {
        FilterDesc::Box => 0.5,
        FilterDesc::Tent { radius } => radius,
        FilterDesc::Gaussian { stddev } => 4.0 * stddev,
        FilterDesc::Mitchell { .. } => 2.0,
    };
    if r.is_finite() { r.max(1e-4) } else { 0.5 }
}

/// The filter's value at a distance of `x` pixels along one axis, unnormalised.
fn value(desc: FilterDesc, radius: f32, x: f32) -> f32 {
    let x = x.abs();
    if x > radius {
        return 0.0;
    }
    match desc {
        FilterDesc::Box => 1.0,
        FilterDesc::Tent { .. } => 1.0 - x / radius,
        FilterDesc::Gaussian { stddev } => {
            let at = |x: f32| (-0.5 * (x / stddev) * (x / stddev)).exp();
            (at(x) - at(radius)).max(0.0)
        }
        // Mitchell & Netravali 1988, eq. 8.
        FilterDesc::Mitchell { b, c } => {
            let (x2, x3) = (x * x, x * x * x);
            let sixfold = if x < 1.0 {
                (12.0 - 9.0 * b - 6.0 * c) * x3 + (-18.0 + 12.0 * b + 6.0 * c) * x2 + (6.0 - 2.0 * b)
            } else {
                (-b - 6.0 * c) * x3 + (6.0 * b + 30.0 * c) * x2 + (-12.0 * b - 48.0 * c) * x + (8.0 * b + 24.0 * c)
            };
            sixfold / 6.0
        }
    }
}

impl PixelFilter {
    /// As described. A filter without extent, or one that integrates to nothing, becomes a box.
    pub fn new(desc: FilterDesc) -> PixelFilter {
        let radius = radius_of(desc);
        let kind = match desc {
            FilterDesc::Box => Kind::Box,
            FilterDesc::Tent { .. } => Kind::Tent,
            FilterDesc::Gaussian { .. } | FilterDesc::Mitchell { .. } => match Table::new(desc, radius) {
                Some(table) => Kind::Tabulated(Box::new(table)),
                None => return PixelFilter { radius: 0.5, kind: Kind::Box },
            },
        };
        PixelFilter { radius, kind }
    }

    /// Half width in pixels.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The filter's value at a distance of `x` pixels along one axis; the integral over all distances is 1.
    fn value(&self, x: f32) -> f32 {
        match &self.kind {
            Kind::Box => value(FilterDesc::Box, self.radius, x) / (2.0 * self.radius),
            Kind::Tent => value(FilterDesc::Tent { radius: self.radius }, self.radius, x) / self.radius,
            Kind::Tabulated(table) => table.value(x, self.radius),
        }
    }

    /// One of the pixels whose filter reaches the raster position `at`, and the weight of a splat that goes there
    /// instead of to all of them: along each axis a pixel is drawn in proportion to |f| at its centre's distance.
    /// `None` where no filter reaches.
    pub fn splat(&self, at: [f32; 2], u: [f32; 2]) -> Option<([i64; 2], f32)> {
        let (x, wx) = self.splat_axis(at[0], u[0])?;
        let (y, wy) = self.splat_axis(at[1], u[1])?;
        Some(([x, y], wx * wy))
    }

    fn splat_axis(&self, at: f32, u: f32) -> Option<(i64, f32)> {
        if let Kind::Box = self.kind {
            return Some((at.floor() as i64, 1.0));
        }
        let first = (at - 0.5 - self.radius).ceil() as i64;
        let last = (at - 0.5 + self.radius).floor() as i64;
        let at_pixel = |i: i64| self.value(at - 0.5 - i as f32);
        let sum: f32 = (first..=last).map(|i| at_pixel(i).abs()).sum();
        let (mut rest, mut chosen) = (u * sum, None);
        for i in first..=last {
            let f = at_pixel(i);
            if f != 0.0 {
                chosen = Some((i, sum.copysign(f)));
                if rest < f.abs() {
                    break;
                }
                rest -= f.abs();
            }
        }
        chosen
    }

    /// An offset from the pixel's centre, in pixels, and the weight of the sample; weights have the mean 1.
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        match &self.kind {
            Kind::Box => ([u[0] - 0.5, u[1] - 0.5], 1.0),
            Kind::Tent => (u.map(|u| self.radius * tent(u)), 1.0),
            Kind::Tabulated(table) => {
                let [(x, wx), (y, wy)] = u.map(|u| table.sample(u, self.radius));
                ([x, y], wx * wy)
            }
        }
    }
}

/// Inverse of the cumulative distribution of the tent over [−1, 1].
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - u)).sqrt() }
}

impl Table {
    fn new(desc: FilterDesc, radius: f32) -> Option<Table> {
        let cells = (NODES - 1) as f32;
        let values: Vec<f32> =
            (0..NODES).map(|k| value(desc, radius, radius * (2.0 * k as f32 / cells - 1.0))).collect();
        let density = PiecewiseLinear::new(&values.iter().map(|v| v.abs()).collect::<Vec<_>>())?;
        let width = 2.0 * f64::from(radius) / f64::from(cells);
        let integral: f64 = values.windows(2).map(|v| 0.5 * width * (f64::from(v[0]) + f64::from(v[1]))).sum();
        (integral > 1e-6).then(|| Table {
            positive: values.iter().all(|v| *v >= 0.0),
            nodes: values.iter().map(|v| (f64::from(*v) / integral) as f32).collect(),
            scale: cells / (2.0 * radius),
            density,
        })
    }

    /// f at a distance of `x` pixels.
    #[inline]
    fn value(&self, x: f32, radius: f32) -> f32 {
        let at = (x + radius) * self.scale;
        if !(0.0..=(NODES - 1) as f32).contains(&at) {
            return 0.0;
        }
        let i = (at as usize).min(NODES - 2);
        self.nodes[i] + (self.nodes[i + 1] - self.nodes[i]) * (at - i as f32)
    }

    fn sample(&self, u: f32, radius: f32) -> (f32, f32) {
        if self.positive {
            return (radius * (2.0 * self.density.place(u) - 1.0), 1.0);
        }
        let (t, pdf) = self.density.sample(u);
        let (x, density) = (radius * (2.0 * t - 1.0), pdf / (2.0 * radius));
        (x, if density > 0.0 { self.value(x, radius) / density } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [FilterDesc; 6] = [
        FilterDesc::Box,
        FilterDesc::Tent { radius: 1.5 },
        FilterDesc::Gaussian { stddev: 0.5 },
        FilterDesc::Gaussian { stddev: 0.8 },
        FilterDesc::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        FilterDesc::Mitchell { b: 0.0, c: 0.75 },
    ];

    /// Mitsuba 3.9.1, scalar_rgb, `rfilter.eval` (relative to the value at zero; its exponential is an approximation to
    /// 1e-3).
    #[test]
    fn values_are_mitsubas() {
        let cases = [
            (ALL[1], [(0.3, 0.8), (0.8, 0.466_667), (1.3, 0.133_333)]),
            (ALL[2], [(0.3, 0.835_048), (0.8, 0.277_601), (1.3, 0.033_705)]),
            (ALL[3], [(0.3, 0.931_631), (0.8, 0.606_432), (1.9, 0.059_271)]),
            (ALL[4], [(0.3, 0.740_389), (0.8, 0.206_222), (1.3, -0.029_944)]),
        ];
        for (desc, points) in cases {
            for (x, expected) in points {
                assert!((value(desc, radius_of(desc), x) - expected).abs() < 1e-3, "{desc:?} {x}");
            }
        }
        assert_eq!(PixelFilter::new(ALL[2]).radius(), 2.0);
    }

    /// Weighted moments over a regular grid of random numbers against those of the filter itself.
    #[test]
    fn samples_reproduce_the_filter() {
        for desc in ALL {
            let filter = PixelFilter::new(desc);
            let r = filter.radius();
            let n = 20_000;
            let (mut weight, mut second) = (0.0f64, 0.0f64);
            for k in 0..n {
                // One axis at a time: the other's weight is divided out.
                let u = (k as f32 + 0.5) / n as f32;
                let (offset, w) = filter.sample([u, 0.5]);
                let other = f64::from(filter.sample([0.5, 0.5]).1).sqrt();
                let w = f64::from(w) / other;
                assert!(offset[0].abs() <= r);
                weight += w;
                second += w * f64::from(offset[0] * offset[0]);
            }
            let m = 20_000;
            let (mut f0, mut f2) = (0.0f64, 0.0f64);
            for k in 0..m {
                let x = r * (2.0 * (k as f32 + 0.5) / m as f32 - 1.0);
                let v = f64::from(value(desc, r, x));
                f0 += v;
                f2 += v * f64::from(x * x);
            }
            assert!((weight / f64::from(n) - 1.0).abs() < 2e-3, "{desc:?} {}", weight / f64::from(n));
            let (got, expected) = (second / f64::from(n), f2 / f0);
            assert!((got - expected).abs() < 2e-3, "{desc:?} {got} {expected}");
        }
    }

    /// Splats from a regular grid of positions bring every pixel the integral of its filter, 1, and no other mean
    /// position than its centre.
    #[test]
    fn splats_reproduce_the_filter() {
        for desc in ALL {
            let filter = PixelFilter::new(desc);
            let (n, m) = (100, 2000);
            let (mut weight, mut first, mut second, mut f2) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
            for k in 0..12 * n {
                let at = -6.0 + (k as f32 + 0.5) / n as f32;
                for j in 0..m {
                    let Some((pixel, w)) = filter.splat_axis(at, (j as f32 + 0.5) / m as f32) else { continue };
                    if pixel == 0 {
                        let (w, x) = (f64::from(w) / f64::from(n * m), f64::from(at) - 0.5);
                        (weight, first, second) = (weight + w, first + w * x, second + w * x * x);
                    }
                }
                let x = f64::from(at) - 0.5;
                f2 += f64::from(filter.value(x as f32)) * x * x / f64::from(n);
            }
            assert!((weight - 1.0).abs() < 5e-3, "{desc:?} {weight}");
            assert!(first.abs() < 5e-3, "{desc:?} {first}");
            assert!((second - f2).abs() < 1e-2, "{desc:?} {second} {f2}");
        }
    }

    #[test]
    fn filters_without_mass_are_boxes() {
        for desc in [FilterDesc::Gaussian { stddev: 0.0 }, FilterDesc::Mitchell { b: f32::NAN, c: 0.0 }] {
            let (offset, weight) = PixelFilter::new(desc).sample([0.25, 0.75]);
            assert_eq!((offset, weight), ([-0.25, 0.25], 1.0));
        }
    }
}
