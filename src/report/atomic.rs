//! Files that appear whole or not at all.

use crate::diagnostic::Diagnostic;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// Writes a file so that no reader ever sees half of it: a temporary file in the same folder, forced to the disk, then
/// renamed over the target. On failure the target is as before and nothing is left behind.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
    Staged::try_new(path, bytes)?.put()
}

/// A file whose bytes are on the disk under a name of their own. Dropped, it leaves nothing behind.
#[derive(Debug)]
pub struct Staged<'a> {
    path: &'a Path,
    file: NamedTempFile,
}

impl<'a> Staged<'a> {
    /// Writes the bytes beside the target. What runs out - room on the disk, a limit on sizes - shows here.
    pub fn try_new(path: &'a Path, bytes: &[u8]) -> Result<Self, Diagnostic> {
        let file = stage(path, bytes).map_err(|error| in_words(path, &error))?;
        Ok(Self { path, file })
    }

    /// The same of what `print` writes, for what need not stand in memory as a whole. What that fails with is told like a disk's fault.
    ///
    /// # Errors
    /// Those of [`write()`].
    pub fn try_with(
        path: &'a Path,
        print: impl FnOnce(&mut BufWriter<&mut std::fs::File>) -> io::Result<()>,
    ) -> Result<Self, Diagnostic> {
        let file = stage_with(path, |file| {
            let mut out = BufWriter::with_capacity(1 << 20, file);
            print(&mut out)?;
            out.flush()
        });
        Ok(Self { path, file: file.map_err(|error| in_words(path, &error))? })
    }

    /// Puts the file in its place.
    pub fn put(self) -> Result<(), Diagnostic> {
        let put = self.file.persist(self.path).map(drop).map_err(|error| error.error);
        put.and_then(|()| sync_folder(self.path)).map_err(|error| in_words(self.path, &error))
    }
}

/// Tries whether files can be written into a folder; what is written for that is gone again.
///
/// # Errors
/// Why not, in words.
pub fn try_folder(folder: &Path) -> Result<(), String> {
    let file = tempfile::Builder::new().prefix(PREFIX).suffix(SUFFIX).tempfile_in(folder);
    file.map(drop).map_err(|error| match error.kind() {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "it is read-only".to_owned(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "the disk is full".to_owned(),
        _ => error.to_string(),
    })
}

const PREFIX: &str = ".shapeline-";
const SUFFIX: &str = ".part";

/// Whether a file of this name is what a killed process left of a write.
pub fn is_leftover(name: &str) -> bool {
    name.starts_with(PREFIX) && name.ends_with(SUFFIX)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn stage(path: &Path, bytes: &[u8]) -> io::Result<NamedTempFile> {
    stage_with(path, |file| file.write_all(bytes))
}

fn stage_with(path: &Path, print: impl FnOnce(&mut std::fs::File) -> io::Result<()>) -> io::Result<NamedTempFile> {
    if path.is_dir() {
        return Err(io::Error::from(ErrorKind::IsADirectory));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        // A temporary file is private by default; a report is as readable as any file the user makes.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder_of(path))?;
    print(file.as_file_mut())?;
    file.as_file().sync_all()?;
    Ok(file)
}

/// Makes the new name last through a power cut, where a folder can be forced to the disk.
fn sync_folder(path: &Path) -> io::Result<()> {
    if cfg!(unix) { std::fs::File::open(folder_of(path))?.sync_all() } else { Ok(()) }
}

/// Why a file could not be written, with what to do.
fn in_words(path: &Path, error: &io::Error) -> Diagnostic {
    let (message, help) = match error.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => {
            ("cannot write, the folder does not exist".to_owned(), "make the folder, or give another one with --out")
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => (
            "cannot write, the folder or the file is read-only".to_owned(),
            "allow writing there, or give another folder with --out",
        ),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            ("cannot write, the disk is full".to_owned(), "make room, or give another folder with --out")
        }
        ErrorKind::FileTooLarge => (
            "cannot write, the file would be larger than this account or file system allows".to_owned(),
            "raise the limit (`ulimit -f`), ask for fewer formats, or give another folder with --out",
        ),
        ErrorKind::IsADirectory => {
            ("cannot write, a folder has this name".to_owned(), "rename the folder, or give another one with --out")
        }
        ErrorKind::InvalidFilename => ("cannot write, the name is too long".to_owned(), "give the scan a shorter name"),
        _ => (format!("cannot write: {error}"), "look whether the folder can be reached, then run again"),
    };
    Diagnostic::error(message).in_file(path).with_help(help)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn replaces_the_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("0007.json");
        write(&path, b"first, and longer").unwrap();
        write(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn failure_says_why_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let missing = write(&folder.path().join("no/0007.json"), b"x").unwrap_err();
        assert!(missing.message.contains("folder does not exist"), "{missing}");

        // A folder stands where the file should go: the rename cannot succeed.
        let taken = folder.path().join("0008.json");
        fs::create_dir(&taken).unwrap();
        let refused = write(&taken, b"x").unwrap_err();
        assert!(refused.message.contains("a folder has this name"), "{refused}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(refused.help.is_some());

        let long = write(&folder.path().join("n".repeat(300)), b"x").unwrap_err();
        assert!(long.message.contains("too long"), "{long}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn full_and_read_only_have_their_own_words() {
        let words = |kind: ErrorKind| in_words(Path::new("x"), &io::Error::from(kind)).message;
        assert!(words(ErrorKind::StorageFull).contains("disk is full"));
        assert!(words(ErrorKind::PermissionDenied).contains("read-only"));
    }
}
