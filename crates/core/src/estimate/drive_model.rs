//! The software's model of the drive: motor, coupling, load, load motor's current, and friction with presliding.

use crate::Fields;
use crate::block::Block;
use crate::drive::{INPUTS, STATES, TwoMass, Winding, advance, half_flow};
use crate::friction::contacts::{Sliding, correct, predict};
use crate::friction::{Friction, Memory};
use crate::scalar::Scalar;

/// The modelled drive, prepared for a step.
///
/// ```text
/// J_M·φ̈_M = M_M − M_C − M_R,M      M_C = c·(φ_M − φ) + d·(φ̇_M − φ̇)
/// J_L·φ̈   = M_C − M_R − K·i − M_x
/// L·di/dt = u − R·i + K·φ̇          τ·Ṁ_M = M_aim − M_M
/// ```
///
/// Integrated by the well-balanced step of the virtual machine: it uses the same code for flow and friction, but
/// independent values. The linear part is exact, stiff bristles are stable, and a load at rest does not creep.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveModel<T> {
    /// Masses, coupling and screw.
    pub drive: TwoMass<T>,
    /// The load motor.
    pub winding: Winding<T>,
    /// Friction of the drive motor.
    pub motor_friction: Friction<T>,
    /// Friction on the load.
    pub friction: Friction<T>,
    /// Flow over half a step, column by column.
    #[field(unit = "1")]
    half_flow: [[T; STATES + 1]; STATES + INPUTS],
}

/// State of the modelled drive.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveState<T> {
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
    /// Torque held against the motor: its friction.
    #[field(symbol = "M_R,M", unit = "N m")]
    pub motor_resistance: T,
    /// Torque held against the load: its friction and other torques.
    #[field(symbol = "M_R", unit = "N m")]
    pub load_resistance: T,
    /// State of the motor's contact.
    pub motor_memory: Memory<T>,
    /// State of the load's contact.
    pub load_memory: Memory<T>,
}

/// Inputs of the modelled drive over a step.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveModelInput<T> {
    /// Torque reference of the servo amplifier.
    #[field(symbol = "M_aim", unit = "N m")]
    pub motor_torque: T,
    /// Voltage at the load motor.
    #[field(symbol = "u", unit = "V")]
    pub voltage: T,
    /// Torque against positive motion of the load that is neither friction nor the load motor's.
    #[field(symbol = "M_x", unit = "N m")]
    pub resistance: T,
}

/// Motion of the modelled drive in the middle of a step.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DriveModelOutput<T> {
    /// Velocity of the screw.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Velocity of the motor.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
    /// Mean acceleration of the screw over the step.
    #[field(symbol = "Ω̇", unit = "rad/s^2")]
    pub acceleration: T,
    /// Torque of the coupling on the load.
    #[field(symbol = "M_C", unit = "N m")]
    pub coupling_torque: T,
    /// Friction torque on the load, against positive motion.
    #[field(symbol = "M_R", unit = "N m")]
    pub friction_torque: T,
}

impl<T: Scalar> DriveModel<T> {
    /// Prepared for steps of `dt` [s]; the servo amplifier lags by `servo_lag` [s].
    pub fn new(
        drive: TwoMass<T>,
        winding: Winding<T>,
        servo_lag: T,
        motor_friction: Friction<T>,
        friction: Friction<T>,
        dt: T,
    ) -> Self {
        let half_flow = half_flow(&drive, &winding, servo_lag, dt);
        DriveModel { drive, winding, motor_friction, friction, half_flow }
    }

    /// Acceleration of the screw [rad/s²].
    #[inline(always)]
    pub fn acceleration(&self, state: &DriveState<T>) -> T {
        let TwoMass { coupling_stiffness, coupling_damping, load_inertia, .. } = self.drive;
        let coupling = coupling_stiffness * state.twist + coupling_damping * (state.motor_velocity - state.velocity);
        (coupling - state.load_resistance - self.winding.torque_constant * state.load_current) / load_inertia
    }

    /// Half a step of the linear part.
    #[inline(always)]
    fn flow(&self, state: &mut DriveState<T>, motor_resistance: T, load_resistance: T, input: &DriveModelInput<T>) {
        let x = [
            state.twist,
            state.motor_velocity,
            state.velocity,
            state.load_current,
            state.motor_torque,
            motor_resistance,
            load_resistance,
            input.voltage,
            input.motor_torque,
        ];
        let [twist, motor_velocity, velocity, load_current, motor_torque, way] = advance(&self.half_flow, x);
        state.angle += way;
        state.twist = twist;
        state.motor_velocity = motor_velocity;
        state.velocity = velocity;
        state.load_current = load_current;
        state.motor_torque = motor_torque;
    }
}

impl<T: Scalar> Block<T> for DriveModel<T> {
    type State = DriveState<T>;
    type Input = DriveModelInput<T>;
    type Output = DriveModelOutput<T>;

    // Not inlined: it is long, and a law calls it several times in a tick.
    #[inline(never)]
    fn step(&self, state: &mut DriveState<T>, input: DriveModelInput<T>, dt: T) -> DriveModelOutput<T> {
        let start = state.velocity;
        let (motor_held, load_held) = (state.motor_resistance, state.load_resistance);
        self.flow(state, motor_held, load_held, &input);

        let coupling_torque = self.drive.coupling_stiffness * state.twist
            + self.drive.coupling_damping * (state.motor_velocity - state.velocity);
        let zero = T::of(0.0);
        let motor = Sliding {
            inertia: self.drive.motor_inertia,
            velocity: state.motor_velocity,
            angle: state.angle + state.twist,
            load: state.motor_torque,
            held: motor_held,
            others: zero,
        };
        let load = Sliding {
            inertia: self.drive.load_inertia,
            velocity: state.velocity,
            angle: state.angle,
            load: coupling_torque,
            held: load_held,
            others: input.resistance,
        };
        let mut brushes = [(&self.motor_friction, T::of(1.0), &mut state.motor_memory)];
        let mut contacts = [(&self.friction, T::of(1.0), &mut state.load_memory)];
        let motor_middle = predict(&motor, &brushes, dt);
        let load_middle = predict(&load, &contacts, dt);
        (state.motor_velocity, state.motor_resistance) = correct(&motor, motor_middle, &mut brushes, dt);
        (state.velocity, state.load_resistance) = correct(&load, load_middle, &mut contacts, dt);

        self.flow(state, motor_held, load_held, &input);
        DriveModelOutput {
            velocity: load_middle.0,
            motor_velocity: motor_middle.0,
            acceleration: (state.velocity - start) / dt,
            coupling_torque,
            friction_torque: state.load_resistance - input.resistance,
        }
    }
}
