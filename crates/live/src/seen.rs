//! What other doors than the protocol need: parameters as numbers, and every cycle as it comes.

use std::time::Instant;

use super::protocol::XcpStatus;
use super::{Live, lock};
use stickslip_base::parameters::Entry;
use stickslip_base::{Error, Preset};
use stickslip_recording::capture::{Batch, Sink, Tap};

impl Live {
    /// A sign of life of a client.
    pub fn seen(&self, client: &str) {
        lock(&self.shared.operator).seen(client, Instant::now());
    }

    /// A client has gone: it operates no more.
    pub fn left(&self, client: &str) {
        lock(&self.shared.operator).left(client);
    }

    /// The newest cycle: its number and its signals, in the order of [`channels`](stickslip_bench::run::channels).
    pub fn newest(&self) -> (u64, Vec<f64>) {
        let newest = lock(&self.shared.newest);
        (newest.cycle, newest.signals.row())
    }

    /// The parameters in force.
    pub fn in_force(&self) -> Preset<f64> {
        *lock(&self.shared.tuning).preset()
    }

    /// All values in force, those of a loaded controller behind those of the preset.
    pub fn entries(&self) -> Vec<Entry> {
        lock(&self.shared.tuning).entries()
    }

    /// All values that the run began with.
    pub fn reference(&self) -> Vec<Entry> {
        lock(&self.shared.tuning).reference_entries()
    }

    /// Gives every row from now on to a sink; it must be quick, captures and records wait for it.
    ///
    /// # Errors
    /// A sink that looks at signals that there are not.
    pub fn attach<S: Sink>(&self, sink: S) -> Result<Tap<S>, Error> {
        lock(&self.shared.captures).stream.add(sink)
    }

    /// The oldest batch that waits of a stream that [`Call::Samples`](super::protocol::Call::Samples) began.
    ///
    /// # Errors
    /// A number of no such stream.
    pub fn batch(&self, capture: u64) -> Result<Option<Batch>, Error> {
        lock(&self.shared.captures).batch(capture)
    }

    /// Takes a sink back.
    pub fn detach<S: Sink>(&self, tap: Tap<S>) -> Option<S> {
        lock(&self.shared.captures).stream.remove(tap)
    }

    /// How it is with one of the addresses at which the bench speaks XCP: replaces what was said of it before.
    pub fn tell(&self, status: XcpStatus) {
        let mut all = lock(&self.shared.xcp);
        match all.iter_mut().find(|known| known.transport == status.transport) {
            Some(known) => *known = status,
            None => all.push(status),
        }
    }
}
