//! `lightsieve merge`: renders of one picture with different seeds, made one.

use super::Failure;
use super::measure_args::MergeArgs;
use crate::image::{ExrFile, ImageError, ImageFault, OutputFormat, write_picture};
use crate::measure::merge::merge;
use crate::render::OutputFiles;
use std::path::PathBuf;

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
    for path in &args.output {
        write_picture(path, &picture, args.exposure).map_err(Failure::io)?;
        if !args.quiet {
            let of = |key: &str| picture.metadata.iter().find(|(k, _)| k == key).map_or("", |(_, v)| v.as_str());
            note!(
                "wrote {}: {} samples per pixel of the seeds {}",
                path.display(),
                of("lightsieve:iterations"),
                of("lightsieve:seed")
            );
        }
    }
    Ok(())
}
