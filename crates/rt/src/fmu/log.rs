//! Messages of an FMU: the last of the most severe ones, and their number.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::fs::File;
use std::io::{Seek as _, Write as _};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Maximum length of a stored message [characters].
const LONGEST: usize = 400;

/// Receiver of the messages, from any thread.
#[repr(C)]
pub(super) struct Log {
    /// First field: the logger in C calls it.
    take: unsafe extern "C" fn(*const Log, c_int, *const c_char),
    state: Mutex<LogState>,
}

#[derive(Default)]
struct LogState {
    count: u64,
    severity: u8,
    text: Option<String>,
    /// Copy of the text that outlives a crash.
    file: Option<File>,
}

unsafe extern "C" {
    /// The logger of FMI 2.0; declared without arguments because it is variadic.
    pub(super) fn stickslip_fmu_log();
    /// From the C library: zeroed memory for FMI 2.0.
    pub(super) fn calloc(count: usize, size: usize) -> *mut c_void;
    /// From the C library.
    pub(super) fn free(memory: *mut c_void);
}

impl Log {
    /// An empty log; the text is also written to the file.
    pub(super) fn new(file: Option<&Path>) -> Self {
        let file = file.and_then(|path| File::create(path).ok());
        Log { take, state: Mutex::new(LogState { file, ..LogState::default() }) }
    }

    /// Clears the log.
    pub(super) fn clear(&self) {
        let mut state = self.state();
        *state = LogState { file: state.file.take(), ..LogState::default() };
        state.write();
    }

    /// Adds a message with this status.
    pub(super) fn add(&self, status: c_int, text: &str) {
        // OK and pending, warning, error.
        let severity = match status {
            0 | 5 => 0,
            1 => 1,
            _ => 2,
        };
        let mut state = self.state();
        state.count = state.count.saturating_add(1);
        let text: String = text.trim().chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
        if severity >= state.severity && !text.is_empty() {
            (state.severity, state.text) = (severity, Some(text));
            state.write();
        }
    }

    /// The last of the most severe messages, and the number of messages.
    pub(super) fn message(&self) -> Option<(String, u64)> {
        let state = self.state();
        state.text.clone().map(|text| (text, state.count))
    }

    fn state(&self) -> MutexGuard<'_, LogState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LogState {
    fn write(&mut self) {
        if let Some(file) = &mut self.file {
            // A lost message does not stop the run.
            let _ = file.set_len(0).and_then(|()| file.rewind());
            let _ = file.write_all(self.text.as_deref().unwrap_or_default().as_bytes());
        }
    }
}

/// Takes a message for a log.
///
/// # Safety
/// The log lives; the text is null or ends with 0.
unsafe extern "C" fn take(log: *const Log, status: c_int, text: *const c_char) {
    if !log.is_null() && !text.is_null() {
        // SAFETY: guaranteed by the caller.
        unsafe { (*log).add(status, &CStr::from_ptr(text).to_string_lossy()) }
    }
}

/// The logger of FMI 3.0.
///
/// # Safety
/// The environment is a log that lives; the texts are null or end with 0.
pub(super) unsafe extern "C" fn log_three(
    environment: *mut c_void,
    status: c_int,
    _category: *const c_char,
    text: *const c_char,
) {
    // SAFETY: guaranteed by the caller.
    unsafe { take(environment.cast(), status, text) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_of_the_most_severe_messages_is_stored_in_bounded_memory() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("message");
        let log = Log::new(Some(&file));
        log.add(1, "a warning");
        log.add(3, "an error\nin two lines");
        for _ in 0..10_000 {
            log.add(0, &"words ".repeat(1000));
        }
        let expected = |text: &str, count| Some((text.to_owned(), count));
        assert_eq!(log.message(), expected("an error in two lines", 10_002));
        log.add(3, &"x".repeat(1000));
        assert_eq!(log.message().map(|message| message.0.len()), Some(LONGEST));
        assert_eq!(std::fs::read_to_string(&file).expect("it is there").len(), LONGEST);
        log.clear();
        assert_eq!((log.message(), std::fs::read(&file).expect("it is there").len()), (None, 0));
    }

    #[test]
    fn the_logger_in_c_formats_its_arguments() {
        type Logger = unsafe extern "C" fn(*const Log, *const c_char, c_int, *const c_char, *const c_char, ...);
        let log = Log::new(None);
        // SAFETY: this is its type in C; the format takes these arguments.
        unsafe {
            let logger = std::mem::transmute::<unsafe extern "C" fn(), Logger>(stickslip_fmu_log);
            logger(&log, c"it".as_ptr(), 3, c"".as_ptr(), c"%s = %g of %d".as_ptr(), c"x".as_ptr(), 0.5f64, 7 as c_int);
        }
        assert_eq!(log.message(), Some(("x = 0.5 of 7".into(), 1)));
    }
}
