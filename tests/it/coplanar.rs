//! Lamps in the plane of another surface are met, lit by and lighting as if they hung a little in front of it.

use crate::support::pictures::{Picture, parse, prepare, takes, unbiased};
use lightsieve::integrators::path;
use lightsieve::math::Rgb;
use lightsieve::math::hash::HashRng;
use lightsieve::prepared::PreparedScene;
use lightsieve::ray::{Backend, Ray};
use lightsieve::scene::SceneDesc;

const BACKENDS: [Backend; 3] = [Backend::Embree, Backend::Obvhs, Backend::Brute];
const TURN: &str = r#"<rotate x="1" y="2" z="3" angle="37"/>"#;

fn camera(turn: &str) -> String {
    format!(
        r#"<sensor type="perspective"><float name="fov" value="50"/><transform name="to_world">
        <lookat origin="0, 4, 4.5" target="0, 0.5, 0" up="0, 1, 0"/>{turn}</transform><film type="hdrfilm">
        <integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film></sensor>"#
    )
}

/// A square of half side `size` at the height `y` that faces down, or up.
fn square(size: f64, y: f64, facing: &str, turn: &str, content: &str) -> String {
    let angle = if facing == "down" { 90 } else { -90 };
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="{size}"/><rotate x="1" angle="{angle}"/>
        <translate x="0.2" y="{y}" z="-0.1"/>{turn}</transform>{content}</shape>"#
    )
}

const EMITTER: &str = r#"<emitter type="area"><rgb name="radiance" value="6, 5, 4"/></emitter>"#;
const TWOSIDED: &str = r#"<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>"#;

/// A floor with a block, a ceiling at the height 3, and lamps.
fn room(lamps: &str, ceiling: &str, turn: &str) -> SceneDesc {
    let block = format!(
        r#"<shape type="cube"><transform name="to_world"><scale value="0.4"/><translate x="-0.9" y="0.4"/>{turn}
        </transform></shape>"#
    );
    let floor = square(8.0, 0.0, "up", turn, r#"<bsdf type="diffuse"/>"#);
    let ceiling = square(3.0, 3.0, ceiling, turn, TWOSIDED);
    parse(&format!("{}{floor}{block}{ceiling}{lamps}", camera(turn)), &[])
}

/// Rays from the front of lights towards random points of them: the number of those that meet no light or its back.
fn missed(scene: &PreparedScene) -> u32 {
    let mut rng = HashRng::new(5, 0, 0, 0);
    let mut missed = 0;
    for (_, light) in scene.lights.iter() {
        for _ in 0..2000 {
            let [x, y, z, w] = rng.next_4();
            let Some(sample) = light.sample_emission([x, y], [z, w]) else { continue };
            let from = sample.origin + sample.direction * (0.1 + 2.0 * rng.next_f32());
            let hit = scene.query.closest(&Ray::leaving(from, sample.origin - from));
            let radiance = hit.and_then(|hit| {
                let light = scene.lights.get(scene.light_of(&hit)?);
                Some(light.emitted([hit.u, hit.v], sample.direction))
            });
            missed += u32::from(radiance.is_none_or(Rgb::is_black));
        }
    }
    missed
}

/// Every ray towards the front of a lamp meets it.
fn assert_met(what: &str, desc: impl Fn() -> SceneDesc) {
    for backend in BACKENDS.into_iter().filter(|b| *b != Backend::Embree || Backend::default_available() == *b) {
        let scene = prepare(desc(), backend, None);
        assert_eq!(missed(&scene), 0, "{what}, {backend:?}");
    }
}

#[test]
fn lamps_in_the_plane_of_another_surface_are_met() {
    for turn in ["", TURN] {
        for ceiling in ["down", "up"] {
            let lamp = square(0.5, 3.0, "down", turn, EMITTER);
            assert_met("a lamp in the ceiling", || room(&lamp, ceiling, turn));
            let both = format!("{lamp}{}", square(0.5, 3.0, "up", turn, EMITTER));
            assert_met("lamps on both sides", || room(&both, ceiling, turn));
            let behind = square(0.5, 3.000_001, "down", turn, EMITTER);
            assert_met("a lamp behind the ceiling by a rounding error", || room(&behind, ceiling, turn));
        }
        let disk = format!(
            r#"<shape type="disk"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/>
            <translate x="0.2" y="3"/>{turn}</transform>{EMITTER}</shape>"#
        );
        assert_met("a disk", || room(&disk, "down", turn));
        let on_disk = format!(
            r#"{}{}<shape type="disk"><transform name="to_world"><rotate x="1" angle="-90"/><translate y="0.5"/>{turn}
            </transform></shape>"#,
            camera(turn),
            square(0.5, 0.5, "up", turn, EMITTER)
        );
        assert_met("a lamp in a disk", || parse(&on_disk, &[]));
    }
}

/// One mesh with both sides of a lamp on four vertices.
#[test]
fn both_sides_of_a_mesh_are_met() {
    let mesh = "v -0.5 3 -0.5\nv 0.5 3 -0.5\nv 0.5 3 0.5\nv -0.5 3 0.5\nf 1 2 3\nf 1 3 4\nf 3 2 1\nf 4 3 1\n";
    let lamp = format!(
        r#"<shape type="obj"><string name="filename" value="lamp.obj"/>
        <boolean name="face_normals" value="true"/>{EMITTER}</shape>"#
    );
    let floor = square(8.0, 0.0, "up", "", r#"<bsdf type="diffuse"/>"#);
    assert_met("a mesh", || parse(&format!("{}{floor}{lamp}", camera("")), &[("lamp.obj", mesh)]));
}

#[test]
fn lamps_beside_other_surfaces_stay() {
    // A lamp between four parts of a ceiling, whose boxes touch its own.
    let part = |x: f64, z: f64, sx: f64, sz: f64| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/>
            <scale x="{sx}" z="{sz}"/><translate x="{x}" y="3" z="{z}"/></transform></shape>"#
        )
    };
    let lamp = part(0.0, 0.0, 1.0, 1.0).replace("</shape>", &format!("{EMITTER}</shape>"));
    let ceiling = [(-2.0, 0.0, 1.0, 3.0), (2.0, 0.0, 1.0, 3.0), (0.0, -2.0, 1.0, 1.0), (0.0, 2.0, 1.0, 1.0)];
    let ceiling: String = ceiling.map(|(x, z, sx, sz)| part(x, z, sx, sz)).concat();
    let xml = format!("{}{lamp}{ceiling}", camera(""));
    let scene = prepare(parse(&xml, &[]), Backend::default_available(), None);
    let height = |mesh: usize| scene.geometry.meshes[mesh].positions.iter().map(|p| p.y).collect::<Vec<_>>();
    assert_eq!(height(0), height(1));
}

/// The picture is that of a room whose lamp hangs lower by a ten thousandth of its height.
#[test]
fn every_integrator_sees_a_lamp_in_the_ceiling() {
    let scene_of = |y: f64, backend| {
        let lamp = square(0.5, y, "down", "", EMITTER);
        prepare(room(&lamp, "down", ""), backend, None)
    };
    let reference = Picture::render(&path::SPEC, &scene_of(2.9997, Backend::default_available()), &[], 512, 100);
    for backend in [Backend::default_available(), Backend::Obvhs] {
        let scene = scene_of(3.0, backend);
        for spec in unbiased().filter(|s| takes(s, &scene)) {
            let picture = Picture::render(spec, &scene, &[], 64, 1);
            picture.assert_agrees(&reference, 1e-3, &format!("{}, {backend:?}", spec.name));
        }
    }
}
