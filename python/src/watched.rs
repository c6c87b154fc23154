//! Long work beside Python: the lock is released, Ctrl-C ends the work, progress is told.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;
use stickslip::{Error, Watch};

use crate::error::raised;

/// Between two looks at what Python wants.
const LOOK: Duration = Duration::from_millis(50);
/// As much as the main thread of a program has: whole benches lie on the stack.
const STACK: usize = 16 << 20;

/// Does the work on a thread of its own, while this one looks for signals and calls `progress(stage, fraction)`. An
/// exception of either ends the work and is raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let (tell, told) = channel();
    let watch = Watch::new(cancelled.clone(), move |stage, fraction| {
        // Whoever does not listen any more has cancelled.
        let _ = tell.send((stage.to_owned(), fraction));
    });
    let heard = |stage: &str, fraction: f64| progress.map_or(Ok(()), |call| call.call1((stage, fraction)).map(drop));
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || work(&watch))?;
        let mut interrupted = None;
        // The receiver is handed in and out: it may not be shared, and the closure runs on this thread anyway.
        let mut told = told;
        loop {
            let next;
            (told, next) = py.detach(move || {
                let next = told.recv_timeout(LOOK);
                (told, next)
            });
            // Python sets what it is told aside until the work has ended.
            let said = match next {
                Ok((stage, fraction)) => heard(&stage, fraction),
                Err(RecvTimeoutError::Timeout) => Ok(()),
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if let (None, Err(error)) = (&interrupted, said.and_then(|()| py.check_signals())) {
                cancelled.store(true, Ordering::Relaxed);
                interrupted = Some(error);
            }
        }
        let outcome = py.detach(|| worker.join());
        match (interrupted, outcome) {
            (Some(error), _) => Err(error),
            (None, Ok(outcome)) => outcome.map_err(|error| raised(py, &error)),
            (None, Err(panic)) => std::panic::resume_unwind(panic),
        }
    })
}
