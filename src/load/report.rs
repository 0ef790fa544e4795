//! Collects diagnostics while loading, and stops collecting when a file is hopeless.

use crate::scene::Severity;
use crate::scene::diag::{Diagnostic, Diagnostics};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// More errors than this help nobody.
pub(super) const MAX_ERRORS: usize = 20;

/// Diagnostics of one load.
#[derive(Debug, Default)]
pub(super) struct Report {
    /// Unsupported elements are warnings instead of errors.
    force: bool,
    diagnostics: Diagnostics,
    errors: usize,
    io: bool,
    /// Messages that have a place, by code, text, file and offset.
    seen: HashSet<(&'static str, String, usize, usize)>,
    /// Files that were opened.
    files: Vec<PathBuf>,
}

impl Report {
    /// With `force`, what is not supported is a warning instead of an error.
    pub(super) fn new(force: bool) -> Report {
        Report { force, ..Report::default() }
    }

    /// The message as this report takes it: what is not supported is a warning if the scene is forced to load.
    pub(super) fn graded(&self, mut d: Diagnostic) -> Diagnostic {
        if self.force && d.changes_picture {
            d.severity = d.severity.min(Severity::Warning);
        }
        d
    }

    /// Adds a message, once for each place (an object that several others refer to is read for each of them); errors
    /// beyond the limit are counted only.
    pub(super) fn push(&mut self, d: Diagnostic) {
        let d = self.graded(d);
        if let Some(span) = &d.span {
            let file = Arc::as_ptr(&span.source) as usize;
            if !self.seen.insert((d.code, d.message.clone(), file, span.range.start)) {
                return;
            }
        }
        if d.severity == Severity::Error {
            self.errors += 1;
            if self.errors > MAX_ERRORS {
                return;
            }
        }
        self.diagnostics.push(d);
    }

    /// Adds an error that comes from the file system.
    pub(super) fn push_io(&mut self, d: Diagnostic) {
        self.io |= d.severity == Severity::Error;
        self.push(d);
    }

    /// Remembers a file that the scene is read from.
    pub(super) fn opened(&mut self, path: &Path) {
        self.files.push(path.to_owned());
    }

    /// Files that were remembered, in the order of reading.
    pub(super) fn take_files(&mut self) -> Vec<PathBuf> {
        std::mem::take(&mut self.files)
    }

    pub(super) fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// True when it is time to give up.
    pub(super) fn full(&self) -> bool {
        self.errors >= MAX_ERRORS
    }

    /// The messages, and whether the file system was at fault.
    pub(super) fn finish(mut self) -> (Diagnostics, bool) {
        if self.full() {
            self.diagnostics
                .push(Diagnostic::note("load::too-many-errors", format!("stopped after {MAX_ERRORS} errors")));
        }
        (self.diagnostics, self.io)
    }
}
