//! Light trees: nodes bound their sources, cuts are partitions, probabilities match draws.

use super::*;
use crate::math::hash::HashRng;
use crate::math::{Pmf, Rgb};
use crate::spatial::morton;
use std::f32::consts::FRAC_PI_2;

fn points(n: usize, seed: u64) -> (Vec<u32>, Vec<WeightedPoint>) {
    let mut rng = HashRng::new(seed, 1, 2, 3);
    let positions: Vec<Vec3> = (0..n)
        .map(|i| {
            let [x, y, z, _] = rng.next_4();
            // Some points coincide, and many lie in one plane.
            if i % 7 == 0 { Vec3::splat(0.25) } else { Vec3::new(x, if i % 3 == 0 { 0.5 } else { y }, z) * 10.0 }
        })
        .collect();
    let sorted = morton::sorted(&positions);
    let weight = |i: usize, rng: &mut HashRng| if i.is_multiple_of(5) { 0.0 } else { rng.next_f32() };
    let weighted = |(i, &(_, number)): (usize, &(u32, u32))| WeightedPoint {
        p: positions[number as usize],
        weight: weight(i, &mut rng),
    };
    let points = sorted.iter().enumerate().map(weighted).collect();
    (sorted.into_iter().map(|(code, _)| code).collect(), points)
}

fn vpl_tree(n: usize, seed: u64) -> (VplTree, Vec<WeightedPoint>) {
    let (codes, mut points) = points(n, seed);
    let mut tree = VplTree::default();
    tree.build_morton(&codes, &mut points);
    (tree, points)
}

fn oriented(n: usize, seed: u64) -> Vec<OrientedSource<Rgb>> {
    let mut rng = HashRng::new(seed, 4, 5, 6);
    let source = |i: usize| {
        let ([x, y, z, w], [a, b, c, size]) = (rng.next_4(), rng.next_4());
        let p = Vec3::new(x, y, if i.is_multiple_of(2) { 0.5 } else { z }) * 8.0;
        let axis = if i.is_multiple_of(3) { Vec3::Z } else { (Vec3::new(a, b, c) - 0.5).normalize_or(Vec3::X) };
        OrientedSource {
            index: 2 * i as u32,
            bounds: LightBounds {
                aabb: Aabb { min: p, max: p + Vec3::new(size, a, b) * 0.1 },
                cone: Cone { axis, half_angle: w * w, emission: FRAC_PI_2 },
                power: Rgb::new(a, b * 3.0, c + 0.01),
            },
        }
    };
    (0..n).map(source).collect()
}

const RECEIVERS: ReceiverBounds = ReceiverBounds { centre: Vec3::new(3.0, -1.0, 2.0), radius: 0.3, normal: Vec3::Y };

fn by_count(max_clusters: usize) -> CutLimits {
    CutLimits { max_clusters, max_error: 0.0 }
}

/// Nodes are ranges that their children divide, and hold their sources.
fn check_nodes<S: LightSource>(tree: &LightTree<S::Cluster>, sources: &[S]) {
    assert_eq!(tree.nodes[0].range(), 0..sources.len());
    for node in &tree.nodes {
        let aabb = node.cluster.aabb();
        for s in &sources[node.range()] {
            let own = s.bounds();
            assert!(aabb.min.cmple(own.aabb().min).all() && aabb.max.cmpge(own.aabb().max).all());
        }
        if !node.is_leaf() {
            let [a, b] = [0, 1].map(|k| tree.nodes[node.child as usize + k].range());
            assert!(a.start == node.first as usize && a.end == b.start && b.end == node.end as usize);
            assert!(!a.is_empty() && !b.is_empty());
        }
    }
}

#[test]
fn nodes_hold_their_sources_under_either_rule() {
    for n in [1, 2, 3, 50, 1000] {
        let (tree, points) = vpl_tree(n, 3);
        check_nodes(&tree, &points);
        let mut sources = oriented(n, 7);
        let mut tree = LightTree::default();
        tree.build(&mut sources, &SaohSplit { max_depth: 31 }, 1);
        check_nodes(&tree, &sources);
        let leaves = tree.nodes.iter().filter(|node| node.is_leaf()).count();
        assert_eq!((leaves, tree.nodes.len()), (n, 2 * n - 1));
        let total = sources.iter().fold(Rgb::BLACK, |sum, s| sum + s.bounds.power);
        let root = tree.nodes[0].cluster.power;
        assert!((root.r - total.r).abs() + (root.g - total.g).abs() < 1e-4 * (total.r + total.g));
        for node in &tree.nodes {
            let Cone { axis, half_angle, .. } = node.cluster.cone;
            for s in &sources[node.range()] {
                let own = s.bounds.cone;
                let farthest = axis.dot(own.axis).clamp(-1.0, 1.0).acos() + own.half_angle;
                assert!(farthest <= half_angle + 2e-3 || half_angle > 3.13, "{farthest} {half_angle}");
            }
        }
    }
}

#[test]
fn a_depth_limit_halves_sets_by_count() {
    // Ever farther apart: the heuristic splits off few sources at a time.
    let mut sources = oriented(200, 2);
    for (i, s) in sources.iter_mut().enumerate() {
        let p = Vec3::X * 1.3f32.powi(i as i32);
        s.bounds.aabb = Aabb { min: p, max: p };
    }
    let depth = |max_depth: u32| {
        let mut tree = LightTree::default();
        tree.build(&mut sources.clone(), &SaohSplit { max_depth }, 1);
        let mut depths = vec![0; tree.nodes.len()];
        for (i, node) in tree.nodes.iter().enumerate().filter(|(_, n)| !n.is_leaf()) {
            depths[node.child as usize] = depths[i] + 1;
            depths[node.child as usize + 1] = depths[i] + 1;
        }
        depths.into_iter().max().unwrap()
    };
    assert!(depth(0) == 8 && depth(5) <= 5 + 8 && depth(1000) > 5 + 8, "{} {} {}", depth(0), depth(5), depth(1000));
}

#[test]
fn cuts_are_partitions_and_their_sums_are_the_whole() {
    for n in [0, 1, 2, 3, 50, 3000] {
        let (tree, points) = vpl_tree(n, n as u64);
        let total: f64 = points.iter().map(|p| f64::from(p.weight)).sum();
        let (mut scratch, mut cut) = (CutScratch::default(), vec![]);
        for clusters in [1, 2, 16, 200, 5000] {
            tree.cut(&RECEIVERS, by_count(clusters), |_| 1.0, &mut scratch, &mut cut);
            assert!(cut.len() <= clusters, "{n} {clusters}: {}", cut.len());
            assert!(cut.len() >= clusters.min(points.len() / MIN_VPL_LEAF / 2), "{n} {clusters}: {}", cut.len());
            let mut next = 0;
            let mut sum = 0.0;
            for range in &cut {
                assert!(range.start == next && range.end > range.start);
                next = range.end;
                sum += tree.weight(range);
            }
            assert_eq!(next, n);
            assert!((sum - total).abs() <= 1e-9 * total, "{sum} {total}");
        }
    }
}

#[test]
fn representatives_follow_weights() {
    let (tree, points) = vpl_tree(40, 9);
    let range = 7..29;
    let total: f64 = points[range.clone()].iter().map(|p| f64::from(p.weight)).sum();
    const N: u32 = 100_000;
    let mut counts = [0u32; 40];
    for i in 0..N {
        let (at, p) = tree.sample_in(&range, (i as f32 + 0.5) / N as f32).unwrap();
        assert!((p - f64::from(points[at].weight) / total).abs() < 1e-12);
        counts[at] += 1;
    }
    for (i, &count) in counts.iter().enumerate() {
        let weight = f64::from(points[i].weight);
        let expected = if range.contains(&i) { weight / total * f64::from(N) } else { 0.0 };
        assert!((f64::from(count) - expected).abs() < 3.0, "{i}: {count} {expected}");
    }
    assert_eq!(tree.sample_in(&(5..6), 0.5), None);
}

#[test]
fn cuts_are_fine_where_they_are_near() {
    let (tree, points) = vpl_tree(3000, 4);
    let receivers = ReceiverBounds { centre: Vec3::new(0.0, 5.0, 5.0), radius: 0.2, normal: Vec3::ZERO };
    let (mut scratch, mut cut) = (CutScratch::default(), vec![]);
    tree.cut(&receivers, by_count(100), |_| 1.0, &mut scratch, &mut cut);
    let size = |near: bool| {
        let own: Vec<usize> = cut
            .iter()
            .filter(|r| (points[r.start].p.distance(receivers.centre) < 3.0) == near)
            .map(ExactSizeIterator::len)
            .collect();
        own.iter().sum::<usize>() as f64 / own.len() as f64
    };
    assert!(size(true) * 2.0 < size(false), "{} {}", size(true), size(false));
}

#[test]
fn an_error_bound_ends_a_cut_and_holds() {
    let mut sources = oriented(2000, 11);
    let mut tree = LightTree::default();
    tree.build(&mut sources, &SaohSplit { max_depth: 31 }, 1);
    let (mut scratch, mut cut) = (CutScratch::default(), vec![]);
    let mut sizes = vec![];
    for max_error in [10.0, 1.0, 0.1] {
        tree.cut(&RECEIVERS, CutLimits { max_clusters: usize::MAX, max_error }, |_| 1.0, &mut scratch, &mut cut);
        sizes.push(cut.len());
        for range in cut.iter().filter(|range| range.len() > 1) {
            // No receiver and no two sources of a cluster may differ by more than the bound, above the softening within
            // the ball.
            let own = &sources[range.clone()];
            let inverse2 = |s: &OrientedSource<Rgb>| {
                let to = s.bounds.aabb.centre() - RECEIVERS.centre;
                if to.dot(RECEIVERS.normal) < 0.0 { None } else { Some(1.0 / to.length_squared().max(0.09)) }
            };
            let values: Vec<f32> = own.iter().filter_map(inverse2).collect();
            let (low, high) = values.iter().fold((f32::MAX, 0.0f32), |(l, h), &v| (l.min(v), h.max(v)));
            let weight = tree.weight(range) as f32;
            // The bound softens 1/d² to 1/(d² + r²): at distance ≥ 1 a difference shrinks by less than a third.
            assert!(values.len() < 2 || weight * (high - low) * 0.7 <= max_error * 1.01 || high > 1.0, "{range:?}");
        }
    }
    assert!(sizes[0] < sizes[1] && sizes[1] < sizes[2] && sizes[2] < 2000, "{sizes:?}");
}

#[test]
fn wide_trees_sample_with_their_probabilities() {
    for n in [0usize, 1, 2, 9, 300] {
        let sources = oriented(n, 20 + n as u64);
        let tree = WideLightTree::new(sources.clone());
        assert_eq!(tree.is_empty(), n == 0);
        assert_eq!(tree.pmf(Vec3::ZERO, None, 1), Pmf(0.0));
        let mut rng = HashRng::new(8, 8, 8, n as u64);
        for k in 0..20 {
            let [x, y, z, w] = rng.next_4();
            let p = Vec3::new(x, y, z) * if k % 2 == 0 { 8.0 } else { 100.0 };
            let normal = (k % 3 > 0).then(|| (Vec3::new(w, x, y) - 0.5).normalize_or(Vec3::Y));
            let total: f64 = sources.iter().map(|s| f64::from(tree.pmf(p, normal, s.index).0)).sum();
            assert!((total - if n == 0 { 0.0 } else { 1.0 }).abs() < 1e-5, "{n}: {total}");
            for _ in 0..50 {
                let sample = tree.sample(p, normal, rng.next_f32());
                let Some((index, pmf)) = sample else {
                    assert_eq!(n, 0);
                    continue;
                };
                assert!(pmf.0 > 0.0 && (pmf.0 - tree.pmf(p, normal, index).0).abs() <= 1e-6 * pmf.0);
            }
        }
    }
}
