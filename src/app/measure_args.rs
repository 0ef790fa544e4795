//! Arguments of the measuring commands.

use super::cli::{Query, duration, exposure, pair, size};
use crate::measure::curve::{MEASURES, Measure};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of every measuring command.
#[derive(Debug, Args)]
pub(crate) struct MeasureArgs {
    /// Integrators, each with parameters if wanted: path,bdpt,bdpt:heuristic=power,max_depth=6 [default: all]
    #[arg(short, long, value_name = "NAMES")]
    pub integrators: Option<String>,
    /// Parameter of all methods that have it
    #[arg(short, long, value_name = "KEY=VALUE", value_parser = pair)]
    pub param: Vec<(String, String)>,
    /// Set a variable of the scene file
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = pair)]
    pub define: Vec<(String, String)>,
    /// Render without what is not supported in a scene, with a warning
    #[arg(long)]
    pub force: bool,
    /// Picture size instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Largest number of edges of a path, for all methods
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub max_depth: Option<i64>,
    /// Threads [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Ray-query backend
    #[arg(long, value_name = "BACKEND", value_enum)]
    pub query: Option<Query>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Print nothing but results and errors
    #[arg(long)]
    pub quiet: bool,
}

/// Source of references.
#[derive(Debug, Args)]
pub(crate) struct ReferenceArgs {
    /// Folder of rendered references [default: lightsieve in the user's cache]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Time for a reference that is not in the cache yet
    #[arg(long, value_name = "TIME", value_parser = duration, conflicts_with = "reference_spp")]
    pub reference_time: Option<Duration>,
    /// Samples per pixel of such a reference instead
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub reference_spp: Option<u64>,
    /// Integrator of such a reference, with parameters if wanted [default: the best of the unbiased ones that are measured,
    /// by short renders]
    #[arg(long, value_name = "NAME")]
    pub reference_integrator: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct ConvergeArgs {
    /// Scene files
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub measure: MeasureArgs,
    /// Render time of every method, with every seed
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "60s")]
    pub time: Duration,
    /// Number of seeds
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Reference of the scene (of one scene only) [default: one is rendered, and kept]
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    #[command(flatten)]
    pub references: ReferenceArgs,
    /// Method that speed-ups are relative to [default: the first]
    #[arg(long, value_name = "METHOD")]
    pub baseline: Option<String>,
    /// Error that times are compared at, e.g. relmse=0.01 [default: the smallest that both reach]
    #[arg(long, value_name = "MEASURE=VALUE", value_parser = target)]
    pub target: Option<(Measure, f64)>,
    /// Write converge.json, converge.csv and index.html to this folder
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ProfileArgs {
    /// Scene file
    pub scene: PathBuf,
    #[command(flatten)]
    pub measure: MeasureArgs,
    /// Render time; the replay of rays comes on top
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "20s")]
    pub time: Duration,
    /// Seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Write profile.json, cost.exr, blocked.exr and index.html to this folder
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// EXR files of one picture, rendered with different seeds
    #[arg(required = true)]
    pub renders: Vec<PathBuf>,
    /// Output image: .exr (all layers), .pfm or .png
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// Exposure of PNG output in stops
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_hyphen_values = true, value_parser = exposure)]
    pub exposure: f32,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    /// Folder of scenes: its .xml files, and those of the folders in it
    #[arg(default_value = "scenes")]
    pub folder: PathBuf,
    #[command(flatten)]
    pub measure: MeasureArgs,
    /// Render time of every method on every scene, with every seed
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "5s")]
    pub time: Duration,
    /// Number of seeds
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    #[command(flatten)]
    pub references: ReferenceArgs,
    /// Earlier measurements to compare with; it is a failure (exit code 1) if something is worse beyond noise
    #[arg(long, value_name = "FILE")]
    pub against: Option<PathBuf>,
    /// Judge times even if other programs used the processors during one of the measurements
    #[arg(long, requires = "against")]
    pub allow_busy: bool,
    /// Write the measurements, for a later --against
    #[arg(long, value_name = "FILE")]
    pub save: Option<PathBuf>,
}

fn target(text: &str) -> Result<(Measure, f64), String> {
    let known = || MEASURES.map(|m| m.key).join(", ");
    let (key, value) = text.split_once('=').ok_or_else(|| format!("expected MEASURE=VALUE, one of {}", known()))?;
    let measure = Measure::find(key).ok_or_else(|| format!("unknown measure \"{key}\"; known: {}", known()))?;
    let value = value.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    Ok((measure, value.ok_or("expected an error above zero")?))
}
