//! Access for XCP and the WebSocket, in addition to the protocol: parameters as numbers, and every cycle.

use super::Live;
use super::protocol::XcpStatus;
use stickslip_base::parameters::Entry;
use stickslip_base::{Error, Preset};
use stickslip_bench::tuning::Tuning;
use stickslip_recording::capture::{Batch, Sink, Tap};

impl Live {
    /// Notes activity of a client, for the timeout of the operator.
    pub fn note_activity(&self, client: &str) {
        self.shared.operation.note_activity(client);
    }

    /// Notes that a client has disconnected: it is no longer the operator.
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

    /// All active values: those of the preset, then those of a loaded controller.
    pub fn entries(&self) -> Vec<Entry> {
        self.shared.parameters.read(Tuning::entries)
    }

    /// All values at the start of the run.
    pub fn reference(&self) -> Vec<Entry> {
        self.shared.parameters.read(Tuning::reference_entries)
    }

    /// Passes every row from now on to a sink; it must be fast, as captures and recordings wait for it.
    ///
    /// # Errors
    /// The sink needs unknown signals.
    pub fn attach<S: Sink>(&self, sink: S) -> Result<Tap<S>, Error> {
        self.shared.acquisition.captures().stream.add(sink)
    }

    /// The oldest unread batch of a stream started by [`Call::Samples`](super::protocol::Call::Samples).
    ///
    /// # Errors
    /// Unknown number of a stream.
    pub fn batch(&self, capture: u64) -> Result<Option<Batch>, Error> {
        self.shared.acquisition.captures().batch(capture)
    }

    /// Detaches a sink and returns it.
    pub fn detach<S: Sink>(&self, tap: Tap<S>) -> Option<S> {
        self.shared.acquisition.captures().stream.remove(tap)
    }

    /// Replaces the status of one of the XCP addresses.
    pub fn set_xcp_status(&self, status: XcpStatus) {
        self.shared.links.set_xcp_status(status);
    }
}
