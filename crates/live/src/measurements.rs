//! Measurements: the one that runs, as far as it is, and the results of earlier runs.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::breakaway::BreakawayProgress;
use super::curve::Measured;
use super::lock;
use stickslip_experiment::Part;
use stickslip_experiment::workflow::render::Rendering;

/// The measurements of the project.
pub(super) struct Measurements {
    /// Folder of the runs.
    pub(super) folder: PathBuf,
    current: Mutex<Current>,
}

/// The measurement that runs, or ran last.
#[derive(Default)]
struct Current {
    curve: Measured,
    at_rest: BreakawayProgress,
}

impl Measurements {
    pub(super) fn new(folder: &Path) -> Self {
        Measurements { folder: folder.into(), current: Mutex::default() }
    }

    /// A friction curve begins, perhaps of a friction that is rendered.
    pub(super) fn begin_curve(&self, run: u64, planned: Option<Box<Rendering>>) {
        lock(&self.current).curve.begin(run, planned);
    }

    /// A measurement of breakaway or presliding begins.
    pub(super) fn begin_at_rest(&self, so_far: BreakawayProgress) {
        lock(&self.current).at_rest = so_far;
    }

    /// Adds a part to the measurement that runs.
    pub(super) fn add(&self, part: Part<'_>) {
        let Current { curve, at_rest } = &mut *lock(&self.current);
        match part {
            Part::Plateau(plateau) if matches!(at_rest, BreakawayProgress::Nothing) => {
                curve.plateaus.push(plateau.clone())
            }
            part => at_rest.add(part),
        }
    }

    /// The measurement has ended.
    pub(super) fn end(&self) {
        let mut current = lock(&self.current);
        current.curve.measuring = false;
        current.at_rest = BreakawayProgress::Nothing;
    }

    /// The friction curve that is being measured, or was measured last.
    pub(super) fn current_curve(&self) -> Measured {
        lock(&self.current).curve.clone()
    }

    /// The measurement of breakaway or presliding that runs.
    pub(super) fn current_at_rest(&self) -> BreakawayProgress {
        lock(&self.current).at_rest.clone()
    }
}
