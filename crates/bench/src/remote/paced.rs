//! A machine behind a link, by the clock: no tick waits for an answer that is late.
//!
//! The number of a frame is a tick: frame k holds the voltages of tick k, and its answer the readings at that tick's
//! end. It is sent at the tick's begin; the machine has the tick to answer, and [`GRACE`] of the next one. An answer that
//! has not come by then is missing: the bench holds what it wrote and goes on. Nothing is sent twice.
//!
//! A machine that does not know this bench any more, since it was started anew, is begun with again, at rest; one that
//! another bench has is left to it. Until then the bench asks every [`RETRY`].

use std::sync::Arc;
use std::time::{Duration, Instant};

use stickslip_core::cycle::Voltages;
use stickslip_core::tick::Measurement;

use super::frame::{Begin, LONGEST, Message, Preload, Reason};
use super::line::Line;
use super::traffic::{Event, Traffic};
use super::{Address, LinkFault, WAIT, asked, connected};
use crate::io::{Arrival, Io, check_preload};
use stickslip_base::Error;

/// Part of a tick in which its readings may still come.
const GRACE: f64 = 0.25;
/// From question to question to a machine that is gone, and to one that has not confirmed its linings [s].
const RETRY: f64 = 0.1;

/// The link to a machine that is paced by a bench's clock.
#[derive(Debug)]
pub struct Paced {
    line: Line,
    tick_time: f64,
    /// How long it waits at the begin of a tick.
    grace: Duration,
    /// Ticks from question to question.
    retry: u64,
    /// Numbers of the frame that was sent last, of the answer that came last, and of the begin that was answered.
    sent: u64,
    answered: u64,
    begun: u64,
    /// Whether the machine knows this bench.
    known: bool,
    /// Of a machine that does not: number of the last question, whether it may be begun with, number of that begin.
    asked: u64,
    free: bool,
    beginning: Option<u64>,
    preload: f64,
    /// Number under which the linings' preload was sent last, until the machine confirms it.
    pressing: Option<u64>,
    traffic: Arc<Traffic>,
}

impl Paced {
    /// Begins with the machine there; its readings at rest.
    ///
    /// # Errors
    /// Where it cannot be reached or refuses, as another tick.
    pub fn begin(address: &Address, tick_time: f64) -> Result<(Self, Measurement<f64>), LinkFault> {
        let mut line = connected(address)?;
        let (_, answer) = asked(&mut line, address, Message::TimingReport(Begin { tick_time }), 0, WAIT)?;
        let begun = match answer {
            Message::Begun(begun) => begun,
            Message::Refusal(refusal) => return Err(LinkFault::Refused { reason: refusal.to_string() }),
            other => {
                let reason = format!("its kind is {}", other.kind());
                return Err(LinkFault::FrameError { address: address.clone(), reason });
            }
        };
        let traffic = Arc::<Traffic>::default();
        traffic.count(Event::Begun);
        let paced = Paced {
            line,
            tick_time,
            grace: Duration::from_secs_f64(GRACE * tick_time),
            retry: (RETRY / tick_time).ceil() as u64,
            sent: 0,
            answered: 0,
            begun: 0,
            known: true,
            asked: 0,
            free: false,
            beginning: None,
            preload: begun.preload,
            pressing: None,
            traffic,
        };
        Ok((paced, begun.measurement))
    }

    /// Waits for each answer, where a test has no clock.
    #[cfg(test)]
    pub(crate) fn patient(mut self) -> Self {
        self.grace = WAIT;
        self
    }

    /// Sends a frame. What does not go through is missing when its answer is due.
    fn send(&mut self, message: Message, number: u64) {
        let _ = self.line.send(&message.datagram(number), None);
    }

    /// Takes an answer; what it says of the tick, if anything.
    fn take(&mut self, frame: &[u8]) -> Option<Arrival> {
        let Ok((number, message)) = Message::read(frame) else {
            self.traffic.count(Event::FrameError);
            return None;
        };
        match message {
            Message::Readings(readings) if self.known && number == self.sent && number > self.answered => {
                self.answered = number;
                self.traffic.count(Event::Answered);
                Some(Arrival::Readings(readings))
            }
            Message::Readings(_) if number <= self.sent => {
                self.traffic.count(if number == self.answered { Event::Doubled } else { Event::Late });
                None
            }
            Message::Begun(begun) if self.beginning == Some(number) => {
                (self.known, self.begun, self.answered, self.beginning) = (true, number, number, None);
                (self.preload, self.pressing) = (begun.preload, None);
                self.traffic.count(Event::Begun);
                Some(Arrival::Readings(begun.measurement))
            }
            Message::Pressed(pressed) => {
                if pressed.preload == self.preload {
                    self.pressing = None;
                }
                None
            }
            Message::Refusal(refusal) => self.refused(number, refusal.reason(), refusal.due),
            _ => {
                self.traffic.count(Event::FrameError);
                None
            }
        }
    }

    fn refused(&mut self, number: u64, reason: Option<Reason>, due: f64) -> Option<Arrival> {
        match reason {
            Some(Reason::FrameError) => self.traffic.count(Event::FrameError),
            Some(Reason::Preload) => self.pressing = None,
            // Frames that were under way when it began are not meant.
            _ if number <= self.begun || number > self.sent => {}
            reason => {
                // Nobody else has it: none has begun, or it has waited too long for this one.
                self.free = reason != Some(Reason::Stranger) || due == 0.0;
                return std::mem::take(&mut self.known).then_some(Arrival::Restarted);
            }
        }
        None
    }
}

impl Io for Paced {
    /// A tick and its answer at once, as by the clock but waited for.
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.start(self.sent, voltages)?;
        let within = std::mem::replace(&mut self.grace, WAIT);
        let arrival = self.finish();
        self.grace = within;
        match arrival {
            Arrival::Readings(readings) => Ok(readings),
            _ => Err(LinkFault::Refused { reason: format!("it does not answer to frame {}", self.sent) }),
        }
    }

    fn start(&mut self, tick: u64, voltages: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        // Number 0 was the begin.
        let number = tick + 1;
        if self.known {
            if self.pressing.is_some_and(|last| number - last >= self.retry) {
                self.pressing = Some(number);
                self.send(Message::Preload(Preload { preload: self.preload }), number);
            }
        } else if number - self.asked < self.retry {
            return Ok(None);
        } else {
            (self.asked, self.sent) = (number, number);
            if self.free {
                self.beginning = Some(number);
                self.send(Message::TimingReport(Begin { tick_time: self.tick_time }), number);
                return Ok(None);
            }
        }
        self.send(Message::Voltages(voltages), number);
        self.sent = number;
        Ok(None)
    }

    fn finish(&mut self) -> Arrival {
        let begin = Instant::now();
        let within = if self.known { self.grace } else { Duration::ZERO };
        let mut bytes = [0; LONGEST];
        loop {
            match self.line.look(&mut bytes) {
                Ok((length, _)) => {
                    if let Some(arrival) = self.take(&bytes[..length]) {
                        return arrival;
                    }
                }
                // Nothing there, or nobody: it may come yet.
                Err(_) => std::hint::spin_loop(),
            }
            if begin.elapsed() >= within {
                self.traffic.count(Event::Missing);
                return Arrival::Missing;
            }
        }
    }

    fn traffic(&self) -> Option<Arc<Traffic>> {
        Some(self.traffic.clone())
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        check_preload(preload)?;
        self.preload = preload;
        self.pressing = Some(self.sent + 1);
        self.send(Message::Preload(Preload { preload }), self.sent + 1);
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.preload
    }
}

impl Drop for Paced {
    fn drop(&mut self) {
        // A machine that has gone needs no farewell.
        self.send(Message::End, self.sent + 1);
    }
}

#[cfg(test)]
mod tests;
