//! The floor of the machine: holes between two readings of the clock by a thread that only reads the clock.
//!
//! Interrupts, the system's management mode and a hypervisor stop this thread as they stop an executive. A wake-up at an
//! instant within a hole is late by the rest of the hole, so the holes h of a time T determine the lateness of an ideal
//! executive: P(late > x) = Σ max(0, h − x) / T.

use std::hint::spin_loop;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use stickslip_rt::{Block, Clock, Cycle, Lap, MonotonicClock, Next, OverrunPolicy, Plan, Running, ThreadSettings};

use super::wake_up::follow;
use crate::BenchError;
use stickslip_base::{Error, Watch};

/// Period of the spins: the kernel stops a real-time thread that uses more than 95 % of a second.
const PERIOD: Duration = Duration::from_millis(100);
const SPUN: u64 = 85_000_000;
/// Shortest hole [ns]; shorter times are normal readings of the clock.
const SHORTEST: u64 = 1000;
/// Maximum number of holes; the measurement ends when it is reached.
const ROOM: usize = 1 << 20;

/// The holes of a machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Floor {
    /// Time for which the clock was read [s].
    pub watched: f64,
    /// All holes from 1 µs on [s], the longest first.
    pub holes: Vec<f64>,
}

impl Floor {
    fn new(watched: u64, holes: &[u64]) -> Self {
        let mut holes: Vec<f64> = holes.iter().map(|hole| *hole as f64 * 1e-9).collect();
        holes.sort_by(|one, other| other.total_cmp(one));
        Floor { watched: watched as f64 * 1e-9, holes }
    }

    /// Share of the instants that are late by more than `lateness` [s].
    pub fn later_than(&self, lateness: f64) -> f64 {
        let within = self.holes.iter().take_while(|hole| **hole > lateness);
        within.map(|hole| hole - lateness).sum::<f64>() / self.watched.max(f64::MIN_POSITIVE)
    }

    /// Lateness that this share of the instants does not exceed [s].
    pub fn quantile(&self, part: f64) -> f64 {
        let beyond = (1.0 - part) * self.watched;
        let mut sum = 0.0;
        for (index, hole) in self.holes.iter().enumerate() {
            sum += hole;
            // For x between this hole's length and the next one's: sum − count·x = beyond.
            let count = (index + 1) as f64;
            let cut = (sum - beyond) / count;
            if cut >= self.holes.get(index + 1).copied().unwrap_or(0.0) {
                return cut.clamp(0.0, *hole);
            }
        }
        0.0
    }

    /// The longest hole [s]; 0 without holes.
    pub fn longest(&self) -> f64 {
        self.holes.first().copied().unwrap_or(0.0)
    }
}

/// Spins through most of each period.
struct Spinning {
    watched: u64,
    holes: Vec<u64>,
    result: Sender<Floor>,
}

impl Cycle for Spinning {
    fn blocks(&self) -> &[Block] {
        &[]
    }

    fn run(&mut self, _: u64, _: &mut Lap) -> Next {
        let clock = MonotonicClock::default();
        let begin = clock.now();
        let mut last = begin;
        while last - begin < SPUN {
            spin_loop();
            let now = clock.now();
            if now - last >= SHORTEST {
                self.holes.push(now - last);
            }
            last = now;
            if self.holes.len() == ROOM {
                break;
            }
        }
        self.watched += last - begin;
        if self.holes.len() < ROOM { Next::Continue } else { Next::Stop }
    }

    fn hold(&mut self, _: u64) {}

    fn end(&mut self) {
        // There is no receiver if the measurement was cancelled.
        let _ = self.result.send(Floor::new(self.watched, &self.holes));
    }
}

/// Reads the clock for this time, on a thread with the executive's settings.
///
/// # Errors
/// [`BenchError::RealTime`] if the system provides no thread; [`Error::Cancelled`].
pub fn measure_floor(time: Duration, thread_settings: ThreadSettings, watch: &Watch) -> Result<Floor, Error> {
    let (result, floor): (_, Receiver<Floor>) = channel();
    let cycles = time.as_nanos().div_ceil(PERIOD.as_nanos()) as u64;
    let overrun = OverrunPolicy { stop_after: None, ..OverrunPolicy::default() };
    let plan = Plan { warm_up: 0, cycles: Some(cycles), overrun, ..Plan::new(PERIOD) };
    let cycle = Spinning { watched: 0, holes: Vec::with_capacity(ROOM), result };
    let (running, mut timings) =
        Running::start(plan, thread_settings, MonotonicClock::default(), cycle).map_err(BenchError::RealTime)?;
    follow(&running, time, "floor of the machine", watch, || timings.by_ref().for_each(drop))?;
    running.join();
    Ok(floor.recv().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instants_within_a_hole_are_late() {
        // One hole of 2 ms and one of 1 ms in a second: 0.3 % of all instants are late.
        let floor = Floor::new(1_000_000_000, &[1_000_000, 2_000_000]);
        let close = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-12, "{value}, not {expected}");
        close(floor.later_than(0.0), 3e-3);
        close(floor.later_than(1e-3), 1e-3);
        close(floor.later_than(1.5e-3), 0.5e-3);
        close(floor.later_than(2e-3), 0.0);
        close(floor.longest(), 2e-3);
        for part in [0.998, 0.999, 0.9995, 1.0] {
            close(floor.later_than(floor.quantile(part)), 1.0 - part);
        }
        close(floor.quantile(0.5), 0.0);
        close(floor.quantile(0.999), 1e-3);
        assert_eq!((Floor::default().quantile(0.999), Floor::default().later_than(0.0)), (0.0, 0.0));
    }
}
