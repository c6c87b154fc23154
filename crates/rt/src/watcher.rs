//! A baseline near every overrun, without a system call in a good cycle.
//!
//! Page faults and preemptions of long ago explain nothing, so somebody has to count shortly before. A plain thread does:
//! fifty times a second it reads the counters of the executive's thread while that sleeps between two cycles, and hands
//! them in as a page. A cycle that has missed its deadline reads its own counters and takes the difference.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::cause::Evidence;
use crate::clock::Nanoseconds;
use crate::cycle::short;
use crate::pages::{Reader, Writer, exchange};
use crate::system::{Counters, OtherThread, ThreadId, own_counters, this_thread};

/// From baseline to baseline.
const INTERVAL: Duration = Duration::from_millis(20);
/// So often in a row it is tried to read within one sleep.
const TRIES: usize = 10;

/// The counters at an instant, and what they include.
#[derive(Clone, Copy, Debug, Default)]
struct Baseline {
    counters: Counters,
    /// Sleeps so far.
    sleeps: u64,
    /// Time between sleeps so far [ns].
    awake: u64,
    /// CPU time that a sleep and its wake-up take themselves [ns].
    overhead: u64,
}

/// What the executive's thread tells the watcher: a few stores a cycle.
#[derive(Default)]
struct Pulse {
    /// Odd while it sleeps.
    phase: AtomicU64,
    sleeps: AtomicU64,
    awake: AtomicU64,
}

/// Of the executive's thread: knows what the thread has used, and asks the system in an overrun alone.
pub(crate) struct ThreadUsage {
    pulse: Arc<Pulse>,
    baselines: Reader<Baseline>,
    /// From the end of the last overrun, if that is newer.
    own: Baseline,
    phase: u64,
    sleeps: u64,
    awake: u64,
}

/// The thread that takes the baselines; it ends with this.
pub(crate) struct Watcher {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ThreadUsage {
    /// On the thread that is watched; the other half starts the watcher, from a thread without priority.
    pub(crate) fn new() -> (Self, impl FnOnce() -> Option<Watcher> + Send) {
        let pulse = Arc::new(Pulse::default());
        let own = Baseline { counters: own_counters(), ..Baseline::default() };
        let (writer, baselines) = exchange(own);
        let (watched, thread) = (pulse.clone(), this_thread());
        let witness = ThreadUsage { pulse, baselines, own, phase: 0, sleeps: 0, awake: 0 };
        (witness, move || Watcher::start(thread, watched, writer))
    }

    /// The thread was awake so long and now sleeps.
    pub(crate) fn sleeps(&mut self, awake: Nanoseconds) {
        self.sleeps += 1;
        self.awake += awake;
        self.phase += 1;
        self.pulse.sleeps.store(self.sleeps, Ordering::Relaxed);
        self.pulse.awake.store(self.awake, Ordering::Relaxed);
        self.pulse.phase.store(self.phase, Ordering::Release);
    }

    /// The thread is awake again.
    pub(crate) fn wakes(&mut self) {
        self.phase += 1;
        // What the watcher read before it saw this is older.
        self.pulse.phase.store(self.phase, Ordering::Release);
    }

    /// In a cycle that has run for so long and missed its deadline: what the system has counted since the baseline.
    pub(crate) fn evidence(&mut self, ran: Nanoseconds) -> Evidence {
        self.baselines.take(self.sleeps);
        let newest = *self.baselines.page();
        let from = if newest.sleeps >= self.own.sleeps { newest } else { self.own };
        let counters = own_counters();
        let sleeps = self.sleeps - from.sleeps;
        // Of the CPU time since, the cycles before this one and the sleeps had their share.
        let before = self.awake.saturating_sub(from.awake) + sleeps * from.overhead;
        let cpu = (counters.cpu - from.counters.cpu).saturating_sub(before);
        // Awake until now: the next window begins here, with this cycle's time not to be counted again.
        self.own = Baseline { counters, sleeps: self.sleeps, awake: self.awake + ran, overhead: newest.overhead };
        let since = |count: fn(&Counters) -> u64| short(count(&counters).saturating_sub(count(&from.counters)));
        Evidence {
            cycles: short(sleeps),
            minor_faults: since(|counters| counters.minor_faults),
            major_faults: since(|counters| counters.major_faults),
            preemptions: since(|counters| counters.preemptions),
            // Each sleep is at most one.
            waits: since(|counters| counters.waits).saturating_sub(short(sleeps)),
            off_cpu: short(ran.saturating_sub(cpu)),
        }
    }
}

impl Watcher {
    /// `None` where the system shows no counters of a thread.
    fn start(watched: ThreadId, pulse: Arc<Pulse>, mut writer: Writer<Baseline>) -> Option<Self> {
        let other = OtherThread::open(watched).ok()?;
        let stop = Arc::new(AtomicBool::new(false));
        let flag = stop.clone();
        let work = move || {
            let mut last = None;
            while !flag.load(Ordering::Relaxed) {
                if let Some(baseline) = (0..TRIES).find_map(|_| pulse.baseline(&other, last)) {
                    writer.publish(baseline);
                    last = Some(baseline);
                }
                thread::sleep(INTERVAL);
            }
        };
        let thread = thread::Builder::new().name("stickslip-watch".into()).spawn(work).ok()?;
        Some(Watcher { stop, thread: Some(thread) })
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say.
            let _ = thread.join();
        }
    }
}

impl Pulse {
    /// The counters, if the thread slept from before they were read until after.
    fn baseline(&self, other: &OtherThread, last: Option<Baseline>) -> Option<Baseline> {
        let phase = self.phase.load(Ordering::Acquire);
        let (sleeps, awake) = (self.sleeps.load(Ordering::Relaxed), self.awake.load(Ordering::Relaxed));
        let counters = other.counters().ok()?;
        std::sync::atomic::fence(Ordering::Acquire);
        if phase.is_multiple_of(2) || self.phase.load(Ordering::Relaxed) != phase {
            return None;
        }
        let overhead = last.filter(|last| sleeps > last.sleeps).map_or(0, |last| {
            let used = (counters.cpu - last.counters.cpu).saturating_sub(awake - last.awake);
            used / (sleeps - last.sleeps)
        });
        Some(Baseline { counters, sleeps, awake, overhead })
    }
}
