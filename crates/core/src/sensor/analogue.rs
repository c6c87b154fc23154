//! Instruments with a voltage: tacho, accelerometer, current sensor, and the converters.

use core::f64::consts::TAU;

use crate::Fields;
use crate::block::Block;
use crate::drive::{flow, nan_to_zero};
use crate::scalar::Scalar;

/// Tacho generator on the motor.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Tacho<T> {
    /// Voltage per speed.
    #[field(symbol = "K_T", unit = "V s/rad", range = 1e-4..=1.0, default = 0.0287)]
    pub constant: T,
    /// Commutator ripple, as a share of the voltage.
    #[field(symbol = "r", unit = "1", range = 0.0..=0.5, default = 0.01)]
    pub ripple: T,
    /// Ripple periods per revolution.
    #[field(symbol = "n", unit = "1", range = 1.0..=1000.0, default = 13.0, whole)]
    pub ripple_periods: T,
    /// Cut-off frequency of its low-pass, first order.
    #[field(symbol = "f_c", unit = "Hz", range = 1.0..=1e5, default = 300.0)]
    pub bandwidth: T,
    /// Noise at the converter, RMS.
    #[field(symbol = "σ_u", unit = "V", range = 0.0..=1.0, default = 3e-3)]
    pub noise: T,
    /// Fault.
    pub fault: Fault<T>,
}

/// Accelerometer on the carriage.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Accelerometer<T> {
    /// Voltage per acceleration. Default: 0.25 V/g.
    #[field(symbol = "S_a", unit = "V/(m/s^2)", range = 1e-5..=10.0, default = 0.025_493)]
    pub sensitivity: T,
    /// Offset at the start of a run.
    #[field(symbol = "a_0", unit = "m/s^2", range = -50.0..=50.0, default = 0.3)]
    pub offset: T,
    /// Drift of the offset.
    #[field(symbol = "ȧ_0", unit = "m/s^3", range = -1.0..=1.0)]
    pub drift: T,
    /// One-sided noise density. Default: 225 µg/√Hz.
    #[field(symbol = "S_n", unit = "m/s^2/√Hz", range = 0.0..=1.0, default = 2.207e-3)]
    pub noise_density: T,
    /// Natural frequency of the second-order sensor.
    #[field(symbol = "f_0", unit = "Hz", range = 10.0..=1e5, default = 1000.0)]
    pub bandwidth: T,
    /// Damping ratio.
    #[field(symbol = "ζ", unit = "1", range = 0.05..=2.0, default = 0.7)]
    pub damping: T,
    /// Largest acceleration.
    #[field(symbol = "a_max", unit = "m/s^2", range = 1.0..=5000.0, default = 49.0)]
    pub range: T,
    /// Fault.
    pub fault: Fault<T>,
}

/// Current sensor of the load motor.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurrentSensor<T> {
    /// Voltage per current.
    #[field(symbol = "S_i", unit = "V/A", range = 1e-3..=100.0, default = 0.5)]
    pub sensitivity: T,
    /// Offset.
    #[field(symbol = "i_0", unit = "A", range = -10.0..=10.0)]
    pub offset: T,
    /// Noise, RMS.
    #[field(symbol = "σ_i", unit = "A", range = 0.0..=1.0, default = 0.01)]
    pub noise: T,
    /// Largest current.
    #[field(symbol = "i_max", unit = "A", range = 0.1..=1000.0, default = 20.0)]
    pub range: T,
    /// Fault.
    pub fault: Fault<T>,
}

/// Faults of an instrument with a voltage.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Fault<T> {
    /// None.
    Nothing,
    /// Broken wire: 0 V.
    Dead,
    /// Constant voltage.
    Stuck(Stuck<T>),
    /// The driver delivers NaN.
    NotANumber,
}

/// Voltage of [`Fault::Stuck`].
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Stuck<T> {
    /// The voltage.
    #[field(symbol = "u", unit = "V", range = -100.0..=100.0, default = 10.0)]
    pub voltage: T,
}

impl<T: Scalar> Fault<T> {
    /// Voltage with the fault.
    #[inline(always)]
    pub fn apply(&self, voltage: T) -> T {
        match self {
            Fault::Nothing => voltage,
            Fault::Dead => T::of(0.0),
            Fault::Stuck(stuck) => stuck.voltage,
            Fault::NotANumber => T::of(f64::NAN),
        }
    }
}

/// An A/D or D/A converter.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Converter<T> {
    /// Resolution.
    #[field(symbol = "n", unit = "bit", range = 4.0..=32.0, default = 16.0, whole)]
    pub bits: T,
    /// Largest voltage, positive and negative.
    #[field(symbol = "u_max", unit = "V", range = 0.1..=1000.0, default = 10.0)]
    pub range: T,
    /// Noise of an A/D converter, RMS, in steps.
    #[field(symbol = "σ", unit = "1", range = 0.0..=100.0, default = 1.0)]
    pub noise: T,
}

impl<T: Scalar> Converter<T> {
    /// One step [V].
    #[inline(always)]
    fn resolution(&self) -> T {
        T::of(2.0) * self.range * (-self.bits).power_of_two()
    }

    #[inline(always)]
    fn quantised(&self, voltage: T) -> T {
        let step = self.resolution();
        (voltage / step).round().clamp(-self.range / step, self.range / step - T::of(1.0)) * step
    }

    /// Reading [V] of a voltage [V] with a standard normal number for the noise; NaN stays NaN.
    #[inline(always)]
    pub fn read(&self, voltage: T, normal: T) -> T {
        self.quantised(voltage + normal * self.noise * self.resolution())
    }

    /// Voltage put out [V]; 0 for NaN.
    #[inline(always)]
    pub fn write(&self, voltage: T) -> T {
        self.quantised(nan_to_zero(voltage))
    }
}

/// Tacho and accelerometer, prepared for a step, up to their output voltages.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Pickups<T> {
    /// The tacho.
    pub tacho: Tacho<T>,
    /// The accelerometer.
    pub accelerometer: Accelerometer<T>,
    /// Share of the difference between input and output by which the tacho's low-pass moves in a step.
    #[field(unit = "1")]
    pub tacho_share: T,
    /// Exact step of the accelerometer. Rows: value and rate; columns: value, rate and held input.
    #[field(unit = "1")]
    pub accelerometer_flow: [[T; 3]; 2],
}

/// State of the pickups.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PickupsState<T> {
    /// Low-passed voltage of the tacho.
    #[field(unit = "V")]
    pub tacho: T,
    /// Acceleration at the output of the sensor.
    #[field(unit = "m/s^2")]
    pub acceleration: T,
    /// Rate of this acceleration.
    #[field(unit = "m/s^3")]
    pub acceleration_rate: T,
    /// Accumulated drift of the offset.
    #[field(unit = "m/s^2")]
    pub drift: T,
}

/// Inputs of the pickups in a step.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PickupsInput<T> {
    /// Speed of the motor.
    #[field(unit = "rad/s")]
    pub motor_velocity: T,
    /// Angle of the motor.
    #[field(unit = "rad")]
    pub motor_angle: T,
    /// Acceleration of the carriage.
    #[field(unit = "m/s^2")]
    pub acceleration: T,
    /// Noise of the accelerometer before its low-pass.
    #[field(unit = "m/s^2")]
    pub acceleration_noise: T,
}

/// Voltages of the pickups.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Voltages<T> {
    /// Tacho.
    #[field(unit = "V")]
    pub tacho: T,
    /// Accelerometer.
    #[field(unit = "V")]
    pub accelerometer: T,
}

impl<T: Scalar> Pickups<T> {
    /// Prepares for a step of `dt` [s].
    pub fn new(tacho: Tacho<T>, accelerometer: Accelerometer<T>, dt: T) -> Self {
        let omega = T::of(TAU) * accelerometer.bandwidth;
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let stiffness = omega * omega;
        let damping = T::of(2.0) * accelerometer.damping * omega;
        let phi = flow(&[[zero, one, zero], [-stiffness, -damping, stiffness], [zero, zero, zero]], dt);
        Pickups {
            tacho,
            accelerometer,
            tacho_share: one - (-T::of(TAU) * tacho.bandwidth * dt).exp(),
            accelerometer_flow: [phi[0], phi[1]],
        }
    }
}

impl<T: Scalar> Block<T> for Pickups<T> {
    type State = PickupsState<T>;
    type Input = PickupsInput<T>;
    type Output = Voltages<T>;

    #[inline(always)]
    fn step(&self, state: &mut PickupsState<T>, input: PickupsInput<T>, dt: T) -> Voltages<T> {
        let ripple = T::of(1.0) + self.tacho.ripple * (self.tacho.ripple_periods * input.motor_angle).sin();
        let generated = self.tacho.constant * input.motor_velocity * ripple;
        state.tacho += self.tacho_share * (generated - state.tacho);

        let [value, rate] = self.accelerometer_flow;
        let felt = input.acceleration + input.acceleration_noise;
        let (a, v) = (state.acceleration, state.acceleration_rate);
        state.acceleration = value[0] * a + value[1] * v + value[2] * felt;
        state.acceleration_rate = rate[0] * a + rate[1] * v + rate[2] * felt;
        state.drift += self.accelerometer.drift * dt;
        let range = self.accelerometer.range;
        let shown = (state.acceleration + self.accelerometer.offset + state.drift).clamp(-range, range);
        Voltages {
            tacho: self.tacho.fault.apply(state.tacho),
            accelerometer: self.accelerometer.fault.apply(shown * self.accelerometer.sensitivity),
        }
    }
}

impl<T: Scalar> CurrentSensor<T> {
    /// Voltage [V] for a current [A], with a standard normal number for the noise.
    #[inline(always)]
    pub fn voltage(&self, current: T, normal: T) -> T {
        let shown = (current + self.offset + self.noise * normal).clamp(-self.range, self.range);
        self.fault.apply(shown * self.sensitivity)
    }
}
