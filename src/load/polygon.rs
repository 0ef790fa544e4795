//! Polygons to triangles: a fan where the polygon is convex, else by cutting off ears.

use glam::{DVec2, DVec3, Vec3};

/// A polygon with more corners than this that is not convex is refused: cutting ears takes quadratic time.
pub(super) const MAX_CONCAVE_CORNERS: usize = 4096;
/// Sine of an angle below which a corner counts as straight.
const STRAIGHT: f64 = 1e-6;

/// The polygon is not convex and has more than [`MAX_CONCAVE_CORNERS`] corners.
#[derive(Debug, PartialEq)]
pub(super) struct TooManyCorners;

/// Hands out the triangles of a polygon, as indices into `corners`: always two fewer than corners, all turning the way
/// the polygon turns. A polygon that is not plane is cut as its projection along its mean normal; one that crosses
/// itself has no right answer and gets as many ears as there are, the rest as a fan.
pub(super) fn triangulate(corners: &[Vec3], mut each: impl FnMut([usize; 3])) -> Result<(), TooManyCorners> {
    let n = corners.len();
    match mean_normal(corners).filter(|normal| is_concave(corners, *normal)) {
        None => (2..n).for_each(|i| each([0, i - 1, i])),
        Some(_) if n > MAX_CONCAVE_CORNERS => return Err(TooManyCorners),
        Some(normal) => cut_ears(&projected(corners, normal), each),
    }
    Ok(())
}

/// The direction about which a polygon turns left; `None` if it has no area.
fn mean_normal(corners: &[Vec3]) -> Option<DVec3> {
    let origin = corners.first()?.as_dvec3();
    let edges = corners.windows(2).map(|c| (c[0].as_dvec3() - origin).cross(c[1].as_dvec3() - origin));
    edges.sum::<DVec3>().try_normalize()
}

/// True if some corner turns right by more than rounding.
fn is_concave(corners: &[Vec3], normal: DVec3) -> bool {
    let n = corners.len();
    (0..n).any(|i| {
        let [a, b, c] = [i, (i + 1) % n, (i + 2) % n].map(|i| corners[i].as_dvec3());
        let (before, after) = (b - a, c - b);
        before.cross(after).dot(normal) < -STRAIGHT * before.length() * after.length()
    })
}

/// Corners in a plane across `normal`.
fn projected(corners: &[Vec3], normal: DVec3) -> Vec<DVec2> {
    let s = normal.any_orthonormal_vector();
    let t = normal.cross(s);
    let origin = corners.first().map_or(DVec3::ZERO, |c| c.as_dvec3());
    let flat = |p: DVec3| DVec2::new(p.dot(s), p.dot(t));
    corners.iter().map(|c| flat(c.as_dvec3() - origin)).collect()
}

/// Twice the signed area of a triangle.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

/// Cuts ears off a polygon that turns left: corners that turn left and whose triangle holds no other corner.
fn cut_ears(points: &[DVec2], mut each: impl FnMut([usize; 3])) {
    let n = points.len();
    let mut next: Vec<usize> = (1..=n).map(|i| i % n).collect();
    let mut previous: Vec<usize> = (0..n).map(|i| (i + n - 1) % n).collect();
    // Only a corner that turns right (or not at all) can lie in the triangle of another one.
    let mut reflex: Vec<usize> =
        (0..n).filter(|&i| turn(points[previous[i]], points[i], points[next[i]]) <= 0.0).collect();
    let (mut at, mut left, mut since_last) = (0, n, 0);
    while left > 3 {
        let (a, c) = (previous[at], next[at]);
        // After a whole round without an ear the polygon crosses itself: cut anyway.
        if since_last <= left && !is_ear(points, &reflex, [a, at, c]) {
            since_last += 1;
            at = c;
            continue;
        }
        each([a, at, c]);
        (next[a], previous[c]) = (c, a);
        left -= 1;
        since_last = 0;
        reflex
            .retain(|&i| i != at && (i != a && i != c || turn(points[previous[i]], points[i], points[next[i]]) <= 0.0));
        // Not the neighbour: cutting round about makes a fan of slivers.
        at = next[c];
    }
    each([previous[at], at, next[at]]);
}

fn is_ear(points: &[DVec2], reflex: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|i| points[i]);
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    let inside = |p: DVec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    !reflex.iter().any(|&i| {
        let p = points[i];
        // Corners at one place (a polygon with a slit) do not block each other.
        !ear.contains(&i) && p != a && p != b && p != c && inside(p)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn triangles(corners: &[Vec3]) -> Vec<[usize; 3]> {
        let mut out = Vec::new();
        triangulate(corners, |t| out.push(t)).unwrap();
        out
    }

    /// Signed areas, seen from +z.
    fn areas(corners: &[Vec3]) -> Vec<f32> {
        let area = |t: [usize; 3]| {
            let [a, b, c] = t.map(|i| corners[i]);
            (b - a).cross(c - a).z * 0.5
        };
        triangles(corners).into_iter().map(area).collect()
    }

    /// A star around the origin with the given radii.
    fn star(radii: &[f32]) -> Vec<Vec3> {
        let angle = |i: usize| std::f32::consts::TAU * i as f32 / radii.len() as f32;
        radii.iter().enumerate().map(|(i, r)| Vec3::new(r * angle(i).cos(), r * angle(i).sin(), 0.0)).collect()
    }

    fn area_of_star(radii: &[f32]) -> f32 {
        let sine = (std::f32::consts::TAU / radii.len() as f32).sin();
        (0..radii.len()).map(|i| 0.5 * sine * radii[i] * radii[(i + 1) % radii.len()]).sum()
    }

    #[test]
    fn convex_polygons_are_fans() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        assert_eq!(triangles(&square), [[0, 1, 2], [0, 2, 3]]);
        // Not plane, with a straight corner, without area, and all corners at one place.
        let mut bent = square;
        bent[2].z = 0.5;
        assert_eq!(triangles(&bent), [[0, 1, 2], [0, 2, 3]]);
        let straight = [Vec3::ZERO, Vec3::X * 0.5, Vec3::X, Vec3::Y];
        assert_eq!(triangles(&straight), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::X]).len(), 2);
        assert_eq!(triangles(&[Vec3::ONE; 5]).len(), 3);
        assert_eq!(triangles(&[Vec3::ONE; 2]).len(), 0);
    }

    #[test]
    fn a_polygon_is_covered_once_from_any_first_corner_in_any_plane() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let shapes = [
            (l.iter().map(|p| Vec3::new(p[0], p[1], 0.0)).collect::<Vec<_>>(), 3.0),
            (star(&[1.0, 0.4].repeat(5)), area_of_star(&[1.0, 0.4].repeat(5))),
        ];
        for (mut corners, area) in shapes {
            for _ in 0..corners.len() {
                corners.rotate_left(1);
                let found = areas(&corners);
                assert_eq!(found.len(), corners.len() - 2);
                assert!(found.iter().all(|&a| a > 0.0), "{corners:?}: {found:?}");
                assert!((found.iter().sum::<f32>() - area).abs() < 1e-5);
                // The other way round, and with x and z exchanged.
                let back: Vec<Vec3> = corners.iter().rev().copied().collect();
                assert!((areas(&back).iter().sum::<f32>() + area).abs() < 1e-5);
                let turned: Vec<Vec3> = corners.iter().map(|p| Vec3::new(p.z, p.y, p.x)).collect();
                assert_eq!(triangles(&turned).len(), corners.len() - 2);
            }
        }
    }

    #[test]
    fn a_slit_to_a_hole_is_followed() {
        // A square of side 4 with a hole of side 2, joined by a slit from (0, 0) to (1, 1).
        let xy = [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0], [1, 1], [1, 3], [3, 3], [3, 1], [1, 1]];
        let corners = xy.map(|[x, y]| Vec3::new(x as f32, y as f32, 0.0));
        let found = areas(&corners);
        assert!(found.iter().all(|&a| a >= 0.0) && (found.iter().sum::<f32>() - 12.0).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn large_polygons_take_no_time_or_are_refused() {
        let radii: Vec<f32> = (0..MAX_CONCAVE_CORNERS).map(|i| if i % 2 == 0 { 1.0 } else { 0.999_99 }).collect();
        assert_eq!(triangles(&star(&radii)).len(), MAX_CONCAVE_CORNERS - 2);
        let mut radii = vec![1.0; MAX_CONCAVE_CORNERS + 1];
        radii[5] = 0.5;
        assert_eq!(triangulate(&star(&radii), |_| ()), Err(TooManyCorners));
    }

    proptest! {
        #[test]
        fn stars_of_any_radii_are_covered_once(radii in prop::collection::vec(0.05f32..1.0, 5..40)) {
            let found = areas(&star(&radii));
            let area = area_of_star(&radii);
            prop_assert!(found.iter().all(|&a| a > -1e-6), "{:?}", found);
            prop_assert!((found.iter().sum::<f32>() - area).abs() < 1e-4 * area);
        }

        #[test]
        fn any_corners_give_triangles(corners in prop::collection::vec(prop::array::uniform3(-2i8..3), 3..20)) {
            let corners: Vec<Vec3> = corners.into_iter().map(|c| Vec3::from(c.map(f32::from))).collect();
            let found = triangles(&corners);
            prop_assert_eq!(found.len(), corners.len() - 2);
            prop_assert!(found.iter().flatten().all(|&i| i < corners.len()));
        }
    }
}
