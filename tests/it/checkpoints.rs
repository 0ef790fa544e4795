//! Checkpoints from outside: renders with an error target go on bit by bit, and damaged files are refused.

use crate::support::program::Sandbox;
use lightsieve::image::{Encoding, read_image};
use serde_json::Value;

fn stats(sandbox: &Sandbox, name: &str) -> Value {
    serde_json::from_slice(&sandbox.read(name)).unwrap()
}

/// Mean luminance of a picture.
fn mean(sandbox: &Sandbox, name: &str) -> f64 {
    let image = read_image(&sandbox.path(name), Encoding::Auto).unwrap();
    let all = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
    all.map(|(x, y)| f64::from(image.rgb(x, y).luminance())).sum::<f64>() / f64::from(image.width * image.height)
}

#[test]
fn a_resumed_render_with_an_error_target_has_the_same_bits() {
    let sandbox = Sandbox::new();
    for integrator in ["path", "bdpt", "two-stage"] {
        let render = |arguments: &str| {
            let run = sandbox.run(&format!("render scene.xml -i {integrator} --seed 5 --error-target {arguments}"));
            run.expect(0, &["by estimate"]);
        };
        render("relmse=0.0025 -o whole.pfm --stats whole.json");
        let whole = stats(&sandbox, "whole.json");
        let iterations = whole["iterations"].as_u64().unwrap();
        assert!(iterations >= 12, "{integrator}: {iterations} iterations need one estimate alone");
        // Before the first estimate, with halves of unequal size, between two estimates, and when the target is
        // reached.
        for first in [2, 7, 10, iterations] {
            render(&format!("relmse=0.0025 --spp {first} --checkpoint c -o part.pfm"));
            if first < iterations {
                assert_ne!(sandbox.read("part.pfm"), sandbox.read("whole.pfm"), "{integrator}");
            }
            render("relmse=0.0025 --resume c --threads 1 -o resumed.pfm --stats resumed.json");
            assert_eq!(sandbox.read("resumed.pfm"), sandbox.read("whole.pfm"), "{integrator} from {first}");
            let resumed = stats(&sandbox, "resumed.json");
            for key in ["iterations", "error", "non_finite"] {
                assert_eq!(resumed[key], whole[key], "{integrator} from {first}");
            }
        }
    }
}

#[test]
fn a_checkpoint_with_and_one_without_an_error_target_are_told_apart() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --error-target mape=1e-9 --spp 4 --checkpoint halves").expect(0, &[]);
    sandbox.run("render scene.xml --spp 4 --checkpoint plain").expect(0, &[]);
    sandbox.run("render scene.xml --spp 8 --resume halves").expect(2, &["another render", "with an error target"]);
    let target = "render scene.xml --error-target mape=1e-9 --spp 8";
    sandbox.run(&format!("{target} --resume plain")).expect(2, &["another render", "without an error target"]);
    // Another target is another end of the same render.
    sandbox.run("render scene.xml --error-target mse=1e-9 --spp 6 --resume halves").expect(0, &["6 samples"]);
}

#[test]
fn the_pyramid_of_a_render_with_an_error_target_is_that_of_both_halves() {
    let sandbox = Sandbox::new();
    // With halves of equal and of unequal size.
    for spp in [6, 5] {
        let target = format!("--error-target mape=1e-9 --spp {spp} --checkpoint c");
        let pyramid = "--pyramid p --pyramid-depth 5";
        sandbox.run(&format!("render scene.xml -i bdpt {target} {pyramid} -o a.exr --quiet")).expect(0, &[]);
        // All path lengths of the scene are in the pyramid: the weighted pictures sum to the picture.
        let (picture, weighted) = (mean(&sandbox, "a.exr"), mean(&sandbox, "p/weighted.exr"));
        assert!((picture / weighted - 1.0).abs() < 1e-5, "{picture} {weighted}");
    }
}

#[test]
fn a_resumed_pyramid_is_that_of_an_uninterrupted_render() {
    let sandbox = Sandbox::new();
    let render = "render scene.xml -i two-stage -p presampled_paths=100 --quiet --pyramid p --pyramid-depth 3";
    for target in ["", "--error-target mape=1e-9"] {
        let run = |rest: &str| sandbox.run(&format!("{render} {target} {rest}"));
        run("--spp 6 -o whole.pfm").expect(0, &[]);
        let techniques = || (sandbox.read("p/sheet.png"), mean(&sandbox, "p/weighted.exr").to_bits());
        let whole = techniques();
        run("--spp 4 --checkpoint c").expect(0, &[]);
        run("--spp 6 --resume c -o resumed.pfm").expect(0, &[]);
        assert!(techniques() == whole, "{target}");
        assert!(sandbox.read("whole.pfm") == sandbox.read("resumed.pfm"), "{target}");
    }
    sandbox.run("render scene.xml -i bdpt --spp 2 --checkpoint plain").expect(0, &[]);
    sandbox.run("render scene.xml -i bdpt --spp 3 --resume plain --pyramid p").expect(2, &["without a pyramid"]);
    sandbox.run("render scene.xml -i bdpt --spp 2 --checkpoint deep --pyramid p --pyramid-depth 2").expect(0, &[]);
    sandbox.run("render scene.xml -i bdpt --spp 3 --resume deep").expect(2, &["with a pyramid"]);
    sandbox.run("render scene.xml -i bdpt --spp 3 --resume deep --pyramid p").expect(2, &["another depth"]);
}

#[test]
fn a_checkpoint_of_another_backend_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --spp 2 --checkpoint c --query obvhs").expect(0, &[]);
    sandbox.run("render scene.xml --spp 4 --resume c --query obvhs").expect(0, &["4 samples"]);
    if cfg!(any(embree3, embree4)) {
        sandbox.run("render scene.xml --spp 4 --resume c").expect(2, &["another ray-query backend"]);
    }
}

#[test]
fn damaged_checkpoints_are_refused() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -i two-stage --spp 3 --checkpoint c").expect(0, &[]);
    let whole = sandbox.read("c");
    let refused = |what: &str, bytes: &[u8], part: &str| {
        sandbox.write("damaged", bytes);
        sandbox.write("out.pfm", "earlier");
        let run = sandbox.run("render scene.xml -i two-stage --spp 4 --resume damaged -o out.pfm");
        assert!(run.code == Some(2) && run.stderr.contains(part), "{what}: {:?} {}", run.code, run.stderr);
        assert_eq!(sandbox.read("out.pfm"), b"earlier", "{what}");
    };
    let line = whole.iter().position(|&b| b == b'\n').unwrap();
    // One bit anywhere: identity, sums, the integrator's state, the checksum.
    let step = whole.len() / 40;
    for place in (line + 1..whole.len()).step_by(step).chain([whole.len() - 1]) {
        let mut damaged = whole.clone();
        damaged[place] ^= 0x40;
        refused(&format!("bit at {place}"), &damaged, "damaged");
    }
    for length in [whole.len() - 1, whole.len() / 2, line + 1] {
        refused(&format!("cut to {length}"), &whole[..length], "cut short");
    }
    refused("longer", &[&whole[..], b"more"].concat(), "damaged");
    refused("empty", b"", "not a lightsieve checkpoint");
    refused("a picture", b"PF\n1 1\n-1.0\n123456789012", "not a lightsieve checkpoint");
    let other = [b"lightsieve-checkpoint-99", &whole[line..]].concat();
    refused("a later version", &other, "version 99 of the format; this program reads version 4");
    let earlier = b"{\"format\":\"lightsieve-checkpoint-2\",\"integrator\":\"two-stage\"}\n0123456701234567";
    refused("an earlier version", earlier, "version 2 of the format");
}

#[test]
fn a_resumed_render_goes_on_saving_to_its_file() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --spp 2 --checkpoint c").expect(0, &[]);
    sandbox.run("render scene.xml --spp 5 --resume c").expect(0, &["5 samples"]);
    // Nothing is left to render: the file had all five.
    sandbox.run("render scene.xml --spp 5 --resume c -o five.pfm --stats s.json").expect(0, &[]);
    assert!(stats(&sandbox, "s.json")["rays"].as_object().unwrap().is_empty());
    let five = sandbox.read("c");
    sandbox.run("render scene.xml --spp 7 --resume c --checkpoint d").expect(0, &["7 samples"]);
    assert!(sandbox.read("c") == five, "the other file was named");
    sandbox.run("render scene.xml --spp 7 --resume d -o seven.pfm").expect(0, &[]);
    sandbox.run("render scene.xml --spp 7 -o whole.pfm").expect(0, &[]);
    assert!(sandbox.read("seven.pfm") == sandbox.read("whole.pfm"));
}

#[test]
fn a_checkpoint_that_cannot_be_written_at_the_end_goes_to_another_place() {
    let sandbox = Sandbox::new();
    std::os::unix::fs::symlink("/dev/full", sandbox.path("full")).unwrap();
    sandbox.run("render scene.xml --spp 2 --checkpoint full").expect(3, &["full: ", "lightsieve-rescued-"]);
    let names = std::fs::read_dir(sandbox.path("")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    let rescued = names.into_iter().find(|n| n.contains("rescued")).unwrap();
    sandbox.run(&format!("render scene.xml --spp 4 --resume {rescued}")).expect(0, &["4 samples"]);
}
