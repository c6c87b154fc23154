//! What an FMU tells its importer: of all its messages the last of the gravest, and how many there were.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::fs::File;
use std::io::{Seek as _, Write as _};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Characters of a message that are kept.
const LONGEST: usize = 400;

/// Where messages go, from whichever thread.
#[repr(C)]
pub(super) struct Log {
    /// The logger in C finds it here.
    take: unsafe extern "C" fn(*const Log, c_int, *const c_char),
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    count: u64,
    gravity: u8,
    text: Option<String>,
    /// Has the text, too, for whoever wants to know it after a crash.
    file: Option<File>,
}

unsafe extern "C" {
    /// The logger of FMI 2.0; an address alone, since it takes any number of arguments.
    pub(super) fn stickslip_fmu_log();
    /// Of the library of C: zeroed memory for FMI 2.0.
    pub(super) fn calloc(count: usize, size: usize) -> *mut c_void;
    /// Of the library of C.
    pub(super) fn free(memory: *mut c_void);
}

impl Log {
    /// An empty one; the text is written into the file, too.
    pub(super) fn new(file: Option<&Path>) -> Self {
        let file = file.and_then(|path| File::create(path).ok());
        Log { take, kept: Mutex::new(Kept { file, ..Kept::default() }) }
    }

    /// Forgets everything.
    pub(super) fn clear(&self) {
        let mut kept = self.kept();
        *kept = Kept { file: kept.file.take(), ..Kept::default() };
        kept.write();
    }

    /// Takes a message of this status.
    pub(super) fn add(&self, status: c_int, text: &str) {
        // OK and pending, warning, all that is worse.
        let gravity = match status {
            0 | 5 => 0,
            1 => 1,
            _ => 2,
        };
        let mut kept = self.kept();
        kept.count = kept.count.saturating_add(1);
        let text: String = text.trim().chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
        if gravity >= kept.gravity && !text.is_empty() {
            (kept.gravity, kept.text) = (gravity, Some(text));
            kept.write();
        }
    }

    /// The last of the gravest messages, and how many there were.
    pub(super) fn said(&self) -> Option<(String, u64)> {
        let kept = self.kept();
        kept.text.clone().map(|text| (text, kept.count))
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    fn write(&mut self) {
        if let Some(file) = &mut self.file {
            // A message that is lost is no reason to stop.
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
        // SAFETY: the caller's promise.
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
    // SAFETY: the caller's promise.
    unsafe { take(environment.cast(), status, text) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_messages_the_last_of_the_gravest_is_kept_in_bounded_memory() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("said");
        let log = Log::new(Some(&file));
        log.add(1, "a warning");
        log.add(3, "an error\nin two lines");
        for _ in 0..10_000 {
            log.add(0, &"words ".repeat(1000));
        }
        let said = |text: &str, count| Some((text.to_owned(), count));
        assert_eq!(log.said(), said("an error in two lines", 10_002));
        log.add(3, &"x".repeat(1000));
        assert_eq!(log.said().map(|said| said.0.len()), Some(LONGEST));
        assert_eq!(std::fs::read_to_string(&file).expect("it is there").len(), LONGEST);
        log.clear();
        assert_eq!((log.said(), std::fs::read(&file).expect("it is there").len()), (None, 0));
    }

    #[test]
    fn the_logger_in_c_fills_its_format_in() {
        type Logger = unsafe extern "C" fn(*const Log, *const c_char, c_int, *const c_char, *const c_char, ...);
        let log = Log::new(None);
        // SAFETY: this is its type in C; the format takes these arguments.
        unsafe {
            let logger = std::mem::transmute::<unsafe extern "C" fn(), Logger>(stickslip_fmu_log);
            logger(&log, c"it".as_ptr(), 3, c"".as_ptr(), c"%s = %g of %d".as_ptr(), c"x".as_ptr(), 0.5f64, 7 as c_int);
        }
        assert_eq!(log.said(), Some(("x = 0.5 of 7".into(), 1)));
    }
}
