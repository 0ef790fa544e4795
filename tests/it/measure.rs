//! Measuring from outside: convergence, profile, merge, bench, error targets, and the report as a file.

use crate::support::program::{BOX, Run, Sandbox};
use lightsieve::film::Film;
use lightsieve::image::ExrFile;
use lightsieve::image::metrics::picture_errors;
use lightsieve::integrators::{Iteration, Params, lvc, path};
use lightsieve::load::{LoadOptions, load_scene};
use lightsieve::prepared::{PrepareOptions, PreparedScene};
use lightsieve::ray::Backend;
use lightsieve::render::run::run;
use lightsieve::render::{Budget, ErrorTarget, Estimator, Method, Observer, Plan, Runtime, Stop};
use serde_json::Value;
use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn keys(object: &Value) -> BTreeSet<&str> {
    object.as_object().unwrap().keys().map(String::as_str).collect()
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("{v} is no number"))
}

/// The box of the sandbox in another size.
fn prepared(sandbox: &Sandbox, size: u32) -> PreparedScene {
    let (desc, mut diagnostics) = load_scene(&sandbox.path("scene.xml"), &LoadOptions::default()).unwrap();
    let options =
        PrepareOptions { backend: Backend::default_available(), threads: 2, size: Some([size, size]), crop: None };
    PreparedScene::build(desc, &options, &mut diagnostics).unwrap_or_else(|e| panic!("{e}"))
}

fn path_params() -> Params {
    let mut params = Params::defaults(&path::SPEC);
    params.set("max_depth", "5").unwrap();
    params
}

#[test]
fn merged_renders_are_one_render_of_all_samples() {
    let sandbox = Sandbox::new();
    for (name, seed, spp) in [("a", 3, 4), ("b", 4, 8), ("c", 5, 1)] {
        sandbox.run(&format!("render scene.xml --seed {seed} --spp {spp} -o {name}.exr --aov depth")).expect(0, &[]);
    }
    sandbox.run("merge a.exr b.exr c.exr -o all.exr").expect(0, &["13 samples", "seeds 3 4 5"]);
    let merged = ExrFile::read(&sandbox.path("all.exr")).unwrap();
    let of = |key: &str| merged.text(&format!("lightsieve:{key}")).map(str::to_owned);
    assert_eq!((of("iterations").as_deref(), of("seed").as_deref()), (Some("13"), Some("3 4 5")));
    assert_eq!(of("integrator").as_deref(), Some("path"));

    let scene = prepared(&sandbox, 16);
    let mut film = Film::new(scene.window);
    for (seed, spp) in [(3, 4), (4, 8), (5, 1)] {
        let mut integrator = (path::SPEC.build)(&path_params());
        for index in 0..spp {
            film.begin_iteration();
            integrator.iterate(&Iteration::new(&scene, seed, index), &mut film);
        }
    }
    let close = |what: &str, found: &[[f64; 3]], expected: &[lightsieve::math::Rgb]| {
        for (f, e) in found.iter().flatten().zip(expected.iter().flat_map(|e| e.to_array())) {
            let e = f64::from(e);
            assert!((f - e).abs() <= 2e-5 * e.abs() + 1e-9, "{what}: {f} {e}");
        }
    };
    close("mean", &merged.colours("").unwrap(), &film.mean());
    close("variance", &merged.colours("variance").unwrap(), &film.variance_of_mean());
    assert!(merged.channel("depth.Z").is_some());

    // Merged renders merge on.
    sandbox.run("render scene.xml --seed 6 --spp 2 -o d.exr").expect(0, &[]);
    sandbox.run("merge all.exr d.exr -o more.exr").expect(0, &["15 samples"]);
}

#[test]
fn what_does_not_belong_together_is_not_merged() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --seed 1 -o a.exr -o a.pfm").expect(0, &[]);
    sandbox.run("render scene.xml --seed 2 -o small.exr --size 8x8").expect(0, &[]);
    sandbox.run("render scene.xml --seed 2 -o deep.exr --max-depth 3").expect(0, &[]);
    sandbox.run("merge a.exr a.exr -o x.exr").expect(2, &["a.exr", "seed 1", "already"]);
    sandbox.run("merge a.exr -o x.exr").expect(2, &["at least two"]);
    sandbox.run("merge a.exr small.exr -o x.exr").expect(2, &["small.exr", "8 x 8", "16 x 16"]);
    sandbox.run("merge a.exr deep.exr -o x.exr").expect(2, &["deep.exr", "max_depth=3"]);
    sandbox.run("merge a.exr a.pfm -o x.exr").expect(2, &["a.pfm", "EXR"]);
    sandbox.run("merge a.exr gone.exr -o x.exr").expect(3, &["gone.exr"]);
    sandbox.run("merge a.exr small.exr -o x.bmp").expect(2, &["x.bmp"]);
    assert!(!sandbox.path("x.exr").exists());
}

#[test]
fn errors_have_pictures_and_a_z_test() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --spp 64 --seed 1 -o a.exr -o a.pfm").expect(0, &[]);
    sandbox.run("render scene.xml --spp 64 --seed 2 -o b.exr").expect(0, &[]);
    sandbox.write_box_with("other.xml", "$red", "0.75");
    sandbox.run("render other.xml --spp 64 --seed 2 -o other.exr").expect(0, &[]);
    let z = |files: &str| json(&sandbox.run(&format!("compare {files} --json --quiet")).expect(0, &[]).stdout);
    let same = &z("a.exr b.exr")["z_test"];
    assert!(number(&same["rms"]) < 1.2 && number(&same["worst"]) < number(&same["threshold"]), "{same}");
    assert!(number(&same["whole"]).abs() < 3.5, "{same}");
    let other = &z("a.exr other.exr")["z_test"];
    assert!(number(&other["whole"]).abs() > 5.0, "{other}");
    assert!(z("a.pfm a.pfm").get("z_test").is_none(), "there is no variance to test with");
    sandbox.run("compare a.exr b.exr --error-image e.png").expect(0, &[]);
    sandbox.run("compare a.exr b.exr --error-image s.exr --signed").expect(0, &[]);
    let signed = ExrFile::read(&sandbox.path("s.exr")).unwrap();
    assert_eq!((signed.width, signed.height), (16, 16));
    sandbox.run("compare a.exr b.exr --error-image e.bmp").expect(2, &["e.bmp"]);
}

/// An observer that hears nothing.
struct Silent;

impl Observer for Silent {}

/// A picture of this size has few blocks: the estimate is the true error on the average over seeds, with independent
/// pixels and with light sub-paths that all pixels share.
#[test]
fn the_estimated_error_of_blocks_is_the_true_one() {
    const PAIRS: u64 = 24;
    let sandbox = Sandbox::new();
    let scene = prepared(&sandbox, 32);
    let mut reference = Estimator::new((path::SPEC.build)(&path_params()), scene.window, 1000);
    for _ in 0..4096 {
        reference.iterate(&scene);
    }
    let reference = reference.film.mean_f64();
    let target = ErrorTarget::parse("relmse_8x8=1").unwrap();
    for spec in [&path::SPEC, &lvc::SPEC] {
        let params = Params::with(spec, &[("max_depth", "5")]).unwrap();
        let film = |seed: u64| {
            let mut estimator = Estimator::new((spec.build)(&params), scene.window, seed);
            for _ in 0..16 {
                estimator.iterate(&scene);
            }
            estimator.film
        };
        let (mut estimates, mut truth) = (0.0, 0.0);
        for pair in 0..PAIRS {
            let (a, b) = (film(2 * pair), film(2 * pair + 1));
            estimates += target.estimate(&a, &b);
            let mut both = Film::new(scene.window);
            both.add(&a);
            both.add(&b);
            truth += picture_errors(&both.mean_f64(), &reference, both.width as usize).regions.relmse_8x8;
        }
        assert!((estimates / truth - 1.0).abs() < 0.2, "{}: {estimates} {truth}", spec.name);
    }
}

#[test]
fn the_estimated_error_is_the_true_one() {
    let sandbox = Sandbox::new();
    let scene = prepared(&sandbox, 32);
    let method = Method { label: "path".into(), spec: &path::SPEC, params: path_params() };
    let mut reference = Estimator::new(method.build(), scene.window, 1000);
    for _ in 0..2048 {
        reference.iterate(&scene);
    }
    let reference = reference.film.mean_f64();
    let pool = rayon::ThreadPoolBuilder::new().build().unwrap();
    let runtime = Runtime { pool: &pool, interrupt: &AtomicBool::new(false), observer: &Silent };
    for (key, value) in [("relmse", 5e-3), ("relmse_trimmed", 2e-3), ("mape", 0.04), ("mae", 0.008)] {
        let target = ErrorTarget::parse(&format!("{key}={value}")).unwrap();
        for seed in [1, 2] {
            let budget = Budget { iterations: Some(4096), time: None };
            let plan = Plan { budget, error_target: Some(target), ..Plan::new(method.clone(), seed) };
            let rendered = run(&scene, &plan, runtime).unwrap();
            let film = &rendered.film;
            assert_eq!(rendered.outcome.stop, Stop::Converged, "{key}");
            assert!(film.iterations() < 4096 && rendered.outcome.iterations == film.iterations());
            let estimate = rendered.error.unwrap().estimate.unwrap();
            let errors =
                serde_json::to_value(picture_errors(&film.mean_f64(), &reference, film.width as usize)).unwrap();
            let truth = number(&errors[key]);
            assert!(estimate < value, "{key}: {estimate}");
            assert!((estimate / truth - 1.0).abs() < 0.2, "{key}: by estimate {estimate}, in truth {truth}");
        }
    }
    for bad in ["relmse", "relms=1", "relmse=0", "relmse=x", "relmse=inf"] {
        assert!(ErrorTarget::parse(bad).is_err(), "{bad}");
    }
}

#[test]
fn a_render_with_a_target_says_how_it_went() {
    let sandbox = Sandbox::new();
    let run = sandbox.run("render scene.xml --error-target mape=0.1 -o a.exr --stats s.json");
    run.expect(0, &["mape by estimate"]);
    let stats = json(std::str::from_utf8(&sandbox.read("s.json")).unwrap());
    assert_eq!(stats["error"]["measure"], "mape");
    assert!(number(&stats["error"]["estimate"]) < 0.1, "{stats}");
    let file = ExrFile::read(&sandbox.path("a.exr")).unwrap();
    assert_eq!(file.text("lightsieve:seed").unwrap().split(' ').count(), 2, "both seeds, so that merging refuses them");
    // Equal bits again, and another limit that comes first.
    sandbox.run("render scene.xml --error-target mape=0.1 -o b.exr --threads 1").expect(0, &[]);
    let pixels = |name: &str| ExrFile::read(&sandbox.path(name)).unwrap().channels;
    assert_eq!(pixels("a.exr"), pixels("b.exr"));
    sandbox.run("render scene.xml --error-target mape=1e-9 --spp 6 --stats s.json").expect(0, &[]);
    assert_eq!(json(std::str::from_utf8(&sandbox.read("s.json")).unwrap())["iterations"], 6);
    sandbox.run("render scene.xml --error-target map=0.1").expect(2, &["known: relmse"]);
}

const QUICK: &str = "--cache cache --reference-integrator path --reference-spp 64 --time 60ms --seeds 2 --size 20x12";

#[test]
fn convergence_is_measured_and_reported() {
    let sandbox = Sandbox::new();
    let methods = "path,bdpt:heuristic=power,max_depth=4";
    let run = sandbox.run(&format!("converge scene.xml -i {methods} {QUICK} --json --quiet --report r")).expect(0, &[]);
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    let found = json(&run.stdout);
    assert_eq!(keys(&found), BTreeSet::from(["command", "seconds", "seeds", "baseline", "machine", "scenes"]));
    let expected = ["cpu", "hardware_threads", "threads", "system", "version", "commit", "compiler", "backend"];
    assert_eq!(keys(&found["machine"]), BTreeSet::from(expected));
    let scene = &found["scenes"][0];
    let runs = scene["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 4);
    for run in runs {
        let points = run["points"].as_array().unwrap();
        assert_eq!(points[0]["iterations"], 1);
        let (first, last) = (&points[0], points.last().unwrap());
        assert!(number(&last["seconds"]) >= number(&first["seconds"]) && number(&last["relmse"]) > 0.0);
        for key in
            ["mape", "relmse", "relmse_trimmed", "relmse_16x16", "relmse_whole", "l1", "mse", "flip", "mean_ratio"]
        {
            assert!(number(&last[key]).is_finite(), "{key}");
        }
        assert!(points.windows(2).all(|p| p[0]["iterations"].as_u64() < p[1]["iterations"].as_u64()));
    }
    assert_eq!(scene["methods"][1]["label"], "bdpt:heuristic=power,max_depth=4");
    assert!(scene["methods"][1]["parameters"].as_str().unwrap().contains("max_depth=4"));
    assert!(number(&scene["reference"]["own"]["relmse"]) > 0.0);
    assert!(number(&scene["load"]["seconds"]) > 0.0);
    let of_path = scene["speed_ups"].as_array().unwrap().iter().filter(|s| s["method"] == "path");
    assert!(of_path.into_iter().all(|s| s["ratio"] == 1.0));

    let rows: usize = runs.iter().map(|r| r["points"].as_array().unwrap().len()).sum();
    let csv = String::from_utf8(sandbox.read("r/converge.csv")).unwrap();
    assert_eq!(csv.lines().count(), rows + 1);
    assert_eq!(json(std::str::from_utf8(&sandbox.read("r/converge.json")).unwrap()), found);
    let page = String::from_utf8(sandbox.read("r/index.html")).unwrap();
    check_page(&page);
    let pictures = viewer_data(&page);
    assert_eq!(pictures.len(), 1);
    let names: Vec<&str> =
        pictures[0]["pictures"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["path", "bdpt:heuristic=power,max_depth=4", "reference"]);
    assert_eq!(page.matches("<svg").count(), 9);
    assert!(page.contains("lightsieve converge scene.xml"));

    // The second time the reference is there already; its time stamp tells.
    let cached = || {
        let mut entries = std::fs::read_dir(sandbox.path("cache")).unwrap().map(|e| e.unwrap());
        let entry = entries.next().unwrap();
        assert!(entries.next().is_none());
        (entry.path(), entry.metadata().unwrap().modified().unwrap())
    };
    let before = cached();
    let table = sandbox.run(&format!("converge scene.xml -i path,light {QUICK} --target mape=0.5")).expect(0, &[]);
    assert_eq!(cached(), before);
    assert!(table.stdout.contains("speed-up over path (mape)"), "{}", table.stdout);
    assert!(table.stderr.contains("samples per pixel of path"), "{}", table.stderr);
}

#[test]
fn convergence_refuses_what_it_cannot_measure() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --seed 2 -o own.exr --size 20x12").expect(0, &[]);
    sandbox.run("render scene.xml --seed 9 -o small.exr --size 8x8").expect(0, &[]);
    let fails = |arguments: &str, code: i32, parts: &[&str]| {
        sandbox.run(&format!("converge {arguments} {QUICK}")).expect(code, parts);
    };
    fails("scene.xml -i paht", 2, &["paht", "did you mean \"path\""]);
    fails("scene.xml -i path:max_dept=3", 2, &["max_depth"]);
    fails("scene.xml -i path --baseline light", 2, &["light", "not among the methods"]);
    fails("scene.xml -i path --reference own.exr", 2, &["seed 2"]);
    fails("scene.xml -i path --reference small.exr", 2, &["8 x 8", "20 x 12"]);
    fails("scene.xml -i path --reference gone.exr", 3, &["gone.exr"]);
    fails("gone.xml -i path", 3, &["gone.xml"]);
    fails("scene.xml -i path --target speed=1", 2, &["known: relmse"]);
    fails("scene.xml scene.xml -i path --reference own.exr", 2, &["--reference"]);
}

#[test]
fn a_profile_adds_up() {
    let sandbox = Sandbox::new();
    let run = sandbox.run("profile scene.xml -i bdpt --time 200ms --size 24x24 --json --quiet --report p");
    let found = json(&run.expect(0, &[]).stdout);
    for key in ["query_share", "shadow_blocked"] {
        assert!((0.0..=1.0).contains(&number(&found[key])), "{key}: {found}");
    }
    let phases: f64 = found["phases"].as_object().unwrap().values().map(number).sum();
    assert!(phases > 0.5 * number(&found["wall_s"]) && phases <= 1.001 * number(&found["wall_s"]), "{found}");
    let work = &found["work"];
    assert_eq!(keys(work), BTreeSet::from(["connections", "weights"]));
    assert!(work.as_object().unwrap().values().all(|w| (0.0..=phases).contains(&number(w))), "{work}");
    let share: f64 = found["rays"].as_object().unwrap().values().map(|k| number(&k["share"])).sum();
    assert!((share - 1.0).abs() < 1e-9);
    assert_eq!(found["replayed"][1], 0);
    assert!(number(&found["replayed"][0]) > 1000.0);
    // All backends give the same answers to the rays.
    let met: Vec<f64> = found["replay"].as_array().unwrap().iter().map(|r| number(&r["met"])).collect();
    assert!(met.iter().all(|m| (m / met[0] - 1.0).abs() < 1e-2), "{met:?}");
    assert!(met[0] > 0.0);
    let wasted = &found["wasted"];
    assert!(number(&wasted["rays_per_sample"]) > 1.0 && number(&wasted["blocked_light"]) < 1.0, "{wasted}");
    for name in ["cost.exr", "blocked.exr"] {
        assert!(ExrFile::read(&sandbox.path(format!("p/{name}"))).unwrap().channel("Y").is_some(), "{name}");
    }
    let page = String::from_utf8(sandbox.read("p/index.html")).unwrap();
    check_page(&page);
    assert_eq!(viewer_data(&page).len(), 2);
    let table = sandbox.run("profile scene.xml -i path --time 50ms --size 8x8").expect(0, &[]);
    assert!(table.stdout.contains("not the bare backend's"), "{}", table.stdout);
    sandbox.run("profile scene.xml -i path,bdpt --time 50ms").expect(2, &["one method"]);
}

#[test]
fn a_bench_finds_what_is_worse() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("all/box")).unwrap();
    sandbox.write("all/box/box.xml", BOX);
    let bench = |more: &str| sandbox.run(&format!("bench all -i path,light {QUICK} --quiet {more}"));
    bench("--save base.json").expect(0, &[]);
    let base = json(std::str::from_utf8(&sandbox.read("base.json")).unwrap());
    let rows = base["rows"].as_array().unwrap();
    assert_eq!(rows.iter().map(|r| r["method"].as_str().unwrap()).collect::<Vec<_>>(), ["path", "light"]);
    // A baseline that was a hundred times faster, and one that was a hundred times slower.
    let scaled = |name: &str, factor: f64| {
        let mut other = base.clone();
        for row in other["rows"].as_array_mut().unwrap() {
            for s in row["seconds_per_iteration"].as_array_mut().unwrap() {
                *s = (number(s) * factor).into();
            }
        }
        sandbox.write(name, other.to_string());
    };
    scaled("fast.json", 0.01);
    scaled("slow.json", 100.0);
    let worse: Run = bench("--against fast.json --allow-busy").expect(1, &["worse than the baseline", "2 rows"]);
    assert!(worse.stdout.contains("slower (bound"), "{}", worse.stdout);
    let better = json(&bench("--against slow.json --allow-busy --json").expect(0, &[]).stdout);
    for verdict in better["against"].as_array().unwrap() {
        assert!(number(&verdict["time"]["ratio"]) < 0.5, "{verdict}");
        // Equal seeds make equal pictures.
        assert!((number(&verdict["error"]["ratio"]) - 1.0).abs() < 1e-9, "{verdict}");
    }
    // A baseline of a machine in use.
    let mut busy = base.clone();
    busy["load"]["others"] = 0.5.into();
    sandbox.write("busy.json", busy.to_string());
    let refused = bench("--against busy.json --json").expect(1, &["times were not judged", "--allow-busy"]);
    for verdict in json(&refused.stdout)["against"].as_array().unwrap() {
        assert!(verdict["time"].is_null() && verdict["error"].is_object(), "{verdict}");
    }
    bench("--allow-busy").expect(2, &["--against"]);
    bench("--against scene.xml").expect(2, &["scene.xml", "bench --save"]);
    bench("--against gone.json").expect(3, &["gone.json"]);
    sandbox.run("bench cache --time 1ms").expect(2, &["no scenes"]);
    sandbox.run("bench gone --time 1ms").expect(3, &["gone"]);
}

/// The data of all viewers of a page; the pixels must be as many as the sizes say.
fn viewer_data(page: &str) -> Vec<Value> {
    let data: Vec<Value> = page
        .split("<script type=\"application/json\">")
        .skip(1)
        .map(|rest| json(rest.split_once("</script>").expect("an end").0))
        .collect();
    for group in &data {
        let pixels = (number(&group["width"]) * number(&group["height"])) as usize;
        for picture in group["pictures"].as_array().unwrap() {
            let length = |key: &str| picture[key].as_str().unwrap().len();
            assert_eq!(length("pixels"), (4 * pixels).div_ceil(3) * 4);
            assert!([0, pixels.div_ceil(3) * 4].contains(&length("errors")));
        }
    }
    data
}

/// A page must be well formed and must not ask for anything from elsewhere.
fn check_page(page: &str) {
    assert!(page.starts_with("<!DOCTYPE html>"));
    let without_namespace = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    for outside in ["http:", "https:", "src=", "@import", "url(", "fetch(", "XMLHttpRequest", "import "] {
        assert!(!without_namespace.contains(outside), "the page asks for something: {outside}");
    }
    let mut open: Vec<&str> = vec![];
    let mut rest = page;
    while let Some(start) = rest.find('<') {
        rest = &rest[start + 1..];
        let end = rest.find('>').expect("a tag ends");
        let (tag, name) = (&rest[..end], rest[..end].split([' ', '\n']).next().unwrap());
        rest = &rest[end + 1..];
        if let Some(closed) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(closed), "in the order of opening");
        } else if !(tag.ends_with('/') || name.starts_with('!') || ["meta", "link"].contains(&name)) {
            open.push(name);
        }
        // Scripts and styles are no markup.
        if ["script", "style"].contains(&name) {
            rest = &rest[rest.find(&format!("</{name}>")).expect("an end")..];
        }
    }
    assert!(open.is_empty(), "not closed: {open:?}");
}

#[test]
fn a_reference_that_nobody_names_is_by_a_method_that_another_confirms() {
    let sandbox = Sandbox::new();
    let quick = "--cache cache --reference-spp 64 --time 60ms --seeds 2 --size 20x12";
    let first = sandbox.run(&format!("converge scene.xml -i path,light,bdpt {quick}"));
    let first = first.expect(0, &["scene: reference by", "agrees", "its own error is about", "by estimate"]);
    assert!(!first.stderr.contains("at most"), "{}", first.stderr);
    // It is kept, and not chosen again.
    let again = sandbox.run(&format!("converge scene.xml -i path,light,bdpt {quick}")).expect(0, &[]);
    assert!(!again.stderr.contains("reference by"), "{}", again.stderr);
}

#[test]
fn methods_that_agree_against_the_reference_are_told() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml --size 20x12 --spp 16 --seed 9 -D red=0.1 -o dark.exr").expect(0, &[]);
    sandbox.run("render scene.xml --size 20x12 --spp 64 --seed 9 -o right.exr").expect(0, &[]);
    let converge = |reference: &str| {
        let run = sandbox.run(&format!(
            "converge scene.xml -i path,bdpt --reference {reference} --time 200ms --seeds 3 --size 20x12"
        ));
        run.expect(0, &[]).stderr
    };
    let wrong = converge("dark.exr");
    assert!(wrong.contains("path, bdpt agree with each other and not with the reference"), "{wrong}");
    assert!(!converge("right.exr").contains("agree with each other"));
}

#[test]
fn parameters_hold_for_all_methods_that_have_them() {
    let sandbox = Sandbox::new();
    let methods = |arguments: &str| {
        let run = sandbox.run(&format!("converge scene.xml {arguments} {QUICK} --json")).expect(0, &[]);
        let found = json(&run.stdout)["scenes"][0]["methods"].clone();
        found.as_array().unwrap().iter().map(|m| m["parameters"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let found = methods("-i path,bdpt,bdpt:max_depth=2 -p max_depth=3 -p light_paths=1/4");
    assert!(found[0].contains("max_depth=3") && found[1].contains("max_depth=3"), "{found:?}");
    assert!(found[1].contains("light_paths=1/4") || found[1].contains("light_paths=0.25"), "{found:?}");
    assert!(found[2].contains("max_depth=2"), "a method's own parameters win: {found:?}");
    sandbox.run("profile scene.xml -i path -p light_paths=1/4 --time 30ms").expect(2, &["none of the methods has"]);
    sandbox.run("profile scene.xml -i path -p max_depth=2 --time 30ms --size 8x8").expect(0, &[]);
}

#[test]
fn clipped_pictures_are_told_from_wrong_ones() {
    let sandbox = Sandbox::new();
    sandbox.run("render scene.xml -o a.exr -o a.png --exposure 3").expect(0, &[]);
    sandbox.run("compare a.png a.exr").expect(0, &[]);
    let lamp = ("target=\"0, 0, -1\"", "target=\"0, 0.95, 0\"");
    sandbox.write_box_with("lamp.xml", lamp.0, lamp.1);
    sandbox.run("render lamp.xml -o l.exr -o l.png").expect(0, &[]);
    for pair in ["l.png l.exr", "l.exr l.png"] {
        sandbox.run(&format!("compare {pair}")).expect(0, &["pixels of l.png are clipped", "l.exr is brighter"]);
    }
    let same = sandbox.run("compare l.exr l.exr").expect(0, &[]);
    assert!(same.stderr.is_empty(), "{}", same.stderr);
    let report = json(&sandbox.run("compare --json l.png l.exr").expect(0, &[]).stdout);
    assert!(report["mean_ratio"].as_f64().is_some());
}

#[test]
fn a_merge_is_described_in_json() {
    let sandbox = Sandbox::new();
    for seed in [3, 4] {
        sandbox.run(&format!("render scene.xml --seed {seed} --spp 2 -o {seed}.exr")).expect(0, &[]);
    }
    let found = json(&sandbox.run("merge 3.exr 4.exr -o all.exr --json").expect(0, &[]).stdout);
    assert_eq!(found, json("{\"iterations\": 4, \"seeds\": [\"3\", \"4\"], \"written\": [\"all.exr\"]}"));
}
