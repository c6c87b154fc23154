//! XCP over TCP.

use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use crate::xcp::MAX_CTO;
use crate::xcp::frame::{self, Next};

use super::session::Session;
use super::{Door, POLL_INTERVAL, is_later};

/// Maximum number of connections; one of them has the master.
const CONNECTIONS: usize = 4;
/// Maximum number of unsent bytes of a connection.
const MAX_UNSENT: usize = 64 << 10;
/// `CONNECT`, which starts a session.
const CONNECT: u8 = 0xff;

/// The master: number of its connection, time of its last command, whether it measures.
type Master = Arc<Mutex<Option<(usize, Instant, bool)>>>;

fn lock(master: &Master) -> MutexGuard<'_, Option<(usize, Instant, bool)>> {
    master.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Accepts connections until the address is closed.
pub(super) fn run(listener: &TcpListener, door: &Door) {
    let (master, open) = (Master::default(), Arc::<AtomicUsize>::default());
    // If the system refuses, connections still work, but the stop is noticed only at the next connection.
    let _ = listener.set_nonblocking(true);
    let mut threads = Vec::new();
    let mut number = 0;
    while !door.is_closing() {
        let accepted = listener.accept();
        let Ok((stream, from)) = accepted else {
            thread::sleep(POLL_INTERVAL);
            continue;
        };
        if open.load(Ordering::Relaxed) >= CONNECTIONS {
            continue;
        }
        number += 1;
        open.fetch_add(1, Ordering::Relaxed);
        let connection = Connection { number, from, master: master.clone(), door: door.clone() };
        let open = open.clone();
        threads.push(thread::spawn(move || {
            // A broken connection has ended.
            let _ = connection.serve(stream);
            open.fetch_sub(1, Ordering::Relaxed);
        }));
        threads.retain(|thread| !thread.is_finished());
    }
    for thread in threads {
        let _ = thread.join();
    }
}

struct Connection {
    number: usize,
    from: SocketAddr,
    master: Master,
    door: Door,
}

impl Connection {
    /// Serves a connection until it ends or another master has replaced it.
    fn serve(&self, stream: TcpStream) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(POLL_INTERVAL))?;
        stream.set_write_timeout(Some(POLL_INTERVAL))?;
        let mut session = self.door.session(self.from);
        let served = self.exchange(stream, &mut session);
        session.end();
        let mut master = lock(&self.master);
        if master.is_some_and(|(number, ..)| number == self.number) {
            *master = None;
            drop(master);
            self.door.report(None);
        }
        served
    }

    fn exchange(&self, mut stream: TcpStream, session: &mut Session) -> io::Result<()> {
        let (mut input, mut out) = (Vec::new(), Vec::new());
        let mut buffer = [0; 4096];
        let mut moved = Instant::now();
        while !self.door.is_closing() {
            // No more commands are read while responses are unsent.
            if out.len() < MAX_UNSENT {
                match stream.read(&mut buffer) {
                    Ok(0) => return Ok(()),
                    Ok(size) => input.extend_from_slice(&buffer[..size]),
                    Err(error) if is_later(&error) => {}
                    Err(error) => return Err(error),
                }
            }
            if !self.commands(&mut input, session, &mut out) {
                return Ok(());
            }
            session.look(&mut out);
            session.measurements(&mut out, MAX_UNSENT);
            if out.is_empty() {
                moved = Instant::now();
            } else {
                match stream.write(&out) {
                    Ok(size) => {
                        out.drain(..size);
                        moved = Instant::now();
                    }
                    Err(error) if is_later(&error) => {}
                    Err(error) => return Err(error),
                }
            }
            let stays =
                if session.is_connected() { self.is_master(session) } else { session.silence() < self.door.patience };
            if !stays || moved.elapsed() > self.door.patience {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Handles the received commands. Returns false if the connection ends: it has no master, or a frame is invalid.
    fn commands(&self, input: &mut Vec<u8>, session: &mut Session, out: &mut Vec<u8>) -> bool {
        let mut rest = &input[..];
        loop {
            match frame::next(rest, MAX_CTO) {
                Next::Packet(packet, behind) => {
                    if !(session.is_connected() || packet[0] == CONNECT && self.claim()) {
                        return false;
                    }
                    session.receive(packet, out);
                    rest = behind;
                }
                Next::Incomplete => break,
                Next::Corrupt => return false,
            }
        }
        let taken = input.len() - rest.len();
        input.drain(..taken);
        true
    }

    /// Becomes the master, unless there is an active one.
    fn claim(&self) -> bool {
        let mut master = lock(&self.master);
        let free = master.is_none_or(|(number, last_command, measures)| {
            number == self.number || !measures && last_command.elapsed() > self.door.patience
        });
        if free {
            *master = Some((self.number, Instant::now(), false));
        }
        free
    }

    /// Whether this connection still has the master; reports its status.
    fn is_master(&self, session: &Session) -> bool {
        let mut master = lock(&self.master);
        let Some((_, last_command, measures)) = master.as_mut().filter(|(number, ..)| *number == self.number) else {
            return false;
        };
        (*last_command, *measures) =
            (Instant::now().checked_sub(session.silence()).unwrap_or(*last_command), session.is_measuring());
        drop(master);
        self.door.report_sometimes(Some((self.from, session)));
        true
    }
}
