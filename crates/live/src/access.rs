//! Access besides the protocol, for XCP and the WebSocket: parameters as numbers, and every cycle as it comes.

use super::Live;
use super::protocol::XcpStatus;
use stickslip_base::parameters::Entry;
use stickslip_base::{Error, Preset};
use stickslip_bench::tuning::Tuning;
use stickslip_recording::capture::{Batch, Sink, Tap};

impl Live {
    /// A sign of life of a client.
    pub fn seen(&self, client: &str) {
        self.shared.operation.seen(client);
    }

    /// A client has gone: it operates no more.
    pub fn left(&self, client: &str) {
        self.shared.operation.left(client);
    }

    /// The newest cycle: its number and its signals, in the order of [`channels`](stickslip_bench::run::channels).
    pub fn newest(&self) -> (u64, Vec<f64>) {
        let newest = self.shared.acquisition.newest();
        (newest.cycle, newest.signals.row())
    }

    /// The active parameters.
    pub fn in_force(&self) -> Preset<f64> {
        self.shared.parameters.preset()
    }

    /// All active values, those of a loaded controller behind those of the preset.
    pub fn entries(&self) -> Vec<Entry> {
        self.shared.parameters.read(Tuning::entries)
    }

    /// All values that the run began with.
    pub fn reference(&self) -> Vec<Entry> {
        self.shared.parameters.read(Tuning::reference_entries)
    }

    /// Gives every row from now on to a sink; it must be quick, captures and records wait for it.
    ///
    /// # Errors
    /// A sink that looks at signals that there are not.
    pub fn attach<S: Sink>(&self, sink: S) -> Result<Tap<S>, Error> {
        self.shared.acquisition.captures().stream.add(sink)
    }

    /// The oldest batch that waits of a stream that [`Call::Samples`](super::protocol::Call::Samples) began.
    ///
    /// # Errors
    /// A number of no such stream.
    pub fn batch(&self, capture: u64) -> Result<Option<Batch>, Error> {
        self.shared.acquisition.captures().batch(capture)
    }

    /// Takes a sink back.
    pub fn detach<S: Sink>(&self, tap: Tap<S>) -> Option<S> {
        self.shared.acquisition.captures().stream.remove(tap)
    }

    /// Replaces the status of one of the addresses for XCP.
    pub fn tell(&self, status: XcpStatus) {
        self.shared.links.tell(status);
    }
}
