//! Faults on purpose: whether the bench sees them, and stops.
//!
//! An [`Injection`] is a line of text, `encoder-stuck@1.5s` or `counts-lost=0.02@3s`: what, how much, and from when, in
//! bench time since the start. [`Faulty`] puts it between any machine and the software, so that it is the same in
//! lockstep, by the clock and over a link; a record keeps it as a change, and a replay injects it again.

mod faulty;
mod injection;

pub(crate) use faulty::Faults;
pub use faulty::{Faulty, FaultyBench};
pub use injection::{Injection, Kind};
