//! Tuning within the robustness limits, on its own thread: one at a time.

use crate::LiveError;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::lock;
use super::changes;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_base::{Error, Preset, Watch};
use stickslip_design::tune;

/// Progress or result of a tuning.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TuneProgress {
    /// Number of the tuning; 0: none yet.
    pub number: u64,
    /// The client that started it.
    pub by: String,
    /// Completed share of the longest search, 0 … 1.
    pub fraction: f64,
    /// Whether it has ended.
    pub ended: bool,
    /// Tuned values that differ from those active at its start, by path; `null` before the end and after a failure.
    pub values: Option<BTreeMap<String, String>>,
    /// Result, or reason of the failure.
    pub sentence: Option<String>,
}

/// The running or last tuning.
#[derive(Clone, Default)]
pub(super) struct Tuner {
    progress: Arc<Mutex<TuneProgress>>,
    cancelled: Arc<AtomicBool>,
}

impl Tuner {
    pub(super) fn progress(&self) -> TuneProgress {
        lock(&self.progress).clone()
    }

    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    fn running(&self) -> Option<TuneProgress> {
        Some(self.progress()).filter(|progress| progress.number > 0 && !progress.ended)
    }

    /// Ends a tuning that this client started.
    pub(super) fn end(&self, client: &str) -> Result<(), Error> {
        match self.running() {
            Some(progress) if progress.by != client => Err(busy(&progress)),
            _ => {
                self.cancel();
                Ok(())
            }
        }
    }

    /// Starts to tune the controller of a preset; the result is reported as differences from the active parameters.
    pub(super) fn begin(
        &mut self,
        client: &str,
        in_force: Preset<f64>,
        preset: Preset<f64>,
        speed: f64,
    ) -> Result<(), Error> {
        if let Some(progress) = self.running() {
            return Err(busy(&progress));
        }
        let number = self.progress().number + 1;
        self.cancelled = Arc::default();
        self.progress = Arc::new(Mutex::new(TuneProgress { number, by: client.into(), ..TuneProgress::default() }));
        let Tuner { progress, cancelled } = self.clone();
        thread::spawn(move || {
            let reported = progress.clone();
            let watch = Watch::new(cancelled, move |_, fraction| lock(&reported).fraction = fraction);
            let tuned = tune(&preset.bench.controller, &preset.model, &preset.bench, speed, &watch);
            let mut progress = lock(&progress);
            progress.ended = true;
            progress.sentence = Some(match tuned {
                Ok(tuned) => {
                    let mut preset = preset;
                    preset.bench.controller = tuned.controller;
                    progress.fraction = 1.0;
                    progress.values = Some(changes(&in_force, &preset));
                    format!(
                        "Tuned within the robustness limits: a load torque of 0.1 N m deflects the angle by at most {}.",
                        tied(&Estimate::new(0.1 * tuned.peak, "rad"))
                    )
                }
                Err(error) => error.to_string(),
            });
        });
        Ok(())
    }
}

fn busy(progress: &TuneProgress) -> Error {
    let remedy = "Wait for its end; only the client that started it can end it.";
    LiveError::Busy { what: format!("a tuning started by {}", progress.by), remedy }.into()
}
