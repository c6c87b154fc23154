//! The paper's law: a static difference on the estimated velocity.

use super::{LawInput, LawOutput};
use crate::Fields;
use crate::block::Block;
use crate::friction::{Speed, Stribeck};
use crate::scalar::{Mask, Scalar};

/// The paper's rendering law: desired minus own characteristic, faded out around standstill.
///
/// ```text
/// M_diff = sign(Ω_est)·[M_R,desired(|Ω_est|) − M_R,own(|Ω_est|)],   0 while |Ω_est| ≤ Ω_fade
/// ```
///
/// Henrichfreise, Starbek, Reuter, figure 8. Needs the friction wheel for the breakaway torque: within the fade-out
/// interval only the machine's own friction acts, and at its limits the torque steps.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DifferenceTorque<T> {
    /// Desired friction.
    pub desired: Stribeck<T>,
    /// Own friction, friction wheel included, as measured.
    pub own: Stribeck<T>,
    /// Half width of the fade-out interval around standstill. Recommended: 2.5 to 3 times the standard deviation of the
    /// estimated velocity. In a narrower interval noise changes the sign; a wider one renders less of the
    /// characteristic.
    #[field(symbol = "Ω_fade", unit = "rad/s", range = 0.0..=10.0, default = 0.3)]
    pub fade_velocity: T,
    /// Largest torque of the load motor.
    #[field(symbol = "M_max", unit = "N m", range = 0.0..=200.0, default = 1.4)]
    pub torque_limit: T,
}

impl<T: Scalar> DifferenceTorque<T> {
    /// Torque for the load motor [N m] at the estimated screw velocity [rad/s]; 0 for NaN.
    #[inline(always)]
    pub fn torque(&self, velocity: T) -> T {
        let (speed, none) = (velocity.abs(), T::of(0.0));
        let desired = self.desired.run(&mut (), Speed { speed }, none).torque;
        let own = self.own.run(&mut (), Speed { speed }, none).torque;
        let difference = desired - own;
        let limited = difference.clamp(-self.torque_limit, self.torque_limit);
        // Not `speed < fade`: a NaN must give zero and not reach the motor. The same holds for an infinite speed, as
        // ∞·0 is NaN.
        let outside = speed.gt(self.fade_velocity) & speed.lt(T::of(1e9));
        outside.select(limited * velocity.sign(), T::of(0.0))
    }
}

impl<T: Scalar> Block<T> for DifferenceTorque<T> {
    type State = ();
    type Input = LawInput<T>;
    type Output = LawOutput<T>;

    #[inline(always)]
    fn step(&self, _state: &mut (), input: LawInput<T>, _dt: T) -> LawOutput<T> {
        input.with(self.torque(input.estimated_velocity))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> DifferenceTorque<f64> {
        let desired =
            Stribeck { kinetic_torque: 0.12, stribeck_velocity: 1.5, viscous_friction: 1.2e-3, ..Stribeck::default() };
        DifferenceTorque { desired, own: Stribeck::default(), fade_velocity: 0.3, torque_limit: 0.05 }
    }

    #[test]
    fn the_difference_is_odd_faded_out_and_limited() {
        let law = law();
        for velocity in [0.0, 0.1, 0.3, 0.301, 1.0, 5.0, 60.0, 150.0] {
            let torque = law.torque(velocity);
            assert_eq!(torque, -law.torque(-velocity));
            let full = law.desired.magnitude(velocity) - law.own.magnitude(velocity);
            let expected = if velocity > 0.3 { full.clamp(-0.05, 0.05) } else { 0.0 };
            assert_eq!(torque, expected, "at {velocity}");
        }
        assert!(law.torque(5.0) < 0.0 && law.torque(150.0) > 0.0, "the difference changes its sign");
    }

    #[test]
    fn a_non_finite_velocity_gives_no_torque() {
        for velocity in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(law().torque(velocity), 0.0);
        }
    }
}
