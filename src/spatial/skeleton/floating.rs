//! Solid things that touch nothing (a hanging lamp, a book a hair above its table) are tied to the walls by threads of cubes.
//!
//! Space around a floating thing is a shell, and thinning a shell leaves a closed sheet: no curve has its topology. With a thread
//! through the shell it has that of a room with a pillar. A thread is cut into the space that is thinned and nowhere else: distances
//! and the map of nodes do not know it.

use super::simple::{CENTRE, pieces};
use super::voxels::{OFFSETS, VoxelGrid};
use std::collections::VecDeque;

const NO_CUBE: usize = usize::MAX;

/// The empty cubes, without threads from floating things to the rim or to things that hold to it. A thread that would split empty
/// space is not made.
pub fn tie(grid: &VoxelGrid, squared: &[u32]) -> Vec<bool> {
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
    let mut threads = Vec::new();
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
            // All of the thing that has been met joins the front. Where it was met from empty space, a thread is due.
            if object[i] {
                threads.push(i);
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
    for start in threads {
        cut(grid, &steps, &from, &mut object, start);
    }
    object
}

/// Takes the thread from `start` back to the first solid cube out of `object`, if that splits nothing.
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
