//! A density on the unit cube of four dimensions that is constant in the boxes of a binary tree, fitted to weighted
//! points.
//!
//! Every inner node halves its box along one axis and holds the probability of the lower half. A sample is warped on
//! its way down the tree, in the coordinate of each node's axis alone: stratified numbers give stratified points, and
//! the density is the product of probability over ½ along the way.

/// A point of the unit cube.
pub type Point4 = [f32; 4];

/// A point with a weight.
#[derive(Clone, Copy, Debug)]
pub struct WeightedPoint {
    /// Where it is, in [0, 1].
    pub at: Point4,
    /// Its share in the density; positive.
    pub weight: f64,
}

/// How a tree is fitted.
#[derive(Clone, Copy, Debug)]
pub struct BoxTreeFit {
    /// Only the first axes are halved; the density is constant along the others.
    pub axes: usize,
    /// Part of the probability that is spread evenly over the cube: no density is less.
    pub even: f64,
    /// A box is halved if it holds no less than this effective number of points, (Σw)² / Σw².
    pub min_points: f64,
    /// A box is halved at most this often.
    pub max_depth: u32,
}

/// Parts of a box along an axis, by which the axis with the most uneven weights is found.
const BINS: usize = 8;
/// Points, of the typical weight in a box, that either of its halves has beforehand: few points in one half do not prove
/// that there is nothing in the other (Laplace's rule of succession).
const PRIOR_POINTS: f64 = 1.0;
/// Marks a node without children.
const LEAF: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// The axis that is halved, or [`LEAF`].
    axis: u32,
    /// The child of the lower half; that of the upper one follows it.
    child: u32,
    /// Probability of the lower half, given that of the box.
    lower: f32,
}

/// See the module's head.
#[derive(Clone, Debug)]
pub struct BoxTree {
    nodes: Vec<Node>,
}

/// A box with the points in it, before it becomes a node.
struct Fitted<'a> {
    node: usize,
    /// Fitted probability.
    probability: f64,
    lo: Point4,
    size: Point4,
    depth: u32,
    points: &'a mut [WeightedPoint],
}

fn total(points: &[WeightedPoint]) -> f64 {
    points.iter().map(|p| p.weight).sum()
}

/// Σ_i q_i ln q_i of the fractions of weight in equal parts of a box along an axis: the negative entropy.
fn unevenness(fitted: &Fitted, axis: usize) -> f64 {
    let mut bins = [0.0; BINS];
    for p in fitted.points.iter() {
        let x = (p.at[axis] - fitted.lo[axis]) / fitted.size[axis] * BINS as f32;
        bins[(x as usize).min(BINS - 1)] += p.weight;
    }
    let sum: f64 = bins.iter().sum();
    bins.iter().filter(|b| **b > 0.0).map(|b| b / sum * (b / sum).ln()).sum()
}

impl BoxTree {
    /// The tree for `points`, which are put in another order; `None` if they have no weight.
    pub fn fit(points: &mut [WeightedPoint], fit: &BoxTreeFit) -> Option<BoxTree> {
        let all = total(points);
        if !(all > 0.0 && all.is_finite()) {
            return None;
        }
        let mut tree = BoxTree { nodes: vec![Node { axis: LEAF, child: 0, lower: 0.5 }] };
        let mut open = vec![Fitted { node: 0, probability: 1.0, lo: [0.0; 4], size: [1.0; 4], depth: 0, points }];
        while let Some(fitted) = open.pop() {
            let weight = total(fitted.points);
            let squares: f64 = fitted.points.iter().map(|p| p.weight * p.weight).sum();
            if fitted.depth == fit.max_depth || weight * weight < fit.min_points * squares || weight <= 0.0 {
                continue;
            }
            // Weight of a typical point.
            let typical = squares / weight;
            let uneven: [f64; 4] =
                std::array::from_fn(|k| if k < fit.axes { unevenness(&fitted, k) } else { f64::MIN });
            let axis = (1..fit.axes).fold(0, |best, k| if uneven[k] > uneven[best] { k } else { best });
            let [lower, upper] = tree.halve(fitted, axis, typical, fit.even);
            open.extend([lower, upper]);
        }
        Some(tree)
    }

    /// Gives the node of a box two children.
    fn halve<'a>(&mut self, fitted: Fitted<'a>, axis: usize, typical: f64, even: f64) -> [Fitted<'a>; 2] {
        let Fitted { node, probability, lo, mut size, depth, points } = fitted;
        size[axis] *= 0.5;
        let middle = lo[axis] + size[axis];
        let mut below = 0;
        for i in 0..points.len() {
            if points[i].at[axis] < middle {
                points.swap(i, below);
                below += 1;
            }
        }
        let (lower, upper) = points.split_at_mut(below);
        let (a, b) = (total(lower) + PRIOR_POINTS * typical, total(upper) + PRIOR_POINTS * typical);
        let volume: f64 = size.iter().map(|&s| f64::from(s)).product();
        let rest = (probability - 2.0 * even * volume).max(0.0);
        let [a, b] = [a, b].map(|mass| even * volume + rest * mass / (a + b));
        let child = self.nodes.len() as u32;
        self.nodes[node] = Node { axis: axis as u32, child, lower: (a / (a + b)) as f32 };
        self.nodes.extend([Node { axis: LEAF, child: 0, lower: 0.5 }; 2]);
        let mut lo_upper = lo;
        lo_upper[axis] = middle;
        let depth = depth + 1;
        [
            Fitted { node: child as usize, probability: a, lo, size, depth, points: lower },
            Fitted { node: child as usize + 1, probability: b, lo: lo_upper, size, depth, points: upper },
        ]
    }

    /// Maps uniform numbers to a point of the density.
    pub fn sample(&self, mut u: Point4) -> Point4 {
        let (mut lo, mut size) = ([0.0f32; 4], [1.0f32; 4]);
        let mut node = &self.nodes[0];
        while node.axis != LEAF {
            let (k, q) = (node.axis as usize, node.lower);
            size[k] *= 0.5;
            node = if u[k] < q {
                u[k] /= q;
                &self.nodes[node.child as usize]
            } else {
                u[k] = (u[k] - q) / (1.0 - q);
                lo[k] += size[k];
                &self.nodes[node.child as usize + 1]
            };
            u[k] = u[k].clamp(0.0, super::float::ONE_MINUS_EPSILON);
        }
        std::array::from_fn(|k| lo[k] + u[k] * size[k])
    }

    /// Density of [`BoxTree::sample`] per unit volume; coordinates outside of the cube are clamped.
    pub fn pdf(&self, p: Point4) -> f32 {
        let mut p = p.map(|x| x.clamp(0.0, super::float::ONE_MINUS_EPSILON));
        let mut density = 1.0;
        let mut node = &self.nodes[0];
        while node.axis != LEAF {
            let k = node.axis as usize;
            p[k] *= 2.0;
            // Doubling and subtracting one are exact: the box is found without rounding.
            node = if p[k] < 1.0 {
                density *= 2.0 * node.lower;
                &self.nodes[node.child as usize]
            } else {
                p[k] -= 1.0;
                density *= 2.0 * (1.0 - node.lower);
                &self.nodes[node.child as usize + 1]
            };
        }
        density
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    const FIT: BoxTreeFit = BoxTreeFit { axes: 4, even: 0.2, min_points: 16.0, max_depth: 14 };

    fn uniform(rng: &mut HashRng) -> Point4 {
        rng.next_4()
    }

    /// Points in a thin slab that is not parallel to the axes.
    fn slab(rng: &mut HashRng) -> Point4 {
        let u = uniform(rng);
        [0.5 * u[0] + 0.1, 0.3 * u[0] + 0.05 * u[1], u[2], 0.75 + 0.01 * u[3]]
    }

    fn fitted(axes: usize) -> (BoxTree, HashRng) {
        let mut rng = HashRng::from_key(7);
        let mut points: Vec<_> =
            (0..4000).map(|i| WeightedPoint { at: slab(&mut rng), weight: 1.0 + f64::from(i % 3) }).collect();
        (BoxTree::fit(&mut points, &BoxTreeFit { axes, ..FIT }).unwrap(), rng)
    }

    /// The mean density of uniform points is one; samples have the inverse densities of the boxes they fall into.
    #[test]
    fn samples_follow_the_density() {
        let (tree, mut rng) = fitted(4);
        let (n, mut mass, mut volume) = (200_000, 0.0, 0.0);
        for _ in 0..n {
            mass += f64::from(tree.pdf(uniform(&mut rng)));
            let p = tree.sample(uniform(&mut rng));
            assert!(p.iter().all(|x| (0.0..1.0).contains(x)));
            volume += 1.0 / f64::from(tree.pdf(p));
        }
        assert!((mass / f64::from(n) - 1.0).abs() < 0.1, "{mass}");
        assert!((volume / f64::from(n) - 1.0).abs() < 0.02, "{volume}");
        // In a region that no box border cuts: its share of samples against its integrated density.
        let inside = |p: &Point4| p[0] < 0.5 && p[3] >= 0.75;
        let drawn = (0..n).filter(|_| inside(&tree.sample(uniform(&mut rng)))).count() as f64 / f64::from(n);
        let region = |rng: &mut HashRng| {
            let u = uniform(rng);
            tree.pdf([0.5 * u[0], u[1], u[2], 0.75 + 0.25 * u[3]])
        };
        let integral = (0..n).map(|_| f64::from(region(&mut rng))).sum::<f64>() / f64::from(n) * 0.125;
        assert!((drawn / integral - 1.0).abs() < 0.05, "{drawn} {integral}");
    }

    #[test]
    fn points_get_density_and_everything_has_some() {
        let (tree, mut rng) = fitted(4);
        let mean = (0..1000).map(|_| f64::from(tree.pdf(slab(&mut rng)))).sum::<f64>() / 1000.0;
        assert!(mean > 50.0, "{mean}");
        assert!((0..1000).all(|_| tree.pdf(uniform(&mut rng)) >= 0.199));
    }

    #[test]
    fn axes_beyond_the_first_stay_even() {
        let (tree, mut rng) = fitted(2);
        for _ in 0..1000 {
            let p = uniform(&mut rng);
            assert_eq!(tree.pdf(p), tree.pdf([p[0], p[1], 0.1, 0.9]));
        }
        let u = [0.3, 0.6, 0.123, 0.456];
        assert_eq!(tree.sample(u)[2..], u[2..]);
    }

    #[test]
    fn points_without_weight_give_nothing() {
        assert!(BoxTree::fit(&mut [], &FIT).is_none());
        assert!(BoxTree::fit(&mut [WeightedPoint { at: [0.5; 4], weight: f64::NAN }], &FIT).is_none());
    }
}
