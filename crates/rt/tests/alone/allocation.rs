//! From the first cycle to the last, the thread neither allocates nor frees memory.
//!
//! A counting allocator is enabled on the executive's thread: it covers the cycle and the code of the executive between
//! two cycles.

use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use super::counting::{CALLS, WATCHED};
use stickslip_rt::pages::{Reader, exchange};
use stickslip_rt::{
    Block, Cycle, Ending, Lap, MonotonicClock, Next, OverrunPolicy, Plan, Running, Summary, ThreadSettings,
};

/// Counts allocations of its thread from the first cycle to the end.
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
        // The first cycle that runs from 50 on: on a busy computer the fiftieth may be missed.
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

/// Calls of the allocator within the cycles, while another thread publishes pages and takes records.
fn calls(allocates: bool, slow: bool) -> (u64, Summary) {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    CALLS.store(0, Ordering::Relaxed);
    let (mut writer, pages) = exchange(vec![0.0; 3]);
    let overrun = OverrunPolicy { stop_after: None, ..OverrunPolicy::default() };
    let plan = Plan { warm_up: 10, cycles: Some(300), overrun, records: 8, ..Plan::new(Duration::from_millis(1)) };
    let cycle = Watched { pages, allocates, slow, sum: 0.0 };
    let (running, mut timings) =
        Running::start(plan, ThreadSettings::PLAIN, MonotonicClock::default(), cycle).expect("the plan is valid");
    let mut records = 0;
    while !running.has_ended() {
        writer.publish(vec![1.0; 1000]);
        // So slowly that the ring of eight records overflows.
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
fn an_allocation_in_a_block_is_counted() {
    let (calls, _) = calls(true, false);
    assert_eq!(calls, 2, "one allocation, freed at once");
}
