//! Arguments of the commands. `config` turns them into requests.

use super::measure_args::{BenchArgs, ConvergeArgs, MergeArgs, ProfileArgs};
use crate::ray::Backend;
use crate::render::ErrorTarget;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// An offline, physically based renderer that sifts light paths.
#[derive(Debug, Parser)]
#[command(
    version,
    max_term_width = 110,
    after_help = "Exit codes: 0 fine, 1 non-finite samples under --strict, a required error target that is not reached, or a \
                  regression found by bench, \
                  2 bad usage or input, 3 files cannot be read or written, 130 interrupted.\n\
                  The same seed gives the same bits for any number of threads; --time may stop at another iteration \
                  each time."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene to images
    Render(Box<RenderArgs>),
    /// Show what is in a scene: counts, bytes, features, textures, diagnostics
    Info(InfoArgs),
    /// List integrators, or one with its parameters
    List(ListArgs),
    /// Compare the ray-query backends on a scene
    CheckRays(CheckRaysArgs),
    /// Run one sample of one pixel again and print its vertices, densities, weights and contributions
    Replay(Box<ReplayArgs>),
    /// Error metrics of an image against a reference
    Compare(CompareArgs),
    /// Error against time, of several integrators side by side
    Converge(Box<ConvergeArgs>),
    /// Where the time of an integrator goes, and what bare ray queries would need
    Profile(Box<ProfileArgs>),
    /// Make one picture of renders with different seeds
    Merge(MergeArgs),
    /// Measure all scenes with all integrators, and compare with an earlier day
    Bench(Box<BenchArgs>),
}

/// Scene file and how it is read.
#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// Scene file: Mitsuba XML (.xml), OBJ with MTL (.obj) or PLY (.ply)
    pub scene: PathBuf,
    /// Set a variable of the scene file
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = pair)]
    pub define: Vec<(String, String)>,
    /// Treat missing textures as errors, and non-finite samples as failure
    #[arg(long)]
    pub strict: bool,
    /// Render without what is not supported, with a warning
    #[arg(long)]
    pub force: bool,
    /// Camera position, for scenes without a camera (OBJ, PLY)
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub camera_origin: Option<[f64; 3]>,
    /// Point the camera looks at
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub camera_target: Option<[f64; 3]>,
    /// Direction that is up in the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub camera_up: Option<[f64; 3]>,
    /// Horizontal field of view in degrees
    #[arg(long, value_name = "DEGREES")]
    pub camera_fov: Option<f64>,
}

/// The samples that are rendered, or one of them to be replayed.
#[derive(Debug, Args)]
pub(crate) struct SampleArgs {
    /// Integrator (see `lightsieve list`)
    #[arg(short, long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Parameter of the integrator (see `lightsieve list -i NAME`)
    #[arg(short, long, value_name = "KEY=VALUE", value_parser = pair)]
    pub param: Vec<(String, String)>,
    /// Seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Picture size instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Only this part is rendered, in pixels of the full picture
    #[arg(long, value_name = "X,Y,W,H", value_parser = crop)]
    pub crop: Option<[u32; 4]>,
    /// Largest number of edges of a path; short for -p max_depth=N
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub max_depth: Option<i64>,
    /// Ray-query backend
    #[arg(long, value_name = "BACKEND", value_enum)]
    pub query: Option<Query>,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Output image: .exr (linear, all layers), .pfm (linear) or .png (sRGB); may be given several times
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    #[command(flatten)]
    pub sample: SampleArgs,
    /// Samples per pixel (iterations)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub spp: Option<u64>,
    /// Time budget of the iterations, e.g. 30s, 5m, 1.5h
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub time: Option<Duration>,
    /// Stop when the estimated error is below, e.g. relmse=0.01 (also relmse_trimmed, mape, mae, mse, rmse; for means
    /// of blocks of pixels relmse_8x8, relmse_16x16, relmse_32x32, for the mean of the picture relmse_whole); renders
    /// two halves with seeds of their own, whose difference tells
    #[arg(long, value_name = "MEASURE=VALUE", value_parser = ErrorTarget::parse)]
    pub error_target: Option<ErrorTarget>,
    /// Exit with code 1 if the error target is not reached
    #[arg(long, requires = "error_target")]
    pub require_error_target: bool,
    /// Threads [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Exposure of PNG output in stops
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_hyphen_values = true, value_parser = exposure)]
    pub exposure: f32,
    /// Write statistics as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Auxiliary layers in EXR output: albedo, normal, depth
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub aov: Vec<String>,
    /// Also write the picture of every technique, raw and weighted, to this folder (bidirectional integrators)
    #[arg(long, value_name = "DIR")]
    pub pyramid: Option<PathBuf>,
    /// Longest paths of the pyramid, in edges
    #[arg(long, value_name = "N", default_value_t = 6, requires = "pyramid", value_parser = clap::value_parser!(u64).range(1..=32))]
    pub pyramid_depth: u64,
    /// Save a checkpoint every minute and at the end
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// Least time between two checkpoints, which are saved between iterations [default: 60s]
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub checkpoint_interval: Option<Duration>,
    /// Go on from a checkpoint, and save to the same file unless --checkpoint names another
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
    /// Print what the command line and the scene resolve to, and stop
    #[arg(long)]
    pub print_config: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ReplayArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Column and row of the pixel in the full picture
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pub pixel: [u32; 2],
    /// Iteration, from zero
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub iteration: u64,
    #[command(flatten)]
    pub sample: SampleArgs,
}

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Write the skeleton of empty space, nodes and edges, as lines: .ply or .obj
    #[arg(long, value_name = "FILE")]
    pub skeleton: Option<PathBuf>,
    /// Draw the skeleton over the camera's view: .png, .exr or .pfm
    #[arg(long, value_name = "FILE")]
    pub skeleton_image: Option<PathBuf>,
    /// Cubes along the longest side of the scene from which the skeleton is made [default: 120, and up to 240 for
    /// flat scenes]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=512))]
    pub voxel_resolution: Option<u32>,
}

#[derive(Debug, Args)]
pub(crate) struct ListArgs {
    /// Show this integrator's parameters
    #[arg(short, long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Print the full descriptions
    #[arg(short, long)]
    pub long: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CheckRaysArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Random rays (and as many segments) to compare
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    pub rays: u64,
    /// Seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Image to compare with the reference
    pub image: PathBuf,
    /// Reference
    pub reference: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Nothing but results and errors is printed anyway; for symmetry with other commands
    #[arg(long, hide = true)]
    pub quiet: bool,
    /// Write a picture of the relative squared errors: .png, .exr or .pfm
    #[arg(long, value_name = "FILE")]
    pub error_image: Option<PathBuf>,
    /// Let that picture show the sign: red where the image is too bright, blue where it is too dark
    #[arg(long, requires = "error_image")]
    pub signed: bool,
}

/// Ray-query backends by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Query {
    /// Debian's Embree
    Embree,
    /// Pure Rust
    Obvhs,
}

impl Query {
    pub fn backend(query: Option<Query>) -> Backend {
        match query {
            Some(Query::Embree) => Backend::Embree,
            Some(Query::Obvhs) => Backend::Obvhs,
            None => Backend::default_available(),
        }
    }
}

pub(super) fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.into(), value.into())),
        _ => Err("expected name=value".into()),
    }
}

fn numbers<T: std::str::FromStr, const N: usize>(text: &str, separator: char, what: &str) -> Result<[T; N], String> {
    let parsed: Option<Vec<T>> = text.split(separator).map(|v| v.trim().parse().ok()).collect();
    parsed.and_then(|v| v.try_into().ok()).ok_or_else(|| format!("expected {what}"))
}

fn triple(text: &str) -> Result<[f64; 3], String> {
    let v: [f64; 3] = numbers(text, ',', "three numbers x,y,z")?;
    if v.iter().all(|c| c.is_finite()) { Ok(v) } else { Err("expected finite numbers".into()) }
}

pub(super) fn size(text: &str) -> Result<[u32; 2], String> {
    numbers(text, 'x', "width and height, e.g. 640x360")
}

fn pixel(text: &str) -> Result<[u32; 2], String> {
    numbers(text, ',', "column and row, e.g. 120,45")
}

fn crop(text: &str) -> Result<[u32; 4], String> {
    numbers(text, ',', "x,y,width,height")
}

/// Stops of exposure: beyond 100 every value is black or white.
pub(super) fn exposure(text: &str) -> Result<f32, String> {
    let stops = text.parse().ok().filter(|v: &f32| v.abs() <= 100.0);
    stops.ok_or_else(|| "expected a number of stops between -100 and 100".into())
}

pub(super) fn duration(text: &str) -> Result<Duration, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match &text[digits.len()..] {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("expected a time such as 30s, 5m or 1.5h".into()),
    };
    match digits.parse::<f64>().map(|v| v * unit) {
        Ok(s) if s > 0.0 && s < 1e9 => Ok(Duration::from_secs_f64(s)),
        _ => Err("expected a time above zero such as 30s, 5m or 1.5h".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn times_have_units() {
        assert_eq!(duration("90"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("250ms"), Ok(Duration::from_millis(250)));
        for bad in ["", "s", "-3s", "0", "3 parsecs", "nan", "inf"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn exposures_are_finite() {
        assert_eq!(exposure("-2.5"), Ok(-2.5));
        for bad in ["nan", "inf", "-inf", "1e9", "bright"] {
            assert!(exposure(bad).is_err(), "{bad}");
        }
    }
}
