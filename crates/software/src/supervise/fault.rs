//! Faults that stop the bench.

use core::fmt;

use super::HomingFault;

/// A fault that stopped the bench, with the measured value and its limit.
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
    /// The carriage leaves its stroke, or has too much energy to stop before its end.
    EndOfStroke {
        /// Angle from the screw's zero at which it would stop [rad].
        angle: f64,
        /// End of the stroke [rad].
        limit: f64,
    },
    /// A measurement is not finite.
    NotANumber {
        /// Which measurement.
        measurement: &'static str,
    },
    /// An output of the software is not finite.
    Computed {
        /// The block with this output.
        block: &'static str,
    },
    /// The encoder is constant while current or tacho indicate motion.
    EncoderFrozen {
        /// Current of the drive [A].
        current: f64,
        /// Velocity of the tacho [rad/s].
        velocity: f64,
        /// Time for which it has been constant [s].
        time: f64,
    },
    /// The encoder's angle jumped.
    EncoderJumped {
        /// Speed equivalent to the jump [rad/s].
        speed: f64,
        /// Highest allowed [rad/s].
        limit: f64,
    },
    /// Velocities of tacho and encoder differ.
    SensorsApart {
        /// Velocity of the tacho [rad/s].
        tacho: f64,
        /// Velocity of the encoder [rad/s].
        encoder: f64,
    },
    /// Index pulses are not whole revolutions apart.
    CountsLost {
        /// Deviation from the nearest whole revolution [rad].
        deviation: f64,
        /// Largest allowed [rad].
        limit: f64,
    },
    /// The screw turned by more than a revolution without an index pulse.
    IndexMissing {
        /// Distance from the last index pulse [rad].
        travel: f64,
    },
    /// Accelerations of accelerometer and tacho differ.
    Accelerometer {
        /// Difference [rad/s²].
        difference: f64,
        /// Largest allowed [rad/s²].
        limit: f64,
    },
    /// The load motor's current differs from its reference.
    LoadCurrent {
        /// Difference [A].
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
    /// The software missed ticks.
    TicksMissed {
        /// Missed ticks in a row.
        missed: u64,
    },
    /// The operator's stop did not bring the screw to rest.
    NotStopped {
        /// Remaining velocity [rad/s].
        velocity: f64,
    },
    /// Homing failed.
    Homing(HomingFault),
    /// The machine behind a link failed.
    Machine(MachineFault),
    /// An external file in the loop no longer gives a torque.
    External(Role, ExternalFault),
}

/// Role of an external file in the loop of the bench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// The position controller: its torque is the drive's.
    #[default]
    Controller,
    /// The rendered friction: its torque is the load motor's, added to that of a rendering law that compensates the
    /// own friction.
    Friction,
    /// The rendering law: its torque is all of the load motor's.
    Law,
}

impl Role {
    /// All roles.
    pub const ALL: [Role; 3] = [Role::Controller, Role::Friction, Role::Law];

    /// Name in messages and records.
    pub fn name(self) -> &'static str {
        match self {
            Role::Controller => "controller",
            Role::Friction => "friction",
            Role::Law => "law",
        }
    }

    /// The role of this name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.name() == name)
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Fault of an external file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExternalFault {
    /// Its process was ended by a signal.
    Crashed {
        /// Number of the signal.
        signal: i32,
    },
    /// Its process exited.
    Ended {
        /// Exit code.
        code: i32,
    },
    /// It does not answer.
    Silent {
        /// Waiting time [s].
        time: f64,
    },
    /// In real time: its torque was missing for more ticks than allowed. The cause may be reported later.
    Late {
        /// Time since the start of its sample [s].
        time: f64,
    },
    /// Its torque is not finite.
    NotANumber,
    /// It reported a failure.
    Failed {
        /// Return value of its function.
        code: i32,
    },
    /// It changed the rounding mode of floating-point numbers, or flushes subnormal ones to 0.
    FloatingPoint,
}

/// Fault of a machine behind a link: no sensor is left for braking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineFault {
    /// Its readings are missing.
    Silent {
        /// Ticks in a row.
        ticks: u64,
    },
    /// It has no connection to this bench any more.
    Restarted,
    /// A device on a fieldbus reports a fault, or has left operation.
    Device {
        /// Its position.
        position: u16,
        /// Error code of the drive (0x603F); 0: none.
        error: u16,
        /// AL status code; 0: none.
        status: u16,
    },
    /// A device on a fieldbus does not exchange data.
    WorkingCounter {
        /// Counted.
        counter: u16,
        /// Expected.
        due: u16,
    },
}

impl Fault {
    /// Whether the encoder, and with it the screw's zero, is no longer reliable.
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

    /// Whether the load motor's current is no longer reliable: then its amplifier gets no voltage, and brakes as a
    /// short circuit.
    pub fn doubts_load(&self) -> bool {
        matches!(self, Fault::LoadCurrent { .. } | Fault::NotANumber { .. } | Fault::Computed { .. })
            || matches!(self, Fault::Overcurrent { motor: "load", .. } | Fault::Overheated { motor: "load", .. })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.cause(), self.remedy().text)
    }
}

/// The cause of a fault as a sentence, with the measured values.
pub struct Cause<'a>(&'a Fault);

impl fmt::Display for Cause<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.write_cause(f)
    }
}

impl Fault {
    /// The cause, without the [`remedy`](Self::remedy).
    pub fn cause(&self) -> Cause<'_> {
        Cause(self)
    }

    fn write_cause(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fault::FollowingError { error, limit } => {
                write!(f, "following error of {error:.3} rad, at most {limit:.3} rad allowed.")
            }
            Fault::Overspeed { speed, limit } => {
                write!(f, "screw speed of {speed:.1} rad/s, at most {limit:.1} rad/s allowed.")
            }
            Fault::EndOfStroke { angle, limit } => {
                write!(f, "the screw would stop at {angle:.2} rad, but its stroke ends at {limit:.2} rad.")
            }
            Fault::NotANumber { measurement } => write!(f, "the measured {measurement} is not finite."),
            Fault::Computed { block } => write!(f, "the output of the {block} is not finite."),
            Fault::EncoderFrozen { current, velocity, time } => write!(
                f,
                "the encoder has been constant for {time:.3} s at {current:.2} A and {velocity:.1} rad/s of the tacho."
            ),
            Fault::EncoderJumped { speed, limit } => {
                write!(f, "the encoder's angle jumped, as at {speed:.0} rad/s; at most {limit:.1} rad/s allowed.")
            }
            Fault::SensorsApart { tacho, encoder } => {
                write!(f, "the tacho measures {tacho:.1} rad/s, the encoder {encoder:.1} rad/s.")
            }
            Fault::CountsLost { deviation, limit } => {
                write!(
                    f,
                    "an index pulse is {deviation:.4} rad off a whole revolution, at most {limit:.4} rad allowed."
                )
            }
            Fault::IndexMissing { travel } => {
                write!(
                    f,
                    "the screw turned by {travel:.2} rad without an index pulse; one is expected every revolution."
                )
            }
            Fault::Accelerometer { difference, limit } => {
                write!(
                    f,
                    "accelerometer and tacho differ by {difference:.0} rad/s², at most {limit:.0} rad/s² allowed."
                )
            }
            Fault::LoadCurrent { difference, limit } => write!(
                f,
                "the load motor's current differs from its reference by {difference:.2} A, at most {limit:.2} A allowed."
            ),
            Fault::Overcurrent { motor, current, limit } => {
                write!(f, "the {motor} motor has {current:.2} A, at most {limit:.2} A allowed.")
            }
            Fault::Overheated { motor, current, limit } => {
                write!(f, "the {motor} motor had {current:.2} A for too long, its continuous current is {limit:.2} A.")
            }
            Fault::TicksMissed { missed } => write!(f, "the software missed {missed} ticks in a row."),
            Fault::NotStopped { velocity } => {
                write!(f, "the screw still turns at {velocity:.1} rad/s after braking.")
            }
            Fault::Homing(fault) => fault.write_cause(f),
            Fault::External(role, fault) => fault.describe(*role, f),
            Fault::Machine(fault) => fault.describe(f),
        }
    }
}

impl MachineFault {
    fn describe(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MachineFault::Silent { ticks } => write!(f, "the machine has not answered for {ticks} ticks."),
            MachineFault::Restarted => write!(
                f,
                "the machine has lost its connection to this bench: it was restarted, or another bench is connected."
            ),
            MachineFault::Device { position, error, status } => {
                write!(f, "device {position} failed: error code 0x{error:04X}, AL status code 0x{status:04X}.")
            }
            MachineFault::WorkingCounter { counter, due } => {
                write!(f, "working counter {counter} instead of {due}: a device does not exchange data.")
            }
        }
    }
}

impl ExternalFault {
    fn describe(&self, role: Role, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ExternalFault::Crashed { signal } => {
                let what = match signal {
                    4 => ", illegal instruction",
                    6 => ", abort",
                    7 => ", bus error",
                    8 => ", division of integers by 0",
                    9 => ", killed",
                    11 => ", invalid memory access",
                    _ => "",
                };
                write!(f, "the {role}'s library crashed (signal {signal}{what}).")
            }
            ExternalFault::Ended { code } => write!(f, "the {role}'s process exited (exit code {code})."),
            ExternalFault::Silent { time } => write!(f, "the {role} has not answered for {time:.3} s."),
            ExternalFault::Late { time } => {
                write!(f, "the {role}'s torque was missing {:.3} ms after the start of its sample.", 1e3 * time)
            }
            ExternalFault::NotANumber => {
                write!(f, "the {role}'s torque is not finite.")
            }
            ExternalFault::Failed { code } => {
                write!(f, "the {role} reported a failure (code {code}).")
            }
            ExternalFault::FloatingPoint => {
                write!(f, "the {role} changed the rounding of floating-point numbers, or flushes subnormal ones to 0.")
            }
        }
    }
}
