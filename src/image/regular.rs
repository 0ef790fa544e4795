//! Input files: regular files of bounded length. Devices, pipes and sockets may block or never end, and are refused
//! before they are opened.

use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;

/// Longest text (a scene, a material library, a table of numbers) that is read, in bytes.
pub const MAX_TEXT_BYTES: u64 = 1 << 30;

/// Opens a regular file for reading and returns it with its length in bytes.
///
/// # Errors
/// If the file cannot be opened, or is a folder, a device, a pipe, a socket or a pointer of Git LFS.
pub fn open_regular(path: &Path) -> io::Result<(File, u64)> {
    // Opening a pipe would wait for a writer, hence the check by name first.
    check_regular(&std::fs::metadata(path)?)?;
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    check_regular(&metadata)?;
    check_fetched(&mut file)?;
    Ok((file, metadata.len()))
}

/// First bytes of a file that stands for a large one in a git repository.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Refuses a file whose content has not been fetched; leaves the others at their beginning.
fn check_fetched(file: &mut File) -> io::Result<()> {
    let mut start = Vec::with_capacity(LFS_POINTER.len());
    file.by_ref().take(LFS_POINTER.len() as u64).read_to_end(&mut start)?;
    if start == LFS_POINTER {
        let message = "is a pointer of Git LFS, not the file itself: `git lfs pull` fetches it";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    file.rewind()
}

/// Reads a regular file of at most `max_bytes` bytes.
///
/// # Errors
/// If the file cannot be read, is not a regular file or is longer.
pub fn read_regular(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let (file, length) = open_regular(path)?;
    let too_long = || io::Error::new(io::ErrorKind::InvalidInput, format!("longer than {max_bytes} bytes"));
    if length > max_bytes {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    // Files of /proc have the length zero and may be endless.
    file.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes { Err(too_long()) } else { Ok(bytes) }
}

/// Reads a text of at most [`MAX_TEXT_BYTES`] bytes in UTF-8.
///
/// # Errors
/// As [`read_regular`], and if the file is not UTF-8.
pub fn read_regular_text(path: &Path) -> io::Result<String> {
    let bytes = read_regular(path, MAX_TEXT_BYTES)?;
    String::from_utf8(bytes).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))
}

fn check_regular(metadata: &std::fs::Metadata) -> io::Result<()> {
    let refused = |what: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    match metadata {
        m if m.is_file() => Ok(()),
        m if m.is_dir() => refused("is a folder, not a file"),
        _ => refused("is not a regular file (a device, a pipe or a socket)"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_folders_and_long_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        for (path, reason) in [(Path::new("/dev/zero"), "device"), (folder.path(), "folder")] {
            let error = read_regular(path, 1000).unwrap_err();
            assert!(error.to_string().contains(reason), "{error}");
        }
        let path = folder.path().join("a");
        std::fs::write(&path, [7; 10]).unwrap();
        assert_eq!(read_regular(&path, 10).unwrap(), [7; 10]);
        assert!(read_regular(&path, 9).unwrap_err().to_string().contains("longer than 9 bytes"));
        assert_eq!(open_regular(&path).unwrap().1, 10);
    }

    #[test]
    fn pointers_of_large_files_are_named_as_such() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n").unwrap();
        let messages = [read_regular(&path, 1000).unwrap_err(), open_regular(&path).unwrap_err()];
        assert!(messages.iter().all(|e| e.to_string().contains("git lfs pull")), "{messages:?}");
    }
}
