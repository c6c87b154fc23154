//! The listener thread: it takes every cycle from the tap for status, captures and recording.

use std::thread;
use std::time::Duration;

use super::Shared;
use super::health::Lost;
use super::protocol::MarkKind;
use stickslip_bench::run::Signals;
use stickslip_bench::tap::Stream;

/// Polling interval.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// Runs until the bench has ended.
pub(super) fn run(mut stream: Stream, shared: &Shared) {
    let mut faulty = false;
    loop {
        // Read before the cycles are taken, so that the last ones are taken as well.
        let last = stream.is_closed();
        take(&mut stream, shared, &mut faulty);
        if shared.operation.is_silent() {
            shared.motion.abandon();
        }
        if last {
            shared.recorder.end(&shared.runs);
            shared.acquisition.end();
            return;
        }
        thread::sleep(POLL_INTERVAL);
    }
}

/// Takes all waiting cycles and changes.
fn take(stream: &mut Stream, shared: &Shared, faulty: &mut bool) {
    let Shared { acquisition, health, .. } = shared;
    let mut newest = None;
    let (mut held, mut lost) = (0, 0);
    // Locked for a short time by a client that starts or ends a recording.
    let mut recording = shared.recorder.recording();
    while let Some(sample) = stream.sample() {
        let signals = Signals::of(&sample.frame);
        let cycle = sample.frame.cycle;
        (held, lost) = (held + sample.held + sample.waited, lost + sample.lost);
        if sample.waited > 0 {
            health.lost(cycle, sample.waited, Lost::Waiting);
        }
        if sample.lost > 0 {
            health.lost(cycle, sample.lost, Lost::Watching);
        }
        // Cannot fail: cycle numbers increase, and all rows have the same width.
        drop(acquisition.captures().stream.push(cycle, &signals.row()));
        let fault = sample.frame.safety.fault();
        if let Some(fault) = fault.filter(|_| !*faulty) {
            acquisition.mark(cycle, MarkKind::Fault, fault.to_string());
        }
        *faulty = fault.is_some();
        if let Some(recording) = &mut *recording {
            let unwritten = recording.scribe.sample(&sample).min(1);
            lost += unwritten;
            if unwritten > 0 {
                health.lost(cycle, unwritten, Lost::Recording);
            }
        }
        newest = Some((sample, signals));
    }
    while let Some(changed) = stream.change() {
        if let Some(recording) = &mut *recording {
            recording.scribe.change(changed);
        }
    }
    drop(recording);
    if let Some((sample, signals)) = newest {
        acquisition.update(&sample, signals, held, lost);
    }
}
