//! Tests of a cube's neighbourhood: may the cube be removed without changing the topology, and does it hold two parts
//! together?
//!
//! An object whose cubes touch over faces, edges or corners (26 neighbours), in a background whose cubes touch over
//! faces (6). A cube is *simple* if the object's other cubes around it are one piece and if the background within its
//! 18 neighbours that reaches a face of it is one piece (Bertrand and Malandain 1994). Removing a simple cube neither
//! splits, joins, opens nor closes anything.

/// Bit of the cube itself in a neighbourhood of 27 bits; bit x + 3y + 9z.
pub const CENTRE: u32 = 1 << 13;
/// All cubes around.
pub const AROUND: u32 = ((1 << 27) - 1) & !CENTRE;
const FACES: u32 = mask_within(1);
const EDGES_AND_FACES: u32 = mask_within(2);

/// Cubes around that differ from the middle in at most `axes` coordinates.
const fn mask_within(axes: u32) -> u32 {
    let (mut mask, mut k) = (0, 0);
    while k < 27 {
        let differs = (k % 3 != 1) as u32 + (k / 3 % 3 != 1) as u32 + (k / 9 != 1) as u32;
        if differs > 0 && differs <= axes {
            mask |= 1 << k;
        }
        k += 1;
    }
    mask
}

/// For each of 27 cubes the others that touch it: over faces only, or in any way. The middle is left out.
const fn touching(faces_only: bool) -> [u32; 27] {
    let mut table = [0; 27];
    let mut a = 0;
    while a < 27 {
        let mut b = 0;
        while b < 27 {
            let (dx, dy, dz) = ((a % 3i32 - b % 3).abs(), (a / 3 % 3 - b / 3 % 3).abs(), (a / 9 - b / 9).abs());
            let near = if faces_only { dx + dy + dz == 1 } else { dx <= 1 && dy <= 1 && dz <= 1 && a != b };
            if near && b != 13 {
                table[a as usize] |= 1 << b;
            }
            b += 1;
        }
        a += 1;
    }
    table
}

const TOUCH_26: [u32; 27] = touching(false);
const TOUCH_6: [u32; 27] = touching(true);

/// Everything in `set` that hangs together with `seed`.
#[inline]
fn flood(set: u32, seed: u32, touch: &[u32; 27]) -> u32 {
    let (mut found, mut front) = (seed, seed);
    while front != 0 {
        let k = front.trailing_zeros() as usize;
        front &= front - 1;
        let new = touch[k] & set & !found;
        found |= new;
        front |= new;
    }
    found
}

/// In how many pieces the object's cubes around the middle lie; 0: the middle is alone. `object` has a bit for each
/// cube of it.
#[inline]
pub fn pieces(object: u32) -> u32 {
    let (mut rest, mut count) = (object & AROUND, 0);
    while rest != 0 {
        rest &= !flood(rest, rest & rest.wrapping_neg(), &TOUCH_26);
        count += 1;
    }
    count
}

/// True if the background touches a face of the middle, and as one piece.
#[inline]
fn background_is_one(object: u32) -> bool {
    let background = !object & EDGES_AND_FACES;
    let at_faces = background & FACES;
    at_faces != 0 && at_faces & !flood(background, at_faces & at_faces.wrapping_neg(), &TOUCH_6) == 0
}

/// True if the background touches a face of the middle.
#[inline]
pub fn is_border(object: u32) -> bool {
    !object & FACES != 0
}

/// True if the middle may go.
#[inline]
pub fn is_simple(object: u32) -> bool {
    background_is_one(object) && pieces(object) == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::HashRng;

    fn at(k: usize) -> [i32; 3] {
        [k % 3, k / 3 % 3, k / 9].map(|c| c as i32 - 1)
    }

    /// Pieces of the listed cubes by the definition, without masks.
    fn components(cubes: &[usize], touch: impl Fn([i32; 3], [i32; 3]) -> bool) -> Vec<usize> {
        let mut label: Vec<usize> = (0..cubes.len()).collect();
        for _ in 0..cubes.len() {
            for (i, &a) in cubes.iter().enumerate() {
                for (j, &b) in cubes.iter().enumerate() {
                    if touch(at(a), at(b)) {
                        label[i] = label[i].min(label[j]);
                    }
                }
            }
        }
        label
    }

    fn by_definition(object: u32) -> (bool, usize) {
        let l1 = |a: [i32; 3], b: [i32; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<i32>();
        let norm = |k: usize| l1(at(k), [0; 3]);
        let cubes: Vec<usize> = (0..27).filter(|&k| k != 13 && object >> k & 1 == 1).collect();
        let mut pieces = components(&cubes, |a, b| (0..3).all(|c| (a[c] - b[c]).abs() <= 1));
        pieces.sort_unstable();
        pieces.dedup();
        let holes: Vec<usize> = (0..27).filter(|&k| k != 13 && norm(k) <= 2 && object >> k & 1 == 0).collect();
        let label = components(&holes, |a, b| l1(a, b) == 1);
        let mut faces: Vec<usize> =
            holes.iter().zip(label).filter(|(k, _)| norm(**k) == 1).map(|(_, label)| label).collect();
        faces.sort_unstable();
        faces.dedup();
        (pieces.len() == 1 && faces.len() == 1, pieces.len())
    }

    #[test]
    fn agrees_with_the_definition() {
        let mut rng = HashRng::new(1, 0, 0, 0);
        let mut simple = 0;
        for round in 0..12_000 {
            let (a, b) = (rng.next_u64() as u32, rng.next_u64() as u32);
            // Half full, thin and dense neighbourhoods.
            let object = ([a, a & b, a | b][round % 3] & AROUND) | CENTRE;
            assert_eq!((is_simple(object), pieces(object) as usize), by_definition(object), "{object:027b}");
            simple += usize::from(is_simple(object));
        }
        assert!((500..11_500).contains(&simple), "{simple}");
    }

    #[test]
    fn known_neighbourhoods() {
        assert!(!is_simple(CENTRE), "a lone cube");
        assert!(is_simple(CENTRE | 1), "the end of a curve");
        assert!(!is_simple(CENTRE | 1 << 12 | 1 << 14), "the middle of a curve");
        assert!(!is_simple(AROUND | CENTRE), "inside");
        assert!(is_simple((AROUND | CENTRE) & !(1 << 12)), "a flat border");
        assert!(!is_border(AROUND | CENTRE));
    }
}
