//! Surroundings of every command that loads a scene: threads, Ctrl-C, and messages on the terminal.

use super::{Failure, report};
use crate::render::memory::check_available;
use crate::render::{Observer, Progress, Runtime};
use crate::scene::Diagnostics;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Once, PoisonError};

/// Threads, Ctrl-C and terminal of a command.
pub(crate) struct Environment {
    /// Number of threads of the pool.
    pub threads: usize,
    pub pool: rayon::ThreadPool,
    pub console: Console,
}

impl Environment {
    /// An environment with so many threads, or as many as the machine offers.
    pub fn new(threads: Option<u32>, quiet: bool) -> Result<Environment, Failure> {
        let all = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let threads = threads.map_or_else(all, |n| n as usize);
        check_available(&format!("{threads} threads: their stack"), threads as u64 * STACK_BYTES)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES as usize).build();
        let pool = pool.map_err(|e| {
            Failure::Input(format!("{threads} threads cannot be started: {e}; choose fewer with --threads"))
        })?;
        Ok(Environment { threads, pool, console: Console::new(quiet) })
    }

    /// The environment as jobs see it.
    pub fn runtime(&self) -> Runtime<'_> {
        Runtime { pool: &self.pool, interrupt: self.interrupt(), observer: &self.console }
    }

    /// Set by the first Ctrl-C.
    pub fn interrupt(&self) -> &AtomicBool {
        &self.console.interrupt
    }

    /// True after Ctrl-C.
    pub fn is_interrupted(&self) -> bool {
        self.interrupt().load(Ordering::Relaxed)
    }
}

/// Messages and the progress bar on standard error.
pub(crate) struct Console {
    /// Only errors are printed, and what makes the picture another than the scene file asks for.
    pub quiet: bool,
    interrupt: Arc<AtomicBool>,
    ctrl_c: Once,
    bar: Mutex<ProgressBar>,
}

/// Bytes of a thread's stack, reserved as it starts.
const STACK_BYTES: u64 = 2 << 20;
/// Steps of the progress bar.
const BAR_STEPS: f64 = 1000.0;

impl Console {
    fn new(quiet: bool) -> Console {
        let bar = Mutex::new(ProgressBar::hidden());
        Console { quiet, interrupt: Arc::default(), ctrl_c: Once::new(), bar }
    }

    /// Prints a line to standard error, unless the console is quiet.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            note!("{text}");
        }
    }

    /// From now on the first Ctrl-C lets the running iteration end and everything be written; the second quits at once.
    pub fn catch_ctrl_c(&self) {
        self.ctrl_c.call_once(|| {
            let interrupt = self.interrupt.clone();
            let handler = move || {
                if interrupt.swap(true, Ordering::Relaxed) {
                    std::process::exit(130);
                }
            };
            if let Err(e) = ctrlc::set_handler(handler) {
                note!("warning: Ctrl-C cannot be caught and will lose the picture: {e}");
            }
        });
    }

    /// Moves the progress bar to a part of the way, 0 … 1.
    pub fn show(&self, part: f64, message: String) {
        let bar = self.bar();
        bar.set_position((part * BAR_STEPS) as u64);
        bar.set_message(message);
    }

    fn bar(&self) -> std::sync::MutexGuard<'_, ProgressBar> {
        self.bar.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Console {
    fn diagnostics(&self, new: &Diagnostics) {
        if !self.quiet || new.has_errors() {
            report::print(new);
        } else {
            report::print(&new.changing_picture());
        }
    }

    fn note(&self, text: &str) {
        self.say(text);
    }

    fn warning(&self, text: &str) {
        self.say(&format!("warning: {text}"));
    }

    fn run_begins(&self) {
        self.catch_ctrl_c();
        if self.quiet || !std::io::stderr().is_terminal() {
            return;
        }
        let bar = ProgressBar::new(BAR_STEPS as u64);
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  ETA {eta}") {
            bar.set_style(style);
        }
        *self.bar() = bar;
    }

    fn progress(&self, progress: &Progress) {
        let spp = progress.iterations;
        let rate = progress.rays as f64 / progress.elapsed.as_secs_f64().max(1e-9);
        let message = match progress.error {
            Some(error) => format!("{spp} spp  {} about {:.2e}", error.measure, error.value),
            None => format!("{spp} spp  {:.2} Mrays/s", rate / 1e6),
        };
        self.show(progress.used, message);
    }

    fn run_ends(&self) {
        let bar = std::mem::replace(&mut *self.bar(), ProgressBar::hidden());
        bar.finish_and_clear();
    }
}
