//! Rendering laws: the torque that the load motor adds, so that the axis has the desired friction.
//!
//! All laws give M_diff against positive motion: own friction and load motor together give the desired friction.
//! [`DifferenceTorque`], [`SmoothDifference`] and [`Karnopp`] need no model but the two characteristics;
//! [`BristleDifference`] and [`Admittance`] contain an observer of the drive and render presliding. [`Correction`] adds
//! to any law the torque that was missing in a measurement under this law; [`RenderedArm`] adds the torque of an
//! elastic arm on the carriage.
//!
//! `stickslip_design` prepares the selected law for a bench and computes its margins; `stickslip_simulate` selects the
//! law for `auto`.

mod admittance;
mod arm;
mod bristle;
mod correction;
mod difference;
mod karnopp;
mod smooth;

pub use admittance::Admittance;
pub use arm::{ArmOutput, ArmRendering, ArmState, RenderedArm};
pub use bristle::BristleDifference;
pub use correction::{Correction, CorrectionInput, CorrectionOutput, CorrectionTable, POINTS as CORRECTION_POINTS};
pub use difference::DifferenceTorque;
pub use karnopp::Karnopp;
pub use smooth::SmoothDifference;
pub(crate) use smooth::smooth_sign;

use crate::Fields;
use crate::block::Block;
use crate::estimate::DriveObserverState;
use crate::friction::Memory;
use crate::scalar::{Mask, Scalar};

/// The active rendering law.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "law")]
pub enum Law<T> {
    /// No torque.
    Off,
    /// The static difference torque with fade-out.
    Paper(DifferenceTorque<T>),
    /// The static difference torque with a smooth sign.
    Smooth(SmoothDifference<T>),
    /// True stick within a band around standstill.
    Karnopp(Karnopp<T>),
    /// Difference of two frictions with bristles.
    Bristle(BristleDifference<T>),
    /// The load follows a virtual load with the desired friction.
    Admittance(Admittance<T>),
}

/// Inputs of a rendering law.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LawInput<T> {
    /// Estimated velocity of the screw, by encoder and accelerometer alone.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub estimated_velocity: T,
    /// Measured screw angle, unwrapped.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Velocity of the motor by the tacho.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
    /// Measured acceleration of the carriage, with its offset.
    #[field(symbol = "a", unit = "m/s^2")]
    pub acceleration: T,
    /// Measured current of the load motor.
    #[field(symbol = "i", unit = "A")]
    pub current: T,
    /// Torque reference of the drive motor from the next tick on.
    #[field(symbol = "M_M", unit = "N m")]
    pub motor_torque: T,
}

/// Outputs of a rendering law.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LawOutput<T> {
    /// Torque for the load motor, against positive motion.
    #[field(symbol = "M_diff", unit = "N m")]
    pub torque: T,
    /// Velocity of the screw as used by the law, for the back-EMF.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub velocity: T,
    /// Expected current of the load motor at the time when the torque acts.
    #[field(symbol = "i_L", unit = "A")]
    pub current: T,
}

/// State of rendering; each law uses its part, so that laws may be swapped while running.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LawState<T> {
    /// The observer of the drive.
    pub observer: DriveObserverState<T>,
    /// State of the contact with the desired friction.
    pub desired_memory: Memory<T>,
    /// Velocity of the virtual load.
    #[field(symbol = "Ω_v", unit = "rad/s")]
    pub virtual_velocity: T,
    /// Lead of the virtual load.
    #[field(symbol = "φ_v − φ", unit = "rad")]
    pub virtual_lead: T,
    /// Friction torque held against the virtual load.
    #[field(symbol = "M_v", unit = "N m")]
    pub virtual_resistance: T,
    /// Torque reference of the drive motor, active until the next tick.
    #[field(symbol = "M_M", unit = "N m")]
    pub motor_torque: T,
    /// Voltage of the load motor, active until the next tick.
    #[field(symbol = "u", unit = "V")]
    pub voltage: T,
    /// Difference torque of the last tick.
    #[field(symbol = "M_diff", unit = "N m")]
    pub torque: T,
    /// Remaining step between the previous law and this one.
    #[field(symbol = "M_diff", unit = "N m")]
    pub bump: T,
    /// Whether a law has just become active.
    #[field(unit = "1", flag)]
    pub swapped: T,
}

/// Time in which the step between two laws fades [s].
const TAKE_OVER: f64 = 20e-3;

impl<T> Law<T> {
    /// Whether the law follows the drive by an observer of its own.
    pub fn follows(&self) -> bool {
        matches!(self, Law::Bristle(_) | Law::Admittance(_))
    }
}

impl<T: Scalar> Law<T> {
    /// Torque for the load motor in this tick. A law that has just become active starts with the torque of the previous
    /// one.
    // Not inlined: the laws are long, and many functions contain a tick.
    #[inline(never)]
    pub fn render(&self, state: &mut LawState<T>, input: LawInput<T>, dt: T) -> LawOutput<T> {
        let wanted = match self {
            Law::Off => input.with(T::of(0.0)),
            Law::Paper(law) => law.run(&mut (), input, dt),
            Law::Smooth(law) => law.run(&mut (), input, dt),
            Law::Karnopp(law) => law.run(state, input, dt),
            Law::Bristle(law) => law.run(state, input, dt),
            Law::Admittance(law) => law.run(state, input, dt),
        };
        let swapped = state.swapped.gt(T::of(0.5));
        let fading = state.bump * (T::of(1.0) - dt / T::of(TAKE_OVER)).max(T::of(0.0));
        state.bump = swapped.select(state.torque - wanted.torque, fading);
        state.swapped = T::of(0.0);
        LawOutput { torque: wanted.torque + state.bump, ..wanted }
    }
}

impl<T: Scalar> LawInput<T> {
    /// This torque [N m], with motion and current as measured.
    #[inline(always)]
    fn with(&self, torque: T) -> LawOutput<T> {
        LawOutput { torque, velocity: self.estimated_velocity, current: self.current }
    }
}

#[cfg(test)]
mod tests;
