use super::*;
use crate::math::Vec3;
use crate::ray::{MeshBuffers, Segment, VertexBuffer};

fn one_triangle() -> Arc<Geometry> {
    let mesh = MeshBuffers {
        positions: VertexBuffer::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y]),
        triangles: vec![[0, 1, 2]],
        surface: SurfaceMask::BLOCKERS,
    };
    Arc::new(Geometry { meshes: vec![mesh], world: vec![0], ..Geometry::default() })
}

#[test]
fn an_error_surfaces_as_an_error() {
    let device = Device::new(1).unwrap();
    assert!(device.check().is_ok());
    // SAFETY: Embree reports a null geometry as an invalid argument and does nothing.
    unsafe { rtcCommitGeometry(std::ptr::null_mut()) };
    // The report has no device to go to, so the slot stays empty; a null instanced scene of a live device has one.
    let scene = new_scene(&device);
    // SAFETY: the scene is alive; the null geometry is reported, not followed.
    unsafe { rtcAttachGeometryByID(scene.0, std::ptr::null_mut(), 0) };
    assert!(device.check().is_err());
    assert!(device.check().is_ok(), "an error is reported once");
}

#[test]
fn invalid_rays_are_filtered_in_packets() {
    let scene = EmbreeScene::build(one_triangle(), 1).unwrap();
    let mut packet = SegmentPacket::default();
    let from = Vec3::new(0.25, 0.25, 1.0);
    packet.push(&Segment::between(from, Vec3::new(0.25, 0.25, -1.0)));
    packet.push(&Segment::between(Vec3::new(f32::NAN, 0.0, 0.0), from));
    packet.push(&Segment::between(from, Vec3::new(f32::INFINITY, 0.0, 0.0)));
    packet.push(&Segment::between(from, Vec3::new(2.0, 2.0, 2.0)));
    assert_eq!(scene.occluded_packet(&packet), (0b0111, 2));
}
