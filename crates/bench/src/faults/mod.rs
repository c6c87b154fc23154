//! Injected faults, to test that the bench detects them and stops.
//!
//! An [`Injection`] is a line of text, `encoder-stuck@1.5s` or `counts-lost=0.02@3s`: kind, value and start, in bench
//! time since the start of the bench. [`Faulty`] applies it between machine and software, in the same way in lockstep,
//! in real time and over a link. It is recorded as a change, and a replay injects it again.

mod faulty;
mod injection;

pub(crate) use faulty::Faults;
pub use faulty::{Faulty, FaultyBench};
pub use injection::{Injection, Kind};
