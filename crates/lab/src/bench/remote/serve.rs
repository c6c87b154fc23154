//! The virtual machine for a bench in another process.

use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use super::Address;
use super::frame::{Begun, LONGEST, Message, Preload, Reason};
use crate::bench::InProcess;
use crate::bench::io::Io as _;
use crate::{Error, Preset, Watch};

/// How often a machine that waits looks whether it shall end.
const LOOK: Duration = Duration::from_millis(100);

/// The machine of a preset behind a socket.
#[derive(Debug)]
pub struct PlantServer {
    socket: UdpSocket,
    address: Address,
    preset: Preset<f64>,
    seed: u64,
}

/// What was served.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    /// Benches that began.
    pub sessions: u64,
    /// Ticks of all of them.
    pub ticks: u64,
    /// Datagrams that were refused.
    pub refused: u64,
}

/// A bench that has begun.
struct Session {
    peer: SocketAddr,
    machine: InProcess,
    /// Number of the next datagram.
    due: u64,
}

impl PlantServer {
    /// Takes the address; port 0 takes a free one.
    ///
    /// # Errors
    /// [`Error::BenchFault`] where the system refuses the address; what the virtual machine's step refuses.
    pub fn bind(address: Address, preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        InProcess::new(preset, seed)?;
        let refused = |error: std::io::Error| Error::BenchFault {
            cycle: 0,
            reason: format!("{address}: {error}. Choose another address."),
        };
        let socket = UdpSocket::bind(address.0).map_err(refused)?;
        socket.set_read_timeout(Some(LOOK)).map_err(refused)?;
        let address = Address(socket.local_addr().map_err(refused)?);
        Ok(PlantServer { socket, address, preset: *preset, seed })
    }

    /// Where it is reached.
    pub fn address(&self) -> Address {
        self.address
    }

    /// Serves one bench after another, each with a machine at rest and the noise of the seed from its begin; ends when
    /// the watch is cancelled, or with `once` at the end of the first.
    ///
    /// # Errors
    /// [`Error::BenchFault`] where the system refuses.
    pub fn serve(&self, once: bool, watch: &Watch) -> Result<Served, Error> {
        let (mut served, mut session) = (Served::default(), None);
        let mut bytes = [0; LONGEST];
        while watch.check().is_ok() {
            let (length, peer) = match self.socket.recv_from(&mut bytes) {
                Ok(received) => received,
                Err(error) => match error.kind() {
                    // Nobody asked, or somebody left before the answer.
                    ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => continue,
                    ErrorKind::ConnectionRefused | ErrorKind::ConnectionReset => continue,
                    _ => return Err(Error::BenchFault { cycle: served.ticks, reason: error.to_string() }),
                },
            };
            let (sequence, answer) = match Message::read(&bytes[..length]) {
                Ok((_, Message::End)) if session.as_ref().is_some_and(|session: &Session| session.peer == peer) => {
                    session = None;
                    if once {
                        break;
                    }
                    continue;
                }
                Ok((sequence, message)) => (sequence, self.answer(&mut session, &mut served, peer, sequence, message)?),
                Err(_) => (0, Reason::Garbled.message(0.0, 0.0)),
            };
            served.refused += u64::from(matches!(answer, Message::Refusal(_)));
            // Whoever does not get it will ask no more.
            let _ = self.socket.send_to(&answer.datagram(sequence), peer);
        }
        Ok(served)
    }

    fn answer(
        &self,
        session: &mut Option<Session>,
        served: &mut Served,
        peer: SocketAddr,
        sequence: u64,
        message: Message,
    ) -> Result<Message, Error> {
        if let Message::Begin(begin) = message {
            let own = self.preset.bench.tick_time();
            if (begin.tick_time - own).abs() > 1e-9 * own || begin.tick_time.is_nan() {
                return Ok(Reason::TickTime.message(own, begin.tick_time));
            }
            let (machine, measurement) = InProcess::new(&self.preset, self.seed)?;
            let preload = machine.preload();
            *session = Some(Session { peer, machine, due: sequence + 1 });
            served.sessions += 1;
            return Ok(Message::Begun(Begun { preload, measurement }));
        }
        let Some(session) = session.as_mut().filter(|session| session.peer == peer) else {
            return Ok(Reason::Stranger.message(0.0, 0.0));
        };
        if sequence != session.due {
            return Ok(Reason::Sequence.message(session.due as f64, sequence as f64));
        }
        session.due += 1;
        Ok(match message {
            Message::Voltages(voltages) => match session.machine.exchange(voltages) {
                Ok(measurement) => {
                    served.ticks += 1;
                    Message::Readings(measurement)
                }
                Err(_) => Reason::Kind.message(0.0, f64::from(message.kind())),
            },
            Message::Preload(Preload { preload }) => match session.machine.set_preload(preload) {
                Ok(()) => Message::Pressed(Preload { preload }),
                Err(_) => Reason::Preload.message(1.0, preload),
            },
            other => Reason::Kind.message(0.0, f64::from(other.kind())),
        })
    }
}
