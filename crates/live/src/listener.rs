//! The listener thread: it takes every cycle from the tap for status, captures and recording.

use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use stickslip_software::supervise::{Fault, SafetyState};

use super::Shared;
use super::fault::FaultStatus;
use super::health::Lost;
use super::protocol::MarkKind;
use stickslip_bench::run::Signals;
use stickslip_bench::tap::Stream;

/// Polling interval.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// Runs until the bench has ended.
pub(super) fn run(mut stream: Stream, shared: &Arc<Shared>) {
    let mut faults = Faults::default();
    let mut saving: Option<JoinHandle<()>> = None;
    loop {
        // Read before the cycles are taken, so that the last ones are taken as well.
        let last = stream.is_closed();
        take(&mut stream, shared, &mut faults);
        // The disk must not delay the listener.
        if let Some(save) = save_fault(shared, &faults) {
            saving = Some(thread::spawn(save));
        }
        if shared.operation.is_silent() {
            shared.motion.abandon();
        }
        if last {
            shared.recorder.end(&shared.runs);
            shared.acquisition.end();
            // A panic was reported on its thread.
            let _ = saving.map(JoinHandle::join);
            return;
        }
        thread::sleep(POLL_INTERVAL);
    }
}

/// Takes all waiting cycles and changes.
fn take(stream: &mut Stream, shared: &Shared, faults: &mut Faults) {
    let Shared { acquisition, health, .. } = shared;
    let mut newest = None;
    let (mut held, mut lost) = (0, 0);
    // Locked for a short time when a recording starts or ends.
    let mut recordings = shared.recorder.recordings();
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
        if let Some(text) = faults.see(cycle, &sample.frame.safety) {
            acquisition.mark(cycle, MarkKind::Fault, text);
        }
        for recording in recordings.iter_mut() {
            let unwritten = recording.scribe.sample(&sample).min(1);
            lost += unwritten;
            if unwritten > 0 {
                health.lost(cycle, unwritten, Lost::Recording);
            }
        }
        newest = Some((sample, signals));
    }
    while let Some(changed) = stream.change() {
        recordings.iter_mut().for_each(|recording| recording.scribe.change(&changed));
    }
    drop(recordings);
    if let Some((sample, signals)) = newest {
        acquisition.update(&sample, signals, faults.present.clone(), [held, lost]);
    }
}

/// Saves the signals around a fault when they are complete.
fn save_fault(shared: &Arc<Shared>, faults: &Faults) -> Option<impl FnOnce() + Send + 'static> {
    let segment = shared.acquisition.captures().around_fault()?;
    let (code, cycle) = faults.seen.clone()?;
    let shared = shared.clone();
    Some(move || match shared.save_fault(segment, &code, cycle) {
        Ok(number) => shared.acquisition.fault_saved(cycle, number),
        Err(error) => shared.runs.report(error.to_string()),
    })
}

/// The faults of the cycles.
#[derive(Default)]
struct Faults {
    /// The present fault.
    present: Option<FaultStatus>,
    /// Whether the zero was known in the last cycle without a fault.
    zero_known: bool,
    last: Option<Fault>,
    /// Code and first cycle of the last fault.
    seen: Option<(String, u64)>,
}

impl Faults {
    /// A cycle. Returns the text of a new fault.
    fn see(&mut self, cycle: u64, state: &SafetyState) -> Option<String> {
        let fault = state.fault();
        if fault.is_none() {
            match state {
                SafetyState::Homing => self.zero_known = false,
                SafetyState::Ready | SafetyState::Running => self.zero_known = true,
                // The torque may be off before or after homing.
                _ => {}
            }
        }
        if fault == self.last {
            return None;
        }
        self.last = fault;
        // The cause of an external fault may follow later.
        let since = self.present.as_ref().map_or(cycle, |present| present.cycle);
        let is_new = self.present.is_none();
        self.present = fault.map(|fault| FaultStatus::new(&fault, since, self.zero_known));
        if let Some(present) = &self.present {
            self.seen = Some((present.code.clone(), present.cycle));
        }
        if let Some(fault) = fault.filter(Fault::doubts_zero) {
            self.zero_known = false;
            return is_new.then(|| fault.to_string());
        }
        fault.filter(|_| is_new).map(|fault| fault.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::super::fault::FaultRecovery;
    use super::*;

    #[test]
    fn the_way_back_depends_on_the_zero_before_the_fault() {
        let mut faults = Faults::default();
        let fault = Fault::Overspeed { speed: 200.0, limit: 150.0 };
        let recovery = |faults: &Faults| faults.present.as_ref().map(|present| (present.recovery, present.cycle));
        assert_eq!(faults.see(0, &SafetyState::Homing), None);
        assert!(faults.see(1, &SafetyState::Stopping(Some(fault))).is_some_and(|text| text.contains("200")));
        assert_eq!(recovery(&faults), Some((FaultRecovery::Home, 1)), "homing was not complete");
        for (cycle, state) in [(2, SafetyState::Off), (3, SafetyState::Ready), (4, SafetyState::Running)] {
            assert_eq!(faults.see(cycle, &state), None);
        }
        faults.see(5, &SafetyState::Stopping(Some(fault)));
        assert_eq!(faults.see(6, &SafetyState::Fault(fault)), None, "the same fault");
        assert_eq!(recovery(&faults), Some((FaultRecovery::Arm, 5)));
        faults.see(7, &SafetyState::Off);
        faults.see(8, &SafetyState::Fault(Fault::TicksMissed { missed: 9 }));
        assert_eq!(recovery(&faults), Some((FaultRecovery::Home, 8)));
        faults.see(9, &SafetyState::Off);
        faults.see(10, &SafetyState::Fault(fault));
        assert_eq!(recovery(&faults), Some((FaultRecovery::Home, 10)), "the zero was lost by the fault before");
    }
}
