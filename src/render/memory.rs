//! Memory that a render needs at least, compared with what there is before anything is allocated.

use super::{JobError, Method};
use crate::film::Pyramid;

/// Bytes of a pixel's sums and sums of squares in a film.
const FILM_BYTES: u64 = 48;
/// Bytes of a pixel's mean and variance, as they are computed and as channels of a picture.
const PICTURE_BYTES: u64 = 48;
/// Bytes of a pixel in the two pictures of a technique.
const TECHNIQUE_BYTES: u64 = 48;

/// Bytes of a stored light sub-path of one vertex, with its densities and the memory of sorting (as measured: 500 to
/// 700).
const SUBPATH_BYTES: u64 = 400;
/// Parameter of methods that store light sub-paths: how many.
const PRESAMPLED_PATHS: &str = "presampled_paths";

/// Films that are held at the same time.
#[derive(Clone, Copy, Debug)]
pub struct FilmMemory {
    /// The part of the picture that is rendered: x, y, width, height.
    pub window: [u32; 4],
    /// Number of films.
    pub films: usize,
    /// Length in edges of the longest paths of each film's pyramid, if there is one.
    pub pyramid_edges: Option<usize>,
}

impl FilmMemory {
    /// Bytes that films, pyramids and the final picture need.
    pub fn bytes(&self) -> u64 {
        let [_, _, width, height] = self.window.map(u64::from);
        let techniques = self.pyramid_edges.map_or(0, Pyramid::techniques_up_to) as u64;
        let per_film = TECHNIQUE_BYTES.saturating_mul(techniques).saturating_add(FILM_BYTES);
        // The sum of all films is one more.
        let per_pixel = per_film.saturating_mul(self.films as u64 + 1).saturating_add(PICTURE_BYTES);
        width.saturating_mul(height).saturating_mul(per_pixel)
    }

    /// Compares the need with the memory that is available, where the system tells.
    ///
    /// # Errors
    /// If there is less; the message says what is needed.
    pub fn check(&self) -> Result<(), JobError> {
        let [_, _, width, height] = self.window;
        let what = match self.pyramid_edges {
            Some(_) => format!("a picture of {width} x {height} pixels with a pyramid of techniques"),
            None => format!("a picture of {width} x {height} pixels"),
        };
        check_available(&what, self.bytes())
    }
}

/// Compares the need of the light sub-paths that a method is told to store with the memory that is available.
///
/// # Errors
/// If there is less; the message says what is needed.
pub fn check_light_subpaths(method: &Method) -> Result<(), JobError> {
    let pairs = method.params.pairs();
    let given = pairs.iter().find(|(key, _)| *key == PRESAMPLED_PATHS).and_then(|(_, value)| value.parse().ok());
    let paths: u64 = given.unwrap_or(0);
    check_available(&format!("{} with {paths} light sub-paths", method.label), paths.saturating_mul(SUBPATH_BYTES))
}

/// Compares a need in bytes with the memory that is available, where the system tells.
///
/// # Errors
/// If there is less; the message says what is needed for `what`.
pub fn check_available(what: &str, bytes: u64) -> Result<(), JobError> {
    match available_bytes() {
        Some(available) if bytes > available => Err(JobError::Input(format!(
            "{what} needs at least {} of memory, and {} is available",
            in_units(bytes),
            in_units(available)
        ))),
        _ => Ok(()),
    }
}

/// Bytes in the largest binary unit that leaves a number above one.
fn in_units(bytes: u64) -> String {
    let gib = bytes as f64 / f64::from(1u32 << 30);
    if gib >= 1.0 { format!("{gib:.1} GiB") } else { format!("{:.1} MiB", gib * 1024.0) }
}

/// Bytes that this process can still allocate: the least of the machine's available memory, the limit of its control
/// group and the limit of its address space. None where the system tells neither (it is not Linux).
pub fn available_bytes() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let machine = read("/proc/meminfo").and_then(|text| kibibytes(&text, "MemAvailable:"));
    let number = |path: &str| read(path)?.trim().parse::<u64>().ok();
    let group = |limit: &str, used: &str| Some(number(limit)?.saturating_sub(number(used)?));
    let new_group = group("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current");
    let old_group = group("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes");
    let address_space = read("/proc/self/limits").and_then(|text| address_limit(&text)).map(|limit| {
        let used = read("/proc/self/status").and_then(|text| kibibytes(&text, "VmSize:"));
        limit.saturating_sub(used.unwrap_or(0))
    });
    [machine, new_group, old_group, address_space].into_iter().flatten().min()
}

/// The value in bytes of a line such as `VmSize:   1234 kB`.
fn kibibytes(text: &str, key: &str) -> Option<u64> {
    let value = text.lines().find_map(|l| l.strip_prefix(key))?;
    value.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// The soft limit of the address space in bytes; none if it is unlimited.
fn address_limit(text: &str) -> Option<u64> {
    text.lines().find_map(|l| l.strip_prefix("Max address space"))?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn system_files_are_understood() {
        assert_eq!(kibibytes("MemTotal: 5 kB\nMemAvailable:   12 kB\n", "MemAvailable:"), Some(12 * 1024));
        assert_eq!(kibibytes("MemTotal: 5 kB\n", "MemAvailable:"), None);
        let limits = |v: &str| format!("Limit  Soft  Hard  Units\nMax address space         {v}   unlimited   bytes\n");
        assert_eq!(address_limit(&limits("4096")), Some(4096));
        assert_eq!(address_limit(&limits("unlimited")), None);
    }

    #[test]
    fn needs_are_those_of_all_films() {
        let need = |films, pyramid_edges| FilmMemory { window: [3, 4, 10, 100], films, pyramid_edges }.bytes();
        assert_eq!(need(1, None), 1000 * (48 * 2 + 48));
        assert_eq!(need(2, None), 1000 * (48 * 3 + 48));
        // Two techniques of one edge.
        assert_eq!(need(1, Some(1)), 1000 * (2 * (48 + 2 * 48) + 48));
        let huge = FilmMemory { window: [0, 0, u32::MAX, u32::MAX], films: usize::MAX, pyramid_edges: Some(32) };
        assert!(huge.check().unwrap_err().to_string().contains("of memory"));
    }
}
