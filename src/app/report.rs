//! Diagnostics for people: file, line, the text underlined, what was expected. Long texts are clipped, and of many
//! messages of one kind the first are shown and the others counted.

use super::excerpt::Excerpt;
use crate::scene::{Diagnostic, Diagnostics, Severity};
use codespan_reporting::diagnostic::{Diagnostic as Shown, Label, Severity as Level};
use codespan_reporting::term::{
    self,
    termcolor::{BufferedStandardStream, ColorChoice},
};
use std::collections::HashMap;
use std::io::{IsTerminal, Write};

/// Messages of one kind that are shown.
const SHOWN: usize = 20;
/// Characters of a message, a label or an advice that are shown.
const MAX_CHARS: usize = 400;

/// Prints messages to standard error, then how many there were.
pub(crate) fn print(diagnostics: &Diagnostics) {
    let colour = if std::io::stderr().is_terminal() { ColorChoice::Auto } else { ColorChoice::Never };
    let mut out = BufferedStandardStream::stderr(colour);
    let mut counts: HashMap<(Severity, &str), usize> = HashMap::new();
    for d in &diagnostics.list {
        let count = counts.entry((d.severity, d.code)).or_default();
        *count += 1;
        if *count <= SHOWN {
            print_one(&mut out, d);
        }
    }
    // A reader that has gone away is no error.
    let _ = out.flush();
    let mut more: Vec<_> = counts.into_iter().filter(|&(_, count)| count > SHOWN).collect();
    more.sort_unstable();
    for ((severity, code), count) in more {
        note!("{}[{code}]: {} more of this kind", name(severity), count - SHOWN);
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

fn name(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}

fn print_one(out: &mut BufferedStandardStream, d: &Diagnostic) {
    let level = match d.severity {
        Severity::Error => Level::Error,
        Severity::Warning => Level::Warning,
        Severity::Note => Level::Note,
    };
    let mut shown = Shown::new(level).with_code(d.code).with_message(clipped(&d.message));
    if let Some(help) = &d.help {
        shown = shown.with_notes(vec![clipped(help)]);
    }
    let excerpt = d.span.as_ref().map(Excerpt::new).unwrap_or_default();
    if d.span.is_some() {
        let label = Label::primary((), excerpt.marked());
        shown = shown.with_labels(vec![match &d.label {
            Some(text) => label.with_message(clipped(text)),
            None => label,
        }]);
    }
    // A message that cannot be drawn is still said.
    if term::emit_to_write_style(out, &term::Config::default(), &excerpt, &shown).is_err() {
        note!("{}: {}", d.code, clipped(&d.message));
    }
}

/// The beginning of a text that is too long.
fn clipped(text: &str) -> String {
    match text.char_indices().nth(MAX_CHARS) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_clipped_between_characters() {
        assert_eq!(clipped("short"), "short");
        let long = clipped(&"ü".repeat(MAX_CHARS + 1));
        assert_eq!((long.chars().count(), long.ends_with("ü …")), (MAX_CHARS + 2, true));
    }
}
