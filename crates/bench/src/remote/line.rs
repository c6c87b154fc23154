//! What carries the frames: datagrams, shared memory or a serial port; waited for or looked at.
//!
//! Whole frames, each once, in order, or not at all; and without an allocation behind the start.

use std::io::{Error, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

use super::Address;
use super::frame::LONGEST;
use super::serial::Serial;
use super::shm::{Mailbox, Side};

/// For so long whoever waits for a shared memory does not sleep: a tick of the machine takes microseconds.
const AWAKE: Duration = Duration::from_micros(20);
/// From look to look at a serial port.
const LOOK: Duration = Duration::from_micros(50);

/// An end of it.
#[derive(Debug)]
pub(super) enum Line {
    /// A socket, and how long it lets its reader wait now; for nothing at all where it is `None`.
    Udp(UdpSocket, Option<Duration>),
    /// A shared memory.
    Shm(Mailbox),
    /// A serial port.
    Serial(Serial),
}

/// Whom an answer goes to; nobody in particular where there is but one.
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
        }
    }

    /// The machine's end, and where it is reached: port 0 takes a free one.
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
        }
    }

    /// Sends a frame; where there is no room it is lost.
    pub(super) fn send(&mut self, frame: &[u8], to: Peer) -> Result<(), Error> {
        match self {
            Line::Udp(socket, _) => to.map_or_else(|| socket.send(frame), |to| socket.send_to(frame, to)).map(drop),
            Line::Shm(mailbox) => mailbox.send(frame),
            Line::Serial(serial) => serial.send(frame),
        }
    }

    /// A frame that is there, and whose it is; [`ErrorKind::WouldBlock`] where there is none.
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

    /// The next frame, waited for without hurry for the processor of others; [`ErrorKind::WouldBlock`] where none comes.
    pub(super) fn wait(&mut self, frame: &mut [u8; LONGEST], within: Duration) -> Result<(usize, Peer), Error> {
        if let Line::Udp(socket, waits) = self {
            if *waits != Some(within) {
                socket.set_nonblocking(false)?;
                socket.set_read_timeout(Some(within))?;
                *waits = Some(within);
            }
            return socket.recv_from(frame).map(|(length, from)| (length, Some(from))).map_err(|error| {
                // What a socket that waited in vain says depends on the system.
                if error.kind() == ErrorKind::TimedOut { ErrorKind::WouldBlock.into() } else { error }
            });
        }
        let begin = Instant::now();
        loop {
            let looked = self.look(frame);
            let waited = begin.elapsed();
            if !looked.as_ref().is_err_and(|error| error.kind() == ErrorKind::WouldBlock) || waited >= within {
                return looked;
            }
            match self {
                _ if waited < AWAKE => std::hint::spin_loop(),
                Line::Shm(mailbox) => mailbox.sleep(within - waited),
                _ => thread::sleep(LOOK),
            }
        }
    }
}
