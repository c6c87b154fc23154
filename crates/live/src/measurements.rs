//! Measurements: the running one with its parts so far, and the results of earlier runs.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::breakaway::BreakawayProgress;
use super::curve::{self, CurveProgress};
use super::lock;
use stickslip_experiment::workflow::render::Rendering;
use stickslip_experiment::{Breakaway, FrictionCurve, Part, Presliding};

/// The measurements of the project.
pub(super) struct Measurements {
    /// Folder of the runs.
    pub(super) folder: PathBuf,
    current: Mutex<Current>,
}

/// The running or last measurement.
#[derive(Default)]
struct Current {
    curve: CurveProgress,
    at_rest: BreakawayProgress,
}

impl Measurements {
    pub(super) fn new(folder: &Path) -> Self {
        Measurements { folder: folder.into(), current: Mutex::default() }
    }

    /// Starts a friction curve, possibly of a rendered friction.
    pub(super) fn begin_curve(&self, run: u64, planned: Option<Box<Rendering>>) {
        lock(&self.current).curve.begin(run, planned);
    }

    /// Starts a measurement of breakaway or presliding.
    pub(super) fn begin_at_rest(&self, so_far: BreakawayProgress) {
        lock(&self.current).at_rest = so_far;
    }

    /// Adds a part to the running measurement.
    pub(super) fn add(&self, part: Part<'_>) {
        let Current { curve, at_rest } = &mut *lock(&self.current);
        match part {
            Part::Plateau(plateau) if matches!(at_rest, BreakawayProgress::Nothing) => {
                curve.plateaus.push(plateau.clone())
            }
            part => at_rest.add(part),
        }
    }

    /// Ends the measurement.
    pub(super) fn end(&self) {
        let mut current = lock(&self.current);
        current.curve.measuring = false;
        current.at_rest = BreakawayProgress::Nothing;
    }

    /// The running friction curve up to now; `None` without a speed.
    pub(super) fn curve_so_far(&self, duration: f64) -> Option<FrictionCurve> {
        let plateaus = lock(&self.current).curve.plateaus.clone();
        (!plateaus.is_empty()).then(|| FrictionCurve { duration, ..curve::of(plateaus) })
    }

    /// The running measurement of breakaway up to now; `None` without a ramp.
    pub(super) fn breakaway_so_far(&self, duration: f64) -> Option<Breakaway> {
        match self.current_at_rest() {
            BreakawayProgress::Breakaway(so_far) if !so_far.ramps.is_empty() => {
                Some(Breakaway { duration, complete: false, ..so_far })
            }
            _ => None,
        }
    }

    /// The running measurement of presliding up to now; `None` without a loop.
    pub(super) fn presliding_so_far(&self, duration: f64) -> Option<Presliding> {
        match self.current_at_rest() {
            BreakawayProgress::Presliding(_, loops) if !loops.is_empty() => {
                Some(Presliding { duration, complete: false, ..Presliding::of_loops(loops) })
            }
            _ => None,
        }
    }

    /// The running or last friction curve.
    pub(super) fn current_curve(&self) -> CurveProgress {
        lock(&self.current).curve.clone()
    }

    /// The running measurement of breakaway or presliding.
    pub(super) fn current_at_rest(&self) -> BreakawayProgress {
        lock(&self.current).at_rest.clone()
    }
}
