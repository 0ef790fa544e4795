//! Diagnostics for people: file, line, the text underlined, what was expected.

use crate::scene::{Diagnostic, Diagnostics, Severity};
use codespan_reporting::diagnostic::{Diagnostic as Shown, Label, Severity as Level};
use codespan_reporting::files::SimpleFile;
use codespan_reporting::term::{
    self,
    termcolor::{ColorChoice, StandardStream},
};
use std::io::IsTerminal;

/// Prints every message to standard error, then how many there were.
pub(crate) fn print(diagnostics: &Diagnostics) {
    let colour = if std::io::stderr().is_terminal() { ColorChoice::Auto } else { ColorChoice::Never };
    let mut out = StandardStream::stderr(colour);
    for d in &diagnostics.list {
        print_one(&mut out, d);
    }
    let (errors, warnings) = (diagnostics.count(Severity::Error), diagnostics.count(Severity::Warning));
    let plural = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    match (errors, warnings) {
        (0, 0) => {}
        (0, w) => note!("{}", plural(w, "warning")),
        (e, 0) => note!("{}", plural(e, "error")),
        (e, w) => note!("{}, {}", plural(e, "error"), plural(w, "warning")),
    }
}

fn print_one(out: &mut StandardStream, d: &Diagnostic) {
    let level = match d.severity {
        Severity::Error => Level::Error,
        Severity::Warning => Level::Warning,
        Severity::Note => Level::Note,
    };
    let mut shown = Shown::new(level).with_code(d.code).with_message(&d.message);
    if let Some(help) = &d.help {
        shown = shown.with_notes(vec![help.clone()]);
    }
    let (name, text) =
        d.span.as_ref().map_or((String::new(), ""), |s| (s.source.path.display().to_string(), s.source.text.as_str()));
    if let Some(span) = &d.span {
        let label = Label::primary((), span.range.clone());
        shown = shown.with_labels(vec![match &d.label {
            Some(text) => label.with_message(text),
            None => label,
        }]);
    }
    let file = SimpleFile::new(name, text);
    // A message that cannot be drawn is still said.
    if term::emit_to_write_style(out, &term::Config::default(), &file, &shown).is_err() {
        note!("{}: {}", d.code, d.message);
    }
}
