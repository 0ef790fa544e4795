//! `lightsieve merge`: renders of one picture with different seeds, made one.

use super::Failure;
use super::measure_args::MergeArgs;
use super::session::to_json;
use crate::image::{ExrFile, ImageError, ImageFault, OutputFormat, write_picture};
use crate::measure::merge::merge;
use crate::render::OutputFiles;
use crate::render::files::write_or_rescue;
use serde::Serialize;
use std::path::PathBuf;

/// Output of `--json`.
#[derive(Serialize)]
struct Answer<'a> {
    /// Samples per pixel of all renders together.
    iterations: Option<u64>,
    seeds: Vec<&'a str>,
    written: &'a [PathBuf],
}

pub(crate) fn run(args: &MergeArgs) -> Result<(), Failure> {
    for path in &args.output {
        OutputFormat::of(path).map_err(Failure::input)?;
    }
    let mut outputs = OutputFiles::default();
    args.output.iter().for_each(|path| outputs.add("-o", path));
    outputs.check_inputs(args.renders.iter().map(PathBuf::as_path))?;
    outputs.check()?;
    let fault = |e: ImageError| match e.fault {
        ImageFault::Io(_) => Failure::io(&e),
        _ => Failure::input(&e),
    };
    let read = |path: &PathBuf| Ok((path.display().to_string(), ExrFile::read(path).map_err(fault)?));
    let files = args.renders.iter().map(read).collect::<Result<Vec<_>, Failure>>()?;
    let picture = merge(&files).map_err(Failure::input)?;
    let of = |key: &str| picture.metadata.iter().find(|(k, _)| k == key).map_or("", |(_, v)| v.as_str());
    let (iterations, seeds) = (of("lightsieve:iterations"), of("lightsieve:seed"));
    for path in &args.output {
        write_or_rescue(path, |path| write_picture(path, &picture, args.exposure))?;
        if !args.quiet {
            note!("wrote {}: {iterations} samples per pixel of the seeds {seeds}", path.display());
        }
    }
    if args.json {
        let seeds = seeds.split_whitespace().collect();
        out!("{}", to_json(&Answer { iterations: iterations.parse().ok(), seeds, written: &args.output })?);
    }
    Ok(())
}
