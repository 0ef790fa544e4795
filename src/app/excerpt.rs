//! The lines of a source file that a message points to, with a long line clipped around the place.

use crate::scene::Span;
use codespan_reporting::files::{Error, Files};
use std::ops::Range;

/// Bytes of a line that are shown before the marked text, and of all that is marked and behind it.
const BEFORE: usize = 60;
const BEHIND: usize = 140;
/// Lines of a marked text that are shown.
const MAX_LINES: usize = 10;

/// Lines of a file from the beginning of a span on.
#[derive(Clone, Debug, Default)]
pub(super) struct Excerpt<'a> {
    name: String,
    text: &'a str,
    /// Number of the first line, from 1.
    line: usize,
    /// Characters of the first line that are left out before `text`.
    clipped_chars: usize,
    /// Bytes of `text` that are marked.
    marked: Range<usize>,
    /// Bytes of `text` at which lines begin.
    line_starts: Vec<usize>,
}

impl<'a> Excerpt<'a> {
    pub fn new(span: &'a Span) -> Excerpt<'a> {
        let all = span.source.text.as_str();
        let (start, end) = (boundary(all, span.range.start), boundary(all, span.range.end.max(span.range.start)));
        let line_begin = all[..start].rfind('\n').map_or(0, |i| i + 1);
        let begin = boundary(all, line_begin.max(start.saturating_sub(BEFORE)));
        let marked_lines = all[start..end].split_inclusive('\n').take(MAX_LINES);
        let marked_end = start + marked_lines.map(str::len).sum::<usize>();
        let line_end = all[marked_end..].find('\n').map_or(all.len(), |i| marked_end + i);
        let limit = start
            + if marked_end > start && all[start..marked_end].contains('\n') { MAX_LINES * BEHIND } else { BEHIND };
        let text = &all[begin..boundary(all, line_end.min(limit))];
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(i, _)| i + 1)).collect();
        Excerpt {
            name: span.source.path.display().to_string(),
            text,
            line: all[..line_begin].bytes().filter(|&b| b == b'\n').count() + 1,
            clipped_chars: all[line_begin..begin].chars().count(),
            marked: start - begin..(marked_end - begin).min(text.len()),
            line_starts,
        }
    }

    /// Bytes of the excerpt that the message is about.
    pub fn marked(&self) -> Range<usize> {
        self.marked.clone()
    }
}

/// The largest boundary between characters that is not above `at`.
fn boundary(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}

impl<'f> Files<'f> for Excerpt<'_> {
    type FileId = ();
    type Name = &'f str;
    type Source = &'f str;

    fn name(&'f self, (): ()) -> Result<&'f str, Error> {
        Ok(&self.name)
    }

    fn source(&'f self, (): ()) -> Result<&'f str, Error> {
        Ok(self.text)
    }

    fn line_index(&'f self, (): (), byte: usize) -> Result<usize, Error> {
        Ok(self.line_starts.partition_point(|&start| start <= byte).saturating_sub(1))
    }

    fn line_range(&'f self, (): (), index: usize) -> Result<Range<usize>, Error> {
        let given = Error::LineTooLarge { given: index, max: self.line_starts.len().saturating_sub(1) };
        let start = *self.line_starts.get(index).ok_or(given)?;
        Ok(start..self.line_starts.get(index + 1).copied().unwrap_or(self.text.len()))
    }

    fn line_number(&'f self, (): (), index: usize) -> Result<usize, Error> {
        Ok(self.line + index)
    }

    fn column_number(&'f self, (): (), index: usize, byte: usize) -> Result<usize, Error> {
        let range = self.line_range((), index)?;
        let before = boundary(self.text, byte.clamp(range.start, range.end));
        let clipped = if index == 0 { self.clipped_chars } else { 0 };
        Ok(clipped + self.text[range.start..before].chars().count() + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::diag::Source;
    use std::path::PathBuf;
    use std::sync::Arc;

    fn span(text: &str, range: Range<usize>) -> Span {
        Span { source: Arc::new(Source { path: PathBuf::from("a.xml"), text: text.into() }), range }
    }

    #[test]
    fn a_long_line_is_clipped_around_the_place() {
        let text = format!("first\n{}HERE{}\nlast", "ä".repeat(1000), "b".repeat(100_000));
        let start = text.find("HERE").unwrap();
        let span = span(&text, start..start + 4);
        let excerpt = Excerpt::new(&span);
        assert!(excerpt.text.len() <= BEFORE + BEHIND, "{}", excerpt.text.len());
        assert_eq!(&excerpt.text[excerpt.marked()], "HERE");
        assert_eq!(excerpt.line_number((), 0).unwrap(), 2);
        assert_eq!(excerpt.column_number((), 0, excerpt.marked.start).unwrap(), 1001);
        assert_eq!(span.line_column(), (2, 1001));
    }

    #[test]
    fn short_lines_are_whole_and_long_spans_end() {
        let text = format!("zero\n  <a\n{}/>\nend\n", "b=\"c\"\n".repeat(1000));
        let from = text.find('<').unwrap();
        let span = span(&text, from..text.find("end").unwrap());
        let excerpt = Excerpt::new(&span);
        assert!(excerpt.text.starts_with("  <a\nb=\"c\"\n") && excerpt.line_starts.len() <= MAX_LINES + 1);
        assert_eq!((excerpt.line, excerpt.column_number((), 0, excerpt.marked.start).unwrap()), (2, 3));
        // A place behind the end of the file.
        let behind = super::tests::span("ab", 7..9);
        assert_eq!(Excerpt::new(&behind).marked(), 2..2);
    }
}
