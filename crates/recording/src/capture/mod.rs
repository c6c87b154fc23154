//! Views of a running bench: captures with a trigger and a history before it, live streams that keep every spike, and a
//! history with zoom, each with an exact account of every cycle.
//!
//! A [`Stream`] receives one row per tick: the number of the cycle and all signals. It passes them to any number of
//! sinks, which are added and removed while it runs: a [`Capture`] stores the rows around a [`Trigger`], an
//! [`Envelope`] reduces a live stream to minimum, maximum and last value of a number of ticks, [`Batches`] provide
//! every row, a [`Pyramid`] returns any span of its samples with a limited number of points, and a [`History`] reaches
//! further back with extremes only. All are plain data: no
//! thread, no clock, the same rows give the same result. Use them on an ordinary thread, after the ring of the
//! real-time loop.
//!
//! A cycle without a row is lost: the ring was full, or the tick was missed. Each sink counts it with its place. At any
//! time, for each sink, every cycle since it was added is either stored, or discarded for a stated reason, or lost
//! ([`Account`]).
//!
//! ```
//! use stickslip_recording::capture::{Capture, Keep, Plan, Stream, Trigger};
//!
//! let trigger: Trigger = "velocity rises through 0.1, hysteresis 0.02".parse()?;
//! let plan = Plan { signals: vec![1], decimation: 1, before: 3, after: 2, keep: Keep::First(1) };
//! let mut stream = Stream::new(2);
//! let tap = stream.add(Capture::new(plan, &trigger, &["position", "velocity"], 1_000_000)?)?;
//! for cycle in 0..10 {
//!     stream.push(cycle, &[0.0, 0.03 * cycle as f64])?;
//! }
//! let segment = stream.get_mut(&tap).and_then(Capture::take).expect("0.12 at cycle 4");
//! assert_eq!(segment.cycles, [1, 2, 3, 4, 5, 6]);
//! assert_eq!((segment.trigger, segment.cycles[segment.trigger]), (3, 4));
//! assert_eq!(segment.columns, [[0.03, 0.06, 0.09, 0.12, 0.15, 0.18]]);
//! # Ok::<(), stickslip_base::Error>(())
//! ```

mod batches;
mod detector;
mod envelope;
mod extremes;
mod history;
mod past;
mod plan;
mod pyramid;
mod segment;
mod stream;
mod trigger;
mod triggered;

#[cfg(test)]
mod tests;

pub use batches::{Batch, Batches};
pub use envelope::{Envelope, Point};
pub use extremes::Extremes;
pub use past::{History, Past};
pub use plan::{Keep, Plan};
pub use pyramid::{Block, Pyramid};
pub use segment::{Gap, Segment};
pub use stream::{Account, Row, Sink, Stream, Tap};
pub use trigger::{Condition, Side, Slope, Test, Trigger};
pub use triggered::{Capture, Stage};

use crate::RecordingError;
use stickslip_base::Error;

/// Refuses more than `limit` bytes.
fn admit(what: &'static str, bytes: u128, limit: usize, remedy: &'static str) -> Result<(), Error> {
    if bytes <= limit as u128 {
        Ok(())
    } else {
        Err(RecordingError::TooMuchMemory { what, bytes, limit, remedy }.into())
    }
}
