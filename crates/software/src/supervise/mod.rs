//! Supervision: homing and safety, in the same tick as the signal path and just as deterministic.
//!
//! Supervision is not a signal path: it uses plain `f64`, `if` and enums. The replay of a recorded run repeats it bit
//! for bit.
//!
//! `safety.rs` has the states, `remedy.rs` the remedy of each fault, `monitor.rs` the comparisons, `brake.rs` the
//! brake, which uses neither controller nor observer. `crates/stickslip/tests/laboratory/running/safety.rs` injects each fault and writes
//! `docs/studies/safety.md`; the example `no_false_alarm` runs an hour without a fault.

mod brake;
mod fault;
mod homing;
mod limits;
mod monitor;
mod remedy;
mod safety;
mod snapshot;

pub use brake::Brake;
pub use fault::{Cause, ExternalFault, Fault, MachineFault, Role};
pub use homing::{Homing, HomingFault, HomingInput, HomingPlan, HomingProgress};
pub use limits::SafetyLimits;
pub use remedy::{Concern, Recovery, Remedy};
pub use safety::{Braking, Refusal, Request, Safety, SafetyInput, SafetyState};
