//! A machine in another process, over datagrams in lockstep.
//!
//! Each tick is one datagram there and one back; nothing is sent twice, and what is lost, doubled, late or garbled ends
//! the run with its name. A machine that is served with a seed gives the same bits as one in this process.

pub(crate) mod frame;
mod serve;
#[cfg(test)]
mod tests;

use std::fmt;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::str::FromStr;
use std::time::Duration;

use frame::{Begin, LONGEST, Message, Preload};
pub use serve::{PlantServer, Served};
use stickslip_core::tick::Measurement;

use super::io::{Io, check_preload};
use super::lockstep::LockstepBench;
use crate::preset::{Model, Settings};
use crate::{Error, Preset};
use stickslip_core::cycle::Voltages;

/// How long an answer may take. A tick of the machine takes microseconds; a loaded computer may need much more.
const WAIT: Duration = Duration::from_secs(2);

/// Where a machine is reached: `udp:127.0.0.1:9750`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address(pub SocketAddr);

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("udp", address)) => {
                let found = address.to_socket_addrs().map_err(|error| format!("{address}: {error}"))?.next();
                found.map(Address).ok_or_else(|| format!("{address} has no address"))
            }
            Some(("shm", _)) => Err("shared memory is not there yet; use udp:127.0.0.1:PORT".into()),
            _ => Err("write it as udp:ADDRESS:PORT, for example udp:127.0.0.1:9750".into()),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "udp:{}", self.0)
    }
}

/// What happened to the link between software and machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LinkFault {
    /// A datagram or its answer was lost.
    #[error(
        "no answer to datagram {sequence} from {address} within {} s. Is `stickslip plant --io {address}` running there?",
        WAIT.as_secs()
    )]
    NoAnswer {
        /// Which.
        sequence: u64,
        /// The machine's.
        address: Address,
    },
    /// An answer came a second time.
    #[error(
        "the answer to datagram {sequence} came twice. A link that doubles datagrams controls nothing; use another."
    )]
    Doubled {
        /// Which.
        sequence: u64,
    },
    /// An answer came for another datagram.
    #[error("the answer to datagram {sequence} came where {due} was due: it is late, or one was lost.")]
    OutOfOrder {
        /// Whose answer.
        sequence: u64,
        /// Whose was due.
        due: u64,
    },
    /// An answer cannot be read.
    #[error("an answer from {address} is garbled: {reason}. Does something else talk there?")]
    Garbled {
        /// The machine's.
        address: Address,
        /// What is wrong with it.
        reason: String,
    },
    /// The machine does not do it.
    #[error("the machine refuses: {reason}.")]
    Refused {
        /// Why.
        reason: String,
    },
    /// The operating system refuses.
    #[error("{address}: {reason}. Is `stickslip plant --io {address}` running there?")]
    System {
        /// The machine's.
        address: Address,
        /// What it says.
        reason: String,
    },
}

/// The link to a machine in another process.
#[derive(Debug)]
pub struct Remote {
    socket: UdpSocket,
    address: Address,
    /// Number of the next datagram.
    sequence: u64,
    preload: f64,
    /// A link that failed stays so: what the machine does meanwhile is not known.
    failed: Option<LinkFault>,
}

impl Remote {
    /// Begins with the machine there; its readings at rest.
    fn begin(address: Address, tick_time: f64, wait: Duration) -> Result<(Self, Measurement<f64>), LinkFault> {
        let system = |error: std::io::Error| LinkFault::System { address, reason: error.to_string() };
        let here = if address.0.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(here).map_err(system)?;
        socket.connect(address.0).map_err(system)?;
        socket.set_read_timeout(Some(wait)).map_err(system)?;
        let mut remote = Remote { socket, address, sequence: 0, preload: 0.0, failed: None };
        let begun = remote.ask(Message::Begin(Begin { tick_time }), |answer| match answer {
            Message::Begun(begun) => Some(begun),
            _ => None,
        })?;
        remote.preload = begun.preload;
        Ok((remote, begun.measurement))
    }

    /// One datagram there, and of its answer what `take` makes of the right kind.
    fn ask<A>(&mut self, message: Message, take: impl Fn(Message) -> Option<A>) -> Result<A, LinkFault> {
        if let Some(fault) = &self.failed {
            return Err(fault.clone());
        }
        let answer = self.answer(message).and_then(|answer| {
            let reason = || format!("its kind is {}", answer.kind());
            take(answer).ok_or_else(|| LinkFault::Garbled { address: self.address, reason: reason() })
        });
        self.failed = answer.as_ref().err().cloned();
        answer
    }

    fn answer(&mut self, message: Message) -> Result<Message, LinkFault> {
        use std::io::ErrorKind::{TimedOut, WouldBlock};
        let (address, due) = (self.address, self.sequence);
        let system = |error: std::io::Error| match error.kind() {
            TimedOut | WouldBlock => LinkFault::NoAnswer { sequence: due, address },
            _ => LinkFault::System { address, reason: error.to_string() },
        };
        self.socket.send(&message.datagram(due)).map_err(system)?;
        let mut bytes = [0; LONGEST];
        let length = self.socket.recv(&mut bytes).map_err(system)?;
        let garbled = |reason: frame::Garbled| LinkFault::Garbled { address, reason: reason.to_string() };
        let (sequence, answer) = Message::read(&bytes[..length]).map_err(garbled)?;
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
        let _ = self.socket.send(&Message::End.datagram(self.sequence));
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
    pub fn connect(preset: &Preset<f64>, address: Address) -> Result<Self, Error> {
        Self::connect_within(&preset.model, &preset.bench, address, WAIT)
    }

    fn connect_within(
        model: &Model<f64>,
        settings: &Settings<f64>,
        address: Address,
        wait: Duration,
    ) -> Result<Self, Error> {
        let (remote, readings) = Remote::begin(address, settings.tick_time(), wait)
            .map_err(|fault| Error::BenchFault { cycle: 0, reason: fault.to_string() })?;
        LockstepBench::over(model, settings, remote, readings)
    }
}
