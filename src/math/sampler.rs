//! Sample values of one path: Owen-scrambled Sobol points on the camera and the first vertices, hashed numbers beyond.
//!
//! Each pixel has its own scramble, so pixels are independent and one pixel's samples are stratified over iterations
//! (Burley 2020, "Practical hash-based Owen scrambling"). Values come four at a time, one set for each [`SampleSlot`]
//! of a vertex.
//!
//! The Sobol matrices and the scramble are those of the crate `sobol_burley`; three things make them cheaper here. The
//! shuffled index is the same for all dimensions of a path and is computed once. A Sobol point is linear in the bits of
//! its index, so instead of one direction vector for every set bit it is the sum of one table entry for every four
//! bits, without a branch. And both sets of a vertex are made together, as arrays of eight that fill a vector register,
//! when the first of them is asked for.

use super::hash::{HashRng, hash_words, mix64};
use sobol_burley::parts::{hash, owen_scramble_rev, sobol_rev, u32_to_f32_norm};
use std::sync::LazyLock;

/// Number `i` of `n` systematic samples of [0, 1): every sample is at the same `offset`, itself in [0, 1), of its own
/// n-th part.
#[inline]
pub fn systematic(i: u32, n: u32, offset: f32) -> f32 {
    // Rounding must not make it one.
    ((i as f32 + offset) / n as f32).min(1.0 - f32::EPSILON)
}

/// Sets of four numbers of a vertex. Fixed slots keep Sobol dimensions aligned whatever earlier vertices consumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleSlot {
    /// Sampling a light and a point on it, and one more number for connections to stored vertices: [light, u, v,
    /// connection].
    Emitter = 0,
    /// Sampling a lobe and a direction, and Russian roulette: [lobe, u, v, roulette].
    Scatter = 1,
}

/// Vertices (counted from the path's origin, which is vertex 0) that get Sobol points.
const SOBOL_VERTICES: u32 = 5;
/// Dimensions of a vertex: two sets of four.
const LANES: usize = 8;
/// sobol_burley has 2^16 points in a sequence; later ones start another scramble.
const SEQUENCE_BITS: u32 = 16;
/// Index bits that one table entry stands for.
const CHUNK: u32 = 4;
const CHUNKS: usize = (SEQUENCE_BITS / CHUNK) as usize;
/// Keys that make the dimensions of a set differ before they are scrambled (sobol_burley's constants), for both sets of
/// a vertex.
const LANE_KEYS: [u32; LANES] = [
    0x912f_69ba,
    0x174f_18ab,
    0x691e_72ca,
    0xb40c_c1b8,
    0x912f_69ba ^ 1,
    0x174f_18ab ^ 1,
    0x691e_72ca ^ 1,
    0xb40c_c1b8 ^ 1,
];

/// `TABLES[vertex][chunk][bits]`: what the index bits of a chunk contribute to the dimensions of a vertex
/// (bit-reversed).
type Tables = [[[[u32; LANES]; 1 << CHUNK]; CHUNKS]; SOBOL_VERTICES as usize + 1];

static TABLES: LazyLock<Box<Tables>> = LazyLock::new(|| {
    let mut tables: Box<Tables> = Box::new([[[[0; LANES]; 1 << CHUNK]; CHUNKS]; SOBOL_VERTICES as usize + 1]);
    for (vertex, chunks) in tables.iter_mut().enumerate() {
        for (chunk, entries) in chunks.iter_mut().enumerate() {
            for (bits, entry) in entries.iter_mut().enumerate() {
                let index_rev = (bits as u32) << (32 - CHUNK * (chunk as u32 + 1));
                *entry = std::array::from_fn(|d| sobol_rev(index_rev, (LANES * vertex + d) as u32));
            }
        }
    }
    tables
});

/// The source of one path's random numbers.
#[derive(Clone, Debug)]
pub struct PathSampler {
    tables: &'static Tables,
    index: u32,
    /// The shuffled, reversed index.
    shuffled_rev: u32,
    scramble: u32,
    /// Key of the hashed numbers; unique to the path.
    key: u64,
    /// The vertex whose numbers are at hand.
    current: u32,
    numbers: [[f32; 4]; 2],
    rest: Option<HashRng>,
}

impl PathSampler {
    /// Numbers of the path of `pixel_or_path` in `iteration`; `stream` tells eye paths from light paths and the like.
    #[inline]
    pub fn new(seed: u64, stream: u64, pixel_or_path: u64, iteration: u64) -> PathSampler {
        let index = (iteration & ((1 << SEQUENCE_BITS) - 1)) as u32;
        let epoch = iteration >> SEQUENCE_BITS;
        let identity = hash_words(&[seed, stream, pixel_or_path, epoch]);
        let scramble = identity as u32;
        PathSampler {
            tables: &TABLES,
            index,
            shuffled_rev: owen_scramble_rev(index.reverse_bits(), hash(scramble ^ 0x79c6_8e4a)),
            scramble: scramble.wrapping_mul(0x9c8f_2d3b),
            key: mix64(identity ^ u64::from(index)),
            current: u32::MAX,
            numbers: [[0.0; 4]; 2],
            rest: None,
        }
    }

    /// One set of numbers of a vertex.
    #[inline]
    fn set(&mut self, vertex: u32, set: usize) -> [f32; 4] {
        if self.current != vertex {
            self.current = vertex;
            let numbers =
                if vertex <= SOBOL_VERTICES { self.sobol(vertex) } else { self.hashed(vertex) }.map(u32_to_f32_norm);
            self.numbers = [std::array::from_fn(|d| numbers[d]), std::array::from_fn(|d| numbers[4 + d])];
        }
        self.numbers[set]
    }

    /// The dimensions of a vertex of the path's Sobol point; the same as of `sobol_burley::sample_4d`.
    #[inline]
    fn sobol(&self, vertex: u32) -> [u32; LANES] {
        let tables = &self.tables[vertex as usize];
        let mut point = [0u32; LANES];
        for (c, chunk) in tables.iter().enumerate() {
            let entry = &chunk[(self.shuffled_rev >> (32 - CHUNK * (c as u32 + 1))) as usize % (1 << CHUNK)];
            for d in 0..LANES {
                point[d] ^= entry[d];
            }
        }
        let scramble = self.scramble ^ (2 * vertex);
        for d in 0..LANES {
            point[d] = owen_scramble_rev(point[d], hash(scramble ^ LANE_KEYS[d])).reverse_bits();
        }
        point
    }

    /// Independent numbers: a 64-bit hash of path and vertex, spread over the lanes by a 32-bit hash of either half.
    #[inline]
    fn hashed(&self, vertex: u32) -> [u32; LANES] {
        let bits = mix64(self.key.wrapping_add(u64::from(vertex).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let (low, high) = (bits as u32, (bits >> 32) as u32);
        let mut lanes = [0u32; LANES];
        for d in 0..LANES {
            lanes[d] = hash(hash(low ^ LANE_KEYS[d]).wrapping_add(high));
        }
        lanes
    }

    /// Numbers for the origin of the path: [film x, film y, lens u, lens v] or [light, u, v, spare].
    #[inline]
    pub fn origin(&mut self) -> [f32; 4] {
        self.set(0, 0)
    }

    /// A second set for the origin (a light's direction).
    #[inline]
    pub fn origin_direction(&mut self) -> [f32; 4] {
        self.set(0, 1)
    }

    /// Numbers for vertex `vertex` (1 is the first hit).
    #[inline]
    pub fn vertex(&mut self, vertex: u32, slot: SampleSlot) -> [f32; 4] {
        self.set(vertex, slot as usize)
    }

    /// Two numbers for the edge to vertex `vertex`, which only some scenes need: each is stratified by itself over the
    /// path's index, beside all other numbers of the path.
    pub fn flight(&mut self, vertex: u32) -> [f32; 2] {
        let key = mix64(u64::from(self.scramble) ^ (u64::from(vertex) << 32) ^ 0xf119_0000_0000_0000);
        [key as u32, (key >> 32) as u32].map(|key| {
            let shuffled_rev = owen_scramble_rev(self.index.reverse_bits(), hash(key));
            // The radical inverse of the shuffled index.
            let point_rev = shuffled_rev.reverse_bits();
            u32_to_f32_norm(owen_scramble_rev(point_rev, hash(key ^ 0x9c8f_2d3b)).reverse_bits())
        })
    }

    /// Unstratified numbers for whatever has no slot.
    #[inline]
    pub fn rng(&mut self) -> &mut HashRng {
        let key = self.key;
        // Tagged so that the stream never meets the numbers of a vertex.
        self.rest.get_or_insert_with(|| HashRng::from_key(mix64(key ^ 0x5eed_0000_0000_0000)))
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
                assert_eq!(sampler.vertex(vertex, SampleSlot::Emitter), expected(2 * vertex));
                assert_eq!(sampler.vertex(vertex, SampleSlot::Scatter), expected(2 * vertex + 1));
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
    fn numbers_of_an_edge_are_stratified_each_by_itself_and_independent() {
        let mut cells = [0u32; 16];
        for pixel in 0..16 {
            let mut strata = [[0u32; 256]; 2];
            for iteration in 0..256 {
                let mut sampler = PathSampler::new(3, 0, pixel, iteration);
                let (u, v) = (sampler.flight(1), sampler.flight(2));
                (0..2).for_each(|d| strata[d][(u[d] * 256.0) as usize] += 1);
                cells[(u[0] * 4.0) as usize * 4 + (v[1] * 4.0) as usize] += 1;
            }
            assert!(strata.iter().flatten().all(|&n| n == 1), "pixel {pixel}");
        }
        // 256 expected in each; 15 degrees of freedom: more than 38 once in a thousand.
        let chi2: f64 = cells.iter().map(|&n| (f64::from(n) - 256.0).powi(2) / 256.0).sum();
        assert!(chi2 < 38.0, "{chi2}");
    }

    #[test]
    fn numbers_beyond_the_sobol_points_are_uniform_and_independent() {
        // Pairs of lanes and pairs of neighbouring vertices, in an 8 × 8 grid of cells.
        const N: usize = 64_000;
        let mut cells = [[[0u32; 64]; 10]; 2];
        let mut seen = std::collections::HashSet::new();
        for path in 0..N as u64 {
            let mut sampler = PathSampler::new(3, 0, path / 250, path % 250);
            let at = |u: [f32; 4]| u.map(|u| (u * 8.0) as usize);
            let (a, b) = (sampler.vertex(6, SampleSlot::Emitter), sampler.vertex(6, SampleSlot::Scatter));
            seen.insert(a.map(f32::to_bits));
            let c = sampler.vertex(7, SampleSlot::Emitter);
            for (k, (x, y)) in [(at(a), at(b)), (at(a), at(c))].into_iter().enumerate() {
                for i in 0..4 {
                    cells[k][i][8 * x[i] + y[i]] += 1;
                }
                for (n, (i, j)) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].into_iter().enumerate() {
                    cells[k][4 + n][8 * x[i] + if k == 0 { x[j] } else { y[j] }] += 1;
                }
            }
        }
        assert_eq!(seen.len(), N);
        // χ² with 63 degrees of freedom exceeds 120 with a probability of 2e-5.
        let expected = N as f64 / 64.0;
        for counts in cells.iter().flatten() {
            let chi2: f64 = counts.iter().map(|&n| (f64::from(n) - expected).powi(2) / expected).sum();
            assert!(chi2 < 120.0, "{chi2}");
        }
    }

    #[test]
    fn sequences_go_on_after_their_period() {
        let a = PathSampler::new(3, 0, 99, 0).origin();
        let b = PathSampler::new(3, 0, 99, 1 << SEQUENCE_BITS).origin();
        assert_ne!(a, b);
    }
}
