//! The bench open to measurement and calibration tools: XCP by datagrams and by connections, a thread each.
//!
//! XCP knows no token: who reaches the address can operate the bench.

mod session;
mod tcp;
#[cfg(test)]
mod tests;
mod udp;

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::Live;
use crate::protocol::XcpStatus;
use crate::xcp::a2l::{self, Doors};
use crate::xcp::{Layout, LiveBench, Slave};

use session::Session;

/// From look to look at what was measured: rows of this time share a datagram.
const LOOK: Duration = Duration::from_millis(2);
/// Without a command for so long, and without a measurement, a master's place is free for another.
pub const PATIENCE: Duration = Duration::from_secs(10);
/// From report to report.
const REPORT: Duration = Duration::from_millis(100);

/// The doors of a bench, open until this is stopped.
pub struct Xcp {
    /// Where.
    pub doors: Doors,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Xcp {
    /// Opens them; port 0 takes a free one. A master that is silent, or takes nothing, for longer than `patience` leaves
    /// its place to others.
    ///
    /// # Errors
    /// The system refuses an address.
    pub fn open(live: &Arc<Live>, wanted: Doors, patience: Duration) -> io::Result<Self> {
        let udp = wanted.udp.map(udp::bind).transpose()?;
        let tcp = wanted.tcp.map(TcpListener::bind).transpose()?;
        let doors = Doors {
            udp: udp.as_ref().map(std::net::UdpSocket::local_addr).transpose()?,
            tcp: tcp.as_ref().map(TcpListener::local_addr).transpose()?,
        };
        let layout = Arc::new(Layout::with(live.in_force().bench.tick_rate, &live.entries()));
        let description: Arc<str> = a2l::describe(&layout, doors).into();
        let stop = Arc::<AtomicBool>::default();
        let mut threads = Vec::new();
        let door = |transport: &'static str, address: SocketAddr| {
            let door = Door {
                transport,
                address,
                live: live.clone(),
                layout: layout.clone(),
                description: description.clone(),
                stop: stop.clone(),
                patience,
                lost: Arc::default(),
                reported: Arc::default(),
            };
            door.report(None);
            door
        };
        if let (Some(socket), Some(address)) = (udp, doors.udp) {
            let door = door("udp", address);
            threads.push(thread::spawn(move || udp::run(socket, &door)));
        }
        if let (Some(listener), Some(address)) = (tcp, doors.tcp) {
            let door = door("tcp", address);
            threads.push(thread::spawn(move || tcp::run(&listener, &door)));
        }
        Ok(Xcp { doors, stop, threads })
    }

    /// Closes them.
    pub fn stop(self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads {
            // One that has panicked is closed as well.
            let _ = thread.join();
        }
    }
}

/// One of the doors: what a session needs.
#[derive(Clone)]
struct Door {
    transport: &'static str,
    address: SocketAddr,
    live: Arc<Live>,
    layout: Arc<Layout>,
    description: Arc<str>,
    stop: Arc<AtomicBool>,
    patience: Duration,
    lost: Arc<AtomicU64>,
    reported: Arc<Mutex<Option<Instant>>>,
}

impl Door {
    fn is_closing(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// A session of a master at an address.
    fn session(&self, master: SocketAddr) -> Session {
        let slave = Slave::new(self.layout.clone(), self.description.clone(), self.lost.clone());
        Session::new(slave, LiveBench::new(self.live.clone(), format!("XCP of {master}")))
    }

    /// Tells how it is.
    fn report(&self, session: Option<(SocketAddr, &Session)>) {
        let session = session.filter(|(_, session)| session.is_connected());
        self.live.tell(XcpStatus {
            transport: self.transport.into(),
            address: self.address.to_string(),
            master: session.map(|(master, _)| master.to_string()),
            measuring: session.is_some_and(|(_, session)| session.is_measuring()),
            lost: self.lost.load(Ordering::Relaxed),
        });
    }

    /// Tells it now and then.
    fn report_sometimes(&self, session: Option<(SocketAddr, &Session)>) {
        let mut reported = self.reported.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if reported.is_none_or(|at| at.elapsed() > REPORT) {
            *reported = Some(Instant::now());
            drop(reported);
            self.report(session);
        }
    }
}

/// Whether an error says that nothing has come, or nothing can go, at the moment.
fn is_later(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}
