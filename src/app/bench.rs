//! `lightsieve bench`: all scenes with all integrators, against earlier measurements.

use super::Failure;
use super::measure_args::BenchArgs;
use super::session::{SceneMethods, Session, to_json};
use crate::image::{atomic_write, read_regular_text};
use crate::measure::bench::{Baseline, Change, Judged, Row, Table as Measured, Verdict, against, calibrate};
use crate::measure::converge::{EqualTimeTask, converge};
use crate::measure::curve::runs_of;
use crate::measure::report::Table;
use crate::measure::{LoadWatch, Machine};
use crate::render::files::write_or_rescue;
use crate::render::{Method, OutputFiles};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Output of `--json`.
#[derive(Serialize)]
struct Answer<'a> {
    #[serde(flatten)]
    measured: &'a Measured,
    #[serde(skip_serializing_if = "Option::is_none")]
    against: Option<&'a [Verdict]>,
}

pub(crate) fn run(args: &BenchArgs) -> Result<(), Failure> {
    let baseline = args.against.as_deref().map(read).transpose()?;
    let scenes = find_scenes(&args.folder)?;
    let mut outputs = OutputFiles::default();
    args.save.iter().for_each(|path| outputs.add("--save", path));
    let inputs = scenes.iter().chain(&args.against).map(PathBuf::as_path);
    let session = Session::new(&args.measure, outputs, inputs)?;
    let (watch, mut rows, mut backend) = (LoadWatch::start(), vec![], String::new());
    for path in &scenes {
        let scene = session.prepare(path, Some(&args.references))?;
        session.say(&format!("{}: {} methods", scene.name, scene.methods.len()));
        rows.extend(one_scene(args, &session, &scene)?);
        backend = scene.scene.query.describe();
        if session.environment.is_interrupted() {
            return Err(Failure::Interrupted);
        }
    }
    let measured =
        Measured { machine: Machine::here(session.environment.threads, backend), load: watch.finish(), rows };
    let judged = match (&baseline, args.allow_busy) {
        (Some(old), false) => Judged::under([old.load.as_ref(), Some(&measured.load)]),
        _ => Judged::All,
    };
    let verdicts = baseline.as_ref().map(|old| against(&old.rows, &measured.rows, judged));
    if args.measure.json {
        out!("{}", to_json(&Answer { measured: &measured, against: verdicts.as_deref() })?);
    } else {
        print(&measured.rows, verdicts.as_deref());
    }
    session.say(&measured.load.sentence());
    if let Some(warning) = measured.load.warning() {
        note!("warning: {warning}");
    }
    if let Some(path) = &args.save {
        let text = to_json(&measured)?;
        write_or_rescue(path, |path| {
            atomic_write(path, |w| writeln!(w, "{text}")).map_err(|e| format!("{}: {e}", path.display()))
        })?;
    }
    let worse = verdicts.iter().flatten().filter(|v| v.is_worse()).count();
    match (verdicts, worse) {
        (Some(v), _) if v.is_empty() => {
            Err(Failure::Input("the baseline has none of these scenes and methods: nothing was compared".into()))
        }
        (Some(_), 0) if judged == Judged::Errors => Err(Failure::NotJudged),
        (_, 0) => Ok(()),
        (_, n) => Err(Failure::Regression(n)),
    }
}

fn read(path: &Path) -> Result<Baseline, Failure> {
    let text = read_regular_text(path).map_err(|e| Failure::Io(format!("{}: {e}", path.display())))?;
    serde_json::from_str(&text)
        .map_err(|e| Failure::Input(format!("{}: not what `bench --save` writes: {e}", path.display())))
}

/// The folder's .xml files and those of the folders in it, in the order of their names.
fn find_scenes(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let list = |folder: &Path| -> Result<Vec<PathBuf>, Failure> {
        let io = |e: std::io::Error| Failure::Io(format!("{}: {e}", folder.display()));
        let entries = std::fs::read_dir(folder).map_err(io)?;
        let mut paths = entries.map(|e| e.map(|e| e.path())).collect::<Result<Vec<_>, _>>().map_err(io)?;
        paths.sort();
        Ok(paths)
    };
    let is_scene = |path: &PathBuf| path.is_file() && path.extension().is_some_and(|e| e == "xml");
    let mut scenes = vec![];
    for path in list(folder)? {
        if path.is_dir() {
            scenes.extend(list(&path)?.into_iter().filter(is_scene));
        } else if is_scene(&path) {
            scenes.push(path);
        }
    }
    if scenes.is_empty() {
        return Err(Failure::Input(format!("{}: there are no scenes (.xml) in this folder", folder.display())));
    }
    Ok(scenes)
}

fn one_scene(args: &BenchArgs, session: &Session, scene: &SceneMethods) -> Result<Vec<Row>, Failure> {
    let reference = session.reference(scene, &args.references)?;
    let seeds: Vec<u64> = (1..=args.seeds).collect();
    let task = EqualTimeTask {
        scene: &scene.scene,
        methods: &scene.methods,
        reference: &reference.pixels,
        time: args.time,
        seeds: &seeds,
    };
    let (before, runs, after) = session.environment.pool.install(|| {
        let before = calibrate();
        let runs = converge(&task, session.environment.interrupt(), |_| {});
        (before, runs, calibrate())
    });
    let calibration = 0.5 * (before + after);
    let row = |m: &Method| Row::new(&scene.name, &m.label, &runs_of(&runs, &m.label), calibration);
    Ok(scene.methods.iter().map(row).collect())
}

fn print(rows: &[Row], verdicts: Option<&[Verdict]>) {
    let mut head = vec!["scene", "method", "ms per sample", "samples", "relMSE", "relMSE x seconds"];
    if verdicts.is_some() {
        head.extend(["time", "error", "error of 16x16 blocks", ""]);
    }
    let mut table = Table::new(head);
    for row in rows {
        let (samples, error) = row.last_error().unwrap_or((0, f64::NAN));
        let mut cells = vec![
            row.scene.clone(),
            row.method.clone(),
            format!("{:.3}", 1e3 * row.seconds()),
            samples.to_string(),
            format!("{error:.3e}"),
            format!("{:.3e}", error * samples as f64 * row.seconds()),
        ];
        let verdict = verdicts.into_iter().flatten().find(|v| v.scene == row.scene && v.method == row.method);
        if let Some(v) = verdict {
            let ratio = |change: Option<Change>| change.map_or("–".into(), |e| format!("x {:.3}", e.ratio));
            cells.extend([v.time, v.error, v.block_error].map(ratio));
            let worse = |(change, what): (Option<Change>, &str)| {
                change.filter(|e| e.regression).map(|e| format!("{what} (bound {:.3})", e.bound))
            };
            let changes = [(v.time, "slower"), (v.error, "worse"), (v.block_error, "blocks worse")];
            cells.push(changes.into_iter().filter_map(worse).collect::<Vec<_>>().join(", "));
        }
        table.row(cells);
    }
    for line in table.lines() {
        out!("{line}");
    }
}
