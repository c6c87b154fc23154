//! The state of supervision, stored and restored.

use super::monitor::{Acceleration, Monitor};
use super::safety::Stop;
use super::{Braking, ExternalFault, Fault, HomingFault, MachineFault, Role, Safety, SafetyState};
use stickslip_core::snapshot::{StateVisitor, choice, fields, flag, optional};

/// Subjects of faults.
const NAMES: [&str; 11] = [
    "",
    "screw angle",
    "tacho velocity",
    "acceleration",
    "load current",
    "velocity observer",
    "position controller",
    "rendering law",
    "current control",
    "drive",
    "load",
];
/// Number of the kinds of faults.
const FAULTS: usize = 31;
/// Number of states; a stop by a fault is a separate one.
const STATES: usize = 7;

impl Safety {
    pub(crate) fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Safety { limits, brake, state, zero, monitor, stop, braking, quiet } = self;
        fields(keep, limits);
        fields(keep, brake);
        state.keep(keep);
        optional(keep, zero);
        monitor.keep(keep);
        let Stop { begin, ramp, time, held } = stop;
        [begin, ramp, time, held].into_iter().for_each(|number| keep.number(number));
        let mut brakes = braking.is_some();
        let Braking { mut torque, mut shorted } = braking.unwrap_or(Braking { torque: 0.0, shorted: false });
        flag(keep, &mut brakes);
        keep.number(&mut torque);
        flag(keep, &mut shorted);
        *braking = brakes.then_some(Braking { torque, shorted });
        keep.number(quiet);
    }
}

impl Monitor {
    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let Monitor {
            previous,
            standing,
            encoder,
            tacho,
            counted,
            jumped,
            sensors_apart,
            index,
            index_deviation,
            acceleration,
            current,
            current_apart,
            heat: [drive, load],
        } = self;
        [previous, jumped, index].into_iter().for_each(|number| optional(keep, number));
        let Acceleration { started, velocity, measured, offset, difference, apart } = acceleration;
        flag(keep, started);
        [
            standing,
            encoder,
            tacho,
            counted,
            sensors_apart,
            index_deviation,
            velocity,
            measured,
            offset,
            difference,
            apart,
            current,
            current_apart,
            drive,
            load,
        ]
        .into_iter()
        .for_each(|number| keep.number(number));
    }
}

impl SafetyState {
    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        let state = match self {
            SafetyState::Off => 0,
            SafetyState::Homing => 1,
            SafetyState::Ready => 2,
            SafetyState::Running => 3,
            SafetyState::Stopping(None) => 4,
            SafetyState::Stopping(Some(_)) => 5,
            SafetyState::Fault(_) => 6,
        };
        let state = choice(keep, state, STATES);
        let (mut kind, mut numbers, mut name) = self.fault().map_or((0, [0.0; 3], ""), parts);
        kind = choice(keep, kind, FAULTS);
        numbers.iter_mut().for_each(|number| keep.number(number));
        let place = NAMES.iter().position(|known| *known == name);
        debug_assert!(place.is_some(), "{name} is not among the names");
        name = NAMES[choice(keep, place.unwrap_or(0), NAMES.len())];
        let fault = fault(kind, numbers, name);
        *self = match state {
            0 => SafetyState::Off,
            1 => SafetyState::Homing,
            2 => SafetyState::Ready,
            3 => SafetyState::Running,
            4 => SafetyState::Stopping(None),
            5 => SafetyState::Stopping(Some(fault)),
            _ => SafetyState::Fault(fault),
        };
    }
}

/// Kind, numbers and subject of a fault.
fn parts(fault: Fault) -> (usize, [f64; 3], &'static str) {
    match fault {
        Fault::FollowingError { error, limit } => (0, [error, limit, 0.0], ""),
        Fault::Overspeed { speed, limit } => (1, [speed, limit, 0.0], ""),
        Fault::EndOfStroke { angle, limit } => (2, [angle, limit, 0.0], ""),
        Fault::NotANumber { measurement } => (3, [0.0; 3], measurement),
        Fault::Computed { block } => (4, [0.0; 3], block),
        Fault::EncoderFrozen { current, velocity, time } => (5, [current, velocity, time], ""),
        Fault::EncoderJumped { speed, limit } => (6, [speed, limit, 0.0], ""),
        Fault::SensorsApart { tacho, encoder } => (7, [tacho, encoder, 0.0], ""),
        Fault::CountsLost { deviation, limit } => (8, [deviation, limit, 0.0], ""),
        Fault::IndexMissing { travel } => (9, [travel, 0.0, 0.0], ""),
        Fault::Accelerometer { difference, limit } => (10, [difference, limit, 0.0], ""),
        Fault::LoadCurrent { difference, limit } => (11, [difference, limit, 0.0], ""),
        Fault::Overcurrent { motor, current, limit } => (12, [current, limit, 0.0], motor),
        Fault::Overheated { motor, current, limit } => (13, [current, limit, 0.0], motor),
        Fault::TicksMissed { missed } => (14, [missed as f64, 0.0, 0.0], ""),
        Fault::NotStopped { velocity } => (15, [velocity, 0.0, 0.0], ""),
        Fault::Homing(HomingFault::NoIndex { travel }) => (16, [travel, 0.0, 0.0], ""),
        Fault::Homing(HomingFault::IndexLost { expected }) => (17, [expected, 0.0, 0.0], ""),
        Fault::Homing(HomingFault::IndexMoved { first, second }) => (18, [first, second, 0.0], ""),
        Fault::Homing(HomingFault::NotANumber) => (19, [0.0; 3], ""),
        Fault::Machine(MachineFault::Silent { ticks }) => (20, [ticks as f64, 0.0, 0.0], ""),
        Fault::Machine(MachineFault::Restarted) => (21, [0.0; 3], ""),
        Fault::External(role, ExternalFault::Crashed { signal }) => (22, [f64::from(signal), 0.0, place(role)], ""),
        Fault::External(role, ExternalFault::Ended { code }) => (23, [f64::from(code), 0.0, place(role)], ""),
        Fault::External(role, ExternalFault::Silent { time }) => (24, [time, 0.0, place(role)], ""),
        Fault::External(role, ExternalFault::NotANumber) => (25, [0.0, 0.0, place(role)], ""),
        Fault::External(role, ExternalFault::Failed { code }) => (26, [f64::from(code), 0.0, place(role)], ""),
        Fault::External(role, ExternalFault::FloatingPoint) => (27, [0.0, 0.0, place(role)], ""),
        Fault::External(role, ExternalFault::Late { time }) => (28, [time, 0.0, place(role)], ""),
        Fault::Machine(MachineFault::Device { position, error, status }) => {
            (29, [position, error, status].map(f64::from), "")
        }
        Fault::Machine(MachineFault::WorkingCounter { counter, due }) => (30, [counter, due, 0].map(f64::from), ""),
    }
}

/// The fault of these parts.
fn fault(kind: usize, [a, b, c]: [f64; 3], name: &'static str) -> Fault {
    match kind {
        0 => Fault::FollowingError { error: a, limit: b },
        1 => Fault::Overspeed { speed: a, limit: b },
        2 => Fault::EndOfStroke { angle: a, limit: b },
        3 => Fault::NotANumber { measurement: name },
        4 => Fault::Computed { block: name },
        5 => Fault::EncoderFrozen { current: a, velocity: b, time: c },
        6 => Fault::EncoderJumped { speed: a, limit: b },
        7 => Fault::SensorsApart { tacho: a, encoder: b },
        8 => Fault::CountsLost { deviation: a, limit: b },
        9 => Fault::IndexMissing { travel: a },
        10 => Fault::Accelerometer { difference: a, limit: b },
        11 => Fault::LoadCurrent { difference: a, limit: b },
        12 => Fault::Overcurrent { motor: name, current: a, limit: b },
        13 => Fault::Overheated { motor: name, current: a, limit: b },
        14 => Fault::TicksMissed { missed: a as u64 },
        15 => Fault::NotStopped { velocity: a },
        16 => Fault::Homing(HomingFault::NoIndex { travel: a }),
        17 => Fault::Homing(HomingFault::IndexLost { expected: a }),
        18 => Fault::Homing(HomingFault::IndexMoved { first: a, second: b }),
        19 => Fault::Homing(HomingFault::NotANumber),
        20 => Fault::Machine(MachineFault::Silent { ticks: a as u64 }),
        21 => Fault::Machine(MachineFault::Restarted),
        22 => Fault::External(role(c), ExternalFault::Crashed { signal: a as i32 }),
        23 => Fault::External(role(c), ExternalFault::Ended { code: a as i32 }),
        24 => Fault::External(role(c), ExternalFault::Silent { time: a }),
        25 => Fault::External(role(c), ExternalFault::NotANumber),
        26 => Fault::External(role(c), ExternalFault::Failed { code: a as i32 }),
        27 => Fault::External(role(c), ExternalFault::FloatingPoint),
        29 => Fault::Machine(MachineFault::Device { position: a as u16, error: b as u16, status: c as u16 }),
        30 => Fault::Machine(MachineFault::WorkingCounter { counter: a as u16, due: b as u16 }),
        _ => Fault::External(role(c), ExternalFault::Late { time: a }),
    }
}

/// A role as a number, and back.
fn place(role: Role) -> f64 {
    f64::from(role as u8)
}

fn role(number: f64) -> Role {
    Role::ALL.get(number as usize).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::cycle::{Parameters, Software};

    /// Stores numbers, or restores them from a place on; counts invalid ones.
    #[derive(Default)]
    struct Row(Vec<f64>, Option<usize>, usize);

    impl StateVisitor for Row {
        fn number(&mut self, value: &mut f64) {
            match &mut self.1 {
                None => self.0.push(*value),
                Some(next) => {
                    *value = self.0[*next];
                    *next += 1;
                }
            }
        }

        fn invalid(&mut self) {
            self.2 += 1;
        }
    }

    #[test]
    fn every_fault_and_every_state_is_restored() {
        for kind in 0..FAULTS {
            for name in NAMES {
                let (again, numbers, said) = parts(fault(kind, [1.0, 2.0, 3.0], name));
                assert!(again == kind && numbers[0] != 2.0 && (said == name || said.is_empty()), "{kind}");
            }
        }
        let known = Fault::Overheated { motor: "load", current: 3.5, limit: 3.0 };
        let states = [
            SafetyState::Off,
            SafetyState::Homing,
            SafetyState::Ready,
            SafetyState::Running,
            SafetyState::Stopping(None),
            SafetyState::Stopping(Some(known)),
            SafetyState::Fault(known),
        ];
        for mut state in states {
            let mut row = Row::default();
            state.keep(&mut row);
            let mut other = SafetyState::Off;
            row.1 = Some(0);
            other.keep(&mut row);
            assert_eq!((other, row.2), (state, 0));
        }
    }

    #[test]
    fn an_invalid_number_is_reported_and_changes_nothing() {
        let mut software = Software::new(Parameters::default(), 1e-3);
        let mut row = Row::default();
        software.keep(&mut row);
        let whole = row.0.clone();
        let mut invalid_numbers = 0;
        for place in 0..whole.len() {
            let mut row = Row(whole.clone(), Some(0), 0);
            row.0[place] = 1e18;
            software.keep(&mut row);
            invalid_numbers += row.2;
            software.keep(&mut Row(whole.clone(), Some(0), 0));
        }
        assert!(invalid_numbers >= 15, "{invalid_numbers}");
    }
}
