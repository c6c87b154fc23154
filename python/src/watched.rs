//! Long work called from Python: releases the interpreter lock, handles Ctrl-C, reports progress.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;
use stickslip::{Error, Watch};

use crate::error::raised;

/// Interval between two checks of signals.
const LOOK: Duration = Duration::from_millis(50);
/// Stack size of the worker in bytes; whole benches are on the stack.
const STACK: usize = 16 << 20;

/// Runs the work on a separate thread, while this thread checks signals and calls `progress(stage, fraction)`. An
/// exception of either ends the work and is raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let cancelled = Arc::new(AtomicBool::new(false));
    let (sender, receiver) = channel();
    let watch = Watch::new(cancelled.clone(), move |stage, fraction| {
        // Sending fails only after a cancellation.
        let _ = sender.send((stage.to_owned(), fraction));
    });
    let report = |stage: &str, fraction: f64| progress.map_or(Ok(()), |call| call.call1((stage, fraction)).map(drop));
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || work(&watch))?;
        let mut interrupted = None;
        // The receiver moves into the closure and back, because it cannot be shared.
        let mut receiver = receiver;
        loop {
            let next;
            (receiver, next) = py.detach(move || {
                let next = receiver.recv_timeout(LOOK);
                (receiver, next)
            });
            // The first error cancels the work; it is raised after the worker has ended.
            let reported = match next {
                Ok((stage, fraction)) => report(&stage, fraction),
                Err(RecvTimeoutError::Timeout) => Ok(()),
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if let (None, Err(error)) = (&interrupted, reported.and_then(|()| py.check_signals())) {
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
