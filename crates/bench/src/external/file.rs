//! The file of somebody's own, which may be opened again when it has become another.

use crate::BenchError;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::fmu::is_fmu;
use super::{External, Role, hash};
use stickslip_base::Error;

/// A controller, friction or law of one's own as a file, and how it is opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExternalFile {
    /// A shared library with the functions of `stickslip_module.h`, an FMU, or a function in Python.
    pub path: PathBuf,
    /// What it is in the loop.
    pub role: Role,
    /// Variables of an FMU that are other signals than their names say: signal, variable.
    pub map: Vec<(String, String)>,
    /// Whether it runs in this process.
    pub trust: bool,
    /// Values of its parameters, by their names.
    pub values: Vec<(String, f64)>,
}

impl ExternalFile {
    /// Opens it: in a process of its own unless it is trusted. A function in Python becomes a library in the folder
    /// first; how long each step of that took is `told`, line by line. The variable `PYTHON` says which Python has the
    /// package.
    ///
    /// # Errors
    /// As [`External::trusted`], [`External::set`]; [`BenchError::External`] for a function that cannot be recorded, by its line.
    pub fn open(&self, folder: &Path, told: &mut dyn FnMut(&str)) -> Result<External, Error> {
        let mut external = self.opened(&self.made(folder, told)?.path)?;
        self.values.iter().try_for_each(|(name, value)| external.set(name, *value))?;
        Ok(external)
    }

    /// The same as a library or an FMU, as it is opened.
    ///
    /// # Errors
    /// As [`ExternalFile::open`], for a function in Python.
    pub fn made(&self, folder: &Path, told: &mut dyn FnMut(&str)) -> Result<Self, Error> {
        Ok(ExternalFile { path: library(&self.path, folder, told)?, ..self.clone() })
    }

    /// SHA-256 of it, in hexadecimal digits.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn hash(&self) -> Result<String, Error> {
        hash(&self.path)
    }

    /// Opens a file that may have become another, while it is still open as it was, with the values that it has now.
    ///
    /// A trusted library is a copy that is called by what is in it: the system takes one name for the library that it
    /// knows.
    ///
    /// # Errors
    /// As [`ExternalFile::open`]; [`Error::File`] where the folder does not take the copy.
    pub fn open_again(&self, folder: &Path, told: &mut dyn FnMut(&str)) -> Result<External, Error> {
        let library = library(&self.path, folder, told)?;
        if !self.trust || is_fmu(&library) {
            return self.opened(&library);
        }
        stickslip_base::output::create_folder(folder)?;
        let copy = folder.join(format!("{}{}", hash(&library)?, std::env::consts::DLL_SUFFIX));
        fs::copy(&library, &copy).map_err(|source| Error::file(&copy, "copy to", source))?;
        let opened = self.opened(&copy);
        // What is open stays, and nobody needs its name.
        let _ = fs::remove_file(&copy);
        opened
    }

    fn opened(&self, library: &Path) -> Result<External, Error> {
        if self.trust {
            External::trusted_as(library, self.role, &self.map)
        } else {
            in_own_process(library, self.role, &self.map)
        }
    }
}

/// The library of a file: of a function in Python one that is made of it.
fn library(file: &Path, folder: &Path, told: &mut dyn FnMut(&str)) -> Result<PathBuf, Error> {
    if file.extension().is_none_or(|ending| ending != "py") {
        return Ok(file.into());
    }
    stickslip_base::output::create_folder(folder)?;
    let refused = |problem| BenchError::External { path: file.into(), problem };
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let made = folder.join("controller.so");
    let mut command = Command::new(&python);
    let command = command.args(["-m", "stickslip.target"]).arg(file).arg("--out").arg(&made);
    let output = command
        .output()
        .map_err(|error| refused(format!("{python} cannot be started ({error}). Install Python, or say PYTHON=…")))?;
    let [said, wrong] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    if !output.status.success() {
        let reason = wrong.lines().last().unwrap_or("it says nothing").trim().trim_end_matches('.');
        let remedy = if reason.contains("No module named") { ". Install the package: pip install ." } else { "" };
        return Err(refused(format!("{reason}{remedy}")).into());
    }
    // The last line says how to do what is done next.
    said.lines().take_while(|line| !line.starts_with("To run it")).for_each(told);
    Ok(made)
}

#[cfg(unix)]
fn in_own_process(file: &Path, role: Role, map: &[(String, String)]) -> Result<External, Error> {
    use super::process::Host;
    External::in_own_process(file, role, &Host::find().mapping(map))
}

#[cfg(not(unix))]
fn in_own_process(file: &Path, _: Role, _: &[(String, String)]) -> Result<External, Error> {
    let problem = "on this system it runs in this process alone. Say that it is trusted: --trust".into();
    Err(BenchError::External { path: file.into(), problem }.into())
}
