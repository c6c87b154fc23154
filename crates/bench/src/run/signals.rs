//! The signals of a cycle, as the channels of a record.

use stickslip_core::Fields;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::tick::{Measurement, TickOutput};
use stickslip_software::cycle::{Command, Frame};
use stickslip_software::supervise::SafetyState;

use super::numbers::{from_numbers, numbers};
use stickslip_base::parameters::{self, Entry};

/// The signals of a cycle: command, readings, and results of the software.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Signals<T> {
    /// Screw angle from the encoder, relative to the screw's zero once it is known.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Set-point, relative to the same zero.
    pub setpoint: Setpoint<T>,
    /// Whether the position controller was requested.
    #[field(unit = "1", flag)]
    pub control: T,
    /// Whether the rendering law was requested.
    #[field(unit = "1", flag)]
    pub render: T,
    /// Torque added to that of the position controller.
    #[field(symbol = "M_add", unit = "N m")]
    pub added_torque: T,
    /// Torque of the load motor added to that of the rendering law, against positive motion.
    #[field(symbol = "M_add,L", unit = "N m")]
    pub added_load_torque: T,
    /// Readings at the start of the tick.
    pub measurement: Measurement<T>,
    /// Results of the software.
    pub software: TickOutput<T>,
    /// State of supervision after the tick: 0 off, 1 homing, 2 ready, 3 running, 4 fault, 5 stopping.
    #[field(unit = "1", whole)]
    pub state: T,
}

impl Signals<f64> {
    /// Signals of a cycle.
    pub fn of(frame: &Frame) -> Self {
        let flag = |on: bool| f64::from(u8::from(on));
        let Command { setpoint, control, render, added_torque, added_load_torque, .. } = frame.command;
        Signals {
            angle: frame.angle,
            setpoint,
            control: flag(control),
            render: flag(render),
            added_torque,
            added_load_torque,
            measurement: frame.measurement,
            software: frame.signals,
            state: code(&frame.safety),
        }
    }

    /// The command.
    pub fn command(&self) -> Command {
        Command {
            setpoint: self.setpoint,
            control: self.control > 0.5,
            render: self.render > 0.5,
            added_torque: self.added_torque,
            added_load_torque: self.added_load_torque,
            mark: 0,
        }
    }

    /// In the order of [`channels`].
    pub fn row(&self) -> Vec<f64> {
        numbers(self)
    }

    /// Signals from a row; `None` for a wrong length.
    pub fn from_row(row: &[f64]) -> Option<Self> {
        from_numbers(row)
    }
}

/// Names of the states of supervision, by their numbers.
pub const STATES: [&str; 6] = ["off", "homing", "ready", "running", "fault", "stopping"];

/// Name of a state of supervision.
pub fn state_name(state: &SafetyState) -> &'static str {
    STATES[code(state) as usize]
}

/// Name, symbol, unit and meaning of each signal, in the order of a row.
pub fn channels() -> Vec<Entry> {
    parameters::flatten(&Signals::default())
}

/// State of supervision as a number.
fn code(state: &SafetyState) -> f64 {
    match state {
        SafetyState::Off => 0.0,
        SafetyState::Homing => 1.0,
        SafetyState::Ready => 2.0,
        SafetyState::Running => 3.0,
        SafetyState::Fault(_) => 4.0,
        SafetyState::Stopping(_) => 5.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bench as _, VirtualBench};

    #[test]
    fn a_row_has_a_channel_for_each_number_and_restores_the_signals() {
        let preset = stickslip_base::parameters::presets::find("clm-bench").unwrap().read().unwrap();
        let mut bench = VirtualBench::new(&preset, 1).unwrap();
        let setpoint = Setpoint { position: 0.25, velocity: -1.5, acceleration: 0.5 };
        let command = Command { setpoint, render: true, added_torque: 0.125, ..Command::default() };
        let frame = bench.step(command).unwrap();
        let signals = Signals::of(&frame);
        let (row, channels) = (signals.row(), channels());
        assert_eq!(row.len(), channels.len());
        assert_eq!(Signals::from_row(&row), Some(signals));
        assert_eq!(signals.command(), command);
        let of = |name: &str| row[channels.iter().position(|channel| channel.path == name).unwrap()];
        assert_eq!((of("setpoint.velocity"), of("added_torque"), of("render"), of("control")), (-1.5, 0.125, 1.0, 0.0));
        assert_eq!(of("measurement.count"), frame.measurement.count);
        assert_eq!(of("software.estimated_velocity"), frame.signals.estimated_velocity);
        // A recording also requires distinct names with units.
        let mut names: Vec<_> = channels.iter().map(|channel| &channel.path).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), channels.len());
        assert!(channels.iter().all(|channel| !channel.field.unit.is_empty() && !channel.field.help.is_empty()));
    }
}
