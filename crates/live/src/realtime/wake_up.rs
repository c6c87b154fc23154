//! How late an executive wakes up that has nothing to do.

use std::thread;
use std::time::{Duration, Instant};

use stickslip_rt::{
    Block, Cycle, Granted, Histograms, Lap, MonotonicClock, Next, OverrunPolicy, Plan, Running, Summary, ThreadSettings,
};

use stickslip_base::{Error, Watch};
use stickslip_bench::BenchError;

/// From look to look at a running measurement.
const LOOK: Duration = Duration::from_millis(20);

/// How late an executive woke up.
#[derive(Clone, Debug)]
pub struct WakeUp {
    /// So long before each deadline it woke up and spun.
    pub spin: Duration,
    /// The distribution.
    pub histograms: Histograms,
    /// What its thread was granted.
    pub granted: Granted,
    /// What the executive says.
    pub summary: Summary,
}

struct Nothing;

impl Cycle for Nothing {
    fn blocks(&self) -> &[Block] {
        &[]
    }

    fn run(&mut self, _: u64, _: &mut Lap) -> Next {
        Next::Continue
    }

    fn hold(&mut self, _: u64) {}

    fn end(&mut self) {}
}

/// Runs an empty cycle so often a second [Hz] and for so long; a tenth of a second before that is not counted.
///
/// # Errors
/// [`BenchError::RealTime`] where the period is too short or long, or the system has no thread; [`Error::Cancelled`].
pub fn measure_wake_up(
    rate: f64,
    time: Duration,
    spin: Duration,
    wishes: ThreadSettings,
    stage: &str,
    watch: &Watch,
) -> Result<WakeUp, Error> {
    let period = Duration::try_from_secs_f64(1.0 / rate).unwrap_or_default();
    let cycles = (rate * time.as_secs_f64()).max(1.0) as u64;
    let overrun = OverrunPolicy { stop_after: None, ..OverrunPolicy::default() };
    let plan = Plan { warm_up: (0.1 * rate) as u64, cycles: Some(cycles), overrun, ..Plan::new(period) };
    let (running, mut timings) =
        Running::start(plan, wishes, MonotonicClock { spin }, Nothing).map_err(BenchError::RealTime)?;
    let mut histograms = Histograms::new(timings.blocks());
    follow(&running, time, stage, watch, || histograms.take(&mut timings))?;
    let granted = running.granted().clone();
    let summary = running.join();
    histograms.take(&mut timings);
    Ok(WakeUp { spin, histograms, granted, summary })
}

/// Tells how far it is until it ends by itself, and takes its records. Cancelled, it is stopped with its holder.
pub(super) fn follow(
    running: &Running,
    time: Duration,
    stage: &str,
    watch: &Watch,
    mut take: impl FnMut(),
) -> Result<(), Error> {
    let begin = Instant::now();
    while !running.has_ended() {
        watch.stage(stage, begin.elapsed().as_secs_f64() / time.as_secs_f64())?;
        take();
        thread::sleep(LOOK);
    }
    watch.stage(stage, 1.0)
}
