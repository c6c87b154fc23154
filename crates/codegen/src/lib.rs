//! Records a block of [`stickslip_core`] and writes it as C99, as FMU, as controller that is loaded, and as
//! signal-flow diagram.
//!
//! A block is generic over its numbers. Run once over [`Recorded`](record::Recorded) numbers, it leaves the graph of its
//! operations behind: a [`Program`](record::Program), with one function a block. [`c::project`] prints it, with a
//! self-test, an example and a page. The C computes the bits of the Rust: each operation is the same IEEE operation in
//! the same order, and exponential, sine and cosine are the kernels of `stickslip_core::scalar::kernel`, recorded in the
//! same way.
#![forbid(unsafe_code)]

pub mod c;
pub mod diagram;
mod distinct;
pub mod fmu;
pub mod module;
pub mod record;
pub mod tree;
