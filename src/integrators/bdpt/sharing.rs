//! Which pixel is joined with which light sub-path, where there are fewer of these than pixels.
//!
//! A connection is one sample of its technique for its pixel, whoever else connects to the same light sub-path: sharing leaves each
//! pixel's estimate and its weights alone, except that the light image gets fewer splats. What it costs is that the noise of pixels
//! with one light sub-path is correlated. They are therefore kept apart, and are others in every iteration.
//!
//! The full film is cut into blocks of 16 × 16 pixels, as into tiles. The k pixels that share a light sub-path are all in one block, and
//! one owns it: its splats are made where that pixel is rendered. So a crop knows its pixels' sub-paths without the rest of the film.

use super::CHOICE_STREAM;
use crate::math::hash::HashRng;

/// Pixels along a block's side.
pub(super) const SIDE: u32 = 16;
/// Pixels in a block.
const BLOCK: u32 = SIDE * SIDE;

/// A rectangle of pixels contains one.
pub(super) fn contains([x0, y0, width, height]: [u32; 4], [x, y]: [u32; 2]) -> bool {
    x.wrapping_sub(x0) < width && y.wrapping_sub(y0) < height
}

/// The sharing of an iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sharing {
    film_size: [u32; 2],
    /// k, a power of two.
    pixels_per_path: u32,
    seed: u64,
    iteration: u64,
}

/// Place of a light sub-path: a block and a number in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot {
    block: [u32; 2],
    number: u32,
}

impl Sharing {
    /// `effort` is the number of light sub-paths over that of pixels, at most one.
    pub fn new(film_size: [u32; 2], effort: f32, seed: u64, iteration: u64) -> Sharing {
        let pixels_per_path = ((1.0 / effort).round() as u32).clamp(1, BLOCK).next_power_of_two();
        Sharing { film_size, pixels_per_path, seed, iteration }
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
                let mut random = HashRng::new(self.seed, CHOICE_STREAM | u64::from(round) << 32, place, self.iteration);
                (random.next_u64() % u64::from(self.slots())) as u32
            }
        }
    }

    /// Where the light sub-path is that the pixel at a column and row of the full film is joined with.
    pub fn slot_of(&self, [x, y]: [u32; 2]) -> Slot {
        let (block, local) = ([x / SIDE, y / SIDE], y % SIDE * SIDE + x % SIDE);
        let slots = self.slots();
        Slot { block, number: (local % slots + self.shift(block, local / slots)) % slots }
    }

    /// The pixel that owns a light sub-path; it may lie beyond the film's edge.
    pub fn owner(&self, slot: Slot) -> [u32; 2] {
        // The first of them: it is not shifted.
        let local = slot.number;
        [slot.block[0] * SIDE + local % SIDE, slot.block[1] * SIDE + local / SIDE]
    }

    /// The pixels that are joined with it, some of which may lie beyond the film's edge.
    pub fn pixels(&self, slot: Slot) -> impl Iterator<Item = [u32; 2]> {
        let slots = self.slots();
        let this = *self;
        (0..self.pixels_per_path).map(move |round| {
            let local = round * slots + (slot.number + slots - this.shift(slot.block, round)) % slots;
            [slot.block[0] * SIDE + local % SIDE, slot.block[1] * SIDE + local / SIDE]
        })
    }

    /// All light sub-paths of the blocks that a rectangle of pixels touches.
    pub fn slots_in(&self, [x0, y0, width, height]: [u32; 4]) -> impl Iterator<Item = Slot> {
        let slots = self.slots();
        let across = x0 / SIDE..(x0 + width).div_ceil(SIDE);
        let down = y0 / SIDE..(y0 + height).div_ceil(SIDE);
        down.flat_map(move |y| across.clone().map(move |x| [x, y]))
            .flat_map(move |block| (0..slots).map(move |number| Slot { block, number }))
    }

    /// Number of the sub-path among those of the iteration.
    pub fn path(&self, slot: Slot) -> u32 {
        match self.pixels_per_path {
            // Where all pixels have their own, it is the pixel's.
            1 => {
                let [x, y] = self.owner(slot);
                y * self.film_size[0] + x
            }
            _ => (slot.block[1] * self.film_size[0].div_ceil(SIDE) + slot.block[0]) * self.slots() + slot.number,
        }
    }

    /// Number of sub-paths that have an owner on the film.
    pub fn paths(&self) -> u32 {
        let along = |size: u32, first: u32| (size.max(first) - first).div_ceil(SIDE);
        let [width, height] = self.film_size;
        (0..self.slots()).map(|local| along(width, local % SIDE) * along(height, local / SIDE)).sum()
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
    fn every_pixel_has_one_light_sub_path_and_every_sub_path_one_owner() {
        for size in [[1, 1], [32, 16], [37, 21], [3, 70]] {
            for effort in [1.0, 0.25, 0.0625, 0.003_906_25] {
                for iteration in 0..3 {
                    let sharing = Sharing::new(size, effort, 7, iteration);
                    let film = [0, 0, size[0], size[1]];
                    let slots: Vec<Slot> = sharing.slots_in(film).collect();
                    let mut of_pixel = HashMap::new();
                    for &slot in &slots {
                        for pixel in sharing.pixels(slot) {
                            assert_eq!(sharing.slot_of(pixel), slot);
                            assert!(of_pixel.insert(pixel, slot).is_none());
                        }
                        assert!(sharing.pixels(slot).any(|pixel| pixel == sharing.owner(slot)));
                    }
                    assert!(all(size).all(|pixel| of_pixel.contains_key(&pixel)));
                    let owned: Vec<Slot> =
                        slots.iter().copied().filter(|&slot| contains(film, sharing.owner(slot))).collect();
                    assert_eq!(owned.len(), sharing.paths() as usize, "{size:?} {effort}");
                    let numbers: HashSet<u32> = owned.iter().map(|&slot| sharing.path(slot)).collect();
                    assert_eq!(numbers.len(), owned.len());
                }
            }
        }
    }

    #[test]
    fn all_have_their_own_at_full_effort() {
        let sharing = Sharing::new([37, 21], 1.0, 7, 3);
        for (number, pixel) in all([37, 21]).enumerate() {
            let slot = sharing.slot_of(pixel);
            assert_eq!(sharing.owner(slot), pixel);
            assert_eq!(sharing.path(slot), number as u32);
        }
        assert_eq!(sharing.paths(), 37 * 21);
    }

    #[test]
    fn neighbours_in_noise_change() {
        let partner = |iteration| {
            let sharing = Sharing::new([64, 64], 0.25, 7, iteration);
            sharing.pixels(sharing.slot_of([9, 9])).collect::<Vec<_>>()
        };
        assert!((1..5).any(|iteration| partner(iteration) != partner(0)));
    }
}
