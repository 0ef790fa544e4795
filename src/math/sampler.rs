//! Sample values of one path: Owen-scrambled Sobol points on the camera and the first vertices, hashed numbers beyond.
//!
//! Each pixel has its own scramble, so pixels are independent and one pixel's samples are stratified over iterations
//! (Burley 2020, "Practical hash-based Owen scrambling"). Values come four at a time, one set for each purpose of a vertex.

use super::hash::{HashRng, hash_words};

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
/// sobol_burley has 2^16 points in a sequence; later ones start another scramble.
const SEQUENCE_BITS: u32 = 16;

/// The source of one path's random numbers.
#[derive(Clone, Debug)]
pub struct PathSampler {
    index: u32,
    scramble: u32,
    key: [u64; 4],
    rest: Option<HashRng>,
}

impl PathSampler {
    /// Numbers of the path of `pixel_or_path` in `iteration`; `stream` tells eye paths from light paths and the like.
    pub fn new(seed: u64, stream: u64, pixel_or_path: u64, iteration: u64) -> PathSampler {
        let index = (iteration & ((1 << SEQUENCE_BITS) - 1)) as u32;
        let epoch = iteration >> SEQUENCE_BITS;
        let scramble = hash_words(&[seed, stream, pixel_or_path, epoch]) as u32;
        PathSampler { index, scramble, key: [seed, stream, pixel_or_path, iteration], rest: None }
    }

    /// Numbers for the origin of the path: [film x, film y, lens u, lens v] or [light, u, v, spare].
    pub fn origin(&mut self) -> [f32; 4] {
        sobol_burley::sample_4d(self.index, 0, self.scramble)
    }

    /// A second set for the origin (a light's direction).
    pub fn origin_direction(&mut self) -> [f32; 4] {
        sobol_burley::sample_4d(self.index, 1, self.scramble)
    }

    /// Numbers for vertex `vertex` (1 is the first hit).
    pub fn vertex(&mut self, vertex: u32, purpose: Purpose) -> [f32; 4] {
        if vertex <= SOBOL_VERTICES {
            sobol_burley::sample_4d(self.index, 2 * vertex + purpose as u32, self.scramble)
        } else {
            self.rng().next_4()
        }
    }

    /// Unstratified numbers for whatever has no slot.
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
