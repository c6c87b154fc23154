//! Immediate changes: they become active with the next cycle, before all queued commands of an experiment.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_software::cycle::Change;

use super::cycle::Answer;
use crate::tap::{ChangeKind, Changed};
use stickslip_base::Error;

/// Time-out for the answer of the loop. A running loop answers within a few cycles.
const PATIENCE: Duration = Duration::from_secs(2);
/// Polling interval.
const LOOK: Duration = Duration::from_micros(100);

/// Changes that bypass the queued commands: stops of the operator, and tuning while the axis moves.
#[derive(Debug)]
pub struct ImmediateChanges {
    changes: Producer<Change>,
    answers: Consumer<Answer>,
    listener: Option<mpsc::Sender<Changed>>,
}

/// Both ends: for the caller and for the loop.
pub(super) fn immediate_changes(
    listener: Option<mpsc::Sender<Changed>>,
) -> (ImmediateChanges, Consumer<Change>, Producer<Answer>) {
    let (changes, changes_out) = RingBuffer::new(1);
    let (answers_in, answers) = RingBuffer::new(1);
    (ImmediateChanges { changes, answers, listener }, changes_out, answers_in)
}

impl ImmediateChanges {
    /// Makes a change with the next cycle and returns the number of that cycle.
    ///
    /// # Errors
    /// [`Error::Refused`]; [`Error::BenchFault`] if the loop has ended.
    pub fn change(&mut self, change: Change) -> Result<u64, Error> {
        let ended =
            || Error::BenchFault { cycle: 0, reason: "the real-time loop does not answer; restart the bench".into() };
        // Removes the answer to a change that timed out.
        while self.answers.pop().is_ok() {}
        self.changes.push(change).map_err(|_| ended())?;
        let start = Instant::now();
        loop {
            if let Ok((cycle, refused)) = self.answers.pop() {
                if let Some(listener) = &self.listener {
                    // The listener may have ended.
                    let _ = listener.send(Changed { cycle, what: ChangeKind::Software(change, refused) });
                }
                return refused.map_or(Ok(cycle), |refusal| Err(refusal.into()));
            }
            if self.changes.is_abandoned() || start.elapsed() > PATIENCE {
                return Err(ended());
            }
            thread::sleep(LOOK);
        }
    }
}
