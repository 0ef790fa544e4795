//! The command line's view of bidirectional techniques: the pyramid, replays, switched off techniques.

use crate::support::program::Sandbox;
use lightsieve::image::{Encoding, Image, read_image};

fn image(sandbox: &Sandbox, name: &str) -> Image {
    read_image(&sandbox.path(name), Encoding::Auto).unwrap()
}

fn mean(image: &Image) -> f64 {
    let all = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    all.map(|(x, y)| f64::from(image.rgb(x, y).luminance())).sum::<f64>() / f64::from(image.width * image.height)
}

#[test]
fn methods_that_only_connect_warn_of_narrow_lobes() {
    let sandbox = Sandbox::new();
    let grey =
        "<bsdf type=\"diffuse\">\n            <rgb name=\"reflectance\" value=\"$red, 0.5, 0.4\"/>\n        </bsdf>";
    let warned = |bsdf: &str, integrator: &str| {
        sandbox.write_box_with("rough.xml", grey, bsdf);
        let run = sandbox.run(&format!("render rough.xml -i {integrator} --spp 1 -o a.pfm")).expect(0, &[]);
        run.stderr.contains("narrow lobes")
    };
    let metal = |alpha: &str| {
        format!(
            "<bsdf type=\"roughconductor\"><string name=\"material\" value=\"Al\"/><float name=\"alpha\" value=\"{alpha}\"/></bsdf>"
        )
    };
    for integrator in ["light", "importance-caching"] {
        assert!(warned(&metal("0.001"), integrator), "{integrator}");
        assert!(!warned(&metal("0.1"), integrator), "{integrator}");
    }
    assert!(!warned(&metal("0.001"), "bdpt"));
}

#[test]
fn no_edges_are_black_and_one_edge_is_the_lamp_for_every_integrator() {
    let sandbox = Sandbox::new();
    // The camera looks up at the lamp.
    sandbox.write_box_with("lamp.xml", "target=\"0, 0, -1\"", "target=\"0, 0.95, 0\"");
    for spec in lightsieve::integrators::REGISTRY {
        let name = spec.name;
        let lit = |depth: u32| {
            let render = format!("render lamp.xml -i {name} --max-depth {depth} --spp 16 -o a.pfm --quiet");
            sandbox.run(&render).expect(0, &[]);
            let image = image(&sandbox, "a.pfm");
            let pixels = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
            pixels.filter(|&(x, y)| image.rgb(x, y).luminance() > 0.0).count()
        };
        assert_eq!(lit(0), 0, "{name}");
        assert!(lit(1) > 0, "{name}");
    }
}

#[test]
fn a_pyramid_is_written() {
    let sandbox = Sandbox::new();
    sandbox
        .run("render scene.xml -i bdpt --spp 4 --seed 3 -o a.exr --pyramid techniques --pyramid-depth 5 --quiet")
        .expect(0, &[]);
    // All path lengths of the scene are in the pyramid: the main layer of what is weighted is the picture.
    let (picture, weighted) = (image(&sandbox, "a.exr"), image(&sandbox, "techniques/weighted.exr"));
    assert!((mean(&picture) / mean(&weighted) - 1.0).abs() < 1e-5);
    // By themselves, all techniques that make a path make it whole.
    assert!(mean(&image(&sandbox, "techniques/raw.exr")) > 1.5 * mean(&picture));
    let sheet = image(&sandbox, "techniques/sheet.png");
    assert!(sheet.width > 2 * 6 * 16 && sheet.height > 5 * 16);
    let bytes = sandbox.read("techniques/weighted.exr");
    for layer in ["depth1_s0_t2.R", "depth2_s1_t2.G", "depth5_s5_t1.B"] {
        assert!(bytes.windows(layer.len()).any(|w| w == layer.as_bytes()), "{layer}");
    }
}

#[test]
fn who_has_no_techniques_has_no_pyramid() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -i path --spp 1 --pyramid p").expect(2, &["path has no techniques"]);
    sandbox.run("render scene.xml -i bdpt --spp 1 --pyramid p --pyramid-depth 0").expect(2, &["pyramid-depth"]);
}

#[test]
fn a_sample_is_replayed() {
    let sandbox = Sandbox::new();
    // The scene is one that `bdpt` would leave to path tracing.
    for (integrator, params) in [("path", ""), ("light", ""), ("bdpt", "-p fallback=false")] {
        let run =
            sandbox.run(&format!("replay scene.xml -i {integrator} {params} --pixel 5,11 --iteration 2 --seed 7"));
        let text = run.expect(0, &[]).stdout;
        let walk = if integrator == "light" { "y1 at" } else { "z1 at" };
        for part in [walk, "throughput", "contributions", "sum of what is visible"] {
            assert!(text.contains(part), "{integrator}: {part} in {text}");
        }
        // Only bidirectional weights have a longer definition, and this light sub-path is nowhere seen.
        assert_eq!(text.contains("by definition"), integrator == "bdpt");
    }
    sandbox.run("replay scene.xml --pixel 16,0").expect(2, &["16,0 is not in the picture"]);
    sandbox.run("replay scene.xml --pixel 1,2,3").expect(2, &["column and row"]);
    sandbox.run("replay scene.xml --pixel 1,1 -i bdtp").expect(2, &["did you mean \"bdpt\""]);
}

/// A path tracer's sample depends on its own pixel alone: what is replayed is what was rendered.
#[test]
fn a_replay_is_the_rendered_sample() {
    let sandbox = Sandbox::new();
    sandbox.write_box_with("scene.xml", "<film type=\"hdrfilm\">", "<film type=\"hdrfilm\"><rfilter type=\"box\"/>");
    for (integrator, params) in [("path", ""), ("bdpt", "-p techniques=-*:1")] {
        let options = format!("-i {integrator} {params} --seed 4");
        sandbox.run(&format!("render scene.xml {options} --spp 1 -o a.pfm --quiet")).expect(0, &[]);
        let text = sandbox.run(&format!("replay scene.xml {options} --pixel 9,6")).expect(0, &[]).stdout;
        let sum = text.lines().last().unwrap().rsplit_once('(').unwrap().1.trim_end_matches(')').to_owned();
        let sum: Vec<f32> = sum.split_whitespace().map(|v| v.parse().unwrap()).collect();
        let rendered = image(&sandbox, "a.pfm").rgb(9, 6).to_array();
        for (a, b) in sum.iter().zip(rendered) {
            assert!((a - b).abs() <= 1e-5 * b.abs(), "{integrator}: {sum:?} {rendered:?}");
        }
    }
}

/// Resampled connections know what iterations before them found, and how much effort was decided then.
#[test]
fn a_replay_knows_the_iterations_before_it() {
    let sandbox = Sandbox::new();
    sandbox.write_box_with("scene.xml", "<film type=\"hdrfilm\">", "<film type=\"hdrfilm\"><rfilter type=\"box\"/>");
    for integrator in ["ris", "two-stage", "bdpt -p allocation=auto"] {
        let options = format!("-i {integrator} -p techniques=-*:1 --seed 4");
        let pixel = |spp: u32| {
            sandbox.run(&format!("render scene.xml {options} --spp {spp} -o a.pfm --quiet")).expect(0, &[]);
            image(&sandbox, "a.pfm").rgb(9, 6).to_array().map(|v| v * spp as f32)
        };
        let (two, three) = (pixel(2), pixel(3));
        let text = sandbox.run(&format!("replay scene.xml {options} --pixel 9,6 --iteration 2")).expect(0, &[]).stdout;
        let sum = text.lines().last().unwrap().rsplit_once('(').unwrap().1.trim_end_matches(')').to_owned();
        let sum: Vec<f32> = sum.split_whitespace().map(|v| v.parse().unwrap()).collect();
        for (i, a) in sum.iter().enumerate() {
            let rendered = three[i] - two[i];
            assert!((a - rendered).abs() <= 1e-5 * three[i].abs(), "{integrator}: {a} {rendered}");
        }
    }
}

#[test]
fn techniques_are_switched_by_name() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -i bdpt --spp 2 -p techniques=*:1 -o a.pfm --quiet").expect(0, &[]);
    sandbox.run("render scene.xml -i light --spp 2 -o b.pfm --quiet").expect(0, &[]);
    assert_eq!(sandbox.read("a.pfm"), sandbox.read("b.pfm"));
    sandbox.run("render scene.xml -o a.pfm -i bdpt -p techniques=1-2").expect(2, &["techniques = 1-2", "light:eye"]);
}

#[test]
fn what_light_tracing_cannot_see_is_said() {
    let sandbox = Sandbox::new();
    sandbox.write_box_with(
        "scene.xml",
        "<shape type=\"rectangle\">",
        "<shape type=\"sphere\"><float name=\"radius\" value=\"0.3\"/><bsdf type=\"dielectric\"/></shape><shape type=\"rectangle\">",
    );
    sandbox
        .run("render scene.xml -i light --spp 1 -o a.pfm")
        .expect(0, &["warning: light: what the camera sees in mirrors"]);
    let other = sandbox.run("render scene.xml -i bdpt --spp 1 -o a.pfm").expect(0, &[]);
    assert!(!other.stderr.contains("warning"), "{}", other.stderr);
}
