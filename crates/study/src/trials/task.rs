//! A trial that is stored.

use std::path::Path;

use super::stored::TrialRun;
use super::{ROW, TrialRow};
use stickslip_base::{Error, Preset, Watch, output};
use stickslip_bench::Bench;
use stickslip_experiment::trial::{TrialMotion, TrialPlan, run_trial};

/// A trial that is prepared to run.
#[derive(Clone, Debug)]
pub struct PreparedTrial {
    /// Parameters of the bench with the controller.
    pub preset: Preset<f64>,
    /// The motion.
    pub motion: TrialMotion,
    /// The controller in words.
    pub controller: String,
    /// The friction in words.
    pub friction: String,
    /// Number of repetitions.
    pub repetitions: u64,
    /// Whether the load motor renders the desired friction.
    pub render: bool,
}

impl PreparedTrial {
    /// Runs the trial from an origin [rad] and writes it as this run into a folder.
    ///
    /// # Errors
    /// As [`run_trial`]; [`Error::File`].
    pub fn run(
        self,
        origin: f64,
        run: u64,
        folder: &Path,
        bench: &mut dyn Bench,
        watch: &Watch,
    ) -> Result<TrialRun, Error> {
        let PreparedTrial { preset, motion, controller, friction, repetitions, render } = self;
        let plan = TrialPlan { motion: &motion, repetitions, render, origin };
        let trial = run_trial(&plan, &preset, bench, watch)?;
        let done = TrialRun { preset, motion, controller, friction, render, preload: bench.preload(), trial };
        done.write(folder, "stickslip serve, trial")?;
        let row = serde_json::to_string(&TrialRow::of(run, &done)).unwrap_or_default();
        output::write(&folder.join(ROW), row)?;
        Ok(done)
    }
}
