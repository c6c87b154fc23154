//! What the bench may do now, and what takes that away.

#[cfg(test)]
mod tests;

use core::fmt;

use super::HomingFault;
use crate::Fields;
use crate::fields::{Relation, at_least};
use crate::scalar::Scalar;

/// What is too much. The stroke counts from the screw's zero.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = SafetyLimits::law)]
pub struct SafetyLimits<T> {
    /// Largest distance between set-point and screw.
    #[field(symbol = "e_max", unit = "rad", range = 1e-6..=1e4, default = 1.0)]
    pub following_error: T,
    /// Highest speed of the screw.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-2..=1e4, default = 350.0)]
    pub speed: T,
    /// Lower end of the stroke.
    #[field(symbol = "φ_min", unit = "rad", range = -1e6..=1e6, default = -157.0)]
    pub lower_end: T,
    /// Upper end of the stroke.
    #[field(symbol = "φ_max", unit = "rad", range = -1e6..=1e6, default = 157.0)]
    pub upper_end: T,
    /// Current of the drive that must move the screw: well above what breakaway takes.
    #[field(symbol = "i_f", unit = "A", range = 1e-3..=1e3, default = 8.0)]
    pub moving_current: T,
    /// Tacho velocity at which the encoder must count.
    #[field(symbol = "Ω_f", unit = "rad/s", range = 1e-2..=1e3, default = 5.0)]
    pub moving_velocity: T,
    /// How long the encoder may stand nevertheless.
    #[field(symbol = "T_f", unit = "s", range = 1e-3..=10.0, default = 0.05)]
    pub frozen_time: T,
    /// Deceleration with which a set-point that nobody leads any more comes to rest.
    #[field(symbol = "a_stop", unit = "rad/s^2", range = 1.0..=1e6, default = 600.0)]
    pub stop_deceleration: T,
}

impl<T: Scalar> SafetyLimits<T> {
    /// There is a stroke.
    fn law(&self) -> [Relation<T>; 1] {
        [at_least("upper_end", self.upper_end, self.lower_end, "The upper end of the stroke is above the lower one.")]
    }
}

/// What the safety functions read in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyInput {
    /// Unwrapped screw angle of the encoder [rad], never set back while the bench is on.
    pub measured_angle: f64,
    /// Velocity of the tacho [rad/s].
    pub measured_velocity: f64,
    /// Current of the drive motor [A].
    pub drive_current: f64,
    /// Current of the load motor [A].
    pub load_current: f64,
    /// Where the screw should be, counted as the measured angle [rad].
    pub reference_position: f64,
}

/// What the bench may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SafetyState {
    /// No torque, nothing supervised.
    Off,
    /// Searching the index.
    Homing,
    /// The zero is known; no torque.
    Ready,
    /// Torque, under control.
    Running,
    /// No torque until the fault is acknowledged.
    Fault(Fault),
}

impl SafetyState {
    /// Whether the motors may have torque.
    pub fn allows_torque(&self) -> bool {
        matches!(self, SafetyState::Homing | SafetyState::Running)
    }
}

/// What took the torque away, with what was measured and what was allowed.
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
    /// The carriage leaves its stroke.
    EndOfStroke {
        /// Angle from the screw's zero [rad].
        angle: f64,
        /// The end that was passed [rad].
        limit: f64,
    },
    /// A sensor gives no number.
    NotANumber {
        /// Which measurement.
        measurement: &'static str,
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
    /// The zero was not found.
    Homing(HomingFault),
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Fault::FollowingError { error, limit } => write!(
                f,
                "the screw is {error:.3} rad from its set-point, allowed are {limit:.3} rad. Ask for less \
                 acceleration, or tune the controller."
            ),
            Fault::Overspeed { speed, limit } => write!(
                f,
                "the screw turns at {speed:.1} rad/s, allowed are {limit:.1} rad/s. Check the sign of the \
                 drive and the set-point."
            ),
            Fault::EndOfStroke { angle, limit } => write!(
                f,
                "the screw is at {angle:.2} rad, its stroke ends at {limit:.2} rad. Move the carriage back \
                 by hand, shorten the manoeuvre."
            ),
            Fault::NotANumber { measurement } => {
                write!(f, "the measured {measurement} is no number. Check the sensor and its scaling.")
            }
            Fault::EncoderFrozen { current, velocity, time } => write!(
                f,
                "the encoder has stood for {time:.3} s at {current:.2} A and {velocity:.1} rad/s of the \
                 tacho. Check the encoder's cable, and whether the axis is blocked."
            ),
            Fault::Homing(fault) => fault.fmt(f),
        }
    }
}

/// What the operator asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Search the index.
    Home,
    /// Be ready again without homing, where the zero is still known.
    Arm,
    /// Torque, under control.
    Start,
    /// No more torque.
    Stop,
    /// Switch off.
    Off,
    /// The fault is seen.
    Acknowledge,
}

/// A request that the present state does not admit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refusal {
    /// What was asked for.
    pub request: Request,
    /// The state that stays.
    pub state: SafetyState,
    /// What to do first.
    pub remedy: &'static str,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the bench refuses {:?}: it is {:?}. {}", self.request, self.state, self.remedy)
    }
}

impl core::error::Error for Refusal {}

/// The safety functions.
#[derive(Clone, Copy, Debug)]
pub struct Safety {
    limits: SafetyLimits<f64>,
    state: SafetyState,
    /// Encoder angle of the screw's zero [rad], where known.
    zero: Option<f64>,
    /// Encoder angle of the cycle before [rad], and how long it has stood [s].
    previous: Option<f64>,
    standing: f64,
}

impl Safety {
    /// Switched off, zero unknown.
    pub fn new(limits: SafetyLimits<f64>) -> Self {
        Safety { limits, state: SafetyState::Off, zero: None, previous: None, standing: 0.0 }
    }

    /// What is too much.
    pub fn limits(&self) -> &SafetyLimits<f64> {
        &self.limits
    }

    /// What is too much from the next cycle on.
    pub fn set_limits(&mut self, limits: SafetyLimits<f64>) {
        self.limits = limits;
    }

    /// What the bench may do.
    pub fn state(&self) -> SafetyState {
        self.state
    }

    /// Encoder angle of the screw's zero [rad], where known.
    pub fn zero(&self) -> Option<f64> {
        self.zero
    }

    /// A request of the operator: the new state, or why not.
    pub fn request(&mut self, request: Request) -> Result<SafetyState, Refusal> {
        use SafetyState::{Fault, Homing, Off, Ready, Running};
        let refused = |state, remedy| Err(Refusal { request, state, remedy });
        let next = match (request, self.state) {
            (Request::Acknowledge, Fault(_)) => Off,
            (_, Fault(_)) => return refused(self.state, "Acknowledge the fault first."),
            (Request::Off, _) => Off,
            (Request::Home, Off | Ready) => Homing,
            (Request::Arm, Off) if self.zero.is_some() => Ready,
            (Request::Arm, Off) => return refused(self.state, "Home first: the zero is not known."),
            (Request::Start, Ready) => Running,
            (Request::Start, _) => return refused(self.state, "Home or arm first, and start once."),
            (Request::Stop, Running) => Ready,
            (Request::Stop, Homing) => Off,
            (Request::Stop, _) => return refused(self.state, "Nothing runs."),
            (Request::Home, _) => return refused(self.state, "Stop first."),
            (Request::Arm, _) => return refused(self.state, "Stop or switch off first."),
            (Request::Acknowledge, _) => return refused(self.state, "There is no fault."),
        };
        if next == Homing {
            self.zero = None;
        }
        (self.state, self.standing) = (next, 0.0);
        Ok(next)
    }

    /// Homing found the index at this encoder angle [rad]: from now on the screw's zero.
    pub fn homed(&mut self, index: f64) {
        if self.state == SafetyState::Homing {
            self.zero = Some(index);
            self.state = SafetyState::Ready;
        }
    }

    /// Homing failed.
    pub fn homing_failed(&mut self, fault: HomingFault) {
        if self.state == SafetyState::Homing {
            self.fault(Fault::Homing(fault));
        }
    }

    /// One cycle of `dt` [s]; the first fault stays until it is acknowledged.
    pub fn step(&mut self, input: SafetyInput, dt: f64) -> SafetyState {
        if !matches!(self.state, SafetyState::Off | SafetyState::Fault(_))
            && let Err(fault) = self.check(&input, dt)
        {
            self.fault(fault);
        }
        self.standing = if self.previous == Some(input.measured_angle) { self.standing + dt } else { 0.0 };
        self.previous = input.measured_angle.is_finite().then_some(input.measured_angle);
        self.state
    }

    fn fault(&mut self, fault: Fault) {
        // What puts the encoder in doubt puts the zero in doubt.
        if matches!(fault, Fault::NotANumber { .. } | Fault::EncoderFrozen { .. } | Fault::Homing(_)) {
            self.zero = None;
        }
        self.state = SafetyState::Fault(fault);
    }

    fn check(&self, input: &SafetyInput, dt: f64) -> Result<(), Fault> {
        let limits = &self.limits;
        for (value, measurement) in [
            (input.measured_angle, "screw angle"),
            (input.measured_velocity, "tacho velocity"),
            (input.drive_current, "drive current"),
            (input.load_current, "load current"),
        ] {
            if !value.is_finite() {
                return Err(Fault::NotANumber { measurement });
            }
        }
        let counted = (input.measured_angle - self.previous.unwrap_or(input.measured_angle)) / dt;
        let speed = input.measured_velocity.abs().max(counted.abs());
        if speed > limits.speed {
            return Err(Fault::Overspeed { speed, limit: limits.speed });
        }
        if !self.state.allows_torque() {
            return Ok(());
        }
        let error = (input.reference_position - input.measured_angle).abs();
        // Not `error > limit`: a set-point that is no number is a fault as well.
        if error.is_nan() || error > limits.following_error {
            return Err(Fault::FollowingError { error, limit: limits.following_error });
        }
        let stands = self.previous == Some(input.measured_angle) && self.standing + dt >= limits.frozen_time;
        let (current, velocity) = (input.drive_current, input.measured_velocity);
        if stands && (current.abs() > limits.moving_current || velocity.abs() > limits.moving_velocity) {
            return Err(Fault::EncoderFrozen { current, velocity, time: self.standing + dt });
        }
        match self.zero.map(|zero| input.measured_angle - zero) {
            Some(angle) if angle > limits.upper_end => Err(Fault::EndOfStroke { angle, limit: limits.upper_end }),
            Some(angle) if angle < limits.lower_end => Err(Fault::EndOfStroke { angle, limit: limits.lower_end }),
            _ => Ok(()),
        }
    }
}
