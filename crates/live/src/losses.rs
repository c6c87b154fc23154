//! Cycles that were lost or held: when, how many, why, and what to do.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Live, lock};
use stickslip_bench::overrun_sentence;

/// So many of each are told.
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
    /// On the way to whoever watches.
    Watching,
    /// On the way into the recording.
    Recording,
    /// Nothing: the machine waited for commands.
    Waiting,
}

/// The newest of them: cycle, cycles, where.
#[derive(Default)]
pub(super) struct Losses(VecDeque<(u64, u64, Lost)>);

impl Losses {
    pub(super) fn push(&mut self, cycle: u64, count: u64, lost: Lost) {
        if self.0.len() == MOST {
            self.0.pop_front();
        }
        self.0.push_back((cycle, count, lost));
    }
}

impl Live {
    /// Lost cycles, and those that were held, each the newest last.
    pub(super) fn losses(&self) -> [Vec<Loss>; 2] {
        let lost = lock(&self.shared.losses).0.iter().map(Loss::of).collect();
        let waits: Vec<_> = lock(&self.shared.waits).0.iter().map(Loss::of).collect();
        let rate = lock(&self.shared.tuning).preset().bench.tick_rate;
        let histograms = lock(&self.shared.histograms);
        let newest = histograms.overruns.len().saturating_sub(MOST);
        let overrun = |overrun: &stickslip_rt::Overrun| Loss {
            cycle: overrun.cycle,
            count: (overrun.by as f64 * 1e-9 * rate).ceil().max(1.0) as u64,
            cause: overrun_sentence(overrun),
            remedy: "`stickslip doctor` finds what the system may do besides; `--cpu N` leaves a CPU to the loop."
                .into(),
        };
        let mut held: Vec<_> = histograms.overruns[newest..].iter().map(overrun).chain(waits).collect();
        held.sort_by_key(|loss| loss.cycle);
        [lost, held]
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
        let told: Vec<Loss> = losses.0.iter().map(Loss::of).collect();
        assert_eq!((told.len(), told[0].cycle, told[0].count), (MOST, 30, 3));
        assert!(told[0].cause.contains("disk") && !told[0].remedy.is_empty());
    }
}
