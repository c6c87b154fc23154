//! XCP by datagrams.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::Ordering;
use std::time::Instant;

use crate::xcp::frame::{self, Next};
use crate::xcp::{MAX_CTO, MAX_DTO};

use super::session::Session;
use super::{Door, LOOK, is_later};

/// Largest datagram: what Ethernet takes, less the heads of IPv6 and UDP; a packet with its frame fits.
const DATAGRAM: usize = 1500 - 40 - 8;
const _: () = assert!(frame::HEADER + MAX_DTO <= DATAGRAM);
/// Datagrams at once: after a pause the rest waits in the ring for the next look, since a receiver that gets more than
/// its buffer takes loses them.
const BURST: usize = 16;
/// `CONNECT`, which begins a session.
const CONNECT: u8 = 0xff;

/// A socket at an address; port 0 takes a free one.
pub(super) fn bind(address: SocketAddr) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind(address)?;
    socket.set_read_timeout(Some(LOOK))?;
    socket.set_write_timeout(Some(LOOK))?;
    Ok(socket)
}

/// Serves one master after the other until the door closes.
///
/// While there is one the socket is connected to it: the system keeps all others away, and tells when its port is
/// closed. A connected socket cannot be freed again: another one takes its place.
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
                std::thread::sleep(LOOK);
            }
            continue;
        };
        let mut gone = false;
        match open.recv_from(&mut datagram) {
            Ok((size, from)) => {
                let known = master.as_ref().is_some_and(|(address, _)| *address == from);
                let begins = matches!(frame::next(&datagram[..size], MAX_CTO), Next::Packet([CONNECT, ..], _));
                if known || begins && !connected {
                    connected = connected || open.connect(from).is_ok();
                    if !known && let Some((_, session)) = master.replace((from, door.session(from))) {
                        session.end();
                    }
                    if let Some((_, session)) = &mut master {
                        receive(&datagram[..size], session, &mut out);
                    }
                }
            }
            // What was sent did not arrive: nobody listens there any more.
            Err(error) => gone = !is_later(&error),
        }
        if let Some((address, session)) = &mut master {
            session.look(&mut out);
            gone |= !send(open, *address, &mut out, door);
            if looked.elapsed() >= LOOK {
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
        // One that is merely silent may go on, until another one comes.
        if connected && (gone || master.as_ref().is_some_and(|(_, session)| silent(session))) {
            // Closed first, or its address is taken; opened at once, so that the next master is heard.
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

/// The commands of a datagram, up to one that cannot be.
fn receive(datagram: &[u8], session: &mut Session, out: &mut Vec<u8>) {
    let mut rest = datagram;
    while let Next::Packet(packet, behind) = frame::next(rest, MAX_CTO) {
        session.receive(packet, out);
        rest = behind;
    }
}

/// Sends what there is; whether somebody is there.
fn send(socket: &UdpSocket, master: SocketAddr, out: &mut Vec<u8>, door: &Door) -> bool {
    if out.is_empty() {
        return true;
    }
    // Connected, it takes no address.
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
