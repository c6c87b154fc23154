//! The software of the bench around its signal path: supervision, and one cycle of both.
//!
//! Without `std`, without allocation, without `unsafe`, without I/O, in plain `f64`. The signal path itself is
//! [`Tick`](stickslip_core::tick::Tick).
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod cycle;
pub mod supervise;
