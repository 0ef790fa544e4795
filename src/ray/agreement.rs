//! Do two backends give the same answers? Counted on random rays, so that every disagreement is seen and can be
//! explained.

use super::{Ray, RayQuery, Segment, SegmentPacket, SurfaceMask};
use crate::math::{Vec3, hash::HashRng, warp};

/// Relative difference of distances that rounding explains for rays that are not grazing.
pub const DISTANCE_TOLERANCE: f32 = 1e-4;

/// Counts of one comparison.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Agreement {
    /// Closest-hit rays compared.
    pub rays: u64,
    /// Both met something.
    pub both_hit: u64,
    /// One met something, the other nothing.
    pub hit_or_miss: u64,
    /// Another triangle at the same distance: a shared edge or coplanar surfaces.
    pub ties: u64,
    /// Another triangle at another distance.
    pub other_surface: u64,
    /// One triangle at a distance that differs by more than the tolerance (grazing rays).
    pub distance: u64,
    /// Segments compared.
    pub segments: u64,
    /// One says blocked, the other not.
    pub occlusion: u64,
    /// A packet and a single query of the same backend differ.
    pub packet: u64,
}

impl Agreement {
    /// Everything that no tie explains, as a share of the questions asked.
    pub fn disagreement(&self) -> f64 {
        let bad = self.hit_or_miss + self.other_surface + self.distance + self.occlusion;
        bad as f64 / (self.rays + self.segments).max(1) as f64
    }
}

/// Compares two backends on `count` random rays and as many segments between points of the box `bounds` and points that
/// rays found.
pub fn compare(a: &dyn RayQuery, b: &dyn RayQuery, bounds: (Vec3, Vec3), count: u64, seed: u64) -> Agreement {
    let mut rng = HashRng::new(seed, 0xa9ee, 0, 0);
    let mut out = Agreement::default();
    let (lo, hi) = bounds;
    let mut packet = SegmentPacket::default();
    let mut last = 0.5 * (lo + hi);
    for i in 0..count {
        let [x, y, z, w] = rng.next_4();
        let o = lo + (hi - lo) * Vec3::new(x, y, z);
        let ray = Ray::leaving(o, warp::square_to_sphere([w, rng.next_f32()]));
        out.rays += 1;
        let surfaces = if i % 2 == 0 { SurfaceMask::VISIBLE } else { SurfaceMask::ALL };
        match (a.closest_of(&ray, surfaces), b.closest_of(&ray, surfaces)) {
            (None, None) => {}
            (Some(ha), Some(hb)) => {
                out.both_hit += 1;
                let near = (ha.t - hb.t).abs() <= DISTANCE_TOLERANCE * ha.t.max(hb.t);
                let same = (ha.triangle, ha.mesh, ha.instance) == (hb.triangle, hb.mesh, hb.instance);
                match (same, near) {
                    (true, true) => {}
                    (true, false) => out.distance += 1,
                    (false, true) => out.ties += 1,
                    (false, false) => out.other_surface += 1,
                }
                // Half way to the surface: a point of the empty space, rather than one inside furniture.
                last = o + ray.d * (0.5 * ha.t);
            }
            _ => out.hit_or_miss += 1,
        }
        let segment = Segment::between(o, last);
        if segment.d == Vec3::ZERO {
            continue;
        }
        out.segments += 1;
        for mask in [SurfaceMask::ALL, SurfaceMask::BLOCKERS, SurfaceMask::MASKS, SurfaceMask::INTERFACES] {
            let blocked = [a, b].map(|query| query.occluded(&segment.ray(), mask));
            out.occlusion += u64::from(blocked[0] != blocked[1]);
        }
        let crossed = [a, b].map(|query| query.closest_of(&segment.ray(), SurfaceMask::MASKS).is_some());
        out.occlusion += u64::from(crossed[0] != crossed[1]);
        packet.push(&segment);
        if packet.len == super::PACKET {
            for query in [a, b] {
                let (mask, _) = query.occluded_packet(&packet);
                for i in 0..packet.len {
                    out.packet +=
                        u64::from((mask >> i & 1 == 1) != query.occluded(&packet.get(i).ray(), packet.blockers));
                }
            }
            packet.len = 0;
            packet.blockers =
                if packet.blockers == SurfaceMask::ALL { SurfaceMask::BLOCKERS } else { SurfaceMask::ALL };
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::{Backend, Geometry, Instance, MeshBuffers, RoundShape, VertexBuffer};
    use crate::scene::RoundKind;
    use glam::{Affine3A, DMat4, DVec3, Mat3A, Vec3A};
    use std::sync::Arc;

    /// Triangles of all shapes in a cube of side `scale` around `centre`.
    fn soup(n: usize, scale: f32, centre: Vec3, seed: u64) -> MeshBuffers {
        let mut rng = HashRng::new(seed, 1, 0, 0);
        let mut point = |spread: f32| {
            let [x, y, z, _] = rng.next_4();
            (Vec3::new(x, y, z) - 0.5) * spread
        };
        let mut positions = Vec::new();
        for i in 0..n {
            let p = point(1.0);
            let size = if i % 10 == 0 { 0.5 } else { 0.1 };
            for _ in 0..3 {
                positions.push(centre + (p + point(size)) * scale);
            }
        }
        let triangles = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        MeshBuffers { positions: VertexBuffer::new(positions), triangles, surface: SurfaceMask::BLOCKERS }
    }

    fn backends() -> Vec<Backend> {
        let mut all = vec![Backend::Obvhs];
        if cfg!(any(embree3, embree4)) {
            all.push(Backend::Embree);
        }
        all
    }

    fn check(geometry: Geometry, tolerated: f64) {
        let geometry = Arc::new(geometry);
        let bounds = geometry.bounds().unwrap();
        let oracle = Backend::Brute.build(geometry.clone(), 1).unwrap();
        for backend in backends() {
            let query = backend.build(geometry.clone(), 1).unwrap();
            let a = compare(&*oracle, &*query, bounds, 4000, 5);
            assert!(a.both_hit > 60, "{a:?}");
            assert!(a.disagreement() <= tolerated, "{backend:?} {a:?}");
            assert_eq!(a.packet, 0, "{backend:?}: packets and single rays must agree");
        }
    }

    /// Soups of surfaces of every kind, in the world and in instances.
    #[test]
    fn kinds_of_surfaces_are_told_apart() {
        let kinds = [SurfaceMask::BLOCKERS, SurfaceMask::MASKS, SurfaceMask::INTERFACES];
        let mesh = |i: usize| {
            let mesh = soup(80, 1.0, Vec3::splat(0.1 * i as f32), 30 + i as u64);
            MeshBuffers { surface: kinds[i % 3], ..mesh }
        };
        let geometry = Geometry {
            meshes: (0..6).map(mesh).collect(),
            world: vec![0, 1, 2],
            groups: vec![vec![3, 4, 5]],
            instances: vec![Instance { group: 0, to_world: Affine3A::from_translation(Vec3::X) }],
            ..Geometry::default()
        };
        check(geometry, 2e-3);
    }

    #[test]
    fn soups_agree_at_every_scale() {
        for scale in [1e-3, 1.0, 1e4] {
            let mesh = soup(300, scale, Vec3::ZERO, 11);
            check(Geometry { meshes: vec![mesh], world: vec![0], ..Geometry::default() }, 5e-4);
        }
    }

    #[test]
    fn soups_agree_off_centre() {
        // A hundred diameters away: single precision leaves 1e-5 of the diameter, so edges blur by that much.
        let mesh = soup(300, 1.0, Vec3::new(100.0, -50.0, 20.0), 12);
        check(Geometry { meshes: vec![mesh], world: vec![0], ..Geometry::default() }, 2e-3);
    }

    #[test]
    fn instances_agree_mirrored_and_sheared() {
        let meshes = vec![soup(60, 1.0, Vec3::ZERO, 13), soup(60, 0.5, Vec3::X, 14), soup(40, 0.7, Vec3::Y, 15)];
        let mirrored = Affine3A {
            matrix3: Mat3A::from_diagonal(glam::Vec3::new(-1.0, 2.0, 0.5)),
            translation: Vec3A::new(2.0, 0.0, 0.0),
        };
        let sheared = Affine3A {
            matrix3: Mat3A::from_cols(Vec3A::new(1.0, 0.3, 0.0), Vec3A::new(-0.5, 1.0, 0.2), Vec3A::new(0.0, 0.1, 0.8)),
            translation: Vec3A::new(-1.0, 1.0, 0.5),
        };
        let instances = vec![
            Instance { group: 0, to_world: mirrored },
            Instance { group: 0, to_world: sheared },
            Instance { group: 1, to_world: mirrored },
        ];
        let groups = vec![vec![1, 2], vec![2]];
        check(Geometry { meshes, world: vec![0], groups, instances, ..Geometry::default() }, 1e-3);
    }

    /// Round shapes of every form among triangles, of every kind of surface, in the world and in stretched instances.
    #[test]
    fn round_shapes_agree() {
        let mut rng = HashRng::new(17, 1, 0, 0);
        let mut shape = |i: usize| {
            let [x, y, z, w] = rng.next_4().map(f64::from);
            let kind = [RoundKind::Sphere, RoundKind::Disk, RoundKind::Cylinder][i % 3];
            let to_place = DMat4::from_translation(DVec3::new(x, y, z) - 0.5)
                * DMat4::from_euler(glam::EulerRot::XYZ, 6.0 * x, 6.0 * y, 6.0 * z)
                * DMat4::from_scale(DVec3::new(0.05 + 0.2 * w, 0.05 + 0.2 * x, 0.1));
            let surface = match i % 4 {
                0 => SurfaceMask::INTERFACES,
                1 => SurfaceMask::MASKS,
                _ => SurfaceMask::BLOCKERS,
            };
            RoundShape::new(kind, to_place, false, surface)
        };
        let round: Vec<RoundShape> = (0..60).map(&mut shape).collect();
        let stretched = Affine3A {
            matrix3: Mat3A::from_cols(
                Vec3A::new(0.5, 0.3, 0.0),
                Vec3A::new(-0.5, 1.0, 0.2),
                Vec3A::new(0.0, 0.1, -0.8),
            ),
            translation: Vec3A::new(1.0, 0.2, 0.1),
        };
        let instances = vec![Instance { group: 1, to_world: stretched }, Instance { group: 0, to_world: stretched }];
        let meshes = vec![soup(30, 1.0, Vec3::ZERO, 18), soup(20, 1.0, Vec3::Y, 19)];
        let world = [0].into_iter().chain(2..42).collect();
        let groups = vec![vec![], [1].into_iter().chain(42..62).collect()];
        check(Geometry { meshes, round, world, groups, instances }, 1e-3);
    }

    #[test]
    fn packets_equal_single_queries() {
        let geometry =
            Arc::new(Geometry { meshes: vec![soup(200, 1.0, Vec3::ZERO, 16)], world: vec![0], ..Geometry::default() });
        let mut rng = HashRng::new(1, 2, 3, 4);
        let mut coordinate = |n: usize| (0..n).map(|_| rng.next_f32() - 0.5).collect::<Vec<f32>>();
        let (x, y, z) = (coordinate(83), coordinate(83), coordinate(83));
        let targets: Vec<Vec3> = (0..83).map(|i| Vec3::new(x[i], y[i], z[i])).collect();
        let origins: Vec<Vec3> = (0..13).map(|i| Vec3::splat(0.03 * i as f32 - 0.2)).collect();
        for backend in backends() {
            let query = backend.build(geometry.clone(), 1).unwrap();
            for &target in &targets {
                // A packet that is not full.
                let mut packet = SegmentPacket::default();
                origins.iter().for_each(|&origin| packet.push(&Segment::between(origin, target)));
                let (mask, invalid) = query.occluded_packet(&packet);
                assert_eq!(invalid, 0);
                for (k, &origin) in origins.iter().enumerate() {
                    let single = query.occluded(&Segment::between(origin, target).ray(), packet.blockers);
                    assert_eq!(mask >> k & 1 == 1, single);
                }
            }
        }
    }

    #[test]
    fn no_ray_leaks_through_a_shared_edge() {
        // A closed box of two triangles a side; rays from inside at random points of its edges' neighbourhood and along
        // the axes.
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32) - 0.5;
        let quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> =
            quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        let positions = VertexBuffer::new((0..8).map(corner).collect());
        let mesh = MeshBuffers { positions, triangles, surface: SurfaceMask::BLOCKERS };
        let geometry = Arc::new(Geometry { meshes: vec![mesh], world: vec![0], ..Geometry::default() });
        for backend in backends() {
            let query = backend.build(geometry.clone(), 1).unwrap();
            let mut rng = HashRng::new(9, 9, 9, 9);
            let mut leaks = 0;
            for i in 0..20_000u32 {
                let [a, b, c, s] = rng.next_4();
                let o = (Vec3::new(a, b, c) - 0.5) * 0.9;
                let q = quads[(i % 6) as usize];
                // The diagonal is the edge that the side's two triangles share.
                let target = if i % 7 == 0 {
                    o + Vec3::AXES[(i % 3) as usize]
                } else {
                    corner(q[0]).lerp(corner(q[2]), 0.01 + 0.98 * s)
                };
                leaks += u32::from(query.closest(&Ray::leaving(o, target - o)).is_none());
            }
            assert_eq!(leaks, 0, "{backend:?}");
        }
    }
}
