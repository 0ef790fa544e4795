//! Rays and hits as Embree hands them to a callback: every component of all rays in a row of its own, a float a lane.

use super::RoundShape;
use crate::math::Vec3;

/// Rows of rays.
pub const RAY_ROWS: usize = 12;
/// Rows of rays with hits: those of the rays, and of the hits all that callbacks write.
pub const RAY_HIT_ROWS: usize = 20;

const ORIGIN: usize = 0;
const NEAR: usize = 3;
const DIRECTION: usize = 4;
const FAR: usize = 8;
const MASK: usize = 9;
const NORMAL: usize = 12;
const UV: usize = 15;
const PRIMITIVE: usize = 17;
const GEOMETRY: usize = 18;
const INSTANCE: usize = 19;

/// Ray parameter and code of the first point of `shape` on the ray of a lane, if the ray looks for its surface.
fn meet(rows: &[f32], [n, lane]: [usize; 2], shape: &RoundShape) -> Option<(f64, [f32; 2])> {
    let at = |row: usize| rows[row * n + lane];
    if at(MASK).to_bits() & shape.surface.bits() == 0 {
        return None;
    }
    let [o, d] = [ORIGIN, DIRECTION].map(|row| Vec3::new(at(row), at(row + 1), at(row + 2)));
    shape.intersect(o, d, [at(NEAR), at(FAR)])
}

/// Writes the hit of a lane's ray on `shape`, if there is one, as a hit on the geometry and instance `ids`. `rows` are
/// [`RAY_HIT_ROWS`] rows; `at` is the number of lanes and the lane.
pub fn intersect(rows: &mut [f32], at: [usize; 2], shape: &RoundShape, ids: [u32; 2]) -> bool {
    let Some((t, [u, v])) = meet(rows, at, shape) else { return false };
    let [n, lane] = at;
    let mut set = |row: usize, value: f32| rows[row * n + lane] = value;
    set(FAR, t as f32);
    (NORMAL..UV).for_each(|row| set(row, 0.0));
    set(UV, u);
    set(UV + 1, v);
    for (row, number) in [(PRIMITIVE, 0), (GEOMETRY, ids[0]), (INSTANCE, ids[1])] {
        set(row, f32::from_bits(number));
    }
    true
}

/// Marks a lane's ray as blocked if it meets `shape`. `rows` are [`RAY_ROWS`] rows; `at` as for [`intersect`].
pub fn occlude(rows: &mut [f32], at: [usize; 2], shape: &RoundShape) -> bool {
    let met = meet(rows, at, shape).is_some();
    if met {
        rows[FAR * at[0] + at[1]] = f32::NEG_INFINITY;
    }
    met
}
