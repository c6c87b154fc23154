//! Safety states of the bench, and the faults that stop it.
//!
//!   off → homing → ready → running → stopping → ready
//!                                  ↘ stopping → fault, kept until it is acknowledged → off
//!
//! A stop by the operator or by a fault brings the screw to rest with the [`Brake`] before the torque is switched off.
//! If no sensor is left for braking, or the brake does not work, the torque is switched off at once: friction and the
//! load motor, shorted by its amplifier, stop the screw.

#[cfg(test)]
mod tests;

use core::fmt;

use super::monitor::Monitor;
use super::{Brake, ExternalFault, Fault, HomingFault, MachineFault, Role, SafetyLimits};

/// Multiple of the braking time after which, with [`PATIENCE`], braking has failed.
const LATE: f64 = 1.5;
/// Additional time before braking has failed [s].
const PATIENCE: f64 = 0.25;

/// Inputs of the safety functions in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyInput {
    /// Unwrapped screw angle of the encoder [rad], never set back while the bench is on.
    pub measured_angle: f64,
    /// This angle as latched at an index pulse since the last cycle [rad].
    pub index: Option<f64>,
    /// Velocity of the tacho [rad/s], or estimated where there is none.
    pub measured_velocity: f64,
    /// Acceleration of the screw by the accelerometer [rad/s²]; `None` on a bench without accelerometer and tacho.
    pub acceleration: Option<f64>,
    /// Current of the drive motor [A].
    pub drive_current: f64,
    /// Current of the load motor [A].
    pub load_current: f64,
    /// Reference of the load motor's current [A].
    pub asked_load_current: f64,
    /// Set-point of the screw, from the same origin as the measured angle [rad].
    pub reference_position: f64,
    /// The block of the software with a non-finite output.
    pub broken: Option<&'static str>,
    /// Ticks that were missed before this one.
    pub missed: u64,
}

/// State of the bench.
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
    /// Braking to rest, by the operator or by a fault, which then stays.
    Stopping(Option<Fault>),
    /// No torque until the fault is acknowledged.
    Fault(Fault),
}

impl SafetyState {
    /// Whether commands may move the motors.
    pub fn allows_torque(&self) -> bool {
        matches!(self, SafetyState::Homing | SafetyState::Running)
    }

    /// The fault that stopped the bench, or is stopping it.
    pub fn fault(&self) -> Option<Fault> {
        match *self {
            SafetyState::Fault(fault) => Some(fault),
            SafetyState::Stopping(fault) => fault,
            _ => None,
        }
    }
}

/// A request of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Search the index.
    Home,
    /// Become ready without homing, if the axis is still homed.
    Arm,
    /// Switch on the torque, under control.
    Start,
    /// Stop, then switch off the torque.
    Stop,
    /// Switch off: no torque at once.
    Off,
    /// Acknowledge the fault.
    Acknowledge,
}

/// A request that the present state does not admit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refusal {
    /// The request.
    pub request: Request,
    /// The present state, which does not change.
    pub state: SafetyState,
    /// Remedy.
    pub remedy: &'static str,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let request = match self.request {
            Request::Home => "home",
            Request::Arm => "arm",
            Request::Start => "start",
            Request::Stop => "stop",
            Request::Off => "switch off",
            Request::Acknowledge => "acknowledge a fault",
        };
        let state = match self.state {
            SafetyState::Off => "off",
            SafetyState::Homing => "homing",
            SafetyState::Ready => "ready",
            SafetyState::Running => "running",
            SafetyState::Stopping(_) => "stopping",
            SafetyState::Fault(_) => "stopped by a fault",
        };
        write!(f, "cannot {request} while the bench is {state}. {}", self.remedy)
    }
}

impl core::error::Error for Refusal {}

/// An active stop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Stop {
    /// Speed at its start, and its present set-point [rad/s].
    pub(super) begin: f64,
    pub(super) ramp: f64,
    /// Time since its start [s].
    pub(super) time: f64,
    /// Torque against a load that pushes [N m].
    pub(super) held: f64,
}

/// Outputs of a stop to the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Braking {
    /// Torque of the drive [N m].
    pub torque: f64,
    /// Whether the load motor's amplifier gets no voltage, so that its short circuit brakes; otherwise the reference of
    /// the current is 0.
    pub shorted: bool,
}

/// The safety functions.
#[derive(Clone, Copy, Debug)]
pub struct Safety {
    pub(super) limits: SafetyLimits<f64>,
    pub(super) brake: Brake<f64>,
    pub(super) state: SafetyState,
    /// Encoder angle of the screw's zero [rad], where known.
    pub(super) zero: Option<f64>,
    pub(super) monitor: Monitor,
    pub(super) stop: Stop,
    pub(super) braking: Option<Braking>,
    /// Time for which the screw has been at rest [s].
    pub(super) quiet: f64,
}

impl Safety {
    /// Switched off at rest, zero unknown.
    pub fn new(limits: SafetyLimits<f64>, brake: Brake<f64>) -> Self {
        Safety {
            limits,
            brake,
            state: SafetyState::Off,
            zero: None,
            monitor: Monitor::default(),
            stop: Stop::default(),
            braking: None,
            quiet: f64::INFINITY,
        }
    }

    /// Limits.
    pub fn limits(&self) -> &SafetyLimits<f64> {
        &self.limits
    }

    /// Limits and brake from the next cycle on.
    pub fn set_limits(&mut self, limits: SafetyLimits<f64>, brake: Brake<f64>) {
        (self.limits, self.brake) = (limits, brake);
    }

    /// State of the bench.
    pub fn state(&self) -> SafetyState {
        self.state
    }

    /// Encoder angle of the screw's zero [rad], where known.
    pub fn zero(&self) -> Option<f64> {
        self.zero
    }

    /// Outputs of the brake in the last cycle, if it is active.
    pub fn braking(&self) -> Option<Braking> {
        self.braking
    }

    /// A request of the operator: the new state, or the reason of its refusal.
    pub fn request(&mut self, request: Request) -> Result<SafetyState, Refusal> {
        use SafetyState::{Fault, Homing, Off, Ready, Running, Stopping};
        let refused = |state, remedy| Err(Refusal { request, state, remedy });
        let next = match (request, self.state) {
            (Request::Acknowledge, Fault(_)) => Off,
            (_, Fault(_)) => return refused(self.state, "Acknowledge the fault first."),
            (Request::Off, Stopping(Some(fault))) => Fault(fault),
            (Request::Off, _) => Off,
            (_, Stopping(_)) => return refused(self.state, "Wait until it has come to rest."),
            (Request::Home, Off | Ready) => Homing,
            (Request::Arm, Off) if self.zero.is_some() => Ready,
            (Request::Arm, Off) => return refused(self.state, "Home first: the zero is not known."),
            (Request::Start, Ready) => Running,
            (Request::Start, _) => return refused(self.state, "Home or arm first, and start once."),
            (Request::Stop, Running | Homing) => self.stopping(),
            (Request::Stop, _) => return refused(self.state, "Nothing runs."),
            (Request::Home, _) => return refused(self.state, "Stop first."),
            (Request::Arm, _) => return refused(self.state, "Stop or switch off first."),
            (Request::Acknowledge, _) => return refused(self.state, "There is no fault."),
        };
        if next == Homing {
            self.zero = None;
        }
        if request == Request::Acknowledge && self.zero.is_none() {
            self.monitor = self.monitor.anew();
        }
        (self.state, self.braking) = (next, None);
        Ok(next)
    }

    /// Commands are missing: stop, then switch off the torque.
    pub fn abandoned(&mut self) {
        if self.state == SafetyState::Running {
            self.state = self.stopping();
        }
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

    /// The machine behind a link failed: no sensor is left for braking. An earlier fault stays.
    pub fn machine_failed(&mut self, fault: MachineFault) {
        if !matches!(self.state, SafetyState::Fault(_)) {
            let first = self.state.fault().unwrap_or(Fault::Machine(fault));
            self.fault(Fault::Machine(fault));
            self.state = SafetyState::Fault(first);
        }
    }

    /// The external file in this role failed: the brake stops the screw. An earlier fault stays, unless it is a late
    /// torque of the same role, of which this is the cause.
    pub fn external_failed(&mut self, role: Role, fault: ExternalFault) {
        match &mut self.state {
            SafetyState::Stopping(Some(Fault::External(whose, known)))
            | SafetyState::Fault(Fault::External(whose, known))
                if *whose == role && matches!(known, ExternalFault::Late { .. }) =>
            {
                *known = fault;
            }
            state if state.fault().is_none() => self.fault(Fault::External(role, fault)),
            _ => {}
        }
    }

    /// One cycle of `dt` [s], missed ticks included; the first fault stays until it is acknowledged.
    pub fn step(&mut self, input: SafetyInput, dt: f64) -> SafetyState {
        // Without torque the amplifier may be shorted: the reference of the current is 0, but the back-EMF drives a
        // current.
        if !self.state.allows_torque() {
            self.monitor.forget_current();
        }
        self.monitor.see(&input, &self.limits, dt);
        let trusted = self.monitor.trusted(&input, &self.limits);
        let stands = trusted.is_some_and(|(velocity, _)| velocity.abs() < self.limits.standstill_velocity);
        // In missed ticks nothing was measured: a screw that is slow now may have moved meanwhile.
        self.quiet = if stands { self.quiet + dt / (1.0 + input.missed as f64) } else { 0.0 };
        let watched = self.state.allows_torque() || self.state == SafetyState::Ready;
        if watched && let Err(fault) = self.check(&input, trusted.map_or(0.0, |(velocity, _)| velocity)) {
            self.fault(fault);
        }
        self.braking = None;
        if let SafetyState::Stopping(fault) = self.state {
            self.brake(fault, trusted, dt);
        }
        self.state
    }

    /// Starts a stop by the operator, which ends at once if the screw is at rest: the new state.
    fn stopping(&mut self) -> SafetyState {
        self.stop = Stop::default();
        if self.quiet >= self.limits.standstill_time { self.rest() } else { SafetyState::Stopping(None) }
    }

    /// State after a stop by the operator.
    fn rest(&self) -> SafetyState {
        if self.zero.is_some() { SafetyState::Ready } else { SafetyState::Off }
    }

    /// A fault without its cause.
    #[cfg(test)]
    pub(super) fn provoke(&mut self, fault: Fault) {
        self.fault(fault);
    }

    fn fault(&mut self, fault: Fault) {
        if fault.doubts_zero() {
            self.zero = None;
        }
        // Without torque there is no braking either.
        let brakes = self.state.allows_torque();
        self.stop = Stop::default();
        self.state = if brakes { SafetyState::Stopping(Some(fault)) } else { SafetyState::Fault(fault) };
    }

    /// A cycle of a stop; `trusted` is the reliable velocity [rad/s], and whether it is that of the tacho.
    fn brake(&mut self, fault: Option<Fault>, trusted: Option<(f64, bool)>, dt: f64) {
        let deceleration = self.brake.deceleration(self.limits.stop_deceleration);
        let velocity = trusted.map_or(0.0, |(velocity, _)| velocity);
        if self.stop.time == 0.0 {
            (self.stop.begin, self.stop.ramp) = (velocity.abs(), velocity.abs());
        }
        self.stop.time += dt;
        self.stop.ramp = (self.stop.ramp - deceleration * dt).max(0.0);
        let slow = velocity.abs() >= self.limits.standstill_velocity;
        let failed = trusted.is_none()
            || (slow || self.monitor.is_hot(&self.limits))
                && self.stop.time > LATE * self.stop.begin / deceleration + PATIENCE
            // The brake accelerates the screw.
            || velocity.abs() > self.stop.begin + self.limits.moving_velocity.max(0.1 * self.stop.begin);
        // A push is held until the operator switches off.
        let pushed = !slow && self.brake.release(&mut self.stop.held, dt);
        let stands = self.quiet.min(self.stop.time) >= self.limits.standstill_time && !pushed;
        self.state = match fault {
            Some(fault) if failed || stands => SafetyState::Fault(fault),
            None if failed => SafetyState::Fault(Fault::NotStopped { velocity }),
            None if stands => self.rest(),
            _ => self.state,
        };
        if let (SafetyState::Stopping(_), Some((velocity, tacho))) = (self.state, trusted) {
            let gain = if tacho { self.brake.tacho_gain } else { self.brake.encoder_gain };
            let torque = self.brake.torque(&mut self.stop.held, (velocity, gain), (self.stop.ramp, deceleration), dt);
            let slow = velocity.abs() > self.stop.ramp + self.limits.moving_velocity;
            let shorted = slow || fault.is_some_and(|fault| fault.doubts_load());
            self.braking = Some(Braking { torque, shorted });
        }
    }

    fn check(&mut self, input: &SafetyInput, velocity: f64) -> Result<(), Fault> {
        let limits = &self.limits;
        self.monitor.always(input, limits)?;
        let speed = self.monitor.speed(input);
        if speed > limits.speed {
            return Err(Fault::Overspeed { speed, limit: limits.speed });
        }
        if !self.state.allows_torque() {
            return Ok(());
        }
        if input.missed as f64 > limits.missed_ticks {
            return Err(Fault::TicksMissed { missed: input.missed });
        }
        self.monitor.with_torque(input, limits)?;
        if self.zero.is_some() {
            self.monitor.index(input, limits)?;
        }
        let error = (input.reference_position - input.measured_angle).abs();
        // Not `error > limit`: a non-finite set-point is a fault as well.
        if error.is_nan() || error > limits.following_error {
            return Err(Fault::FollowingError { error, limit: limits.following_error });
        }
        // Braking distance: over it, the work of the brake is ½·J·Ω².
        let way = 0.5 * velocity * velocity.abs() / self.brake.deceleration(limits.stop_deceleration);
        let Some(angle) = self.zero.map(|zero| input.measured_angle - zero) else { return Ok(()) };
        for (limit, outwards) in [(limits.upper_end, 1.0), (limits.lower_end, -1.0)] {
            let beyond = |angle: f64| (angle - limit) * outwards > 0.0;
            if beyond(angle) || beyond(angle + way) {
                let angle = if beyond(angle + way) { angle + way } else { angle };
                return Err(Fault::EndOfStroke { angle, limit });
            }
        }
        Ok(())
    }
}
