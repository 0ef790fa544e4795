//! The finish step: pictures with layers and metadata, the pyramid of techniques, and statistics as files.

use super::files::{OutputFiles, is_same_file, write_or_rescue};
use super::stats::Clock;
use super::{JobError, OutputRequest, Plan, PreparedJob, RenderRequest, RenderStats, Rendered, Stop, aov};
use crate::film::pyramid::PyramidLayer;
use crate::film::{Film, Pyramid};
use crate::image::{Layer, OutputFormat, Picture, atomic_write, check_writable, write_picture};
use crate::math::Rgb;
use crate::scene::SceneDesc;
use std::path::{Path, PathBuf};

/// End of a render.
pub struct Finished {
    /// Statistics.
    pub stats: RenderStats,
    /// Files that were written.
    pub written: Vec<PathBuf>,
    /// Reason for the end of the iterations.
    pub stop: Stop,
    /// Iterations of this run.
    pub new_iterations: u64,
    /// Failures to write a file or a checkpoint; one file that cannot be written does not cost the others.
    pub failures: Vec<JobError>,
}

/// Name and value of an entry in the header of a picture.
type Metadata = Vec<(String, String)>;

/// Files of a pyramid in its folder.
const PYRAMID_RAW: &str = "raw.exr";
const PYRAMID_WEIGHTED: &str = "weighted.exr";
const PYRAMID_SHEET: &str = "sheet.png";

impl RenderRequest {
    /// Checks the names of all files that are written at the end, so that no hours of rendering are lost: each can be
    /// written, they are different, and none is the scene file or the checkpoint to go on from.
    ///
    /// # Errors
    /// If a picture's format is not known, an output is another output or an input, or a file cannot be written.
    pub fn check_files(&self) -> Result<(), JobError> {
        for path in &self.outputs.pictures {
            OutputFormat::of(path).map_err(JobError::input)?;
        }
        self.check_effects()?;
        let outputs = self.output_files();
        // A file that is resumed from is an input, unless it is the one that is saved to as well.
        let saved = self.checkpoint.as_deref();
        let resumed = self.resume.as_deref().filter(|resume| !saved.is_some_and(|saved| is_same_file(saved, resume)));
        outputs.check_inputs([self.scene.file.as_path()].into_iter().chain(resumed))?;
        outputs.check()?;
        match (saved, resumed) {
            // It is saved to only once it has been found to be a checkpoint.
            (None, Some(path)) => check_writable(path).map_err(|e| {
                JobError::File(format!(
                    "{}: cannot be written: {e}; name another file with --checkpoint",
                    path.display()
                ))
            }),
            _ => Ok(()),
        }
    }

    /// True if nothing of the render would be kept: no picture, statistics, pyramid or checkpoint is written.
    pub fn keeps_nothing(&self) -> bool {
        let OutputRequest { pictures, stats, pyramid, .. } = &self.outputs;
        pictures.is_empty() && stats.is_none() && pyramid.is_none() && self.checkpoint_file().is_none()
    }

    /// Refuses options that would have no effect.
    fn check_effects(&self) -> Result<(), JobError> {
        let OutputRequest { pictures, exposure, aovs, pyramid, .. } = &self.outputs;
        let has = |format| pictures.iter().any(|path| OutputFormat::of(path).is_ok_and(|f| f == format));
        let refusals = [
            (!aovs.is_empty() && !has(OutputFormat::Exr), "--aov has no effect without an EXR file (-o FILE.exr)"),
            (
                *exposure != 0.0 && !has(OutputFormat::Png) && pyramid.is_none(),
                "--exposure has no effect without a PNG file (-o FILE.png)",
            ),
            (
                self.checkpoint_interval.is_some() && self.checkpoint_file().is_none(),
                "--checkpoint-interval has no effect without --checkpoint or --resume",
            ),
        ];
        match refusals.into_iter().find(|(refused, _)| *refused) {
            Some((_, reason)) => Err(JobError::Input(reason.into())),
            None => Ok(()),
        }
    }

    /// Checks that no output is a file that the scene was read from.
    ///
    /// # Errors
    /// If one is.
    pub fn check_scene_files(&self, desc: &SceneDesc) -> Result<(), JobError> {
        self.output_files().check_inputs(desc.files.iter().map(PathBuf::as_path))
    }

    /// The file that checkpoints are saved to: the one to go on from, if no other is named.
    pub fn checkpoint_file(&self) -> Option<&Path> {
        self.checkpoint.as_deref().or(self.resume.as_deref())
    }

    fn output_files(&self) -> OutputFiles {
        let mut files = OutputFiles::default();
        self.outputs.pictures.iter().for_each(|path| files.add("-o", path));
        self.outputs.stats.iter().for_each(|path| files.add("--stats", path));
        self.checkpoint.iter().for_each(|path| files.add("--checkpoint", path));
        if let Some(pyramid) = &self.outputs.pyramid {
            files.add_folder("--pyramid", &pyramid.folder, &[PYRAMID_RAW, PYRAMID_WEIGHTED, PYRAMID_SHEET]);
        }
        files
    }
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
                let result = write_or_rescue(path, |path| write_picture(path, &picture, outputs.exposure));
                keep(result.map(|()| vec![path.clone()]));
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
    failures.extend(rendered.checkpoint_error);
    Finished { stats, written, stop: rendered.outcome.stop, new_iterations: rendered.outcome.iterations, failures }
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
    for (name, side) in [(PYRAMID_RAW, PyramidLayer::Raw), (PYRAMID_WEIGHTED, PyramidLayer::Weighted)] {
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
        write_or_rescue(&path, |path| write_picture(path, &picture, outputs.exposure))?;
        written.push(path);
    }
    let (width, height, sheet) = pyramid.sheet();
    let path = folder.join(PYRAMID_SHEET);
    let picture = Picture { width, height, layers: vec![rgb_layer("", &sheet)], metadata: vec![] };
    write_or_rescue(&path, |path| write_picture(path, &picture, outputs.exposure))?;
    written.push(path);
    Ok(written)
}

/// Entries of the pictures' headers; `merge` reads them.
fn metadata(prepared: &PreparedJob, plan: &Plan, stats: &RenderStats) -> Metadata {
    // A render with an error target has two halves with seeds of their own.
    let seeds = stats.error.map_or_else(|| vec![stats.seed], |e| e.seeds.to_vec());
    let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
    let changes = Some(stats.scene_changes.join("\n")).filter(|lines| !lines.is_empty());
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
    .chain(changes.map(|lines| ("sceneChanges", lines)))
    .map(|(k, v)| (format!("lightsieve:{k}"), v))
    .collect()
}

fn write_json(path: &Path, stats: &RenderStats) -> Result<(), JobError> {
    let json = serde_json::to_string_pretty(stats).map_err(JobError::file)?;
    write_or_rescue(path, |path| {
        atomic_write(path, |w| w.write_all(json.as_bytes()).and_then(|()| w.write_all(b"\n")))
            .map_err(|e| format!("{}: {e}", path.display()))
    })
}
