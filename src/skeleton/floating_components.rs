//! Solid components that touch nothing (a hanging lamp, a book a hair above its table) are connected to the walls by
//! bridges: paths of cubes one cube thick.
//!
//! Empty space around a floating component is a shell, and thinning a shell leaves a closed sheet: no curve has its
//! topology. With a bridge through the shell it has the topology of a room with a pillar. Bridges are cut into the
//! space that is thinned and nowhere else: neither distances nor the map of nodes contain them.

use super::simple::{CENTRE, pieces};
use super::voxels::{OFFSETS, VoxelGrid};
use std::collections::VecDeque;

const NO_CUBE: usize = usize::MAX;

/// The empty cubes, less bridges from floating components to the rim or to components connected to it. A bridge that
/// would split empty space is left out. `squared` are the squared distances to solid cubes, in cubes.
pub fn bridge(grid: &VoxelGrid, squared: &[u32]) -> Vec<bool> {
    let mut object: Vec<bool> = squared.iter().map(|&d| d > 0).collect();
    if object.is_empty() {
        return object;
    }
    let steps = grid.steps();
    let faces: Vec<isize> = steps
        .iter()
        .zip(OFFSETS)
        .filter(|(_, o)| o.iter().map(|c| c.abs()).sum::<isize>() == 1)
        .map(|(s, _)| *s)
        .collect();
    let neighbour = |i: usize, step: isize| i.checked_add_signed(step).filter(|&n| n < squared.len());

    // Breadth first from the rim; solid cubes cost nothing, so that they come before all that is empty.
    let mut from = vec![NO_CUBE; object.len()];
    let mut reached = vec![false; object.len()];
    let mut queue = VecDeque::from([0]);
    reached[0] = true;
    let mut bridge_starts = Vec::new();
    let mut solid = Vec::new();
    while let Some(i) = queue.pop_front() {
        for n in faces.iter().filter_map(|&s| neighbour(i, s)) {
            if reached[n] {
                continue;
            }
            (reached[n], from[n]) = (true, i);
            if object[n] {
                queue.push_back(n);
                continue;
            }
            // The whole component joins the front. Where the front met it from empty space, a bridge starts.
            if object[i] {
                bridge_starts.push(i);
            }
            solid.push(n);
            while let Some(s) = solid.pop() {
                queue.push_front(s);
                for m in faces.iter().filter_map(|&step| neighbour(s, step)) {
                    if !reached[m] && !object[m] {
                        (reached[m], from[m]) = (true, s);
                        solid.push(m);
                    }
                }
            }
        }
    }
    for start in bridge_starts {
        cut(grid, &steps, &from, &mut object, start);
    }
    object
}

/// Removes the bridge from `start` back to the first solid cube from `object`, unless that splits empty space.
fn cut(grid: &VoxelGrid, steps: &[isize; 26], from: &[usize], object: &mut [bool], start: usize) {
    let mut done = Vec::new();
    let mut i = start;
    while object[i] && !grid.is_rim(grid.place(i)) {
        let mut mask = CENTRE;
        for (k, step) in steps.iter().enumerate() {
            // Bits after the middle are one further on.
            mask |= u32::from(object[i.wrapping_add_signed(*step)]) << (k + usize::from(k >= 13));
        }
        if pieces(mask) != 1 {
            for i in done {
                object[i] = true;
            }
            return;
        }
        object[i] = false;
        done.push(i);
        i = from[i];
    }
}
