//! The command line; the only room that prints.

/// Prints a line of results. A reader that has gone away (`| head`) is not an error; any other failure is one at the
/// end of the command.
macro_rules! out {
    ($($text:tt)*) => { $crate::app::output::print(format_args!($($text)*)) };
}

/// Prints a line to standard error, in the same way.
macro_rules! note {
    ($($text:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

mod bench;
mod check_rays;
mod cli;
mod compare;
mod config;
mod converge;
mod environment;
mod excerpt;
mod info;
mod list;
mod measure_args;
mod merge;
mod numbers;
mod output;
mod processor;
mod profile;
mod render;
mod replay;
mod report;
mod session;
mod skeleton;

use crate::render::JobError;
use clap::Parser;
use std::process::ExitCode;

/// Why a command did not succeed; each kind has its exit code.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Bad usage or input, already explained on standard error if the text is empty.
    Input(String),
    /// The file system refused.
    Io(String),
    /// `--strict`, and samples were not finite.
    NonFinite(u64),
    /// `bench --against`: so many rows are worse than they were.
    Regression(usize),
    /// `bench --against`: other programs used the processors, and nothing but errors was judged.
    NotJudged,
    /// `--require-error-target`: the estimated error is not below the target.
    Target,
    /// Ctrl-C; everything was written.
    Interrupted,
}

impl Failure {
    pub(crate) fn input(e: impl std::fmt::Display) -> Failure {
        Failure::Input(e.to_string())
    }

    pub(crate) fn io(e: impl std::fmt::Display) -> Failure {
        Failure::Io(e.to_string())
    }

    /// Prints the failure to standard error, unless it has been explained there already.
    fn print(&self) {
        match self {
            Failure::Input(text) | Failure::Io(text) if text.is_empty() => {}
            Failure::Input(text) | Failure::Io(text) => note!("error: {text}"),
            Failure::NonFinite(n) => note!("error: {n} samples were not finite (--strict)"),
            Failure::Regression(n) => note!("error: worse than the baseline beyond noise: {n} rows"),
            Failure::NotJudged => note!(
                "error: other programs used the processors: errors are no worse than the baseline's, times were not \
                 judged; measure on a quiet machine, or use --allow-busy"
            ),
            Failure::Target => note!("error: the error target was not reached (--require-error-target)"),
            Failure::Interrupted => note!("interrupted"),
        }
    }

    fn exit_code(&self) -> u8 {
        match self {
            Failure::NonFinite(_) | Failure::Regression(_) | Failure::NotJudged | Failure::Target => 1,
            Failure::Input(_) => 2,
            Failure::Io(_) => 3,
            Failure::Interrupted => 130,
        }
    }
}

impl From<JobError> for Failure {
    fn from(e: JobError) -> Failure {
        match e {
            JobError::Load(failure) => {
                report::print(&failure.diagnostics);
                if failure.io { Failure::Io(String::new()) } else { Failure::Input(String::new()) }
            }
            JobError::Input(text) => Failure::Input(text),
            JobError::File(text) => Failure::Io(text),
            JobError::Interrupted => Failure::Interrupted,
        }
    }
}

/// Runs the program; the exit code tells how it ended.
pub fn main() -> ExitCode {
    if processor::reports_missing_instruction_sets() {
        return ExitCode::from(2);
    }
    parse_and_run()
}

/// A function of its own, so that nothing of it is computed before the check of the processor.
#[inline(never)]
fn parse_and_run() -> ExitCode {
    let cli = match cli::Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version are errors to clap, but not to the user.
            let code = if e.use_stderr() { 2 } else { 0 };
            let printed = e.print().map_err(|e| output::failure(&e));
            return match printed {
                Err(Some(failure)) if code == 0 => {
                    failure.print();
                    ExitCode::from(failure.exit_code())
                }
                _ => ExitCode::from(code),
            };
        }
    };
    let result = match cli.command {
        cli::Command::Render(args) => render::run(&args),
        cli::Command::Info(args) => info::run(&args),
        cli::Command::List(args) => list::run(&args),
        cli::Command::CheckRays(args) => check_rays::run(&args),
        cli::Command::Replay(args) => replay::run(&args),
        cli::Command::Compare(args) => compare::run(&args),
        cli::Command::Converge(args) => converge::run(&args),
        cli::Command::Profile(args) => profile::run(&args),
        cli::Command::Merge(args) => merge::run(&args),
        cli::Command::Bench(args) => bench::run(&args),
    };
    let result = result.and_then(|()| output::finish());
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.exit_code())
        }
    }
}
