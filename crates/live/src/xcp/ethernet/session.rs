//! A master's session: the slave, and the thread that changes the bench for it.

use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::xcp::{Bench as _, LiveBench, Slave};
use stickslip_base::Error;

/// A master hears that its command takes longer that often: it may wait two seconds from one to the next.
const PENDING: Duration = Duration::from_millis(500);

/// A session.
pub(super) struct Session {
    slave: Slave,
    bench: LiveBench,
    /// What changes the bench for a command, and when the master last heard of it.
    change: Option<(JoinHandle<Result<(), Error>>, Instant)>,
    heard: Instant,
}

impl Session {
    pub(super) fn new(slave: Slave, bench: LiveBench) -> Self {
        Session { slave, bench, change: None, heard: Instant::now() }
    }

    pub(super) fn is_connected(&self) -> bool {
        self.slave.is_connected()
    }

    pub(super) fn is_measuring(&self) -> bool {
        self.slave.is_measuring()
    }

    /// How long the master has not said anything.
    pub(super) fn silence(&self) -> Duration {
        self.heard.elapsed()
    }

    /// A command.
    pub(super) fn receive(&mut self, packet: &[u8], out: &mut Vec<u8>) {
        self.heard = Instant::now();
        if let Some(change) = self.slave.receive(packet, &self.bench, out) {
            // A design may take seconds: measurements go on meanwhile.
            let bench = self.bench.clone();
            self.change = Some((thread::spawn(move || bench.change(&change)), Instant::now()));
        }
    }

    /// The answer to a command that took longer, or that it does.
    pub(super) fn look(&mut self, out: &mut Vec<u8>) {
        if let Some((thread, _)) = self.change.take_if(|(thread, _)| thread.is_finished()) {
            let gone =
                || Error::BenchFault { cycle: 0, reason: "a change of parameters has panicked; report it".into() };
            self.slave.done(thread.join().unwrap_or_else(|_| Err(gone())), out);
        }
        if let Some((_, told)) = self.change.as_mut().filter(|(_, told)| told.elapsed() > PENDING) {
            *told = Instant::now();
            self.slave.pending(out);
        }
    }

    /// Measurements, as long as the output stays below so many bytes.
    pub(super) fn measurements(&mut self, out: &mut Vec<u8>, limit: usize) {
        self.slave.measurements(out, limit);
    }

    /// The master is gone.
    pub(super) fn end(mut self) {
        self.slave.end(&self.bench);
        if let Some((thread, _)) = self.change.take() {
            // Whatever came of it, nobody waits for it.
            let _ = thread.join();
        }
    }
}
