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

/// Joins the vertices at each place that have the same data beside their normal, and splits them where the normals of
/// the triangles around differ too much: a triangle shares a vertex with the first one there whose normal makes an angle
/// with its own of a cosine above `min_cosine` (as Mitsuba 0.6 does for `maxSmoothAngle`). Normals of the mesh are lost.
pub(super) fn split_at_creases(mesh: &mut MeshDesc, min_cosine: f32) {
    let vertex = |corner: u32| mesh.triangles[corner as usize / 3][corner as usize % 3] as usize;
    let normals: Vec<Vec3> = mesh
        .triangles
        .iter()
        .map(|t| unit_normal(t.map(|i| mesh.positions[i as usize])).unwrap_or(Vec3::ZERO))
        .collect();
    let normal = |corner: u32| normals[corner as usize / 3];
    // Positive and negative zero are one place.
    let bits = |x: f32| (x + 0.0).to_bits();
    let key = |corner: u32| {
        let v = vertex(corner);
        let uv = mesh.uvs.get(v).map(|uv| uv.to_array().map(bits));
        let color = mesh.colors.get(v).map(|c| [c.r, c.g, c.b].map(bits));
        (mesh.positions[v].to_array().map(bits), uv, color)
    };
    let mut corners: Vec<u32> = (0..3 * mesh.triangles.len() as u32).collect();
    corners.sort_by_key(|&c| key(c));
    let mut sources = Vec::new();
    let mut triangles = vec![[0; 3]; mesh.triangles.len()];
    for same in corners.chunk_by(|&a, &b| key(a) == key(b)) {
        let mut rest = same.to_vec();
        while let Some(&first) = rest.first() {
            let joined = |&corner: &u32| {
                corner == first || normal(corner) == normal(first) || normal(corner).dot(normal(first)) > min_cosine
            };
            for &corner in rest.iter().filter(|c| joined(c)) {
                triangles[corner as usize / 3][corner as usize % 3] = sources.len() as u32;
            }
            sources.push(vertex(first));
            rest.retain(|c| !joined(c));
        }
    }
    mesh.positions = sources.iter().map(|&v| mesh.positions[v]).collect();
    mesh.uvs = sources.iter().filter_map(|&v| mesh.uvs.get(v).copied()).collect();
    mesh.colors = sources.iter().filter_map(|&v| mesh.colors.get(v).copied()).collect();
    (mesh.normals, mesh.triangles) = (Vec::new(), triangles);
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

    /// Two walls and a lid of a box, and a fourth square that continues the lid: 30 degrees keep the right angles sharp,
    /// 100 degrees round them.
    #[test]
    fn creases_split_what_is_sharper_than_the_angle() {
        let square = |o: [f32; 3], a: [f32; 3], b: [f32; 3]| {
            let [o, a, b] = [o, a, b].map(Vec3::from);
            [o, o + a, o + a + b, o + b]
        };
        let (x, y, z) = ([1., 0., 0.], [0., 1., 0.], [0., 0., 1.]);
        let squares = [
            square([0., 0., 1.], x, y),
            square([1., 0., 0.], y, z),
            square([0., 0., 0.], x, z),
            square([-1., 0., 1.], x, y),
        ];
        let mut mesh = MeshDesc {
            positions: squares.concat(),
            normals: vec![Vec3::splat(0.577); 16],
            triangles: (0..4).flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]).collect(),
            ..MeshDesc::default()
        };
        let mut rounded = mesh.clone();
        split_at_creases(&mut mesh, 30f32.to_radians().cos());
        assert!(mesh.normals.is_empty());
        // The lid and what continues it share two corners, the walls share none.
        assert_eq!(mesh.positions.len(), 4 + 4 + 6);
        let normals = angle_weighted(&mesh.positions, &mesh.triangles);
        for (t, want) in mesh.triangles.iter().zip([Vec3::Z, Vec3::Z, Vec3::X, Vec3::X, Vec3::NEG_Y, Vec3::NEG_Y]) {
            assert!(t.iter().all(|&i| (normals[i as usize] - want).length() < 1e-6), "{t:?}");
        }
        split_at_creases(&mut rounded, 100f32.to_radians().cos());
        // Nine different places.
        assert_eq!(rounded.positions.len(), 9);
        let normals = angle_weighted(&rounded.positions, &rounded.triangles);
        let corner = rounded.positions.iter().position(|p| *p == Vec3::new(1., 0., 1.)).unwrap();
        assert!((normals[corner] - Vec3::new(1., -1., 1.).normalize()).length() < 1e-6, "{}", normals[corner]);
    }

    /// Texture coordinates and colours that differ keep vertices apart and stay beside their place.
    #[test]
    fn seams_of_texture_coordinates_stay() {
        let mut mesh = MeshDesc {
            positions: [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 0., 0.], [1., 1., 0.], [0., 1., 0.]]
                .map(Vec3::from)
                .to_vec(),
            uvs: [[0., 0.], [1., 0.], [1., 1.], [0., 0.], [0.5, 0.5], [0., 1.]].map(glam::Vec2::from).to_vec(),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            ..MeshDesc::default()
        };
        let before: Vec<_> = mesh.triangles.iter().flatten().map(|&i| mesh.uvs[i as usize]).collect();
        split_at_creases(&mut mesh, 0.5);
        assert_eq!((mesh.positions.len(), mesh.uvs.len(), mesh.colors.len()), (5, 5, 0));
        let after: Vec<_> = mesh.triangles.iter().flatten().map(|&i| mesh.uvs[i as usize]).collect();
        assert_eq!(before, after);
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
