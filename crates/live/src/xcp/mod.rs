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
mod live;

pub use live::{LiveBench, denial};
pub use stickslip_generate::xcp::{
    Bench, Cell, Change, Content, EPK, EVENT_NAME, Layout, MAX_CTO, MAX_DTO, MEASUREMENTS, PARAMETERS, Parameter, SIZE,
    Sampler, Slave, VERSION, a2l, ascii, cycle_time, frame, packet,
};
