//! Changes that wait for no command: they enter with the next cycle, whatever an experiment has handed over before.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_core::cycle::Change;

use super::cycle::Answer;
use crate::tap::{Changed, What};
use stickslip_base::Error;

/// How long the loop may take to answer [s]: a loop that lives does within a few cycles.
const PATIENCE: Duration = Duration::from_secs(2);
/// From look to look.
const LOOK: Duration = Duration::from_micros(100);

/// The way past the commands: for stops of the operator, and parameters that are tuned while the axis moves.
#[derive(Debug)]
pub struct ImmediateChanges {
    changes: Producer<Change>,
    answers: Consumer<Answer>,
    told: Option<mpsc::Sender<Changed>>,
}

/// Its ends: for whoever asks, and for the loop.
pub(super) fn urgent(told: Option<mpsc::Sender<Changed>>) -> (ImmediateChanges, Consumer<Change>, Producer<Answer>) {
    let (changes, changes_out) = RingBuffer::new(1);
    let (answers_in, answers) = RingBuffer::new(1);
    (ImmediateChanges { changes, answers, told }, changes_out, answers_in)
}

impl ImmediateChanges {
    /// Makes a change with the next cycle: the number of that cycle.
    ///
    /// # Errors
    /// [`Error::Refused`]; [`Error::BenchFault`] where the loop does not run any more.
    pub fn change(&mut self, change: Change) -> Result<u64, Error> {
        let gone = || Error::BenchFault {
            cycle: 0,
            reason: "the real-time loop does not answer; start the bench anew".into(),
        };
        // The answer to a change that was given up.
        while self.answers.pop().is_ok() {}
        self.changes.push(change).map_err(|_| gone())?;
        let begin = Instant::now();
        loop {
            if let Ok((cycle, refused)) = self.answers.pop() {
                if let Some(told) = &self.told {
                    // Who does not listen any more misses nothing.
                    let _ = told.send(Changed { cycle, what: What::Software(change, refused) });
                }
                return refused.map_or(Ok(cycle), |refusal| Err(refusal.into()));
            }
            if self.changes.is_abandoned() || begin.elapsed() > PATIENCE {
                return Err(gone());
            }
            thread::sleep(LOOK);
        }
    }
}
