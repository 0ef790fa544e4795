//! References: the pictures that errors are measured against. A rendered reference is kept in a cache under the hash
//! of its scene and settings.

use super::choice::{Choice, PILOTS, choose};
use crate::image::{Encoding, ExrFile, read_image, write_picture};
use crate::math::hash::mix64;
use crate::prepared::PreparedScene;
use crate::render::{Budget, JobError, Method, Plan, Runtime, Stop, output, run, scene_hash};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Seed of references: far from the seeds that people type, so that a reference shares no sample with the pictures
/// compared to it.
pub const REFERENCE_SEED: u64 = 0x5eed_7e57;

/// A picture to compare with.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Width and height.
    pub size: [u32; 2],
    /// Linear colours, row by row.
    pub pixels: Vec<[f64; 3]>,
    /// Facts about its making.
    pub facts: ReferenceFacts,
}

/// Facts about a reference that a reader of a table needs.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceFacts {
    /// File.
    pub file: PathBuf,
    /// Integrator and parameters, if its header tells.
    pub integrator: Option<String>,
    /// Samples per pixel.
    pub iterations: Option<String>,
    /// Seeds.
    pub seeds: Option<String>,
    /// Error of the reference itself, by estimate from its variance layer. Samples are stratified over iterations,
    /// which makes the estimate too large; light that no sample met is not in it.
    pub own: Option<OwnError>,
    /// Pixels that are not finite; errors leave them out.
    pub non_finite: u64,
}

/// Estimated error of a picture against its expectation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OwnError {
    /// Mean of v / (r² + 0.01), v the variance of the mean.
    pub relmse: f64,
    /// Mean of √(2v/π) / (r + 0.01), which is the expectation of |d| / (r + 0.01) of a normal error.
    pub mape: f64,
    /// Mean of √(2v/π).
    pub mae: f64,
}

/// A reference cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The file cannot be read or is no picture.
    #[error("{0}")]
    Image(#[from] crate::image::ImageError),
    /// It cannot be written.
    #[error("{0}")]
    Write(#[from] crate::image::WriteError),
    /// The cache's folder cannot be made.
    #[error("{}: {source}", path.display())]
    Folder {
        /// Folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It cannot be rendered, or was interrupted.
    #[error("{0}")]
    Job(#[from] JobError),
}

/// A reference to be rendered.
#[derive(Clone, Copy)]
pub struct ReferenceTask<'a> {
    /// Scene.
    pub scene: &'a PreparedScene,
    /// Name of the scene.
    pub name: &'a str,
    /// Methods of which the best is taken (see [`choose`]); all should be unbiased and render all of the scene.
    pub methods: &'a [Method],
    /// Limits of the render.
    pub budget: Budget,
}

impl OwnError {
    /// From means and the variances of these means.
    pub fn new(pixels: &[[f64; 3]], variance: &[[f64; 3]]) -> OwnError {
        let (mut sums, mut n) = ([0.0; 3], 0u64);
        for (r, v) in pixels.iter().flatten().zip(variance.iter().flatten()) {
            if r.is_finite() && v.is_finite() {
                let absolute = (v * std::f64::consts::FRAC_2_PI).sqrt();
                sums[0] += v / (r * r + 0.01);
                sums[1] += absolute / (r + 0.01);
                sums[2] += absolute;
                n += 1;
            }
        }
        let [relmse, mape, mae] = sums.map(|s| s / n as f64);
        OwnError { relmse, mape, mae }
    }
}

impl Reference {
    /// Reads any picture; an EXR file of this program also tells how it was made and how exact it is.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(path: &Path) -> Result<Reference, ReferenceError> {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            let file = ExrFile::read(path)?;
            if let Some(pixels) = file.colours("") {
                let own = file.colours("variance").map(|v| OwnError::new(&pixels, &v));
                let text = |name: &str| file.text(&format!("lightsieve:{name}")).map(str::to_owned);
                let integrator = text("integrator").map(|i| format!("{i} {}", text("parameters").unwrap_or_default()));
                let facts = ReferenceFacts {
                    file: path.to_owned(),
                    integrator,
                    iterations: text("iterations"),
                    seeds: text("seed"),
                    own,
                    non_finite: non_finite(&pixels),
                };
                return Ok(Reference { size: [file.width, file.height], pixels, facts });
            }
        }
        let image = read_image(path, Encoding::Auto)?;
        let all = (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y)));
        let pixels: Vec<[f64; 3]> = all.map(|(x, y)| image.rgb(x, y).to_array().map(f64::from)).collect();
        let facts = ReferenceFacts {
            file: path.to_owned(),
            integrator: None,
            iterations: None,
            seeds: None,
            own: None,
            non_finite: non_finite(&pixels),
        };
        Ok(Reference { size: [image.width, image.height], pixels, facts })
    }

    /// The reference of a scene from the cache in `folder`, or rendered and put there.
    ///
    /// # Errors
    /// If there is no method, the cache cannot be used, or the render was interrupted.
    pub fn cached(task: &ReferenceTask, folder: &Path, runtime: Runtime) -> Result<Reference, ReferenceError> {
        let path = folder.join(task.file_name());
        if path.is_file() {
            return Reference::read(&path);
        }
        std::fs::create_dir_all(folder).map_err(|source| ReferenceError::Folder { path: folder.to_owned(), source })?;
        let method = task.choose(runtime)?;
        let plan = Plan { budget: task.budget, ..Plan::new(method.clone(), REFERENCE_SEED) };
        let rendered = run::run(task.scene, &plan, runtime)?;
        if rendered.outcome.stop == Stop::Interrupted {
            return Err(JobError::Interrupted.into());
        }
        let metadata = [
            ("scene", task.name.to_owned()),
            ("integrator", method.spec.name.to_owned()),
            ("parameters", method.parameters()),
            ("iterations", rendered.film.iterations().to_string()),
            ("seed", REFERENCE_SEED.to_string()),
            ("renderSeconds", format!("{:.3}", rendered.outcome.wall.as_secs_f64())),
        ];
        let metadata = metadata.into_iter().map(|(k, v)| (format!("lightsieve:{k}"), v)).collect();
        write_picture(&path, &output::picture(&rendered.film, vec![], metadata), 0.0)?;
        Reference::read(&path)
    }
}

/// Part of a reference's budget that the choice between several methods takes, about.
const CHOICE_PART: u32 = 10;

impl ReferenceTask<'_> {
    /// Name of the reference's file in the cache: a hash of the scene and everything that makes the picture.
    fn file_name(&self) -> String {
        let scene = self.scene;
        let text = |method: &Method| format!("{} {}", method.spec.name, method.parameters());
        let methods: Vec<String> = self.methods.iter().map(text).collect();
        let settings = format!(
            "{} {:?} {:?} {:?} {}",
            methods.join(", "),
            scene.film_size,
            scene.window,
            self.budget,
            env!("CARGO_PKG_VERSION"),
        );
        let hash = settings.bytes().fold(scene_hash(scene), |h, b| mix64(h.rotate_left(5) ^ u64::from(b)));
        let method = match self.methods {
            [one] => one.spec.name,
            _ => "best",
        };
        format!("{}-{method}-{hash:016x}.exr", self.name)
    }

    /// The best of the methods; the observer hears which it is.
    fn choose(&self, runtime: Runtime) -> Result<Method, JobError> {
        let none = || JobError::Input(format!("there is no method to render a reference of {}", self.name));
        let Some(first) = self.methods.first() else { return Err(none()) };
        if self.methods.len() == 1 {
            return Ok(first.clone());
        }
        let share = |n: u64| (n / u64::from(CHOICE_PART)).clamp(1, 16);
        let parts = CHOICE_PART * self.methods.len() as u32 * PILOTS as u32;
        let budget =
            Budget { iterations: self.budget.iterations.map(share), time: self.budget.time.map(|t| t / parts) };
        let Choice { best, confirmed_by } = choose(self.scene, self.methods, budget, runtime)?;
        let label = |i: usize| self.methods[i].label.as_str();
        match confirmed_by {
            Some(other) => {
                let found = format!("{}: reference by {}, with which {} agrees", self.name, label(best), label(other));
                runtime.observer.note(&found);
            }
            None => runtime.observer.warning(&format!(
                "{}: the reference is rendered by {}, and no other method agrees with it in short renders",
                self.name,
                label(best)
            )),
        }
        Ok(self.methods[best].clone())
    }
}

impl ReferenceFacts {
    /// As a sentence.
    pub fn sentence(&self) -> String {
        let unknown = || "an unknown number of".to_owned();
        let made = match &self.integrator {
            Some(i) => format!("{} samples per pixel of {i}", self.iterations.clone().unwrap_or_else(unknown)),
            None => "made by another program".to_owned(),
        };
        let own = match self.own {
            Some(e) => format!(
                "its own error is about relMSE {:.2e}, MAPE {:.2e} by estimate from its samples, which say nothing of \
                 light that none of them met",
                e.relmse, e.mape
            ),
            None => "its own error is not known (no variance layer)".to_owned(),
        };
        format!("reference {}: {made}; {own}", self.file.display())
    }
}

fn non_finite(pixels: &[[f64; 3]]) -> u64 {
    pixels.iter().filter(|p| !p.iter().all(|v| v.is_finite())).count() as u64
}
