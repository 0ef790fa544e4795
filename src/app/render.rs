//! `lightsieve render`.

use super::Failure;
use super::cli::RenderArgs;
use super::config::print_plan;
use super::environment::Environment;
use super::numbers::number;
use crate::render::{Finished, JobError, Observer, RenderRequest, Stop, job};

pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    let environment = Environment::new(args.threads, args.quiet)?;
    let request = args.request(&environment)?;
    if args.print_config {
        return print_config(&request, &environment);
    }
    if request.keeps_nothing() {
        return Err(Failure::Input("nothing of the render would be kept: name an output file (-o FILE)".into()));
    }
    let finished = job::render(&request, environment.runtime())?;
    if !args.quiet {
        summarise(&finished, args);
    }
    if let Some(failure) = last_failure(finished.failures) {
        return Err(failure);
    }
    if finished.stop == Stop::Interrupted {
        return Err(Failure::Interrupted);
    }
    if args.scene.strict && finished.stats.non_finite > 0 {
        return Err(Failure::NonFinite(finished.stats.non_finite));
    }
    match &finished.stats.error {
        Some(error) if args.require_error_target && !error.is_reached() => Err(Failure::Target),
        _ => Ok(()),
    }
}

/// Prints all failures but the last, which decides the exit code.
fn last_failure(failures: Vec<JobError>) -> Option<Failure> {
    let mut failures = failures.into_iter().map(Failure::from);
    let last = failures.next_back();
    failures.for_each(|failure| failure.print());
    last
}

/// The first two steps of the pipeline alone.
fn print_config(request: &RenderRequest, environment: &Environment) -> Result<(), Failure> {
    request.check_files()?;
    let mut loaded = job::load(&request.scene, environment.runtime())?;
    request.check_scene_files(&loaded.desc)?;
    let plan = job::resolve(request, &mut loaded)?;
    environment.console.diagnostics(&loaded.diagnostics);
    print_plan(request, &plan);
    Ok(())
}

fn summarise(finished: &Finished, args: &RenderArgs) {
    let stats = &finished.stats;
    note!(
        "{} samples per pixel in {:.2} s ({:.2} Mrays/s, {:.0} % of the time in ray queries, {})",
        stats.iterations,
        stats.wall_s,
        stats.rays_per_s / 1e6,
        100.0 * stats.ray_query_share,
        stats.backend
    );
    if let (Some(time), 1) = (args.time, finished.new_iterations) {
        note!(
            "a single iteration takes {:.2} s: --time {:.2}s leaves room for no other",
            stats.wall_s,
            time.as_secs_f64()
        );
    }
    for line in &stats.notes {
        note!("{}: {line}", stats.integrator);
    }
    if let Some(e) = &stats.error {
        let estimate = e.estimate.map_or("not known".into(), number);
        let reached = if e.is_reached() { "" } else { ": not reached" };
        note!("{} by estimate {estimate} (target {}){reached}", e.measure, number(e.target));
    }
    if stats.non_finite > 0 {
        note!("warning: {} samples were not finite and were left out; the first:", stats.non_finite);
        for p in &stats.non_finite_at {
            note!("  pixel {},{} iteration {}: {}", p.x, p.y, p.iteration, p.source.name());
        }
    }
    if !stats.scene_changes.is_empty() {
        note!("warning: the picture is another than the scene file asks for:");
        for line in &stats.scene_changes {
            note!("  {line}");
        }
    }
    for path in &finished.written {
        note!("wrote {}", path.display());
    }
}
