//! Checkpoints: the films of a render in full precision, and everything that must be equal for a resumed render to go
//! on bit by bit.
//!
//! A file is a line with the version of the format, then the identity of the render and the state of each estimator
//! (postcard encoding), then the CRC-32 of everything before it (four bytes, little-endian). The state of an
//! integrator is an opaque block of bytes here. A file of another version, of another render, or with a wrong
//! checksum is refused.

use super::scene_hash::scene_hash;
use super::{Estimator, Plan};
use crate::film::{Film, Pyramid};
use crate::image::{atomic_write, read_regular};
use crate::prepared::PreparedScene;
use serde::{Deserialize, Serialize};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Beginning of every checkpoint; the version follows.
const NAME: &str = "lightsieve-checkpoint-";
/// Version of the format.
const VERSION: u32 = 4;
/// Bytes at the beginning of a file that are searched for [`NAME`]: version 2 had it behind a bracket and a key.
const HEAD: usize = 64;
/// Longest file that is read, in bytes.
const MAX_BYTES: u64 = 1 << 38;
/// Bytes of the checksum.
const CHECKSUM: usize = 4;

/// Everything that two runs must have in common to be parts of one render.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderIdentity {
    integrator: String,
    params: Vec<(String, String)>,
    seed: u64,
    /// The render has two halves with seeds of their own, see [`super::error_target`].
    error_target: bool,
    /// Edges of the longest paths of the pyramid, if one is kept.
    pyramid_edges: Option<usize>,
    film_size: [u32; 2],
    window: [u32; 4],
    scene_hash: u64,
    backend: String,
}

/// A film and the state of the integrator that rendered it.
#[derive(Debug, Serialize, Deserialize)]
pub struct SavedEstimator {
    /// Film.
    pub film: Film,
    /// State of the integrator, see [`crate::integrators::Integrator::state`].
    pub state: Vec<u8>,
    /// Pictures of techniques, if the render keeps them.
    pub pyramid: Option<Pyramid>,
}

/// Contents of a file, as it is read.
#[derive(Deserialize)]
struct Contents {
    identity: RenderIdentity,
    estimators: Vec<SavedEstimator>,
}

/// Contents of a file, as it is written: the same fields, borrowed.
#[derive(Serialize)]
struct ContentsRef<'a> {
    identity: &'a RenderIdentity,
    estimators: Vec<EstimatorRef<'a>>,
}

/// A [`SavedEstimator`], borrowed.
#[derive(Serialize)]
struct EstimatorRef<'a> {
    film: &'a Film,
    state: Vec<u8>,
    pyramid: Option<&'a Pyramid>,
}

/// A checkpoint that cannot be used or written.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// File.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// No checkpoint, one of another version, or a damaged one.
    #[error("{}: {reason}", path.display())]
    Format {
        /// File.
        path: PathBuf,
        /// Reason.
        reason: String,
    },
    /// A checkpoint of another render.
    #[error("{}: the checkpoint is of another render ({difference})", path.display())]
    Other {
        /// File.
        path: PathBuf,
        /// First difference.
        difference: &'static str,
    },
}

impl RenderIdentity {
    /// The identity of a planned render of `scene`.
    pub fn new(scene: &PreparedScene, plan: &Plan) -> RenderIdentity {
        let params = plan.method.params.pairs();
        RenderIdentity {
            integrator: plan.method.spec.name.into(),
            params: params.into_iter().map(|(k, v)| (k.to_owned(), v)).collect(),
            seed: plan.seed,
            error_target: plan.error_target.is_some(),
            pyramid_edges: plan.pyramid_edges,
            film_size: scene.film_size,
            window: scene.window,
            scene_hash: scene_hash(scene),
            backend: scene.query.describe(),
        }
    }

    /// The first difference from another identity, in words about the other.
    fn difference(&self, other: &RenderIdentity) -> Option<&'static str> {
        let target = if other.error_target { "with an error target" } else { "without an error target" };
        let pyramid = match other.pyramid_edges {
            Some(_) if self.pyramid_edges.is_some() => "a pyramid of another depth",
            Some(_) => "with a pyramid of techniques",
            None => "without a pyramid of techniques",
        };
        let equal = [
            ("another integrator", other.integrator == self.integrator),
            ("other parameters of the integrator", other.params == self.params),
            ("another seed", other.seed == self.seed),
            (target, other.error_target == self.error_target),
            (pyramid, other.pyramid_edges == self.pyramid_edges),
            ("another picture size", other.film_size == self.film_size),
            ("another crop window", other.window == self.window),
            ("another scene", other.scene_hash == self.scene_hash),
            ("another ray-query backend", other.backend == self.backend),
        ];
        equal.into_iter().find(|&(_, equal)| !equal).map(|(what, _)| what)
    }

    /// Number of estimators of the render.
    fn estimators(&self) -> usize {
        if self.error_target { 2 } else { 1 }
    }

    /// Writes films and states of all estimators; whole or not at all.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn save(&self, path: &Path, estimators: &[Estimator]) -> Result<(), CheckpointError> {
        let estimators = estimators.iter().map(|e| EstimatorRef {
            film: &e.film,
            state: e.integrator.state(),
            pyramid: e.integrator.pyramid(),
        });
        let contents = ContentsRef { identity: self, estimators: estimators.collect() };
        atomic_write(path, |file| encode(&contents, file))
            .map_err(|source| CheckpointError::Io { path: path.to_owned(), source })
    }

    /// Reads the estimators back, if the checkpoint is of this render.
    ///
    /// # Errors
    /// If it is not, or is damaged.
    pub fn load(&self, path: &Path) -> Result<Vec<SavedEstimator>, CheckpointError> {
        let data =
            read_regular(path, MAX_BYTES).map_err(|source| CheckpointError::Io { path: path.to_owned(), source })?;
        let found = decode(&data).map_err(|reason| CheckpointError::Format { path: path.to_owned(), reason })?;
        if let Some(difference) = self.difference(&found.identity) {
            return Err(CheckpointError::Other { path: path.to_owned(), difference });
        }
        let has_pyramid = |e: &SavedEstimator| match (&e.pyramid, self.pyramid_edges) {
            (Some(pyramid), Some(edges)) => {
                pyramid.is_of(self.window, edges) && pyramid.is_plausible() && pyramid.iterations <= e.film.iterations()
            }
            (pyramid, edges) => pyramid.is_none() && edges.is_none(),
        };
        let is_sound = |film: &Film| film.is_of_window(self.window) && film.is_plausible();
        let whole = found.estimators.iter().all(|e| is_sound(&e.film) && has_pyramid(e));
        if !whole || found.estimators.len() != self.estimators() {
            let reason = "the checkpoint is damaged: its pictures cannot be those of this render".into();
            return Err(CheckpointError::Format { path: path.to_owned(), reason });
        }
        Ok(found.estimators)
    }
}

/// Writes version, contents and checksum.
fn encode(contents: &ContentsRef, file: &mut dyn Write) -> std::io::Result<()> {
    let mut out = BufWriter::new(Checksummed { file, checksum: crc32fast::Hasher::new(), error: None });
    writeln!(out, "{NAME}{VERSION}")?;
    if let Err(e) = postcard::to_io(contents, &mut out) {
        // postcard does not say why a write failed.
        return Err(out.get_mut().error.take().unwrap_or_else(|| std::io::Error::other(e)));
    }
    let Checksummed { file, checksum, .. } = out.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    file.write_all(&checksum.finalize().to_le_bytes())
}

/// Checks version and checksum and decodes the rest.
fn decode(data: &[u8]) -> Result<Contents, String> {
    let version = version(data).ok_or("not a lightsieve checkpoint")?;
    if version != VERSION.to_string() {
        return Err(format!(
            "the checkpoint has version {version} of the format; this program reads version {VERSION}"
        ));
    }
    let damaged = || "the checkpoint is damaged or cut short: its checksum does not match".to_owned();
    let (checked, checksum) = data.split_last_chunk::<CHECKSUM>().ok_or_else(damaged)?;
    if crc32fast::hash(checked) != u32::from_le_bytes(*checksum) {
        return Err(damaged());
    }
    let line = checked.iter().position(|&b| b == b'\n').ok_or_else(damaged)?;
    postcard::from_bytes(&checked[line + 1..]).map_err(|e| format!("the checkpoint is damaged: {e}"))
}

/// The version that the beginning of a file tells; none if it is no checkpoint.
fn version(data: &[u8]) -> Option<String> {
    let head = String::from_utf8_lossy(&data[..data.len().min(HEAD)]);
    let (_, rest) = head.split_once(NAME)?;
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    (!digits.is_empty()).then_some(digits)
}

/// Passes bytes on to a file and sums them up.
struct Checksummed<'a> {
    file: &'a mut dyn Write,
    checksum: crc32fast::Hasher,
    /// The latest failure of the file.
    error: Option<std::io::Error>,
}

impl Checksummed<'_> {
    /// Keeps a failure, of which the caller gets the kind alone.
    fn keep(&mut self, e: std::io::Error) -> std::io::Error {
        let kind = e.kind();
        self.error = Some(e);
        kind.into()
    }
}

impl Write for Checksummed<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.file.write(bytes).map_err(|e| self.keep(e))?;
        self.checksum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush().map_err(|e| self.keep(e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{ContributionKind, SampleBuffer};
    use crate::math::Rgb;

    const WINDOW: [u32; 4] = [0, 0, 2, 1];

    /// Makes the sums of an estimator wrong.
    type Change = fn(&mut Film, &mut Pyramid);

    fn identity() -> RenderIdentity {
        RenderIdentity {
            integrator: "path".into(),
            params: vec![],
            seed: 0,
            error_target: false,
            pyramid_edges: Some(2),
            film_size: [2, 1],
            window: WINDOW,
            scene_hash: 1,
            backend: "none".into(),
        }
    }

    /// Two iterations of a film and a pyramid.
    fn saved() -> (Film, Pyramid) {
        let (mut film, mut buffer) = (Film::new(WINDOW), SampleBuffer::default());
        for value in [1.0, 3.0] {
            let iteration = film.begin_iteration();
            buffer.clear(2);
            (0..2).for_each(|pixel| buffer.add(ContributionKind::Hit, pixel, Rgb::grey(value)));
            film.tiles[0].commit(&buffer, None, iteration);
        }
        let mut pyramid = Pyramid::new(WINDOW, 2);
        pyramid.add((0, 2), (1, 0), Rgb::WHITE, 1.0);
        pyramid.iterations = 2;
        (film, pyramid)
    }

    /// Saves what `change` makes of a film and its pyramid, with a right checksum, and loads it.
    fn load(change: impl FnOnce(&mut Film, &mut Pyramid)) -> Result<Vec<SavedEstimator>, CheckpointError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c");
        let (mut film, mut pyramid) = saved();
        change(&mut film, &mut pyramid);
        let identity = identity();
        let estimators = vec![EstimatorRef { film: &film, state: vec![], pyramid: Some(&pyramid) }];
        let contents = ContentsRef { identity: &identity, estimators };
        atomic_write(&path, |file| encode(&contents, file)).unwrap();
        identity.load(&path)
    }

    #[test]
    fn sums_that_no_render_can_have_are_refused_whatever_the_checksum_says() {
        assert!(load(|_, _| {}).is_ok());
        let changes: [(&str, Change); 8] = [
            ("not a number", |film, _| film.tiles[0].sums[1][2] = f64::NAN),
            ("infinite squares", |film, _| film.tiles[0].squares[0][0] = f64::INFINITY),
            ("negative squares", |film, _| film.tiles[0].squares[0][0] = -1.0),
            ("a sum without samples", |film, _| film.tiles[0].sums[0] = [100.0; 3]),
            ("more bad samples than samples", |film, _| film.tiles[0].non_finite = 5),
            ("a pixel too few", |film, _| film.tiles[0].sums.truncate(1)),
            ("a pyramid of more iterations", |_, pyramid| pyramid.iterations = 3),
            ("a pyramid that is not finite", |_, pyramid| pyramid.merge(&broken_pyramid())),
        ];
        for (what, change) in changes {
            let refused = load(change).err().unwrap_or_else(|| panic!("{what} is accepted"));
            assert!(refused.to_string().contains("damaged"), "{what}: {refused}");
        }
    }

    /// A pyramid whose sums overflow.
    fn broken_pyramid() -> Pyramid {
        let mut pyramid = Pyramid::new(WINDOW, 2);
        pyramid.add((0, 2), (0, 0), Rgb::WHITE, 1.0);
        (0..1100).for_each(|_| pyramid.merge(&pyramid.clone()));
        pyramid
    }

    #[test]
    fn counts_of_iterations_that_overflow_are_refused() {
        for iterations in [0, 1, crate::film::MAX_ITERATIONS + 1, u64::MAX] {
            let (film, _) = saved();
            let mut value = serde_json::to_value(&film).unwrap();
            value["iterations"] = iterations.into();
            let film: Film = serde_json::from_value(value).unwrap();
            assert!(!film.is_plausible(), "{iterations}");
        }
        assert!(saved().0.is_plausible());
    }
}
