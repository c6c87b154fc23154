//! Rendered elastic arm: the load motor gives the torque with which a mounted arm would load the carriage.
//!
//! Only the rigid part of the arm needs the measured acceleration; it closes an algebraic loop over sensor and current
//! control. The mode has no direct feed-through: it is driven by the observed angle and velocity, which have neither
//! the accelerometer's offset nor its noise, or, if the observer is too slow, by the acceleration without its offset.

use crate::Fields;
use crate::block::Block;
use crate::control::VelocityObserverOutput;
use crate::drive::ElasticArm;
use crate::scalar::{Mask, Scalar};

/// Rendered arm.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum RenderedArm<T> {
    /// No arm.
    Nothing,
    /// An elastic arm.
    Elastic(ArmRendering<T>),
}

/// The torque of an elastic arm, against positive motion: `J_r·Ω̇ − k_a·q − d_a·q̇`, with the twist q = φ_a − φ.
///
/// Between two samples the velocity of the carriage is constant and the flow of the mode is exact.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ArmRendering<T> {
    /// The arm.
    pub arm: ElasticArm<T>,
    /// Whether the measured acceleration drives the mode, instead of the observed motion.
    #[field(unit = "1", flag)]
    pub by_acceleration: T,
    /// Low-pass of the acceleration for the rigid part: share of a change that passes in one sample. 1: no low-pass.
    #[field(symbol = "γ", unit = "1", range = 1e-4..=1.0, default = 1.0)]
    pub low_pass: T,
    /// Flow of twist and rate over a sample, row by row.
    #[field(unit = "1")]
    pub flow: [[T; 2]; 2],
    /// Largest torque.
    #[field(symbol = "M_max", unit = "N m", range = 0.0..=1000.0, default = 1.4)]
    pub torque_limit: T,
}

/// State of the rendered arm.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ArmState<T> {
    /// Twist of the mode, φ_a − φ.
    #[field(symbol = "q", unit = "rad")]
    pub twist: T,
    /// Rate of the twist.
    #[field(symbol = "q̇", unit = "rad/s")]
    pub rate: T,
    /// Angle of the screw one sample ago.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Velocity of the screw one sample ago.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Acceleration of the screw one sample ago.
    #[field(symbol = "Ω̇", unit = "rad/s^2")]
    pub acceleration: T,
    /// Low-passed acceleration of the screw, for the rigid part.
    #[field(symbol = "Ω̇_r", unit = "rad/s^2")]
    pub felt_acceleration: T,
    /// Whether the arm runs; it starts at rest relative to the carriage.
    #[field(unit = "1", flag)]
    pub started: T,
}

/// Outputs of a rendered arm.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ArmOutput<T> {
    /// Torque for the load motor, against positive motion.
    #[field(symbol = "M_arm", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> Block<T> for ArmRendering<T> {
    type State = ArmState<T>;
    type Input = VelocityObserverOutput<T>;
    type Output = ArmOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut ArmState<T>, motion: VelocityObserverOutput<T>, dt: T) -> ArmOutput<T> {
        let started = state.started.gt(T::of(0.5));
        let delayed = |before: T, now: T| started.select(before, now);
        let (angle, velocity) = (delayed(state.angle, motion.angle), delayed(state.velocity, motion.velocity));
        let acceleration = delayed(state.acceleration, motion.acceleration);

        // The velocity of the carriage steps from its last value to the mean over the last sample, then to its new
        // value.
        let mean = (motion.angle - angle) / dt;
        let by_acceleration = self.by_acceleration.gt(T::of(0.5));
        let half = T::of(0.5) * dt;
        let gained = by_acceleration.select(half * acceleration, mean - velocity);
        let [twist, rate] = [state.twist, state.rate - gained];
        let [[a, b], [c, d]] = self.flow;
        let gained = by_acceleration.select(half * motion.acceleration, motion.velocity - mean);
        let [twist, rate] = [a * twist + b * rate, c * twist + d * rate - gained];
        let felt = state.felt_acceleration;
        let felt_acceleration = felt + self.low_pass * (motion.acceleration - felt);

        *state = ArmState {
            twist,
            rate,
            angle: motion.angle,
            velocity: motion.velocity,
            acceleration: motion.acceleration,
            felt_acceleration,
            started: T::of(1.0),
        };
        let torque = self.arm.rigid_inertia * felt_acceleration - self.arm.torque(twist, rate);
        ArmOutput { torque: torque.clamp(-self.torque_limit, self.torque_limit) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 250e-6;

    fn rendering(by_acceleration: f64) -> ArmRendering<f64> {
        let arm = ElasticArm::default();
        ArmRendering { arm, by_acceleration, flow: arm.flow(DT), ..ArmRendering::default() }
    }

    /// Motion of a swinging carriage, φ = sin ωt, at a time [s].
    fn swinging(omega: f64, time: f64) -> VelocityObserverOutput<f64> {
        let (sin, cos) = (omega * time).sin_cos();
        VelocityObserverOutput {
            angle: sin,
            velocity: omega * cos,
            acceleration: -omega * omega * sin,
            ..Default::default()
        }
    }

    /// The torque of the arm on a swinging carriage is the response of a linear system.
    #[test]
    fn the_torque_is_that_of_an_arm_which_is_dragged_along() {
        for by_acceleration in [0.0, 1.0] {
            for hertz in [1.0, 5.0, 15.0] {
                let omega = core::f64::consts::TAU * hertz;
                let rendering = rendering(by_acceleration);
                let arm = rendering.arm;
                // M = [J_r·s² − (k + d·s)·G]·φ, G = q/φ = −J_a·s²/(J_a·s² + d·s + k)
                let (real, imaginary) = (arm.stiffness - arm.inertia * omega * omega, arm.damping * omega);
                let scale = arm.inertia * omega * omega / (real * real + imaginary * imaginary);
                let twist = [scale * real, -scale * imaginary];
                let mode = [
                    arm.stiffness * twist[0] - arm.damping * omega * twist[1],
                    arm.stiffness * twist[1] + arm.damping * omega * twist[0],
                ];
                let mut state = ArmState::default();
                let (mut largest, mut worst) = (0.0f64, 0.0f64);
                for tick in 0..140_000 {
                    let time = f64::from(tick) * DT;
                    let torque = rendering.step(&mut state, swinging(omega, time), DT).torque;
                    let (sin, cos) = (omega * time).sin_cos();
                    let exact = -arm.rigid_inertia * omega * omega * sin - mode[0] * sin - mode[1] * cos;
                    if time > 30.0 {
                        largest = largest.max(exact.abs());
                        worst = worst.max((torque - exact).abs());
                    }
                }
                // The error is of second order in the faster of carriage and mode.
                let faster = omega.max((arm.stiffness / arm.inertia).sqrt());
                let bound = (faster * DT).powi(2) * largest;
                assert!(worst <= bound, "{hertz} Hz, {by_acceleration}: {worst} of {largest}, {bound}");
            }
        }
    }

    #[test]
    fn it_begins_at_rest_wherever_the_carriage_is_and_stays_there() {
        let rendering = rendering(0.0);
        let mut state = ArmState::default();
        let resting = VelocityObserverOutput { angle: 1e4, ..Default::default() };
        for _ in 0..1000 {
            assert_eq!(rendering.step(&mut state, resting, DT).torque, 0.0);
        }
    }

    #[test]
    fn its_torque_is_limited() {
        let rendering = ArmRendering { torque_limit: 0.01, ..rendering(0.0) };
        let wild = VelocityObserverOutput { acceleration: 1e9, ..Default::default() };
        assert_eq!(rendering.step(&mut ArmState::default(), wild, DT).torque, 0.01);
    }
}
