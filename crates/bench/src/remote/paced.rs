//! A machine behind a link, in real time: no tick waits for a late answer.
//!
//! The number of a frame is that of a tick: frame k has the voltages of tick k, and its answer the readings at the end
//! of that tick. It is sent at the start of the tick; the machine has this tick and [`GRACE`] of the next one to
//! answer. After that the answer is missing: the bench holds its voltages and continues. Nothing is sent twice.
//!
//! A restarted machine does not know this bench; the bench starts it again, at rest. A machine used by another bench is
//! not disturbed. Until then the bench sends a request every [`RETRY`].

use std::sync::Arc;
use std::time::{Duration, Instant};

use stickslip_core::tick::Measurement;
use stickslip_software::cycle::Voltages;

use super::frame::{Begin, LONGEST, Message, Preload, Reason};
use super::line::Line;
use super::traffic::{Event, Traffic};
use super::{Address, LinkFault, WAIT, connected, exchange};
use crate::io::{Arrival, Io, check_preload};
use stickslip_base::Error;

/// Fraction of the next tick in which readings are still accepted.
const GRACE: f64 = 0.25;
/// Interval of requests to an unavailable machine, and to one that has not confirmed its preload [s].
const RETRY: f64 = 0.1;

/// Link to a machine whose ticks follow the clock of the bench.
#[derive(Debug)]
pub struct Paced {
    line: Line,
    tick_time: f64,
    /// Waiting time at the start of a tick.
    grace: Duration,
    /// Ticks between requests.
    retry: u64,
    /// Numbers of the last sent frame, the last received answer, and the last answered start.
    sent: u64,
    answered: u64,
    started: u64,
    /// Whether the machine recognizes this bench.
    recognized: bool,
    /// If it does not: number of the last request, whether it can be started, number of that start.
    requested: u64,
    free: bool,
    beginning: Option<u64>,
    preload: f64,
    /// Number of the frame with the last preload, until the machine confirms it.
    pressing: Option<u64>,
    traffic: Arc<Traffic>,
}

impl Paced {
    /// Starts the machine; returns its readings at rest.
    ///
    /// # Errors
    /// The machine cannot be reached or refuses, for example because of another tick time.
    pub fn begin(address: &Address, tick_time: f64) -> Result<(Self, Measurement<f64>), LinkFault> {
        let mut line = connected(address)?;
        let (_, answer) = exchange(&mut line, address, Message::BeginRealTime(Begin { tick_time }), 0, WAIT)?;
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
            started: 0,
            recognized: true,
            requested: 0,
            free: false,
            beginning: None,
            preload: begun.preload,
            pressing: None,
            traffic,
        };
        Ok((paced, begun.measurement))
    }

    /// Waits for each answer, for tests without a clock.
    #[cfg(test)]
    pub(crate) fn patient(mut self) -> Self {
        self.grace = WAIT;
        self
    }

    /// Sends a frame. If sending fails, the answer is missing when due.
    fn send(&mut self, message: Message, number: u64) {
        let _ = self.line.send(&message.datagram(number), None);
    }

    /// Processes an answer. Returns its result for the tick, if any.
    fn take(&mut self, frame: &[u8]) -> Option<Arrival> {
        let Ok((number, message)) = Message::read(frame) else {
            self.traffic.count(Event::FrameError);
            return None;
        };
        match message {
            Message::Readings(readings) if self.recognized && number == self.sent && number > self.answered => {
                self.answered = number;
                self.traffic.count(Event::Answered);
                Some(Arrival::Readings(readings))
            }
            Message::Readings(_) if number <= self.sent => {
                self.traffic.count(if number == self.answered { Event::Doubled } else { Event::Late });
                None
            }
            Message::Begun(begun) if self.beginning == Some(number) => {
                (self.recognized, self.started, self.answered, self.beginning) = (true, number, number, None);
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
            // Answers to frames sent before the start are ignored.
            _ if number <= self.started || number > self.sent => {}
            reason => {
                // No other bench uses it, or it has waited too long for this one.
                self.free = reason != Some(Reason::Stranger) || due == 0.0;
                return std::mem::take(&mut self.recognized).then_some(Arrival::Restarted);
            }
        }
        None
    }
}

impl Io for Paced {
    /// A tick with a blocking wait for its answer.
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.start(self.sent, voltages)?;
        let within = std::mem::replace(&mut self.grace, WAIT);
        let arrival = self.finish();
        self.grace = within;
        match arrival {
            Arrival::Readings(readings) => Ok(readings),
            _ => Err(LinkFault::Refused { reason: format!("it does not answer frame {}", self.sent) }),
        }
    }

    fn start(&mut self, tick: u64, voltages: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        // Number 0 was the start.
        let number = tick + 1;
        if self.recognized {
            if self.pressing.is_some_and(|last| number - last >= self.retry) {
                self.pressing = Some(number);
                self.send(Message::Preload(Preload { preload: self.preload }), number);
            }
        } else if number - self.requested < self.retry {
            return Ok(None);
        } else {
            (self.requested, self.sent) = (number, number);
            if self.free {
                self.beginning = Some(number);
                self.send(Message::BeginRealTime(Begin { tick_time: self.tick_time }), number);
                return Ok(None);
            }
        }
        self.send(Message::Voltages(voltages), number);
        self.sent = number;
        Ok(None)
    }

    fn finish(&mut self) -> Arrival {
        let start = Instant::now();
        let within = if self.recognized { self.grace } else { Duration::ZERO };
        let mut bytes = [0; LONGEST];
        loop {
            match self.line.look(&mut bytes) {
                Ok((length, _)) => {
                    if let Some(arrival) = self.take(&bytes[..length]) {
                        return arrival;
                    }
                }
                // No frame yet, or no machine.
                Err(_) => std::hint::spin_loop(),
            }
            if start.elapsed() >= within {
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
        // The machine may have ended already.
        self.send(Message::End, self.sent + 1);
    }
}

#[cfg(test)]
mod tests;
