//! Records a block of [`stickslip_core`] and writes it as C99, as FMU, as loadable controller, and as signal-flow
//! diagram.
//!
//! A block is generic over its numbers. Run once over [`Recorded`](record::Recorded) numbers, it creates the graph of
//! its operations: a [`Program`](record::Program), with one function per block. [`c::project`] prints it, with a
//! self-test, an example and a page. The C code computes the same bits as the Rust code: each operation is the same
//! IEEE operation in the same order, and exponential, sine and cosine are the kernels of
//! `stickslip_core::scalar::kernel`, recorded in the same way.
//!
//! ```
//! use stickslip_codegen::c;
//! use stickslip_core::control::Pid;
//!
//! let source = c::generate::<_, f64>(&Pid::<f64>::default(), "pid")?;
//! assert!(source.source.contains("pid_step"));
//! # Ok::<(), c::NotAName>(())
//! ```
#![forbid(unsafe_code)]

pub mod c;
pub mod diagram;
mod distinct;
pub mod fmu;
pub mod module;
pub mod record;
pub mod tree;
