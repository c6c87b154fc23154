//! The remedy of each fault: what to check, the part of the bench that it concerns, and the way back to a usable bench.
//!
//! Messages, records, scripts and the page use this table only.

use super::{ExternalFault, Fault, HomingFault, MachineFault, Role};

/// The way back to a usable bench after a fault, once the cause is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recovery {
    /// Acknowledge. The torque stays off until the operator decides otherwise.
    Acknowledge,
    /// Acknowledge, then arm: the axis is still homed.
    Arm,
    /// Acknowledge, then home again.
    Home,
    /// Acknowledge, then open the external file again, which starts at rest.
    Reopen,
}

/// The part of the bench that a remedy concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Concern {
    /// Gains and limits of the position controller.
    Controller,
    /// The rendered friction.
    Rendering,
    /// Manoeuvre and limits of supervision.
    Limits,
    /// Sensors, their cables and scaling.
    Sensors,
    /// Motors and amplifiers.
    Motors,
    /// Execution time of the software.
    Timing,
    /// Blocks of the software.
    Blocks,
    /// An external file.
    External(Role),
    /// The machine behind a link.
    Machine,
}

/// What to do about a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Remedy {
    /// Name of the kind of fault, for scripts and the search in the help: `following-error`.
    pub code: &'static str,
    /// What to check or to change, in a sentence or two.
    pub text: &'static str,
    /// The part of the bench that it concerns.
    pub concern: Concern,
    /// The way back.
    pub recovery: Recovery,
}

impl Fault {
    /// The remedy of this fault.
    pub fn remedy(&self) -> Remedy {
        let (code, concern, text) = match self {
            Fault::FollowingError { .. } => {
                ("following-error", Concern::Controller, "Reduce the acceleration, or tune the controller.")
            }
            Fault::Overspeed { .. } => ("overspeed", Concern::Limits, "Check the sign of the drive and the set-point."),
            Fault::EndOfStroke { .. } => (
                "end-of-stroke",
                Concern::Limits,
                "Shorten the manoeuvre, or move more slowly near the ends. If the carriage is outside, move it back by hand.",
            ),
            Fault::NotANumber { .. } => ("reading-not-finite", Concern::Sensors, "Check the sensor and its scaling."),
            Fault::Computed { .. } => ("output-not-finite", Concern::Blocks, "Check its parameters and inputs."),
            Fault::EncoderFrozen { .. } => {
                ("encoder-frozen", Concern::Sensors, "Check the encoder's cable, and whether the axis is blocked.")
            }
            Fault::EncoderJumped { .. } => ("encoder-jumped", Concern::Sensors, "Check the counter's range."),
            Fault::SensorsApart { .. } => (
                "sensors-differ",
                Concern::Sensors,
                "Check cables, the tacho's constant and the encoder's lines. If the axis vibrates, reduce the controller's gains.",
            ),
            Fault::CountsLost { .. } => (
                "counts-lost",
                Concern::Sensors,
                "The counter loses counts: check the encoder's cable and its highest frequency.",
            ),
            Fault::IndexMissing { .. } => ("index-missing", Concern::Sensors, "Check the encoder's index wire."),
            Fault::Accelerometer { .. } => (
                "accelerometer",
                Concern::Sensors,
                "Check the accelerometer's supply and its mounting. If the axis vibrates, reduce the controller's gains.",
            ),
            Fault::LoadCurrent { .. } => {
                ("load-current", Concern::Motors, "Check the sign of the current sensor, and the amplifier.")
            }
            Fault::Overcurrent { motor: "load", .. } => {
                ("load-overcurrent", Concern::Rendering, "Reduce the desired friction.")
            }
            Fault::Overcurrent { .. } => {
                ("drive-overcurrent", Concern::Controller, "Reduce the acceleration or the controller's torque limit.")
            }
            Fault::Overheated { motor: "load", .. } => (
                "load-overheated",
                Concern::Rendering,
                "Let the motor cool, and reduce the desired friction or the time for which it is rendered.",
            ),
            Fault::Overheated { .. } => (
                "drive-overheated",
                Concern::Controller,
                "Let the motor cool, and reduce the accelerations or the preload of the friction wheel. If the axis vibrates, \
                 reduce the controller's gains.",
            ),
            Fault::TicksMissed { .. } => {
                ("ticks-missed", Concern::Timing, "Close other programs, and run `stickslip doctor`.")
            }
            Fault::NotStopped { .. } => {
                ("not-stopped", Concern::Motors, "Use the machine's emergency stop, and check the drive's amplifier.")
            }
            Fault::Homing(fault) => fault.remedy(),
            Fault::Machine(fault) => fault.remedy(),
            Fault::External(role, fault) => fault.remedy(*role),
        };
        Remedy { code, text, concern, recovery: self.recovery() }
    }

    /// The way back: it follows from what supervision still admits.
    fn recovery(&self) -> Recovery {
        match self {
            Fault::External(..) => Recovery::Reopen,
            // The amplifier must be checked first.
            Fault::NotStopped { .. } => Recovery::Acknowledge,
            fault if fault.doubts_zero() => Recovery::Home,
            _ => Recovery::Arm,
        }
    }
}

impl HomingFault {
    fn remedy(&self) -> (&'static str, Concern, &'static str) {
        let (code, text) = match self {
            HomingFault::NoIndex { .. } => {
                ("homing-no-index", "Check the encoder's index wire, and that the screw turns.")
            }
            HomingFault::IndexLost { .. } => ("homing-index-lost", "Check for disturbances on the index wire."),
            HomingFault::IndexMoved { .. } => (
                "homing-index-moved",
                "The counter loses counts, or one pulse was a disturbance: check the shield of the encoder's cable.",
            ),
            HomingFault::NotANumber => ("homing-not-finite", "Check the encoder's counter."),
        };
        (code, Concern::Sensors, text)
    }
}

impl MachineFault {
    fn remedy(&self) -> (&'static str, Concern, &'static str) {
        let (code, text) = match self {
            MachineFault::Silent { .. } => (
                "machine-silent",
                "Check that it runs, and check its cable. The bench reconnects automatically. Then acknowledge, and home.",
            ),
            MachineFault::Restarted => (
                "machine-restarted",
                "The bench reconnects automatically when the machine is free. Then acknowledge, and home.",
            ),
            MachineFault::Device { .. } => (
                "device-fault",
                "Look up both codes in the manual of the drive, and remove the cause. Then acknowledge, and home.",
            ),
            MachineFault::WorkingCounter { .. } => (
                "working-counter",
                "Run `stickslip ethercat scan` after the bench has ended, and check cables and supply of the devices.",
            ),
        };
        (code, Concern::Machine, text)
    }
}

impl ExternalFault {
    fn remedy(&self, role: Role) -> (&'static str, Concern, &'static str) {
        let (code, text) = match self {
            ExternalFault::Crashed { .. } => {
                ("external-crashed", "Run it under a debugger or with -fsanitize=address, and load it again.")
            }
            ExternalFault::Ended { .. } => {
                ("external-exited", "A library must not call exit. Correct it, and load it again.")
            }
            ExternalFault::Silent { .. } => {
                ("external-silent", "Check its step for an endless loop or a wait, and load it again.")
            }
            ExternalFault::Late { .. } => {
                ("external-late", "Reduce the duration of its step, and close other programs that use the processor.")
            }
            ExternalFault::NotANumber => {
                ("external-not-finite", "Check for a division by 0 and for uninitialised values.")
            }
            ExternalFault::Failed { .. } => ("external-failed", "See its messages."),
            ExternalFault::FloatingPoint => {
                ("external-rounding", "Compile it without -ffast-math, or restore the mode before its step returns.")
            }
        };
        (code, Concern::External(role), text)
    }
}

#[cfg(test)]
mod tests {
    use std::string::ToString;
    use std::vec::Vec;

    use super::super::{Brake, Request, Safety, SafetyLimits, SafetyState};
    use super::*;

    /// One fault of each kind.
    fn all() -> Vec<Fault> {
        let motors = ["drive", "load"];
        let homing = [
            HomingFault::NoIndex { travel: 9.0 },
            HomingFault::IndexLost { expected: 1.0 },
            HomingFault::IndexMoved { first: 1.0, second: 2.0 },
            HomingFault::NotANumber,
        ];
        let external = [
            ExternalFault::Crashed { signal: 11 },
            ExternalFault::Ended { code: 1 },
            ExternalFault::Silent { time: 1.0 },
            ExternalFault::Late { time: 0.002 },
            ExternalFault::NotANumber,
            ExternalFault::Failed { code: 3 },
            ExternalFault::FloatingPoint,
        ];
        let mut faults = std::vec![
            Fault::FollowingError { error: 1.0, limit: 0.5 },
            Fault::Overspeed { speed: 200.0, limit: 150.0 },
            Fault::EndOfStroke { angle: 300.0, limit: 250.0 },
            Fault::NotANumber { measurement: "tacho" },
            Fault::Computed { block: "controller" },
            Fault::EncoderFrozen { current: 3.0, velocity: 1.0, time: 0.1 },
            Fault::EncoderJumped { speed: 1e3, limit: 150.0 },
            Fault::SensorsApart { tacho: 1.0, encoder: 2.0 },
            Fault::CountsLost { deviation: 0.1, limit: 0.01 },
            Fault::IndexMissing { travel: 7.0 },
            Fault::Accelerometer { difference: 9.0, limit: 5.0 },
            Fault::LoadCurrent { difference: 1.0, limit: 0.5 },
            Fault::TicksMissed { missed: 9 },
            Fault::NotStopped { velocity: 3.0 },
            Fault::Machine(MachineFault::Silent { ticks: 9 }),
            Fault::Machine(MachineFault::Restarted),
            Fault::Machine(MachineFault::Device { position: 1, error: 0x2310, status: 0 }),
            Fault::Machine(MachineFault::WorkingCounter { counter: 4, due: 7 }),
        ];
        faults.extend(motors.map(|motor| Fault::Overcurrent { motor, current: 9.0, limit: 5.0 }));
        faults.extend(motors.map(|motor| Fault::Overheated { motor, current: 9.0, limit: 5.0 }));
        faults.extend(homing.map(Fault::Homing));
        faults.extend(external.map(|fault| Fault::External(Role::Controller, fault)));
        faults
    }

    #[test]
    fn each_fault_has_its_own_remedy_and_its_message_ends_with_it() {
        let remedies: Vec<Remedy> = all().iter().map(Fault::remedy).collect();
        for (n, (remedy, fault)) in remedies.iter().zip(all()).enumerate() {
            assert!(fault.to_string().ends_with(remedy.text), "{fault}");
            assert!(fault.cause().to_string().ends_with('.'), "{}", fault.cause());
            for other in &remedies[..n] {
                assert!(other.code != remedy.code && other.text != remedy.text, "{other:?} and {remedy:?}");
            }
        }
    }

    #[test]
    fn supervision_admits_the_way_back_of_each_fault() {
        for fault in all() {
            let mut safety = Safety::new(SafetyLimits::default(), Brake::default());
            safety.request(Request::Home).unwrap();
            safety.homed(40.0);
            safety.provoke(fault);
            assert_eq!(safety.state(), SafetyState::Fault(fault));
            safety.request(Request::Acknowledge).unwrap();
            let armed = safety.request(Request::Arm).is_ok();
            match fault.remedy().recovery {
                // Homing would be admitted, too, but moves the axis without need.
                Recovery::Arm | Recovery::Reopen => assert!(armed, "{fault}"),
                Recovery::Home => assert!(!armed && safety.request(Request::Home).is_ok(), "{fault}"),
                Recovery::Acknowledge => {}
            }
        }
    }
}
