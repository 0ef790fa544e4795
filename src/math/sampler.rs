//! Sample values of one path: Owen-scrambled Sobol points on the camera and the first vertices, hashed numbers beyond.
//!
//! Each pixel has its own scramble, so pixels are independent and one pixel's samples are stratified over iterations
//! (Burley 2020, "Practical hash-based Owen scrambling"). Values come four at a time, one set for each purpose of a vertex.
//!
//! The Sobol matrices and the scramble are those of the crate `sobol_burley`; two things make them cheaper here. The shuffled index
//! is the same for all dimensions of a path and is computed once. And a Sobol point is linear in the bits of its index, so instead
//! of one direction vector for every set bit it is the sum of one table entry for every four bits, without a branch.

use super::hash::{HashRng, hash_words};
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};
use std::sync::LazyLock;

/// What four numbers of a vertex are for. Fixed slots keep Sobol dimensions aligned whatever earlier vertices consumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Choosing a light and a point on it: [light, u, v, spare].
    Emitter = 0,
    /// Choosing a lobe and a direction, and Russian roulette: [lobe, u, v, roulette].
    Scatter = 1,
}

/// Vertices (counted from the path's origin) that get Sobol points.
const SOBOL_VERTICES: u32 = 5;
/// Sets of four dimensions: two for the origin, two for each vertex.
const SETS: usize = 2 + 2 * SOBOL_VERTICES as usize;
/// sobol_burley has 2^16 points in a sequence; later ones start another scramble.
const SEQUENCE_BITS: u32 = 16;
/// Index bits that one table entry stands for.
const CHUNK: u32 = 4;

/// `TABLES[set][chunk][bits]`: what the index bits of a chunk contribute to four dimensions (bit-reversed).
type Tables = [[[[u32; 4]; 1 << CHUNK]; (SEQUENCE_BITS / CHUNK) as usize]; SETS];

static TABLES: LazyLock<Box<Tables>> = LazyLock::new(|| {
    let mut tables: Box<Tables> = Box::new([[[[0; 4]; 1 << CHUNK]; (SEQUENCE_BITS / CHUNK) as usize]; SETS]);
    for (set, chunks) in tables.iter_mut().enumerate() {
        for (chunk, entries) in chunks.iter_mut().enumerate() {
            for (bits, entry) in entries.iter_mut().enumerate() {
                let index_rev = (bits as u32) << (32 - CHUNK * (chunk as u32 + 1));
                *entry = std::array::from_fn(|d| sobol_rev(index_rev, (4 * set + d) as u32));
            }
        }
    }
    tables
});

/// The source of one path's random numbers.
#[derive(Clone, Debug)]
pub struct PathSampler {
    tables: &'static Tables,
    /// Chunks of the shuffled, reversed index.
    chunks: [u8; (SEQUENCE_BITS / CHUNK) as usize],
    scramble: u32,
    key: [u64; 4],
    rest: Option<HashRng>,
}

impl PathSampler {
    /// Numbers of the path of `pixel_or_path` in `iteration`; `stream` tells eye paths from light paths and the like.
    #[inline]
    pub fn new(seed: u64, stream: u64, pixel_or_path: u64, iteration: u64) -> PathSampler {
        let index = (iteration & ((1 << SEQUENCE_BITS) - 1)) as u32;
        let epoch = iteration >> SEQUENCE_BITS;
        let scramble = hash_words(&[seed, stream, pixel_or_path, epoch]) as u32;
        let shuffled_rev = owen_scramble_rev(index.reverse_bits(), hash(scramble ^ 0x79c6_8e4a));
        PathSampler {
            tables: &TABLES,
            chunks: std::array::from_fn(|c| (shuffled_rev >> (32 - CHUNK * (c as u32 + 1))) as u8 & ((1 << CHUNK) - 1)),
            scramble: scramble.wrapping_mul(0x9c8f_2d3b),
            key: [seed, stream, pixel_or_path, iteration],
            rest: None,
        }
    }

    /// Four dimensions of the path's Sobol point; the same numbers as `sobol_burley::sample_4d`.
    #[inline]
    fn sobol(&self, set: usize) -> [f32; 4] {
        const LANES: [u32; 4] = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];
        let tables = &self.tables[set];
        let mut point = [0u32; 4];
        for (chunk, &bits) in tables.iter().zip(&self.chunks) {
            let entry = &chunk[bits as usize];
            for (p, e) in point.iter_mut().zip(entry) {
                *p ^= e;
            }
        }
        std::array::from_fn(|d| {
            let scramble = hash(self.scramble ^ set as u32 ^ LANES[d]);
            u32_to_f32_norm(owen_scramble_rev(point[d], scramble).reverse_bits())
        })
    }

    /// Numbers for the origin of the path: [film x, film y, lens u, lens v] or [light, u, v, spare].
    #[inline]
    pub fn origin(&mut self) -> [f32; 4] {
        self.sobol(0)
    }

    /// A second set for the origin (a light's direction).
    #[inline]
    pub fn origin_direction(&mut self) -> [f32; 4] {
        self.sobol(1)
    }

    /// Numbers for vertex `vertex` (1 is the first hit).
    #[inline]
    pub fn vertex(&mut self, vertex: u32, purpose: Purpose) -> [f32; 4] {
        if vertex <= SOBOL_VERTICES { self.sobol(2 * vertex as usize + purpose as usize) } else { self.rng().next_4() }
    }

    /// Unstratified numbers for whatever has no slot.
    #[inline]
    pub fn rng(&mut self) -> &mut HashRng {
        let [seed, stream, index, iteration] = self.key;
        // The stream is tagged so that it never meets a stream keyed without the tag.
        self.rest.get_or_insert_with(|| HashRng::new(seed, stream ^ 0x5eed_0000_0000, index, iteration))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_crate() {
        for (pixel, iteration) in [(0, 0), (99, 1), (12_345, 77), (3, 65_535), (8, 40_000)] {
            let mut sampler = PathSampler::new(3, 1, pixel, iteration);
            let seed = hash_words(&[3, 1, pixel, 0]) as u32;
            let expected = |set: u32| sobol_burley::sample_4d(iteration as u32, set, seed);
            assert_eq!(sampler.origin(), expected(0));
            assert_eq!(sampler.origin_direction(), expected(1));
            for vertex in 1..=SOBOL_VERTICES {
                assert_eq!(sampler.vertex(vertex, Purpose::Emitter), expected(2 * vertex));
                assert_eq!(sampler.vertex(vertex, Purpose::Scatter), expected(2 * vertex + 1));
            }
        }
    }

    #[test]
    fn one_pixel_is_stratified_over_iterations() {
        let mut cells = [0u32; 256];
        for iteration in 0..256 {
            let u = PathSampler::new(3, 0, 99, iteration).origin();
            cells[(u[0] * 16.0) as usize * 16 + (u[1] * 16.0) as usize] += 1;
        }
        // A scrambled (0, 8, 2)-net has one point in every cell of a 16 × 16 grid.
        assert!(cells.iter().all(|&n| n == 1));
    }

    #[test]
    fn sequences_go_on_after_their_period() {
        let a = PathSampler::new(3, 0, 99, 0).origin();
        let b = PathSampler::new(3, 0, 99, 1 << SEQUENCE_BITS).origin();
        assert_ne!(a, b);
    }
}
