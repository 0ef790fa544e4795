//! Exact Euclidean distance from every cube to the nearest solid one, squared, in cubes between middles.
//!
//! One pass along each axis: the squared distance along a line is the lower envelope of parabolas (Felzenszwalb and
//! Huttenlocher 2012). All numbers are whole, so the result is exact.

use super::voxels::VoxelGrid;
use rayon::prelude::*;

/// Further than any grid is wide, and its square still fits.
const FAR: u32 = 1 << 26;

/// Squared distances; 0 for solid cubes.
pub fn squared_distances(grid: &VoxelGrid) -> Vec<u32> {
    let [nx, ny, nz] = grid.dims;
    let mut field: Vec<u32> = grid.solid.iter().map(|&s| if s { 0 } else { FAR }).collect();
    if field.is_empty() {
        return field;
    }
    field.par_chunks_mut(nx).for_each(|row| envelope(row, &mut Scratch::default()));
    field.par_chunks_mut(nx * ny).for_each(|layer| along(layer, nx, ny, &mut Scratch::default()));
    // The third axis runs through all layers; a copy with z and y exchanged keeps every thread in memory of its own.
    let mut turned = vec![0; field.len()];
    turned.par_chunks_mut(nx * nz).enumerate().for_each(|(y, sheet)| {
        for z in 0..nz {
            let from = nx * (y + ny * z);
            sheet[nx * z..nx * (z + 1)].copy_from_slice(&field[from..from + nx]);
        }
        along(sheet, nx, nz, &mut Scratch::default());
    });
    field.par_chunks_mut(nx * ny).enumerate().for_each(|(z, layer)| {
        for y in 0..ny {
            let from = nx * (z + nz * y);
            layer[nx * y..nx * (y + 1)].copy_from_slice(&turned[from..from + nx]);
        }
    });
    field
}

#[derive(Default)]
struct Scratch {
    line: Vec<u32>,
    values: Vec<u32>,
    /// Places of the parabolas of the envelope, and where each begins to be the lowest.
    parabolas: Vec<(usize, i64)>,
}

/// Along the second axis of a sheet of `n` rows.
fn along(sheet: &mut [u32], nx: usize, n: usize, scratch: &mut Scratch) {
    for x in 0..nx {
        let mut line = std::mem::take(&mut scratch.line);
        line.clear();
        line.extend((0..n).map(|k| sheet[x + nx * k]));
        envelope(&mut line, scratch);
        for (k, value) in line.iter().enumerate() {
            sheet[x + nx * k] = *value;
        }
        scratch.line = line;
    }
}

/// line[i] ← min over k of line[k] + (i − k)².
fn envelope(line: &mut [u32], scratch: &mut Scratch) {
    let Scratch { values, parabolas, .. } = scratch;
    values.clear();
    values.extend_from_slice(line);
    parabolas.clear();
    let f = |k: usize| i64::from(values[k]) + (k * k) as i64;
    for (k, &value) in values.iter().enumerate() {
        if value >= FAR {
            continue;
        }
        let mut from = i64::MIN;
        while let Some(&(j, start)) = parabolas.last() {
            // First whole place where k is lower than j.
            from = (f(k) - f(j)).div_euclid(2 * (k - j) as i64) + 1;
            if from > start {
                break;
            }
            parabolas.pop();
            from = i64::MIN;
        }
        parabolas.push((k, from));
    }
    let mut current = 0;
    for (i, value) in line.iter_mut().enumerate() {
        while parabolas.get(current + 1).is_some_and(|&(_, start)| start <= i as i64) {
            current += 1;
        }
        if let Some(&(k, _)) = parabolas.get(current) {
            *value = values[k] + (i.abs_diff(k) * i.abs_diff(k)) as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    #[test]
    fn equals_brute_force() {
        for seed in 0..6 {
            let mut rng = HashRng::new(seed, 0, 0, 0);
            let share = [0.003, 0.02, 0.3][seed as usize % 3];
            let random: Vec<bool> = (0..13 * 17 * 11).map(|_| rng.next_f32() < share).collect();
            let mut grid = VoxelGrid::of([13, 17, 11], |_| false);
            // Without the rim, lines without anything solid occur as well.
            grid.solid = random;
            let solid: Vec<[usize; 3]> = (0..grid.len()).filter(|&i| grid.solid[i]).map(|i| grid.place(i)).collect();
            for (i, d) in squared_distances(&grid).into_iter().enumerate() {
                let at = grid.place(i);
                let to = |s: &[usize; 3]| (0..3).map(|c| at[c].abs_diff(s[c]).pow(2) as u32).sum::<u32>();
                assert_eq!(d, solid.iter().map(to).min().unwrap());
            }
        }
    }

    #[test]
    fn nothing_at_all_is_fine() {
        assert!(squared_distances(&VoxelGrid::default()).is_empty());
    }
}
