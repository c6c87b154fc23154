//! XCP over UDP.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crate::xcp::frame::{self, Next};
use crate::xcp::{MAX_CTO, MAX_DTO};

use super::session::Session;
use super::{Door, POLL_INTERVAL, is_later};

/// Largest datagram: the payload of Ethernet without the headers of IPv6 and UDP; a packet with its frame fits.
const DATAGRAM: usize = 1500 - 40 - 8;
const _: () = assert!(frame::HEADER + MAX_DTO <= DATAGRAM);
/// Maximum number of datagrams per poll. The rest waits in the ring for the next poll: a receiver loses datagrams that
/// exceed its buffer.
const BURST: usize = 16;
/// `CONNECT`, which starts a session.
const CONNECT: u8 = 0xff;

/// A socket at an address; port 0 selects a free port.
pub(super) fn bind(address: SocketAddr) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind(address)?;
    stickslip_rt::report_closed_ports(&socket)?;
    socket.set_read_timeout(Some(POLL_INTERVAL))?;
    socket.set_write_timeout(Some(POLL_INTERVAL))?;
    Ok(socket)
}

/// Serves one master after the other until the address is closed.
///
/// The system reports a closed port of the master. Reports occupy the buffer of the socket until it is closed: after one,
/// the socket is replaced by a new one.
pub(super) fn run(socket: UdpSocket, door: &Door) {
    let mut socket = Some(socket);
    let mut master: Option<Master> = None;
    let mut datagram = [0; 2048];
    let mut out = Vec::with_capacity(DATAGRAM);
    let mut looked = Instant::now();
    while !door.is_closing() {
        let Some(open) = &socket else {
            socket = bind(door.address).ok();
            if socket.is_none() {
                std::thread::sleep(POLL_INTERVAL);
            }
            continue;
        };
        let mut closed = false;
        match open.recv_from(&mut datagram) {
            Ok((size, from)) => {
                let begins = matches!(frame::next(&datagram[..size], MAX_CTO), Next::Packet([CONNECT, ..], _));
                if begins && master.as_ref().is_none_or(|master| master.is_replaced_by(from, door.patience)) {
                    let replaced = master.replace(Master { address: from, session: door.session(from) });
                    replaced.into_iter().for_each(|master| master.session.end());
                }
                if let Some(master) = master.as_mut().filter(|master| master.address == from) {
                    receive(&datagram[..size], &mut master.session, &mut out);
                }
            }
            // A sent datagram was rejected: the port of the master is closed.
            Err(error) => closed = !is_later(&error),
        }
        let mut disconnected = false;
        if let Some(Master { address, session }) = &mut master {
            session.look(&mut out);
            closed |= !send(open, *address, &mut out, door);
            if looked.elapsed() >= POLL_INTERVAL {
                looked = Instant::now();
                for _ in 0..BURST {
                    session.measurements(&mut out, DATAGRAM);
                    if out.is_empty() {
                        break;
                    }
                    closed |= !send(open, *address, &mut out, door);
                }
            }
            disconnected = !session.is_connected();
        }
        door.report_sometimes(master.as_ref().map(|master| (master.address, &master.session)));
        if closed {
            // Closed first to free the address; opened at once for the next master.
            drop(socket.take());
            socket = bind(door.address).ok();
        }
        if (closed || disconnected)
            && let Some(master) = master.take()
        {
            master.session.end();
            door.report(None);
        }
    }
    master.into_iter().for_each(|master| master.session.end());
}

/// A master at an address.
struct Master {
    address: SocketAddr,
    session: Session,
}

impl Master {
    /// Whether the master at an address that begins a session replaces this one.
    ///
    /// A master that restarts has another port of the same host. It takes over at once; while the former one measures,
    /// only if that is silent, since both may be tools in use on one host. A silent master may continue until another one
    /// connects.
    fn is_replaced_by(&self, from: SocketAddr, patience: Duration) -> bool {
        let (same_host, silent) = (from.ip() == self.address.ip(), self.session.silence() > patience);
        let may = if self.session.is_measuring() { same_host && silent } else { same_host || silent };
        may && from != self.address
    }
}

/// Handles the commands of a datagram, up to the first invalid one.
fn receive(datagram: &[u8], session: &mut Session, out: &mut Vec<u8>) {
    let mut rest = datagram;
    while let Next::Packet(packet, behind) = frame::next(rest, MAX_CTO) {
        session.receive(packet, out);
        rest = behind;
    }
}

/// Sends the output. Returns whether the port of the master is open.
fn send(socket: &UdpSocket, master: SocketAddr, out: &mut Vec<u8>, door: &Door) -> bool {
    if out.is_empty() {
        return true;
    }
    let sent = socket.send_to(out, master);
    out.clear();
    match sent {
        Ok(_) => true,
        Err(error) => {
            door.lost.fetch_add(1, Ordering::Relaxed);
            is_later(&error)
        }
    }
}
