//! Files of users: regular files up to a stated size, or standard input by the name `-`.
//!
//! A device or a pipe may never end, so that it is refused by its kind before it is opened. Every read has a limit, also
//! where the system states no size.

use std::fs::{self, File, FileType};
use std::io::{self, Read};
use std::path::Path;

use crate::Error;

/// The name of standard input.
const STANDARD_INPUT: &str = "-";
/// Largest standard input [bytes]: it is kept in memory and has no size beforehand.
const STREAM: u64 = 256 << 20;

/// Largest size of a kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// The kind of file, with its article.
    kind: &'static str,
    bytes: u64,
    remedy: &'static str,
}

/// Files that are written by hand: parameters, machines, studies.
pub const TEXT: Limit = Limit { kind: "a parameter file", bytes: 4 << 20, remedy: "Check that it is the right file." };
/// Results that a program wrote: reports, summaries, labels.
pub const RESULT: Limit = Limit { kind: "a result", bytes: 256 << 20, remedy: "Check that it is the right file." };
/// Recordings and friction curves.
pub const RECORDING: Limit =
    Limit { kind: "a recording", bytes: 4 << 30, remedy: "Split it, or leave out columns that are not used." };
/// Linked programs and FMUs.
pub const PROGRAM: Limit = Limit { kind: "a program", bytes: 1 << 30, remedy: "Check that it is the right file." };

impl Limit {
    /// Largest size [bytes].
    pub fn bytes(self) -> u64 {
        self.bytes
    }

    /// The error of contents that exceed the limit; their size is known or only more than the limit.
    pub fn exceeded(self, path: &Path, size: Option<u64>) -> Error {
        self.refusal(path, size, self.bytes)
    }

    fn refusal(self, path: &Path, size: Option<u64>, limit: u64) -> Error {
        let megabytes = |bytes: u64| format!("{:.1} MB", bytes as f64 / 1e6);
        let size = size.map_or_else(|| format!("more than {}", megabytes(limit)), megabytes);
        let reason = format!("{size}, which is too large for {}; the limit is {}", self.kind, megabytes(limit));
        Error::Document { path: path.into(), place: None, reason, remedy: self.remedy }
    }
}

/// The bytes of a regular file, or of standard input.
///
/// # Errors
/// [`Error::File`] from the system; [`Error::Document`] for a folder, device, socket or pipe, and above the limit.
pub fn read(path: &Path, limit: Limit) -> Result<Vec<u8>, Error> {
    if is_standard_input(path) {
        let most = limit.bytes.min(STREAM);
        let name = Path::new("standard input");
        return bounded(io::stdin().lock(), name, most)?.ok_or_else(|| limit.refusal(name, None, most));
    }
    bounded(open(path, limit)?, path, limit.bytes)?.ok_or_else(|| limit.exceeded(path, None))
}

/// The text of a regular file, or of standard input.
///
/// # Errors
/// As [`read`]; [`Error::File`] for contents that are not UTF-8.
pub fn text(path: &Path, limit: Limit) -> Result<String, Error> {
    let invalid = |_| io::Error::new(io::ErrorKind::InvalidData, "stream did not contain valid UTF-8");
    String::from_utf8(read(path, limit)?).map_err(|error| Error::file(path, "read", invalid(error)))
}

/// A regular file within its limit, opened for reading in parts.
///
/// # Errors
/// As [`read`].
pub fn open(path: &Path, limit: Limit) -> Result<File, Error> {
    let failed = |source| Error::file(path, "read", source);
    let metadata = fs::metadata(path).map_err(failed)?;
    // Before it is opened: opening a pipe waits for its writer.
    regular(path, metadata.file_type())?;
    if metadata.len() > limit.bytes {
        return Err(limit.exceeded(path, Some(metadata.len())));
    }
    let file = File::open(path).map_err(failed)?;
    // The name may have changed its file in the meantime.
    regular(path, file.metadata().map_err(failed)?.file_type())?;
    Ok(file)
}

/// Whether a path is the name of standard input.
pub fn is_standard_input(path: &Path) -> bool {
    path == Path::new(STANDARD_INPUT)
}

/// All bytes of a source, or `None` if there are more than `most`.
fn bounded(source: impl Read, path: &Path, most: u64) -> Result<Option<Vec<u8>>, Error> {
    let mut bytes = Vec::new();
    source.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(|error| Error::file(path, "read", error))?;
    Ok(Some(bytes).filter(|bytes| bytes.len() as u64 <= most))
}

/// Refuses everything but a regular file.
fn regular(path: &Path, kind: FileType) -> Result<(), Error> {
    if kind.is_file() {
        return Ok(());
    }
    let refused =
        |reason: &str, remedy| Err(Error::Document { path: path.into(), place: None, reason: reason.into(), remedy });
    if kind.is_dir() {
        return refused("it is a folder, not a file", "Give the path of a file in it.");
    }
    let reason = format!("it is {}, which may have no end", special(kind));
    refused(&reason, "Give a regular file, or pipe the data to the command and give `-` in place of the file.")
}

/// The kind of a special file.
#[cfg(unix)]
fn special(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt as _;
    if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

/// The kind of a special file.
#[cfg(not(unix))]
fn special(_: FileType) -> &'static str {
    "a special file"
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: Limit = Limit { kind: "a test", bytes: 10, remedy: "Shorten it." };

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "0123456789").unwrap();
        assert_eq!(text(&path, SMALL).unwrap(), "0123456789");
        fs::write(&path, "0123456789A").unwrap();
        let message = read(&path, SMALL).unwrap_err().to_string();
        assert!(message.ends_with("a.txt: 0.0 MB, which is too large for a test; the limit is 0.0 MB. Shorten it."));
        fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
        assert!(text(&path, SMALL).unwrap_err().to_string().contains("not UTF-8"), "invalid text");
    }

    #[test]
    fn a_stream_without_end_is_read_up_to_its_limit() {
        let name = Path::new("standard input");
        assert_eq!(bounded(io::repeat(b'y'), name, 1 << 20).unwrap(), None);
        assert_eq!(bounded(&b"1,2"[..], name, 3).unwrap().unwrap(), b"1,2");
    }

    #[test]
    fn folders_devices_pipes_and_sockets_are_refused_by_kind_before_they_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let message = |path: &Path| read(path, TEXT).unwrap_err().to_string();
        assert!(message(folder.path()).contains("it is a folder, not a file. Give the path of a file in it."));
        #[cfg(target_os = "linux")]
        {
            assert!(message(Path::new("/dev/zero")).contains("/dev/zero: it is a device"));
            let pipe = folder.path().join("pipe");
            // Opening it for reading would wait for a writer.
            assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
            assert!(message(&pipe).contains("it is a pipe, which may have no end. Give a regular file, or pipe"));
            let socket = folder.path().join("socket");
            let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
            assert!(message(&socket).contains("it is a socket"));
        }
        assert!(matches!(read(&folder.path().join("none"), TEXT), Err(Error::File { .. })));
    }
}
