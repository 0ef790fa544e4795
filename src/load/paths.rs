//! Where a file is that another file names. Names come from other machines: with backslashes, and with the folders of
//! whoever wrote them.

use super::report::Report;
use crate::scene::Span;
use crate::scene::diag::Diagnostic;
use std::path::{Path, PathBuf};

/// A file that another one names.
#[derive(Debug, PartialEq)]
pub(super) struct Located {
    /// The file; where nothing is found, its place in the first folder.
    pub path: PathBuf,
    /// An absolute name leads nowhere, and a file of the same name is in one of the folders.
    pub by_file_name: bool,
}

/// Looks for `name` in `folders` in turn: as written, with backslashes as separators, and, if it is absolute, by its
/// last part.
pub(super) fn locate(folders: &[PathBuf], name: &str) -> Located {
    let portable = name.replace('\\', "/");
    let in_folders = |name: &str| folders.iter().map(|f| f.join(name)).find(|p| p.exists());
    if let Some(path) = in_folders(name).or_else(|| in_folders(&portable)) {
        return Located { path, by_file_name: false };
    }
    if is_absolute(&portable)
        && let Some(last) = portable.rsplit('/').next().filter(|last| !last.is_empty())
        && let Some(path) = in_folders(last)
    {
        return Located { path, by_file_name: true };
    }
    let first = folders.first().map_or_else(PathBuf::new, Clone::clone);
    Located { path: first.join(portable), by_file_name: false }
}

/// [`locate`], with a warning where only the file's own name was found.
pub(super) fn locate_or_warn(folders: &[PathBuf], name: &str, span: Option<&Span>, report: &mut Report) -> PathBuf {
    let Located { path, by_file_name } = locate(folders, name);
    if by_file_name {
        let message = format!("`{name}` is not on this machine: `{}` is used", path.display());
        report.push(Diagnostic::warning("load::other-folder", message).at(span.cloned()));
    }
    path
}

/// Absolute here, or on Windows: `C:/…` or `//server/…`.
fn is_absolute(name: &str) -> bool {
    let drive = matches!(name.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic());
    drive || Path::new(name).is_absolute()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_by_names_of_other_machines() {
        let root = tempfile::tempdir().unwrap();
        let folders = [root.path().to_path_buf(), root.path().join("two")];
        std::fs::create_dir_all(root.path().join("two/maps")).unwrap();
        for file in ["a.png", "two/b.png", "two/maps/c.png", "x\\y.png"] {
            std::fs::write(root.path().join(file), "").unwrap();
        }
        for (name, path, by_file_name) in [
            ("a.png", "a.png", false),
            ("b.png", "two/b.png", false),
            ("maps/c.png", "two/maps/c.png", false),
            ("maps\\c.png", "two/maps/c.png", false),
            (".\\maps\\c.png", "two/./maps/c.png", false),
            // A backslash in a name is legal here.
            ("x\\y.png", "x\\y.png", false),
            ("C:\\Users\\me\\b.png", "two/b.png", true),
            ("d:/models/a.png", "a.png", true),
            ("\\\\server\\share\\a.png", "a.png", true),
            ("/home/somebody/a.png", "a.png", true),
            // Relative folders count.
            ("elsewhere/a.png", "elsewhere/a.png", false),
            ("maps\\none.png", "maps/none.png", false),
        ] {
            assert_eq!(locate(&folders, name), Located { path: root.path().join(path), by_file_name }, "{name}");
        }
        let own = root.path().join("a.png");
        assert_eq!(locate(&folders, &own.to_string_lossy()), Located { path: own, by_file_name: false });
        assert_eq!(locate(&folders, "C:\\none\\").path, root.path().join("C:/none/"));
    }
}
