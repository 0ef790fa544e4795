//! Hashed random numbers: every number is a pure function of (seed, stream, index, iteration, dimension), so that the
//! same seed gives the same bits for any number of threads and any one sample can be computed again alone.

use super::float::ONE_MINUS_EPSILON;

/// Finaliser of SplitMix64 (Steele et al. 2014): a bijection of 64 bits that passes statistical tests.
#[inline]
pub fn mix64(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Hash of several words, order mattering.
#[inline]
pub fn hash_words(words: &[u64]) -> u64 {
    words.iter().fold(0x9e37_79b9_7f4a_7c15, |h, &w| {
        mix64(h.wrapping_add(0x9e37_79b9_7f4a_7c15) ^ mix64(w.wrapping_add(0x632b_e59b_d9b4_e019)))
    })
}

/// 32 random bits → [0, 1), 24 bits of resolution.
pub fn unit_float(bits: u32) -> f32 {
    ((bits >> 8) as f32 * (1.0 / 16_777_216.0)).min(ONE_MINUS_EPSILON)
}

/// A counter-based stream: number `i` is a hash of the key and `i`.
#[derive(Clone, Copy, Debug)]
pub struct HashRng {
    key: u64,
    counter: u64,
}

impl HashRng {
    /// The stream of one purpose (`stream`), one pixel or light sub-path (`index`), one iteration.
    pub fn new(seed: u64, stream: u64, index: u64, iteration: u64) -> HashRng {
        HashRng { key: hash_words(&[seed, stream, index, iteration]), counter: 0 }
    }

    /// The stream of a key that is well mixed already.
    pub fn from_key(key: u64) -> HashRng {
        HashRng { key, counter: 0 }
    }

    /// Next 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        self.counter = self.counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix64(self.key ^ self.counter)
    }

    /// Next number in [0, 1).
    pub fn next_f32(&mut self) -> f32 {
        unit_float((self.next_u64() >> 32) as u32)
    }

    /// Next four numbers in [0, 1).
    pub fn next_4(&mut self) -> [f32; 4] {
        let (a, b) = (self.next_u64(), self.next_u64());
        [unit_float((a >> 32) as u32), unit_float(a as u32), unit_float((b >> 32) as u32), unit_float(b as u32)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_uniform_and_distinct() {
        let mut sum = 0.0f64;
        let mut seen = std::collections::HashSet::new();
        for index in 0..1000u64 {
            let mut rng = HashRng::new(7, 1, index, 0);
            for _ in 0..10 {
                let x = rng.next_f32();
                assert!((0.0..1.0).contains(&x));
                sum += f64::from(x);
            }
            assert!(seen.insert(rng.next_u64()));
        }
        // 10 000 uniforms: standard error of the mean is 0.0029.
        assert!((sum / 1e4 - 0.5).abs() < 0.0145, "{sum}");
    }
}
