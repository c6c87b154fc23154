//! State, inputs and motion of the moving parts.

use crate::Fields;
use crate::friction::Memory;

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
