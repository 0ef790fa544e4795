//! `lightsieve render`.

use super::Failure;
use super::cli::{Query, RenderArgs};
use super::config::Config;
use super::{pyramid, report};
use crate::film::Film;
use crate::image::{OutputFormat, atomic_write, write_picture};
use crate::integrators::Iteration;
use crate::prepared::{PrepareOptions, PreparedScene};
use crate::render::stats::Clock;
use crate::render::stats::ErrorEstimate;
use crate::render::{
    Checkpoint, CheckpointError, Progress, RenderStats, Stop, aov, error_target, output, render, render_to_target,
};
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between checkpoints.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(60);

pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    // What is typed wrong is said before anything is loaded.
    for path in &args.output {
        OutputFormat::of(path).map_err(Failure::input)?;
    }
    for path in args.output.iter().chain(&args.stats).chain(&args.checkpoint) {
        check_writable(path)?;
    }
    let mut phases = BTreeMap::new();
    let mut clock = Clock::default();
    let (desc, mut diagnostics) = clock.time(|| report::load(&args.scene, args.quiet))?;
    phases.insert("load", clock.total().as_secs_f64());

    let already_said = diagnostics.list.len();
    let config = Config::resolve(args, &desc, &mut diagnostics)?;
    if args.print_config {
        diagnostics.list.drain(..already_said);
        if !args.quiet {
            report::print(&diagnostics);
        }
        config.print(args);
        return Ok(());
    }
    let textures = desc.textures.len();
    let mut clock = Clock::default();
    let options = PrepareOptions {
        backend: Query::backend(args.what.query),
        threads: config.threads,
        size: args.what.size,
        crop: args.what.crop,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(config.threads).build().map_err(Failure::input)?;
    let prepared = clock.time(|| pool.install(|| PreparedScene::build(desc, &options, &mut diagnostics)));
    diagnostics.list.drain(..already_said);
    if !args.quiet || diagnostics.has_errors() {
        report::print(&diagnostics);
    }
    let scene = prepared.map_err(Failure::input)?;
    phases.insert("prepare", clock.total().as_secs_f64());
    phases.insert("tree", scene.tree_seconds);
    if let (Some(what), false) = ((config.spec.limitations)(scene.features), args.quiet) {
        note!("warning: {}: {what}", config.spec.name);
    }

    let params = config.params.pairs();
    let identity = (args.checkpoint.is_some() || args.resume.is_some())
        .then(|| Checkpoint::new(&scene, config.spec.name, &params, args.what.seed));
    let (mut film, state) = match (&args.resume, &identity) {
        (Some(path), Some(identity)) => identity.load(path).map_err(checkpoint_failure)?,
        _ => (Film::new(scene.window), vec![]),
    };

    let interrupt = Arc::new(AtomicBool::new(false));
    catch_ctrl_c(interrupt.clone())?;
    let bar = progress_bar(args.quiet);
    let mut last_checkpoint = Instant::now();
    let mut trouble = None;
    let mut integrator = (config.spec.build)(&config.params);
    let next = Iteration { scene: &scene, seed: args.what.seed, index: film.iterations() };
    if !pool.install(|| integrator.restore(&next, &state)) {
        return Err(Failure::Input("the checkpoint does not hold what this integrator has learnt".into()));
    }
    if args.pyramid.is_some() && !integrator.keep_pyramid(scene.window, args.pyramid_depth as usize) {
        let reason =
            format!("{} has no techniques to tell apart; --pyramid needs a bidirectional integrator", config.spec.name);
        return Err(Failure::Input(reason));
    }
    let mut estimate = None;
    let outcome = pool.install(|| {
        if let Some(target) = &args.error_target {
            let build = || (config.spec.build)(&config.params);
            let what = (args.what.seed, config.budget, target);
            let (outcome, found) = render_to_target(&scene, build, &mut film, what, &interrupt, |progress, found| {
                show(&bar, progress);
                if let Some(found) = found {
                    bar.set_message(format!("{} spp  {} about {found:.2e}", progress.iterations, target.key));
                }
            });
            let seeds = error_target::seeds(args.what.seed);
            estimate = Some(ErrorEstimate { measure: target.key, target: target.value, estimate: found, seeds });
            return outcome;
        }
        render(
            &scene,
            &mut *integrator,
            &mut film,
            args.what.seed,
            config.budget,
            &interrupt,
            |progress, film, state| {
                show(&bar, progress);
                if let (Some(path), Some(identity)) = (&args.checkpoint, &identity)
                    && last_checkpoint.elapsed() > CHECKPOINT_EVERY
                {
                    trouble = trouble.take().or(identity.save(path, film, &state()).err());
                    last_checkpoint = Instant::now();
                }
            },
        )
    });
    bar.finish_and_clear();
    if film.iterations() == 0 {
        // Interrupted before there was anything: an earlier picture is worth more than a black one.
        return Err(Failure::Interrupted);
    }
    if let (Some(path), Some(identity)) = (&args.checkpoint, &identity) {
        trouble = identity.save(path, &film, &integrator.state()).err();
    }

    let run = (args.what.seed, config.threads, config.spec.name);
    let mut stats = RenderStats::new(&scene, &film, &outcome, phases, textures, run);
    stats.error = estimate;
    let mut clock = Clock::default();
    let (mut written, mut result) = clock.time(|| pool.install(|| write_outputs(args, &config, &scene, &film, &stats)));
    if let (Some(folder), Some(pyramid)) = (&args.pyramid, integrator.pyramid()) {
        match pyramid::write(folder, pyramid, &metadata(args, &config, &stats), args.exposure) {
            Ok(files) => written.extend(files),
            Err(e) => result = result.and(Err(e)),
        }
    }
    stats.phases.insert("output", clock.total().as_secs_f64());
    if let Some(path) = &args.stats {
        write_json(path, &stats)?;
    }
    if !args.quiet {
        summarise(&stats, &written);
        if written.is_empty() {
            note!("no output file was asked for (-o FILE)");
        }
    }
    result?;
    if let Some(e) = trouble {
        return Err(checkpoint_failure(e));
    }
    if outcome.stop == Stop::Interrupted {
        return Err(Failure::Interrupted);
    }
    if args.scene.strict && stats.non_finite > 0 {
        return Err(Failure::NonFinite(stats.non_finite));
    }
    Ok(())
}

fn checkpoint_failure(e: CheckpointError) -> Failure {
    match e {
        CheckpointError::Io { .. } => Failure::io(e),
        CheckpointError::Format { .. } | CheckpointError::Other { .. } => Failure::input(e),
    }
}

/// A file that cannot be written would be found out only after hours of rendering. Nothing is changed: what is there is opened
/// only (unless it is a pipe, whose reader would notice), and what is not there is tried out under another name.
fn check_writable(path: &Path) -> Result<(), Failure> {
    let refused = |e: std::io::Error| Failure::Io(format!("{}: cannot be written: {e}", path.display()));
    if let Ok(there) = path.metadata() {
        if !there.is_file() && !there.is_dir() {
            return Ok(());
        }
        return OpenOptions::new().write(true).open(path).map(drop).map_err(refused);
    }
    let folder =
        path.parent().filter(|p| !p.as_os_str().is_empty()).map_or_else(|| PathBuf::from("."), Path::to_path_buf);
    if !folder.is_dir() {
        return Err(Failure::Io(format!("{}: the folder does not exist", path.display())));
    }
    let trial = folder.join(format!(".lightsieve-{}.trial", std::process::id()));
    File::create(&trial).and_then(|_| std::fs::remove_file(&trial)).map_err(refused)
}

/// The first Ctrl-C lets the iteration end and everything be written; the second quits at once.
pub(super) fn catch_ctrl_c(interrupt: Arc<AtomicBool>) -> Result<(), Failure> {
    ctrlc::set_handler(move || {
        if interrupt.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(Failure::input)
}

const BAR_STEPS: u64 = 1000;

pub(super) fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(BAR_STEPS);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  ETA {eta}") {
        bar.set_style(style);
    }
    bar
}

pub(super) fn show(bar: &ProgressBar, progress: &Progress) {
    bar.set_position((progress.done * BAR_STEPS as f64) as u64);
    let rate = progress.rays as f64 / progress.elapsed.as_secs_f64().max(1e-9);
    bar.set_message(format!("{} spp  {:.2} Mrays/s", progress.iterations, rate / 1e6));
}

/// Writes every output; one that cannot be written does not cost the others. Returns what was written, and what went wrong first.
fn write_outputs(
    args: &RenderArgs,
    config: &Config,
    scene: &PreparedScene,
    film: &Film,
    stats: &RenderStats,
) -> (Vec<PathBuf>, Result<(), Failure>) {
    let (mut written, mut result) = (vec![], Ok(()));
    if args.output.is_empty() {
        return (written, result);
    }
    let layers = if config.aovs.is_empty() { vec![] } else { aov::layers(scene, film, args.what.seed, &config.aovs) };
    let picture = output::picture(film, layers, metadata(args, config, stats));
    for path in &args.output {
        match write_picture(path, &picture, args.exposure) {
            Ok(()) => written.push(path.clone()),
            Err(e) => result = result.and(Err(Failure::io(e))),
        }
    }
    (written, result)
}

fn metadata(args: &RenderArgs, config: &Config, stats: &RenderStats) -> Vec<(String, String)> {
    // With an error target two renders were made one.
    let seeds: Vec<String> =
        stats.error.map_or_else(|| vec![stats.seed], |e| e.seeds.to_vec()).iter().map(u64::to_string).collect();
    let params: Vec<String> = config.params.pairs().into_iter().map(|(k, v)| format!("{k}={v}")).collect();
    [
        ("software", format!("lightsieve {}", stats.version)),
        ("scene", args.scene.scene.display().to_string()),
        ("integrator", config.spec.name.to_string()),
        ("parameters", params.join(" ")),
        ("iterations", stats.iterations.to_string()),
        ("seed", seeds.join(" ")),
        ("backend", stats.backend.clone()),
        ("nonFinite", stats.non_finite.to_string()),
        ("renderSeconds", format!("{:.3}", stats.wall_s)),
        ("unbiased", config.spec.unbiased.to_string()),
    ]
    .into_iter()
    .map(|(k, v)| (format!("lightsieve:{k}"), v))
    .collect()
}

fn write_json(path: &Path, stats: &RenderStats) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(stats).map_err(Failure::io)?;
    atomic_write(path, |w| w.write_all(json.as_bytes()).and_then(|()| w.write_all(b"\n")))
        .map_err(|e| Failure::Io(format!("{}: {e}", path.display())))
}

fn summarise(stats: &RenderStats, written: &[PathBuf]) {
    note!(
        "{} samples per pixel in {:.2} s ({:.2} Mrays/s, {:.0} % of the time in ray queries, {})",
        stats.iterations,
        stats.wall_s,
        stats.rays_per_s / 1e6,
        100.0 * stats.ray_query_share,
        stats.backend
    );
    for line in &stats.notes {
        note!("{}: {line}", stats.integrator);
    }
    if let Some(e) = &stats.error {
        let estimate = e.estimate.map_or("not known".into(), |v| format!("{v:.3e}"));
        note!("{} by estimate {estimate} (target {:e})", e.measure, e.target);
    }
    if stats.non_finite > 0 {
        note!("warning: {} samples were not finite and were left out; the first:", stats.non_finite);
        for p in &stats.non_finite_at {
            note!("  pixel {},{} iteration {}", p.x, p.y, p.iteration);
        }
    }
    for path in written {
        note!("wrote {}", path.display());
    }
}
