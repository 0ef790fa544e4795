//! `lightsieve converge`: error against time.

use super::Failure;
use super::environment::Environment;
use super::measure_args::ConvergeArgs;
use super::session::{SceneMethods, Session, command_line, is_complete, reference_failure, to_json, write_text};
use crate::measure::consensus::doubt;
use crate::measure::converge::{EqualTimeTask, Run, converge};
use crate::measure::curve::csv;
use crate::measure::reference::Reference;
use crate::measure::study::{MethodSummary, SceneStudy, Study};
use crate::measure::{LoadWatch, Machine};
use crate::render::{Observer, OutputFiles};
use std::path::{Path, PathBuf};

/// Files of a report in its folder.
const JSON: &str = "converge.json";
const CSV: &str = "converge.csv";
const PAGE: &str = "index.html";

pub(crate) fn run(args: &ConvergeArgs) -> Result<(), Failure> {
    if args.reference.is_some() && args.scenes.len() > 1 {
        return Err(Failure::Input("--reference belongs to one scene, and there are more".into()));
    }
    let mut outputs = OutputFiles::default();
    args.report.iter().for_each(|folder| outputs.add_folder("--report", folder, &[JSON, CSV, PAGE]));
    let inputs = args.scenes.iter().chain(&args.reference).map(PathBuf::as_path);
    let session = Session::new(&args.measure, outputs, inputs)?;
    let labels: Vec<String> = session.methods.iter().filter_map(|m| m.label.clone()).collect();
    let first = || labels.first().cloned().unwrap_or_default();
    let baseline = args.baseline.clone().unwrap_or_else(first);
    if !labels.contains(&baseline) {
        return Err(Failure::Input(format!("--baseline {baseline} is not among the methods")));
    }
    let seeds: Vec<u64> = (1..=args.seeds).collect();
    let (mut scenes, mut references, mut backend) = (vec![], vec![], String::new());
    for path in &args.scenes {
        let scene = session.prepare(path, Some(&args.references))?;
        let reference = match &args.reference {
            Some(path) => Reference::read(path).map_err(reference_failure)?,
            None => session.reference(&scene, &args.references)?,
        };
        check(&scene, &reference, &seeds)?;
        let study = one_scene(
            &session,
            &Comparison { args, path, scene: &scene, reference: &reference, seeds: &seeds, baseline: &baseline },
        )?;
        session.say(&format!("\n{}: {}", study.scene, study.load.sentence()));
        study.load.warning().iter().for_each(|warning| session.say(&format!("warning: {warning}")));
        session.say(&study.reference.sentence());
        let trusted = scene.methods.iter().filter(|m| is_complete(m, &scene.scene)).map(|m| m.label.as_str());
        if let Some(warning) = doubt(&study.runs, &trusted.collect::<Vec<_>>(), &reference.pixels) {
            session.say(&format!("warning: {warning}"));
        }
        for method in study.single_samples() {
            session.say(&format!("warning: {method}: --time leaves room for a single sample per pixel only"));
        }
        if !args.measure.json {
            for line in study.end_table().lines().iter().chain(&[String::new()]).chain(&study.speed_table().lines()) {
                out!("{line}");
            }
            out!("");
        }
        backend = scene.scene.query.describe();
        scenes.push(study);
        references.push(reference);
        if session.environment.is_interrupted() {
            break;
        }
    }
    let machine = Machine::here(session.environment.threads, backend);
    let seconds = args.time.as_secs_f64();
    let study = Study { command: command_line(), seconds, seeds, baseline, machine, scenes };
    if args.measure.json {
        out!("{}", to_json(&study)?);
    } else {
        for line in study.summary().lines() {
            out!("{line}");
        }
    }
    if let Some(folder) = &args.report {
        let rows = csv(study.scenes.iter().map(|s| (s.scene.as_str(), s.runs.as_slice())));
        for (name, text) in [(JSON, to_json(&study)?), (CSV, rows), (PAGE, study.page(&references))] {
            session.say(&format!("wrote {}", write_text(folder, name, &text)?.display()));
        }
    }
    if session.environment.is_interrupted() { Err(Failure::Interrupted) } else { Ok(()) }
}

/// Refuses a reference of another size, or one that holds the very samples that are compared with it.
fn check(scene: &SceneMethods, reference: &Reference, seeds: &[u64]) -> Result<(), Failure> {
    let size = [scene.scene.window[2], scene.scene.window[3]];
    if reference.size != size {
        let [a, b] = [reference.size, size].map(|[w, h]| format!("{w} x {h}"));
        return Err(Failure::Input(format!("the reference has {a} pixels, {} is rendered with {b}", scene.name)));
    }
    let used = reference.facts.seeds.iter().flat_map(|s| s.split_whitespace()).filter_map(|s| s.parse::<u64>().ok());
    if let Some(seed) = used.into_iter().find(|s| seeds.contains(s)) {
        return Err(Failure::Input(format!(
            "the reference was rendered with seed {seed}, which is measured here: its samples would judge themselves"
        )));
    }
    Ok(())
}

/// Methods that are compared on one scene.
struct Comparison<'a> {
    args: &'a ConvergeArgs,
    /// Scene file.
    path: &'a Path,
    scene: &'a SceneMethods,
    reference: &'a Reference,
    seeds: &'a [u64],
    /// Label of the method that speed-ups are relative to.
    baseline: &'a str,
}

fn one_scene(session: &Session, comparison: &Comparison) -> Result<SceneStudy, Failure> {
    let Comparison { args, path, scene, reference, seeds, baseline } = *comparison;
    let task = EqualTimeTask {
        scene: &scene.scene,
        methods: &scene.methods,
        reference: &reference.pixels,
        time: args.time,
        seeds,
    };
    let Environment { pool, console, .. } = &session.environment;
    let watch = LoadWatch::start();
    console.run_begins();
    let runs: Vec<Run> = pool
        .install(|| converge(&task, session.environment.interrupt(), |part| console.show(part, scene.name.clone())));
    console.run_ends();
    if runs.iter().all(|r| r.points.is_empty()) {
        return Err(Failure::Interrupted);
    }
    let mut study = SceneStudy {
        scene: scene.name.clone(),
        file: path.display().to_string(),
        size: reference.size,
        triangles: scene.scene.geometry.triangle_count(),
        reference: reference.facts.clone(),
        methods: scene.methods.iter().map(MethodSummary::from).collect(),
        runs,
        speed_ups: vec![],
        load: watch.finish(),
    };
    study.answer(baseline, args.target);
    Ok(study)
}
