//! The moving parts, integrated by a well-balanced splitting.
//!
//! The linear part (masses, coupling, currents, servo lag) flows exactly, with the friction torques of the last step
//! held. In the middle of the step the friction is updated by a midpoint of the exponential bristle step, and only its
//! *change* kicks the velocities. A load at rest is therefore a fixed point of the scheme and does not creep. The
//! scheme is of second order. The twist of the coupling is a state and the screw angle a separate integral, so that
//! rounding of a large angle does not disturb the balance.

use super::{MachineInput, MachineState, Motion, Plant};
use crate::Fields;
use crate::block::Block;
use crate::drive::{INPUTS, STATES, advance, half_flow};
use crate::friction::contact_vector::{ContactVector, Inputs};
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
    pub(super) half_flow: [[T; STATES + 1]; STATES + INPUTS],
}

/// Inputs held over a step, in the order of the columns.
#[derive(Clone, Copy)]
pub(super) struct Held<T> {
    motor_resistance: T,
    load_resistance: T,
    voltage: T,
    torque: T,
}

impl<T: Scalar> Held<T> {
    /// States and inputs in the order of the columns.
    #[inline(always)]
    pub(super) fn with(self, state: &MachineState<T>) -> [T; STATES + INPUTS] {
        [
            state.twist,
            state.motor_velocity,
            state.velocity,
            state.load_current,
            state.motor_torque,
            self.motor_resistance,
            self.load_resistance,
            self.voltage,
            self.torque,
        ]
    }
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
        let [twist, motor_velocity, velocity, load_current, motor_torque, way] =
            advance(&self.half_flow, held.with(state));
        state.arm_twist += T::of(0.5) * dt * state.arm_velocity - way;
        state.angle += way;
        state.twist = twist;
        state.motor_velocity = motor_velocity;
        state.velocity = velocity;
        state.load_current = load_current;
        state.motor_torque = motor_torque;
    }
}

/// A step at its middle, before friction acts.
struct Middle<T> {
    held: Held<T>,
    motor: Sliding<T>,
    load: Sliding<T>,
    arm_velocity: T,
    lost_torque: T,
    /// Velocities at the start.
    start: T,
    motor_start: T,
}

impl<T: Scalar> Machine<T> {
    /// Inputs held over a step from this state, under a voltage [V] that the load motor induces besides K·Ω.
    #[inline(always)]
    pub(super) fn held(&self, state: &MachineState<T>, input: MachineInput<T>, induced: T) -> Held<T> {
        let plant = &self.plant;
        let (winding, amplifier) = (&plant.load_motor.winding, &plant.load_motor.amplifier);
        Held {
            motor_resistance: state.motor_resistance,
            load_resistance: state.load_resistance,
            voltage: induced + amplifier.voltage(input.amplifier_voltage, winding, state.load_current, state.velocity),
            torque: plant.servo.torque(input.servo_voltage, &plant.motor, state.motor_velocity),
        }
    }

    /// The first half of a step of `dt` [s].
    #[inline(always)]
    fn first_half(&self, state: &mut MachineState<T>, input: MachineInput<T>, dt: T) -> Middle<T> {
        let plant = &self.plant;
        let (start, motor_start) = (state.velocity, state.motor_velocity);
        let (ripple, induced) = plant.load_motor.ripple.of(&plant.load_motor.winding, state);
        let held = self.held(state, input, induced);
        self.flow(state, held, dt);

        let slip = state.motor_velocity - state.velocity;
        let coupling = plant.drive.coupling_stiffness * state.twist + plant.drive.coupling_damping * slip;
        // The flow holds the torque lost in the gap as it holds friction: a load at rest is a fixed point in contact
        // and in the gap, too.
        let lost_torque = plant.backlash.lost(&plant.drive, state.twist, slip);
        let motor = Sliding {
            inertia: plant.drive.motor_inertia,
            velocity: state.motor_velocity,
            angle: state.angle + state.twist,
            load: state.motor_torque,
            held: held.motor_resistance,
            others: T::of(0.0) - lost_torque,
        };
        let (arm, arm_velocity) = plant.arm.kick(state.arm_twist, state.arm_velocity, state.velocity, dt);
        let load = Sliding {
            inertia: plant.drive.load_inertia,
            velocity: state.velocity,
            angle: state.angle,
            load: coupling - lost_torque,
            held: held.load_resistance,
            others: ripple - input.external_torque - arm + lost_torque,
        };
        Middle { held, motor, load, arm_velocity, lost_torque, start, motor_start }
    }

    /// The second half of a step, after friction has acted.
    #[inline(always)]
    fn second_half(&self, state: &mut MachineState<T>, middle: &Middle<T>, dt: T) -> Motion<T> {
        state.arm_velocity = middle.arm_velocity;
        state.lost_torque = middle.lost_torque;
        self.flow(state, middle.held, dt);
        let half = T::of(0.5);
        let motor_velocity = half * (middle.motor_start + state.motor_velocity);
        Motion {
            angle: state.angle,
            acceleration: (state.velocity - middle.start) / dt,
            motor_angle: state.angle + state.twist - half * dt * motor_velocity,
            motor_velocity,
            load_current: state.load_current,
        }
    }

    /// The contacts of the machine side by side, if they can be.
    #[inline(always)]
    pub(super) fn contact_vector(&self) -> Option<ContactVector<T>> {
        let wheel = &self.plant.wheel.friction;
        let contacts = [&self.plant.motor_friction, &self.plant.screw_friction, wheel, wheel];
        if T::HAS_VECTORS { ContactVector::of(contacts) } else { None }
    }

    /// A [`step`](Block::step) with the contacts side by side: the same bits.
    #[inline(always)]
    pub(super) fn step_in_vector(
        &self,
        contacts: &ContactVector<T>,
        state: &mut MachineState<T>,
        input: MachineInput<T>,
        dt: T,
    ) -> Motion<T> {
        let middle = self.first_half(state, input, dt);
        let Middle { motor, load, .. } = &middle;
        let plant = &self.plant;
        let (preload, wheel_factor) = (plant.wheel.preload, plant.wheel.friction.factor(load.angle, load.load));
        let (half, one) = (T::of(0.5) * dt, T::of(1.0));
        let pair = |motor: T, load: T| [motor, load, load, load];

        let [brushes, screw, wheel] = [&state.motor_memory, &state.screw_memory, &state.wheel_memory];
        let inputs = Inputs {
            deflection: [brushes.deflection, screw.deflection, wheel.deflection, wheel.deflection],
            velocity: pair(motor.velocity, load.velocity),
            factor: [
                plant.motor_friction.factor(motor.angle, motor.load),
                plant.screw_friction.factor(load.angle, load.load),
                wheel_factor,
                wheel_factor,
            ],
        };
        let (probe, torque) = contacts.predict(&inputs, half);
        let [brushes, screw, wheel, _] = torque;
        let (motor_velocity, _) = motor.kicked([(one, brushes)], half);
        let (velocity, _) = load.kicked([(one, screw), (preload, wheel)], half);

        let inputs = Inputs { velocity: pair(motor_velocity, velocity), ..inputs };
        let (end, torque) = contacts.correct(&inputs, &probe, dt);
        let [brushes, screw, wheel, _] = torque;
        (state.motor_velocity, state.motor_resistance) = motor.kicked([(one, brushes)], dt);
        (state.velocity, state.load_resistance) = load.kicked([(one, screw), (preload, wheel)], dt);
        let [brushes, screw, wheel, _] = end;
        state.motor_memory.deflection = brushes;
        state.screw_memory.deflection = screw;
        state.wheel_memory.deflection = wheel;
        self.second_half(state, &middle, dt)
    }
}

impl<T: Scalar> Block<T> for Machine<T> {
    type State = MachineState<T>;
    type Input = MachineInput<T>;
    type Output = Motion<T>;

    #[inline(always)]
    fn step(&self, state: &mut MachineState<T>, input: MachineInput<T>, dt: T) -> Motion<T> {
        let plant = &self.plant;
        let middle = self.first_half(state, input, dt);
        let Middle { motor, load, .. } = &middle;
        let mut brushes = [(&plant.motor_friction, T::of(1.0), &mut state.motor_memory)];
        let mut contacts = [
            (&plant.screw_friction, T::of(1.0), &mut state.screw_memory),
            (&plant.wheel.friction, plant.wheel.preload, &mut state.wheel_memory),
        ];
        // Both predictors before both correctors: each is a long chain of dependent operations, and the processor
        // overlaps independent chains.
        let motor_middle = predict(motor, &brushes, dt);
        let load_middle = predict(load, &contacts, dt);
        (state.motor_velocity, state.motor_resistance) = correct(motor, motor_middle, &mut brushes, dt);
        (state.velocity, state.load_resistance) = correct(load, load_middle, &mut contacts, dt);
        self.second_half(state, &middle, dt)
    }
}
