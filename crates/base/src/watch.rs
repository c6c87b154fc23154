//! Progress and cancellation of long work.

use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::Error;

/// Callback for a stage's name and its finished part (0 … 1).
type Report = dyn Fn(&str, f64) + Send + Sync;

/// Callback for a part of a measurement.
type Parts = dyn Fn(&dyn Any) + Send + Sync;

/// The observer of one piece of work: gets its progress, and may cancel it.
#[derive(Clone)]
pub struct Watch {
    cancelled: Arc<AtomicBool>,
    report: Arc<Report>,
    parts: Option<Arc<Parts>>,
}

impl Watch {
    /// An observer that ignores progress and never cancels.
    pub fn silent() -> Self {
        Watch::new(Arc::default(), |_, _| {})
    }

    /// Calls `report` with the stage's name and its finished part (0 … 1); cancels the work when `cancelled` is true.
    pub fn new(cancelled: Arc<AtomicBool>, report: impl Fn(&str, f64) + Send + Sync + 'static) -> Self {
        Watch { cancelled, report: Arc::new(report), parts: None }
    }

    /// Calls `parts` with each part of a measurement as well, as soon as it is available.
    pub fn with_parts(self, parts: impl Fn(&dyn Any) + Send + Sync + 'static) -> Self {
        Watch { parts: Some(Arc::new(parts)), ..self }
    }

    /// Reports a part of a measurement.
    pub fn part(&self, part: &dyn Any) {
        self.parts.iter().for_each(|report| report(part));
    }

    /// Reports that the fraction `fraction` (0 … 1) of the stage `name` is done.
    ///
    /// # Errors
    /// [`Error::Cancelled`]: return it, and leave what is finished in a usable state.
    pub fn stage(&self, name: &str, fraction: f64) -> Result<(), Error> {
        self.check()?;
        (self.report)(name, fraction.clamp(0.0, 1.0));
        Ok(())
    }

    /// Checks for cancellation, for loops too short to report.
    ///
    /// # Errors
    /// [`Error::Cancelled`], as from [`stage`](Self::stage).
    pub fn check(&self) -> Result<(), Error> {
        if self.cancelled.load(Ordering::Relaxed) { Err(Error::Cancelled) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn a_watch_gets_each_stage_until_it_cancels() {
        let cancelled = Arc::new(AtomicBool::new(false));
        let stages = Arc::new(Mutex::new(Vec::new()));
        let list = stages.clone();
        let watch = Watch::new(cancelled.clone(), move |name, fraction| {
            list.lock().unwrap().push((name.to_string(), fraction));
        });
        assert!(watch.stage("measure", 0.25).is_ok());
        assert!(watch.stage("measure", 1.5).is_ok());
        cancelled.store(true, Ordering::Relaxed);
        assert!(matches!(watch.stage("fit", 0.0), Err(Error::Cancelled)));
        assert!(matches!(watch.check(), Err(Error::Cancelled)));
        assert_eq!(*stages.lock().unwrap(), [("measure".to_string(), 0.25), ("measure".to_string(), 1.0)]);
    }

    #[test]
    fn a_silent_watch_never_cancels() {
        assert!((0..1000).all(|i| Watch::silent().stage("run", f64::from(i) / 1000.0).is_ok()));
    }
}
