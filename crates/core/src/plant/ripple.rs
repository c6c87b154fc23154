//! Torque ripple and cogging of the load motor.

use core::f64::consts::TAU;

use super::MachineState;
use crate::Fields;
use crate::drive::Winding;
use crate::scalar::Scalar;

/// Torque ripple of the load motor.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum MotorRipple<T> {
    /// No ripple.
    Smooth,
    /// With torque ripple and cogging.
    Rippled(RippledMotor<T>),
}

/// A torque constant K·(1 + r·sin(n_r·φ)), which the back-EMF shares, and a cogging torque M_cog·sin(n_c·φ).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct RippledMotor<T> {
    /// Share by which the torque constant ripples.
    #[field(symbol = "r", unit = "1", range = 0.0..=0.5, default = 0.02)]
    pub ripple: T,
    /// Periods of the ripple per revolution.
    #[field(symbol = "n_r", unit = "1", range = 1.0..=1000.0, default = 26.0, whole)]
    pub ripple_periods: T,
    /// Amplitude of the cogging torque.
    #[field(symbol = "M_cog", unit = "N m", range = 0.0..=1.0, default = 2e-3)]
    pub cogging: T,
    /// Periods of the cogging torque per revolution.
    #[field(symbol = "n_c", unit = "1", range = 1.0..=1000.0, default = 24.0, whole)]
    pub cogging_periods: T,
}

impl<T: Scalar> MotorRipple<T> {
    /// Torque besides K·i against positive motion [N m], and voltage induced besides K·Ω [V].
    #[inline(always)]
    pub(super) fn of(&self, winding: &Winding<T>, state: &MachineState<T>) -> (T, T) {
        match self {
            MotorRipple::Smooth => (T::of(0.0), T::of(0.0)),
            MotorRipple::Rippled(motor) => {
                let turns = state.angle * T::of(1.0 / TAU);
                let angle = (turns - turns.floor()) * T::of(TAU);
                let constant = winding.torque_constant * motor.ripple * (motor.ripple_periods * angle).sin();
                let cogging = motor.cogging * (motor.cogging_periods * angle).sin();
                (cogging + constant * state.load_current, constant * state.velocity)
            }
        }
    }
}
