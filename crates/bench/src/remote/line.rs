//! Transport of frames: datagrams, shared memory or a serial port; blocking or polled.
//!
//! Frames arrive complete, once and in order, or not at all; no allocation after the start.

use std::io::{Error, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

use super::Address;
use super::frame::LONGEST;
use super::serial::Serial;
use super::shm::{Mailbox, Side};

/// Spinning time before a sleep on shared memory: a tick of the machine takes microseconds.
const AWAKE: Duration = Duration::from_micros(20);
/// Polling interval of a serial port.
const LOOK: Duration = Duration::from_micros(50);

/// An end of a link.
#[derive(Debug)]
pub(super) enum Line {
    /// A socket with its present time-out; non-blocking if `None`.
    Udp(UdpSocket, Option<Duration>),
    /// A shared memory.
    Shm(Mailbox),
    /// A serial port.
    Serial(Serial),
}

/// Destination of an answer; `None` if there is only one.
pub(super) type Peer = Option<SocketAddr>;

impl Line {
    /// The software's end.
    pub(super) fn connect(address: &Address) -> Result<Self, Error> {
        match address {
            Address::Udp(address) => {
                let socket = UdpSocket::bind(if address.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" })?;
                socket.connect(address)?;
                socket.set_nonblocking(true)?;
                Ok(Line::Udp(socket, None))
            }
            Address::Shm(name) => Mailbox::open(name, Side::Software).map(Line::Shm),
            Address::Serial(path) => Serial::open(path).map(Line::Serial),
            Address::Ethercat(_) => Err(ErrorKind::Unsupported.into()),
        }
    }

    /// The machine's end with its address: port 0 selects a free port.
    pub(super) fn bind(address: &Address) -> Result<(Self, Address), Error> {
        match address {
            Address::Udp(address) => {
                let socket = UdpSocket::bind(address)?;
                socket.set_nonblocking(true)?;
                let address = Address::Udp(socket.local_addr()?);
                Ok((Line::Udp(socket, None), address))
            }
            Address::Shm(name) => Ok((Mailbox::open(name, Side::Machine).map(Line::Shm)?, address.clone())),
            Address::Serial(path) => Ok((Serial::open(path).map(Line::Serial)?, address.clone())),
            Address::Ethercat(_) => Err(Error::new(ErrorKind::Unsupported, "use --ethercat INTERFACE")),
        }
    }

    /// Sends a frame; without room it is lost.
    pub(super) fn send(&mut self, frame: &[u8], to: Peer) -> Result<(), Error> {
        match self {
            Line::Udp(socket, _) => to.map_or_else(|| socket.send(frame), |to| socket.send_to(frame, to)).map(drop),
            Line::Shm(mailbox) => mailbox.send(frame),
            Line::Serial(serial) => serial.send(frame),
        }
    }

    /// An available frame with its sender; [`ErrorKind::WouldBlock`] if there is none.
    pub(super) fn look(&mut self, frame: &mut [u8; LONGEST]) -> Result<(usize, Peer), Error> {
        match self {
            Line::Udp(socket, waits) => {
                if waits.take().is_some() {
                    socket.set_nonblocking(true)?;
                }
                socket.recv_from(frame).map(|(length, from)| (length, Some(from)))
            }
            Line::Shm(mailbox) => mailbox.receive(frame).map(|length| (length, None)),
            Line::Serial(serial) => serial.receive(frame).map(|length| (length, None)),
        }
    }

    /// Waits for the next frame without occupying the CPU; [`ErrorKind::WouldBlock`] if none comes.
    pub(super) fn wait(&mut self, frame: &mut [u8; LONGEST], within: Duration) -> Result<(usize, Peer), Error> {
        if let Line::Udp(socket, waits) = self {
            if *waits != Some(within) {
                socket.set_nonblocking(false)?;
                socket.set_read_timeout(Some(within))?;
                *waits = Some(within);
            }
            return socket.recv_from(frame).map(|(length, from)| (length, Some(from))).map_err(|error| {
                // The error of a time-out depends on the system.
                if error.kind() == ErrorKind::TimedOut { ErrorKind::WouldBlock.into() } else { error }
            });
        }
        let start = Instant::now();
        loop {
            let result = self.look(frame);
            let elapsed = start.elapsed();
            if !result.as_ref().is_err_and(|error| error.kind() == ErrorKind::WouldBlock) || elapsed >= within {
                return result;
            }
            match self {
                _ if elapsed < AWAKE => std::hint::spin_loop(),
                Line::Shm(mailbox) => mailbox.sleep(within - elapsed),
                _ => thread::sleep(LOOK),
            }
        }
    }
}
