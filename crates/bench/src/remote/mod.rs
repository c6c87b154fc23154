//! A machine in another process, over datagrams, shared memory or a serial port.
//!
//! Each tick is one frame there and one back; nothing is sent twice. In lockstep ([`Remote`]) a lost, duplicated, late
//! or damaged frame ends the run with an error. In real time ([`Paced`]) it causes a missed tick; missed ticks are
//! counted, and too many stop the bench. In both cases a machine served with a seed gives the same bits as one in this
//! process.

mod address;
pub(crate) mod frame;
mod line;
mod link_fault;
mod paced;
mod serial;
mod serve;
mod shm;
#[cfg(test)]
mod tests;
mod traffic;

use std::io::ErrorKind;
use std::time::Duration;

pub use address::Address;
use frame::{Begin, LONGEST, Message, Preload};
use line::Line;
pub use link_fault::LinkFault;
pub use paced::Paced;
pub use serve::{PlantServer, Served};
use stickslip_core::tick::Measurement;
pub use traffic::{Counts, Event, Traffic};

use super::io::{Io, check_preload};
use super::lockstep::LockstepBench;
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{Error, Preset};
use stickslip_software::cycle::Voltages;

/// Time-out of an answer. A tick of the machine takes microseconds; a busy computer may need much more.
const WAIT: Duration = Duration::from_secs(2);

/// The link to a machine in another process.
#[derive(Debug)]
pub struct Remote {
    line: Line,
    address: Address,
    /// Time-out of an answer.
    wait: Duration,
    /// Number of the next frame.
    sequence: u64,
    preload: f64,
    /// A failed link stays failed, since the state of the machine is unknown.
    failed: Option<LinkFault>,
}

impl Remote {
    /// Starts the machine; returns its readings at rest.
    fn begin(address: &Address, tick_time: f64, wait: Duration) -> Result<(Self, Measurement<f64>), LinkFault> {
        let line = connected(address)?;
        let mut remote = Remote { line, address: address.clone(), wait, sequence: 0, preload: 0.0, failed: None };
        let start = remote.ask(Message::Begin(Begin { tick_time }), |answer| match answer {
            Message::Begun(begun) => Some(begun),
            _ => None,
        })?;
        remote.preload = start.preload;
        Ok((remote, start.measurement))
    }

    /// Sends one frame and converts its answer by `take`.
    fn ask<A>(&mut self, message: Message, take: impl Fn(Message) -> Option<A>) -> Result<A, LinkFault> {
        if let Some(fault) = &self.failed {
            return Err(fault.clone());
        }
        let answer = self.answer(message).and_then(|answer| {
            let reason = || format!("its kind is {}", answer.kind());
            take(answer).ok_or_else(|| LinkFault::FrameError { address: self.address.clone(), reason: reason() })
        });
        self.failed = answer.as_ref().err().cloned();
        answer
    }

    fn answer(&mut self, message: Message) -> Result<Message, LinkFault> {
        let due = self.sequence;
        let (sequence, answer) = exchange(&mut self.line, &self.address, message, due, self.wait)?;
        if let Message::Refusal(refusal) = answer {
            return Err(LinkFault::Refused { reason: refusal.to_string() });
        }
        if sequence + 1 == due {
            return Err(LinkFault::Doubled { sequence });
        }
        if sequence != due {
            return Err(LinkFault::OutOfOrder { sequence, due });
        }
        self.sequence += 1;
        Ok(answer)
    }
}

/// Sends one frame and returns the next one with its number.
fn exchange(
    line: &mut Line,
    address: &Address,
    message: Message,
    due: u64,
    wait: Duration,
) -> Result<(u64, Message), LinkFault> {
    let system = |error: std::io::Error| match error.kind() {
        ErrorKind::WouldBlock => LinkFault::NoAnswer { sequence: due, address: address.clone() },
        _ => LinkFault::System { address: address.clone(), reason: error.to_string() },
    };
    line.send(&message.datagram(due), None).map_err(system)?;
    let mut bytes = [0; LONGEST];
    let (length, _) = line.wait(&mut bytes, wait).map_err(system)?;
    let damaged =
        |reason: frame::FrameError| LinkFault::FrameError { address: address.clone(), reason: reason.to_string() };
    Message::read(&bytes[..length]).map_err(damaged)
}

/// The software's end of a link.
fn connected(address: &Address) -> Result<Line, LinkFault> {
    if let Address::Ethercat(_) = address {
        return Err(LinkFault::Fieldbus { address: address.clone() });
    }
    Line::connect(address).map_err(|error| LinkFault::System { address: address.clone(), reason: error.to_string() })
}

impl Io for Remote {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.ask(Message::Voltages(voltages), |answer| match answer {
            Message::Readings(measurement) => Some(measurement),
            _ => None,
        })
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        check_preload(preload)?;
        let cycle = self.sequence;
        let pressed = self.ask(Message::Preload(Preload { preload }), |answer| match answer {
            Message::Pressed(pressed) => Some(pressed.preload),
            _ => None,
        });
        self.preload = pressed.map_err(|fault| Error::BenchFault { cycle, reason: fault.to_string() })?;
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.preload
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        // The machine may have ended already.
        let _ = self.line.send(&Message::End.datagram(self.sequence), None);
    }
}

/// The software of a bench whose machine is in another process.
pub type RemoteBench = LockstepBench<Remote>;

impl RemoteBench {
    /// The bench of a preset with the machine served at an address, switched on and at rest.
    ///
    /// # Errors
    /// [`Error::BenchFault`] if it cannot be reached or has another tick time; errors of the design of observer and
    /// current control.
    pub fn connect(preset: &Preset<f64>, address: &Address) -> Result<Self, Error> {
        Self::connect_within(&preset.model, &preset.bench, address, WAIT)
    }

    fn connect_within(
        model: &Model<f64>,
        settings: &Settings<f64>,
        address: &Address,
        wait: Duration,
    ) -> Result<Self, Error> {
        let (remote, readings) = Remote::begin(address, settings.tick_time(), wait)
            .map_err(|fault| Error::BenchFault { cycle: 0, reason: fault.to_string() })?;
        LockstepBench::over(model, settings, remote, readings)
    }
}
