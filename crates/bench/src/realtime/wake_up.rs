//! Lateness of an executive with empty cycles.

use std::thread;
use std::time::{Duration, Instant};

use stickslip_rt::{
    Block, Cycle, Granted, Histograms, Lap, MonotonicClock, Next, OverrunPolicy, Plan, Running, Summary, ThreadSettings,
};

use crate::BenchError;
use stickslip_base::{Error, Watch};

/// Polling interval of a running measurement.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Lateness of an executive.
#[derive(Clone, Debug)]
pub struct WakeUp {
    /// Time before each deadline for which it spun.
    pub spin: Duration,
    /// Distribution of the lateness.
    pub histograms: Histograms,
    /// Settings granted to its thread.
    pub granted: Granted,
    /// Summary of the executive.
    pub summary: Summary,
}

struct EmptyCycle;

impl Cycle for EmptyCycle {
    fn blocks(&self) -> &[Block] {
        &[]
    }

    fn run(&mut self, _: u64, _: &mut Lap) -> Next {
        Next::Continue
    }

    fn hold(&mut self, _: u64) {}

    fn end(&mut self) {}
}

/// Runs empty cycles at a rate [Hz] for some time, after a warm-up of 0.1 s that is not counted.
///
/// # Errors
/// [`BenchError::RealTime`] if the period is too short or long, or the system provides no thread; [`Error::Cancelled`].
pub fn measure_wake_up(
    rate: f64,
    time: Duration,
    spin: Duration,
    thread_settings: ThreadSettings,
    stage: &str,
    watch: &Watch,
) -> Result<WakeUp, Error> {
    let period = Duration::try_from_secs_f64(1.0 / rate).unwrap_or_default();
    let cycles = (rate * time.as_secs_f64()).max(1.0) as u64;
    let overrun = OverrunPolicy { stop_after: None, ..OverrunPolicy::default() };
    let plan = Plan { warm_up: (0.1 * rate) as u64, cycles: Some(cycles), overrun, ..Plan::new(period) };
    let (running, mut timings) =
        Running::start(plan, thread_settings, MonotonicClock { spin }, EmptyCycle).map_err(BenchError::RealTime)?;
    let mut histograms = Histograms::new(timings.blocks());
    follow(&running, time, stage, watch, || histograms.take(&mut timings))?;
    let granted = running.granted().clone();
    let summary = running.join();
    histograms.take(&mut timings);
    Ok(WakeUp { spin, histograms, granted, summary })
}

/// Reports the progress of a measurement until it ends, and takes its records. If cancelled, returns; dropping `running`
/// then stops the measurement.
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
        thread::sleep(POLL_INTERVAL);
    }
    watch.stage(stage, 1.0)
}
