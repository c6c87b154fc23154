//! A baseline of the system's counters shortly before every overrun, without a system call in a cycle that meets its
//! deadline.
//!
//! Only recent page faults and preemptions explain an overrun. An ordinary thread therefore reads the counters of the
//! executive's thread fifty times a second, while that thread sleeps between two cycles, and publishes them as a page.
//! A cycle that has missed its deadline reads its own counters and computes the difference.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::cause::Evidence;
use crate::clock::Nanoseconds;
use crate::cycle::short;
use crate::pages::{Reader, Writer, exchange};
use crate::system::{Counters, OtherThread, ThreadId, own_counters, this_thread};

/// Interval between baselines.
const INTERVAL: Duration = Duration::from_millis(20);
/// Number of attempts to read within one sleep.
const TRIES: usize = 10;

/// The counters at an instant, with sleeps and times until then.
#[derive(Clone, Copy, Debug, Default)]
struct Baseline {
    counters: Counters,
    /// Number of sleeps.
    sleeps: u64,
    /// Total time awake [ns].
    awake: u64,
    /// CPU time of a sleep and its wake-up [ns].
    overhead: u64,
}

/// State of the executive's thread for the watcher: a few stores per cycle.
#[derive(Default)]
struct Pulse {
    /// Odd while it sleeps.
    phase: AtomicU64,
    sleeps: AtomicU64,
    awake: AtomicU64,
}

/// Resource usage of the executive's thread; queries the system only in an overrun.
pub(crate) struct ThreadUsage {
    pulse: Arc<Pulse>,
    baselines: Reader<Baseline>,
    /// Baseline at the end of the last overrun, if newer.
    own: Baseline,
    phase: u64,
    sleeps: u64,
    awake: u64,
}

/// The thread that takes the baselines, ended when this is dropped.
pub(crate) struct Watcher {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ThreadUsage {
    /// For the calling thread. The second value starts the watcher, from a thread without priority.
    pub(crate) fn new() -> (Self, impl FnOnce() -> Option<Watcher> + Send) {
        let pulse = Arc::new(Pulse::default());
        let own = Baseline { counters: own_counters(), ..Baseline::default() };
        let (writer, baselines) = exchange(own);
        let (watched, thread) = (pulse.clone(), this_thread());
        let usage = ThreadUsage { pulse, baselines, own, phase: 0, sleeps: 0, awake: 0 };
        (usage, move || Watcher::start(thread, watched, writer))
    }

    /// The thread was awake for `awake` and now sleeps.
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
        // Values that the watcher read before this store are older.
        self.pulse.phase.store(self.phase, Ordering::Release);
    }

    /// In a cycle that ran for `ran` and missed its deadline: differences of the counters since the baseline.
    pub(crate) fn evidence(&mut self, ran: Nanoseconds) -> Evidence {
        self.baselines.take(self.sleeps);
        let newest = *self.baselines.page();
        let from = if newest.sleeps >= self.own.sleeps { newest } else { self.own };
        let counters = own_counters();
        let sleeps = self.sleeps - from.sleeps;
        // Share of the earlier cycles and the sleeps in the CPU time since the baseline.
        let before = self.awake.saturating_sub(from.awake) + sleeps * from.overhead;
        let cpu = (counters.cpu - from.counters.cpu).saturating_sub(before);
        // The next window starts here and excludes the time of this cycle.
        self.own = Baseline { counters, sleeps: self.sleeps, awake: self.awake + ran, overhead: newest.overhead };
        let since = |count: fn(&Counters) -> u64| short(count(&counters).saturating_sub(count(&from.counters)));
        Evidence {
            cycles: short(sleeps),
            minor_faults: since(|counters| counters.minor_faults),
            major_faults: since(|counters| counters.major_faults),
            preemptions: since(|counters| counters.preemptions),
            // Each sleep counts as at most one wait.
            waits: since(|counters| counters.waits).saturating_sub(short(sleeps)),
            off_cpu: short(ran.saturating_sub(cpu)),
        }
    }
}

impl Watcher {
    /// `None` if the system has no counters of a thread.
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
            // It returns no result.
            let _ = thread.join();
        }
    }
}

impl Pulse {
    /// The counters, if the thread slept during the whole read.
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
