//! Bidirectional methods leave a render to path tracing where it is more efficient, and only there.

use crate::support::pictures::{Picture, parse, prepare};
use crate::support::program::Sandbox;
use lightsieve::film::Film;
use lightsieve::integrators::{Integrator, IntegratorSpec, Iteration, Params, REGISTRY, path, resampling};
use lightsieve::prepared::PreparedScene;
use lightsieve::ray::Backend;

/// A ball on a floor under a white sky, seen from the side: next event finds nearly all light.
const OPEN: &str = r#"
    <sensor type="perspective"><float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0, 1, 4" target="0, 0.5, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="32"/></film></sensor>
    <emitter type="constant"/>
    <shape type="rectangle"><transform name="to_world"><scale value="9"/><rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.3"/></bsdf></shape>
    <shape type="cube"><transform name="to_world"><scale value="0.5"/><translate y="0.5"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>"#;

/// A point light and a mirror: light on the floor by way of the mirror is out of reach for path tracing.
const MIRROR: &str = r#"
    <emitter type="point"><point name="position" value="0, 3, 2"/><rgb name="intensity" value="1"/></emitter>
    <shape type="rectangle"><transform name="to_world"><translate x="0" y="1" z="-2"/></transform>
        <bsdf type="conductor"/></shape>"#;

/// A room that is lit by a narrow spot on its ceiling: bounces of a path seldom meet the spot, light sub-paths all do.
const INDIRECT: &str = r#"
    <sensor type="perspective"><float name="fov" value="70"/>
        <transform name="to_world"><lookat origin="0, 0, 0.95" target="0, -0.2, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="32"/></film></sensor>
    <shape type="cube">
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></bsdf></shape>
    <emitter type="spot"><float name="cutoff_angle" value="4"/><rgb name="intensity" value="100"/>
        <transform name="to_world"><lookat origin="0, 0.5, 0" target="0, 1, 0" up="0, 0, 1"/></transform>
    </emitter>"#;

/// Every method that decides.
fn methods() -> impl Iterator<Item = &'static IntegratorSpec> {
    REGISTRY.iter().copied().filter(|spec| spec.params().any(|p| p.name == "fallback"))
}

/// Values that suit a small film and take two iterations for the decision.
fn build(spec: &'static IntegratorSpec) -> Box<dyn Integrator> {
    let mut params = Params::defaults(spec);
    for (name, value) in [("cache_density", "0.05"), ("record_density", "0.05"), ("presampled_paths", "500")] {
        if spec.params().any(|p| p.name == name) {
            params.set(name, value).unwrap();
        }
    }
    (spec.build)(&params)
}

fn scene(parts: &[&str]) -> PreparedScene {
    prepare(parse(&parts.concat(), &[]), Backend::default_available(), None)
}

/// A method after the iterations that decide.
fn decided(spec: &'static IntegratorSpec, scene: &PreparedScene) -> Box<dyn Integrator> {
    let (mut integrator, mut film) = (build(spec), Film::new(scene.window));
    for _ in 0..2 {
        let index = film.begin_iteration();
        integrator.iterate(&Iteration::new(scene, 5, index), &mut film);
    }
    integrator
}

fn leaves_the_render(integrator: &dyn Integrator) -> bool {
    integrator.notes().iter().any(|note| note.starts_with("path tracing is more efficient"))
}

#[test]
fn path_tracing_renders_what_it_is_better_at() {
    let (open, mirror) = (scene(&[OPEN]), scene(&[OPEN, MIRROR]));
    assert!(methods().count() >= 7);
    for spec in methods() {
        assert!(leaves_the_render(&*decided(spec, &open)), "{}", spec.name);
        assert!(!leaves_the_render(&*decided(spec, &mirror)), "{}: light would be missing", spec.name);
    }
}

#[test]
fn methods_keep_what_they_are_better_at() {
    let indirect = scene(&[INDIRECT]);
    for spec in methods() {
        for seed in 1..=3 {
            let (mut integrator, mut film) = (build(spec), Film::new(indirect.window));
            for _ in 0..2 {
                let index = film.begin_iteration();
                integrator.iterate(&Iteration::new(&indirect, seed, index), &mut film);
            }
            assert!(!leaves_the_render(&*integrator), "{}, seed {seed}", spec.name);
        }
    }
}

#[test]
fn the_picture_is_that_of_path_tracing() {
    let open = scene(&[OPEN]);
    let reference = Picture::render(&path::SPEC, &open, &[], 32, 100);
    let auto = [("allocation", "auto"), ("cache_density", "0.05")];
    Picture::render(&resampling::TWO_STAGE, &open, &auto, 32, 200).assert_agrees(&reference, 0.0, "two-stage");
}

/// Visible contributions of eye sub-paths in a replay are what the iteration added to the pixel, but for splats, which
/// come from light sub-paths of other pixels and which path tracing does not have.
#[test]
fn replays_know_who_renders() {
    for (scene, path_takes_over) in
        [(scene(&[OPEN]), true), (scene(&[OPEN, MIRROR]), false), (scene(&[INDIRECT]), false)]
    {
        let new = || build(&resampling::RIS);
        let (mut integrator, mut film) = (new(), Film::new(scene.window));
        let sum = |film: &Film| film.mean_f64()[20 * 48 + 20].iter().sum::<f64>() * film.iterations() as f64;
        for index in 0..4 {
            let before = sum(&film);
            film.begin_iteration();
            let iteration = Iteration::new(&scene, 9, index);
            integrator.iterate(&iteration, &mut film);
            let added = sum(&film) - before;
            let replay = new().replay(&iteration, (20, 20));
            let visible = replay.contributions.iter().filter(|c| c.visible && c.t >= 2);
            let replayed: f64 = visible.map(|c| (c.raw * c.weight).to_array().map(f64::from).iter().sum::<f64>()).sum();
            let tolerance = 1e-5 * added + 1e-9;
            assert!(replayed <= added + tolerance, "iteration {index}: {replayed} of {added}");
            if path_takes_over && index >= 2 {
                assert!(replayed >= added - tolerance, "iteration {index}: {replayed} of {added}");
            }
        }
    }
}

#[test]
fn a_resumed_render_goes_on_with_whoever_rendered() {
    let sandbox = Sandbox::new();
    let renderers = [
        (OPEN.to_owned(), "\"path tracing is more efficient"),
        (OPEN.to_owned() + MIRROR, "\"bidirectional path tracing is more efficient"),
        (INDIRECT.to_owned(), "light sub-paths"),
    ];
    for (parts, note) in renderers {
        sandbox.write("s.xml", format!("<scene version=\"3.0.0\">{parts}</scene>"));
        let render = |arguments: &str| {
            sandbox
                .run(&format!("render s.xml -i two-stage -p presampled_paths=500 --seed 3 {arguments}"))
                .expect(0, &[]);
        };
        render("--spp 5 -o whole.pfm --stats whole.json");
        for first in [1, 2, 4] {
            render(&format!("--spp {first} --checkpoint c -o part.pfm"));
            render("--spp 5 --resume c --threads 1 -o resumed.pfm");
            assert_eq!(sandbox.read("resumed.pfm"), sandbox.read("whole.pfm"), "from {first}");
        }
        let stats = String::from_utf8(sandbox.read("whole.json")).unwrap();
        assert!(stats.contains(note), "{note}");
    }
}
