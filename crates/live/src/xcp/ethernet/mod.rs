//! The bench for measurement and calibration tools: XCP over UDP and TCP, one thread each.
//!
//! XCP has no token: anyone who can reach the address can operate the bench.

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

/// Polling interval of the measurements: rows of this time share a datagram.
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// Timeout of a master without command and measurement: after it, another master may connect.
pub const PATIENCE: Duration = Duration::from_secs(10);
/// Interval of the status reports.
const REPORT: Duration = Duration::from_millis(100);

/// The XCP addresses of a bench, open until [`stop`](Self::stop).
pub struct Xcp {
    /// The addresses.
    pub doors: Doors,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Xcp {
    /// Opens the addresses; port 0 selects a free port. A master that sends or receives nothing for longer than `patience`
    /// can be replaced by another.
    ///
    /// # Errors
    /// The system refuses an address.
    pub fn open(live: &Arc<Live>, requested: Doors, patience: Duration) -> io::Result<Self> {
        let udp = requested.udp.map(udp::bind).transpose()?;
        let tcp = requested.tcp.map(TcpListener::bind).transpose()?;
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

    /// Closes the addresses.
    pub fn stop(self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads {
            // A panicked thread has closed its address as well.
            let _ = thread.join();
        }
    }
}

/// One of the addresses, with the data of its sessions.
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
        let slave = slave.with_denials(super::live::denial);
        Session::new(slave, LiveBench::new(self.live.clone(), format!("XCP of {master}")))
    }

    /// Reports its status.
    fn report(&self, session: Option<(SocketAddr, &Session)>) {
        let session = session.filter(|(_, session)| session.is_connected());
        self.live.set_xcp_status(XcpStatus {
            transport: self.transport.into(),
            address: self.address.to_string(),
            master: session.map(|(master, _)| master.to_string()),
            measuring: session.is_some_and(|(_, session)| session.is_measuring()),
            lost: self.lost.load(Ordering::Relaxed),
        });
    }

    /// Reports its status once per [`REPORT`] interval.
    fn report_sometimes(&self, session: Option<(SocketAddr, &Session)>) {
        let mut reported = self.reported.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if reported.is_none_or(|at| at.elapsed() > REPORT) {
            *reported = Some(Instant::now());
            drop(reported);
            self.report(session);
        }
    }
}

/// Whether an error means that nothing can be received or sent at the moment.
fn is_later(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}
