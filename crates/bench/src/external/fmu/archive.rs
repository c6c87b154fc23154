//! The archive of an FMU. It is untrusted: only the required files are unpacked, up to a size limit.

use std::fs::{self, File};
use std::io::{self, BufReader, Read as _};
use std::path::{Component, Path, PathBuf};

use stickslip_base::input;
use tempfile::TempDir;
use zip::ZipArchive;
use zip::result::ZipError;

/// The model description.
const DESCRIPTION: &str = "modelDescription.xml";

/// Size limits of an FMU.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Archive file [bytes].
    pub(super) archive: u64,
    /// Number of files.
    pub(super) files: usize,
    /// Unpacked files [bytes].
    pub(super) unpacked: u64,
    /// Model description [bytes].
    pub(super) description: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { archive: 1 << 30, files: 20_000, unpacked: 1 << 30, description: 32 << 20 }
    }
}

/// An open archive.
pub(super) struct Archive {
    zip: ZipArchive<BufReader<File>>,
    limits: Limits,
    /// Names of the files in order, with `/` between folders.
    names: Vec<String>,
}

impl Archive {
    /// Opens the archive and checks the names of its files.
    pub(super) fn open(path: &Path, limits: Limits) -> Result<Self, String> {
        let broken = |error: ZipError| format!("not an FMU: invalid zip archive ({error})");
        let file = input::open(path, input::PROGRAM).map_err(|error| error.to_string())?;
        let size = file.metadata().map_or(0, |about| about.len());
        if size > limits.archive {
            return Err(format!("it has {size} bytes; the maximum is {}", limits.archive));
        }
        let zip = ZipArchive::new(BufReader::new(file)).map_err(broken)?;
        if zip.len() > limits.files {
            return Err(format!("it has {} files; the maximum is {}", zip.len(), limits.files));
        }
        let names: Result<Vec<String>, _> =
            zip.file_names().map(|name| name.map(|name| name.replace('\\', "/"))).collect();
        let names = names.map_err(broken)?;
        if let Some(name) = names.iter().find(|name| inside(name).is_none()) {
            return Err(format!("its file {name:?} would be written outside the target folder. Do not trust it"));
        }
        Ok(Archive { zip, limits, names })
    }

    /// Names of its files.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// The model description.
    pub(super) fn description(&mut self) -> Result<String, String> {
        let most = self.limits.description;
        let Ok(entry) = self.zip.by_name(DESCRIPTION) else {
            return Err(format!("not an FMU: its archive has no {DESCRIPTION} that can be unpacked"));
        };
        let mut text = Vec::new();
        let read = entry.take(most + 1).read_to_end(&mut text);
        read.map_err(|error| format!("its {DESCRIPTION} cannot be unpacked ({error})"))?;
        if text.len() as u64 > most {
            return Err(format!("its {DESCRIPTION} is longer than {most} bytes"));
        }
        String::from_utf8(text).map_err(|_| format!("its {DESCRIPTION} is not UTF-8, which the standard requires"))
    }

    /// Unpacks the files with these prefixes into a temporary folder.
    pub(super) fn unpack(&mut self, prefixes: &[String]) -> Result<TempDir, String> {
        let refused = |error: io::Error| format!("it cannot be unpacked ({error})");
        let folder = tempfile::tempdir().map_err(refused)?;
        let mut rest = self.limits.unpacked;
        for index in 0..self.zip.len() {
            let name = &self.names[index];
            if name != DESCRIPTION && !prefixes.iter().any(|folder| name.starts_with(folder)) {
                continue;
            }
            let Some(inside) = inside(name) else { continue };
            let path = folder.path().join(inside);
            let mut entry =
                self.zip.by_index(index).map_err(|error| format!("its file {name} cannot be unpacked ({error})"))?;
            if entry.is_symlink() {
                return Err(format!("its file {name} is a link. Do not trust it"));
            }
            if entry.is_dir() || name.ends_with('/') {
                fs::create_dir_all(&path).map_err(refused)?;
                continue;
            }
            fs::create_dir_all(path.parent().unwrap_or(folder.path())).map_err(refused)?;
            let executable = entry.unix_mode().is_some_and(|mode| mode & 0o100 != 0);
            let mut file = File::create(&path).map_err(refused)?;
            let copied = io::copy(&mut (&mut entry).take(rest.saturating_add(1)), &mut file)
                .map_err(|error| format!("its file {name} cannot be unpacked ({error})"))?;
            rest = rest
                .checked_sub(copied)
                .ok_or_else(|| format!("unpacked it is larger than {} bytes. Do not trust it", self.limits.unpacked))?;
            if executable {
                allow(&file).map_err(refused)?;
            }
        }
        Ok(folder)
    }
}

/// Makes a file executable.
#[cfg(unix)]
fn allow(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    file.set_permissions(fs::Permissions::from_mode(0o700))
}

#[cfg(not(unix))]
fn allow(_: &File) -> io::Result<()> {
    Ok(())
}

/// The path of a name, if it stays inside the folder.
fn inside(name: &str) -> Option<PathBuf> {
    let path = Path::new(name);
    let stays = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    (stays && !name.is_empty() && !name.contains([':', '\0'])).then(|| path.into())
}

/// Whether a file is an FMU, by its first bytes or by its extension.
pub(in crate::external) fn is_fmu(path: &Path) -> bool {
    let mut begin = [0; 4];
    let archive = path.is_file()
        && File::open(path).and_then(|mut file| file.read_exact(&mut begin)).is_ok()
        && (begin == *b"PK\x03\x04" || begin == *b"PK\x05\x06");
    archive || path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("fmu"))
}
