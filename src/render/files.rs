//! Files that a command writes and reads: no output may replace an input or another output, every output is tried
//! before the work begins, and what cannot be written after it goes to another place.

use super::JobError;
use crate::image::{check_writable, check_writable_folder};
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A file that a command writes.
#[derive(Clone, Debug)]
struct OutputFile {
    /// Option that names it.
    option: &'static str,
    path: PathBuf,
    /// Folder that the command makes if it does not exist.
    folder: Option<PathBuf>,
}

/// All files that a command writes.
#[derive(Clone, Debug, Default)]
pub struct OutputFiles {
    files: Vec<OutputFile>,
}

/// A file apart from its name.
#[derive(PartialEq, Eq)]
enum Identity {
    /// An existing file: device and number in its file system.
    #[cfg(unix)]
    Existing(u64, u64),
    /// Canonical name of the folder, and name.
    Name(PathBuf),
}

impl OutputFiles {
    /// Adds a file that `option` names. The same name under the same option is one file.
    pub fn add(&mut self, option: &'static str, path: &Path) {
        if !self.files.iter().any(|f| f.option == option && f.path == path) {
            self.files.push(OutputFile { option, path: path.to_owned(), folder: None });
        }
    }

    /// Adds files in a folder that `option` names and that is made if it does not exist.
    pub fn add_folder(&mut self, option: &'static str, folder: &Path, names: &[&str]) {
        let file = |name: &&str| OutputFile { option, path: folder.join(name), folder: Some(folder.to_owned()) };
        self.files.extend(names.iter().map(file));
    }

    /// Checks that the files are different and that each can be written. Nothing is changed.
    ///
    /// # Errors
    /// If two outputs are one file, or a file cannot be written.
    pub fn check(&self) -> Result<(), JobError> {
        for (i, a) in self.files.iter().enumerate() {
            for b in &self.files[..i] {
                if identity(&a.path).is_some_and(|id| Some(id) == identity(&b.path)) {
                    return Err(JobError::Input(format!(
                        "{}: the file of {} is that of {} too: one would replace the other",
                        a.path.display(),
                        a.option,
                        b.option
                    )));
                }
            }
        }
        for file in &self.files {
            let missing_folder = file.folder.as_ref().filter(|f| !f.is_dir());
            let tried = missing_folder.map_or_else(|| check_writable(&file.path), |f| check_writable_folder(f));
            tried.map_err(|e| {
                let missing = file.path.parent().filter(|p| missing_folder.is_none() && is_missing(p));
                let reason = missing.map_or_else(|| e.to_string(), |_| "the folder does not exist".into());
                JobError::File(format!("{}: cannot be written: {reason}", file.path.display()))
            })?;
        }
        Ok(())
    }

    /// Checks that no output is one of the files that the command reads.
    ///
    /// # Errors
    /// If one is.
    pub fn check_inputs<'a>(&self, inputs: impl IntoIterator<Item = &'a Path>) -> Result<(), JobError> {
        let outputs: Vec<_> = self.files.iter().filter_map(|f| identity(&f.path).map(|id| (f, id))).collect();
        for input in inputs {
            let Some(id) = identity(input) else { continue };
            if let Some((file, _)) = outputs.iter().find(|(_, output)| *output == id) {
                return Err(JobError::Input(format!(
                    "{}: {} would replace the input {}",
                    file.path.display(),
                    file.option,
                    input.display()
                )));
            }
        }
        Ok(())
    }
}

/// True if there is nothing of that name.
fn is_missing(folder: &Path) -> bool {
    !folder.as_os_str().is_empty() && !folder.exists()
}

/// True if both names are of one file, whether it exists or not.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    identity(a).is_some_and(|id| Some(id) == identity(b))
}

/// The identity of a regular file or of one that does not exist yet; writing to anything else replaces nothing.
fn identity(path: &Path) -> Option<Identity> {
    match std::fs::metadata(path) {
        #[cfg(unix)]
        Ok(metadata) if metadata.is_file() => {
            use std::os::unix::fs::MetadataExt;
            Some(Identity::Existing(metadata.dev(), metadata.ino()))
        }
        #[cfg(not(unix))]
        Ok(metadata) if metadata.is_file() => path.canonicalize().ok().map(Identity::Name),
        Ok(_) => None,
        Err(_) => {
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
            path.file_name().map(|name| Identity::Name(folder.join(name)))
        }
    }
}

/// Writes a file through `write`, or a file of a similar name in another folder if that fails: the working directory,
/// the folder of temporary files, or the home directory.
///
/// # Errors
/// The failure, and where the contents are instead.
pub fn write_or_rescue<E: Display>(path: &Path, write: impl Fn(&Path) -> Result<(), E>) -> Result<(), JobError> {
    let Err(failure) = write(path) else { return Ok(()) };
    let Some(name) = path.file_name() else { return Err(JobError::file(failure)) };
    let name = format!("lightsieve-rescued-{}-{}", std::process::id(), name.to_string_lossy());
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let folders = std::env::current_dir().into_iter().chain([std::env::temp_dir()]).chain(home);
    let mut places = folders.map(|folder| folder.join(&name)).filter(|place| !place.exists());
    Err(JobError::File(match places.find(|place| write(place).is_ok()) {
        Some(place) => format!("{failure}; its contents were written to {} instead", place.display()),
        None => format!("{failure}; no other place could be written to"),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_compared_apart_from_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("a"), "").unwrap();
        std::fs::hard_link(path("a"), path("b")).unwrap();
        std::os::unix::fs::symlink(path("a"), path("c")).unwrap();
        std::fs::create_dir(path("d")).unwrap();
        for (one, other, same) in [
            ("a", "b", true),
            ("a", "c", true),
            ("a", "d/../a", true),
            ("new", "d/../new", true),
            ("a", "new", false),
            ("new", "newer", false),
            ("d", "d", false),
        ] {
            assert_eq!(is_same_file(&path(one), &path(other)), same, "{one} {other}");
        }
        assert!(!is_same_file(Path::new("/dev/null"), Path::new("/dev/null")), "nothing is lost in a device");
    }
}
