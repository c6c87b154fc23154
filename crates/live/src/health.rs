//! Health of the loop: execution times, and cycles that were lost or held, each with its cause and a remedy.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stickslip_rt::{Histograms, Overrun};

use super::lock;
use super::protocol::{Answer, Timing};
use stickslip_bench::overrun_sentence;

/// So many of each are kept.
const MOST: usize = 50;

/// Something that was lost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Loss {
    /// The first cycle behind it.
    pub cycle: u64,
    /// Cycles.
    pub count: u64,
    /// Why.
    pub cause: String,
    /// What to do.
    pub remedy: String,
}

/// What happened between two cycles that came through.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lost {
    /// On the way to the listener.
    Watching,
    /// On the way into the recording.
    Recording,
    /// Nothing: the machine waited for commands.
    Waiting,
}

/// Execution times of cycles, and the newest losses.
pub(super) struct Health {
    /// The bench fills them.
    histograms: Arc<Mutex<Histograms>>,
    losses: Mutex<Losses>,
}

/// Cycle, number of cycles, and what happened: those that were lost, and those that waited.
#[derive(Default)]
struct Losses {
    lost: VecDeque<(u64, u64, Lost)>,
    waited: VecDeque<(u64, u64, Lost)>,
}

impl Losses {
    fn push(&mut self, cycle: u64, count: u64, lost: Lost) {
        let list = if matches!(lost, Lost::Waiting) { &mut self.waited } else { &mut self.lost };
        if list.len() == MOST {
            list.pop_front();
        }
        list.push_back((cycle, count, lost));
    }
}

impl Health {
    pub(super) fn new(histograms: Arc<Mutex<Histograms>>) -> Self {
        Health { histograms, losses: Mutex::default() }
    }

    /// Notes cycles that did not come through.
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

    /// Lost cycles, and those that were held at a tick rate, each the newest last.
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
            remedy: "`stickslip doctor` finds what the system may do besides; `--cpu N` leaves a CPU to the loop."
                .into(),
        };
        let mut held: Vec<_> = self.times(|times| {
            let newest = times.overruns.len().saturating_sub(MOST);
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
                "Whoever watches was kept from the CPU until there was no room for more cycles.",
                "The loop itself went on. Close what computes besides, or leave it fewer CPUs.",
            ),
            Lost::Recording => (
                "The disk took the recording slower than cycles came.",
                "The loop itself went on. Record onto a faster disk, and nothing else meanwhile.",
            ),
            Lost::Waiting => (
                "Commands of the experiment were late; the virtual machine waited for them.",
                "The results are the same; a machine of steel would have come to rest. Close what computes besides.",
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
        let told: Vec<Loss> = losses.lost.iter().map(Loss::of).collect();
        assert_eq!((told.len(), told[0].cycle, told[0].count), (MOST, 30, 3));
        assert!(told[0].cause.contains("disk") && !told[0].remedy.is_empty());
    }
}
