//! The bench for measurement and calibration tools: a slave of ASAM MCD-1 XCP 1.4 on Ethernet, and its description in
//! ASAP2 1.61.
//!
//! [`Slave`] is the protocol alone: bytes in, bytes out, without socket, thread or clock; whoever has a connection
//! drives it, as [`ethernet`] does by datagrams and connections. Behind it is a [`Bench`]. Addresses are those of a [`Layout`], made from the tables of the parameters and
//! signals, which the description ([`a2l`](a2l::describe)) is printed from as well. No memory is touched: an address is
//! looked up, or refused.
//!
//! **Pages.** Page 0 is the working set, page 1 the reference that the run began with, which cannot be written. While
//! the bench runs the working set each value enters as soon as it is complete. While it runs the reference, values are
//! collected on page 0, and all of them enter with one cycle when the bench is switched back to it.

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

/// The bench behind a slave.
pub trait Bench {
    /// The master is still there.
    fn seen(&self);
    /// The master has gone.
    fn left(&self);
    /// The newest cycle: its number and its signals.
    fn newest(&self) -> (u64, Vec<f64>);
    /// The parameters in force.
    fn in_force(&self) -> Vec<Entry>;
    /// The parameters that the run began with.
    fn reference(&self) -> Vec<Entry>;
    /// From the next cycle on, rows go to this sampler.
    ///
    /// # Errors
    /// It looks at signals that there are not.
    fn attach(&self, sampler: Sampler) -> Result<Tap<Sampler>, Error>;
    /// It gets no more of them.
    fn detach(&self, tap: Tap<Sampler>);
    /// Changes parameters, all together with one cycle; may take seconds.
    ///
    /// # Errors
    /// What does not let them in.
    fn change(&self, change: &Change) -> Result<(), Error>;
}

/// A change of parameters.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// These values: paths and values as in a file.
    Set(Vec<(String, String)>),
    /// As the run began.
    Reset,
}
