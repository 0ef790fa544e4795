//! Morton order: a curve through space along which neighbours stay close (Morton 1966).

use crate::math::Vec3;
use rayon::prelude::*;

/// Bits of a code.
pub const BITS: u32 = 30;

/// Moves the lower ten bits of `x` three apart.
fn dilate(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// Morton code of `p` in the box from `lo` to `hi`, of [`BITS`] bits; points outside are moved to its faces.
pub fn code(p: Vec3, lo: Vec3, hi: Vec3) -> u32 {
    let size = (hi - lo).max(Vec3::splat(f32::MIN_POSITIVE));
    let cell = ((p - lo) / size * 1024.0).clamp(Vec3::ZERO, Vec3::splat(1023.0));
    // Coordinates that are not numbers become 0.
    dilate(cell.x as u32) | dilate(cell.y as u32) << 1 | dilate(cell.z as u32) << 2
}

fn bounds(points: &[Vec3]) -> [Vec3; 2] {
    [points.iter().copied().fold(Vec3::INFINITY, Vec3::min), points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max)]
}

/// Morton codes of `points` in the box around them, each with the number of its point, in ascending order.
pub fn sorted(points: &[Vec3]) -> Vec<(u32, u32)> {
    let mut keys = vec![];
    sort(points, &mut keys);
    keys
}

/// [`sorted`] into `keys`, whose memory is used again.
pub fn sort(points: &[Vec3], keys: &mut Vec<(u32, u32)>) {
    let [lo, hi] = bounds(points);
    let key = |(i, p): (usize, &Vec3)| (code(*p, lo, hi), i as u32);
    points.par_iter().enumerate().map(key).collect_into_vec(keys);
    // All keys differ: the order is the same for any number of threads.
    keys.par_sort_unstable();
}

/// Numbers of `points` in Morton order.
pub fn order(points: &[Vec3]) -> Vec<u32> {
    sorted(points).into_iter().map(|(_, i)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_interleaved() {
        let at = |x: f32, y: f32, z: f32| code(Vec3::new(x, y, z), Vec3::ZERO, Vec3::splat(1024.0));
        assert_eq!((at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, 0.0, 1.0)), (1, 2, 4));
        assert_eq!(at(1023.0, 1023.0, 1023.0), (1 << 30) - 1);
        assert_eq!(at(-5.0, 2000.0, 3.0), at(0.0, 1023.0, 3.0));
        assert_eq!(at(f32::NAN, 0.0, 0.0), 0);
    }

    #[test]
    fn an_order_has_everything_once() {
        let points: Vec<Vec3> = (0..500).map(|i| Vec3::new((i % 7) as f32, (i % 11) as f32, (i % 13) as f32)).collect();
        let mut order = order(&points);
        order.sort_unstable();
        assert!(order.iter().copied().eq(0..500));
        assert!(super::order(&[]).is_empty());
    }
}
