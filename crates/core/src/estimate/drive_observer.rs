//! Observer of the drive, with friction in its model.

use super::{DriveModel, DriveModelInput, DriveModelOutput, DriveState};
use crate::Fields;
use crate::block::Block;
use crate::control::finite_or;
use crate::drive::{Delay, LONGEST_DELAY};
use crate::fields::Fields as _;
use crate::scalar::{Mask, Scalar};

/// Model of the accelerometer, prepared for a step: second order.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AccelerationSensor<T> {
    /// Travel of the carriage per angle of the screw.
    #[field(symbol = "1/i_h", unit = "m/rad", range = 1e-5..=1.0, default = 7.957_747_154_594_768e-4)]
    pub carriage_ratio: T,
    /// Exact step. Rows: value and rate; columns: value, rate and held input.
    #[field(unit = "1")]
    pub flow: [[T; 3]; 2],
}

/// Correction of each state per deviation of a measurement; one column each for encoder, tacho and accelerometer.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ObserverGains<T> {
    /// Correction of the angle.
    #[field(unit = "rad", range = -1e9..=1e9)]
    pub angle: [T; 3],
    /// Correction of the twist.
    #[field(unit = "rad", range = -1e9..=1e9)]
    pub twist: [T; 3],
    /// Correction of the motor's velocity.
    #[field(unit = "rad/s", range = -1e9..=1e9)]
    pub motor_velocity: [T; 3],
    /// Correction of the velocity.
    #[field(unit = "rad/s", range = -1e9..=1e9)]
    pub velocity: [T; 3],
    /// Correction of the torque missing in the model.
    #[field(unit = "N m", range = -1e9..=1e9)]
    pub torque: [T; 3],
    /// Correction of the accelerometer's offset.
    #[field(unit = "m/s^2", range = -1e9..=1e9)]
    pub offset: [T; 3],
    /// Correction of the tacho's low-pass.
    #[field(unit = "rad/s", range = -1e9..=1e9)]
    pub tacho: [T; 3],
    /// Correction of the accelerometer's value.
    #[field(unit = "m/s^2", range = -1e9..=1e9)]
    pub acceleration: [T; 3],
    /// Correction of the accelerometer's rate.
    #[field(unit = "m/s^3", range = -1e9..=1e9)]
    pub acceleration_rate: [T; 3],
    /// Correction of the load current per deviation of the measured one.
    #[field(unit = "1", range = 0.0..=1.0, default = 0.3)]
    pub current: T,
}

/// Observer of the whole drive: the model takes one or more steps in a tick, and the measurements of each tick correct
/// it.
///
/// The gains are those of a stationary Kalman filter for the linear drive with an unknown torque on the load
/// (`stickslip::design::drive_observer`). This torque is the error of the modelled friction, provided that it varies
/// slowly. Presliding is smaller than one count of most encoders, so that only the model shows it. The ripple of a
/// tacho grows with speed, which constant gains cannot represent: there are two sets of gains, weighted by the speed.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveObserver<T> {
    /// The drive, prepared for a step.
    pub model: DriveModel<T>,
    /// Steps of the model in a tick.
    #[field(fixed)]
    pub steps: usize,
    /// Delay of the drive motor's torque.
    pub motor_delay: Delay<T>,
    /// Delay of the load motor's voltage.
    pub load_delay: Delay<T>,
    /// Share of the difference between input and output by which the tacho's low-pass moves in a step.
    #[field(unit = "1", range = 0.0..=1.0, default = 1.0)]
    pub tacho_share: T,
    /// The accelerometer.
    pub accelerometer: AccelerationSensor<T>,
    /// Correction by the measurements at standstill.
    pub gains: ObserverGains<T>,
    /// Correction at high speed, where the commutator's ripple spoils the tacho.
    pub fast_gains: ObserverGains<T>,
    /// Speed at which the correction is the mean of both sets of gains.
    #[field(symbol = "Ω_r", unit = "rad/s", range = 1e-3..=1e6, default = 1e3)]
    pub ripple_velocity: T,
}

/// State of the observer, predicted for the next tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveObserverState<T> {
    /// The drive.
    pub drive: DriveState<T>,
    /// Torque references of the drive motor that have not acted yet, the newest first.
    #[field(symbol = "M_M", unit = "N m")]
    pub motor_torques: [T; LONGEST_DELAY],
    /// Voltages of the load motor that have not acted yet, the newest first.
    #[field(symbol = "u", unit = "V")]
    pub voltages: [T; LONGEST_DELAY],
    /// Torque missing in the model, against positive motion.
    #[field(symbol = "r", unit = "N m")]
    pub residual: T,
    /// Accelerometer offset.
    #[field(symbol = "a₀", unit = "m/s^2")]
    pub offset: T,
    /// Tacho behind its low-pass.
    #[field(unit = "rad/s")]
    pub tacho: T,
    /// Accelerometer: value.
    #[field(unit = "m/s^2")]
    pub acceleration: T,
    /// Accelerometer: rate.
    #[field(unit = "m/s^3")]
    pub acceleration_rate: T,
    /// Whether the observer runs; its initial state is that of the first measurements.
    #[field(unit = "1", flag)]
    pub started: T,
}

/// Inputs of the observer at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveObserverInput<T> {
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
    /// Torque reference of the drive motor, sent in the tick before.
    #[field(symbol = "M_M", unit = "N m")]
    pub motor_torque: T,
    /// Voltage for the load motor, sent in the tick before.
    #[field(symbol = "u", unit = "V")]
    pub voltage: T,
    /// Initial velocity of the observer.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub estimated_velocity: T,
}

/// Estimates of the observer for the present tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Estimate<T> {
    /// Screw angle.
    #[field(symbol = "φ_est", unit = "rad")]
    pub angle: T,
    /// Screw velocity.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub velocity: T,
    /// Velocity of the motor.
    #[field(symbol = "Ω_M,est", unit = "rad/s")]
    pub motor_velocity: T,
}

impl<T: Scalar> DriveObserver<T> {
    /// Corrects the state by the measurements of this tick.
    #[inline(always)]
    fn correct(&self, state: &mut DriveObserverState<T>, input: &DriveObserverInput<T>) {
        let known = state.started.gt(T::of(0.5));
        let begin = self.begin(input);
        *state = state.merge(&begin, &mut |running, fresh| known.select(running, fresh));

        let error = [
            finite_or(input.angle, state.drive.angle) - state.drive.angle,
            finite_or(input.motor_velocity, state.tacho) - state.tacho,
            finite_or(input.acceleration, state.acceleration + state.offset) - state.acceleration - state.offset,
        ];
        let by = |gain: [T; 3]| gain[0] * error[0] + gain[1] * error[1] + gain[2] * error[2];
        let ratio = state.drive.velocity / self.ripple_velocity;
        let slow = T::of(1.0) / (T::of(1.0) + ratio * ratio);
        let gains = self.gains.merge(&self.fast_gains, &mut |at_rest, fast| fast + slow * (at_rest - fast));
        let drive = &mut state.drive;
        drive.angle += by(gains.angle);
        drive.twist += by(gains.twist);
        drive.motor_velocity += by(gains.motor_velocity);
        drive.velocity += by(gains.velocity);
        drive.load_current += gains.current * (finite_or(input.current, drive.load_current) - drive.load_current);
        state.offset += by(gains.offset);
        state.tacho += by(gains.tacho);
        state.acceleration += by(gains.acceleration);
        state.acceleration_rate += by(gains.acceleration_rate);
        let missing = by(gains.torque);
        state.residual += missing;
        // The held torque changes by the same amount, so that the correction does not kick the velocity.
        state.drive.load_resistance += missing;
    }

    /// The state before the first measurement.
    #[inline(always)]
    pub(crate) fn begin(&self, input: &DriveObserverInput<T>) -> DriveObserverState<T> {
        let zero = T::of(0.0);
        let velocity = finite_or(input.estimated_velocity, zero);
        DriveObserverState {
            drive: DriveState {
                angle: finite_or(input.angle, zero),
                velocity,
                twist: input.motor_torque / self.model.drive.coupling_stiffness,
                motor_velocity: velocity,
                load_current: finite_or(input.current, zero),
                motor_torque: input.motor_torque,
                ..DriveState::default()
            },
            motor_torques: [input.motor_torque; LONGEST_DELAY],
            voltages: [input.voltage; LONGEST_DELAY],
            offset: finite_or(input.acceleration, zero),
            tacho: velocity,
            started: T::of(1.0),
            ..DriveObserverState::default()
        }
    }

    /// Corrects the state by the measurements and advances it to the next tick; `passenger` is called with each step
    /// and its length [s].
    #[inline(always)]
    pub fn follow(
        &self,
        state: &mut DriveObserverState<T>,
        input: &DriveObserverInput<T>,
        dt: T,
        mut passenger: impl FnMut(&DriveModelOutput<T>, T),
    ) -> Estimate<T> {
        self.correct(state, input);
        let DriveState { angle, velocity, motor_velocity, .. } = state.drive;
        let estimate = Estimate { angle, velocity, motor_velocity };
        let dt = dt / T::of(self.steps as f64);
        let motor_torque = self.motor_delay.next(&mut state.motor_torques, input.motor_torque);
        let voltage = self.load_delay.next(&mut state.voltages, input.voltage);
        for _ in 0..self.steps {
            let held = DriveModelInput { motor_torque, voltage, resistance: state.residual };
            let middle = self.model.run(&mut state.drive, held, dt);
            state.tacho += self.tacho_share * (middle.motor_velocity - state.tacho);
            let felt = self.accelerometer.carriage_ratio * middle.acceleration;
            let [value, rate] = self.accelerometer.flow;
            let (a, v) = (state.acceleration, state.acceleration_rate);
            state.acceleration = value[0] * a + value[1] * v + value[2] * felt;
            state.acceleration_rate = rate[0] * a + rate[1] * v + rate[2] * felt;
            passenger(&middle, dt);
        }
        // A value that is NaN or at least 1e9 is implausible: the observer restarts with the next measurement.
        let mut sane = T::of(0.0).le(T::of(0.0));
        let _ = state.merge(state, &mut |number, _| {
            sane = sane & number.abs().lt(T::of(1e9));
            number
        });
        state.started = sane.select(T::of(1.0), T::of(0.0));
        let fresh = self.begin(input);
        *state = state.merge(&fresh, &mut |kept, new| sane.select(kept, new));
        estimate
    }

    /// The drive at the tick from which on the load motor's present command acts, under the commands sent before and
    /// this torque of the drive motor [N m]; `passenger` is called with each step and its length [s].
    #[inline(always)]
    pub fn after_pending_commands(
        &self,
        state: &DriveObserverState<T>,
        motor_torque: T,
        dt: T,
        mut passenger: impl FnMut(&DriveModelOutput<T>, T),
    ) -> DriveState<T> {
        let dt = dt / T::of(self.steps as f64);
        let mut drive = state.drive;
        for lead in 0..self.load_delay.whole() {
            let held = DriveModelInput {
                motor_torque: self.motor_delay.ahead(&state.motor_torques, motor_torque, lead),
                // The newest voltage is not known yet; it acts later.
                voltage: self.load_delay.ahead(&state.voltages, state.voltages[0], lead),
                resistance: state.residual,
            };
            for _ in 0..self.steps {
                passenger(&self.model.run(&mut drive, held, dt), dt);
            }
        }
        drive
    }

    /// Predicts the model over `steps` steps from `drive` on, the state of [`after_pending_commands`](Self::after_pending_commands), with
    /// the torque of the load motor given by `torque` [N m]: a function of the middle of the step, of the own friction
    /// there [N m], and of the length of the step [s]. Returns the mean torque [N m] of all steps but the first `skip`.
    #[inline(always)]
    pub fn look_ahead(
        &self,
        (state, mut drive): (&DriveObserverState<T>, DriveState<T>),
        motor_torque: T,
        (skip, steps): (usize, usize),
        dt: T,
        mut torque: impl FnMut(&DriveModelOutput<T>, T, T) -> T,
    ) -> T {
        let dt = dt / T::of(self.steps as f64);
        let constant = self.model.winding.torque_constant;
        let motor_torque = self.motor_delay.ahead(&state.motor_torques, motor_torque, self.load_delay.whole());
        let mut asked = constant * drive.load_current;
        // The load current is removed from the model; its torque is held instead.
        drive.load_current = T::of(0.0);
        drive.load_resistance += asked;
        let mut sum = T::of(0.0);
        for step in 0..steps {
            let held = DriveModelInput {
                motor_torque,
                voltage: -constant * drive.velocity,
                resistance: state.residual + asked,
            };
            let middle = self.model.run(&mut drive, held, dt);
            asked = torque(&middle, middle.friction_torque + state.residual, dt);
            if step >= skip {
                sum += asked;
            }
        }
        sum / T::of((steps - skip) as f64)
    }
}

impl<T: Scalar> Block<T> for DriveObserver<T> {
    type State = DriveObserverState<T>;
    type Input = DriveObserverInput<T>;
    type Output = Estimate<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Estimate<T> {
        self.follow(state, &input, dt, |_, _| {})
    }
}

#[cfg(test)]
impl DriveObserver<f64> {
    /// Observer with low gains for a drive with this inertia [kg m²] and friction; encoder and tacho correct it every
    /// `dt` [s].
    pub(crate) fn unhurried(inertia: f64, friction: crate::friction::Friction<f64>, dt: f64) -> Self {
        use crate::drive::{TwoMass, Winding};
        let steps = 8;
        let drive = TwoMass { motor_inertia: 0.4 * inertia, load_inertia: 0.6 * inertia, ..TwoMass::default() };
        let winding = Winding { torque_constant: 0.0, ..Winding::default() };
        let motor = crate::friction::Friction::default();
        let model = DriveModel::new(drive, winding, 0.1e-3, motor, friction, dt / steps as f64);
        let gains = ObserverGains {
            angle: [0.5, 0.0, 0.0],
            motor_velocity: [0.0, 0.3, 0.0],
            velocity: [0.0, 0.3, 0.0],
            tacho: [0.0, 0.3, 0.0],
            ..ObserverGains::default()
        };
        DriveObserver { model, steps, tacho_share: 0.5, gains, fast_gains: gains, ..DriveObserver::default() }
    }
}
