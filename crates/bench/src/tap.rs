//! What happens on a bench, for whoever records or watches it: every cycle, and every change with its cycle.
//!
//! Cycles come through a bounded ring. In lockstep the bench waits where it is full; by the clock it waits for nobody,
//! and what finds no room is counted. Changes are rare and never lost.

use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use rtrb::{Consumer, Producer, PushError, RingBuffer};
use stickslip_core::cycle::{Change, Frame};
use stickslip_core::supervise::Refusal;

use super::Injection;

/// Until the next look at a ring that is full.
const LOOK: Duration = Duration::from_micros(200);

/// A cycle, and what lies between it and the one before that came through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What happened in the cycle.
    pub frame: Frame,
    /// Cycles that found no room and are not known.
    pub lost: u64,
    /// Deadlines that were missed: voltages stood and nothing was computed. A virtual machine waited meanwhile; of one
    /// of steel the numbers of these cycles are passed over.
    pub held: u64,
    /// Ticks through which a virtual machine waited for a command that was late.
    pub waited: u64,
}

/// What changed between two cycles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Changed {
    /// The first cycle after it.
    pub cycle: u64,
    /// What it was.
    pub what: What,
}

/// What can change.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "changes are rare")]
pub enum What {
    /// The software, or the reason why it did not.
    Software(Change, Option<Refusal>),
    /// How far the linings of the friction wheel are pressed on, 0 … 1.
    Preload(f64),
    /// A fault was injected.
    Fault(Injection),
}

/// Both ends, with room for so many cycles.
pub fn tap(cycles: usize) -> (Tap, Stream) {
    let (producer, consumer) = RingBuffer::new(cycles);
    let (changes, changes_out) = mpsc::channel();
    let samples = Samples { ring: producer, lost: 0, held: 0, waited: 0 };
    (Tap { samples, changes }, Stream { samples: consumer, changes: changes_out })
}

/// The end at the bench.
#[derive(Debug)]
pub struct Tap {
    pub(super) samples: Samples,
    pub(super) changes: mpsc::Sender<Changed>,
}

/// Where cycles go in.
#[derive(Debug)]
pub(super) struct Samples {
    ring: Producer<Sample>,
    lost: u64,
    held: u64,
    waited: u64,
}

impl Samples {
    /// A cycle. Where there is no room it is counted.
    pub(super) fn offer(&mut self, frame: &Frame) {
        let Samples { ring, lost, held, waited } = self;
        match ring.push(Sample { frame: *frame, lost: *lost, held: *held, waited: *waited }) {
            Ok(()) => (*lost, *held, *waited) = (0, 0, 0),
            Err(PushError::Full(_)) => *lost += 1,
        }
    }

    /// A cycle. Where there is no room this waits, unless nobody is there any more.
    pub(super) fn wait(&mut self, frame: &Frame) {
        while self.ring.is_full() && !self.ring.is_abandoned() {
            thread::sleep(LOOK);
        }
        self.offer(frame);
    }

    /// A cycle was held.
    pub(super) fn hold(&mut self) {
        self.held += 1;
    }

    /// A tick passed without a cycle, since a command was late.
    pub(super) fn wait_for_command(&mut self) {
        self.waited += 1;
    }
}

/// The end of whoever records or watches.
#[derive(Debug)]
pub struct Stream {
    samples: Consumer<Sample>,
    changes: mpsc::Receiver<Changed>,
}

impl Stream {
    /// The next cycle that is there.
    pub fn sample(&mut self) -> Option<Sample> {
        self.samples.pop().ok()
    }

    /// The next change that is there; it may lie behind or ahead of the cycles that were taken.
    pub fn change(&mut self) -> Option<Changed> {
        self.changes.try_recv().ok()
    }

    /// Whether the bench is gone. What it left can still be taken.
    pub fn is_closed(&self) -> bool {
        self.samples.is_abandoned()
    }
}

#[cfg(test)]
mod tests {
    use stickslip_core::cycle::Software;
    use stickslip_core::tick::Measurement;

    use super::*;

    #[test]
    fn what_finds_no_room_is_counted_in_the_next_sample() {
        let (mut tap, mut stream) = tap(2);
        let mut software = Software::new(stickslip_core::cycle::Parameters::default(), 1e-3);
        let mut give = |tap: &mut Tap| tap.samples.offer(&software.step(Measurement::default(), None));
        (0..5).for_each(|_| give(&mut tap));
        tap.samples.hold();
        tap.samples.wait_for_command();
        tap.samples.wait_for_command();
        let known = |sample: Option<Sample>| sample.map(|s| (s.frame.cycle, s.lost, s.held, s.waited));
        assert_eq!(known(stream.sample()), Some((0, 0, 0, 0)));
        assert_eq!(known(stream.sample()), Some((1, 0, 0, 0)));
        assert_eq!(known(stream.sample()), None);
        give(&mut tap);
        give(&mut tap);
        assert_eq!(known(stream.sample()), Some((5, 3, 1, 2)), "2, 3 and 4 found no room");
        assert_eq!(known(stream.sample()), Some((6, 0, 0, 0)));
        assert!(!stream.is_closed());
        drop(tap);
        assert!(stream.is_closed());
    }
}
