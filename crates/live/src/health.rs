//! Health of the loop: execution times, and lost or missed cycles, each with its cause and a remedy.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stickslip_rt::{Histograms, Overrun};

use super::lock;
use super::protocol::{Answer, Timing};
use stickslip_bench::overrun_sentence;

/// Capacity of each list.
const CAPACITY: usize = 50;

/// Lost or missed cycles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Loss {
    /// The first cycle after them.
    pub cycle: u64,
    /// Number of lost or missed cycles.
    pub count: u64,
    /// Cause.
    pub cause: String,
    /// Remedy.
    pub remedy: String,
}

/// Kind of a gap between two received cycles.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lost {
    /// Cycles lost on the way to the listener.
    Watching,
    /// Cycles lost on the way into the recording.
    Recording,
    /// No cycle lost: the virtual machine waited for commands.
    Waiting,
}

/// Execution times of cycles, and the newest losses.
pub(super) struct Health {
    /// Filled by the bench.
    histograms: Arc<Mutex<Histograms>>,
    losses: Mutex<Losses>,
}

/// Cycle, number of cycles and kind of gap: lost cycles, and waiting times.
#[derive(Default)]
struct Losses {
    lost: VecDeque<(u64, u64, Lost)>,
    waited: VecDeque<(u64, u64, Lost)>,
}

impl Losses {
    fn push(&mut self, cycle: u64, count: u64, lost: Lost) {
        let list = if matches!(lost, Lost::Waiting) { &mut self.waited } else { &mut self.lost };
        if list.len() == CAPACITY {
            list.pop_front();
        }
        list.push_back((cycle, count, lost));
    }
}

impl Health {
    pub(super) fn new(histograms: Arc<Mutex<Histograms>>) -> Self {
        Health { histograms, losses: Mutex::default() }
    }

    /// Notes a gap in the cycles.
    pub(super) fn lost(&self, cycle: u64, count: u64, lost: Lost) {
        lock(&self.losses).push(cycle, count, lost);
    }

    #[cfg(test)]
    pub(super) fn add_overrun(&self, overrun: Overrun) {
        lock(&self.histograms).overruns.push(overrun);
    }

    /// Reads the execution times.
    pub(super) fn times<R>(&self, read: impl FnOnce(&Histograms) -> R) -> R {
        read(&lock(&self.histograms))
    }

    /// The execution times at a tick rate.
    pub(super) fn timing(&self, rate: f64) -> Answer {
        Answer::Timing(Box::new(self.times(|times| Timing::of(times, rate))))
    }

    /// Lost cycles, and missed ones at a tick rate, each list with the newest last.
    pub(super) fn losses(&self, rate: f64) -> Answer {
        let (lost, waited) = {
            let losses = lock(&self.losses);
            let list = |list: &VecDeque<_>| list.iter().map(Loss::of).collect::<Vec<_>>();
            (list(&losses.lost), list(&losses.waited))
        };
        let overrun = |overrun: &Overrun| Loss {
            cycle: overrun.cycle,
            count: (overrun.by as f64 * 1e-9 * rate).ceil().max(1.0) as u64,
            cause: overrun_sentence(overrun),
            remedy: "`stickslip doctor` checks the set-up of the system; `--cpu N` reserves a CPU for the loop.".into(),
        };
        let mut held: Vec<_> = self.times(|times| {
            let newest = times.overruns.len().saturating_sub(CAPACITY);
            times.overruns[newest..].iter().map(overrun).chain(waited).collect()
        });
        held.sort_by_key(|loss| loss.cycle);
        Answer::Losses { lost, held }
    }
}

impl Loss {
    fn of(&(cycle, count, lost): &(u64, u64, Lost)) -> Self {
        let (cause, remedy) = match lost {
            Lost::Watching => (
                "The listener thread did not get CPU time until its buffer of cycles was full.",
                "The loop itself was not affected. Close other programs, or leave them fewer CPUs.",
            ),
            Lost::Recording => (
                "The disk was too slow for the recording.",
                "The loop itself was not affected. Record onto a faster disk that no other program uses.",
            ),
            Lost::Waiting => (
                "Commands of the experiment were late; the virtual machine waited for them.",
                "The results are unchanged; physical hardware would have stopped. Close other programs.",
            ),
        };
        Loss { cycle, count, cause: cause.into(), remedy: remedy.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_losses_are_kept_with_cause_and_remedy() {
        let mut losses = Losses::default();
        (0..80).for_each(|cycle| losses.push(cycle, 3, Lost::Recording));
        let shown: Vec<Loss> = losses.lost.iter().map(Loss::of).collect();
        assert_eq!((shown.len(), shown[0].cycle, shown[0].count), (CAPACITY, 30, 3));
        assert!(shown[0].cause.contains("disk") && !shown[0].remedy.is_empty());
    }
}
