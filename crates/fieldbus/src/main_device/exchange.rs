//! The thread of the frames, from the scan to the end of the bench.
//!
//! Without outputs of the bench it continues to send frames, so that the watchdogs of the drives do not act: with the
//! last torques for [`HELD`] frames, then with zero. A device that was switched off and on is brought to OP again while
//! the drives are off.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use ethercrab::MainDevice;
use rtrb::{Consumer, Producer};
use stickslip_bench::segment::{Segment, SegmentOutlet};

use super::bring_up::{Plan, prepare};
use super::cyclic::{Analogue, Answer, Cyclic, Outputs, Refused};
use super::error::MainDeviceError;
use super::machine::main_device;
use super::steering::Steering;
use super::wire::Wire;
use crate::socket::{Socket, raise_priority};

/// Frames without outputs after which the torques are zero.
const HELD: u32 = 10;
/// Priority of the thread, below that of the tick.
const PRIORITY: u8 = 79;

/// Pause between attempts to bring devices to OP again.
const PAUSE: Duration = Duration::from_millis(200);

/// What the thread works with.
pub(crate) struct Exchange {
    pub(crate) plan: Plan,
    pub(crate) analogue: Option<Analogue>,
    pub(crate) steering: Steering,
    pub(crate) outputs: Consumer<Outputs>,
    pub(crate) answers: Producer<Answer>,
}

/// The first answer and the segment, or the reason why there are none.
pub(crate) type Started = Result<(Answer, Segment), MainDeviceError>;

/// End of the cyclic frames.
enum End {
    /// The bench has ended.
    Bench,
    /// A device has lost its configuration.
    Device,
}

impl Exchange {
    /// Runs until the bench ends.
    pub(crate) fn run(mut self, socket: Socket, started: &mpsc::Sender<Started>) {
        // Without the permission it is an ordinary thread, as the tick is then.
        let _ = raise_priority(PRIORITY);
        main_device(socket, |main, wire| {
            let mut cyclic = match self.begin(main, wire) {
                Ok(cyclic) => cyclic,
                Err(refused) => return drop(started.send(Err(refused.0))),
            };
            let first = (0..20).map(|_| cyclic.exchange(Outputs::default()));
            let first = first.filter(|answer| matches!(answer, Answer::Signals(..))).last();
            let (devices, counter) = cyclic.segment();
            let (segment, mut viewers) = Segment::new(devices, counter, self.plan.period.as_secs_f64());
            if started.send(Ok((first.unwrap_or(Answer::Lost), segment))).is_err() || first.is_none() {
                return cyclic.shut_down();
            }
            while let End::Device = self.cycles(&mut cyclic, &mut viewers) {
                let mut wire = cyclic.into_wire();
                cyclic = loop {
                    match self.begin(main, wire) {
                        Ok(cyclic) => break cyclic,
                        Err(refused) if !self.outputs.is_abandoned() => {
                            wire = refused.1;
                            thread::sleep(PAUSE);
                        }
                        Err(_) => return,
                    }
                };
                self.steering.restart();
            }
            cyclic.shut_down();
        });
    }

    /// Brings the devices to OP; an error returns the wire.
    fn begin<'a>(&self, main: &'a MainDevice<'a>, mut wire: Wire<'a>) -> Result<Cyclic<'a>, Refused<'a>> {
        match wire.run(prepare(main, &self.plan)) {
            Ok((group, drives)) => Cyclic::start(main, wire, group, drives, self.analogue, self.plan.period),
            Err(error) => Err(Box::new((error, wire))),
        }
    }

    /// Exchanges frames.
    fn cycles(&mut self, cyclic: &mut Cyclic<'_>, viewers: &mut SegmentOutlet) -> End {
        let period = self.plan.period;
        let (mut last, mut silent, mut has_begun) = (Outputs::default(), 0_u32, false);
        while let Some(next) = wait(&mut self.outputs, if has_begun { 2 * period } else { period }) {
            let is_new = next.is_some();
            (last, silent) = next.map_or((last, silent.saturating_add(1)), |next| (next, 0));
            has_begun |= is_new;
            if silent > HELD {
                last.torques = [0.0; 2];
            }
            let answer = cyclic.exchange(last);
            cyclic.record.offset = match (is_new, cyclic.clock) {
                (true, Some(time)) => i32::try_from(self.steering.follow(time)).ok(),
                _ => None,
            };
            if has_begun {
                viewers.push(cyclic.record);
                // After missed ticks the newest readings count. A full ring means that the tick has stopped.
                let _ = self.answers.push(answer);
            }
            if !last.on && cyclic.has_restarted() {
                return End::Device;
            }
        }
        End::Bench
    }
}

/// The newest outputs; `Some(None)` after this time without any, `None` at the end of the bench.
fn wait(outputs: &mut Consumer<Outputs>, within: Duration) -> Option<Option<Outputs>> {
    let start = Instant::now();
    loop {
        let mut newest = None;
        while let Ok(next) = outputs.pop() {
            newest = Some(next);
        }
        if newest.is_some() {
            return Some(newest);
        }
        if outputs.is_abandoned() {
            return None;
        }
        match within.checked_sub(start.elapsed()) {
            Some(left) if !left.is_zero() => thread::park_timeout(left),
            _ => return Some(None),
        }
    }
}
