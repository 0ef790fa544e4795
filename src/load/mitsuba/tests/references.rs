//! Objects that stand in the scene with an id and are referred to from where they belong.

use super::*;

const LIGHT: &str = "<emitter type=\"area\" id=\"glow\"><rgb name=\"radiance\" value=\"1, 2, 3\"/></emitter>";

#[test]
fn area_lights_may_stand_in_the_scene() {
    for inside in [
        format!("{LIGHT}<shape type=\"rectangle\" id=\"lamp\"><ref id=\"glow\"/></shape>"),
        format!("<shape type=\"rectangle\" id=\"lamp\"><ref name=\"emitter\" id=\"glow\"/></shape>{LIGHT}"),
        format!("{LIGHT}<alias id=\"glow\" as=\"g\"/><shape type=\"disk\" id=\"lamp\"><ref id=\"g\"/></shape>"),
    ] {
        let s = good(&inside);
        let lamp = s.shapes.iter().find(|s| s.name.as_deref() == Some("lamp")).unwrap();
        let radiance = lamp.emission.as_ref().unwrap().radiance;
        assert_eq!(radiance, ColorDesc::Constant(Rgb::new(1.0, 2.0, 3.0)), "{inside}");
        // The other light is the one that every scene here has.
        assert_eq!(s.emitters.len(), 1, "{inside}");
    }
    // One that no shape refers to is a mistake, and the only one.
    assert_eq!(messages(load(&scene(LIGHT))), [("scene::misplaced-element", 2, 1)]);
}

#[test]
fn films_samplers_and_filters_may_stand_in_the_scene() {
    let declared = "<rfilter type=\"tent\" id=\"f\"><float name=\"radius\" value=\"2\"/></rfilter>\
        <film type=\"hdrfilm\" id=\"p\"><integer name=\"width\" value=\"12\"/><ref id=\"f\"/></film>\
        <sampler type=\"multijitter\" id=\"s\"><integer name=\"sample_count\" value=\"9\"/></sampler>";
    let s = good(&format!(
        "{declared}<sensor type=\"perspective\"><ref id=\"p\"/><ref id=\"s\"/></sensor>\
         <sensor type=\"perspective\"><ref name=\"film\" id=\"p\"/></sensor>"
    ));
    for sensor in &s.sensors[1..] {
        assert_eq!((sensor.film.width, sensor.film.filter), (12, FilterDesc::Tent { radius: 2.0 }));
    }
    assert_eq!((s.sensors[1].sample_count, s.sensors[2].sample_count), (Some(9), None));
}

#[test]
fn a_slip_in_an_object_that_several_share_is_said_once() {
    let film = "<film type=\"hdrfilm\" id=\"p\"><integer name=\"widht\" value=\"12\"/></film>";
    let inside = format!("{film}{}", "<sensor type=\"perspective\"><ref id=\"p\"/></sensor>".repeat(3));
    assert_eq!(messages(load(&scene(&inside))), [("scene::unknown-property", 2, 44)]);
    // Also where nobody refers to it.
    assert_eq!(messages(load(&scene(film))), [("scene::unknown-property", 2, 44)]);
}
