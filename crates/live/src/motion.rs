//! The state of the axis: its motion or measurement, the result of the last one, and how to stop it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use stickslip_software::cycle::Change;
use stickslip_software::supervise::Request;

use super::jog::JogSwitch;
use super::protocol::{Answer, CurrentTask, Ended};
use super::{LiveError, lock};
use stickslip_base::Error;
use stickslip_bench::ImmediateChanges;

/// The stage of a motion: parameters may be changed during it.
pub(super) const MOVING: &str = "moving";

/// The state of the axis.
pub(super) struct Motion {
    /// Changes for the next cycle.
    urgent: Mutex<ImmediateChanges>,
    activity: Mutex<Activity>,
    /// Preload of the friction wheel: the bits of an `f64`.
    preload: AtomicU64,
    /// The button that is held for a jog.
    pub(super) jog: JogSwitch,
    /// Set to end the motion or the measurement.
    halt: Arc<AtomicBool>,
    /// Whether it was stopped by the timeout of the operator.
    abandoned: AtomicBool,
}

/// The running motion or measurement, and the end of the last one.
#[derive(Default)]
pub(super) struct Activity {
    doing: Option<CurrentTask>,
    last: Option<Ended>,
}

impl Motion {
    pub(super) fn new(urgent: ImmediateChanges, preload: f64) -> Self {
        Motion {
            urgent: Mutex::new(urgent),
            activity: Mutex::default(),
            preload: AtomicU64::new(preload.to_bits()),
            jog: JogSwitch::default(),
            halt: Arc::default(),
            abandoned: AtomicBool::new(false),
        }
    }

    /// Makes a change with the next cycle: the number of that cycle.
    pub(super) fn change(&self, change: Change) -> Result<u64, Error> {
        lock(&self.urgent).change(change)
    }

    /// Waits for the end of a change in progress: it is then reported.
    pub(super) fn wait_for_change(&self) {
        drop(lock(&self.urgent));
    }

    pub(super) fn request(&self, request: Request) -> Result<Answer, Error> {
        self.change(Change::Request(request)).map(|_| Answer::Done {})
    }

    /// Halts and brakes to rest; or disables the torque immediately.
    pub(super) fn stop(&self, off: bool) -> Result<Answer, Error> {
        self.halt();
        self.request(if off { Request::Off } else { Request::Stop })
    }

    /// Ends the motion or the measurement.
    pub(super) fn halt(&self) -> Answer {
        self.jog.release();
        self.halt.store(true, Ordering::Relaxed);
        Answer::Done {}
    }

    /// Whether the running activity has this name.
    pub(super) fn is_doing(&self, what: &str) -> bool {
        lock(&self.activity).doing.as_ref().is_some_and(|doing| doing.what == what)
    }

    pub(super) fn is_halted(&self) -> bool {
        self.halt.load(Ordering::Relaxed)
    }

    /// Flag that ends the motion or the measurement.
    pub(super) fn halt_flag(&self) -> Arc<AtomicBool> {
        self.halt.clone()
    }

    /// Starts a motion or a measurement by `start`, unless one is running.
    pub(super) fn begin(&self, what: &str, start: impl FnOnce() -> Result<Answer, Error>) -> Result<Answer, Error> {
        let mut activity = lock(&self.activity);
        if let Some(doing) = &activity.doing {
            return Err(busy(doing));
        }
        self.halt.store(false, Ordering::Relaxed);
        self.abandoned.store(false, Ordering::Relaxed);
        activity.doing = Some(CurrentTask { what: what.into(), stage: "begin".into(), fraction: 0.0 });
        start()
    }

    /// While this guard is held, no measurement runs or starts: a measurement sets parameters itself.
    pub(super) fn at_most_moving(&self) -> Result<MutexGuard<'_, Activity>, Error> {
        let activity = lock(&self.activity);
        match &activity.doing {
            Some(running) if running.stage != MOVING => Err(busy(running)),
            _ => Ok(activity),
        }
    }

    pub(super) fn progress(&self, what: &str, stage: &str, fraction: f64) {
        lock(&self.activity).doing = Some(CurrentTask { what: what.into(), stage: stage.into(), fraction });
    }

    /// Ends the activity without a result.
    pub(super) fn idle(&self) {
        lock(&self.activity).doing = None;
    }

    pub(super) fn end(&self, ended: Ended) {
        *lock(&self.activity) = Activity { doing: None, last: Some(ended) };
    }

    pub(super) fn status(&self) -> (Option<CurrentTask>, Option<Ended>) {
        let activity = lock(&self.activity);
        (activity.doing.clone(), activity.last.clone())
    }

    /// Stops the motion or the measurement after the timeout of the operator.
    pub(super) fn abandon(&self) {
        let runs = lock(&self.activity).doing.is_some();
        if runs && !self.abandoned.swap(true, Ordering::Relaxed) {
            // Refused if it is stopping already or the loop has ended.
            drop(self.stop(false));
        }
    }

    /// Whether the ending activity was stopped by the timeout.
    pub(super) fn was_abandoned(&self) -> bool {
        self.abandoned.load(Ordering::Relaxed)
    }

    /// Whether the ending activity was stopped by the timeout; resets the flag.
    pub(super) fn take_abandoned(&self) -> bool {
        self.abandoned.swap(false, Ordering::Relaxed)
    }

    /// Preload of the friction wheel, 0 … 1.
    pub(super) fn preload(&self) -> f64 {
        f64::from_bits(self.preload.load(Ordering::Relaxed))
    }

    pub(super) fn set_preload(&self, preload: f64) {
        self.preload.store(preload.to_bits(), Ordering::Relaxed);
    }
}

fn busy(running: &CurrentTask) -> Error {
    let remedy = "Wait for its end, or end it: `stickslip bench halt`.";
    LiveError::Busy { what: running.what.clone(), remedy }.into()
}
