//! One cycle of the bench's software, a pure function: measurements and set-point in, voltages out.
//!
//! The real-time loop calls it on time, a simulation in a loop, a replay with recorded inputs; the recorder writes it
//! as C. [`VirtualBench`] closes the loop over the virtual machine, with a delay of one sample between reading and
//! writing.
//!
//! There are three rates: the tick (sensors, observer, law, current control); the position controller, every few ticks,
//! with its output delayed by one of its samples; the steps of the virtual machine, at most 25 µs.
//! `stickslip_software::cycle` adds supervision: command in, frame out.

mod decoder;
mod virtual_bench;

pub use decoder::{Decoder, DecoderOutput, DecoderState, EncoderReading};
pub use virtual_bench::{BenchInput, BenchState, VirtualBench};

use crate::Fields;
use crate::block::Block;
use crate::control::reference::Setpoint;
use crate::control::{
    AxisControl, AxisControlInput, AxisControlState, CurrentControl, CurrentControlInput, CurrentControlState,
    VelocityObserverOutput, VelocityObserverState,
};
use crate::drive::nan_to_zero;
use crate::estimate::{DriveObserverInput, MotionEstimate, MotionObserver};
use crate::fields::Fields as _;
use crate::render::{ArmState, Correction, Law, LawInput, LawState, RenderedArm};
use crate::scalar::{Mask, Scalar};

/// Data-sheet scaling of instruments and servo amplifier.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Scaling<T> {
    /// Voltage of the tacho per speed.
    #[field(symbol = "K_T", unit = "V s/rad", range = 1e-4..=1.0, default = 0.0287)]
    pub tacho: T,
    /// Voltage of the accelerometer per acceleration.
    #[field(symbol = "S_a", unit = "V/(m/s^2)", range = 1e-5..=10.0, default = 0.025_493)]
    pub accelerometer: T,
    /// Voltage of the current sensor per current.
    #[field(symbol = "S_i", unit = "V/A", range = 1e-3..=100.0, default = 0.5)]
    pub current_sensor: T,
    /// Torque of the drive motor per input voltage of its amplifier.
    #[field(symbol = "k_u", unit = "N m/V", range = 1e-4..=100.0, default = 0.14)]
    pub torque_per_volt: T,
    /// Largest input voltage of the drive motor's amplifier.
    #[field(symbol = "u_max", unit = "V", range = 0.1..=100.0, default = 10.0)]
    pub servo_limit: T,
}

/// Readings of the interfaces at a tick: the only inputs from the machine.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Measurement<T> {
    /// Encoder counter.
    #[field(symbol = "n", unit = "counts")]
    pub count: T,
    /// 1 if the index pulse came since the last tick.
    #[field(symbol = "n_i", unit = "1", flag)]
    pub index: T,
    /// Encoder counter at the last index pulse.
    #[field(symbol = "n_l", unit = "counts")]
    pub latch: T,
    /// Voltage of the tacho.
    #[field(symbol = "u_tacho", unit = "V")]
    pub tacho_voltage: T,
    /// Voltage of the accelerometer.
    #[field(symbol = "u_acc", unit = "V")]
    pub accelerometer_voltage: T,
    /// Voltage of the current sensor.
    #[field(symbol = "u_i", unit = "V")]
    pub current_voltage: T,
}

/// The software side of the bench, prepared for its rates.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Tick<T> {
    /// Data-sheet scaling.
    pub scaling: Scaling<T>,
    /// From counts to angles.
    pub decoder: Decoder<T>,
    /// Velocities by the encoder and a second source.
    pub observer: MotionObserver<T>,
    /// The rendering law.
    pub law: Law<T>,
    /// Correction of the law.
    pub correction: Correction<T>,
    /// The rendered elastic arm.
    pub arm: RenderedArm<T>,
    /// Current control of the load motor.
    pub current: CurrentControl<T>,
    /// Position control: the controller under test with compensation and hold.
    pub control: AxisControl<T>,
    /// Sampling time of the position controller.
    #[field(symbol = "T_c", unit = "s", range = 1e-5..=1.0, default = 1e-3)]
    pub control_period: T,
}

/// State of the software.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct TickState<T> {
    /// Decoder.
    pub decoder: DecoderState<T>,
    /// Observer.
    pub observer: VelocityObserverState<T>,
    /// Rendering law.
    pub law: LawState<T>,
    /// Rendered arm.
    pub arm: ArmState<T>,
    /// Current control.
    pub current: CurrentControlState<T>,
    /// Position control.
    pub control: AxisControlState<T>,
    /// Computed drive torque, pending until the end of its sample.
    #[field(symbol = "M", unit = "N m")]
    pub computed_torque: T,
    /// Active drive torque.
    #[field(symbol = "M", unit = "N m")]
    pub commanded_torque: T,
}

/// Commands of a tick, besides the measurements. Flags are 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Order<T> {
    /// Set-point.
    pub reference: Setpoint<T>,
    /// Whether the position controller is on; when off, it tracks the motion for a bumpless start.
    #[field(unit = "1", flag)]
    pub control: T,
    /// Whether the rendering law is on.
    #[field(unit = "1", flag)]
    pub render: T,
    /// Torque added to the controller's, for breakaway ramps and identification.
    #[field(symbol = "M_add", unit = "N m")]
    pub added_torque: T,
    /// Torque of the load motor added to the law's, against positive motion, for identification.
    #[field(symbol = "M_add,L", unit = "N m")]
    pub added_load_torque: T,
    /// A sample of the position controller begins.
    #[field(unit = "1", flag)]
    pub control_due: T,
    /// A sample of the position controller ends: its torque becomes active with the next tick.
    #[field(unit = "1", flag)]
    pub control_release: T,
}

impl<T: Scalar> Order<T> {
    /// Sets when the position controller runs: every `divider` ticks, with its output delayed by one of its samples.
    pub fn schedule(&mut self, cycle: u64, divider: u64) {
        let flag = |is: bool| T::of(f64::from(u8::from(is)));
        self.control_due = flag(cycle.is_multiple_of(divider));
        self.control_release = flag(cycle % divider == divider - 1);
    }
}

/// Inputs of the tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct TickInput<T> {
    /// From the interfaces.
    pub measurement: Measurement<T>,
    /// From supervision.
    pub order: Order<T>,
}

/// Outputs and estimates of the tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct TickOutput<T> {
    /// For the servo amplifier's D/A converter.
    #[field(symbol = "u_servo", unit = "V")]
    pub servo_voltage: T,
    /// For the load amplifier's D/A converter.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_voltage: T,
    /// Measured angle of the screw since the start.
    #[field(symbol = "φ", unit = "rad")]
    pub measured_angle: T,
    /// Angle at the last index pulse.
    #[field(symbol = "φ_i", unit = "rad")]
    pub index_angle: T,
    /// 1 if the index pulse came since the last tick.
    #[field(symbol = "n_i", unit = "1", flag)]
    pub index: T,
    /// Estimated velocity of the screw.
    #[field(symbol = "Ω_est", unit = "rad/s")]
    pub estimated_velocity: T,
    /// Estimated offset of the accelerometer.
    #[field(symbol = "a_0", unit = "m/s^2")]
    pub acceleration_offset: T,
    /// Velocity of the motor by the tacho, or estimated where there is none.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub measured_motor_velocity: T,
    /// Torque reference of the drive motor.
    #[field(symbol = "M_M", unit = "N m")]
    pub commanded_torque: T,
    /// Torque reference of the load motor, against positive motion: the law's, and the added one.
    #[field(symbol = "M_diff", unit = "N m")]
    pub difference_torque: T,
    /// Torque of the load motor by its measured current, against positive motion.
    #[field(symbol = "M_L", unit = "N m")]
    pub measured_load_torque: T,
}

impl<T: Scalar> Block<T> for Tick<T> {
    type State = TickState<T>;
    type Input = TickInput<T>;
    type Output = TickOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut TickState<T>, input: TickInput<T>, dt: T) -> TickOutput<T> {
        let TickInput { measurement, order } = input;
        let (zero, half) = (T::of(0.0), T::of(0.5));
        let Observed { decoded, estimate, motor_velocity, acceleration, current } =
            self.observe(state, measurement, dt);
        // The position controller first, so that its torque acts in the same tick as the load torque.
        self.control_position(state, &order, decoded.angle, motor_velocity);
        let torque = nan_to_zero(state.commanded_torque + order.added_torque);
        let limit = self.scaling.servo_limit;
        let servo_voltage = (torque / self.scaling.torque_per_volt).clamp(-limit, limit);
        let commanded_torque = servo_voltage * self.scaling.torque_per_volt;

        let felt = LawInput {
            estimated_velocity: estimate.velocity,
            angle: decoded.angle,
            motor_velocity,
            acceleration,
            current,
            motor_torque: commanded_torque,
        };
        let wanted = self.law.render(&mut state.law, felt, dt);
        let corrected = self.correction.correct(wanted.torque, wanted.velocity, dt);
        let rendering = order.render.gt(half);
        let mut rendered = corrected;
        if let RenderedArm::Elastic(arm) = &self.arm {
            rendered += arm.run(&mut state.arm, estimate, dt).torque;
            state.arm = state.arm.merge(&ArmState::default(), &mut |on, off| rendering.select(on, off));
        }
        let difference_torque = rendering.select(rendered, zero) + order.added_load_torque;
        let demand = CurrentControlInput {
            reference_current: difference_torque / self.current.torque_constant,
            measured_current: wanted.current,
            estimated_velocity: wanted.velocity,
        };
        let load = self.current.run(&mut state.current, demand, dt);
        state.law.motor_torque = commanded_torque;
        state.law.voltage = load.voltage;
        state.law.torque = difference_torque;

        TickOutput {
            servo_voltage,
            amplifier_voltage: load.amplifier_input,
            measured_angle: decoded.angle,
            index_angle: decoded.index_angle,
            index: decoded.index,
            estimated_velocity: estimate.velocity,
            acceleration_offset: estimate.acceleration_offset,
            measured_motor_velocity: motor_velocity,
            commanded_torque,
            difference_torque,
            measured_load_torque: current * self.current.torque_constant,
        }
    }
}

/// Measured and estimated motion at a tick.
#[derive(Clone, Copy, Debug)]
pub struct Observed<T> {
    /// Angles by the encoder.
    pub decoded: DecoderOutput<T>,
    /// Estimated motion of the screw.
    pub estimate: VelocityObserverOutput<T>,
    /// Velocity of the motor by the tacho, or estimated where there is none [rad/s].
    pub motor_velocity: T,
    /// Measured acceleration of the carriage, with its offset [m/s²].
    pub acceleration: T,
    /// Measured current of the load motor [A].
    pub current: T,
}

impl<T: Scalar> Tick<T> {
    /// Decodes the readings and runs the observer.
    #[inline(always)]
    pub fn observe(&self, state: &mut TickState<T>, measurement: Measurement<T>, dt: T) -> Observed<T> {
        let Measurement { count, index, latch, .. } = measurement;
        let decoded = self.decoder.run(&mut state.decoder, EncoderReading { count, index, latch }, dt);
        let motor_velocity = measurement.tacho_voltage / self.scaling.tacho;
        let current = measurement.current_voltage / self.scaling.current_sensor;
        let acceleration = measurement.accelerometer_voltage / self.scaling.accelerometer;
        let LawState { motor_torque, voltage, .. } = state.law;
        let angle = decoded.angle;
        let estimated_velocity = T::of(0.0);
        let input = DriveObserverInput {
            angle,
            motor_velocity,
            acceleration,
            current,
            motor_torque,
            voltage,
            estimated_velocity,
        };
        let states = (&mut state.observer, &mut state.law.observer);
        let MotionEstimate { screw, motor_velocity } = self.observer.observe(states, self.law.follows(), input, dt);
        Observed { decoded, estimate: screw, motor_velocity, acceleration, current }
    }

    /// Position control at its own, slower rate: computed where a lane may be due, used where it is.
    #[inline(always)]
    fn control_position(&self, state: &mut TickState<T>, order: &Order<T>, angle: T, motor_velocity: T) {
        let half = T::of(0.5);
        let due = order.control_due.gt(half);
        if due.anywhere() {
            let input = AxisControlInput {
                reference: order.reference,
                measured_angle: angle,
                measured_velocity: motor_velocity,
            };
            let on = order.control.gt(half);
            let (all_due, all_on) = (!(!due).anywhere(), !(!on).anywhere());
            // The state is large: it is copied only where a lane needs its present values.
            let before = (!(all_due && all_on)).then_some(state.control);
            let mut torque = self.control.run(&mut state.control, input, self.control_period).torque;
            if let Some(before) = before {
                let following = self.control.take_over(T::of(0.0), input, &before, None);
                let next = state.control.merge(&following, &mut |on_value, off_value| on.select(on_value, off_value));
                state.control = next.merge(&before, &mut |new, old| due.select(new, old));
                torque = due.select(on.select(torque, T::of(0.0)), state.computed_torque);
            }
            state.computed_torque = torque;
        }
        let release = order.control_release.gt(half);
        state.commanded_torque = release.select(state.computed_torque, state.commanded_torque);
    }
}
