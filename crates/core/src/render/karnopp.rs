//! True stick within a band around standstill.

use super::{LawInput, LawOutput, LawState};
use crate::Fields;
use crate::block::Block;
use crate::friction::Stribeck;
use crate::scalar::{Mask, Scalar};

/// Karnopp's rendering law: outside a band around standstill the static difference; within it the load motor adds the
/// holding torque that the own friction lacks.
///
/// ```text
/// |Ω_est| > Ω_b:  M_diff = sign(Ω_est)·[M_desired(|Ω_est|) − M_own(|Ω_est|)]
/// |Ω_est| ≤ Ω_b:  M_diff = clamp(M_M + K_h·Ω_est, ±M_S,desired) − clamp(M_M, ±M_S,own)
/// ```
///
/// D. Karnopp, ASME J. Dyn. Syst. 107 (1985) 100. The commanded torque M_M of the motor is used instead of the torque
/// of the coupling; the term K_h·Ω_est holds the load in its place. No presliding.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Karnopp<T> {
    /// Desired friction.
    pub desired: Stribeck<T>,
    /// Own friction, friction wheel included, as measured.
    pub own: Stribeck<T>,
    /// Half width of the velocity band that counts as standstill.
    #[field(symbol = "Ω_b", unit = "rad/s", range = 1e-4..=10.0, default = 0.1)]
    pub band: T,
    /// Torque per velocity that holds the load within the band.
    #[field(symbol = "K_h", unit = "N m s/rad", range = 0.0..=100.0, default = 0.5)]
    pub holding_gain: T,
    /// Largest torque of the load motor.
    #[field(symbol = "M_max", unit = "N m", range = 0.0..=200.0, default = 1.4)]
    pub torque_limit: T,
}

impl<T: Scalar> Block<T> for Karnopp<T> {
    type State = LawState<T>;
    type Input = LawInput<T>;
    type Output = LawOutput<T>;

    #[inline(always)]
    fn step(&self, _state: &mut LawState<T>, input: LawInput<T>, _dt: T) -> LawOutput<T> {
        let velocity = input.estimated_velocity;
        let speed = velocity.abs();
        let sliding = velocity.sign() * (self.desired.magnitude(speed) - self.own.magnitude(speed));
        let taken = |breakaway: T, torque: T| torque.clamp(-breakaway, breakaway);
        let applied = input.motor_torque;
        let standing = taken(self.desired.breakaway_torque, applied + self.holding_gain * velocity)
            - taken(self.own.breakaway_torque, applied);
        let wanted = speed.gt(self.band).select(sliding, standing);
        let limited = wanted.clamp(-self.torque_limit, self.torque_limit);
        input.with(speed.lt(T::of(1e9)).select(limited, T::of(0.0)))
    }
}
