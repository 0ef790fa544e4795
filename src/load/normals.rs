//! Vertex normals: made where a file has none (corner angles as weights, Thürmer & Wüthrich 1998, "Computing vertex
//! normals from polygonal facets"), brought to unit length where it has.

use crate::scene::MeshDesc;
use glam::Vec3;

/// Unit normals, one per vertex; a vertex without any proper triangle gets +x.
pub(super) fn angle_weighted(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let corner = t.map(|i| positions[i as usize]);
        // Products of three lengths: tiny and huge models would leave the range of f32 without the normalisations.
        let Some(normal) = unit_normal(corner) else { continue };
        for k in 0..3 {
            let (a, b) = (corner[(k + 1) % 3] - corner[k], corner[(k + 2) % 3] - corner[k]);
            let angle = a.normalize_or_zero().angle_between(b.normalize_or_zero());
            if angle.is_finite() {
                sums[t[k] as usize] += normal * angle;
            }
        }
    }
    sums.iter_mut().for_each(|n| *n = n.try_normalize().unwrap_or(Vec3::X));
    sums
}

fn unit_normal([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    (b - a).normalize_or_zero().cross((c - a).normalize_or_zero()).try_normalize()
}

/// Brings normals to unit length; those that have no direction are made from the triangles around their vertex.
pub(super) fn normalize_or_repair(mesh: &mut MeshDesc) {
    let mut broken = false;
    for n in &mut mesh.normals {
        if (n.length_squared() - 1.0).abs() > 1e-4 || !n.is_finite() {
            *n = n.try_normalize().unwrap_or(Vec3::ZERO);
            broken |= *n == Vec3::ZERO;
        }
    }
    if broken {
        let made = angle_weighted(&mesh.positions, &mesh.triangles);
        for (n, made) in mesh.normals.iter_mut().zip(made) {
            if *n == Vec3::ZERO {
                *n = made;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mitsuba 3.9.1, scalar_rgb: `vertex_normals` of a bent quad read from a PLY without normals.
    #[test]
    fn agree_with_mitsuba_on_a_bent_quad() {
        let p = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.5], [0., 1., 0.]].map(Vec3::from);
        let n = angle_weighted(&p, &[[0, 1, 2], [0, 2, 3]]);
        let want = [
            [-0.235_702, -0.235_702, 0.942_809],
            [0.0, -0.447_214, 0.894_427],
            [-0.235_702, -0.235_702, 0.942_809],
            [-0.447_214, 0.0, 0.894_427],
        ];
        for (n, want) in n.iter().zip(want) {
            assert!((*n - Vec3::from(want)).length() < 1e-5, "{n} {want:?}");
        }
    }

    #[test]
    fn weigh_by_angle_not_by_area() {
        // A right angle in the plane z = 0 and a far larger triangle upright on y = 0, with half the angle at the
        // shared corner.
        let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [100., 0., 0.], [100., 0., 100.]].map(Vec3::from);
        let n = angle_weighted(&p, &[[0, 1, 2], [0, 3, 4]])[0];
        let want = Vec3::new(0.0, -1.0, 2.0).normalize();
        assert!((n - want).length() < 1e-5, "{n}");
    }

    #[test]
    fn repair_only_the_broken() {
        let mut mesh = MeshDesc {
            positions: [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]].map(Vec3::from).to_vec(),
            normals: vec![Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO, Vec3::new(f32::NAN, 0.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            ..MeshDesc::default()
        };
        normalize_or_repair(&mut mesh);
        assert_eq!(mesh.normals, [Vec3::Y, Vec3::Z, Vec3::Z]);
    }
}
