//! The bench for measurement and calibration tools: a slave of ASAM MCD-1 XCP 1.4 on Ethernet, and its description in
//! ASAP2 1.61.
//!
//! [`Slave`] is the protocol alone: bytes in, bytes out, without socket, thread or clock. A transport drives it:
//! [`ethernet`] by UDP and TCP. The slave serves a [`Bench`]. Addresses are those of a [`Layout`] from the tables of the
//! parameters and signals; the description ([`a2l`](a2l::describe)) has the same source. Addresses are looked up, never
//! dereferenced; unknown ones are refused.
//!
//! **Pages.** Page 0 is the working set, page 1 the read-only reference: the parameters at the start of the run. While the
//! bench runs the working set, each value becomes active as soon as it is complete. While it runs the reference, values are
//! collected on page 0, and all of them become active in one cycle when the bench is switched back.

pub mod ethernet;
pub mod frame;
mod lists;
mod live;
pub mod packet;
mod pages;
mod sampler;
mod slave;

pub use live::LiveBench;
pub use sampler::Sampler;
pub use slave::Slave;
pub use stickslip_generate::xcp::{
    Cell, Content, EPK, EVENT_NAME, Layout, MAX_CTO, MAX_DTO, MEASUREMENTS, PARAMETERS, Parameter, SIZE, VERSION, a2l,
    ascii, cycle_time,
};

use stickslip_base::Error;
use stickslip_base::parameters::Entry;
use stickslip_recording::capture::Tap;

/// The bench of a slave.
pub trait Bench {
    /// Notes activity of the master.
    fn note_activity(&self);
    /// Notes that the master has disconnected.
    fn left(&self);
    /// The newest cycle: its number and its signals.
    fn newest(&self) -> (u64, Vec<f64>);
    /// The active parameters.
    fn in_force(&self) -> Vec<Entry>;
    /// The parameters at the start of the run.
    fn reference(&self) -> Vec<Entry>;
    /// Passes rows to a sampler, from the next cycle on.
    ///
    /// # Errors
    /// The sampler needs unknown signals.
    fn attach(&self, sampler: Sampler) -> Result<Tap<Sampler>, Error>;
    /// Detaches a sampler.
    fn detach(&self, tap: Tap<Sampler>);
    /// Changes parameters, all in one cycle; may take seconds.
    ///
    /// # Errors
    /// The values are invalid or refused.
    fn change(&self, change: &Change) -> Result<(), Error>;
}

/// A change of parameters.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// These values: paths and values as in a file.
    Set(Vec<(String, String)>),
    /// The values at the start of the run.
    Reset,
}
