//! Policy and accounting, on a simulated clock.

use super::*;
use crate::clock::SimulatedClock;
use crate::cycle::Block;

const PERIOD: u64 = 1000;
const BLOCKS: [Block; 2] = [Block::io("read"), Block::new("law")];

/// Calls of a cycle.
#[derive(Default)]
struct Log {
    ran: Vec<u64>,
    held: Vec<u64>,
    ended: u32,
}

/// Takes 100 ns to read, and a given time for its law.
struct Script<F> {
    clock: SimulatedClock,
    law: F,
    log: Arc<std::sync::Mutex<Log>>,
}

impl<F: FnMut(u64) -> (u64, Next) + Send> Cycle for Script<F> {
    fn blocks(&self) -> &[Block] {
        &BLOCKS
    }

    fn run(&mut self, cycle: u64, lap: &mut Lap) -> Next {
        self.log.lock().unwrap().ran.push(cycle);
        self.clock.advance(100);
        lap.done(0);
        let (time, next) = (self.law)(cycle);
        self.clock.advance(time);
        next
    }

    fn hold(&mut self, cycle: u64) {
        self.log.lock().unwrap().held.push(cycle);
    }

    fn end(&mut self) {
        self.log.lock().unwrap().ended += 1;
    }
}

fn plan(cycles: u64) -> Plan {
    Plan { warm_up: 0, cycles: Some(cycles), ..Plan::new(Duration::from_nanos(PERIOD)) }
}

/// A clock with late wake-ups.
struct LateClock<F>(SimulatedClock, F);

impl<F: Fn(u64) -> u64> Clock for LateClock<F> {
    fn now(&self) -> u64 {
        self.0.now()
    }

    fn wait_until(&self, deadline: u64) -> u64 {
        self.0.wait_until(deadline);
        // The first deadline is one period after the start at 0.
        self.0.advance((self.1)(deadline / PERIOD - 1));
        self.0.now()
    }
}

fn run(
    plan: Plan,
    late: impl Fn(u64) -> u64,
    law: impl FnMut(u64) -> (u64, Next) + Send,
) -> (Summary, Vec<Timing>, Log) {
    let (clock, log) = (SimulatedClock::default(), Arc::default());
    let script = Script { clock: clock.clone(), law, log: Arc::clone(&log) };
    let (executive, timings) = Executive::new(plan, script).unwrap();
    let summary = executive.run(&LateClock(clock, late));
    let log = std::mem::take(&mut *log.lock().unwrap());
    (summary, timings.collect(), log)
}

#[test]
fn cycles_begin_on_their_deadlines_and_lateness_does_not_accumulate() {
    let (summary, timings, log) = run(plan(6), |cycle| 10 * cycle, |_| (200, Next::Continue));
    assert_eq!(timings.iter().map(|timing| timing.lateness).collect::<Vec<_>>(), [0, 10, 20, 30, 40, 50]);
    assert!(timings.iter().all(|timing| timing.total == 300 && timing.blocks[..2] == [100, 200]));
    assert_eq!((log.ran.len(), log.held.len(), log.ended), (6, 0, 1));
    assert_eq!((summary.ending, summary.cycles, summary.overruns), (Ending::Finished, 6, 0));
}

#[test]
fn after_an_overrun_the_missed_cycles_are_held_and_the_next_one_begins_in_time() {
    // Cycle 2 ends 2500 ns after its deadline: the times of 3 and 4 have passed.
    let slow = |cycle| (if cycle == 2 { 2400 } else { 200 }, Next::Continue);
    let (summary, timings, log) = run(plan(7), |_| 0, slow);
    assert_eq!((log.ran, log.held), (vec![0, 1, 2, 5, 6], vec![3, 4]));
    let overrun = timings[2].overrun.unwrap();
    assert_eq!((overrun.cycle, overrun.by, overrun.cause), (2, 1500, Cause::Block(1)));
    assert_eq!((timings[3].cycle, timings[3].missed, timings[3].lateness), (5, 2, 0));
    assert_eq!((summary.cycles, summary.missed, summary.overruns, summary.worst), (5, 2, 1, Some(overrun)));
}

#[test]
fn work_that_ends_on_the_next_deadline_is_in_time_and_a_nanosecond_later_it_is_not() {
    let (summary, ..) = run(plan(3), |_| 0, |_| (900, Next::Continue));
    assert_eq!((summary.overruns, summary.missed), (0, 0));
    let (summary, ..) = run(plan(3), |_| 0, |cycle| (900 + u64::from(cycle == 0), Next::Continue));
    assert_eq!((summary.overruns, summary.missed), (1, 1));
}

#[test]
fn a_cycle_that_wakes_too_late_is_held_with_its_cause() {
    let (summary, timings, log) = run(plan(9), |cycle| if cycle == 3 { 3600 } else { 0 }, |_| (0, Next::Continue));
    assert_eq!((log.ran, log.held), (vec![0, 1, 2, 7, 8], vec![3, 4, 5, 6]));
    let overrun = timings[3].overrun.unwrap();
    assert_eq!((overrun.cycle, overrun.late, overrun.cause), (3, 3600, Cause::LateWakeUp));
    assert_eq!((timings[4].cycle, timings[4].missed, summary.missed, summary.cycles), (7, 4, 4, 5));
}

#[test]
fn a_cycle_begins_late_within_the_part_of_the_period_that_the_policy_allows() {
    let (late, still) = (|cycle| if cycle == 1 { 501 } else { 500 }, |_| (0, Next::Continue));
    assert_eq!(run(plan(3), late, still).2.held, [1]);
    let patient = OverrunPolicy { begin_within: 0.6, ..OverrunPolicy::default() };
    assert_eq!(run(Plan { overrun: patient, ..plan(3) }, late, still).2.held, [] as [u64; 0]);
}

#[test]
fn a_late_wake_up_is_the_cause_of_an_overrun_that_follows_from_it() {
    let (_, timings, _) = run(plan(5), |cycle| if cycle == 4 { 450 } else { 0 }, |_| (500, Next::Continue));
    assert_eq!(timings[4].overrun.unwrap().cause, Cause::LateWakeUp);
}

#[test]
fn only_consecutive_overruns_end_the_run() {
    let overrun = OverrunPolicy { stop_after: Some(3), ..OverrunPolicy::default() };
    let plan = Plan { overrun, ..plan(100) };
    let (summary, _, log) = run(plan, |_| 0, |_| (1000, Next::Continue));
    assert_eq!((summary.ending, log.ran.len(), log.ended), (Ending::Overruns(3), 3, 1));
    let (summary, ..) = run(plan, |_| 0, |cycle| (if cycle % 6 < 4 { 1000 } else { 0 }, Next::Continue));
    assert_eq!(summary.ending, Ending::Finished);
    assert!(summary.overruns > 20);
}

#[test]
fn the_warm_up_runs_but_is_not_counted() {
    let slow = |cycle| (if cycle < 3 { 5000 } else { 0 }, Next::Continue);
    let (summary, timings, log) = run(Plan { warm_up: 20, ..plan(5) }, |_| 0, slow);
    assert_eq!(log.ran.first(), Some(&0));
    assert_eq!((summary.cycles, summary.overruns, summary.missed), (5, 0, 0));
    assert_eq!(timings.iter().map(|timing| timing.cycle).collect::<Vec<_>>(), [20, 21, 22, 23, 24]);
}

#[test]
fn the_run_ends_by_the_cycle_or_by_the_stop_flag() {
    let last = |cycle| (0, if cycle == 4 { Next::Stop } else { Next::Continue });
    let (summary, _, log) = run(plan(100), |_| 0, last);
    assert_eq!((summary.ending, summary.cycles, log.ended), (Ending::Finished, 5, 1));

    let (clock, log) = (SimulatedClock::default(), Arc::default());
    let stop: Arc<std::sync::OnceLock<Arc<AtomicBool>>> = Arc::default();
    let flag = stop.clone();
    let law = move |cycle| {
        flag.get().unwrap().store(cycle == 7, Ordering::Relaxed);
        (0, Next::Continue)
    };
    let script = Script { clock: clock.clone(), law, log: Arc::clone(&log) };
    let (executive, _timings) = Executive::new(Plan { cycles: None, ..plan(0) }, script).unwrap();
    stop.set(executive.stop()).unwrap();
    let summary = executive.run(&clock);
    assert_eq!((summary.ending, summary.cycles, log.lock().unwrap().ended), (Ending::Stopped, 8, 1));
}

#[test]
fn a_cycle_that_panics_leaves_safe_outputs_and_its_message() {
    let (summary, _, log) = run(
        plan(9),
        |_| 0,
        |cycle| {
            assert!(cycle < 3, "the encoder is upside down");
            (0, Next::Continue)
        },
    );
    assert_eq!(summary.ending, Ending::Panicked("the encoder is upside down".into()));
    assert_eq!((summary.cycles, log.ended, log.held.len()), (3, 1, 0));
}

#[test]
fn records_lost_in_a_full_ring_are_counted() {
    let (summary, timings, _) = run(Plan { records: 4, ..plan(10) }, |_| 0, |_| (0, Next::Continue));
    assert_eq!((timings.len(), summary.lost, summary.cycles), (4, 6, 10));
}

#[test]
fn an_invalid_plan_is_refused() {
    struct Many;
    impl Cycle for Many {
        fn blocks(&self) -> &[Block] {
            const { &[Block::new("one of many"); MAX_BLOCKS + 1] }
        }
        fn run(&mut self, _: u64, _: &mut Lap) -> Next {
            Next::Stop
        }
        fn hold(&mut self, _: u64) {}
        fn end(&mut self) {}
    }
    let refused = |plan: Plan| Executive::new(plan, Many).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(refused(plan(1)).contains("17 blocks"));
    assert!(refused(Plan { period: Duration::ZERO, ..plan(1) }).contains("outside 1 µs … 1 s"));
    assert!(refused(Plan { records: 0, ..plan(1) }).contains("no room"));
    let overrun = OverrunPolicy { begin_within: f64::NAN, ..OverrunPolicy::default() };
    assert!(refused(Plan { overrun, ..plan(1) }).contains("NaN"));
}
