//! The screw's velocity from its encoder and the accelerometer of the carriage.
//!
//! Differences of counts are coarse at low speed, an integrated acceleration drifts; together they give a velocity
//! without either. The offset of the accelerometer is a state of its own, so that it does not end up in the velocity.
//!
//! It requires no model of the drive or its friction. An observer with an accurate model of the drive has less delay.

use super::{finite_or, measurable};
use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// Three-state observer of angle, velocity and accelerometer offset.
///
/// In current form, the present angle corrects the present estimate:
///
///   φ⁺ = φ + T·Ω + T²/2·α,   Ω⁺ = Ω + T·α,   a₀⁺ = a₀,   α = i_h·(a − a₀),   y = φ
///
/// Between two samples the acceleration is held (zero-order hold). The gains belong to one sampling time; they come
/// from three poles by `stickslip::design::velocity_observer`. The defaults are those of 250 1/s thrice, 4 kHz and a
/// lead of 5 mm.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct VelocityObserver<T> {
    /// Screw angle per carriage travel, 2π over the lead.
    #[field(symbol = "i_h", unit = "rad/m", range = 1.0..=1e5, default = 1256.6370614359173)]
    pub screw_ratio: T,
    /// Part of the angle's deviation that corrects the angle.
    #[field(symbol = "l_φ", unit = "1", range = 0.0..=1.0, default = 0.17097088181959966)]
    pub angle_gain: T,
    /// Correction of the velocity per deviation of the angle.
    #[field(symbol = "l_Ω", unit = "1/s", range = 0.0..=1e5, default = 42.71491669397492)]
    pub velocity_gain: T,
    /// Correction of the accelerometer offset per deviation of the angle. Negative: an angle ahead of the estimate
    /// means that the offset is estimated too large.
    #[field(symbol = "l_a", unit = "m/(s^2 rad)", range = -1e8..=0.0, default = -2.8316991727667413)]
    pub offset_gain: T,
}

/// State of the observer, predicted for the next sample.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct VelocityObserverState<T> {
    /// Screw angle.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Screw velocity.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Accelerometer offset.
    #[field(symbol = "a₀", unit = "m/s^2")]
    pub acceleration_offset: T,
    /// Whether an angle is known; the first measured one is used directly.
    #[field(unit = "1", flag)]
    pub started: T,
}

impl<T: Scalar> VelocityObserverState<T> {
    /// At rest at this angle [rad], with unknown offset.
    pub fn at(angle: T) -> Self {
        VelocityObserverState { angle, started: T::of(1.0), ..Self::default() }
    }
}

/// Inputs of the observer.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct VelocityObserverInput<T> {
    /// Measured screw angle, unwrapped.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Measured acceleration of the carriage, with its offset.
    #[field(symbol = "a", unit = "m/s^2")]
    pub acceleration: T,
}

/// Estimates of the observer for the present sample.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct VelocityObserverOutput<T> {
    /// Screw angle.
    #[field(symbol = "φ_est", unit = "rad")]
    pub angle: T,
    /// Screw velocity.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub velocity: T,
    /// Accelerometer offset.
    #[field(symbol = "a₀", unit = "m/s^2")]
    pub acceleration_offset: T,
    /// Screw acceleration: the measured one without its offset, 0 without a measurement.
    #[field(symbol = "Ω̇_est", unit = "rad/s^2")]
    pub acceleration: T,
}

impl<T: Scalar> Block<T> for VelocityObserver<T> {
    type State = VelocityObserverState<T>;
    type Input = VelocityObserverInput<T>;
    type Output = VelocityObserverOutput<T>;

    /// Without a valid angle the observer coasts on the acceleration, without a valid acceleration at constant speed.
    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let known = state.started.gt(T::of(0.5));
        let measured = finite_or(input.angle, state.angle);
        let expected = known.select(state.angle, measured);

        let deviation = measured - expected;
        let angle = expected + self.angle_gain * deviation;
        let velocity = state.velocity + self.velocity_gain * deviation;
        let offset = state.acceleration_offset + self.offset_gain * deviation;

        let acceleration = self.screw_ratio * (finite_or(input.acceleration, offset) - offset);
        let gained = dt * acceleration;
        state.angle = angle + dt * (velocity + T::of(0.5) * gained);
        state.velocity = velocity + gained;
        state.acceleration_offset = offset;
        state.started = measurable(input.angle).select(T::of(1.0), state.started);
        VelocityObserverOutput { angle, velocity, acceleration_offset: offset, acceleration }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 250e-6;

    /// Quantised angle of an encoder with 10 000 counts.
    fn counted(angle: f64) -> f64 {
        let count = core::f64::consts::TAU / 10_000.0;
        (angle / count).floor() * count
    }

    fn sample(angle: f64, acceleration: f64) -> VelocityObserverInput<f64> {
        VelocityObserverInput { angle, acceleration }
    }

    #[test]
    fn the_first_angle_is_taken_as_it_is() {
        let observer = VelocityObserver::<f64>::default();
        let mut state = VelocityObserverState::default();
        let first = observer.step(&mut state, sample(1e3, 0.0), DT);
        assert_eq!((first.angle, first.velocity), (1e3, 0.0));
        let mut given = VelocityObserverState::at(1e3);
        assert_eq!(observer.step(&mut given, sample(1e3, 0.0), DT), first);
        assert_eq!(given, state);
    }

    #[test]
    fn an_offset_of_half_a_metre_per_second_squared_leaves_the_velocity() {
        let observer = VelocityObserver::<f64>::default();
        let mut state = VelocityObserverState::at(0.0);
        let mut worst: f64 = 0.0;
        for k in 0..4000 {
            let angle = 5.0 * f64::from(k) * DT;
            let out = observer.step(&mut state, sample(angle, 0.5), DT);
            if k > 400 {
                worst = worst.max((out.velocity - 5.0).abs());
            }
        }
        // 0.1 s are 25 time constants of the poles at 250 1/s; the angle carries rounding only.
        assert!(worst < 1e-6, "{worst}");
        assert!((state.acceleration_offset - 0.5).abs() < 1e-9);
    }

    #[test]
    fn held_accelerations_are_followed_exactly() {
        let observer = VelocityObserver::<f64>::default();
        let mut state = VelocityObserverState::at(0.0);
        let (mut angle, mut velocity) = (0.0, 0.0);
        for k in 0..400 {
            let acceleration = Scalar::sin(0.1 * f64::from(k));
            let out = observer.step(&mut state, sample(angle, acceleration), DT);
            // Rounding over 400 steps.
            assert!((out.velocity - velocity).abs() < 1e-10);
            let screw = observer.screw_ratio * acceleration;
            angle += DT * (velocity + 0.5 * DT * screw);
            velocity += DT * screw;
        }
    }

    #[test]
    fn counting_costs_little_of_the_velocity() {
        let observer = VelocityObserver::<f64>::default();
        let mut state = VelocityObserverState::at(0.0);
        let mut squares = 0.0;
        for k in 0..8000 {
            let out = observer.step(&mut state, sample(counted(0.77 * f64::from(k) * DT), 0.0), DT);
            squares += if k < 4000 { 0.0 } else { (out.velocity - 0.77) * (out.velocity - 0.77) };
        }
        // White quantisation noise would give 0.02 rad/s; at 3 samples a count it is coloured.
        assert!(squares / 4000.0 < 0.05 * 0.05, "{}", squares / 4000.0);
    }

    #[test]
    fn a_non_finite_measurement_leaves_no_trace() {
        let observer = VelocityObserver::<f64>::default();
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut state = VelocityObserverState::default();
            observer.step(&mut state, sample(bad, bad), DT);
            assert_eq!(state, VelocityObserverState::default(), "an angle was taken from {bad}");
            observer.step(&mut state, sample(2.0, 0.0), DT);
            state.velocity = 3.0;
            let out = observer.step(&mut state, sample(bad, 0.0), DT);
            assert_eq!((out.angle, out.velocity), (2.0, 3.0), "coasts");
            observer.step(&mut state, sample(2.0, bad), DT);
            assert!(state.angle.is_finite() && state.velocity.is_finite() && state.acceleration_offset.is_finite());
        }
    }
}
