//! Surroundings of a job: threads, interruption, and the observer that shows what happens.

use super::{CheckpointError, Progress};
use crate::load::LoadFailure;
use crate::scene::Diagnostics;
use std::sync::atomic::AtomicBool;

/// Threads, interruption and observer of a job.
#[derive(Clone, Copy)]
pub struct Runtime<'a> {
    /// Threads that prepare, render and write.
    pub pool: &'a rayon::ThreadPool,
    /// Once set, the running iteration is the last.
    pub interrupt: &'a AtomicBool,
    /// Observer of the job.
    pub observer: &'a dyn Observer,
}

/// Hears what happens during a job. Nothing in this room prints.
pub trait Observer: Sync {
    /// New diagnostics about the scene.
    fn diagnostics(&self, _new: &Diagnostics) {}

    /// A fact about the render that is worth knowing.
    fn note(&self, _text: &str) {}

    /// A warning about the render.
    fn warning(&self, _text: &str) {}

    /// The first iteration is about to start.
    fn run_begins(&self) {}

    /// An iteration has ended.
    fn progress(&self, _progress: &Progress) {}

    /// The last iteration has ended.
    fn run_ends(&self) {}
}

/// Reason why a job failed.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The scene cannot be loaded.
    #[error(transparent)]
    Load(#[from] LoadFailure),
    /// The request or the scene cannot be used.
    #[error("{0}")]
    Input(String),
    /// A file cannot be read or written.
    #[error("{0}")]
    File(String),
    /// Ctrl-C before there was a picture.
    #[error("interrupted")]
    Interrupted,
}

impl JobError {
    /// An error of the request or the scene.
    pub fn input(e: impl std::fmt::Display) -> JobError {
        JobError::Input(e.to_string())
    }

    /// An error of the file system.
    pub fn file(e: impl std::fmt::Display) -> JobError {
        JobError::File(e.to_string())
    }
}

impl From<CheckpointError> for JobError {
    fn from(e: CheckpointError) -> JobError {
        match e {
            CheckpointError::Io { .. } => JobError::file(e),
            CheckpointError::Format { .. } | CheckpointError::Other { .. } => JobError::input(e),
        }
    }
}
