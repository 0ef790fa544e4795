//! Options that would have no effect are refused, limits of the machine end with a message, and messages stay short.

use crate::support::program::{BOX, Run, Sandbox};
use std::process::{Command, Stdio};

/// Runs `lightsieve` in the sandbox with an address space of so many KiB.
fn run_limited(sandbox: &Sandbox, kib: u64, arguments: &str) -> Run {
    let program = env!("CARGO_BIN_EXE_lightsieve");
    let out = Command::new("sh")
        .current_dir(sandbox.path(""))
        .args(["-c", &format!("ulimit -v {kib} && exec {program} {arguments}")])
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Run { code: out.status.code(), stdout: text(out.stdout), stderr: text(out.stderr) }
}

#[test]
fn options_without_effect_are_refused() {
    let sandbox = Sandbox::new();
    for (options, part) in [
        ("-o a.pfm --camera-origin 0,0,0", "options for the camera have no effect"),
        ("-o a.pfm --camera-fov 20", "options for the camera have no effect"),
        ("-o a.pfm --aov albedo", "--aov has no effect without an EXR file"),
        ("-o a.pfm -o a.exr --exposure 1", "--exposure has no effect without a PNG file"),
        ("-o a.png --exposure nan", "expected a number of stops"),
        ("-o a.png --exposure inf", "expected a number of stops"),
        ("-o a.pfm --pyramid-depth 3", "--pyramid"),
        ("-o a.pfm --checkpoint-interval 3s", "--checkpoint-interval has no effect"),
        ("-o a.pfm --require-error-target", "--error-target"),
        ("", "nothing of the render would be kept: name an output file"),
    ] {
        sandbox.run(&format!("render scene.xml --spp 1000000000 {options}")).expect(2, &[part]);
    }
    // Each kind of output is something to keep.
    for (i, output) in ["--stats s.json", "--checkpoint c", "--resume c", "--pyramid p -i bdpt"].iter().enumerate() {
        sandbox.run(&format!("render scene.xml --spp {} {output}", i + 1)).expect(0, &[]);
    }
    sandbox.run("info scene.xml --camera-fov 20").expect(2, &["options for the camera have no effect"]);
    sandbox.write("model.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    sandbox.run("info model.obj --camera-fov 20").expect(0, &[]);
}

#[test]
fn an_error_target_that_is_not_reached_is_said_and_has_a_code() {
    let sandbox = Sandbox::new();
    let render = |rest: &str| sandbox.run(&format!("render scene.xml -o a.pfm --spp 8 {rest}"));
    render("--error-target relmse=1e-9").expect(0, &["(target 1.0000e-9): not reached"]);
    render("--error-target relmse=1e-9 --require-error-target").expect(1, &["was not reached"]);
    let run = render("--error-target relmse=1e9 --require-error-target").expect(0, &["by estimate"]);
    assert!(!run.stderr.contains("not reached"), "{}", run.stderr);
    // Too few iterations for an estimate.
    sandbox
        .run("render scene.xml -o a.pfm --spp 1 --error-target mse=1 --require-error-target")
        .expect(1, &["not known"]);
}

#[test]
fn a_time_for_one_iteration_only_is_said() {
    let sandbox = Sandbox::new();
    let said = "a single iteration takes";
    sandbox.run("render scene.xml -o a.pfm --time 1ms --size 256x256").expect(0, &["1 samples per pixel", said]);
    let more = sandbox.run("render scene.xml -o a.pfm --time 300ms").expect(0, &[]);
    assert!(!more.stderr.contains(said), "{}", more.stderr);
    assert!(!sandbox.run("render scene.xml -o a.pfm --spp 1").stderr.contains(said));
}

#[test]
fn memory_and_threads_that_cannot_be_had_are_refused_before_the_render() {
    let sandbox = Sandbox::new();
    let film = "render scene.xml --threads 2 -o a.pfm --spp 1 --size";
    run_limited(&sandbox, 4_000_000, &format!("{film} 20000x20000"))
        .expect(2, &["20000 x 20000 pixels needs at least", "GiB"]);
    run_limited(&sandbox, 4_000_000, &format!("{film} 3000x3000 -i bdpt --pyramid p --pyramid-depth 32"))
        .expect(2, &["with a pyramid of techniques needs at least"]);
    run_limited(&sandbox, 4_000_000, &format!("{film} 8x8")).expect(0, &[]);
    sandbox.run(&format!("{film} 100000x100000")).expect(2, &["100000 x 100000 pixels is too large"]);
    let paths = "render scene.xml --threads 2 -o a.pfm --spp 1 -i ris -p presampled_paths=10000000";
    run_limited(&sandbox, 3_000_000, paths).expect(2, &["ris with 10000000 light sub-paths", "needs at least", "GiB"]);
    let threads = "render scene.xml -o a.pfm --spp 1 --threads";
    run_limited(&sandbox, 600_000, &format!("{threads} 4096")).expect(2, &["4096 threads", "GiB of memory"]);
    run_limited(&sandbox, 4_000_000, &format!("{threads} 16")).expect(0, &[]);
    run_limited(&sandbox, 4_000_000, "converge scene.xml -i path --size 20000x20000").expect(2, &["needs at least"]);
}

#[test]
fn narrow_films_are_rendered() {
    let sandbox = Sandbox::new();
    for size in ["1x1", "1x4096", "4096x1"] {
        for integrator in ["path", "bdpt", "two-stage"] {
            sandbox.run(&format!("render scene.xml -i {integrator} --spp 2 --size {size} -o a.pfm")).expect(0, &[]);
            let picture = sandbox.read("a.pfm");
            let (width, height) = size.split_once('x').unwrap();
            assert!(picture.starts_with(format!("PF\n{width} {height}\n").as_bytes()), "{integrator} {size}");
        }
    }
}

#[test]
fn very_many_messages_are_counted_and_long_lines_clipped() {
    let sandbox = Sandbox::new();
    let unknown: String = (0..1000).map(|i| format!("<float name=\"unknown{i}\" value=\"1\"/>")).collect();
    sandbox.write(
        "many.xml",
        BOX.replacen("<sensor type=\"perspective\">", &format!("<sensor type=\"perspective\">{unknown}"), 1),
    );
    let run = sandbox
        .run("render many.xml -o a.pfm --spp 1")
        .expect(0, &["unknown0", "980 more of this kind", "1000 warnings"]);
    assert!(run.stderr.len() < 20_000, "{} bytes of messages", run.stderr.len());
    assert!(!run.stderr.contains("unknown500"));
    // The name of a property may be as long as one likes.
    let long = "x".repeat(100_000);
    sandbox.write_box_with("long.xml", "name=\"fov\"", &format!("name=\"{long}\""));
    let run = sandbox.run("render long.xml -o a.pfm --spp 1").expect(0, &["unknown-property", "long.xml:8:22"]);
    assert!(run.stderr.len() < 3000, "{} bytes of messages", run.stderr.len());
}
