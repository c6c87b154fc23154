//! Records of runs: every cycle, every change with its cycle, and the data for a replay.

mod change;
mod course;
mod events;
mod numbers;
mod read;
mod recorder;
mod replay;
mod scribe;
mod signals;
mod simulate;
#[cfg(test)]
mod tests;

pub use course::{Alignment, Course, align, course};
pub use events::{RunEvent, story};
pub use read::Stored;
pub use recorder::{About, Recorded, Recorder, RunWriter};
pub use recorder::{BEGIN, PRESET, SCHEMA};
pub use replay::{Difference, Replayed, replay};
pub use scribe::{Progress, Scribe};
pub use signals::{STATES, state_name};
pub use signals::{Signals, channels};
pub use simulate::{Simulated, SimulationRequest, Trace};

use stickslip_software::cycle::Parameters;

use crate::Keyframe;
use crate::tap::{Changed, Sample, Stream};
use stickslip_base::Preset;

/// A recorded run.
#[derive(Clone, Debug)]
pub struct Record {
    /// Preset of the bench.
    pub preset: Preset<f64>,
    /// Seed of the noise of the virtual machine; `None` for another machine.
    pub seed: Option<u64>,
    /// Initial parameters of the software.
    pub initial: Parameters<f64>,
    /// Initial state, if the record does not start with the first cycle of the bench.
    pub state: Option<Vec<f64>>,
    /// The cycles with their numbers.
    pub cycles: Vec<(u64, Signals<f64>)>,
    /// The changes, in order.
    pub changes: Vec<Changed>,
    /// Numbers of lost cycles, each with the following cycle.
    pub lost: Vec<(u64, u64)>,
}

impl Record {
    /// An empty record.
    pub fn new(preset: &Preset<f64>, seed: Option<u64>, initial: Parameters<f64>) -> Self {
        let preset = *preset;
        Record { preset, seed, initial, state: None, cycles: Vec::new(), changes: Vec::new(), lost: Vec::new() }
    }

    /// An empty record of a running bench.
    pub fn from(preset: &Preset<f64>, seed: Option<u64>, initial: Parameters<f64>, keyframe: &Keyframe) -> Self {
        Record { state: Some(keyframe.numbers.clone()), ..Self::new(preset, seed, initial) }
    }

    /// Takes all available cycles and changes.
    pub fn take(&mut self, stream: &mut Stream) {
        while let Some(Sample { frame, lost, .. }) = stream.sample() {
            self.cycles.push((frame.cycle, Signals::of(&frame)));
            if lost > 0 {
                self.lost.push((frame.cycle, lost));
            }
        }
        self.changes.extend(std::iter::from_fn(|| stream.change()));
    }

    /// Tick time [s].
    pub fn tick_time(&self) -> f64 {
        self.preset.bench.tick_time()
    }
}
