//! The library of an FMU for co-simulation, FMI 2.0 and 3.0, <https://fmi-standard.org>: one instance at a time, called
//! by its owner only.
//!
//! As with a [`Module`](crate::Module), the library is unchecked code inside the process that opens it. Its description
//! is read elsewhere; this module handles value references and numbers.

#![expect(unsafe_code, reason = "functions of a library are called by address and return pointers")]

mod functions;
mod log;

use std::ffi::{CString, c_int};
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::Arc;

use functions::{Callbacks, Functions, Identity, Instance, Three, Two};
use libloading::Library;
use log::Log;

/// `fmi2Warning` and `fmi3Warning`: a step was taken.
const WARNING: c_int = 1;
/// `fmi2Discard` and `fmi3Discard`: a step was not taken.
const DISCARD: c_int = 2;
/// `fmi2Fatal` and `fmi3Fatal`: no function may be called any more.
const FATAL: c_int = 4;

/// A version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FmiVersion {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

/// Library, token and folders of an FMU.
#[derive(Clone, Debug)]
pub struct FmuLibrary {
    /// Version of its functions.
    pub version: FmiVersion,
    /// The library.
    pub library: PathBuf,
    /// Its GUID, or instantiation token.
    pub token: String,
    /// The folder of its resources.
    pub resources: PathBuf,
    /// File for a copy of its message, which outlives a crash.
    pub messages: Option<PathBuf>,
}

/// Error of the library of an FMU.
#[derive(Debug, thiserror::Error)]
pub enum FmuError {
    /// The system cannot open it.
    #[error("its library cannot be opened ({0})")]
    Open(String),
    /// A function is missing.
    #[error("its library has no function {0}, which the standard requires")]
    Function(&'static str),
    /// Token or path contain the character 0.
    #[error("its token or its folder contains the character 0")]
    Text,
}

/// Phase of an instance.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Instantiated,
    Stepping,
    /// Failed: it can only be freed. Fatal: not even that.
    Failed,
    Fatal,
}

/// An open library with at most one instance.
pub struct Fmu {
    functions: Functions,
    token: CString,
    resources: Option<CString>,
    log: Arc<Log>,
    callbacks: Arc<Callbacks>,
    instance: Instance,
    phase: Phase,
    /// Kept open while its functions can be called.
    _library: Library,
}

// SAFETY: the standard permits any thread, one at a time; only the owner of the FMU calls it. Its log accepts messages
// from any thread.
unsafe impl Send for Fmu {}

impl Fmu {
    /// Opens the library; there is no instance yet.
    ///
    /// # Errors
    /// [`FmuError`].
    pub fn open(files: &FmuLibrary) -> Result<Self, FmuError> {
        let text = |text: String| CString::new(text).map_err(|_| FmuError::Text);
        // SAFETY: opening runs code of the library, which the documentation states.
        let library = unsafe { Library::new(&files.library) }.map_err(|error| FmuError::Open(error.to_string()))?;
        // SAFETY: functions with these names have the types of the standard.
        let functions = unsafe {
            match files.version {
                FmiVersion::Two => Functions::Two(Two::of(&library)?),
                FmiVersion::Three => Functions::Three(Three::of(&library)?),
            }
        };
        let resources = match files.version {
            FmiVersion::Two => Some(text(uri(&files.resources))?),
            // A path with a final separator; null without a folder.
            FmiVersion::Three if !files.resources.is_dir() => None,
            FmiVersion::Three => Some(text(format!("{}{}", files.resources.display(), std::path::MAIN_SEPARATOR))?),
        };
        let log = Arc::new(Log::new(files.messages.as_deref()));
        let callbacks = Arc::new(Callbacks {
            logger: log::stickslip_fmu_log,
            allocate_memory: log::calloc,
            free_memory: log::free,
            step_finished: null(),
            environment: Arc::as_ptr(&log).cast(),
        });
        let token = text(files.token.clone())?;
        let (instance, phase) = (null_mut(), Phase::Instantiated);
        Ok(Fmu { functions, token, resources, log, callbacks, instance, phase, _library: library })
    }

    /// Ends the present instance and creates a new one. Returns whether the library did.
    pub fn instantiate(&mut self) -> bool {
        self.end();
        self.log.clear();
        let identity = Identity {
            token: self.token.as_ptr(),
            resources: self.resources.as_ref().map_or(null(), |path| path.as_ptr()),
            callbacks: Arc::as_ptr(&self.callbacks),
            log: &self.log,
        };
        // SAFETY: token, path, callbacks and log live as long as this does, which ends the instance before.
        self.instance = unsafe { self.functions.instantiate(&identity) };
        self.phase = Phase::Instantiated;
        !self.instance.is_null()
    }

    /// Starts the initialization of the new instance at time 0, with these values of its parameters.
    ///
    /// # Errors
    /// The status, if worse than a warning; -1 without an instance.
    pub fn initialize(&mut self, references: &[u32], values: &[f64]) -> Result<(), i32> {
        self.set(references, values)?;
        if let Functions::Two(Two { setup, .. }) = self.functions {
            // SAFETY: a live instance, checked by `set`.
            let status = unsafe { setup(self.instance, 0, 0.0, 0.0, 0, 0.0) };
            self.check(status)?;
        }
        // SAFETY: as before.
        let status = unsafe { self.functions.enter(self.instance) };
        self.check(status)
    }

    /// Ends the initialization; steps follow.
    ///
    /// # Errors
    /// As [`Fmu::initialize`].
    pub fn start(&mut self) -> Result<(), i32> {
        self.live()?;
        let (Functions::Two(Two { exit, .. }) | Functions::Three(Three { exit, .. })) = self.functions;
        // SAFETY: a live instance.
        let status = unsafe { exit(self.instance) };
        self.check(status)?;
        self.phase = Phase::Stepping;
        Ok(())
    }

    /// Sets numbers by their value references.
    ///
    /// # Errors
    /// As [`Fmu::initialize`].
    pub fn set(&mut self, references: &[u32], values: &[f64]) -> Result<(), i32> {
        assert_eq!(references.len(), values.len(), "a value for each reference");
        self.live()?;
        if references.is_empty() {
            return Ok(());
        }
        // SAFETY: a live instance.
        let status = unsafe { self.functions.set(self.instance, references, values) };
        self.check(status)
    }

    /// Reads numbers by their value references.
    ///
    /// # Errors
    /// As [`Fmu::initialize`].
    pub fn get(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), i32> {
        assert_eq!(references.len(), values.len(), "a value for each reference");
        self.live()?;
        // SAFETY: a live instance.
        let status = unsafe { self.functions.get(self.instance, references, values) };
        self.check(status)
    }

    /// One step from time `point` [s] of this length [s].
    ///
    /// # Errors
    /// As [`Fmu::initialize`]; a step that it ends early, or after which it requests the end, counts as discarded.
    pub fn step(&mut self, point: f64, length: f64) -> Result<(), i32> {
        self.live()?;
        let (mut event, mut terminate, mut early, mut reached) = (0u8, 0u8, 0u8, point);
        // SAFETY: a live instance; it writes to local variables.
        let status = unsafe {
            match &self.functions {
                Functions::Two(two) => (two.step)(self.instance, point, length, 1),
                Functions::Three(three) => (three.step)(
                    self.instance,
                    point,
                    length,
                    true,
                    &mut event,
                    &mut terminate,
                    &mut early,
                    &mut reached,
                ),
            }
        };
        self.check(status)?;
        if terminate != 0 || early != 0 {
            // Its own message has a higher severity.
            self.log.add(WARNING, "The FMU requests the end of the simulation or ends a step early.");
            return Err(DISCARD);
        }
        Ok(())
    }

    /// The last of the most severe messages of its instance, and the number of messages.
    pub fn message(&self) -> Option<(String, u64)> {
        self.log.message()
    }

    fn live(&self) -> Result<(), i32> {
        let dead = self.instance.is_null() || matches!(self.phase, Phase::Failed | Phase::Fatal);
        if dead { Err(-1) } else { Ok(()) }
    }

    /// Sets the phase from a status; an error if the call failed.
    fn check(&mut self, status: c_int) -> Result<(), i32> {
        match status {
            0 | WARNING => return Ok(()),
            DISCARD => {}
            FATAL => self.phase = Phase::Fatal,
            _ => self.phase = Phase::Failed,
        }
        Err(status)
    }

    fn end(&mut self) {
        let instance = std::mem::replace(&mut self.instance, null_mut());
        if instance.is_null() || self.phase == Phase::Fatal {
            return;
        }
        let (Functions::Two(Two { terminate, free, .. }) | Functions::Three(Three { terminate, free, .. })) =
            self.functions;
        // SAFETY: a live instance whose address is not used afterwards. It is terminated only where the standard
        // permits it.
        unsafe {
            if self.phase == Phase::Stepping {
                terminate(instance);
            }
            free(instance);
        }
    }
}

impl Drop for Fmu {
    fn drop(&mut self) {
        self.end();
    }
}

/// A path as `file:///…`.
fn uri(path: &Path) -> String {
    let path = path.to_string_lossy().replace('\\', "/");
    let mut uri = String::from(if path.starts_with('/') { "file://" } else { "file:///" });
    for byte in path.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'/' | b':' | b'-' | b'.' | b'_' | b'~' => uri.push(byte.into()),
            other => uri.push_str(&format!("%{other:02X}")),
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_a_uri() {
        assert_eq!(uri(Path::new("/tmp/a b/ü")), "file:///tmp/a%20b/%C3%BC");
        assert_eq!(uri(Path::new("C:\\a\\b")), "file:///C:/a/b");
    }
}
