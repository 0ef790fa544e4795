//! The light sub-path that each pixel is connected to, where there are fewer of these than pixels.
//!
//! A connection is one sample of its technique for its pixel, whatever other pixels connect to the same light sub-path:
//! assignment leaves the estimate of each pixel and its weights alone, except that the light image gets fewer splats.
//! Its cost is that the noise of pixels with one light sub-path is correlated. They are therefore kept apart, and are
//! others in every iteration.
//!
//! The full film is cut into blocks of 16 × 16 pixels, as into tiles. The k pixels that share a light sub-path are all
//! in one block, and one is its home: its splats are made where that pixel is rendered. So a crop knows the sub-paths
//! of its pixels without the rest of the film.

use crate::math::hash::HashRng;
use crate::path::streams;

/// Pixels along a block's side.
pub const BLOCK_SIDE: u32 = 16;
/// Pixels in a block.
const BLOCK: u32 = BLOCK_SIDE * BLOCK_SIDE;

/// A rectangle of pixels contains one.
pub fn contains([x0, y0, width, height]: [u32; 4], [x, y]: [u32; 2]) -> bool {
    x.wrapping_sub(x0) < width && y.wrapping_sub(y0) < height
}

/// How the pixels of an iteration share light sub-paths.
#[derive(Clone, Copy, Debug)]
pub struct LightPathAssignment {
    film_size: [u32; 2],
    /// k, a power of two.
    pixels_per_path: u32,
    seed: u64,
    iteration: u64,
}

/// A light sub-path: a block and a number in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightPathSlot {
    block: [u32; 2],
    number: u32,
}

impl LightPathAssignment {
    /// `fraction` is the number of light sub-paths over that of pixels, at most one.
    pub fn new(film_size: [u32; 2], fraction: f32, seed: u64, iteration: u64) -> LightPathAssignment {
        let pixels_per_path = ((1.0 / fraction).round() as u32).clamp(1, BLOCK).next_power_of_two();
        LightPathAssignment { film_size, pixels_per_path, seed, iteration }
    }

    fn slots(&self) -> u32 {
        BLOCK / self.pixels_per_path
    }

    /// Pixels of a block that are `round` times the number of slots apart have the same slot, but for a shift.
    fn shift(&self, block: [u32; 2], round: u32) -> u32 {
        match round {
            0 => 0,
            _ => {
                let place = u64::from(block[1]) << 32 | u64::from(block[0]);
                let mut random =
                    HashRng::new(self.seed, streams::ASSIGNMENT | u64::from(round) << 32, place, self.iteration);
                (random.next_u64() % u64::from(self.slots())) as u32
            }
        }
    }

    /// The light sub-path that the pixel at a column and row of the full film is connected to.
    pub fn slot_of(&self, [x, y]: [u32; 2]) -> LightPathSlot {
        let (block, local) = ([x / BLOCK_SIDE, y / BLOCK_SIDE], y % BLOCK_SIDE * BLOCK_SIDE + x % BLOCK_SIDE);
        let slots = self.slots();
        LightPathSlot { block, number: (local % slots + self.shift(block, local / slots)) % slots }
    }

    /// The pixel that a light sub-path belongs to; it may lie beyond the film's edge.
    pub fn home_pixel(&self, slot: LightPathSlot) -> [u32; 2] {
        // The first of them: it is not shifted.
        let local = slot.number;
        [slot.block[0] * BLOCK_SIDE + local % BLOCK_SIDE, slot.block[1] * BLOCK_SIDE + local / BLOCK_SIDE]
    }

    /// The pixels that are connected to it, some of which may lie beyond the film's edge.
    pub fn pixels(&self, slot: LightPathSlot) -> impl Iterator<Item = [u32; 2]> {
        let slots = self.slots();
        let this = *self;
        (0..self.pixels_per_path).map(move |round| {
            let local = round * slots + (slot.number + slots - this.shift(slot.block, round)) % slots;
            [slot.block[0] * BLOCK_SIDE + local % BLOCK_SIDE, slot.block[1] * BLOCK_SIDE + local / BLOCK_SIDE]
        })
    }

    /// All light sub-paths of the blocks that a rectangle of pixels touches.
    pub fn slots_in(&self, [x0, y0, width, height]: [u32; 4]) -> impl Iterator<Item = LightPathSlot> {
        let slots = self.slots();
        let across = x0 / BLOCK_SIDE..(x0 + width).div_ceil(BLOCK_SIDE);
        let down = y0 / BLOCK_SIDE..(y0 + height).div_ceil(BLOCK_SIDE);
        down.flat_map(move |y| across.clone().map(move |x| [x, y]))
            .flat_map(move |block| (0..slots).map(move |number| LightPathSlot { block, number }))
    }

    /// Number of the sub-path among those of the iteration.
    pub fn path(&self, slot: LightPathSlot) -> u32 {
        match self.pixels_per_path {
            // Without sharing it is the number of the pixel.
            1 => {
                let [x, y] = self.home_pixel(slot);
                y * self.film_size[0] + x
            }
            _ => (slot.block[1] * self.film_size[0].div_ceil(BLOCK_SIDE) + slot.block[0]) * self.slots() + slot.number,
        }
    }

    /// Number of sub-paths whose home pixel is on the film.
    pub fn paths(&self) -> u32 {
        let along = |size: u32, first: u32| (size.max(first) - first).div_ceil(BLOCK_SIDE);
        let [width, height] = self.film_size;
        (0..self.slots()).map(|local| along(width, local % BLOCK_SIDE) * along(height, local / BLOCK_SIDE)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{HashMap, HashSet};

    fn all(size: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
        (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y]))
    }

    #[test]
    fn every_pixel_has_one_light_sub_path_and_every_sub_path_one_home() {
        for size in [[1, 1], [32, 16], [37, 21], [3, 70]] {
            for fraction in [1.0, 0.25, 0.0625, 0.003_906_25] {
                for iteration in 0..3 {
                    let assignment = LightPathAssignment::new(size, fraction, 7, iteration);
                    let film = [0, 0, size[0], size[1]];
                    let slots: Vec<LightPathSlot> = assignment.slots_in(film).collect();
                    let mut of_pixel = HashMap::new();
                    for &slot in &slots {
                        for pixel in assignment.pixels(slot) {
                            assert_eq!(assignment.slot_of(pixel), slot);
                            assert!(of_pixel.insert(pixel, slot).is_none());
                        }
                        assert!(assignment.pixels(slot).any(|pixel| pixel == assignment.home_pixel(slot)));
                    }
                    assert!(all(size).all(|pixel| of_pixel.contains_key(&pixel)));
                    let at_home: Vec<LightPathSlot> =
                        slots.iter().copied().filter(|&slot| contains(film, assignment.home_pixel(slot))).collect();
                    assert_eq!(at_home.len(), assignment.paths() as usize, "{size:?} {fraction}");
                    let numbers: HashSet<u32> = at_home.iter().map(|&slot| assignment.path(slot)).collect();
                    assert_eq!(numbers.len(), at_home.len());
                }
            }
        }
    }

    #[test]
    fn all_have_their_own_without_sharing() {
        let assignment = LightPathAssignment::new([37, 21], 1.0, 7, 3);
        for (number, pixel) in all([37, 21]).enumerate() {
            let slot = assignment.slot_of(pixel);
            assert_eq!(assignment.home_pixel(slot), pixel);
            assert_eq!(assignment.path(slot), number as u32);
        }
        assert_eq!(assignment.paths(), 37 * 21);
    }

    #[test]
    fn pixels_that_share_change() {
        let partner = |iteration| {
            let assignment = LightPathAssignment::new([64, 64], 0.25, 7, iteration);
            assignment.pixels(assignment.slot_of([9, 9])).collect::<Vec<_>>()
        };
        assert!((1..5).any(|iteration| partner(iteration) != partner(0)));
    }
}
