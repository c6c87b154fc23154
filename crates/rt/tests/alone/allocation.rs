//! The first paragraph of the crate: from the first cycle to the last, the thread allocates and frees nothing.
//!
//! An allocator that counts, on the thread that has been told so: the executive's own code between two cycles is
//! watched as well as the cycle.

use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::counting::{CALLS, WATCHED};
use stickslip_rt::pages::{Reader, exchange};
use stickslip_rt::{
    Block, Cycle, Ending, Lap, MonotonicClock, Next, OverrunPolicy, Plan, Running, Summary, ThreadSettings,
};

/// Watches its thread from its first cycle to its end.
struct Watched {
    pages: Reader<Vec<f64>>,
    allocates: bool,
    slow: bool,
    sum: f64,
}

impl Cycle for Watched {
    fn blocks(&self) -> &[Block] {
        const { &[Block::new("law")] }
    }

    fn run(&mut self, cycle: u64, lap: &mut Lap) -> Next {
        WATCHED.set(true);
        self.pages.take(cycle);
        self.sum += self.pages.page().iter().sum::<f64>();
        // The first one from 50 on that runs: on a busy machine the fiftieth may be missed.
        if cycle >= 50 && std::mem::take(&mut self.allocates) {
            self.sum += *std::hint::black_box(Box::new(1.0));
        }
        if cycle >= 50 && std::mem::take(&mut self.slow) {
            std::thread::sleep(Duration::from_millis(20));
        }
        lap.done(0);
        Next::Continue
    }

    fn hold(&mut self, _: u64) {}

    fn end(&mut self) {
        WATCHED.set(false);
    }
}

/// Calls of the allocator within the cycles, while somebody else hands in pages and takes records.
fn calls(allocates: bool, slow: bool) -> (u64, Summary) {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    CALLS.store(0, Ordering::Relaxed);
    let (mut writer, pages) = exchange(vec![0.0; 3]);
    let overrun = OverrunPolicy { stop_after: None, ..OverrunPolicy::default() };
    let plan = Plan { warm_up: 10, cycles: Some(300), overrun, records: 8, ..Plan::new(Duration::from_millis(1)) };
    let cycle = Watched { pages, allocates, slow, sum: 0.0 };
    let (running, mut timings) =
        Running::start(plan, ThreadSettings::PLAIN, MonotonicClock::default(), cycle).expect("the plan can be");
    let mut records = 0;
    while !running.has_ended() {
        writer.publish(vec![1.0; 1000]);
        // So slowly that the ring of eight runs over.
        std::thread::sleep(Duration::from_millis(50));
        records += timings.by_ref().count();
    }
    let summary = running.join();
    assert!(writer.entered().is_none_or(|cycle| cycle > 0) && records > 0 && summary.lost > 0);
    (CALLS.load(Ordering::Relaxed), summary)
}

#[test]
fn a_running_executive_allocates_and_frees_nothing() {
    let (calls, summary) = calls(false, false);
    assert_eq!((calls, summary.ending), (0, Ending::Finished));
}

#[test]
fn the_search_for_the_cause_of_an_overrun_allocates_nothing_either() {
    let (calls, summary) = calls(false, true);
    assert!(summary.overruns > 0);
    assert_eq!(calls, 0);
}

#[test]
fn a_block_that_allocates_is_noticed() {
    let (calls, _) = calls(true, false);
    assert_eq!(calls, 2, "one allocation, freed at once");
}
