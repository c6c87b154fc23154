//! Stream of all cycles and changes of a bench, for recorders and viewers.
//!
//! Cycles pass through a bounded ring. In lockstep the bench waits while it is full; in real time it never waits, and
//! lost cycles are counted. Changes are rare and never lost.

use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use rtrb::{Consumer, Producer, PushError, RingBuffer};
use stickslip_software::cycle::{Change, Frame};
use stickslip_software::supervise::Refusal;

use super::Injection;

/// Polling interval of a full ring.
const LOOK: Duration = Duration::from_micros(200);

/// A cycle, and the numbers of cycles missing since the previous one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Frame of the cycle.
    pub frame: Frame,
    /// Cycles lost because the ring was full.
    pub lost: u64,
    /// Missed deadlines: voltages were held and nothing was computed. A virtual machine paused meanwhile; with physical
    /// hardware the numbers of these cycles are skipped.
    pub held: u64,
    /// Ticks that a virtual machine waited for a late command.
    pub waited: u64,
}

/// A change between two cycles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Changed {
    /// First cycle after the change.
    pub cycle: u64,
    /// The change.
    pub what: ChangeKind,
}

/// Kind of a change.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "changes are rare")]
pub enum ChangeKind {
    /// Change of the software; with the reason if it was refused.
    Software(Change, Option<Refusal>),
    /// Preload of the friction wheel, 0 … 1.
    Preload(f64),
    /// Injected fault.
    Fault(Injection),
}

/// Both ends, with room for `cycles` cycles.
pub fn tap(cycles: usize) -> (Tap, Stream) {
    let (producer, consumer) = RingBuffer::new(cycles);
    let (changes, changes_out) = mpsc::channel();
    let samples = Samples { ring: producer, lost: 0, held: 0, waited: 0 };
    (Tap { samples, changes }, Stream { samples: consumer, changes: changes_out })
}

/// End of the bench.
#[derive(Debug)]
pub struct Tap {
    pub(super) samples: Samples,
    pub(super) changes: mpsc::Sender<Changed>,
}

/// Writing end of the ring of cycles.
#[derive(Debug)]
pub(super) struct Samples {
    ring: Producer<Sample>,
    lost: u64,
    held: u64,
    waited: u64,
}

impl Samples {
    /// Adds a cycle, or counts it as lost if the ring is full.
    pub(super) fn offer(&mut self, frame: &Frame) {
        let Samples { ring, lost, held, waited } = self;
        match ring.push(Sample { frame: *frame, lost: *lost, held: *held, waited: *waited }) {
            Ok(()) => (*lost, *held, *waited) = (0, 0, 0),
            Err(PushError::Full(_)) => *lost += 1,
        }
    }

    /// Adds a cycle. Waits while the ring is full, unless the other end is closed.
    pub(super) fn wait(&mut self, frame: &Frame) {
        while self.ring.is_full() && !self.ring.is_abandoned() {
            thread::sleep(LOOK);
        }
        self.offer(frame);
    }

    /// Counts a held cycle.
    pub(super) fn hold(&mut self) {
        self.held += 1;
    }

    /// Counts a tick without a cycle, due to a late command.
    pub(super) fn wait_for_command(&mut self) {
        self.waited += 1;
    }
}

/// End of the recorder or viewer.
#[derive(Debug)]
pub struct Stream {
    samples: Consumer<Sample>,
    changes: mpsc::Receiver<Changed>,
}

impl Stream {
    /// The next available cycle.
    pub fn sample(&mut self) -> Option<Sample> {
        self.samples.pop().ok()
    }

    /// The next available change; its cycle may be before or after the cycles taken so far.
    pub fn change(&mut self) -> Option<Changed> {
        self.changes.try_recv().ok()
    }

    /// Whether the bench has ended. Remaining cycles and changes can still be taken.
    pub fn is_closed(&self) -> bool {
        self.samples.is_abandoned()
    }
}

#[cfg(test)]
mod tests {
    use stickslip_core::tick::Measurement;
    use stickslip_software::cycle::Software;

    use super::*;

    #[test]
    fn lost_cycles_are_counted_in_the_next_sample() {
        let (mut tap, mut stream) = tap(2);
        let mut software = Software::new(stickslip_software::cycle::Parameters::default(), 1e-3);
        let mut offer = |tap: &mut Tap| tap.samples.offer(&software.step(Measurement::default(), None));
        (0..5).for_each(|_| offer(&mut tap));
        tap.samples.hold();
        tap.samples.wait_for_command();
        tap.samples.wait_for_command();
        let numbers = |sample: Option<Sample>| sample.map(|s| (s.frame.cycle, s.lost, s.held, s.waited));
        assert_eq!(numbers(stream.sample()), Some((0, 0, 0, 0)));
        assert_eq!(numbers(stream.sample()), Some((1, 0, 0, 0)));
        assert_eq!(numbers(stream.sample()), None);
        offer(&mut tap);
        offer(&mut tap);
        assert_eq!(numbers(stream.sample()), Some((5, 3, 1, 2)), "2, 3 and 4 were lost");
        assert_eq!(numbers(stream.sample()), Some((6, 0, 0, 0)));
        assert!(!stream.is_closed());
        drop(tap);
        assert!(stream.is_closed());
    }
}
