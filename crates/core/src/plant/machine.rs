//! The moving parts, integrated by a well-balanced splitting.
//!
//! The linear part (masses, coupling, currents, servo lag) flows exactly, with the friction torques of the last step
//! held. In the middle of the step the friction is updated by a midpoint of the exponential bristle step, and only its
//! *change* kicks the velocities. A load at rest is therefore a fixed point of the scheme and does not creep. The
//! scheme is of second order. The twist of the coupling is a state and the screw angle a separate integral, so that
//! rounding of a large angle does not disturb the balance.

use super::Plant;
use crate::Fields;
use crate::block::Block;
use crate::drive::{INPUTS, STATES, advance, half_flow};
use crate::friction::Memory;
use crate::friction::contacts::{Sliding, correct, predict};
use crate::scalar::Scalar;
use crate::sensor::Pickups;

/// The moving parts of the virtual machine, prepared for a step: motor, coupling, load, friction, currents.
///
/// The linear part flows exactly over half a step, friction acts in the middle as a midpoint of exponential bristle
/// steps, and only its change kicks the velocities, so that a load at rest does not creep.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Machine<T> {
    /// Parameters; the load inertia includes the rigid part of the arm.
    pub plant: Plant<T>,
    /// Tacho and accelerometer, prepared.
    pub pickups: Pickups<T>,
    /// Steps in a tick.
    #[field(fixed)]
    pub steps: usize,
    /// √(f_tick/2): from a noise density to a standard deviation.
    #[field(unit = "√Hz")]
    pub noise_bandwidth_root: T,
    /// Flow over half a step: one column for each state and each input, with the new states and the change of angle.
    #[field(unit = "1")]
    half_flow: [[T; STATES + 1]; STATES + INPUTS],
}

/// State of the moving parts.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct MachineState<T> {
    /// Angle of the screw.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Velocity of the screw.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Twist of the coupling, φ_M − φ.
    #[field(symbol = "δ", unit = "rad")]
    pub twist: T,
    /// Velocity of the motor.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
    /// Current of the load motor.
    #[field(symbol = "i_L", unit = "A")]
    pub load_current: T,
    /// Torque of the drive motor.
    #[field(symbol = "M_M", unit = "N m")]
    pub motor_torque: T,
    /// Torque held against the motor: its friction, less the torque missing at the coupling in a gap.
    #[field(symbol = "M_R,M", unit = "N m")]
    pub motor_resistance: T,
    /// Torque held against the load: friction and the torque missing at the coupling in a gap, less external torque.
    #[field(symbol = "M_R", unit = "N m")]
    pub load_resistance: T,
    /// Torque missing at the coupling in a gap, as held.
    #[field(symbol = "M_G", unit = "N m")]
    pub lost_torque: T,
    /// State of the motor's contact.
    pub motor_memory: Memory<T>,
    /// State of the screw's contact.
    pub screw_memory: Memory<T>,
    /// State of the wheel's contact.
    pub wheel_memory: Memory<T>,
    /// Twist of the arm, φ_a − φ.
    #[field(symbol = "δ_a", unit = "rad")]
    pub arm_twist: T,
    /// Velocity of the arm.
    #[field(symbol = "Ω_a", unit = "rad/s")]
    pub arm_velocity: T,
}

/// Inputs of the moving parts.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct MachineInput<T> {
    /// Input of the servo amplifier.
    #[field(symbol = "u_servo", unit = "V")]
    pub servo_voltage: T,
    /// Input of the load amplifier.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_voltage: T,
    /// External torque, in the positive direction.
    #[field(symbol = "M_ext", unit = "N m")]
    pub external_torque: T,
}

/// True motion in a step, for the instruments. Signals that pass a filter are means over the step: a value at the end,
/// held over the step, would lead by half a step.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Motion<T> {
    /// Angle of the screw at the end of the step.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Mean acceleration of the screw.
    #[field(symbol = "Ω̇", unit = "rad/s^2")]
    pub acceleration: T,
    /// Angle of the motor in the middle of the step.
    #[field(symbol = "φ_M", unit = "rad")]
    pub motor_angle: T,
    /// Mean velocity of the motor.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
    /// Current of the load motor at the end of the step.
    #[field(symbol = "i_L", unit = "A")]
    pub load_current: T,
}

/// Inputs held over a step, in the order of the columns.
#[derive(Clone, Copy)]
struct Held<T> {
    motor_resistance: T,
    load_resistance: T,
    voltage: T,
    torque: T,
}

impl<T: Scalar> Machine<T> {
    /// Prepares the flow over half of `dt` [s].
    pub(super) fn new(plant: &Plant<T>, steps: usize, dt: T, noise_bandwidth_root: T) -> Self {
        // The rigid part of the arm is a part of the load.
        let mut plant = *plant;
        plant.drive.load_inertia += plant.arm.rigid_inertia();
        let half_flow = half_flow(&plant.drive, &plant.load_motor.winding, plant.servo.lag, dt);
        let pickups = Pickups::new(plant.tacho, plant.accelerometer, dt);
        Machine { plant, pickups, steps, noise_bandwidth_root, half_flow }
    }

    /// Half a step of the linear part; `dt` [s] is the whole step.
    #[inline(always)]
    fn flow(&self, state: &mut MachineState<T>, held: Held<T>, dt: T) {
        let x = [
            state.twist,
            state.motor_velocity,
            state.velocity,
            state.load_current,
            state.motor_torque,
            held.motor_resistance,
            held.load_resistance,
            held.voltage,
            held.torque,
        ];
        let [twist, motor_velocity, velocity, load_current, motor_torque, way] = advance(&self.half_flow, x);
        state.arm_twist += T::of(0.5) * dt * state.arm_velocity - way;
        state.angle += way;
        state.twist = twist;
        state.motor_velocity = motor_velocity;
        state.velocity = velocity;
        state.load_current = load_current;
        state.motor_torque = motor_torque;
    }
}

impl<T: Scalar> Block<T> for Machine<T> {
    type State = MachineState<T>;
    type Input = MachineInput<T>;
    type Output = Motion<T>;

    #[inline(always)]
    fn step(&self, state: &mut MachineState<T>, input: MachineInput<T>, dt: T) -> Motion<T> {
        let plant = &self.plant;
        let (start, motor_start) = (state.velocity, state.motor_velocity);
        let (ripple, induced) = plant.load_motor.ripple.of(&plant.load_motor.winding, state);
        let winding = &plant.load_motor.winding;
        let held = Held {
            motor_resistance: state.motor_resistance,
            load_resistance: state.load_resistance,
            voltage: induced
                + plant.load_motor.amplifier.voltage(input.amplifier_voltage, winding, state.load_current, start),
            torque: plant.servo.torque(input.servo_voltage, &plant.motor, state.motor_velocity),
        };
        self.flow(state, held, dt);

        let slip = state.motor_velocity - state.velocity;
        let coupling = plant.drive.coupling_stiffness * state.twist + plant.drive.coupling_damping * slip;
        // The flow holds the torque lost in the gap as it holds friction: a load at rest is a fixed point in contact
        // and in the gap, too.
        let lost = plant.backlash.lost(&plant.drive, state.twist, slip);
        let mut brushes = [(&plant.motor_friction, T::of(1.0), &mut state.motor_memory)];
        let motor = Sliding {
            inertia: plant.drive.motor_inertia,
            velocity: state.motor_velocity,
            angle: state.angle + state.twist,
            load: state.motor_torque,
            held: held.motor_resistance,
            others: T::of(0.0) - lost,
        };
        let (arm, arm_velocity) = plant.arm.kick(state.arm_twist, state.arm_velocity, state.velocity, dt);
        let mut contacts = [
            (&plant.screw_friction, T::of(1.0), &mut state.screw_memory),
            (&plant.wheel.friction, plant.wheel.preload, &mut state.wheel_memory),
        ];
        let load = Sliding {
            inertia: plant.drive.load_inertia,
            velocity: state.velocity,
            angle: state.angle,
            load: coupling - lost,
            held: held.load_resistance,
            others: ripple - input.external_torque - arm + lost,
        };
        // Both predictors before both correctors: each is a long chain of dependent operations, and the processor
        // overlaps independent chains.
        let motor_middle = predict(&motor, &brushes, dt);
        let load_middle = predict(&load, &contacts, dt);
        (state.motor_velocity, state.motor_resistance) = correct(&motor, motor_middle, &mut brushes, dt);
        (state.velocity, state.load_resistance) = correct(&load, load_middle, &mut contacts, dt);
        state.arm_velocity = arm_velocity;
        state.lost_torque = lost;

        self.flow(state, held, dt);
        let half = T::of(0.5);
        let motor_velocity = half * (motor_start + state.motor_velocity);
        Motion {
            angle: state.angle,
            acceleration: (state.velocity - start) / dt,
            motor_angle: state.angle + state.twist - half * dt * motor_velocity,
            motor_velocity,
            load_current: state.load_current,
        }
    }
}
