//! Trials: the active controller follows a manoeuvre, and chosen controllers are compared on the same friction.
//!
//! Each trial is a run of the project with its samples, scores and report. A comparison is a run as well, in addition to
//! the trials of its controllers.

mod compare;
mod run;

use std::path::Path;
use std::sync::Mutex;

use super::protocol::Answer;
use super::{Live, lock};
use stickslip_study::trials::{Comparison, TrialChoices, TrialStore};

/// Largest number of repetitions.
const MOST_REPETITIONS: u64 = 20;

/// The trials of the project.
pub(super) struct Trials {
    pub(super) store: TrialStore,
    /// The running or last comparison.
    comparison: Mutex<Option<Comparison>>,
}

impl Trials {
    pub(super) fn new(folder: &Path) -> Self {
        Trials { store: TrialStore::new(folder), comparison: Mutex::default() }
    }

    /// The running or last comparison, or that of a run.
    pub(super) fn comparison(&self, run: Option<u64>) -> Answer {
        let current = lock(&self.comparison).clone();
        let current = current.filter(|comparison| run.is_none_or(|run| run == comparison.run));
        Answer::Comparison(Box::new(current.or_else(|| self.store.comparison(run)).unwrap_or_default()))
    }
}

impl Live {
    /// What can be tried now.
    pub(super) fn trial_choices(&self) -> Answer {
        let preset = self.shared.parameters.preset();
        let not_rendered = self.shared.parameters.tuning().renderable().err().map(|error| error.to_string());
        let active = self.shared.active_controller(&preset);
        Answer::TrialChoices(Box::new(TrialChoices::of(&preset, active, not_rendered)))
    }
}
