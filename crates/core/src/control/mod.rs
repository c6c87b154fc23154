//! Estimation of the screw's motion and control of its two motors.
//!
//! Blocks over any kind of number: the velocity observer, the current control of the load motor, the position
//! controllers under test ([`PositionController`]), [`mod@compensation`] of friction beside them ([`AxisControl`] joins
//! the two), and what they follow ([`mod@reference`]). Their parameters are computed for a sampling time by
//! `stickslip::design`; the step has no constant that depends on it.
//!
//! A non-finite measurement must not stay in a state or reach a motor: each block documents its reaction.

mod axis;
mod cascade;
pub mod compensation;
mod current;
mod filter;
mod linear;
mod pid;
mod position;
mod predictive;
pub mod reference;
mod velocity_observer;

pub use axis::{AxisControl, AxisControlInput, AxisControlState};
pub use cascade::{Cascade, CascadeState};
pub use current::{CurrentControl, CurrentControlInput, CurrentControlOutput, CurrentControlState};
pub use filter::{FilterInput, FilterState, Notch, TorqueFilter};
pub use linear::{INPUTS, LinearController, LinearState, STATES};
pub use pid::{Pid, PidState};
pub use position::{ControllerInput, ControllerOutput, PositionController, PositionControllerState};
pub use predictive::{
    CAUSES, HORIZON, LimitStep, LimitStepInput, LimitStepOutput, LimitStepState, LimitSteps, Limited, Predictive,
    SPEEDS, STRIDE,
};
pub use velocity_observer::{VelocityObserver, VelocityObserverInput, VelocityObserverOutput, VelocityObserverState};

#[cfg(test)]
#[path = "tests/axis.rs"]
mod axis_tests;
#[cfg(test)]
mod tests;

use crate::scalar::{Mask, Scalar};

/// Beyond any measurement, and small enough that its products stay finite, also in `f32`.
const BEYOND_MEASURE: f64 = 1e12;

/// Whether a machine can have measured or commanded this value: no NaN, no infinity.
#[inline(always)]
pub(crate) fn measurable<T: Scalar>(value: T) -> T::Mask {
    value.abs().lt(T::of(BEYOND_MEASURE))
}

/// `value`, or `instead` where it cannot have been measured.
#[inline(always)]
pub(crate) fn finite_or<T: Scalar>(value: T, instead: T) -> T {
    measurable(value).select(value, instead)
}

/// Whether an integrator may move by `increment` while `demand` exceeds ±`limit`: always back into the range, never
/// further out (conditional integration).
#[inline(always)]
fn may_integrate<T: Scalar>(demand: T, increment: T, limit: T) -> T::Mask {
    demand.abs().le(limit) | (demand * increment).le(T::of(0.0))
}
