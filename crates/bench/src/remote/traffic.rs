//! Traffic counters of a link, shared between threads.

use std::sync::atomic::{AtomicU64, Ordering};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Event of a frame or of the bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Readings in time.
    Answered,
    /// No readings in time.
    Missing,
    /// An answer after its tick.
    Late,
    /// An answer that arrived twice.
    Doubled,
    /// An unreadable frame.
    FrameError,
    /// A start of the machine.
    Begun,
}

/// Counters of a link in real time.
#[derive(Debug, Default)]
pub struct Traffic([AtomicU64; 6]);

/// Values of the counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Counts {
    /// Ticks with readings in time.
    pub answered: u64,
    /// Ticks without readings in time.
    pub missing: u64,
    /// Answers that arrived after their tick.
    pub late: u64,
    /// Answers that arrived twice.
    pub doubled: u64,
    /// Unreadable frames, on either side.
    pub garbled: u64,
    /// Number of starts of the machine.
    pub begun: u64,
}

impl Traffic {
    /// Counts an event.
    pub fn count(&self, event: Event) {
        self.0[event as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// Present counts.
    pub fn counts(&self) -> Counts {
        let [answered, missing, late, doubled, garbled, begun] = self.0.each_ref().map(|n| n.load(Ordering::Relaxed));
        Counts { answered, missing, late, doubled, garbled, begun }
    }
}
