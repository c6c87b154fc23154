//! A running bench for a slave.

use std::sync::Arc;

use super::packet::Refusal;
use super::{Bench, Change, Sampler};
use crate::protocol::Call;
use crate::{Live, LiveError};
use stickslip_base::Error;
use stickslip_base::parameters::Entry;
use stickslip_recording::capture::Tap;

/// A live bench for one of its clients.
#[derive(Clone)]
pub struct LiveBench {
    live: Arc<Live>,
    client: String,
}

impl LiveBench {
    /// For a client of this name.
    pub fn new(live: Arc<Live>, client: String) -> Self {
        LiveBench { live, client }
    }
}

impl Bench for LiveBench {
    fn note_activity(&self) {
        self.live.note_activity(&self.client);
    }

    fn left(&self) {
        self.live.left(&self.client);
    }

    fn newest(&self) -> (u64, Vec<f64>) {
        self.live.newest()
    }

    fn in_force(&self) -> Vec<Entry> {
        self.live.entries()
    }

    fn reference(&self) -> Vec<Entry> {
        self.live.reference()
    }

    fn attach(&self, sampler: Sampler) -> Result<Tap<Sampler>, Error> {
        self.live.attach(sampler)
    }

    fn detach(&self, tap: Tap<Sampler>) {
        drop(self.live.detach(tap));
    }

    fn change(&self, change: &Change) -> Result<(), Error> {
        let call = match change {
            Change::Set(values) => Call::Set { values: values.iter().cloned().collect() },
            Change::Reset => Call::Reset {},
        };
        self.live.call(&self.client, call).map(drop)
    }
}

/// Codes of the errors of a live bench.
pub fn denial(error: &Error) -> Option<Refusal> {
    match error.of()? {
        LiveError::Operated { .. } => Some(Refusal::AccessDenied),
        LiveError::Busy { .. } => Some(Refusal::NotNow),
        _ => None,
    }
}
