//! The static difference with a smooth sign.

use super::{LawInput, LawOutput};
use crate::Fields;
use crate::block::Block;
use crate::friction::Stribeck;
use crate::scalar::{Mask, Scalar};

/// The paper's law with a smooth sign instead of the fade-out.
///
/// ```text
/// M_diff = s/√(1 + s²)·[M_R,desired(|Ω_est|) − M_R,own(|Ω_est|)],   s = Ω_est/Ω_s
/// ```
///
/// The torque has no step, but it is less than the characteristic below a few Ω_s, and 0 at rest.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct SmoothDifference<T> {
    /// Desired friction.
    pub desired: Stribeck<T>,
    /// Own friction, friction wheel included, as measured.
    pub own: Stribeck<T>,
    /// Velocity at which 71 % of the difference is rendered.
    #[field(symbol = "Ω_s", unit = "rad/s", range = 1e-4..=10.0, default = 0.1)]
    pub smoothing_velocity: T,
    /// Largest torque of the load motor.
    #[field(symbol = "M_max", unit = "N m", range = 0.0..=200.0, default = 1.4)]
    pub torque_limit: T,
}

impl<T: Scalar> Block<T> for SmoothDifference<T> {
    type State = ();
    type Input = LawInput<T>;
    type Output = LawOutput<T>;

    #[inline(always)]
    fn step(&self, _state: &mut (), input: LawInput<T>, _dt: T) -> LawOutput<T> {
        let velocity = input.estimated_velocity;
        let speed = velocity.abs();
        let difference = self.desired.magnitude(speed) - self.own.magnitude(speed);
        let limited = difference.clamp(-self.torque_limit, self.torque_limit);
        let rendered = limited * smooth_sign(velocity, self.smoothing_velocity);
        // Not `speed ≥ 1e9`: a NaN must give zero.
        input.with(speed.lt(T::of(1e9)).select(rendered, T::of(0.0)))
    }
}

/// s/√(1 + s²) of s = `velocity`/`smoothing`: −1 … 1. s/(1 + |s|) would need no root, but it is 9 % below 1 at ten
/// times the smoothing velocity, instead of 0.5 %.
#[inline(always)]
pub(crate) fn smooth_sign<T: Scalar>(velocity: T, smoothing: T) -> T {
    let s = velocity / smoothing;
    s / root(T::of(1.0) + s * s)
}

/// √x for 1 ≤ x, by logarithm.
#[inline(always)]
fn root<T: Scalar>(x: T) -> T {
    (T::of(0.5) * x.ln()).exp()
}
