//! The file of an external controller, friction or law, which can be reopened after a change.

use crate::BenchError;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::fmu::is_fmu;
use super::{External, Role, hash};
use stickslip_base::{Error, input};

/// File of an external controller, friction or law, with its options.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExternalFile {
    /// A shared library with the functions of `stickslip_module.h`, an FMU, or a function in Python.
    pub path: PathBuf,
    /// Role in the loop.
    pub role: Role,
    /// Explicit mapping of signals to variables of an FMU: signal, variable.
    pub map: Vec<(String, String)>,
    /// Whether it runs in this process.
    pub trust: bool,
    /// Values of its parameters, by their names.
    pub values: Vec<(String, f64)>,
}

impl ExternalFile {
    /// Opens the file in a separate process, or in this process if it is trusted. A function in Python is first
    /// compiled to a library in the folder; `progress` receives the duration of each step, line by line. The variable
    /// `PYTHON` selects the Python interpreter with the package.
    ///
    /// # Errors
    /// As [`External::trusted`], [`External::set`]; [`BenchError::External`] for a function that cannot be recorded,
    /// with its line.
    pub fn open(&self, folder: &Path, progress: &mut dyn FnMut(&str)) -> Result<External, Error> {
        let mut external = self.open_library(&self.made(folder, progress)?.path)?;
        self.values.iter().try_for_each(|(name, value)| external.set(name, *value))?;
        Ok(external)
    }

    /// The same file compiled to a library, if it is a function in Python.
    ///
    /// # Errors
    /// As [`ExternalFile::open`], for a function in Python.
    pub fn made(&self, folder: &Path, progress: &mut dyn FnMut(&str)) -> Result<Self, Error> {
        Ok(ExternalFile { path: library(&self.path, folder, progress)?, ..self.clone() })
    }

    /// SHA-256 of the file, in hexadecimal digits.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn hash(&self) -> Result<String, Error> {
        hash(&self.path)
    }

    /// Reopens a changed file while the previous version is still open, with the present values.
    ///
    /// A trusted library is opened as a copy named by its hash, since the system would return the loaded library for
    /// the same name.
    ///
    /// # Errors
    /// As [`ExternalFile::open`]; [`Error::File`] if the copy cannot be written.
    pub fn open_again(&self, folder: &Path, progress: &mut dyn FnMut(&str)) -> Result<External, Error> {
        let library = library(&self.path, folder, progress)?;
        if !self.trust || is_fmu(&library) {
            return self.open_library(&library);
        }
        stickslip_base::output::create_folder(folder)?;
        let copy = folder.join(format!("{}{}", hash(&library)?, std::env::consts::DLL_SUFFIX));
        fs::copy(&library, &copy).map_err(|source| Error::file(&copy, "copy to", source))?;
        let opened = self.open_library(&copy);
        // The open library remains valid without its file.
        let _ = fs::remove_file(&copy);
        opened
    }

    fn open_library(&self, library: &Path) -> Result<External, Error> {
        if self.trust {
            External::trusted_as(library, self.role, &self.map)
        } else {
            in_own_process(library, self.role, &self.map)
        }
    }
}

/// The library of a file; a function in Python is compiled.
fn library(file: &Path, folder: &Path, progress: &mut dyn FnMut(&str)) -> Result<PathBuf, Error> {
    if file.exists() {
        // A folder, device or pipe is refused by its kind, before a program waits for its end.
        input::open(file, input::PROGRAM)?;
    }
    if file.extension().is_none_or(|ending| ending != "py") {
        return Ok(file.into());
    }
    stickslip_base::output::create_folder(folder)?;
    let refused = |problem| BenchError::External { path: file.into(), problem };
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let compiled = folder.join("controller.so");
    let mut command = Command::new(&python);
    let command = command.args(["-m", "stickslip.target"]).arg(file).arg("--out").arg(&compiled);
    let result = command
        .output()
        .map_err(|error| refused(format!("{python} cannot be started ({error}). Install Python, or set PYTHON=…")))?;
    let [output, errors] = [&result.stdout, &result.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    if !result.status.success() {
        let reason = errors.lines().last().unwrap_or("no error message").trim().trim_end_matches('.');
        let remedy = if reason.contains("No module named") { ". Install the package: pip install ." } else { "" };
        return Err(refused(format!("{reason}{remedy}")).into());
    }
    // The last line describes the next step, which is done here.
    output.lines().take_while(|line| !line.starts_with("To run it")).for_each(progress);
    Ok(compiled)
}

#[cfg(unix)]
fn in_own_process(file: &Path, role: Role, map: &[(String, String)]) -> Result<External, Error> {
    use super::process::HostProcess;
    External::in_own_process(file, role, &HostProcess::find().mapping(map))
}

#[cfg(not(unix))]
fn in_own_process(file: &Path, _: Role, _: &[(String, String)]) -> Result<External, Error> {
    let problem = "a separate process is not supported on this system. Run it in this process: --trust".into();
    Err(BenchError::External { path: file.into(), problem }.into())
}
