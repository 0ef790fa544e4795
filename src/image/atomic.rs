//! Files appear whole or not at all: written beside their place, flushed to the disk, then renamed over it.
//!
//! `tempfile::NamedTempFile::persist` is the rename alone: it replaces a symbolic link or a device by a file, gives the
//! result the mode 0600 instead of that of the file it replaces, overwrites files that are write-protected, and flushes
//! nothing. What is done about that here is most of this file, so that `tempfile` stays a dependency of tests.

use crate::math::hash::mix64;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

/// Writes a file through `write` such that `path` holds either what it held before or all of the new contents.
///
/// A symbolic link is followed and stays; permissions of a file that is replaced are kept. Something that is there but
/// is no regular file (a pipe, a device) is written to directly, since renaming would put a file in its place.
///
/// # Errors
/// Whatever opening, `write`, flushing or renaming reports. The temporary file is removed then.
pub fn atomic_write(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let earlier = fs::metadata(&target).ok();
    if earlier.as_ref().is_some_and(|m| !m.is_file()) {
        let mut out = BufWriter::new(OpenOptions::new().write(true).open(&target)?);
        write(&mut out)?;
        return out.flush();
    }

    let folder = folder_of(&target);
    let (temporary, file) = Temporary::create(folder)?;
    if let Some(earlier) = earlier {
        // Opening would have failed on a file that is not ours to write; renaming over it must not succeed instead.
        OpenOptions::new().write(true).open(&target)?;
        file.set_permissions(earlier.permissions())?;
    }
    let mut out = BufWriter::new(file);
    write(&mut out)?;
    out.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()?;
    fs::rename(&temporary.path, &target)?;
    temporary.keep();
    // The contents are safe already; that a folder cannot be flushed (network file systems) is no failure.
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// The folder that holds `path`.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Tries whether [`atomic_write`] can write `path`, and leaves everything as it is: a file that exists is opened only,
/// one that does not is created under its name and removed, and a temporary file is created and removed beside it.
/// Devices and pipes are not tried, as a reader would notice.
///
/// # Errors
/// Whatever opening or creating reports.
pub fn check_writable(path: &Path) -> io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(metadata) if !metadata.is_file() && !metadata.is_dir() => return Ok(()),
        Ok(_) => drop(OpenOptions::new().write(true).open(&target)?),
        // A link to nothing is replaced by the file.
        Err(_) if fs::symlink_metadata(&target).is_ok() => {}
        Err(_) => {
            OpenOptions::new().write(true).create_new(true).open(&target)?;
            fs::remove_file(&target)?;
        }
    }
    check_writable_folder(folder_of(&target))
}

/// Tries whether files can be created in `folder`, or in the nearest of its parents that exists if it does not.
///
/// # Errors
/// Whatever creating a file reports.
pub fn check_writable_folder(folder: &Path) -> io::Result<()> {
    let existing = folder.ancestors().find(|f| f.as_os_str().is_empty() || fs::symlink_metadata(f).is_ok());
    let existing = existing.filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Temporary::create(existing).map(drop)
}

/// Removed when dropped, unless kept.
struct Temporary {
    path: PathBuf,
}

/// Age from which a temporary file of another machine or of an earlier boot is taken for left behind.
const STALE: Duration = Duration::from_secs(24 * 3600);

impl Temporary {
    fn create(folder: &Path) -> io::Result<(Temporary, File)> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        remove_leftovers(folder);
        loop {
            let n = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".lightsieve-{}-{}-{n}.tmp", process_space(), std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Temporary { path }, file)),
                // Left behind by a process of the same number that was killed.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
    }

    fn keep(self) {
        std::mem::forget(self);
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Removes temporary files of processes that were killed: of this boot and these process numbers if no process has the
/// number any more, and of any other after a day. A failure costs disk space alone.
fn remove_leftovers(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some((space, process)) = name.to_str().and_then(temporary_owner) else { continue };
        let left = if space == process_space() {
            process != std::process::id() && !Path::new(&format!("/proc/{process}")).exists()
        } else {
            let modified = entry.metadata().and_then(|m| m.modified()).ok();
            modified.and_then(|m| m.elapsed().ok()).is_some_and(|age| age > STALE)
        };
        if left {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The process space and the process that a temporary file's name tells.
fn temporary_owner(name: &str) -> Option<(&str, u32)> {
    let mut parts = name.strip_prefix(".lightsieve-")?.strip_suffix(".tmp")?.split('-');
    let (space, process) = (parts.next()?, parts.next()?.parse().ok()?);
    (space.len() == 16 && parts.next()?.parse::<u32>().is_ok() && parts.next().is_none()).then_some((space, process))
}

/// A name of the set that process numbers belong to: the boot of the machine and the namespace (Linux); 16 digits.
fn process_space() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let boot = fs::read("/proc/sys/kernel/random/boot_id").unwrap_or_default();
        let namespace = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
        let bytes = boot.iter().chain(namespace.as_os_str().as_encoded_bytes());
        format!("{:016x}", bytes.fold(0, |hash: u64, &b| mix64(hash.rotate_left(5) ^ u64::from(b))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failed_write_leaves_the_earlier_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        atomic_write(&path, |w| w.write_all(b"first")).unwrap();
        let failed = atomic_write(&path, |w| {
            w.write_all(&[0; 100_000])?;
            Err(io::Error::other("no more"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "no more");
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(names(folder.path()), ["a.json"]);
    }

    #[test]
    fn a_panicking_writer_leaves_no_temporary() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let panicked = std::panic::catch_unwind(|| atomic_write(&path, |_| panic!("expected by this test")));
        assert!(panicked.is_err());
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn replaces_contents_keeps_links_and_permissions() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a"), folder.path().join("link"));
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        symlink(&path, &link).unwrap();
        atomic_write(&link, |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(names(folder.path()), ["a", "link"]);
    }

    #[test]
    fn leftovers_of_this_process_number_are_stepped_over() {
        let folder = tempfile::tempdir().unwrap();
        // Whatever the counter says now, the next few names are taken.
        let (first, _file) = Temporary::create(folder.path()).unwrap();
        let name = first.path.file_name().unwrap().to_str().unwrap().to_owned();
        let (stem, n) = name.trim_end_matches(".tmp").rsplit_once('-').unwrap();
        let n: u32 = n.parse().unwrap();
        for k in 1..200 {
            fs::write(folder.path().join(format!("{stem}-{}.tmp", n + k)), "").unwrap();
        }
        let path = folder.path().join("a");
        atomic_write(&path, |w| w.write_all(b"x")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"x");
    }

    #[test]
    fn leftovers_of_killed_processes_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        // Process numbers of Linux end at 2^22.
        let dead = format!(".lightsieve-{}-99999999-0.tmp", process_space());
        let living = format!(".lightsieve-{}-1-0.tmp", process_space());
        let elsewhere = ".lightsieve-0123456789abcdef-99999999-0.tmp".to_owned();
        let (old, foreign) =
            (".lightsieve-0123456789abcdef-99999999-1.tmp".to_owned(), ".lightsieve-1-2.tmp".to_owned());
        for name in [&dead, &living, &elsewhere, &old, &foreign] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let long_ago = std::time::SystemTime::now() - 2 * STALE;
        File::options().write(true).open(folder.path().join(&old)).unwrap().set_modified(long_ago).unwrap();
        atomic_write(&folder.path().join("a"), |w| w.write_all(b"x")).unwrap();
        let mut expected = vec![living, elsewhere, foreign, "a".into()];
        expected.sort();
        assert_eq!(names(folder.path()), expected);
    }

    #[test]
    fn trying_a_name_changes_nothing() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("there"), "old").unwrap();
        symlink("nowhere", path("link")).unwrap();
        for name in ["there", "new", "link"] {
            check_writable(&path(name)).unwrap();
        }
        check_writable_folder(&path("a/b/c")).unwrap();
        assert_eq!(names(folder.path()), ["link", "there"]);
        assert_eq!(fs::read(path("there")).unwrap(), b"old");
        // The name itself is tried: this one is too long for the file system.
        assert!(check_writable(&path(&"n".repeat(300))).is_err());
        assert!(check_writable(&path("no/such")).is_err());
        assert!(check_writable(folder.path()).is_err());
        assert!(check_writable_folder(&path("there/below")).is_err());
    }

    #[test]
    fn a_full_device_and_a_missing_folder_are_errors() {
        let full = Path::new("/dev/full");
        if full.exists() {
            let e = atomic_write(full, |w| w.write_all(b"x")).unwrap_err();
            assert_eq!(e.kind(), io::ErrorKind::StorageFull);
            assert!(full.exists(), "the device is still there");
        }
        let folder = tempfile::tempdir().unwrap();
        let e = atomic_write(&folder.path().join("no/such/a.json"), |w| w.write_all(b"x")).unwrap_err();
        assert_eq!(e.kind(), io::ErrorKind::NotFound);
        assert!(atomic_write(folder.path(), |w| w.write_all(b"x")).is_err(), "a folder is no file");
    }
}
