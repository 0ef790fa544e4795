//! Outputs and inputs as files: nothing overwrites an input or another output, a picture that cannot be written in its
//! place is written to another, standard output that cannot be written is a failure, and devices and pipes are refused.

use crate::support::program::{BOX, Sandbox};
use std::process::{Command, Stdio};

/// A render that would take hours, so that a test shows that something is refused before it.
const ENDLESS: &str = "--spp 1000000000";

/// Runs a command that must be refused with exit code 2 and leave the file as it is.
#[track_caller]
fn refused(sandbox: &Sandbox, kept: &str, command: &str, parts: &[&str]) {
    let before = std::fs::read(sandbox.path(kept)).ok();
    sandbox.run(command).expect(2, parts);
    assert_eq!(std::fs::read(sandbox.path(kept)).ok(), before, "{kept} was touched by {command}");
}

/// The box with a texture, a mesh and an include.
fn with_inputs() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --spp 1 -o texture.pfm").expect(0, &[]);
    sandbox.write("plate.ply", PLATE);
    let shape = "<shape type=\"ply\"><string name=\"filename\" value=\"plate.ply\"/></shape>";
    sandbox.write("part.xml", format!("<scene version=\"3.0.0\">{shape}</scene>"));
    let texture =
        "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"texture.pfm\"/></texture>";
    let scene = BOX.replace("<rgb name=\"reflectance\" value=\"$red, 0.5, 0.4\"/>", texture);
    sandbox.write("scene.xml", scene.replace("</scene>", "<include filename=\"part.xml\"/></scene>"));
    sandbox
}

const PLATE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 -1 -1\n1 -1 -1\n1 1 -1\n3 0 1 2\n";

#[test]
fn no_output_replaces_an_input() {
    let sandbox = with_inputs();
    sandbox.run("render scene.xml --spp 1 -o out.pfm").expect(0, &[]);
    std::os::unix::fs::symlink("scene.xml", sandbox.path("link.xml")).unwrap();
    std::fs::hard_link(sandbox.path("texture.pfm"), sandbox.path("hard.pfm")).unwrap();
    let render = |rest: &str| format!("render scene.xml {ENDLESS} {rest}");
    for (kept, outputs) in [
        ("scene.xml", "-o a.pfm --stats scene.xml"),
        ("scene.xml", "-o a.pfm --checkpoint scene.xml"),
        ("scene.xml", "-o a.pfm --stats ./link.xml"),
        ("part.xml", "-o a.pfm --stats part.xml"),
        ("plate.ply", "-o a.pfm --checkpoint plate.ply"),
        ("texture.pfm", "-o texture.pfm"),
        ("texture.pfm", "-o hard.pfm"),
    ] {
        refused(&sandbox, kept, &render(outputs), &["would replace the input"]);
        assert!(!sandbox.path("a.pfm").exists());
    }
    sandbox.run("render scene.xml --spp 1 --checkpoint saved").expect(0, &[]);
    refused(&sandbox, "saved", &render("--resume saved --stats saved"), &["would replace the input saved"]);
    // Going on from a checkpoint and saving to it is no loss.
    sandbox.run("render scene.xml --spp 2 --resume saved --checkpoint saved").expect(0, &[]);
    sandbox.run("render part.xml --spp 2 --print-config --stats plate.ply").expect(2, &[]);
}

#[test]
fn outputs_are_different_files() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("folder")).unwrap();
    for outputs in [
        "-o x.pfm --stats x.pfm",
        "-o x.pfm --checkpoint ./folder/../x.pfm",
        "--stats x --checkpoint x",
        "-o p/sheet.png --pyramid p -i bdpt",
    ] {
        let command = format!("render scene.xml {ENDLESS} {outputs}");
        refused(&sandbox, "x.pfm", &command, &["one would replace the other"]);
    }
    sandbox.run("render scene.xml --spp 1 -o a.pfm -o a.pfm -o a.exr").expect(0, &["wrote a.pfm"]);
    sandbox.run("render scene.xml --spp 1 --stats /dev/null --checkpoint /dev/null").expect(0, &[]);
}

#[test]
fn measuring_commands_replace_no_input() {
    let sandbox = Sandbox::new();
    for seed in 0..2 {
        sandbox.run(&format!("render scene.xml --spp 1 --seed {seed} -o {seed}.exr")).expect(0, &[]);
    }
    refused(&sandbox, "0.exr", "compare 0.exr 1.exr --error-image 0.exr", &["--error-image would replace"]);
    refused(&sandbox, "1.exr", "merge 0.exr 1.exr -o ./1.exr", &["-o would replace"]);
    sandbox.write("model.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    refused(&sandbox, "model.obj", "info model.obj --skeleton model.obj", &["--skeleton would replace"]);
    std::fs::create_dir(sandbox.path("report")).unwrap();
    sandbox.write("report/index.html", BOX);
    std::os::unix::fs::symlink("report/index.html", sandbox.path("linked.xml")).unwrap();
    for command in ["converge linked.xml --report report", "profile linked.xml --report report -i path"] {
        refused(&sandbox, "report/index.html", command, &["--report would replace"]);
    }
    sandbox.write("old.json", "{\"rows\": []}");
    refused(&sandbox, "old.json", "bench . --against old.json --save old.json", &["--save would replace"]);
}

#[test]
fn names_are_tried_before_the_render() {
    let sandbox = Sandbox::new();
    // The folder can be written, the name cannot.
    let long = format!("{}.pfm", "n".repeat(300));
    let run = sandbox.run(&format!("render scene.xml {ENDLESS} -o {long}"));
    run.expect(3, &["cannot be written", "too long"]);
    sandbox.run(&format!("render scene.xml {ENDLESS} -i bdpt --pyramid scene.xml/p")).expect(3, &["cannot be written"]);
    sandbox.run("converge scene.xml --report scene.xml/p").expect(3, &["cannot be written"]);
    // Nothing is left of a trial.
    sandbox.run("render scene.xml -o a.pfm -i pathh").expect(2, &[]);
    let left: Vec<_> = std::fs::read_dir(sandbox.path("")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["scene.xml"]);
}

#[test]
fn a_picture_that_cannot_be_written_goes_to_another_place() {
    let sandbox = Sandbox::new();
    for name in ["full.pfm", "full.exr"] {
        std::os::unix::fs::symlink("/dev/full", sandbox.path(name)).unwrap();
    }
    let run = sandbox.run("render scene.xml -o full.pfm -o full.exr -o good.pfm --quiet");
    let run = run.expect(3, &["full.pfm: ", "full.exr: ", "No space left"]);
    assert_eq!(run.stderr.matches("its contents were written to").count(), 2, "{}", run.stderr);
    let rescued = |ending: &str| {
        let entries = std::fs::read_dir(sandbox.path("")).unwrap().map(|e| e.unwrap().file_name());
        let mut found =
            entries.map(|n| n.into_string().unwrap()).filter(|n| n.ends_with(ending) && n.contains("rescued"));
        found.next().unwrap_or_else(|| panic!("no file ends in {ending}"))
    };
    assert_eq!(sandbox.read(&rescued("full.pfm")), sandbox.read("good.pfm"));
    assert!(run.stderr.contains(&rescued("full.exr")), "{}", run.stderr);
}

#[test]
fn a_full_standard_output_is_a_failure() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -o a.pfm").expect(0, &[]);
    for command in [
        "list",
        "list -i path",
        "info scene.xml",
        "compare a.pfm a.pfm",
        "compare a.pfm a.pfm --json",
        "check-rays scene.xml --rays 10 --json",
        "render scene.xml --print-config",
        "replay scene.xml --pixel 1,1",
        "--help",
        "render --help",
        "--version",
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let run = Command::new(env!("CARGO_BIN_EXE_lightsieve"))
            .current_dir(sandbox.path(""))
            .args(command.split_whitespace())
            .stdin(Stdio::null())
            .stdout(full)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(3), "{command}: {said}");
        assert!(said.contains("standard output") && said.contains("No space left"), "{command}: {said}");
    }
}

#[test]
fn devices_and_pipes_are_refused_by_every_reader() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -o a.pfm").expect(0, &[]);
    for name in ["pipe.xml", "pipe.obj", "pipe.ply", "pipe.pfm", "pipe.mtl", "pipe.serialized", "pipe.spd", "pipe"] {
        assert!(Command::new("mkfifo").arg(sandbox.path(name)).status().unwrap().success());
    }
    for ending in ["xml", "obj", "ply"] {
        std::os::unix::fs::symlink("/dev/zero", sandbox.path(format!("zero.{ending}"))).unwrap();
        for name in ["pipe", "zero"] {
            sandbox.run(&format!("info {name}.{ending}")).expect(3, &["not a regular file"]);
        }
    }
    let shape = |kind: &str| format!("<shape type=\"{kind}\"><string name=\"filename\" value=\"pipe.{kind}\"/>");
    for kind in ["obj", "ply", "serialized"] {
        sandbox.write_box_with("mesh.xml", "<shape type=\"cube\">", &shape(kind));
        sandbox.run("info mesh.xml").expect(3, &["not a regular file"]);
    }
    sandbox.write_box_with(
        "include.xml",
        "<bsdf type=\"twosided\"",
        "<include filename=\"pipe.xml\"/><bsdf type=\"twosided\"",
    );
    sandbox.run("info include.xml").expect(3, &["not a regular file"]);
    let spectrum = "<spectrum name=\"radiance\" filename=\"pipe.spd\"/>";
    sandbox.write_box_with("spectrum.xml", "<rgb name=\"radiance\" value=\"5, 4, 3\"/>", spectrum);
    sandbox.run("info spectrum.xml").expect(3, &["not a regular file"]);
    let texture =
        "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"pipe.pfm\"/></texture>";
    sandbox.write_box_with("texture.xml", "<rgb name=\"reflectance\" value=\"$red, 0.5, 0.4\"/>", texture);
    sandbox.run("info texture.xml --strict").expect(3, &["not a regular file"]);
    sandbox.write("m.obj", "mtllib pipe.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    sandbox.run("info m.obj").expect(0, &["not a regular file"]);
    sandbox.run("compare pipe.pfm a.pfm").expect(3, &["not a regular file"]);
    sandbox.run("merge pipe pipe.pfm -o b.pfm").expect(3, &["not a regular file"]);
    sandbox.run("render scene.xml --resume pipe").expect(3, &["not a regular file"]);
    sandbox.run("render scene.xml --resume /dev/zero").expect(3, &["not a regular file"]);
    sandbox.run("bench . --against pipe").expect(3, &["not a regular file"]);
}
