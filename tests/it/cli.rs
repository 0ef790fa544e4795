//! Every command from outside, with small scenes: what is written, what is printed, what the exit code says.

use crate::support::program::{BOX, Process, Run, Sandbox};
use lightsieve::image::{Encoding, Image, read_image};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

fn image(sandbox: &Sandbox, name: &str) -> Image {
    read_image(&sandbox.path(name), Encoding::Auto).unwrap()
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

/// A number of the statistics file.
fn stats(sandbox: &Sandbox, name: &str) -> serde_json::Value {
    json(std::str::from_utf8(&sandbox.read(name)).unwrap())
}

fn keys(object: &serde_json::Value) -> BTreeSet<&str> {
    object.as_object().unwrap().keys().map(String::as_str).collect()
}

/// Runs `lightsieve render scene.xml` with nothing to complain about.
#[track_caller]
fn render(sandbox: &Sandbox, arguments: &str) -> Run {
    sandbox.run(&format!("render scene.xml {arguments}")).expect(0, &[])
}

#[test]
fn every_format_holds_the_same_picture() {
    let sandbox = Sandbox::new();
    let run = render(&sandbox, "-o a.exr -o a.pfm -o a.png -o b.PNG --exposure 0");
    assert!(run.stdout.is_empty());
    for name in ["a.exr", "a.pfm", "a.png", "b.PNG"] {
        assert!(run.stderr.contains(&format!("wrote {name}")), "{}", run.stderr);
    }
    assert!(run.stderr.contains("4 samples per pixel"), "{}", run.stderr);
    let [exr, pfm, png] = ["a.exr", "a.pfm", "a.png"].map(|n| image(&sandbox, n));
    assert_eq!(sandbox.read("a.png"), sandbox.read("b.PNG"));
    assert_eq!((exr.width, exr.height), (16, 16));
    let mut sum = 0.0;
    for y in 0..16 {
        for x in 0..16 {
            let (e, p, g) = (exr.rgb(x, y), pfm.rgb(x, y), png.rgb(x, y));
            assert_eq!(e.to_array().map(f32::to_bits), p.to_array().map(f32::to_bits));
            // Half a step of eight bits is largest where sRGB is steepest against linear: 2.4 / 2 / 255 near white.
            for (a, b) in p.to_array().into_iter().zip(g.to_array()) {
                assert!((a.min(1.0) - b).abs() < 0.005, "{a} {b}");
            }
            sum += e.g;
        }
    }
    assert!(sum / 256.0 > 0.05, "the box is lit: mean {}", sum / 256.0);
}

#[test]
fn exposure_brightens_png_only() {
    let sandbox = Sandbox::new();
    render(&sandbox, "-o a.pfm -o a.png");
    render(&sandbox, "-o b.pfm -o b.png --exposure -2");
    assert_eq!(sandbox.read("a.pfm"), sandbox.read("b.pfm"));
    let (a, b) = (image(&sandbox, "a.png"), image(&sandbox, "b.png"));
    for y in 0..16 {
        for x in 0..16 {
            let (a, b) = (a.rgb(x, y).g, b.rgb(x, y).g);
            assert!(a >= 1.0 || (a / 4.0 - b).abs() < 0.005, "{a} {b}");
        }
    }
}

#[test]
fn statistics_have_their_keys() {
    let sandbox = Sandbox::new();
    render(&sandbox, "--stats s.json --spp 3 --seed 9 --threads 2");
    let s = stats(&sandbox, "s.json");
    let contract = [
        "iterations",
        "wall_s",
        "cpu_s",
        "phases",
        "rays",
        "rays_per_s",
        "ray_query_share",
        "peak_rss_bytes",
        "non_finite",
        "seed",
        "threads",
        "backend",
        "scene",
    ];
    let beside = ["blocked", "ns_per_ray", "non_finite_at", "invalid_rays", "integrator", "version"];
    assert_eq!(keys(&s), contract.into_iter().chain(beside).collect());
    assert_eq!(keys(&s["scene"]), BTreeSet::from(["triangles", "emitters", "textures", "features"]));
    for (key, value) in [("iterations", 3), ("non_finite", 0), ("invalid_rays", 0), ("seed", 9), ("threads", 2)] {
        assert_eq!(s[key], value, "{key}");
    }
    assert_eq!((&s["scene"]["triangles"], &s["scene"]["emitters"]), (&json("14"), &json("2")));
    assert_eq!((&s["scene"]["textures"], &s["scene"]["features"]), (&json("0"), &json("[\"area-lights\"]")));
    assert_eq!(s["integrator"], "path");
    let number = |v: &serde_json::Value| v.as_f64().unwrap_or_else(|| panic!("{v} is no number"));
    let share = number(&s["ray_query_share"]);
    assert!(share > 0.0 && share <= 1.0, "{share}");
    assert!(number(&s["peak_rss_bytes"]) > 1e6);
    assert!(number(&s["cpu_s"]) >= 0.0);
    let rays: f64 = s["rays"].as_object().unwrap().values().map(number).sum();
    assert_eq!(number(&s["rays"]["camera"]), 3.0 * 256.0);
    assert!((number(&s["rays_per_s"]) * number(&s["wall_s"]) / rays - 1.0).abs() < 1e-6);
    assert_eq!(number(&s["phases"]["render"]), number(&s["wall_s"]));
    assert!(["load", "prepare", "output"].iter().all(|p| number(&s["phases"][p]) > 0.0));
}

#[test]
fn layers_are_in_the_exr() {
    use exr::prelude::*;
    let sandbox = Sandbox::new();
    render(&sandbox, "-o a.exr --aov albedo,normal,depth");
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let file = reader.from_file(sandbox.path("a.exr")).unwrap();
    // Names with dots: readers may show them as layers, the file has them as channels.
    let channels: Vec<(String, Vec<f32>)> = file
        .layer_data
        .iter()
        .flat_map(|layer| {
            let prefix = layer.attributes.layer_name.as_ref().map_or(String::new(), |n| format!("{n}."));
            layer
                .channel_data
                .list
                .iter()
                .map(move |c| (format!("{prefix}{}", c.name), c.sample_data.values_as_f32().collect()))
        })
        .collect();
    let channel =
        |name: &str| &channels.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no channel {name}")).1;
    let centre = 8 * 16 + 8;
    // The middle of the picture is the back wall, 1.9 away and facing the camera.
    for (name, expected) in [
        ("albedo.R", 0.6),
        ("albedo.G", 0.5),
        ("albedo.B", 0.4),
        ("normal.X", 0.0),
        ("normal.Y", 0.0),
        ("normal.Z", 1.0),
    ] {
        assert!((channel(name)[centre].abs() - expected).abs() < 1e-3, "{name}: {}", channel(name)[centre]);
    }
    let depth = channel("depth.Z")[centre];
    assert!((1.9..1.92).contains(&depth), "{depth}");
    for name in ["R", "G", "B", "variance.R", "variance.G", "variance.B"] {
        assert_eq!(channel(name).len(), 256, "{name}");
    }
    assert!(channel("variance.G").iter().any(|&v| v > 0.0));

    render(&sandbox, "-o b.exr --aov depth");
    let text = String::from_utf8_lossy(&sandbox.read("b.exr")).into_owned();
    assert!(text.contains("depth") && !text.contains("albedo"));
    assert!(text.contains("lightsieve:seed"), "metadata");
}

#[test]
fn the_configuration_is_printed() {
    let sandbox = Sandbox::new();
    let print = |more: &str| {
        let run = render(&sandbox, &format!("--print-config {more}"));
        assert!(run.stderr.is_empty(), "{}", run.stderr);
        run.stdout.lines().map(str::to_owned).collect::<BTreeSet<_>>()
    };
    let has = |lines: &BTreeSet<String>, wanted: &[&str]| {
        for line in wanted {
            assert!(lines.contains(*line), "\"{line}\" is not in {lines:?}");
        }
    };
    has(
        &print("--threads 3"),
        &["scene = scene.xml", "integrator = path", "max_depth = 5", "spp = 4", "seed = 0", "threads = 3"],
    );
    // The command line wins over the scene, and -p over its short forms.
    has(
        &print("--max-depth 3 --spp 9 --seed 7 -p heuristic=balance"),
        &["max_depth = 3", "spp = 9", "seed = 7", "heuristic = balance"],
    );
    has(&print("--max-depth 3 -p max_depth=2"), &["max_depth = 2"]);
    let timed = print("--time 1.5m");
    has(&timed, &["time = 90s"]);
    assert!(!timed.iter().any(|l| l.starts_with("spp")), "a time budget replaces the scene's samples: {timed:?}");
    assert!(!sandbox.path("out.exr").exists());
}

#[test]
fn integrators_are_listed() {
    let sandbox = Sandbox::new();
    let run = sandbox.run("list").expect(0, &[]);
    for spec in lightsieve::integrators::REGISTRY {
        assert!(run.stdout.lines().any(|l| l.starts_with(spec.name) && l.ends_with(spec.short)), "{}", run.stdout);
        let one = sandbox.run(&format!("list -i {}", spec.name)).expect(0, &[]).stdout;
        assert!(one.contains(spec.short));
        let table: Vec<&str> = one.lines().skip_while(|l| !l.contains("PARAMETER")).collect();
        let column = |head: &str| table[0].find(head).unwrap();
        let long = sandbox.run(&format!("list -i {} --long", spec.name)).expect(0, &[]).stdout;
        assert!(long.lines().all(|l| l.chars().count() <= 110), "{long}");
        // Lines are broken anywhere between words.
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let long = words(&long);
        assert!(long.contains(&words(spec.long)));
        for p in spec.params() {
            let row = table.iter().find(|l| l.trim_start().starts_with(&format!("{} ", p.name)));
            let row: Vec<char> = row.unwrap_or_else(|| panic!("{} {}", spec.name, p.name)).chars().collect();
            let from = |head: &str| row[column(head)..].iter().collect::<String>();
            assert!(from("DEFAULT").starts_with(&format!("{} ", p.default_text())), "{} {}", spec.name, p.name);
            assert_eq!(from("MEANING"), p.short, "{} {}", spec.name, p.name);
            assert!(long.contains(&words(p.long)), "{} {}", spec.name, p.name);
        }
    }
}

#[test]
fn earlier_names_of_parameters_work_and_are_noted_once() {
    let sandbox = Sandbox::new();
    let config = |options: &str| {
        sandbox.run(&format!("render scene.xml -o out.exr --print-config -i two-stage {options}")).expect(0, &[])
    };
    let earlier = config("-p skip=never -p keep=60 -p paths=0 -p metric=plain");
    let present = config("-p allocation=full -p rr_scale=60% -p presampled_paths=auto -p metric=position");
    assert_eq!(earlier.stdout, present.stdout);
    assert!(present.stdout.contains("rr_scale = 0.6\n"), "{}", present.stdout);
    assert!(!present.stderr.contains("now"), "{}", present.stderr);
    for note in ["`skip` is now called `allocation`", "`rr_scale=0.6`", "`presampled_paths=auto`", "`metric=position`"]
    {
        assert_eq!(earlier.stderr.matches(note).count(), 1, "{note}: {}", earlier.stderr);
    }
    assert!(!config("-p skip=never --quiet").stderr.contains("now"));
    sandbox.run("render scene.xml -o out.exr --print-config -i ris -p keep=0").expect(2, &["keep = 0", "rr_scale"]);
    // In the scene's own block, with its place.
    sandbox.write_box_with(
        "old.xml",
        "<integrator type=\"path\">",
        "<integrator type=\"ris\"><integer name=\"keep\" value=\"50\"/>",
    );
    let scene = sandbox.run("render old.xml -o out.exr --print-config").expect(0, &["`rr_scale=0.5`", "old.xml:"]);
    assert!(scene.stdout.contains("rr_scale = 0.5\n"), "{}", scene.stdout);
    // A measurement of several scenes says it once for all of them.
    let measured = sandbox
        .run("converge scene.xml old.xml -i bdpt:skip=never --cache cache --reference-spp 2 --time 30ms --seeds 1");
    assert_eq!(measured.expect(0, &[]).stderr.matches("`skip` is now called").count(), 1);
}

#[test]
fn a_checkpoint_is_resumed_by_earlier_names() {
    let sandbox = Sandbox::new();
    render(&sandbox, "-i ris --spp 1 --checkpoint c -p rr_scale=0.6");
    render(&sandbox, "-i ris --spp 2 --resume c -p keep=60 -o resumed.pfm");
    render(&sandbox, "-i ris --spp 2 -p rr_scale=0.6 -o whole.pfm");
    assert_eq!(std::fs::read(sandbox.path("resumed.pfm")).unwrap(), std::fs::read(sandbox.path("whole.pfm")).unwrap());
    sandbox.run("render scene.xml -i ris --spp 2 --resume c -p keep=61").expect(2, &["other parameters"]);
}

#[test]
fn info_writes_the_skeleton() {
    let sandbox = Sandbox::new();
    let run =
        sandbox.run("info scene.xml --skeleton s.ply --skeleton-image s.png --voxel-resolution 30").expect(0, &[]);
    let row = run.stdout.lines().find_map(|l| l.strip_prefix("skeleton")).unwrap_or_default().trim();
    let nodes: usize = row.split(' ').next().and_then(|n| n.parse().ok()).unwrap();
    let ply = std::fs::read_to_string(sandbox.path("s.ply")).unwrap();
    assert!(nodes > 0 && ply.contains(&format!("element vertex {nodes}\n")), "{row}");
    sandbox.run("info scene.xml --skeleton s.obj").expect(0, &[]);
    let obj = std::fs::read_to_string(sandbox.path("s.obj")).unwrap();
    assert!(obj.lines().any(|l| l.starts_with("v ")));
    for bad in ["--skeleton s.stl", "--skeleton s", "--skeleton-image s.ply"] {
        sandbox.run(&format!("info scene.xml {bad}")).expect(2, &["known:"]);
    }
    sandbox.run("info scene.xml --skeleton no/such/folder/s.ply").expect(3, &["cannot be written"]);
}

#[test]
fn info_counts() {
    let run = Sandbox::new().run("info scene.xml").expect(0, &[]);
    let row =
        |key: &str| run.stdout.lines().find_map(|l| l.strip_prefix(key)).unwrap_or_else(|| panic!("{key}")).trim();
    assert_eq!(row("meshes"), "2");
    assert!(row("triangles").starts_with("14 "));
    assert!(row("lights").starts_with("2 "));
    assert_eq!(row("features"), "area-lights");
    assert!(row("camera").contains("field of view 60.00 degrees, film 16 x 16"));
    assert_eq!(row("integrator"), "path max_depth=5");
}

#[test]
fn backends_agree_on_rays() {
    let sandbox = Sandbox::new();
    let run = sandbox.run("check-rays scene.xml --rays 3000 --json").expect(0, &[]);
    let rows = json(&run.stdout);
    assert!(!rows.as_object().unwrap().is_empty());
    for (name, row) in rows.as_object().unwrap() {
        assert_eq!(row["rays"], 3000, "{name}");
        // Inside a closed box every ray meets a wall.
        assert_eq!(
            (&row["both_hit"], &row["hit_or_miss"], &row["packet"]),
            (&json("3000"), &json("0"), &json("0")),
            "{name}"
        );
    }
    assert!(sandbox.run("check-rays scene.xml --rays 100").expect(0, &[]).stdout.contains("disagreement"));
}

#[test]
fn pictures_are_compared() {
    let sandbox = Sandbox::new();
    render(&sandbox, "-o a.pfm -o a.exr");
    render(&sandbox, "-o b.pfm --seed 1");
    render(&sandbox, "-o small.pfm --size 8x8");
    let compare = |files: &str| json(&sandbox.run(&format!("compare --json {files}")).expect(0, &[]).stdout);
    let same = compare("a.pfm a.exr");
    assert_eq!(same["z_test"]["worst"], 0.0);
    for (key, value) in same.as_object().unwrap().iter().filter(|(k, _)| *k != "z_test") {
        assert_eq!(value.as_f64(), Some(if key == "mean_ratio" { 1.0 } else { 0.0 }), "{key}");
    }
    let other = compare("b.pfm a.pfm");
    for key in ["mse", "rmse", "mae", "mape", "relmse", "relmse_trimmed", "flip", "hdr_flip"] {
        assert!(other[key].as_f64().unwrap() > 0.0, "{key}");
    }
    let text = sandbox.run("compare b.pfm a.pfm").expect(0, &[]).stdout;
    let row = text.lines().find(|l| l.starts_with("relMSE ")).unwrap();
    let shown: f64 = row.split_whitespace().nth(1).unwrap().parse().unwrap();
    // Five digits, without a power of ten.
    assert!((shown / other["relmse"].as_f64().unwrap() - 1.0).abs() < 1e-4, "{text}");
    assert!(!row.split_whitespace().nth(1).unwrap().contains('e'), "{text}");
    sandbox.run("compare small.pfm a.pfm").expect(2, &["8 x 8", "16 x 16"]);
}

/// All integrators, and one whose pixels share light sub-paths.
fn integrators() -> impl Iterator<Item = &'static str> {
    let shared = "bdpt -p light_paths=1/4 -p connections=1/2";
    lightsieve::integrators::REGISTRY.iter().map(|s| s.name).chain([shared])
}

#[test]
fn same_seed_same_bits_for_any_number_of_threads() {
    let sandbox = Sandbox::new();
    for i in integrators() {
        // Several tiles, the last ones narrow.
        for threads in [1, 2, 7] {
            render(
                &sandbox,
                &format!("-i {i} -o {threads}.pfm -o {threads}.exr --size 40x24 --spp 3 --seed 5 --threads {threads}"),
            );
        }
        for threads in [2, 7] {
            assert_eq!(sandbox.read("1.pfm"), sandbox.read(&format!("{threads}.pfm")), "{i}, {threads} threads");
        }
        render(&sandbox, &format!("-i {i} -o other.pfm --size 40x24 --spp 3 --seed 6"));
        assert_ne!(sandbox.read("1.pfm"), sandbox.read("other.pfm"));
    }
}

#[test]
fn both_backends_make_the_same_picture() {
    let sandbox = Sandbox::new();
    render(&sandbox, "-o default.pfm --spp 16");
    render(&sandbox, "-o obvhs.pfm --spp 16 --query obvhs --stats s.json");
    assert!(stats(&sandbox, "s.json")["backend"].as_str().unwrap().contains("obvhs"));
    let report = json(&sandbox.run("compare --json obvhs.pfm default.pfm").expect(0, &[]).stdout);
    // With equal random numbers, paths are equal but where a hit's last bits send one elsewhere.
    let (ratio, mape) = (report["mean_ratio"].as_f64().unwrap(), report["mape"].as_f64().unwrap());
    assert!((ratio - 1.0).abs() < 1e-2 && mape < 1e-2, "{report}");
}

#[test]
fn a_resumed_render_has_the_same_bits() {
    let sandbox = Sandbox::new();
    for i in integrators() {
        let render = |arguments: &str| render(&sandbox, &format!("-i {i} --size 20x18 {arguments}"));
        render("-o whole.pfm --spp 8");
        // Some decide after their second iteration.
        for first in [1, 4] {
            render(&format!("-o half.pfm --spp {first} --checkpoint c"));
            assert_ne!(sandbox.read("half.pfm"), sandbox.read("whole.pfm"), "{i}");
            render("-o resumed.pfm --spp 8 --resume c --checkpoint d --threads 1 --stats s.json");
            assert_eq!(sandbox.read("resumed.pfm"), sandbox.read("whole.pfm"), "{i}");
            assert_eq!(stats(&sandbox, "s.json")["iterations"], 8);
        }
        // All is done: nothing is traced, the picture is written.
        render("-o done.pfm --spp 8 --resume d");
        assert_eq!(sandbox.read("done.pfm"), sandbox.read("whole.pfm"), "{i}");
    }
}

#[test]
fn a_checkpoint_of_another_render_is_refused() {
    let sandbox = Sandbox::new();
    render(&sandbox, "--spp 2 --checkpoint c");
    let refused = |arguments: &str, code: i32, part: &str| {
        sandbox.write("out.pfm", "earlier");
        sandbox.run(&format!("render {arguments} -o out.pfm")).expect(code, &[part]);
        assert_eq!(sandbox.read("out.pfm"), b"earlier");
    };
    refused("scene.xml --resume c --seed 1", 2, "another seed");
    refused("scene.xml --resume c --size 8x8", 2, "another picture size");
    refused("scene.xml --resume c --crop 0,0,4,4", 2, "another crop window");
    refused("scene.xml --resume c --max-depth 2", 2, "other parameters");
    for (what, from, to) in [
        ("material", "$red, 0.5", "0.6, 0.4"),
        ("geometry", "<scale value=\"0.4\"/>", "<scale value=\"0.41\"/>"),
        ("lamp", "\"5, 4, 3\"", "\"5, 4, 2\""),
        ("camera", "\"fov\" value=\"60\"", "\"fov\" value=\"61\""),
        ("filter", "<film type=\"hdrfilm\">", "<film type=\"hdrfilm\"><rfilter type=\"box\"/>"),
    ] {
        sandbox.write_box_with(&format!("{what}.xml"), from, to);
        refused(&format!("{what}.xml --resume c"), 2, "another scene");
    }
    let whole = sandbox.read("c");
    sandbox.write("cut", &whole[..whole.len() - 1]);
    refused("scene.xml --resume cut", 2, "cut short");
    refused("scene.xml --resume scene.xml", 2, "not a lightsieve checkpoint");
    refused("scene.xml --resume none", 3, "none");
}

#[test]
fn other_pixels_of_a_texture_are_another_scene() {
    let sandbox = Sandbox::new();
    let texture = "<texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"t.ppm\"/></texture>";
    sandbox.write_box_with("scene.xml", "<rgb name=\"reflectance\" value=\"$red, 0.5, 0.4\"/>", texture);
    // An equal mean, in another order.
    sandbox.write("t.ppm", "P3 2 1 255  200 100 50  10 20 30\n");
    render(&sandbox, "--spp 2 --checkpoint c");
    render(&sandbox, "--spp 3 --resume c");
    sandbox.write("t.ppm", "P3 2 1 255  10 20 30  200 100 50\n");
    sandbox.run("render scene.xml --spp 3 --resume c").expect(2, &["another scene"]);
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let sandbox = Sandbox::new();
    for i in integrators() {
        // A part of the picture may be worth other numbers of samples than the whole.
        let name = i.split(' ').next().unwrap();
        let listed = sandbox.run(&format!("list -i {name}")).expect(0, &[]).stdout;
        let full = if listed.contains("  allocation ") { "-p allocation=full" } else { "" };
        render(&sandbox, &format!("-i {i} {full} -o whole.pfm --size 40x24"));
        render(&sandbox, &format!("-i {i} {full} -o part.pfm --size 40x24 --crop 9,5,20,11"));
        let (whole, part) = (image(&sandbox, "whole.pfm"), image(&sandbox, "part.pfm"));
        assert_eq!((part.width, part.height), (20, 11));
        for y in 0..11 {
            for x in 0..20 {
                let [a, b] = [part.rgb(x, y), whole.rgb(9 + x, 5 + y)].map(|c| c.to_array().map(f32::to_bits));
                assert_eq!(a, b, "{i} pixel {x},{y}");
            }
        }
    }
}

#[test]
fn quiet_is_quiet() {
    let sandbox = Sandbox::new();
    sandbox.write_box_with("scene.xml", "name=\"fov\"", "name=\"fovv\"");
    let run = render(&sandbox, "-o a.png --quiet");
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
    // Errors are still said.
    sandbox.write_box_with("scene.xml", "type=\"diffuse\"", "type=\"difuse\"");
    sandbox.run("render scene.xml -o a.png --quiet").expect(2, &["unknown-plugin"]);
}

#[test]
fn time_is_kept() {
    let sandbox = Sandbox::new();
    let start = Instant::now();
    render(&sandbox, "-o a.pfm --time 300ms --stats s.json");
    let wall = start.elapsed();
    let s = stats(&sandbox, "s.json");
    let (used, iterations) = (s["wall_s"].as_f64().unwrap(), s["iterations"].as_u64().unwrap());
    // Iterations take a millisecond; the rest is what a busy machine adds.
    assert!((0.2..1.0).contains(&used), "{used} s");
    assert!(wall < Duration::from_secs(5), "{wall:?}");
    assert!(iterations > 4, "the scene's 4 samples are no limit: {iterations}");
    // With both budgets the first to be used up counts.
    let start = Instant::now();
    render(&sandbox, "--time 1h --spp 2 --stats s.json");
    assert!(start.elapsed() < Duration::from_secs(10));
    assert_eq!(stats(&sandbox, "s.json")["iterations"], 2);
}

/// Interrupts the process as soon as it catches SIGINT (bit 1 of a mask in its status) and has rendered for `time`.
fn interrupt_after(process: &Process, time: Duration) {
    let pid = process.child.id();
    let deadline = Instant::now() + Duration::from_secs(20);
    loop {
        let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:")).unwrap();
        if u64::from_str_radix(mask.trim(), 16).unwrap() & 2 != 0 {
            break;
        }
        assert!(Instant::now() < deadline, "no handler");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(time);
    kill(Pid::from_raw(pid.try_into().unwrap()), Signal::SIGINT).unwrap();
}

#[test]
fn interrupted_renders_are_written() {
    let sandbox = Sandbox::new();
    let process = sandbox.start("render scene.xml -o a.pfm --stats s.json --checkpoint c --spp 1000000000");
    interrupt_after(&process, Duration::from_millis(300));
    let run = process.finish().expect(130, &["wrote a.pfm", "interrupted"]);
    assert!(run.stdout.is_empty());
    let iterations = stats(&sandbox, "s.json")["iterations"].as_u64().unwrap();
    assert!(iterations > 0);
    assert_eq!(image(&sandbox, "a.pfm").width, 16);
    // A resumed render has the bits of an uninterrupted one.
    render(&sandbox, &format!("-o resumed.pfm --resume c --spp {}", iterations + 2));
    render(&sandbox, &format!("-o whole.pfm --spp {}", iterations + 2));
    assert_eq!(sandbox.read("resumed.pfm"), sandbox.read("whole.pfm"));
}

#[test]
fn definitions_override_defaults() {
    let sandbox = Sandbox::new();
    render(&sandbox, "-o a.pfm -D red=0.1 --stats s.json -D spp=2");
    assert_eq!(stats(&sandbox, "s.json")["iterations"], 2);
    sandbox.write_box_with("direct.xml", "$red", "0.1");
    sandbox.run("render direct.xml -o b.pfm --spp 2").expect(0, &[]);
    render(&sandbox, "-o c.pfm --spp 2");
    assert_eq!(sandbox.read("a.pfm"), sandbox.read("b.pfm"));
    assert_ne!(sandbox.read("a.pfm"), sandbox.read("c.pfm"));
}

#[test]
fn help_is_no_error() {
    let sandbox = Sandbox::new();
    for command in ["", "render", "info", "list", "check-rays", "compare", "converge", "profile", "merge", "bench"] {
        let run = sandbox.run(&format!("{command} --help")).expect(0, &[]);
        assert!(run.stdout.contains("Usage: lightsieve") && run.stderr.is_empty(), "{command}");
    }
    assert!(sandbox.run("--help").stdout.contains("Exit codes"));
    assert_eq!(
        sandbox.run("--version").expect(0, &[]).stdout.trim(),
        concat!("lightsieve ", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn a_reader_that_went_away_is_no_panic() {
    let sandbox = Sandbox::new();
    render(&sandbox, "-o a.pfm");
    for arguments in [
        "list",
        "list -i path",
        "info scene.xml",
        "compare a.pfm a.pfm",
        "compare a.pfm a.pfm --json",
        "render --help",
        "render scene.xml --print-config",
        "check-rays scene.xml --rays 10",
        "check-rays scene.xml --rays 10 --json",
    ] {
        let mut process = sandbox.start(arguments);
        drop(process.child.stdout.take());
        process.finish().expect(0, &[]);
        // Without a reader of messages the exit code alone can tell.
        let mut process = sandbox.start(arguments);
        drop(process.child.stderr.take());
        assert_eq!(process.finish().code, Some(0), "{arguments}");
    }
    let mut process = sandbox.start("render none.xml -o a.pfm");
    drop(process.child.stderr.take());
    assert_eq!(process.finish().code, Some(3));
}

#[test]
fn an_obj_without_its_mtl_is_grey() {
    let sandbox = Sandbox::new();
    sandbox.write("model.obj", "mtllib gone.mtl\nusemtl red\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
    let run = sandbox.run("render model.obj -o a.pfm --size 16x16 --spp 4");
    run.expect(0, &["warning[load::missing-mtl]", "gone.mtl", "warning[load::unknown-material]", "added-sky"]);
    let picture = image(&sandbox, "a.pfm");
    // A flat thing of reflectance one half under a sky of one.
    let c = picture.rgb(8, 8);
    assert!(c.to_array().iter().all(|&v| (v - 0.5).abs() < 0.05), "{c:?}");
    let away =
        "render model.obj -o b.pfm --size 16x16 --spp 1 --camera-origin 0,0,-5 --camera-target -1,0,-9 --camera-fov 20";
    sandbox.run(away).expect(0, &[]);
    let sky = image(&sandbox, "b.pfm").rgb(8, 8);
    // But for the weights of the pixel filter, which are one to its table's precision.
    assert!(sky.to_array().iter().all(|&v| (v - 1.0).abs() < 1e-3), "the camera looks at the sky: {sky:?}");
}

#[test]
fn every_part_of_the_box_is_read() {
    // The other tests change the box by text; a box that warns of something would hide that they do not.
    let run = Sandbox::new().run("render scene.xml -o a.pfm");
    assert!(BOX.contains("$red") && !run.stderr.contains("warning"), "{}", run.stderr);
}
