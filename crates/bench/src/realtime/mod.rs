//! Real-time performance of this machine: its set-up, its own holes, and the lateness of the executive of
//! [`stickslip_rt`].

mod floor;
mod report;
mod wake_up;

use std::path::Path;
use std::time::Duration;

pub use floor::{Floor, measure_floor};
pub use stickslip_rt::Outcome;
pub use stickslip_rt::SPIN;
pub use stickslip_rt::doctor::network;
pub use stickslip_rt::doctor::{Finding, NOT_REPORTED, Verdict};
use stickslip_rt::{Granted, ThreadSettings, doctor};
pub use wake_up::{WakeUp, measure_wake_up};

use stickslip_base::{Error, Watch};

/// Settings of an examination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkup {
    /// Rate of the cycles [Hz], 2 … 100 000.
    pub rate: f64,
    /// Total time of all measurements [s], 0.3 … 86 400.
    pub seconds: f64,
}

/// Result of an examination.
#[derive(Clone, Debug)]
pub struct Examination {
    /// Its settings.
    pub checkup: Checkup,
    /// The set-up.
    pub findings: Vec<Finding>,
    /// The holes of the machine.
    pub floor: Floor,
    /// The executive that sleeps until its deadline.
    pub asleep: WakeUp,
    /// The executive that sleeps until shortly before its deadline and then spins.
    pub spinning: WakeUp,
}

impl Default for Checkup {
    /// The bench's default rate, four seconds.
    fn default() -> Self {
        Checkup { rate: 4000.0, seconds: 4.0 }
    }
}

impl Checkup {
    /// Reads the set-up below `root` (`/`) and measures, a third of the time each: floor, asleep, spinning.
    ///
    /// # Errors
    /// [`Error::OutOfRange`]; [`BenchError::RealTime`](crate::BenchError::RealTime) if the system provides no thread;
    /// [`Error::Cancelled`].
    pub fn examine(self, root: &Path, watch: &Watch) -> Result<Examination, Error> {
        in_range("rate", self.rate, "Hz", [2.0, 100_000.0])?;
        in_range("seconds", self.seconds, "s", [0.3, 86_400.0])?;
        let findings = doctor::examine(root);
        let third = Duration::from_secs_f64(self.seconds / 3.0);
        let thread_settings = ThreadSettings::default();
        let floor = measure_floor(third, thread_settings, watch)?;
        let [asleep, spinning] = [("asleep", Duration::ZERO), ("spinning", SPIN)];
        let wake_up = |(name, spin): (&str, Duration)| {
            measure_wake_up(self.rate, third, spin, thread_settings, &format!("wake-up {name}"), watch)
        };
        Ok(Examination { checkup: self, findings, floor, asleep: wake_up(asleep)?, spinning: wake_up(spinning)? })
    }
}

impl Examination {
    /// Settings that the system granted to the executive's thread.
    pub fn granted(&self) -> &Granted {
        &self.asleep.granted
    }

    /// Number of findings with this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.findings.iter().filter(|finding| finding.verdict == verdict).count()
    }
}

fn in_range(name: &'static str, value: f64, unit: &'static str, [minimum, maximum]: [f64; 2]) -> Result<(), Error> {
    if (minimum..=maximum).contains(&value) {
        return Ok(());
    }
    Err(Error::OutOfRange { name, value, unit, minimum, maximum, remedy: "Choose a value within this range." })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impossible_rate_or_time_is_refused() {
        for (rate, seconds) in [(1.0, 1.0), (f64::NAN, 1.0), (1e6, 1.0), (4000.0, 0.0), (4000.0, f64::INFINITY)] {
            let refused = Checkup { rate, seconds }.examine(Path::new("/"), &Watch::silent());
            assert!(matches!(refused, Err(Error::OutOfRange { .. })), "{rate} {seconds}");
        }
    }

    #[test]
    fn each_measurement_has_the_requested_cycles() {
        let examination = Checkup { rate: 1000.0, seconds: 0.6 }.examine(Path::new("/"), &Watch::silent()).unwrap();
        for wake_up in [&examination.asleep, &examination.spinning] {
            // Cycles missed on a busy machine are not recorded.
            let (ran, missed) = (wake_up.summary.cycles, wake_up.summary.missed);
            assert!((200..=200 + missed).contains(&(ran + missed)), "{:?}", wake_up.summary);
            assert_eq!(wake_up.histograms.lost, 0);
        }
        let summary = examination.summary();
        let findings = ["good", "costs", "unknown"].map(|name| summary.value(&format!("doctor.{name}")).unwrap());
        assert_eq!(findings.iter().sum::<f64>(), examination.findings.len() as f64);
        assert!(examination.report("stickslip doctor").html().contains("</svg>"));
    }

    #[test]
    fn a_cancelled_measurement_ends_its_threads() {
        let cancelled = std::sync::Arc::new(true.into());
        let refused = Checkup { rate: 1000.0, seconds: 60.0 }
            .examine(Path::new("/"), &Watch::new(cancelled, |_, _| {}))
            .map(|_| ());
        assert!(matches!(refused, Err(Error::Cancelled)));
    }
}
