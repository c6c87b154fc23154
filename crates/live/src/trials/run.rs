//! A trial with the active controller.

use std::sync::Arc;

use super::MOST_REPETITIONS;
use crate::axis::{Job, make_ready};
use crate::protocol::{Answer, TrialFile};
use crate::{Live, Shared};
use stickslip_base::{Error, Preset, Watch};
use stickslip_bench::{Bench as _, ClockedBench, Command};
use stickslip_design::within;
use stickslip_experiment::trial::{PositionFile, TrialMotion};
use stickslip_study::benchmark::{MANOEUVRES, Manoeuvre};
use stickslip_study::trials::{PreparedTrial, controller_words, friction_of};

/// The error of an unknown name, with the known ones.
pub(super) fn unknown(what: &'static str, name: &str, known: &[&str]) -> Error {
    Error::Unknown { what, name: name.into(), remedy: format!("Known: {}.", known.join(", ")) }
}

/// The manoeuvre of a name.
pub(super) fn manoeuvre(name: &str) -> Result<Manoeuvre, Error> {
    let found = MANOEUVRES.into_iter().find(|manoeuvre| manoeuvre.name() == name);
    found.ok_or_else(|| unknown("manoeuvre", name, &MANOEUVRES.map(Manoeuvre::name)))
}

/// Checks a number of repetitions.
pub(super) fn check_repetitions(repetitions: u64, least: u64) -> Result<(), Error> {
    let range = (least as f64, MOST_REPETITIONS as f64);
    within("the number of repetitions", repetitions as f64, "", range, "Choose a number within this range.")
}

impl Live {
    /// Starts a trial with the active controller.
    pub(crate) fn trial(
        &self,
        motion: &str,
        file: Option<TrialFile>,
        repetitions: u64,
        render: bool,
    ) -> Result<Answer, Error> {
        check_repetitions(repetitions, 1)?;
        self.renderable(render)?;
        let shared = &self.shared;
        let preset = shared.parameters.preset();
        let motion = match file {
            Some(TrialFile { name, text }) => TrialMotion::File(PositionFile::parse(&name, &text, &preset)?),
            None => TrialMotion::Manoeuvre(manoeuvre(motion)?),
        };
        shared.check_start(&motion, &preset)?;
        let what = format!("test {}", motion.name());
        let (controller, friction) = (shared.active_controller(&preset), friction_of(&preset, render).1);
        let (run, folder) = shared.runs.folder(&format!("test-{}", motion.name()))?;
        let prepared = PreparedTrial { preset, motion, controller, friction, repetitions, render };
        let to = folder.clone();
        let work = move |bench: &mut ClockedBench, watch: &Watch| {
            let origin = ready_at(bench, watch)?;
            prepared.run(origin, run, &to, bench, watch).map(drop)
        };
        self.begin(&what.clone(), Job::run(what, folder, work))
    }
}

impl Shared {
    /// The active controller in words: that of the loaded file if it is in the loop.
    pub(super) fn active_controller(&self, preset: &Preset<f64>) -> String {
        let is_loaded = self.parameters.read(|tuning| tuning.acting()).is_some_and(|role| role.name() == "controller");
        let loaded = self.parameters.loaded.status().filter(|_| is_loaded);
        loaded.map_or_else(|| controller_words(preset), |loaded| loaded.name)
    }

    /// Refuses a motion that leaves the travel. Without homing the axis will be near its zero.
    pub(super) fn check_start(self: &Arc<Self>, motion: &TrialMotion, preset: &Preset<f64>) -> Result<(), Error> {
        let newest = self.acquisition.newest();
        let is_homed = matches!(newest.state, "running" | "ready");
        motion.check(preset, if is_homed { self.acquisition.held_angle() } else { 0.0 })
    }
}

/// Homes and enables the torque if necessary. Returns the position [rad].
pub(super) fn ready_at(bench: &mut ClockedBench, watch: &Watch) -> Result<f64, Error> {
    make_ready(bench, watch)?;
    Ok(bench.step(Command::default())?.angle)
}
