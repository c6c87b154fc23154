//! Supervision: homing and safety, in the same tick as the signal path and just as deterministic.
//!
//! No signal path: plain `f64`, real `if`s, and states that are enums. A recorded run replays it bit for bit.

mod homing;
mod safety;

pub use homing::{Homing, HomingFault, HomingInput, HomingPlan, HomingProgress};
pub use safety::{Fault, Refusal, Request, Safety, SafetyInput, SafetyLimits, SafetyState};
