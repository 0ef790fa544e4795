//! Checkpoints: the film's sums in full precision, and what must be the same for a resumed render to go on bit by bit.
//!
//! A file is one line of JSON (what was rendered), then the sums: for each tile in order, for each pixel, three sums and three
//! sums of squares as little-endian doubles, then the number of non-finite samples as a 64-bit integer; last, what the
//! integrator has learnt, in words of its own.

use super::scene_hash::scene_hash;
use crate::film::{Film, NonFinite};
use crate::image::atomic_write;
use crate::integrators::{self, Params};
use crate::prepared::PreparedScene;
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::path::{Path, PathBuf};

const FORMAT: &str = "lightsieve-checkpoint-2";

/// What a checkpoint belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    format: String,
    integrator: String,
    params: Vec<(String, String)>,
    seed: u64,
    film_size: [u32; 2],
    window: [u32; 4],
    scene_hash: u64,
    iterations: u64,
    non_finite_at: Vec<NonFinite>,
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
    /// Not a checkpoint, or a damaged one.
    #[error("{}: {reason}", path.display())]
    Format {
        /// File.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// A checkpoint of something else.
    #[error("{}: the checkpoint is of another render ({what})", path.display())]
    Other {
        /// File.
        path: PathBuf,
        /// What differs.
        what: &'static str,
    },
}

impl Checkpoint {
    /// Describes a render.
    pub fn new(scene: &PreparedScene, integrator: &str, params: &[(&'static str, String)], seed: u64) -> Checkpoint {
        Checkpoint {
            format: FORMAT.into(),
            integrator: integrator.into(),
            params: params.iter().map(|(k, v)| ((*k).to_string(), v.clone())).collect(),
            seed,
            film_size: scene.film_size,
            window: scene.window,
            scene_hash: scene_hash(scene),
            iterations: 0,
            non_finite_at: vec![],
        }
    }

    /// The parameters have these values, by their present or earlier names.
    fn has_params(&self, found: &[(String, String)]) -> bool {
        if found.len() != self.params.len() {
            return false;
        }
        let Some(spec) = integrators::find(&self.integrator) else { return found == self.params };
        let named = |pairs: &[(String, String)]| Params::with(spec, pairs).ok();
        named(found).is_some_and(|params| Some(params) == named(&self.params))
    }

    /// Writes the film and what the integrator has learnt; whole or not at all.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn save(&self, path: &Path, film: &Film, state: &[u8]) -> Result<(), CheckpointError> {
        let header = Checkpoint { iterations: film.iterations(), non_finite_at: film.non_finite().1, ..self.clone() };
        let io = |source| CheckpointError::Io { path: path.to_owned(), source };
        let json = serde_json::to_string(&header).map_err(|e| io(e.into()))?;
        atomic_write(path, |w| {
            writeln!(w, "{json}")?;
            for tile in &film.tiles {
                let mut bytes = Vec::with_capacity(tile.sums.len() * 48 + 8);
                for (sum, square) in tile.sums.iter().zip(&tile.squares) {
                    for v in sum.iter().chain(square) {
                        bytes.extend_from_slice(&v.to_le_bytes());
                    }
                }
                bytes.extend_from_slice(&tile.non_finite.to_le_bytes());
                w.write_all(&bytes)?;
            }
            w.write_all(state)?;
            Ok(())
        })
        .map_err(io)
    }

    /// Reads a film and an integrator's state back, if the checkpoint is of this render.
    ///
    /// # Errors
    /// If it is not, or is damaged.
    pub fn load(&self, path: &Path) -> Result<(Film, Vec<u8>), CheckpointError> {
        let io = |source| CheckpointError::Io { path: path.to_owned(), source };
        let format = |reason: &str| CheckpointError::Format { path: path.to_owned(), reason: reason.into() };
        let mut data = Vec::new();
        std::fs::File::open(path).and_then(|mut f| f.read_to_end(&mut data)).map_err(io)?;
        let end = data.iter().position(|&b| b == b'\n').ok_or_else(|| format("not a lightsieve checkpoint"))?;
        let found: Checkpoint =
            serde_json::from_slice(&data[..end]).map_err(|_| format("not a lightsieve checkpoint"))?;
        if found.format != self.format {
            return Err(format(&format!("format {} is not {FORMAT}", found.format)));
        }
        let same = [
            ("another integrator", found.integrator == self.integrator),
            ("other parameters of the integrator", self.has_params(&found.params)),
            ("another seed", found.seed == self.seed),
            ("another picture size", found.film_size == self.film_size),
            ("another crop window", found.window == self.window),
            ("another scene", found.scene_hash == self.scene_hash),
        ];
        if let Some((what, _)) = same.into_iter().find(|&(_, same)| !same) {
            return Err(CheckpointError::Other { path: path.to_owned(), what });
        }

        let mut film = Film::new(self.window);
        film.set_iterations(found.iterations);
        let mut words = data[end + 1..].chunks_exact(8).map(|c| u64::from_le_bytes(c.try_into().unwrap_or_default()));
        let mut next = || words.next().ok_or_else(|| format("the file is cut short"));
        for tile in &mut film.tiles {
            for (sum, square) in tile.sums.iter_mut().zip(&mut tile.squares) {
                for v in sum.iter_mut().chain(square) {
                    *v = f64::from_bits(next()?);
                }
            }
            tile.non_finite = next()?;
        }
        if let Some(tile) = film.tiles.first_mut() {
            tile.places = found.non_finite_at;
        }
        let state = words.flat_map(u64::to_le_bytes).collect();
        Ok((film, state))
    }
}
