//! What happens on a link, counted where it happens and looked at from elsewhere.

use std::sync::atomic::{AtomicU64, Ordering};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What befell a frame or the bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    Answered,
    Missing,
    Late,
    Doubled,
    FrameError,
    Begun,
}

/// Counters of a link by the clock.
#[derive(Debug, Default)]
pub struct Traffic([AtomicU64; 6]);

/// What they say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Counts {
    /// Ticks whose readings came in time.
    pub answered: u64,
    /// Ticks whose readings did not.
    pub missing: u64,
    /// Answers that came behind their tick.
    pub late: u64,
    /// Answers that came a second time.
    pub doubled: u64,
    /// Frames that could not be read, on either side.
    pub garbled: u64,
    /// How often the machine was taken up.
    pub begun: u64,
}

impl Traffic {
    pub(super) fn count(&self, event: Event) {
        self.0[event as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// As known so far.
    pub fn counts(&self) -> Counts {
        let [answered, missing, late, doubled, garbled, begun] = self.0.each_ref().map(|n| n.load(Ordering::Relaxed));
        Counts { answered, missing, late, doubled, garbled, begun }
    }
}
