//! Delays of the amplifiers' inputs.

use super::PlantInput;
use crate::Fields;
use crate::block::Block;
use crate::drive::{Delay, LONGEST_DELAY};
use crate::scalar::Scalar;

/// Delays between the commands and the inputs of both amplifiers, prepared for a tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct InputDelays<T> {
    /// Of the servo amplifier.
    pub servo: Delay<T>,
    /// Of the load amplifier.
    pub amplifier: Delay<T>,
}

/// Commands that have not acted yet, the newest first.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct InputDelaysState<T> {
    /// For the servo amplifier.
    #[field(symbol = "u_servo", unit = "V")]
    pub servo_voltages: [T; LONGEST_DELAY],
    /// For the load amplifier.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_voltages: [T; LONGEST_DELAY],
}

impl<T: Scalar> Block<T> for InputDelays<T> {
    type State = InputDelaysState<T>;
    type Input = PlantInput<T>;
    type Output = PlantInput<T>;

    /// The inputs that act in this tick.
    #[inline(always)]
    fn step(&self, state: &mut InputDelaysState<T>, input: PlantInput<T>, _dt: T) -> PlantInput<T> {
        PlantInput {
            servo_voltage: self.servo.next(&mut state.servo_voltages, input.servo_voltage),
            amplifier_voltage: self.amplifier.next(&mut state.amplifier_voltages, input.amplifier_voltage),
            ..input
        }
    }
}
