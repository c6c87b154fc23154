//! The virtual machine: everything between the D/A and A/D converters. The software of the bench has no access to it.
//!
//! [`Plant`] holds the values of the `[plant]` table; [`Machine`] is prepared from it for a step and computes the
//! motion; [`VirtualMachine`] runs the steps of one tick and reads the instruments.

mod backlash;
mod delays;
mod glide;
mod machine;
mod motion;
mod ripple;

pub use backlash::{Backlash, Gap};
pub use delays::{InputDelays, InputDelaysState};
pub use glide::{Glide, GlidingMachine};
pub use machine::Machine;
pub use motion::{MachineInput, MachineState, Motion};
pub use ripple::{MotorRipple, RippledMotor};

use crate::Fields;
use crate::block::Block;
use crate::drive::{Arm, LoadAmplifier, Servo, TwoMass, Winding};
use crate::friction::Friction;
use crate::scalar::Scalar;
use crate::sensor::{
    Accelerometer, Converter, CurrentSensor, Encoder, EncoderState, PickupsInput, PickupsState, Tacho, Voltages,
};
use crate::tick::Measurement;

/// The virtual machine with its mismatch and its faults.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Plant<T> {
    /// Masses, coupling and screw.
    pub drive: TwoMass<T>,
    /// Play of the coupling.
    pub backlash: Backlash<T>,
    /// The drive motor.
    pub motor: Winding<T>,
    /// Amplifier of the drive motor.
    pub servo: Servo<T>,
    /// Friction of brushes and bearings of the drive motor, on the motor's side of the coupling.
    pub motor_friction: Friction<T>,
    /// Friction of screw, nut and guide.
    pub screw_friction: Friction<T>,
    /// The friction wheel.
    pub wheel: Wheel<T>,
    /// The load motor.
    pub load_motor: LoadMotor<T>,
    /// Arm on the carriage.
    pub arm: Arm<T>,
    /// Encoder on the screw.
    pub encoder: Encoder<T>,
    /// Tacho on the motor.
    pub tacho: Tacho<T>,
    /// Accelerometer on the carriage.
    pub accelerometer: Accelerometer<T>,
    /// Current sensor of the load motor.
    pub current_sensor: CurrentSensor<T>,
    /// A/D converters.
    pub inputs: Converter<T>,
    /// D/A converters.
    pub outputs: Converter<T>,
    /// Angle of the screw at power-on, unknown to the software before homing.
    #[field(symbol = "φ_0", unit = "rad", range = -1e4..=1e4)]
    pub start_angle: T,
    /// Standard deviation of the instants of the ticks about their nominal times, rounded to whole steps of the virtual
    /// machine. The software assumes equal ticks.
    #[field(symbol = "σ_t", unit = "s", range = 0.0..=1e-3)]
    pub tick_jitter: T,
}

/// Friction wheel: two linings pressed against a disc on the screw. If the linings are released, the disc and its
/// inertia remain.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Wheel<T> {
    /// Preload of the linings: factor of the whole friction of the wheel. 0: exactly no torque.
    #[field(symbol = "p", unit = "1", range = 0.0..=1.0, default = 1.0)]
    pub preload: T,
    /// Friction at preload 1.
    pub friction: Friction<T>,
}

/// The load motor and its amplifier.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LoadMotor<T> {
    /// The winding.
    pub winding: Winding<T>,
    /// The amplifier.
    pub amplifier: LoadAmplifier<T>,
    /// Torque ripple and cogging.
    pub ripple: MotorRipple<T>,
}

/// State of the virtual machine.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PlantState<T> {
    /// Masses, currents, bristles.
    pub machine: MachineState<T>,
    /// Tacho and accelerometer.
    pub pickups: PickupsState<T>,
    /// Encoder.
    pub encoder: EncoderState<T>,
}

/// Inputs of the virtual machine over a tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PlantInput<T> {
    /// Output of the servo's D/A converter.
    #[field(symbol = "u_servo", unit = "V")]
    pub servo_voltage: T,
    /// Output of the load amplifier's D/A converter.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_voltage: T,
    /// External torque on the screw, in the positive direction.
    #[field(symbol = "M_ext", unit = "N m")]
    pub external_torque: T,
    /// Independent standard normal numbers, new in each tick.
    pub noise: Noise<T>,
}

/// Standard normal numbers for the instruments.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Noise<T> {
    /// Accelerometer.
    #[field(unit = "1")]
    pub acceleration: T,
    /// Tacho.
    #[field(unit = "1")]
    pub tacho: T,
    /// Current sensor.
    #[field(unit = "1")]
    pub current: T,
    /// A/D converters: tacho, accelerometer, current.
    #[field(unit = "1")]
    pub converters: [T; 3],
}

/// One tick of the virtual machine between the converters, in steps.
///
/// The inputs are held over the tick; all instruments are read at its end.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct VirtualMachine<T> {
    /// The moving parts, prepared for their step.
    pub parts: Machine<T>,
}

impl<T: Scalar> Block<T> for VirtualMachine<T> {
    type State = PlantState<T>;
    type Input = PlantInput<T>;
    type Output = Measurement<T>;

    /// `dt` [s] is the tick.
    #[inline(always)]
    fn step(&self, state: &mut PlantState<T>, input: PlantInput<T>, dt: T) -> Measurement<T> {
        let steps = self.parts.steps;
        self.take(steps, state, input, dt / T::of(steps as f64))
    }
}

impl<T: Scalar> VirtualMachine<T> {
    /// Takes a number of steps of `dt` [s], at least one, with the inputs held: a tick of any length.
    #[inline(always)]
    pub fn take(&self, steps: usize, state: &mut PlantState<T>, input: PlantInput<T>, dt: T) -> Measurement<T> {
        let seen = self.parts.go(steps, None, state, self.held(input), dt);
        self.readings(state, seen, input, dt)
    }

    /// Inputs held over a tick: those of the moving parts, behind the D/A converters, and the noise of the accelerometer
    /// [m/s²], white up to half the tick rate: variance S²·f/2.
    #[inline(always)]
    fn held(&self, input: PlantInput<T>) -> (MachineInput<T>, T) {
        let Machine { plant, noise_bandwidth_root, .. } = &self.parts;
        let drive = MachineInput {
            servo_voltage: plant.outputs.write(input.servo_voltage),
            amplifier_voltage: plant.outputs.write(input.amplifier_voltage),
            external_torque: input.external_torque,
        };
        (drive, plant.accelerometer.noise_density * *noise_bandwidth_root * input.noise.acceleration)
    }

    /// Readings at the end of a tick.
    #[inline(always)]
    fn readings(&self, state: &mut PlantState<T>, seen: Seen<T>, input: PlantInput<T>, dt: T) -> Measurement<T> {
        let (motion, voltages) = seen;
        let plant = &self.parts.plant;
        let reading = plant.encoder.run(&mut state.encoder, motion.angle, dt);
        let current = plant.current_sensor.voltage(motion.load_current, input.noise.current);
        let [tacho_noise, acceleration_noise, current_noise] = input.noise.converters;
        Measurement {
            count: reading.count,
            index: reading.index,
            latch: reading.latch,
            tacho_voltage: plant.inputs.read(voltages.tacho + plant.tacho.noise * input.noise.tacho, tacho_noise),
            accelerometer_voltage: plant.inputs.read(voltages.accelerometer, acceleration_noise),
            current_voltage: plant.inputs.read(current, current_noise),
        }
    }
}

/// Motion and voltages of the pickups in a step.
type Seen<T> = (Motion<T>, Voltages<T>);

impl<T: Scalar> Machine<T> {
    /// A number of steps of `dt` [s] with inputs and noise held; returns the last one. The tacho sees the mean velocity of
    /// a step, and the share `ramp` of its change.
    #[inline(always)]
    fn go(
        &self,
        steps: usize,
        ramp: Option<T>,
        state: &mut PlantState<T>,
        (drive, noise): (MachineInput<T>, T),
        dt: T,
    ) -> Seen<T> {
        let mut seen = Seen::default();
        let vector = self.contact_vector();
        for _ in 0..steps {
            let start = state.machine.motor_velocity;
            let motion = match &vector {
                Some(contacts) => self.step_in_vector(contacts, &mut state.machine, drive, dt),
                None => self.run(&mut state.machine, drive, dt),
            };
            let motor_velocity = match ramp {
                Some(share) => motion.motor_velocity + share * (state.machine.motor_velocity - start),
                None => motion.motor_velocity,
            };
            let input = PickupsInput {
                motor_velocity,
                motor_angle: motion.motor_angle,
                acceleration: motion.acceleration * self.plant.drive.carriage_ratio(),
                acceleration_noise: noise,
            };
            seen = (motion, self.pickups.run(&mut state.pickups, input, dt));
        }
        seen
    }
}

impl<T: Scalar> Plant<T> {
    /// Prepared for steps of `dt` [s], of which a tick has `steps`.
    pub fn prepare(&self, steps: usize, dt: T) -> Machine<T> {
        let tick = dt * T::of(steps as f64);
        Machine::new(self, steps, dt, square_root(T::of(0.5) / tick))
    }
}

/// √x by Newton's iteration from a power of two, x > 0; for preparation only.
fn square_root<T: Scalar>(x: T) -> T {
    let mut root = (x.exponent() * T::of(0.5)).round().power_of_two();
    for _ in 0..6 {
        root = T::of(0.5) * (root + x / root);
    }
    root
}

#[cfg(test)]
#[path = "tests/contact_vector.rs"]
mod contact_vector_tests;
#[cfg(test)]
mod tests;
