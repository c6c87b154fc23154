//! XCP over UDP.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::Ordering;
use std::time::Instant;

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
    socket.set_read_timeout(Some(POLL_INTERVAL))?;
    socket.set_write_timeout(Some(POLL_INTERVAL))?;
    Ok(socket)
}

/// Serves one master after the other until the address is closed.
///
/// The socket is connected to the master: the system rejects all others and reports a closed port of the master. A
/// connected socket cannot be disconnected; it is replaced by a new one.
pub(super) fn run(socket: UdpSocket, door: &Door) {
    let mut socket = Some(socket);
    let mut master: Option<(SocketAddr, Session)> = None;
    let mut connected = false;
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
        let mut gone = false;
        match open.recv_from(&mut datagram) {
            Ok((size, from)) => {
                let is_master = master.as_ref().is_some_and(|(address, _)| *address == from);
                let begins = matches!(frame::next(&datagram[..size], MAX_CTO), Next::Packet([CONNECT, ..], _));
                if is_master || begins && !connected {
                    connected = connected || open.connect(from).is_ok();
                    if !is_master && let Some((_, session)) = master.replace((from, door.session(from))) {
                        session.end();
                    }
                    if let Some((_, session)) = &mut master {
                        receive(&datagram[..size], session, &mut out);
                    }
                }
            }
            // A sent datagram was rejected: the port of the master is closed.
            Err(error) => gone = !is_later(&error),
        }
        if let Some((address, session)) = &mut master {
            session.look(&mut out);
            gone |= !send(open, *address, &mut out, door);
            if looked.elapsed() >= POLL_INTERVAL {
                looked = Instant::now();
                for _ in 0..BURST {
                    session.measurements(&mut out, DATAGRAM);
                    if out.is_empty() {
                        break;
                    }
                    gone |= !send(open, *address, &mut out, door);
                }
            }
            gone |= !session.is_connected();
        }
        door.report_sometimes(master.as_ref().map(|(address, session)| (*address, session)));
        let silent = |session: &Session| session.silence() > door.patience && !session.is_measuring();
        // A silent master may continue until another one connects.
        if connected && (gone || master.as_ref().is_some_and(|(_, session)| silent(session))) {
            // Closed first to free the address; opened at once for the next master.
            drop(socket.take());
            (socket, connected) = (bind(door.address).ok(), false);
        }
        if gone && let Some((_, session)) = master.take() {
            session.end();
            door.report(None);
        }
    }
    if let Some((_, session)) = master {
        session.end();
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
    // A connected socket accepts no address.
    let sent = match socket.peer_addr() {
        Ok(_) => socket.send(out),
        Err(_) => socket.send_to(out, master),
    };
    out.clear();
    match sent {
        Ok(_) => true,
        Err(error) => {
            door.lost.fetch_add(1, Ordering::Relaxed);
            is_later(&error)
        }
    }
}
