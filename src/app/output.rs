//! Standard output, whose failures are failures of the command.

use super::Failure;
use std::fmt::Arguments;
use std::io::{self, Write};
use std::sync::OnceLock;

/// The first failure of standard output, but for a reader that has gone away.
static FAILURE: OnceLock<String> = OnceLock::new();

/// Prints a line; a failure is kept for [`finish`].
pub(crate) fn print(line: Arguments) {
    keep(writeln!(io::stdout(), "{line}"));
}

/// Writes out what is buffered, and tells whether everything was printed.
///
/// # Errors
/// If standard output could not be written, unless its reader has gone away.
pub(crate) fn finish() -> Result<(), Failure> {
    keep(io::stdout().flush());
    FAILURE.get().map_or(Ok(()), |text| Err(Failure::Io(text.clone())))
}

/// The failure that an error of standard output is; none if the reader has gone away.
pub(crate) fn failure(e: &io::Error) -> Option<Failure> {
    (e.kind() != io::ErrorKind::BrokenPipe).then(|| Failure::Io(format!("standard output: {e}")))
}

fn keep(result: io::Result<()>) {
    if let Some(Failure::Io(text)) = result.err().as_ref().and_then(failure) {
        // The first failure tells more than those that follow from it.
        let _ = FAILURE.set(text);
    }
}
