//! Neither the size of a scene nor its place changes its picture, and nothing leaks through closed walls at any size.

use crate::support::gallery::{GALLERY, exhibit};
use crate::support::pictures::{Picture, parse, prepare, takes, unbiased};
use glam::{DMat4, DVec3};
use lightsieve::integrators::{Params, path};
use lightsieve::math::Vec3;
use lightsieve::ray::Backend;
use lightsieve::render::{Aov, Estimator, aov};
use lightsieve::scene::{BsdfKind, EmitterKind, SceneDesc};

const SPP: u64 = 32;
/// Size and place: tiny, huge, far away.
const PLACES: [(f64, DVec3); 3] = [(1e-3, DVec3::ZERO), (1e4, DVec3::ZERO), (1.0, DVec3::new(1000.0, -500.0, 200.0))];

/// A scene at another place in another size; lights shine so that radiance stays what it was.
fn placed(mut desc: SceneDesc, scale: f64, offset: DVec3) -> SceneDesc {
    let m = DMat4::from_translation(offset) * DMat4::from_scale(DVec3::splat(scale));
    // A camera or a light has a frame of unit length.
    let move_frame = |frame: &mut DMat4| frame.w_axis = m * frame.w_axis;
    for sensor in &mut desc.sensors {
        move_frame(&mut sensor.to_world);
        for length in
            [&mut sensor.near_clip, &mut sensor.far_clip, &mut sensor.aperture_radius, &mut sensor.focus_distance]
        {
            *length *= scale;
        }
    }
    desc.shapes.iter_mut().for_each(|s| s.to_world = m * s.to_world);
    desc.instances.iter_mut().for_each(|i| i.to_world = m * i.to_world);
    for bsdf in &mut desc.bsdfs {
        if let BsdfKind::BumpMap { scale: height, .. } = &mut bsdf.kind {
            *height *= scale as f32;
        }
    }
    for emitter in &mut desc.emitters {
        match &mut emitter.kind {
            EmitterKind::Point { position, intensity } => {
                *position = m.transform_point3(*position);
                *intensity *= (scale * scale) as f32;
            }
            EmitterKind::Spot { to_world, intensity, .. } => {
                move_frame(to_world);
                *intensity *= (scale * scale) as f32;
            }
            EmitterKind::Projector(projector) => {
                move_frame(&mut projector.to_world);
                projector.scale *= (scale * scale) as f32;
            }
            EmitterKind::Directional { .. }
            | EmitterKind::Constant { .. }
            | EmitterKind::Envmap { .. }
            | EmitterKind::SunSky { .. } => {}
        }
    }
    desc
}

#[test]
fn size_and_place_do_not_matter() {
    for name in GALLERY {
        let here = prepare(exhibit(name), Backend::default_available(), None);
        for spec in unbiased().filter(|s| takes(s, &here)) {
            let expected = Picture::render(spec, &here, &[], SPP, 1);
            for (scale, offset) in PLACES {
                let there = prepare(placed(exhibit(name), scale, offset), Backend::default_available(), None);
                let picture = Picture::render(spec, &there, &[], SPP, 100);
                let what = format!("{}: {name} x {scale} at {offset}", spec.name);
                picture.assert_agrees(&expected, 0.0, &what);
            }
        }
    }
}

/// Sizes at which squares of lengths leave single precision.
const UNITS: [(f64, DVec3); 2] = [(1e-12, DVec3::new(3e-11, -1e-11, 2e-11)), (1e15, DVec3::new(1e16, 2e16, -3e16))];

#[test]
fn units_do_not_matter() {
    for name in ["bumps", "delta-lights", "instances", "lens", "sunsky"] {
        let here = prepare(exhibit(name), Backend::default_available(), None);
        for spec in unbiased().filter(|s| ["path", "bdpt"].contains(&s.name) && takes(s, &here)) {
            let expected = Picture::render(spec, &here, &[], SPP, 1);
            for (scale, offset) in UNITS {
                let there = prepare(placed(exhibit(name), scale, offset), Backend::default_available(), None);
                let picture = Picture::render(spec, &there, &[], SPP, 100);
                picture.assert_agrees(&expected, 0.0, &format!("{}: {name} x {scale} at {offset}", spec.name));
            }
        }
    }
}

#[test]
fn distances_are_in_the_units_of_the_file() {
    let layer = |scale: f64, offset: DVec3| {
        let scene = prepare(placed(exhibit("instances"), scale, offset), Backend::default_available(), None);
        let film = Estimator::new((path::SPEC.build)(&Params::defaults(&path::SPEC)), scene.window, 1).film;
        let depth = aov::layers(&scene, &film, 1, &[Aov::Depth]).remove(0).channels.remove(0).1;
        // A corner of the scene's box, in units that do not depend on the scale.
        let corner = scene.position_in_file(Vec3::splat(scene.radius));
        (depth, corner, f64::from(scene.radius) * scene.unit)
    };
    let (depth, point, radius) = layer(1.0, DVec3::ZERO);
    assert!(depth.iter().any(|d| *d > 0.1));
    for (scale, offset) in UNITS {
        let (there, point_there, radius_there) = layer(scale, offset);
        let ratios = there.iter().zip(&depth).filter(|(_, d)| **d > 0.0).map(|(a, b)| f64::from(*a) / f64::from(*b));
        ratios.for_each(|ratio| assert!((ratio / scale - 1.0).abs() < 1e-3, "{ratio:e}"));
        assert!((radius_there / radius / scale - 1.0).abs() < 1e-3, "{radius_there:e}");
        assert!(((point_there - offset) / scale).distance(point) < 1e-3 * radius, "{point_there}");
    }
}

/// A camera inside a closed, tilted box with balls that touch and pierce its walls; all the light is outside.
const DARK: &str = r#"
    <sensor type="perspective"><float name="fov" value="90"/>
        <transform name="to_world"><lookat origin="0.1, 0.2, 0.3" target="1, 1, 1" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film></sensor>
    <bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.9"/></bsdf></bsdf>
    <shape type="cube"><transform name="to_world"><rotate x="1" y="2" z="3" angle="37"/></transform><ref id="white"/></shape>
    <shape type="sphere"><transform name="to_world"><scale value="0.3"/><translate x="0.7"/><rotate x="1" y="2" z="3" angle="37"/>
        </transform><ref id="white"/></shape>
    <shape type="sphere"><transform name="to_world"><scale value="0.3"/><translate y="0.65" z="0.8"/>
        <rotate x="1" y="2" z="3" angle="37"/></transform><bsdf type="dielectric"/></shape>
    <emitter type="constant"><rgb name="radiance" value="1e6"/></emitter>
    <emitter type="directional"><vector name="direction" value="-1, -2, -3"/><rgb name="irradiance" value="1e6"/></emitter>
    <emitter type="point"><point name="position" x="2" y="2" z="2"/><rgb name="intensity" value="1e6"/></emitter>
    <shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="90"/><translate y="2"/></transform>
        <emitter type="area"><rgb name="radiance" value="1e6"/></emitter></shape>"#;

#[test]
fn a_closed_box_is_dark() {
    for (scale, offset) in PLACES.into_iter().chain([(1.0, DVec3::ZERO)]) {
        for backend in [Backend::default_available(), Backend::Obvhs] {
            let scene = prepare(placed(parse(DARK, &[]), scale, offset), backend, None);
            for spec in unbiased().filter(|s| takes(s, &scene)) {
                let picture = Picture::render(spec, &scene, &[("rr_depth", "10")], 16, 1);
                let dark = Picture::constant(0.0, picture.mean.len());
                picture.assert_agrees(&dark, 0.0, &format!("{}: {scale} at {offset}, {backend:?}", spec.name));
                assert_eq!(picture.whole.0, 0.0, "{}: {scale} at {offset}, {backend:?}", spec.name);
            }
        }
    }
}

#[test]
fn a_closed_box_is_dark_in_any_unit() {
    for (scale, offset) in UNITS {
        let scene = prepare(placed(parse(DARK, &[]), scale, offset), Backend::default_available(), None);
        let picture = Picture::render(&path::SPEC, &scene, &[], 16, 1);
        assert_eq!(picture.whole.0, 0.0, "{scale} at {offset}");
    }
}
