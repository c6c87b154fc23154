//! Server of a virtual machine for a bench in another process.

use std::io::ErrorKind;
use std::time::Duration;

use stickslip_core::tick::Measurement;
use stickslip_software::cycle::Voltages;

use super::Address;
use super::frame::{Begin, Begun, LONGEST, Message, Preload, Reason};
use super::line::{Line, Peer};
use crate::InProcess;
use crate::io::Io as _;
use stickslip_base::{Error, Preset, Watch};

/// Interval of the checks for cancellation.
const LOOK: Duration = Duration::from_millis(100);
/// Maximum time that a machine continues without frames of a real-time bench [s].
const ALONE: f64 = 1.0;

/// The machine of a preset behind a link.
#[derive(Debug)]
pub struct PlantServer {
    line: Line,
    address: Address,
    preset: Preset<f64>,
    seed: u64,
}

/// Statistics of a server.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    /// Number of started benches.
    pub sessions: u64,
    /// Number of ticks of all benches.
    pub ticks: u64,
    /// Number of refused frames.
    pub refused: u64,
    /// Number of ticks without a frame, with held voltages.
    pub held: u64,
}

/// Connection to a started bench.
struct Session {
    peer: Peer,
    machine: InProcess,
    /// Expected number of the next frame.
    due: u64,
    /// Whether frame numbers count ticks in real time: skipped numbers have then passed.
    clocked: bool,
    /// Active voltages.
    voltages: Voltages<f64>,
}

impl PlantServer {
    /// Binds an address; port 0 selects a free port.
    ///
    /// # Errors
    /// [`Error::BenchFault`] if the system refuses the address; errors of the step of the virtual machine.
    pub fn bind(address: &Address, preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        InProcess::new(preset, seed)?;
        let (line, address) = Line::bind(address).map_err(|error| Error::BenchFault {
            cycle: 0,
            reason: format!("{address}: {error}. Choose another address."),
        })?;
        Ok(PlantServer { line, address, preset: *preset, seed })
    }

    /// Address of the server.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// Serves one bench after another, each with a machine at rest and the noise of the seed from its start. Ends when
    /// the watch is cancelled, or with `once` after the first bench.
    ///
    /// # Errors
    /// [`Error::BenchFault`] for errors of the system.
    pub fn serve(&mut self, once: bool, watch: &Watch) -> Result<Served, Error> {
        let (mut served, mut session) = (Served::default(), None);
        let mut bytes = [0; LONGEST];
        while watch.check().is_ok() {
            let (length, peer) = match self.line.wait(&mut bytes, LOOK) {
                Ok(received) => received,
                Err(error) => match error.kind() {
                    // No request, or the bench ended before the answer.
                    ErrorKind::WouldBlock | ErrorKind::Interrupted => continue,
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
                Err(_) => (0, Some(Reason::FrameError.message(0.0, 0.0))),
            };
            served.refused += u64::from(matches!(answer, Some(Message::Refusal(_))));
            if let Some(answer) = answer {
                // If sending fails, the bench reports the missing answer.
                let _ = self.line.send(&answer.datagram(sequence), peer);
            }
        }
        Ok(served)
    }

    fn answer(
        &self,
        session: &mut Option<Session>,
        served: &mut Served,
        peer: Peer,
        sequence: u64,
        message: Message,
    ) -> Result<Option<Message>, Error> {
        if let Message::Begin(Begin { tick_time }) | Message::BeginRealTime(Begin { tick_time }) = message {
            let own = self.preset.bench.tick_time();
            if (tick_time - own).abs() > 1e-9 * own || tick_time.is_nan() {
                return Ok(Some(Reason::TickTime.message(own, tick_time)));
            }
            let (machine, measurement) = InProcess::new(&self.preset, self.seed)?;
            let preload = machine.preload();
            let clocked = matches!(message, Message::BeginRealTime(_));
            *session = Some(Session { peer, machine, due: sequence + 1, clocked, voltages: Voltages::default() });
            served.sessions += 1;
            return Ok(Some(Message::Begun(Begun { preload, measurement })));
        }
        let taken = f64::from(u8::from(session.is_some()));
        let Some(session) = session.as_mut().filter(|session| session.peer == peer) else {
            return Ok(Some(Reason::Stranger.message(taken, 0.0)));
        };
        Ok(match message {
            // In real time a number is a tick, and the preload is set between two ticks.
            Message::Preload(Preload { preload }) if session.clocked => Some(session.press(preload)),
            Message::Voltages(voltages) if session.clocked => {
                let alone = sequence.checked_sub(session.due);
                match alone {
                    // Late or duplicated: the tick has passed.
                    None => None,
                    Some(alone) if alone as f64 * self.preset.bench.tick_time() > ALONE => {
                        Some(Reason::Sequence.message(session.due as f64, sequence as f64))
                    }
                    Some(alone) => {
                        (served.held, session.due) = (served.held + alone, sequence + 1);
                        Some(session.ticks(voltages, alone, served))
                    }
                }
            }
            _ if sequence != session.due => Some(Reason::Sequence.message(session.due as f64, sequence as f64)),
            message => {
                session.due += 1;
                Some(match message {
                    Message::Voltages(voltages) => session.ticks(voltages, 0, served),
                    Message::Preload(Preload { preload }) => session.press(preload),
                    other => Reason::Kind.message(0.0, f64::from(other.kind())),
                })
            }
        })
    }
}

impl Session {
    /// Ticks with the active voltages, then one with new voltages. Returns the readings at its end.
    fn ticks(&mut self, voltages: Voltages<f64>, alone: u64, served: &mut Served) -> Message {
        let mut readings = Measurement::default();
        let mut index = 0.0_f64;
        for tick in 0..=alone {
            self.voltages = if tick == alone { voltages } else { self.voltages };
            readings = match self.machine.exchange(self.voltages) {
                Ok(readings) => readings,
                Err(_) => return Reason::Kind.message(0.0, 0.0),
            };
            index = index.max(readings.index);
            served.ticks += 1;
        }
        Message::Readings(Measurement { index, ..readings })
    }

    fn press(&mut self, preload: f64) -> Message {
        match self.machine.set_preload(preload) {
            Ok(()) => Message::Pressed(Preload { preload }),
            Err(_) => Reason::Preload.message(1.0, preload),
        }
    }
}
