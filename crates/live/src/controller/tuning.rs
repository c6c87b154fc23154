//! The fair tuning beside a bench that runs, on a thread of its own: one at a time.

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

/// How far a tuning is, or what it found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TuneProgress {
    /// Its number; 0 where there was none.
    pub number: u64,
    /// Who began it.
    pub by: String,
    /// The part that is done, 0 … 1: of the longest search.
    pub fraction: f64,
    /// Whether it has ended.
    pub ended: bool,
    /// What is not as it was in force when it began: value by path; `null` until then, and where nothing was found.
    pub values: Option<BTreeMap<String, String>>,
    /// What was found, or why nothing was.
    pub sentence: Option<String>,
}

/// The tuning that runs, or ran last.
#[derive(Clone, Default)]
pub(super) struct Tuner {
    seen: Arc<Mutex<TuneProgress>>,
    cancelled: Arc<AtomicBool>,
}

impl Tuner {
    pub(super) fn seen(&self) -> TuneProgress {
        lock(&self.seen).clone()
    }

    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    fn runs(&self) -> Option<TuneProgress> {
        Some(self.seen()).filter(|seen| seen.number > 0 && !seen.ended)
    }

    /// Ends it for whoever began it.
    pub(super) fn end(&self, client: &str) -> Result<(), Error> {
        match self.runs() {
            Some(seen) if seen.by != client => Err(busy(&seen)),
            _ => {
                self.cancel();
                Ok(())
            }
        }
    }

    /// Begins to tune the controller of a preset; what is found is told against what is in force.
    pub(super) fn begin(
        &mut self,
        client: &str,
        in_force: Preset<f64>,
        preset: Preset<f64>,
        speed: f64,
    ) -> Result<(), Error> {
        if let Some(seen) = self.runs() {
            return Err(busy(&seen));
        }
        let number = self.seen().number + 1;
        self.cancelled = Arc::default();
        self.seen = Arc::new(Mutex::new(TuneProgress { number, by: client.into(), ..TuneProgress::default() }));
        let Tuner { seen, cancelled } = self.clone();
        thread::spawn(move || {
            let told = seen.clone();
            let watch = Watch::new(cancelled, move |_, fraction| lock(&told).fraction = fraction);
            let tuned = tune(&preset.bench.controller, &preset.model, &preset.bench, speed, &watch);
            let mut seen = lock(&seen);
            seen.ended = true;
            seen.sentence = Some(match tuned {
                Ok(tuned) => {
                    let mut preset = preset;
                    preset.bench.controller = tuned.controller;
                    seen.fraction = 1.0;
                    seen.values = Some(changes(&in_force, &preset));
                    format!(
                        "Tuned within the fair limits: the angle after a load torque of 0.1 N m rises to {}.",
                        tied(&Estimate::new(0.1 * tuned.peak, "rad"))
                    )
                }
                Err(error) => error.to_string(),
            });
        });
        Ok(())
    }
}

fn busy(seen: &TuneProgress) -> Error {
    LiveError::Busy { what: format!("a tuning that {} began", seen.by) }.into()
}
