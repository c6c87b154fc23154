//! A machine in another process, over datagrams, shared memory or a serial port.
//!
//! Each tick is one frame there and one back; nothing is sent twice. In lockstep ([`Remote`]) what is lost, doubled, late
//! or garbled ends the run with its name. By the clock ([`Paced`]) it costs the bench ticks, which are counted, and too
//! many of them stop it. A machine that is served with a seed gives the same bits as one in this process either way.

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
pub use traffic::{Counts, Traffic};

use super::io::{Io, check_preload};
use super::lockstep::LockstepBench;
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{Error, Preset};
use stickslip_core::cycle::Voltages;

/// How long an answer may take. A tick of the machine takes microseconds; a loaded computer may need much more.
const WAIT: Duration = Duration::from_secs(2);

/// The link to a machine in another process.
#[derive(Debug)]
pub struct Remote {
    line: Line,
    address: Address,
    /// How long an answer may take.
    wait: Duration,
    /// Number of the next frame.
    sequence: u64,
    preload: f64,
    /// A link that failed stays so: what the machine does meanwhile is not known.
    failed: Option<LinkFault>,
}

impl Remote {
    /// Begins with the machine there; its readings at rest.
    fn begin(address: &Address, tick_time: f64, wait: Duration) -> Result<(Self, Measurement<f64>), LinkFault> {
        let line = connected(address)?;
        let mut remote = Remote { line, address: address.clone(), wait, sequence: 0, preload: 0.0, failed: None };
        let begun = remote.ask(Message::Begin(Begin { tick_time }), |answer| match answer {
            Message::Begun(begun) => Some(begun),
            _ => None,
        })?;
        remote.preload = begun.preload;
        Ok((remote, begun.measurement))
    }

    /// One frame there, and of its answer what `take` makes of the right kind.
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
        let (sequence, answer) = asked(&mut self.line, &self.address, message, due, self.wait)?;
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

/// One frame there, the next one back, with its number.
fn asked(
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
    let garbled =
        |reason: frame::FrameError| LinkFault::FrameError { address: address.clone(), reason: reason.to_string() };
    Message::read(&bytes[..length]).map_err(garbled)
}

/// The software's end of a link.
fn connected(address: &Address) -> Result<Line, LinkFault> {
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
        // A machine that has gone needs no farewell.
        let _ = self.line.send(&Message::End.datagram(self.sequence), None);
    }
}

/// The software of a bench whose machine is in another process.
pub type RemoteBench = LockstepBench<Remote>;

impl RemoteBench {
    /// The bench of what is believed and set, with the machine that is served there, switched on and at rest.
    ///
    /// # Errors
    /// [`Error::BenchFault`] where it cannot be reached or has another tick; whatever the design of observer and
    /// current control refuses.
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
