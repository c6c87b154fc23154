//! What stops the bench.

use core::fmt;

use super::HomingFault;

/// What stopped the bench, with what was measured and what was allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The screw does not follow its set-point.
    FollowingError {
        /// Distance [rad].
        error: f64,
        /// Largest allowed [rad].
        limit: f64,
    },
    /// The screw is too fast.
    Overspeed {
        /// Speed, the larger of tacho and encoder [rad/s].
        speed: f64,
        /// Highest allowed [rad/s].
        limit: f64,
    },
    /// The carriage leaves its stroke, or has more energy than what is left of it can brake.
    EndOfStroke {
        /// Angle from the screw's zero at which it would stand [rad].
        angle: f64,
        /// The end that it would pass [rad].
        limit: f64,
    },
    /// A sensor gives no number.
    NotANumber {
        /// Which measurement.
        measurement: &'static str,
    },
    /// The software computed no number.
    Computed {
        /// Whose output it is.
        block: &'static str,
    },
    /// The encoder stands while current or tacho say that the screw moves.
    EncoderFrozen {
        /// Current of the drive [A].
        current: f64,
        /// Velocity of the tacho [rad/s].
        velocity: f64,
        /// How long it has stood [s].
        time: f64,
    },
    /// The encoder's angle jumped.
    EncoderJumped {
        /// Speed that the jump would take [rad/s].
        speed: f64,
        /// Highest allowed [rad/s].
        limit: f64,
    },
    /// Tacho and encoder say different velocities.
    SensorsApart {
        /// By the tacho [rad/s].
        tacho: f64,
        /// By the encoder [rad/s].
        encoder: f64,
    },
    /// Index pulses are not whole revolutions apart.
    CountsLost {
        /// From the nearest whole revolution [rad].
        deviation: f64,
        /// Largest allowed [rad].
        limit: f64,
    },
    /// The screw turned by more than a revolution without an index pulse.
    IndexMissing {
        /// From the last one [rad].
        travel: f64,
    },
    /// The accelerometer does not say what the tacho's change says.
    Accelerometer {
        /// How far apart they are [rad/s²].
        difference: f64,
        /// Largest allowed [rad/s²].
        limit: f64,
    },
    /// The load motor's current is not what is asked for.
    LoadCurrent {
        /// How far apart they are [A].
        difference: f64,
        /// Largest allowed [A].
        limit: f64,
    },
    /// A motor has too much current.
    Overcurrent {
        /// Which motor.
        motor: &'static str,
        /// Its current [A].
        current: f64,
        /// Highest allowed [A].
        limit: f64,
    },
    /// A motor has had too much current for too long (i²t).
    Overheated {
        /// Which motor.
        motor: &'static str,
        /// Root mean square over the thermal time [A].
        current: f64,
        /// Highest allowed [A].
        limit: f64,
    },
    /// The software came too late.
    TicksMissed {
        /// In a row.
        missed: u64,
    },
    /// The operator's stop did not bring the screw to rest.
    NotStopped {
        /// How fast it still is [rad/s].
        velocity: f64,
    },
    /// The zero was not found.
    Homing(HomingFault),
    /// The machine behind a link is not there any more.
    Machine(MachineFault),
    /// What was brought along for a part of the bench gives no torque any more.
    External(Role, ExternalFault),
}

/// The part that somebody's own file plays in the loop of the bench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// The position controller: its torque is the drive's.
    #[default]
    Controller,
    /// The friction that is rendered: its torque is the load motor's, beside a rendering law that makes the load as
    /// frictionless as it can.
    Friction,
    /// The rendering law: its torque is all of the load motor's.
    Law,
}

impl Role {
    /// All of them.
    pub const ALL: [Role; 3] = [Role::Controller, Role::Friction, Role::Law];

    /// As people and records call it.
    pub fn name(self) -> &'static str {
        match self {
            Role::Controller => "controller",
            Role::Friction => "friction",
            Role::Law => "law",
        }
    }

    /// The one that is called so.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.name() == name)
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What is wrong with something that was brought along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExternalFault {
    /// Its process was ended by a signal.
    Crashed {
        /// Number of the signal.
        signal: i32,
    },
    /// Its process ended by itself.
    Ended {
        /// Exit code.
        code: i32,
    },
    /// It does not answer.
    Silent {
        /// How long [s].
        time: f64,
    },
    /// By the clock: its torque was missing for more ticks than may be missed. Why, may be known later.
    Late {
        /// How long after its sample began it was not there [s].
        time: f64,
    },
    /// Its torque is no finite number.
    NotANumber,
    /// It says that it failed.
    Failed {
        /// What its function returned.
        code: i32,
    },
    /// It changed how floating-point numbers are rounded, or whether small ones are kept.
    FloatingPoint,
}

/// What is wrong with a machine behind a link. No sensor is left to brake by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineFault {
    /// Its readings do not come.
    Silent {
        /// Ticks in a row.
        ticks: u64,
    },
    /// It does not know this bench any more.
    Restarted,
}

impl Fault {
    /// Whether it puts the encoder in doubt, and with it the screw's zero.
    pub fn doubts_zero(&self) -> bool {
        use Fault::{
            CountsLost, EncoderFrozen, EncoderJumped, Homing, IndexMissing, Machine, NotANumber, SensorsApart,
            TicksMissed,
        };
        matches!(
            self,
            NotANumber { .. }
                | EncoderFrozen { .. }
                | EncoderJumped { .. }
                | SensorsApart { .. }
                | CountsLost { .. }
                | IndexMissing { .. }
                | TicksMissed { .. }
                | Homing(_)
                | Machine(_)
        )
    }

    /// Whether it puts the load motor's current in doubt: then its amplifier gets no voltage, and brakes by its short
    /// circuit.
    pub fn doubts_load(&self) -> bool {
        matches!(self, Fault::LoadCurrent { .. } | Fault::NotANumber { .. } | Fault::Computed { .. })
            || matches!(self, Fault::Overcurrent { motor: "load", .. } | Fault::Overheated { motor: "load", .. })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_cause(f)?;
        self.remedy().map_or(Ok(()), |remedy| write!(f, " {remedy}"))
    }
}

impl Fault {
    /// The cause, with what was measured; the whole message of a fault without [`remedy`](Self::remedy).
    fn write_cause(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fault::FollowingError { error, limit } => {
                write!(f, "the screw is {error:.3} rad from its set-point, allowed are {limit:.3} rad.")
            }
            Fault::Overspeed { speed, limit } => {
                write!(f, "the screw turns at {speed:.1} rad/s, allowed are {limit:.1} rad/s.")
            }
            Fault::EndOfStroke { angle, limit } => {
                write!(f, "the screw would stop at {angle:.2} rad, its stroke ends at {limit:.2} rad.")
            }
            Fault::NotANumber { measurement } => write!(f, "the measured {measurement} is no number."),
            Fault::Computed { block } => write!(f, "the {block} gives no number."),
            Fault::EncoderFrozen { current, velocity, time } => write!(
                f,
                "the encoder has stood for {time:.3} s at {current:.2} A and {velocity:.1} rad/s of the tacho."
            ),
            Fault::EncoderJumped { speed, limit } => {
                write!(f, "the encoder's angle jumped as if at {speed:.0} rad/s, allowed are {limit:.1} rad/s.")
            }
            Fault::SensorsApart { tacho, encoder } => {
                write!(f, "the tacho says {tacho:.1} rad/s, the encoder {encoder:.1} rad/s.")
            }
            Fault::CountsLost { deviation, limit } => {
                write!(f, "an index pulse lies {deviation:.4} rad off a whole revolution, allowed are {limit:.4} rad.")
            }
            Fault::IndexMissing { travel } => {
                write!(f, "the screw turned by {travel:.2} rad without an index pulse, it comes every revolution.")
            }
            Fault::Accelerometer { difference, limit } => {
                write!(f, "accelerometer and tacho are {difference:.0} rad/s² apart, allowed are {limit:.0} rad/s².")
            }
            Fault::LoadCurrent { difference, limit } => write!(
                f,
                "the load motor's current is {difference:.2} A from what is asked for, allowed are {limit:.2} A."
            ),
            Fault::Overcurrent { motor, current, limit } => {
                write!(f, "the {motor} motor has {current:.2} A, allowed are {limit:.2} A.")
            }
            Fault::Overheated { motor, current, limit } => {
                write!(f, "the {motor} motor has had {current:.2} A for too long, it bears {limit:.2} A.")
            }
            Fault::TicksMissed { missed } => write!(f, "the software missed {missed} ticks in a row."),
            Fault::NotStopped { velocity } => {
                write!(f, "the screw still turns at {velocity:.1} rad/s though it was braked.")
            }
            Fault::Homing(fault) => fmt::Display::fmt(fault, f),
            Fault::External(role, fault) => fault.tell(*role, f),
            Fault::Machine(fault) => fault.tell(f),
        }
    }

    /// What to do, in a sentence or two.
    fn remedy(&self) -> Option<&'static str> {
        Some(match self {
            Fault::FollowingError { .. } => "Ask for less acceleration, or tune the controller.",
            Fault::Overspeed { .. } => "Check the sign of the drive and the set-point.",
            Fault::EndOfStroke { .. } => {
                "Shorten the manoeuvre, or go more slowly near the ends; where it is outside, move the carriage back by \
                 hand."
            }
            Fault::NotANumber { .. } => "Check the sensor and its scaling.",
            Fault::Computed { .. } => "Check its parameters and what it is given.",
            Fault::EncoderFrozen { .. } => "Check the encoder's cable, and whether the axis is blocked.",
            Fault::EncoderJumped { .. } => "Check the counter's range.",
            Fault::SensorsApart { .. } => "Check cables, the tacho's constant and the encoder's lines.",
            Fault::CountsLost { .. } => {
                "The counter loses counts: check the encoder's cable and its highest frequency."
            }
            Fault::IndexMissing { .. } => "Check the encoder's index wire.",
            Fault::Accelerometer { .. } => "Check the accelerometer's supply and its mounting.",
            Fault::LoadCurrent { .. } => "Check the sign of the current sensor, and the amplifier.",
            Fault::Overcurrent { .. } => "Ask for less torque.",
            Fault::Overheated { .. } => "Let it cool, and ask for less torque.",
            Fault::TicksMissed { .. } => "Close other programs, and see what `stickslip doctor` finds.",
            Fault::NotStopped { .. } => "Check the drive's amplifier; use the machine's emergency stop.",
            Fault::Homing(_) | Fault::External(..) | Fault::Machine(_) => return None,
        })
    }
}

impl MachineFault {
    fn tell(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MachineFault::Silent { ticks } => write!(
                f,
                "the machine has not answered for {ticks} ticks. Check that it runs, and its cable; the bench takes it up \
                 again by itself. Then acknowledge, and home."
            ),
            MachineFault::Restarted => write!(
                f,
                "the machine does not know this bench any more: it was started anew, or another bench has taken it. The \
                 bench takes it up again where nobody else has it. Then acknowledge, and home."
            ),
        }
    }
}

impl ExternalFault {
    fn tell(&self, role: Role, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ExternalFault::Crashed { signal } => {
                let what = match signal {
                    4 => ", an instruction that there is not",
                    6 => ", it gave up",
                    7 => ", memory that is not there",
                    8 => ", a division of integers by 0",
                    9 => ", somebody ended it",
                    11 => ", memory that is not its own",
                    _ => "",
                };
                write!(
                    f,
                    "the {role}'s library crashed (signal {signal}{what}). Run it under a debugger or with \
                     -fsanitize=address, and load it again."
                )
            }
            ExternalFault::Ended { code } => write!(
                f,
                "the {role}'s process ended by itself (exit code {code}). A library must not call exit; load it \
                 again."
            ),
            ExternalFault::Silent { time } => write!(
                f,
                "the {role} has not answered for {time:.3} s. Look for a loop without an end, or for a wait in its \
                 step; load it again."
            ),
            ExternalFault::Late { time } => write!(
                f,
                "the {role}'s torque was not there {:.3} ms after its sample began. Look for what takes so long in its \
                 step, and for other programs that take the processor.",
                1e3 * time
            ),
            ExternalFault::NotANumber => write!(
                f,
                "the {role}'s torque is no finite number. Look for a division by 0 and for a value that is not \
                 initialised."
            ),
            ExternalFault::Failed { code } => {
                write!(f, "the {role} says that it failed (code {code}). See what it says of it.")
            }
            ExternalFault::FloatingPoint => write!(
                f,
                "the {role} changed how floating-point numbers are rounded, or flushes small ones to 0. Compile it \
                 without -ffast-math, or restore the mode before its step returns."
            ),
        }
    }
}
