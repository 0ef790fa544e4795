//! Reachable parts of empty space: those that hold the camera, a point it sees, or a light.
//!
//! A house may stand on a wide ground, on which most cubes of a grid would be wasted: the grid ends not far beyond the
//! visible points. Points outside of the grid have no node.
//!
//! Walls, columns and cupboards of real scenes are hollow, and cavities may be larger than rooms together; as closed
//! parts of empty space they would have more nodes than the rooms. Paths hardly ever get there. Where one does after
//! all (through glass, through a gap finer than a cube), its points belong to the nearest node elsewhere.

use super::voxels::VoxelGrid;
use crate::emit::Light;
use crate::math::Vec3;
use crate::prepared::PreparedScene;
use crate::ray::Ray;

/// Columns and rows of rays that look at the scene.
const VIEW: [u32; 2] = [48, 32];
/// How far from a surface its part of space is looked for, in cubes: in the next one, never beyond a wall that is
/// close.
const STEP_OFF: f32 = 1.0;

/// Share of what is seen that may be further out than the rest, on each side.
const OUTLIERS: f32 = 0.03;
/// Share of what is seen that makes a part of space count; less is seen through cracks.
const FAIR: f32 = 0.005;
/// Points of a round light that are looked at, as pairs of uniform numbers: some may be inside of other things.
const ROUND_PLACES: [[f32; 2]; 4] = [[0.1, 0.05], [0.4, 0.3], [0.6, 0.8], [0.9, 0.55]];
/// A region is used if it is shorter than this share of the scene.
const MUCH_SMALLER: f32 = 0.6;

/// A point, and the unit normal on the side that matters; zero for a point in the air.
pub type Place = (Vec3, Vec3);

/// Places that paths visit for sure.
#[derive(Debug, Default)]
pub struct Places {
    /// The camera, and the lights that are in the scene.
    pub ends: Vec<Place>,
    /// First hits of camera rays.
    pub seen: Vec<Place>,
}

/// The places of a scene.
pub fn places(scene: &PreparedScene) -> Places {
    let mut seen = Vec::new();
    for (x, y) in (0..VIEW[1]).flat_map(|y| (0..VIEW[0]).map(move |x| (x, y))) {
        let share = [x as f32 / VIEW[0] as f32, y as f32 / VIEW[1] as f32];
        let raster = [0, 1].map(|c| scene.film_size[c] as f32 * share[c] + 0.5);
        let eye = scene.camera.sample_ray(raster, [0.5; 2]);
        let ray = Ray { o: eye.origin, d: eye.direction, t_min: eye.t_near, t_max: eye.t_far };
        if let Some(hit) = ray.is_valid().then(|| scene.query.closest(&ray)).flatten() {
            let (point, _) = scene.surface_point(&hit);
            seen.push((point.p, if point.ng.dot(ray.d) > 0.0 { -point.ng } else { point.ng }));
        }
    }
    let mut ends = vec![(scene.camera.position(), Vec3::ZERO)];
    ends.extend(scene.lights.iter().flat_map(|(_, light)| match light {
        Light::Triangle(l) => vec![(l.corners().into_iter().sum::<Vec3>() / 3.0, l.ng())],
        Light::Round(l) => {
            ROUND_PLACES.map(|u| l.shape().point_of(l.shape().sample_unit(u))).map(|x| (x.p, x.ng)).into()
        }
        Light::Point(l) => vec![(l.position(), Vec3::ZERO)],
        Light::Spot(l) => vec![(l.position(), Vec3::ZERO)],
        Light::Projector(l) => vec![(l.position(), Vec3::ZERO)],
        Light::Directional(_) | Light::Environment(_) => vec![],
    }));
    Places { ends, seen }
}

/// The part of the box `bounds` that a grid should cover: where the ends are and most of what is seen, and as much
/// again on each side; all if that is not much smaller.
pub fn region(bounds: (Vec3, Vec3), places: &Places) -> (Vec3, Vec3) {
    let (lo, hi) = bounds;
    let mut core = (hi, lo);
    for axis in 0..3 {
        let mut sorted: Vec<f32> = places.seen.iter().map(|(p, _)| p[axis]).collect();
        sorted.sort_by(f32::total_cmp);
        // Points seen through a window can be anywhere.
        let few = (sorted.len() as f32 * OUTLIERS) as usize;
        let (Some(first), Some(last)) = (sorted.get(few), sorted.iter().rev().nth(few)) else { return bounds };
        (core.0[axis], core.1[axis]) = (*first, *last);
    }
    for &(p, _) in &places.ends {
        let p = p.clamp(lo, hi);
        core = (core.0.min(p), core.1.max(p));
    }
    let size = core.1 - core.0;
    let more = size.max(Vec3::splat(0.5 * size.max_element()));
    let part = ((core.0 - more).max(lo), (core.1 + more).min(hi));
    let longest = |(lo, hi): (Vec3, Vec3)| (hi - lo).max_element();
    if longest(part) < MUCH_SMALLER * longest(bounds) { part } else { bounds }
}

/// `grid` with everything solid that does not hang together with an end, or with a fair share of what is seen;
/// unchanged if no place is in empty space.
pub fn closed_off(grid: &VoxelGrid, places: &Places) -> VoxelGrid {
    let mut space = VoxelGrid { solid: vec![true; grid.len()], ..grid.clone() };
    let cube = |&(p, normal): &Place| grid.cell_of(p + normal * (STEP_OFF * grid.cell)).filter(|&i| !grid.solid[i]);
    let mut seeds: Vec<usize> = places.ends.iter().filter_map(cube).collect();
    flood(grid, &mut space, &seeds);
    let mut seen: Vec<usize> = places.seen.iter().filter_map(cube).collect();
    let enough = (seen.len() as f32 * FAIR) as usize;
    seeds.extend(&seen);
    if seeds.is_empty() {
        return grid.clone();
    }
    seen.retain(|&i| space.solid[i]);
    while let Some(&i) = seen.first() {
        let mut part = space.clone();
        flood(grid, &mut part, &[i]);
        let before = seen.len();
        seen.retain(|&i| part.solid[i]);
        if before - seen.len() > enough {
            space = part;
        }
    }
    space
}

/// Opens in `space` what is empty in `grid` and hangs together with `seeds`.
fn flood(grid: &VoxelGrid, space: &mut VoxelGrid, seeds: &[usize]) {
    let steps = grid.steps();
    let mut stack = seeds.to_vec();
    for &i in seeds {
        space.solid[i] = false;
    }
    while let Some(i) = stack.pop() {
        for step in steps {
            let n = i.wrapping_add_signed(step);
            if space.solid[n] && !grid.solid[n] {
                space.solid[n] = false;
                stack.push(n);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_leaves_far_ground_out_but_no_part_of_a_room() {
        let bounds = (Vec3::splat(-30.0), Vec3::splat(30.0));
        let place = |x: f32, y: f32| (Vec3::new(x, y, 0.0), Vec3::ZERO);
        let mut seen: Vec<Place> = (0..100).map(|k| place(0.04 * k as f32, 2.0)).collect();
        seen.push(place(29.0, -29.0));
        let places = Places { ends: vec![place(1.0, 1.0)], seen };
        let (lo, hi) = region(bounds, &places);
        assert!(lo.x < -3.0 && lo.x > -5.0 && hi.x > 7.0 && hi.x < 9.0, "{lo} {hi}");
        assert!(lo.y <= -0.5 && hi.y >= 3.5, "{lo} {hi}");
        assert_eq!(region((Vec3::ZERO, Vec3::splat(6.0)), &places), (Vec3::ZERO, Vec3::splat(6.0)));
        assert_eq!(region(bounds, &Places::default()), bounds);
        // A light is never an outlier.
        assert_eq!(region(bounds, &Places { ends: vec![place(25.0, -25.0)], ..places }), bounds);
    }

    #[test]
    fn only_parts_with_a_place_stay_open() {
        // Three rooms; the light is on the wall of the last.
        let grid = VoxelGrid::of([31, 9, 9], |[x, ..]| x == 10 || x == 20);
        let open = |ends: &[Place], seen: &[Place]| {
            let space = closed_off(&grid, &Places { ends: ends.to_vec(), seen: seen.to_vec() });
            [5, 15, 25].map(|x| !space.solid[grid.index([x, 4, 4])])
        };
        let (eye, light) = ((Vec3::splat(4.5), Vec3::ZERO), (Vec3::new(20.5, 4.5, 4.5), Vec3::X));
        assert_eq!(open(&[eye], &[]), [true, false, false]);
        assert_eq!(open(&[eye, light], &[]), [true, false, true]);
        assert_eq!(open(&[(Vec3::splat(-9.0), Vec3::X), (Vec3::NAN, Vec3::X)], &[]), [true; 3]);
        let far = (Vec3::new(15.5, 4.5, 4.5), Vec3::ZERO);
        assert_eq!(open(&[], &[eye, far]), [true, true, false]);
        assert_eq!(open(&[], &[vec![eye; 300], vec![far]].concat()), [true, false, false]);
    }
}
