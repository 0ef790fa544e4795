//! Participating media, in every method: values known by hand, agreement of methods with each other and with Mitsuba, and
//! weights.

use crate::support::methods::{bidirectional_methods, weight_variant};
use crate::support::pictures::{Picture, parse_beside, prepare, takes, unbiased};
use lightsieve::integrators::{IntegratorSpec, Iteration, find, path};
use lightsieve::prepared::{Features, PreparedScene};
use lightsieve::ray::Backend;

const SPP: u64 = 64;

fn scene(parts: &[&str]) -> PreparedScene {
    prepare(parse_beside(&parts.concat(), &[("smoke.vol", smoke())]), Backend::default_available(), None)
}

/// A puff of smoke on a grid of 5 × 4 × 3 samples of single precision.
fn smoke() -> Vec<u8> {
    let mut file = b"VOL\x03".to_vec();
    [1, 5, 4, 3, 1].iter().for_each(|n: &i32| file.extend(n.to_le_bytes()));
    [-0.5f32, -0.5, -0.5, 0.5, 0.5, 0.5].iter().for_each(|x| file.extend(x.to_le_bytes()));
    let samples = (0..3).flat_map(|z| (0..4).flat_map(move |y| (0..5).map(move |x| (x, y, z))));
    for (x, y, z) in samples {
        let border = x == 0 || y == 3 || z == 2;
        let density = if border { 0.0f32 } else { 0.4 + 0.3 * ((3 * x + 5 * y + 7 * z) % 4) as f32 };
        file.extend(density.to_le_bytes());
    }
    file
}

/// A camera at `origin` that looks at `target`, with its film and what else it contains.
fn camera(origin: &str, target: &str, fov: f64, content: &str) -> String {
    format!(
        r#"<sensor type="perspective"><float name="fov" value="{fov}"/>
        <transform name="to_world"><lookat origin="{origin}" target="{target}" up="0, 1, 0"/></transform>{content}
        <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film>
        </sensor>"#
    )
}

fn medium(name: &str, sigma_t: &str, albedo: &str, phase: &str) -> String {
    format!(
        r#"<medium type="homogeneous"{name}><rgb name="sigma_t" value="{sigma_t}"/><rgb name="albedo" value="{albedo}"/>
        {phase}</medium>"#
    )
}

fn hg(g: f64) -> String {
    format!(r#"<phase type="hg"><float name="g" value="{g}"/></phase>"#)
}

const INTERIOR: &str = r#" name="interior""#;

/// A shape of which only the medium inside is seen.
fn border(kind: &str, transform: &str, medium: &str) -> String {
    format!(
        r#"<shape type="{kind}"><transform name="to_world">{transform}</transform><bsdf type="null"/>{medium}</shape>"#
    )
}

fn diffuse(albedo: &str) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf>"#)
}

fn sky(radiance: &str) -> String {
    format!(r#"<emitter type="constant"><rgb name="radiance" value="{radiance}"/></emitter>"#)
}

const POINT: &str = r#"<emitter type="point"><point name="position" value="0.6, 0.9, 0.3"/>
    <rgb name="intensity" value="5, 4, 3"/></emitter>"#;

/// A square lamp over the origin, that looks down.
fn lamp(y: f64) -> String {
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/>
        <translate y="{y}"/></transform><emitter type="area"><rgb name="radiance" value="6, 5, 4"/></emitter>{}</shape>"#,
        diffuse("0")
    )
}

fn floor(y: f64) -> String {
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/><rotate x="1" angle="-90"/>
        <translate y="{y}"/></transform>{}</shape>"#,
        diffuse("0.6, 0.5, 0.4")
    )
}

/// Means of the pictures of four of the [`scenes`] and their standard errors, by Mitsuba 3.9.1: `volpathmis` in
/// `llvm_ad_rgb`, max_depth -1, rr_depth 50, 12 x 65,536 samples of each pixel. (Its `rgb` takes no coefficients above
/// one: a tenth of `sigma_t` was given with a `scale` of 10.)
const MITSUBA: [(&str, [f64; 3], [f64; 3]); 4] = [
    ("fog box with a lamp in it", [0.141753, 0.115547, 0.090503], [0.000190, 0.000158, 0.000127]),
    ("coloured fog under a sky", [0.587199, 0.569651, 0.487125], [0.000134, 0.000053, 0.000069]),
    ("dense ball in thin fog", [0.136121, 0.111331, 0.087487], [0.000187, 0.000156, 0.000125]),
    ("cloudy glass ball", [0.198976, 0.185836, 0.170533], [0.000081, 0.000067, 0.000060]),
];

/// Scenes, each with the media in another place.
fn scenes() -> Vec<(&'static str, PreparedScene)> {
    let view = camera("0, 0.4, 4", "0, 0, 0", 40.0, "");
    let grey = medium(INTERIOR, "0.8", "0.9", "");
    let coloured = medium(INTERIOR, "0.3, 1, 3", "0.95, 0.8, 0.5", &hg(0.6));
    let blend = format!(
        r#"<phase type="blendphase"><float name="weight" value="0.4"/>{}<phase type="rayleigh"/></phase>"#,
        hg(-0.5)
    );
    let cube = r#"<scale x="2" y="1.4" z="2"/>"#;
    let dense = r#"<scale value="0.4"/><translate x="0.3"/>"#;
    let exterior = medium(r#" name="exterior""#, "0.8", "0.9", "");
    let inside = camera("0, 0, 1.5", "0, 0, 0", 60.0, &medium("", "0.4, 0.6, 0.5", "0.9", &hg(0.3)));
    let glass = |medium: &str| {
        format!(r#"<shape type="sphere"><float name="radius" value="0.6"/><bsdf type="dielectric"/>{medium}</shape>"#)
    };
    let to_world =
        r#"<transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2.2"/></transform>"#;
    let grid = format!(
        r#"<medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t"><string name="filename"
        value="smoke.vol"/>{to_world}</volume><float name="scale" value="3"/><rgb name="albedo" value="0.9, 0.7, 0.5"/>{}</medium>"#,
        hg(0.4)
    );
    vec![
        ("smoke on a grid", scene(&[&view, &sky("0.3"), POINT, &lamp(1.4), &floor(-1.2), &border("cube", "", &grid)])),
        ("fog box with a lamp in it", scene(&[&view, &floor(-1.0), &lamp(1.2), &border("cube", cube, &grey)])),
        (
            "coloured fog under a sky",
            scene(&[&view, &sky("0.7, 0.8, 1"), &floor(-1.0), &border("sphere", "", &coloured)]),
        ),
        ("point light in coloured fog", scene(&[&view, POINT, &floor(-1.0), &border("cube", cube, &coloured)])),
        ("camera and lamp in endless fog", scene(&[&inside, &floor(-1.0), &lamp(1.2), POINT])),
        (
            "dense ball in thin fog",
            scene(&[
                &view,
                &lamp(1.2),
                &floor(-1.0),
                &border("cube", cube, &grey),
                &border("sphere", dense, &(medium(INTERIOR, "6", "0.7", &blend) + &exterior)),
            ]),
        ),
        (
            "cloudy glass ball",
            scene(&[&view, &lamp(1.6), &sky("0.2"), &floor(-1.0), &glass(&medium(INTERIOR, "2, 1, 0.5", "0.9", ""))]),
        ),
    ]
}

fn render(spec: &'static IntegratorSpec, scene: &PreparedScene, spp: u64, seed: u64) -> Picture {
    Picture::render(spec, scene, &[("fallback", "false")], spp, seed)
}

/// Behind a slab that only absorbs, the sky is exp(−σ d) as bright.
#[test]
fn absorption_is_exponential() {
    let slab = medium(INTERIOR, "0.5, 1, 2", "0", "");
    let scene = scene(&[
        &camera("0, 0, 40", "0, 0, 0", 0.1, ""),
        &sky("1, 2, 3"),
        &border("cube", r#"<scale x="9" y="9" z="0.7"/>"#, &slab),
    ]);
    let expected = [1.0 * (-0.7f64).exp(), 2.0 * (-1.4f64).exp(), 3.0 * (-2.8f64).exp()];
    // Hardly any light sub-path of its own meets so narrow a view.
    for spec in unbiased().filter(|spec| takes(spec, &scene) && spec.name != "light") {
        let picture = render(spec, &scene, SPP, 1);
        picture.assert_agrees(&Picture::constant_rgb(expected, 16), 1e-4, spec.name);
    }
}

/// A medium that absorbs nothing, lit from all sides alike, cannot be seen.
#[test]
fn a_white_medium_in_a_white_sky_is_invisible() {
    let view = camera("0, 0.4, 4", "0, 0, 0", 40.0, "");
    for (shape, phase) in [("sphere", hg(0.7)), ("cube", String::new())] {
        let white = medium(INTERIOR, "1, 1.3, 1.6", "1", &phase);
        let scene = scene(&[&view, &sky("1"), &border(shape, "", &white)]);
        let expected = Picture::constant(1.0, 16);
        for spec in unbiased().filter(|spec| takes(spec, &scene)) {
            let (params, spp) = ([("max_depth", "-1"), ("fallback", "false")], 2 * SPP);
            let picture = Picture::render(spec, &scene, &params, spp, 1);
            picture.assert_agrees(&expected, 1e-3, &format!("{}: {shape}", spec.name));
        }
    }
}

/// Nor can one behind any boundary that absorbs nothing, with anything white in it.
#[test]
fn white_media_behind_any_boundary_are_invisible() {
    let view = camera("0, 0.4, 4", "0, 0, 0", 40.0, "");
    let ball = |radius: f64, bsdf: &str, content: &str| {
        format!(r#"<shape type="sphere"><float name="radius" value="{radius}"/>{bsdf}{content}</shape>"#)
    };
    let bsdf = |kind: &str| format!(r#"<bsdf type="{kind}"/>"#);
    let white = |sigma_t: &str, phase: &str| medium(INTERIOR, sigma_t, "1", phase);
    let around = |sigma_t: &str| medium(r#" name="exterior""#, sigma_t, "1", "");
    let to_world =
        r#"<transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2.2"/></transform>"#;
    let grid = format!(
        r#"<medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t"><string name="filename"
        value="smoke.vol"/>{to_world}</volume><float name="scale" value="3"/><rgb name="albedo" value="1"/></medium>"#
    );
    let (fog, null) = (white("1.3", &hg(0.7)), bsdf("null"));
    let cases = [
        ("glass", ball(1.0, &bsdf("dielectric"), &white("1.3", r#"<phase type="rayleigh"/>"#))),
        ("thin glass", ball(1.0, &bsdf("thindielectric"), &white("2", &hg(-0.4)))),
        ("a grid in glass", ball(1.0, &bsdf("dielectric"), &grid)),
        (
            "a ball in a ball",
            ball(1.0, &bsdf("dielectric"), &fog) + &ball(0.5, &null, &(white("5", "") + &around("1.3"))),
        ),
        ("a mirror in fog", ball(1.0, &null, &fog) + &ball(0.4, &bsdf("conductor"), &around("1.3"))),
        ("a white wall in fog", ball(1.0, &null, &fog) + &ball(0.4, &diffuse("1"), &around("1.3"))),
    ];
    for (what, shapes) in cases {
        let scene = scene(&[&view, &sky("1"), &shapes]);
        // Without Russian roulette every path that comes to its end brings the whole light of the sky.
        let params = [("max_depth", "-1"), ("rr_depth", "1000000"), ("fallback", "false")];
        let picture = Picture::render(find("path").unwrap(), &scene, &params, 2 * SPP, 1);
        picture.assert_agrees(&Picture::constant(1.0, 16), 1e-3, what);
        // Where next event reaches the sky its weights scatter; behind glass every path is exact.
        let (error, spread) = ((picture.whole.0 - 1.0).abs(), picture.whole.1.sqrt());
        let bound = if what.contains("glass") { 0.0 } else { 4.0 * spread };
        assert!(error < 1e-3 + bound && spread < 2e-3, "{what}: {error} +- {spread}");
    }
}

#[test]
fn pictures_are_as_bright_as_those_of_mitsuba() {
    for (what, scene) in scenes() {
        let Some((_, mean, error)) = MITSUBA.iter().find(|(name, ..)| *name == what) else { continue };
        let spec = find("bdpt").unwrap();
        let params = [("max_depth", "-1"), ("fallback", "false")];
        let pictures: Vec<Picture> = (0..4).map(|seed| Picture::render(spec, &scene, &params, 8 * SPP, seed)).collect();
        for c in 0..3 {
            let of_picture = |p: &Picture| p.mean.iter().map(|pixel| pixel[c]).sum::<f64>() / p.mean.len() as f64;
            let means: Vec<f64> = pictures.iter().map(of_picture).collect();
            let ours = means.iter().sum::<f64>() / 4.0;
            let variance = means.iter().map(|m| (m - ours).powi(2)).sum::<f64>() / 12.0;
            // Three degrees of freedom: six standard errors are exceeded once in a hundred of such channels by chance,
            // beside the tolerance of half a percent.
            let tolerance = 0.005 * mean[c] + 6.0 * (variance + error[c].powi(2)).sqrt();
            assert!((ours - mean[c]).abs() < tolerance, "{what}, channel {c}: {ours} and {}, {tolerance}", mean[c]);
            assert!(tolerance < 0.03 * mean[c], "{what}, channel {c}: {tolerance} of {}", mean[c]);
        }
    }
}

#[test]
fn all_methods_agree_in_media() {
    for (what, scene) in scenes() {
        assert!(scene.features.contains(Features::MEDIA), "{what}");
        let expected = render(&path::SPEC, &scene, 64 * SPP, 100);
        let methods: Vec<_> = unbiased().filter(|spec| takes(spec, &scene) && spec.name != "path").collect();
        assert!(methods.len() >= 7, "{what}");
        for spec in methods {
            let spp = if spec.name == "light" { 16 * SPP } else { 2 * SPP };
            render(spec, &scene, spp, 1).assert_agrees(&expected, 0.0, &format!("{}: {what}", spec.name));
        }
    }
}

/// Weights are those of the definition, and sum to one, with collisions anywhere on the path.
#[test]
fn weights_count_collisions_and_media_on_every_edge() {
    let scenes = scenes();
    for spec in bidirectional_methods() {
        let (mut checked, mut connections) = (0, 0);
        for (what, scene) in &scenes {
            for variant in 0..2 {
                let mut integrator = (spec.build)(&weight_variant(spec, variant));
                let contributions = (0..16 * 6).flat_map(|i| {
                    let pixel = (i % 4, i / 4 % 4);
                    integrator.replay(&Iteration::new(scene, 7, u64::from(i / 16)), pixel).contributions
                });
                // Behind a surface that blocks a connection, other media may begin.
                for c in contributions.filter(|c| c.visible) {
                    let (s, sum) = (c.s, c.techniques.iter().map(|t| t.1).sum::<f64>());
                    let text = format!("{what}: {} variant {variant} ({s}, {}): {:?}", spec.name, c.t, c.techniques);
                    assert!((sum - 1.0).abs() < 1e-12, "{sum} {text}");
                    assert!((f64::from(c.weight) - c.techniques[s].1).abs() < 2e-3, "{} {text}", c.weight);
                    checked += 1;
                    connections += usize::from(s >= 2 && c.t >= 2);
                }
            }
        }
        let enough = checked > 200 && (connections > 100) == (spec.name != "light");
        assert!(enough, "{}: {checked} {connections}", spec.name);
    }
}
