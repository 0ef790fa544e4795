//! Diagnostics: what is wrong in a file, where, what was expected. Collected, not thrown: one run shows them all.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// A text file that messages point into.
#[derive(Debug)]
pub struct Source {
    /// As it was opened.
    pub path: PathBuf,
    /// Its whole text.
    pub text: String,
}

/// A stretch of a source file.
#[derive(Clone, Debug)]
pub struct Span {
    /// The file.
    pub source: Arc<Source>,
    /// Byte range in its text.
    pub range: Range<usize>,
}

impl Span {
    /// Line and column (both from 1) of the beginning.
    pub fn line_column(&self) -> (usize, usize) {
        let before = &self.source.text[..self.range.start.min(self.source.text.len())];
        let line = before.bytes().filter(|&b| b == b'\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        (line, column)
    }

    /// `file:line:column`.
    pub fn location(&self) -> String {
        let (line, column) = self.line_column();
        format!("{}:{line}:{column}", self.source.path.display())
    }
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// The scene renders, but not as its author may have meant.
    Warning,
    /// The scene cannot be rendered.
    Error,
}

/// One message.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// Stable name of the kind of problem, e.g. `scene::unknown-plugin`.
    pub code: &'static str,
    /// The mistake, in one sentence.
    pub message: String,
    /// Where, if the problem has a place in a text file.
    pub span: Option<Span>,
    /// Shown at the place itself: what was expected, the nearest known name.
    pub label: Option<String>,
    /// A remedy, or the consequence.
    pub help: Option<String>,
    /// The picture will be another than the file asks for: said even where warnings are not wanted.
    pub changes_picture: bool,
}

impl Diagnostic {
    /// An error.
    pub fn error(code: &'static str, message: impl Into<String>) -> Diagnostic {
        Diagnostic {
            severity: Severity::Error,
            code,
            message: message.into(),
            span: None,
            label: None,
            help: None,
            changes_picture: false,
        }
    }

    /// An error about what is not supported and would change the picture. Whoever forces the scene to load gets a
    /// warning instead.
    pub fn unsupported(message: impl Into<String>) -> Diagnostic {
        Diagnostic::error("scene::unsupported", message).changing_picture()
    }

    /// A warning.
    pub fn warning(code: &'static str, message: impl Into<String>) -> Diagnostic {
        Diagnostic { severity: Severity::Warning, ..Diagnostic::error(code, message) }
    }

    /// A note.
    pub fn note(code: &'static str, message: impl Into<String>) -> Diagnostic {
        Diagnostic { severity: Severity::Note, ..Diagnostic::error(code, message) }
    }

    /// The message and its place, on one line.
    pub fn line(&self) -> String {
        match &self.span {
            Some(span) => format!("{}: {}", span.location(), self.message),
            None => self.message.clone(),
        }
    }

    /// Adds the place.
    pub fn at(mut self, span: impl Into<Option<Span>>) -> Diagnostic {
        self.span = span.into();
        self
    }

    /// Adds the text shown at the place.
    pub fn label(mut self, label: impl Into<String>) -> Diagnostic {
        self.label = Some(label.into());
        self
    }

    /// Marks a message that tells of a picture other than the file asks for.
    pub fn changing_picture(mut self) -> Diagnostic {
        self.changes_picture = true;
        self
    }

    /// Adds advice.
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help = Some(help.into());
        self
    }
}

/// Every message about one scene, in the order found.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    /// The messages.
    pub list: Vec<Diagnostic>,
}

impl Diagnostics {
    /// Adds one.
    pub fn push(&mut self, d: Diagnostic) {
        self.list.push(d);
    }

    /// How many of this severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|d| d.severity == severity).count()
    }

    /// The messages that tell of a picture other than the file asks for.
    pub fn changing_picture(&self) -> Diagnostics {
        Diagnostics { list: self.list.iter().filter(|d| d.changes_picture).cloned().collect() }
    }

    /// True if the scene cannot be rendered.
    pub fn has_errors(&self) -> bool {
        self.count(Severity::Error) > 0
    }
}

/// The known name nearest to `name`, if it is near enough to be a slip.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(name, k), k))
        .filter(|&(distance, k)| distance <= 1 + k.len() / 4)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, k)| k)
}
