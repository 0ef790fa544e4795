//! The finish step: pictures with layers and metadata, the pyramid of techniques, and statistics as files.

use super::stats::Clock;
use super::{JobError, OutputRequest, Plan, PreparedJob, RenderRequest, RenderStats, Rendered, Stop, aov};
use crate::film::pyramid::PyramidLayer;
use crate::film::{Film, Pyramid};
use crate::image::{Layer, OutputFormat, Picture, atomic_write, write_picture};
use crate::math::Rgb;
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

/// End of a render.
pub struct Finished {
    /// Statistics.
    pub stats: RenderStats,
    /// Files that were written.
    pub written: Vec<PathBuf>,
    /// Reason for the end of the iterations.
    pub stop: Stop,
    /// The first failure to write a file or a checkpoint; one file that cannot be written does not cost the others.
    pub failure: Option<JobError>,
}

/// Name and value of an entry in the header of a picture.
type Metadata = Vec<(String, String)>;

impl RenderRequest {
    /// Checks the names of all files that are written at the end, so that no hours of rendering are lost.
    ///
    /// # Errors
    /// If a picture's format is not known, or a file cannot be written.
    pub fn check_files(&self) -> Result<(), JobError> {
        for path in &self.outputs.pictures {
            OutputFormat::of(path).map_err(JobError::input)?;
        }
        for path in self.outputs.pictures.iter().chain(&self.outputs.stats).chain(&self.checkpoint) {
            check_writable(path)?;
        }
        Ok(())
    }
}

/// Checks that a file can be written. Nothing is changed: an existing file is opened only (unless it is a pipe, whose
/// reader would notice), and one that does not exist is tried out under another name.
fn check_writable(path: &Path) -> Result<(), JobError> {
    let refused = |e: std::io::Error| JobError::File(format!("{}: cannot be written: {e}", path.display()));
    if let Ok(existing) = path.metadata() {
        if !existing.is_file() && !existing.is_dir() {
            return Ok(());
        }
        return OpenOptions::new().write(true).open(path).map(drop).map_err(refused);
    }
    let folder =
        path.parent().filter(|p| !p.as_os_str().is_empty()).map_or_else(|| PathBuf::from("."), Path::to_path_buf);
    if !folder.is_dir() {
        return Err(JobError::File(format!("{}: the folder does not exist", path.display())));
    }
    let trial = folder.join(format!(".lightsieve-{}.trial", std::process::id()));
    File::create(&trial).and_then(|_| std::fs::remove_file(&trial)).map_err(refused)
}

/// Writes everything that the request names, the statistics last. Runs on the current thread pool.
pub(super) fn write_all(prepared: &PreparedJob, plan: &Plan, rendered: Rendered, request: &RenderRequest) -> Finished {
    let mut stats = RenderStats::new(prepared, plan, &rendered);
    let outputs = &request.outputs;
    let metadata = metadata(prepared, plan, &stats);
    let (mut written, mut failures) = (vec![], vec![]);
    let mut keep = |result: Result<Vec<PathBuf>, JobError>| match result {
        Ok(files) => written.extend(files),
        Err(e) => failures.push(e),
    };
    let mut clock = Clock::default();
    clock.time(|| {
        if !outputs.pictures.is_empty() {
            let layers = aov::layers(&prepared.scene, &rendered.film, plan.seed, &outputs.aovs);
            let picture = picture(&rendered.film, layers, metadata.clone());
            for path in &outputs.pictures {
                let result = write_picture(path, &picture, outputs.exposure);
                keep(result.map(|()| vec![path.clone()]).map_err(JobError::file));
            }
        }
        if let (Some(pyramid), Some(found)) = (&outputs.pyramid, rendered.pyramid()) {
            keep(write_pyramid(&pyramid.folder, &found, &metadata, outputs));
        }
    });
    stats.phases.insert("output", clock.total().as_secs_f64());
    if let Some(path) = &outputs.stats
        && let Err(e) = write_json(path, &stats)
    {
        failures.push(e);
    }
    failures.extend(rendered.checkpoint_error.map(JobError::from));
    let failure = failures.into_iter().next();
    Finished { stats, written, stop: rendered.outcome.stop, failure }
}

/// A layer of red, green and blue.
fn rgb_layer(name: &str, pixels: &[Rgb]) -> Layer {
    let channel = |c: usize| pixels.iter().map(|p| p[c]).collect::<Vec<f32>>();
    Layer { name: name.into(), channels: vec![("R", channel(0)), ("G", channel(1)), ("B", channel(2))] }
}

/// The picture: the mean as the nameless main layer, the variance of the mean, and `layers`.
pub fn picture(film: &Film, layers: Vec<Layer>, metadata: Metadata) -> Picture {
    let mut all = vec![rgb_layer("", &film.mean()), rgb_layer("variance", &film.variance_of_mean())];
    all.extend(layers);
    Picture { width: film.width, height: film.height, layers: all, metadata }
}

/// Writes `raw.exr`, `weighted.exr` (one layer per technique; the main layer is their sum) and `sheet.png` to the
/// folder, which is made if it does not exist. Returns the files.
fn write_pyramid(
    folder: &Path,
    pyramid: &Pyramid,
    metadata: &Metadata,
    outputs: &OutputRequest,
) -> Result<Vec<PathBuf>, JobError> {
    std::fs::create_dir_all(folder).map_err(|e| JobError::File(format!("{}: {e}", folder.display())))?;
    let [width, height] = pyramid.size();
    let mut written = vec![];
    for (name, side) in [("raw.exr", PyramidLayer::Raw), ("weighted.exr", PyramidLayer::Weighted)] {
        let mut sum = vec![Rgb::BLACK; width as usize * height as usize];
        let mut layers = vec![];
        for (k, s) in pyramid.techniques() {
            let pixels = pyramid.picture((k, s), side);
            sum.iter_mut().zip(&pixels).for_each(|(a, b)| *a += *b);
            layers.push(rgb_layer(&format!("depth{k}_s{s}_t{}", k + 1 - s), &pixels));
        }
        layers.insert(0, rgb_layer("", &sum));
        let path = folder.join(name);
        let picture = Picture { width, height, layers, metadata: metadata.clone() };
        write_picture(&path, &picture, outputs.exposure).map_err(JobError::file)?;
        written.push(path);
    }
    let (width, height, sheet) = pyramid.sheet();
    let path = folder.join("sheet.png");
    let picture = Picture { width, height, layers: vec![rgb_layer("", &sheet)], metadata: vec![] };
    write_picture(&path, &picture, outputs.exposure).map_err(JobError::file)?;
    written.push(path);
    Ok(written)
}

/// Entries of the pictures' headers; `merge` reads them.
fn metadata(prepared: &PreparedJob, plan: &Plan, stats: &RenderStats) -> Metadata {
    // A render with an error target has two halves with seeds of their own.
    let seeds = stats.error.map_or_else(|| vec![stats.seed], |e| e.seeds.to_vec());
    let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
    [
        ("software", format!("lightsieve {}", stats.version)),
        ("scene", prepared.file.display().to_string()),
        ("integrator", plan.method.spec.name.to_string()),
        ("parameters", plan.method.parameters()),
        ("iterations", stats.iterations.to_string()),
        ("seed", seeds.join(" ")),
        ("backend", stats.backend.clone()),
        ("nonFinite", stats.non_finite.to_string()),
        ("renderSeconds", format!("{:.3}", stats.wall_s)),
        ("unbiased", plan.method.spec.unbiased.to_string()),
    ]
    .into_iter()
    .map(|(k, v)| (format!("lightsieve:{k}"), v))
    .collect()
}

fn write_json(path: &Path, stats: &RenderStats) -> Result<(), JobError> {
    let json = serde_json::to_string_pretty(stats).map_err(JobError::file)?;
    atomic_write(path, |w| w.write_all(json.as_bytes()).and_then(|()| w.write_all(b"\n")))
        .map_err(|e| JobError::File(format!("{}: {e}", path.display())))
}
