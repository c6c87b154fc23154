//! XCP by connections.

use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use crate::xcp::MAX_CTO;
use crate::xcp::frame::{self, Next};

use super::session::Session;
use super::{Door, LOOK, is_later};

/// Connections at once, of which one has a master.
const CONNECTIONS: usize = 4;
/// Bytes that may wait for a connection.
const WAITING: usize = 64 << 10;
/// `CONNECT`, which begins a session.
const CONNECT: u8 = 0xff;

/// Who is the master: number of its connection, when it was last heard, whether it measures.
type Master = Arc<Mutex<Option<(usize, Instant, bool)>>>;

fn lock(master: &Master) -> MutexGuard<'_, Option<(usize, Instant, bool)>> {
    master.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes connections until the door closes.
pub(super) fn run(listener: &TcpListener, door: &Door) {
    let (master, open) = (Master::default(), Arc::<AtomicUsize>::default());
    // Where the system refuses, an accepted connection is looked at all the same, the stop only once one comes.
    let _ = listener.set_nonblocking(true);
    let mut threads = Vec::new();
    let mut number = 0;
    while !door.is_closing() {
        let accepted = listener.accept();
        let Ok((stream, from)) = accepted else {
            thread::sleep(LOOK);
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
            // A connection that breaks has ended.
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
    /// Until it ends, or somebody else has taken its place.
    fn serve(&self, stream: TcpStream) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LOOK))?;
        stream.set_write_timeout(Some(LOOK))?;
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
            // Who does not take answers is not asked for more.
            if out.len() < WAITING {
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
            session.measurements(&mut out, WAITING);
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

    /// Commands that have come; false where the connection ends: by its master, or since what comes is no frame.
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

    /// Becomes the master, if there is none that still is.
    fn claim(&self) -> bool {
        let mut master = lock(&self.master);
        let free = master.is_none_or(|(number, heard, measures)| {
            number == self.number || !measures && heard.elapsed() > self.door.patience
        });
        if free {
            *master = Some((self.number, Instant::now(), false));
        }
        free
    }

    /// Whether it still is, and says how it goes.
    fn is_master(&self, session: &Session) -> bool {
        let mut master = lock(&self.master);
        let Some((_, heard, measures)) = master.as_mut().filter(|(number, ..)| *number == self.number) else {
            return false;
        };
        (*heard, *measures) = (Instant::now().checked_sub(session.silence()).unwrap_or(*heard), session.is_measuring());
        drop(master);
        self.door.report_sometimes(Some((self.from, session)));
        true
    }
}
