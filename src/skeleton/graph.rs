//! From cubes on curves to few nodes: each node clears its maximal ball of smaller ones (Noël and Biri 2015, §4.4).
//!
//! A ball is empty space, and its middle sees all of it: one node speaks for what is inside. What a node of the curves
//! becomes when it is removed is the nearest node that stays, along the curves; so the graph of those that stay hangs
//! together where the curves do.
//!
//! Two things are added to the paper's filter, since walls have insides and grids have an end. A ball is taken to be at
//! least two cubes wide, so that a gap of one cube does not have a node in every cube; such a ball clears neighbours
//! only. And curves in spaces no wider than two cubes are left out unless they join what nothing else joins: they run
//! between the shells of walls and through every lattice. The graph thus keeps pieces together, but not all of the
//! loops that thinning keeps.

use super::Node;
use super::thinning::WIDE;
use super::voxels::{OFFSETS, VoxelGrid};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Smallest squared radius that a ball is taken to have. Cubes nearer than two cubes are neighbours: nothing is between
/// them.
const SMALLEST: u32 = 4;

/// Nodes that stay, and which of them are neighbours.
#[derive(Debug, Default)]
pub struct Graph {
    /// Nodes, largest ball first.
    pub nodes: Vec<Node>,
    /// The cube of each node.
    pub cubes: Vec<usize>,
    /// Pairs of neighbours, the smaller number first, sorted.
    pub edges: Vec<[u32; 2]>,
}

/// Filters `curve`, cubes in ascending order; `squared` as for thinning.
pub fn filtered(grid: &VoxelGrid, squared: &[u32], curve: &[usize]) -> Graph {
    let curve = &worthwhile(grid, squared, curve);
    let mut order = curve.clone();
    order.sort_by_key(|&i| (Reverse(squared[i]), i));
    let stay = survivors(grid, squared, &order);
    let node = |&i: &usize| Node { position: grid.centre(i), radius: (squared[i] as f32).sqrt() * grid.cell };
    let edges = contracted(grid, curve, &stay);
    Graph { nodes: stay.iter().map(node).collect(), edges, cubes: stay }
}

/// Cubes that hang together and are all wide, or all narrow.
struct Stretch {
    wide: bool,
    cubes: Vec<usize>,
    /// Stretches of the other kind that it touches.
    touches: Vec<usize>,
}

/// Cuts curves where they become wide ([`WIDE`]) or narrow.
fn stretches(grid: &VoxelGrid, squared: &[u32], curve: &[usize]) -> Vec<Stretch> {
    const UNNUMBERED: usize = usize::MAX;
    let mut on_curve = vec![false; grid.len()];
    for &i in curve {
        on_curve[i] = true;
    }
    let is_wide = |i: usize| squared[i] >= WIDE;
    let steps = grid.steps();
    let near = |i: usize| steps.iter().map(move |s| i.wrapping_add_signed(*s));
    let mut number = vec![UNNUMBERED; grid.len()];
    let mut found: Vec<Stretch> = Vec::new();
    for &start in curve {
        if number[start] != UNNUMBERED {
            continue;
        }
        let (wide, mut cubes, mut done) = (is_wide(start), vec![start], 0);
        number[start] = found.len();
        while let Some(&i) = cubes.get(done) {
            done += 1;
            for n in near(i).filter(|&n| on_curve[n] && is_wide(n) == wide) {
                if number[n] == UNNUMBERED {
                    number[n] = found.len();
                    cubes.push(n);
                }
            }
        }
        found.push(Stretch { wide, cubes, touches: Vec::new() });
    }
    for (k, stretch) in found.iter_mut().enumerate() {
        let around = stretch.cubes.iter().flat_map(|&i| near(i)).filter(|&n| on_curve[n]).map(|n| number[n]);
        stretch.touches = around.filter(|&n| n != k).collect();
        stretch.touches.sort_unstable();
        stretch.touches.dedup();
    }
    found
}

/// The cubes of wide stretches, and of those narrow ones that join wide ones, the short before the long. All if nothing
/// is wide.
fn worthwhile(grid: &VoxelGrid, squared: &[u32], curve: &[usize]) -> Vec<usize> {
    let stretches = stretches(grid, squared, curve);
    if !stretches.iter().any(|s| s.wide) {
        return curve.to_vec();
    }
    // Joined nodes have the same root.
    let mut parent: Vec<usize> = (0..stretches.len()).collect();
    let root = |parent: &[usize], mut k: usize| {
        while parent[k] != k {
            k = parent[k];
        }
        k
    };
    let mut narrow: Vec<&Stretch> = stretches.iter().filter(|s| !s.wide).collect();
    narrow.sort_by_key(|s| s.cubes.len());
    let mut stay: Vec<usize> = stretches.iter().filter(|s| s.wide).flat_map(|s| s.cubes.iter().copied()).collect();
    for stretch in narrow {
        let mut joined = false;
        for pair in stretch.touches.windows(2) {
            let (a, b) = (root(&parent, pair[0]), root(&parent, pair[1]));
            joined |= a != b;
            parent[a.max(b)] = a.min(b);
        }
        if joined {
            stay.extend(&stretch.cubes);
        }
    }
    stay.sort_unstable();
    stay
}

/// The cubes of `order` that are in no ball of an earlier one that stays.
fn survivors(grid: &VoxelGrid, squared: &[u32], order: &[usize]) -> Vec<usize> {
    let places: Vec<[usize; 3]> = order.iter().map(|&i| grid.place(i)).collect();
    let mut gone = vec![false; order.len()];
    let mut number = vec![u32::MAX; grid.len()];
    for (k, &i) in order.iter().enumerate() {
        number[i] = k as u32;
    }
    let inside = |a: [usize; 3], b: [usize; 3], radius2: u32| {
        (0..3).map(|c| a[c].abs_diff(b[c]).pow(2)).sum::<usize>() < radius2 as usize
    };
    let mut stay = Vec::new();
    for (k, &i) in order.iter().enumerate() {
        if gone[k] {
            continue;
        }
        stay.push(i);
        let (at, radius2) = (places[k], squared[i].max(SMALLEST));
        let reach = f64::from(radius2).sqrt() as usize;
        if (2 * reach + 1).pow(3) > order.len() {
            for later in k + 1..order.len() {
                gone[later] |= inside(at, places[later], radius2);
            }
            continue;
        }
        // A small ball: fewer cubes than nodes.
        let range = |c: usize| at[c].saturating_sub(reach)..=(at[c] + reach).min(grid.dims[c] - 1);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let later = number[grid.index([x, y, z])] as usize;
                    if later != u32::MAX as usize && later > k && inside(at, [x, y, z], radius2) {
                        gone[later] = true;
                    }
                }
            }
        }
    }
    stay
}

/// Gives every cube of `curve` to the node of `stay` that is nearest along the curves (steps count their length; ties
/// go to the smaller number), and joins the nodes whose cubes touch.
fn contracted(grid: &VoxelGrid, curve: &[usize], stay: &[usize]) -> Vec<[u32; 2]> {
    const NO_OWNER: (u32, u32) = (u32::MAX, u32::MAX);
    // Distance and owner of cubes on curves.
    let mut owner = vec![NO_OWNER; grid.len()];
    let mut on_curve = vec![false; grid.len()];
    for &i in curve {
        on_curve[i] = true;
    }
    let mut queue = BinaryHeap::new();
    for (&i, k) in stay.iter().zip(0..) {
        owner[i] = (0, k);
        queue.push(Reverse((0, k, i)));
    }
    let steps = grid.steps();
    let mut edges = Vec::new();
    while let Some(Reverse((distance, k, i))) = queue.pop() {
        if owner[i] != (distance, k) {
            continue;
        }
        for (step, offset) in steps.iter().zip(OFFSETS) {
            let n = i.wrapping_add_signed(*step);
            let offer = (distance + super::map::step_length(offset), k);
            if on_curve[n] && offer < owner[n] {
                owner[n] = offer;
                queue.push(Reverse((offer.0, k, n)));
            }
        }
    }
    for &i in curve {
        for step in steps {
            let n = i.wrapping_add_signed(step);
            let (a, b) = (owner[i].1, owner[n].1);
            if on_curve[n] && a < b && b != u32::MAX {
                edges.push([a, b]);
            }
        }
    }
    edges.sort_unstable();
    edges.dedup();
    edges
}

#[cfg(test)]
mod tests {
    use super::super::distance::squared_distances;
    use super::super::thinning::curves;
    use super::*;
    use crate::math::Vec3;
    use crate::math::hash::HashRng;

    fn graph_of(grid: &VoxelGrid) -> (Graph, Vec<usize>, Vec<u32>) {
        let squared = squared_distances(grid);
        let curve = curves(grid, &squared);
        (filtered(grid, &squared, &curve), curve, squared)
    }

    /// Number of pieces of a graph.
    fn pieces(nodes: usize, edges: &[[u32; 2]]) -> usize {
        let mut label: Vec<usize> = (0..nodes).collect();
        for _ in 0..nodes {
            for [a, b] in edges.iter().map(|e| e.map(|k| k as usize)) {
                let least = label[a].min(label[b]);
                (label[a], label[b]) = (least, least);
            }
        }
        label.iter().enumerate().filter(|(i, l)| i == *l).count()
    }

    #[test]
    fn no_node_is_in_a_larger_ball_and_every_cube_of_the_curves_is_in_one() {
        for seed in 0..6 {
            let mut rng = HashRng::new(seed, 0, 0, 0);
            let random: Vec<bool> = (0..30 * 24 * 20).map(|_| rng.next_f32() < 0.004).collect();
            let grid = VoxelGrid::of([30, 24, 20], |[x, y, z]| random[x + 30 * (y + 24 * z)] || x == 15);
            let (graph, curve, squared) = graph_of(&grid);
            let distance = |a: Vec3, b: Vec3| (a - b).length();
            for (k, a) in graph.nodes.iter().enumerate() {
                for b in &graph.nodes[k + 1..] {
                    assert!(a.radius >= b.radius && distance(a.position, b.position) >= a.radius.max(2.0) - 1e-4);
                }
            }
            for &i in &worthwhile(&grid, &squared, &curve) {
                let p = grid.centre(i);
                let node = |n: &Node| {
                    distance(n.position, p) < n.radius.max(2.0) && n.radius.powi(2) > squared[i] as f32 - 1e-2
                };
                assert!(graph.nodes.iter().any(node));
            }
            assert_eq!(pieces(graph.nodes.len(), &graph.edges), 2, "two rooms");
        }
    }

    #[test]
    fn a_ring_stays_a_ring() {
        let grid = VoxelGrid::of([40, 40, 8], |[x, y, _]| (6..34).contains(&x) && (6..34).contains(&y));
        let (graph, ..) = graph_of(&grid);
        assert_eq!(pieces(graph.nodes.len(), &graph.edges), 1);
        assert_eq!(graph.nodes.len(), graph.edges.len(), "as many edges as nodes");
    }

    #[test]
    fn of_two_narrow_passages_the_short_one_stays() {
        // Rooms beside each other; holes in the wall between them at y = 5 and, with a way round a corner, at y = 15.
        let solid = |[x, y, z]: [usize; 3]| {
            let passage = z == 5 && ((y == 5 && (9..12).contains(&x)) || (y == 15 && (9..16).contains(&x)));
            let wall = (9..12).contains(&x) || ((12..16).contains(&x) && y > 10);
            wall && !passage
        };
        let grid = VoxelGrid::of([26, 20, 11], solid);
        let (graph, curve, _) = graph_of(&grid);
        let has = |y: usize| curve.contains(&grid.index([10, y, 5]));
        assert!(has(5) && has(15), "a loop");
        assert_eq!(pieces(graph.nodes.len(), &graph.edges), 1);
        let crossing = |y: f32| {
            let near = |n: &&Node| (9.0..12.0).contains(&n.position.x) && (n.position.y - y).abs() < 1.0;
            graph.nodes.iter().filter(near).count()
        };
        assert!(crossing(5.5) > 0 && crossing(15.5) == 0);
    }
}
