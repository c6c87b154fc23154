//! A master's session: the slave, and the thread that changes the bench for it.

use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::xcp::{Bench as _, LiveBench, Slave};
use stickslip_base::Error;

/// Interval of the notices that a command takes longer; the master waits two seconds for each.
const PENDING: Duration = Duration::from_millis(500);

/// A session.
pub(super) struct Session {
    slave: Slave,
    bench: LiveBench,
    /// The thread that changes the bench for a command, and the time of the last notice to the master.
    change: Option<(JoinHandle<Result<(), Error>>, Instant)>,
    last_command: Instant,
}

impl Session {
    pub(super) fn new(slave: Slave, bench: LiveBench) -> Self {
        Session { slave, bench, change: None, last_command: Instant::now() }
    }

    pub(super) fn is_connected(&self) -> bool {
        self.slave.is_connected()
    }

    pub(super) fn is_measuring(&self) -> bool {
        self.slave.is_measuring()
    }

    /// Time since the last command of the master.
    pub(super) fn silence(&self) -> Duration {
        self.last_command.elapsed()
    }

    /// Handles a command.
    pub(super) fn receive(&mut self, packet: &[u8], out: &mut Vec<u8>) {
        self.last_command = Instant::now();
        if let Some(change) = self.slave.receive(packet, &self.bench, out) {
            // A design may take seconds; measurements continue meanwhile.
            let bench = self.bench.clone();
            self.change = Some((thread::spawn(move || bench.change(&change)), Instant::now()));
        }
    }

    /// Sends the response to a longer command, or a notice that it takes longer.
    pub(super) fn look(&mut self, out: &mut Vec<u8>) {
        if let Some((thread, _)) = self.change.take_if(|(thread, _)| thread.is_finished()) {
            let gone =
                || Error::BenchFault { cycle: 0, reason: "a change of parameters has panicked; report it".into() };
            self.slave.done(thread.join().unwrap_or_else(|_| Err(gone())), out);
        }
        if let Some((_, notice)) = self.change.as_mut().filter(|(_, notice)| notice.elapsed() > PENDING) {
            *notice = Instant::now();
            self.slave.pending(out);
        }
    }

    /// Appends measurements, up to a limit of the output [bytes].
    pub(super) fn measurements(&mut self, out: &mut Vec<u8>, limit: usize) {
        self.slave.measurements(out, limit);
    }

    /// Ends the session.
    pub(super) fn end(mut self) {
        self.slave.end(&self.bench);
        if let Some((thread, _)) = self.change.take() {
            // Its result is no longer needed.
            let _ = thread.join();
        }
    }
}
