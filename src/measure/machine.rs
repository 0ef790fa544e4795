//! Facts about the machine that a reader of a measurement needs, and its load by other programs meanwhile.

use super::report::Table;
use crate::render::stats::cpu_seconds;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// The machine and the program.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Processor.
    pub cpu: String,
    /// Threads that it offers to this process.
    pub hardware_threads: usize,
    /// Threads that render.
    pub threads: usize,
    /// Operating system and its version.
    pub system: String,
    /// Version of this program.
    pub version: &'static str,
    /// Commit that was checked out when the program was built, if that is known. The sources may have been changed
    /// since.
    pub commit: Option<&'static str>,
    /// Compiler.
    pub compiler: Option<&'static str>,
    /// Ray-query backend.
    pub backend: String,
}

impl Machine {
    /// This machine.
    pub fn here(threads: usize, backend: String) -> Machine {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let after = |text: &str, key: &str, separator: char| {
            let line = text.lines().find(|l| l.starts_with(key))?;
            Some(line.split_once(separator)?.1.trim().trim_matches('"').to_owned())
        };
        let cpu = after(&read("/proc/cpuinfo"), "model name", ':').unwrap_or_else(|| std::env::consts::ARCH.into());
        let name = after(&read("/etc/os-release"), "PRETTY_NAME", '=').unwrap_or_default();
        let kernel = read("/proc/sys/kernel/osrelease");
        Machine {
            cpu,
            hardware_threads: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            threads,
            system: format!("{} {} {}", std::env::consts::OS, kernel.trim(), name).trim().to_owned(),
            version: env!("CARGO_PKG_VERSION"),
            commit: option_env!("LIGHTSIEVE_COMMIT"),
            compiler: option_env!("LIGHTSIEVE_RUSTC"),
            backend,
        }
    }

    /// As a table.
    pub fn table(&self) -> Table {
        let mut table = Table::new(["machine", ""]);
        table.row(["processor", &self.cpu]);
        table.row(["threads", &format!("{} of {}", self.threads, self.hardware_threads)]);
        table.row(["system", &self.system]);
        table.row(["lightsieve", &format!("{}, commit {}", self.version, self.commit.unwrap_or("not known"))]);
        table.row(["compiler", self.compiler.unwrap_or("not known")]);
        table.row(["ray queries", &self.backend]);
        table
    }
}

/// How busy the machine was, where the system tells (Linux).
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Load {
    /// Seconds watched.
    pub seconds: f64,
    /// Load average over a minute, before.
    pub average_before: Option<f64>,
    /// Load average over a minute, after.
    pub average_after: Option<f64>,
    /// Share of all processor time that other processes took: measurements with more than a few percent are disturbed.
    pub others: Option<f64>,
}

/// Watches the machine from [`LoadWatch::start`] on.
#[derive(Debug)]
pub struct LoadWatch {
    start: Instant,
    average: Option<f64>,
    /// Busy and all processor time of the machine, and this process's.
    before: Option<(f64, f64, f64)>,
}

impl LoadWatch {
    /// Begins to watch.
    pub fn start() -> LoadWatch {
        LoadWatch { start: Instant::now(), average: load_average(), before: now() }
    }

    /// The load since then.
    pub fn finish(&self) -> Load {
        let others = self.before.zip(now()).map(|((busy0, all0, own0), (busy1, all1, own1))| {
            let (busy, all, own) = (busy1 - busy0, all1 - all0, own1 - own0);
            if all > 0.0 { ((busy - own) / all).clamp(0.0, 1.0) } else { 0.0 }
        });
        Load {
            seconds: self.start.elapsed().as_secs_f64(),
            average_before: self.average,
            average_after: load_average(),
            others,
        }
    }
}

/// Share of all processor time from which on other processes disturb a measurement of time.
const DISTURBING: f64 = 0.05;

impl Load {
    /// The share that other processes took, if it is so large that measured times say little.
    pub fn disturbance(&self) -> Option<f64> {
        self.others.filter(|share| *share > DISTURBING)
    }

    /// A warning if other processes took so much processor time that measured times say little.
    pub fn warning(&self) -> Option<String> {
        let percent = 100.0 * self.disturbance()?;
        Some(format!("other programs took {percent:.0} % of the processors: times of this measurement say little"))
    }

    /// As a sentence.
    pub fn sentence(&self) -> String {
        let number = |v: Option<f64>| v.map_or("unknown".into(), |v| format!("{v:.2}"));
        let share = self.others.map_or("an unknown share".into(), |v| format!("{:.1} %", 100.0 * v));
        format!(
            "measured in {:.0} s; load average {} before and {} after; other programs took {share} of the processors",
            self.seconds,
            number(self.average_before),
            number(self.average_after),
        )
    }
}

/// Processor nanoseconds of all threads of this process, where the system tells (Linux): exact but for threads that
/// are running at the moment, unlike the ticks of [`cpu_seconds`].
pub fn cpu_ns() -> Option<f64> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    let of = |task: std::fs::DirEntry| {
        // A thread may end between the two calls.
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    let sum: f64 = tasks.flatten().filter_map(of).sum();
    (sum > 0.0).then_some(sum)
}

/// Runs `f` and tells the processor nanoseconds that it took on all threads, or else its wall time on `threads`
/// threads. Other programs that want the processors do not count, unlike in wall time.
pub fn cpu_time<T>(threads: usize, f: impl FnOnce() -> T) -> (f64, T) {
    let (before, start) = (cpu_ns(), Instant::now());
    let out = f();
    let wall = start.elapsed().as_nanos() as f64 * threads as f64;
    (before.zip(cpu_ns()).map_or(wall, |(a, b)| b - a), out)
}

fn load_average() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

fn now() -> Option<(f64, f64, f64)> {
    // The first line sums all processors: user, nice, system, idle, iowait, … in clock ticks of 1/100 s.
    let stat = std::fs::read_to_string("/proc/stat").ok()?;
    let ticks: Vec<f64> = stat.lines().next()?.split_whitespace().skip(1).filter_map(|v| v.parse().ok()).collect();
    let (idle, all) = (ticks.get(3)? + ticks.get(4)?, ticks.iter().take(8).sum::<f64>());
    Some(((all - idle) / 100.0, all / 100.0, cpu_seconds()?))
}
