//! `lightsieve converge`: error against time.

use super::Failure;
use super::measure_args::ConvergeArgs;
use super::render::progress_bar;
use super::stage::{Set, Stage, command_line, reference_failure, to_json, write_text};
use crate::measure::converge::{Run, converge};
use crate::measure::curve::csv;
use crate::measure::reference::Reference;
use crate::measure::study::{Method, SceneStudy, Study};
use crate::measure::{LoadWatch, Machine};
use std::path::Path;
use std::sync::atomic::Ordering;

pub(crate) fn run(args: &ConvergeArgs) -> Result<(), Failure> {
    if args.reference.is_some() && args.scenes.len() > 1 {
        return Err(Failure::Input("--reference belongs to one scene, and there are more".into()));
    }
    let stage = Stage::new(&args.measure)?;
    let first = || stage.methods.first().map(|m| m.label.clone()).unwrap_or_default();
    let baseline = args.baseline.clone().unwrap_or_else(first);
    if !stage.methods.iter().any(|m| m.label == baseline) {
        return Err(Failure::Input(format!("--baseline {baseline} is not among the methods")));
    }
    let seeds: Vec<u64> = (1..=args.seeds).collect();
    let (mut scenes, mut references, mut backend) = (vec![], vec![], String::new());
    for path in &args.scenes {
        let set = stage.set(path, Some(&args.references))?;
        let reference = match &args.reference {
            Some(path) => Reference::read(path).map_err(reference_failure)?,
            None => stage.reference(&set, &args.references)?,
        };
        check(&set, &reference, &seeds)?;
        let study = one_scene(args, &stage, (path, &set, &reference), &seeds, &baseline)?;
        stage.say(&format!("\n{}: {}", study.scene, study.load.sentence()));
        stage.say(&study.reference.sentence());
        if !args.measure.json {
            for line in study.end_table().lines().iter().chain(&[String::new()]).chain(&study.speed_table().lines()) {
                out!("{line}");
            }
            out!("");
        }
        backend = set.scene.query.describe();
        scenes.push(study);
        references.push(reference);
        if stage.interrupt.load(Ordering::Relaxed) {
            break;
        }
    }
    let machine = Machine::here(stage.threads, backend);
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
        for (name, text) in
            [("converge.json", to_json(&study)?), ("converge.csv", rows), ("index.html", study.page(&references))]
        {
            stage.say(&format!("wrote {}", write_text(folder, name, &text)?.display()));
        }
    }
    if stage.interrupt.load(Ordering::Relaxed) { Err(Failure::Interrupted) } else { Ok(()) }
}

/// A reference that is of another size, or that holds the very samples that it is to judge.
fn check(set: &Set, reference: &Reference, seeds: &[u64]) -> Result<(), Failure> {
    let size = [set.scene.window[2], set.scene.window[3]];
    if reference.size != size {
        let [a, b] = [reference.size, size].map(|[w, h]| format!("{w} x {h}"));
        return Err(Failure::Input(format!("the reference has {a} pixels, {} is rendered with {b}", set.name)));
    }
    let used = reference.facts.seeds.iter().flat_map(|s| s.split_whitespace()).filter_map(|s| s.parse::<u64>().ok());
    if let Some(seed) = used.into_iter().find(|s| seeds.contains(s)) {
        return Err(Failure::Input(format!(
            "the reference was rendered with seed {seed}, which is measured here: its samples would judge themselves"
        )));
    }
    Ok(())
}

fn one_scene(
    args: &ConvergeArgs,
    stage: &Stage,
    (path, set, reference): (&Path, &Set, &Reference),
    seeds: &[u64],
    baseline: &str,
) -> Result<SceneStudy, Failure> {
    let bar = progress_bar(args.measure.quiet);
    let total = args.time.as_secs_f64() * (seeds.len() * set.contenders.len()) as f64;
    let watch = LoadWatch::start();
    let runs: Vec<Run> = stage.pool.install(|| {
        converge(&set.scene, &set.contenders, &reference.pixels, (args.time, seeds), &stage.interrupt, |seconds| {
            bar.set_position((seconds / total * bar.length().unwrap_or(1) as f64) as u64);
            bar.set_message(set.name.clone());
        })
    });
    bar.finish_and_clear();
    if runs.iter().all(|r| r.points.is_empty()) {
        return Err(Failure::Interrupted);
    }
    let method = |c: &crate::measure::Contender| Method {
        label: c.label.clone(),
        integrator: c.spec.name,
        parameters: c.parameters(),
        unbiased: c.spec.unbiased,
    };
    let mut study = SceneStudy {
        scene: set.name.clone(),
        file: path.display().to_string(),
        size: reference.size,
        triangles: set.scene.geometry.triangle_count(),
        reference: reference.facts.clone(),
        methods: set.contenders.iter().map(method).collect(),
        runs,
        speed_ups: vec![],
        load: watch.finish(),
    };
    study.answer(baseline, args.target);
    Ok(study)
}
