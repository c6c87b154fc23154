//! Files that are written completely or not at all.
//!
//! A result is written next to its target, forced to the disk and renamed: the target is the old file or the new one,
//! never a part of it, also after a failure or a loss of power.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::Error;

/// Creates the folder `directory` and its parents if they do not exist.
///
/// # Errors
/// [`Error::File`] with the folder that cannot be created.
pub fn create_folder(directory: &Path) -> Result<(), Error> {
    fs::create_dir_all(directory).map_err(|source| Error::file(directory, "create", source))
}

/// Replaces the file at `path` by `contents`, completely or not at all.
///
/// # Errors
/// [`Error::File`]; the old file, if there was one, is unchanged.
pub fn write(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Error> {
    write_with(path, |file| file.write_all(contents.as_ref()))
}

/// Replaces the file at `path` by the output of `fill`, completely or not at all.
///
/// A device or pipe must not be replaced by a file: it is written directly.
///
/// # Errors
/// [`Error::File`] with the error of `fill` or of the system; the old file, if there was one, is unchanged.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>) -> Result<(), Error> {
    // A link stays a link: its target is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let old = fs::metadata(&target).ok();
    let result = match &old {
        Some(old) if !old.is_file() && !old.is_dir() => {
            OpenOptions::new().write(true).open(&target).and_then(|file| fill_and_flush(file, fill).map(drop))
        }
        _ => replace(&target, old.map(|old| old.permissions()), fill),
    };
    result.map_err(|source| Error::file(path, "write", source))
}

fn replace(
    target: &Path,
    permissions: Option<fs::Permissions>,
    fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
) -> io::Result<()> {
    let (file, temporary) = create_temporary(target)?;
    let result = fill_and_flush(file, fill).and_then(|file| {
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        file.sync_all()?;
        drop(file); // Windows renames no open file.
        fs::rename(&temporary, target)
    });
    if result.is_err() {
        // The first error is reported; a remaining file is hidden and harmless.
        let _ = fs::remove_file(&temporary);
    }
    result
}

fn fill_and_flush(file: File, fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>) -> io::Result<File> {
    let mut buffered = BufWriter::new(file);
    fill(&mut buffered)?;
    buffered.into_inner().map_err(io::IntoInnerError::into_error)
}

/// A new file in the target's folder (a rename works only within one file system), with its path.
fn create_temporary(target: &Path) -> io::Result<(File, PathBuf)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let name = target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "no file name"))?;
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let temporary = target.with_file_name(format!(".{}.{}-{count}.part", name.to_string_lossy(), process::id()));
        match File::create_new(&temporary) {
            // A crashed process with the same number has left one: use the next name.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            result => return Ok((result?, temporary)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_is_written_whole_and_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/er/summary.json");
        create_folder(path.parent().unwrap()).unwrap();
        write(&path, "old").unwrap();
        write(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(names(path.parent().unwrap()), ["summary.json"]);
    }

    #[test]
    fn a_failure_halfway_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.csv");
        write(&path, "old").unwrap();
        let error = write_with(&path, |file| {
            file.write_all(&[b'x'; 100_000])?;
            Err(io::Error::other("the sensor caught fire"))
        });
        let message = error.unwrap_err().to_string();
        assert!(message.contains("result.csv") && message.contains("caught fire"), "{message}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["result.csv"]);
    }

    #[test]
    fn a_folder_below_a_file_is_refused_with_its_path() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("taken");
        write(&file, "").unwrap();
        let message = create_folder(&file.join("out")).unwrap_err().to_string();
        assert!(message.contains("taken") && message.contains("cannot create"), "{message}");
        let message = write(&file.join("summary.json"), "").unwrap_err().to_string();
        assert!(message.contains("cannot write"), "{message}");
    }

    #[test]
    fn a_folder_in_the_place_of_the_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("summary.json");
        create_folder(&path.join("inner")).unwrap();
        assert!(write(&path, "x").is_err());
        assert_eq!(names(folder.path()), ["summary.json"]);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("real"), folder.path().join("link"));
        write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        symlink(&path, &link).unwrap();
        write(&link, "new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_is_an_error_and_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("summary.json");
        std::os::unix::fs::symlink("/dev/full", &link).unwrap();
        let error = write(&link, "x").unwrap_err();
        assert!(matches!(&error, Error::File { source, .. } if source.kind() == io::ErrorKind::StorageFull), "{error}");
        assert!(error.to_string().contains("make room"), "{error}");
        assert!(!fs::metadata("/dev/full").unwrap().is_file());
    }
}
