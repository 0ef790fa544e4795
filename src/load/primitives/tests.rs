use super::*;

fn area(m: &MeshDesc) -> f64 {
    m.triangles.iter().map(|t| corners(m, t)).map(|[a, b, c]| (b - a).cross(c - a).length() * 0.5).sum()
}

fn corners(m: &MeshDesc, t: &[u32; 3]) -> [DVec3; 3] {
    t.map(|i| m.positions[i as usize].as_dvec3())
}

/// Interpolated uv and normal, and geometric normal, where a ray first meets the mesh.
fn hit(m: &MeshDesc, origin: [f64; 3], direction: [f64; 3]) -> (Vec2, Vec3, Vec3) {
    let (o, d) = (DVec3::from(origin), DVec3::from(direction));
    let mut best = (f64::INFINITY, None);
    for t in &m.triangles {
        let [a, b, c] = corners(m, t);
        // Möller & Trumbore 1997.
        let (e1, e2) = (b - a, c - a);
        let (p, s) = (d.cross(e2), o - a);
        let det = e1.dot(p);
        let (u, q) = (s.dot(p) / det, s.cross(e1));
        let (v, along) = (d.dot(q) / det, e2.dot(q) / det);
        if det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && along > 0.0 && along < best.0 {
            best = (along, Some((*t, [1.0 - u - v, u, v], e1.cross(e2).normalize().as_vec3())));
        }
    }
    let (t, w, ng) = best.1.expect("the ray hits");
    let mix2: Vec2 = (0..3).map(|k| m.uvs[t[k] as usize] * w[k] as f32).sum();
    let mix3: Vec3 = (0..3).map(|k| m.normals[t[k] as usize] * w[k] as f32).sum();
    (mix2, mix3.normalize(), ng)
}

const ALL: [Primitive; 4] = [Primitive::Rectangle, Primitive::Cube, Primitive::Sphere, Primitive::Cylinder];

#[test]
fn areas_are_exact() {
    for (p, want) in ALL.into_iter().zip([4.0, 24.0, 4.0 * PI, 2.0 * PI]) {
        let got = area(&p.mesh(false));
        assert!((got / want - 1.0).abs() < 1e-6, "{p:?}: {got} is not {want}");
    }
}

#[test]
fn geometric_and_vertex_normals_are_on_one_side() {
    for p in ALL {
        for mirrored in [false, true] {
            let mut m = p.mesh(mirrored);
            if mirrored {
                m.positions.iter_mut().for_each(|p| p.x = -p.x);
                m.normals.iter_mut().for_each(|n| n.x = -n.x);
            }
            for t in &m.triangles {
                let [a, b, c] = corners(&m, t);
                let ng = (b - a).cross(c - a).normalize().as_vec3();
                assert!(t.iter().all(|&i| m.normals[i as usize].dot(ng) > 0.9), "{p:?} {mirrored}");
            }
        }
    }
}

/// uv and normal of single hits by Mitsuba 3.9.1, scalar_rgb.
#[test]
fn parametrisations_are_mitsubas() {
    let cases = [
        (Primitive::Rectangle, [0.3, 0.5, 3.0], [0.0, 0.0, -1.0], [0.65, 0.75], [0.0, 0.0, 1.0]),
        (Primitive::Cube, [0.3, 0.5, 3.0], [0.0, 0.0, -1.0], [0.75, 0.65], [0.0, 0.0, 1.0]),
        (Primitive::Sphere, [0.3, 0.5, 3.0], [0.0, 0.0, -1.0], [0.163_989, 0.198_159], [0.3, 0.5, 0.812_404]),
        (Primitive::Sphere, [0.3, -0.5, -3.0], [0.0, 0.0, 1.0], [0.836_011, 0.801_841], [0.3, -0.5, -0.812_404]),
        (Primitive::Cylinder, [3.0, 0.5, 0.3], [-1.0, 0.0, 0.0], [0.083_333, 0.3], [0.866_025, 0.5, 0.0]),
        (Primitive::Cylinder, [0.5, -3.0, 0.3], [0.0, 1.0, 0.0], [0.833_333, 0.3], [0.5, -0.866_025, 0.0]),
    ];
    for (p, origin, direction, uv, n) in cases {
        let m = p.mesh(false);
        let (got_uv, ns, ng) = hit(&m, origin, direction);
        assert!((got_uv - Vec2::from(uv)).length() < 2e-3, "{p:?}: uv {got_uv}");
        assert!((ns - Vec3::from(n)).length() < 2e-3 && ng.dot(Vec3::from(n)) > 0.999, "{p:?}: normal {ns} {ng}");
    }
}

#[test]
fn texture_coordinates_do_not_jump_within_a_triangle() {
    for p in ALL {
        let m = p.mesh(false);
        for t in &m.triangles {
            let [a, b, c] = t.map(|i| m.uvs[i as usize]);
            let spread = (a - b).abs().max(b - c).abs().max((a - c).abs());
            // u runs around.
            let around = match p {
                Primitive::Sphere | Primitive::Cylinder => spread.x,
                _ => 0.0,
            };
            assert!(around < 0.02, "{p:?}: {a} {b} {c}");
        }
    }
}
