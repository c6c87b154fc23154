//! The thread behind the tap: it takes every cycle, tells how the bench is, and feeds who captures and records.

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use super::losses::Lost;
use super::protocol::MarkKind;
use super::record::Recording;
use super::{Shared, lock};
use stickslip_bench::run::{Signals, state_name};
use stickslip_bench::tap::Stream;

/// From look to look.
const LOOK: Duration = Duration::from_millis(2);

/// What is known of the newest cycle.
#[derive(Clone, Debug, Default)]
pub(super) struct Newest {
    pub(super) cycle: u64,
    pub(super) signals: Signals<f64>,
    pub(super) state: &'static str,
    pub(super) fault: Option<String>,
    pub(super) held: u64,
    pub(super) lost: u64,
}

/// Runs until the bench is gone.
pub(super) fn run(mut stream: Stream, shared: &Arc<Shared>) {
    let mut faulty = false;
    loop {
        // Asked before the cycles are taken: those that came last are not left behind.
        let last = stream.is_closed();
        let mut newest = None;
        let mut gaps = (0, 0);
        // Whoever begins or ends a recording holds it for a moment.
        let mut recorder = lock(&shared.recorder);
        while let Some(sample) = stream.sample() {
            let signals = Signals::of(&sample.frame);
            gaps = (gaps.0 + sample.held + sample.waited, gaps.1 + sample.lost);
            if sample.waited > 0 {
                lock(&shared.waits).push(sample.frame.cycle, sample.waited, Lost::Waiting);
            }
            if sample.lost > 0 {
                lock(&shared.losses).push(sample.frame.cycle, sample.lost, Lost::Watching);
            }
            // Cycles only go up, and all rows are alike.
            drop(lock(&shared.captures).stream.push(sample.frame.cycle, &signals.row()));
            let fault = sample.frame.safety.fault();
            if let Some(fault) = fault.filter(|_| !faulty) {
                shared.mark(sample.frame.cycle, MarkKind::Fault, fault.to_string());
            }
            faulty = fault.is_some();
            newest = Some((sample.frame, signals));
            if let Some(Recording { scribe, .. }) = &mut *recorder {
                let lost = scribe.sample(&sample).min(1);
                gaps.1 += lost;
                if lost > 0 {
                    lock(&shared.losses).push(sample.frame.cycle, lost, Lost::Recording);
                }
            }
        }
        while let Some(changed) = stream.change() {
            if let Some(Recording { scribe, .. }) = &mut *recorder {
                scribe.change(changed);
            }
        }
        drop(recorder);
        if let Some((frame, signals)) = newest {
            let fault = frame.safety.fault().map(|fault| fault.to_string());
            let mut known = lock(&shared.newest);
            *known = Newest {
                cycle: frame.cycle,
                signals,
                state: state_name(&frame.safety),
                fault,
                held: known.held + gaps.0,
                lost: known.lost + gaps.1,
            };
        }
        shared.watch_operator();
        if last {
            let recording = lock(&shared.recorder).take();
            if let Some(recording) = recording {
                // Told in the status.
                let _ = recording.finish(shared);
            }
            lock(&shared.newest).state = "ended";
            return;
        }
        thread::sleep(LOOK);
    }
}
