//! Files appear whole or not at all: written beside their place, flushed to the disk, then renamed over it.
//!
//! `tempfile::NamedTempFile::persist` is the rename alone: it replaces a symbolic link or a device by a file, gives the
//! result the mode 0600 instead of that of the file it replaces, overwrites files that are write-protected, and flushes
//! nothing. What is done about that here is most of this file, so that `tempfile` stays a dependency of tests.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

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

    let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
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

/// Removed when dropped, unless kept.
struct Temporary {
    path: PathBuf,
}

impl Temporary {
    fn create(folder: &Path) -> io::Result<(Temporary, File)> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        loop {
            let n = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".lightsieve-{}-{n}.tmp", std::process::id()));
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
    fn leftovers_of_a_killed_process_are_stepped_over() {
        let folder = tempfile::tempdir().unwrap();
        // Whatever the counter says now, the next few names are taken.
        let (first, _file) = Temporary::create(folder.path()).unwrap();
        let name = first.path.file_name().unwrap().to_str().unwrap().to_owned();
        let n: u32 = name.trim_end_matches(".tmp").rsplit('-').next().unwrap().parse().unwrap();
        for k in 1..200 {
            fs::write(folder.path().join(format!(".lightsieve-{}-{}.tmp", std::process::id(), n + k)), "").unwrap();
        }
        let path = folder.path().join("a");
        atomic_write(&path, |w| w.write_all(b"x")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"x");
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
