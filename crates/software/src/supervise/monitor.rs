//! Plausibility checks of the measurements against each other and against the commands.

use core::f64::consts::TAU;

use super::{Fault, SafetyInput, SafetyLimits};

/// Lag of the low-pass of the encoder's velocity [s]: one count in a tick is coarse.
const VELOCITY_LAG: f64 = 2e-3;
/// Lag of the low-passes in the comparison of accelerometer and tacho [s]: at higher frequencies the coupling twists
/// between them.
const ACCELERATION_LAG: f64 = 0.02;
/// Time constant with which a drift of the accelerometer's offset is tracked [s].
const OFFSET_TIME: f64 = 1.0;
/// Lag of the low-pass in the comparison of commanded and measured current [s].
const CURRENT_LAG: f64 = 5e-3;

/// State of the checks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Monitor {
    /// Encoder angle of the last cycle [rad]; time for which it has been constant although the screw should move [s].
    pub(super) previous: Option<f64>,
    pub(super) standing: f64,
    /// Velocities, both with the same low-pass [rad/s].
    pub(super) encoder: f64,
    pub(super) tacho: f64,
    /// Velocity of the last cycle's counts, not low-passed [rad/s].
    pub(super) counted: f64,
    /// Speed equivalent to a jump of the encoder [rad/s]; after a jump the encoder is not reliable.
    pub(super) jumped: Option<f64>,
    /// Time for which tacho and encoder have been apart [s].
    pub(super) sensors_apart: f64,
    /// Encoder angle of the last index pulse [rad]; deviation of its distance to the previous one from whole
    /// revolutions [rad].
    pub(super) index: Option<f64>,
    pub(super) index_deviation: f64,
    pub(super) acceleration: Acceleration,
    /// Commanded minus measured current of the load motor, low-passed [A]; time for which it has been too large [s].
    pub(super) current: f64,
    pub(super) current_apart: f64,
    /// Squares of the currents, low-passed with the thermal time: drive, load [A²].
    pub(super) heat: [f64; 2],
}

/// Accelerometer against tacho.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Acceleration {
    pub(super) started: bool,
    /// Low-passed velocity of the tacho [rad/s], acceleration of the accelerometer and its offset [rad/s²].
    pub(super) velocity: f64,
    pub(super) measured: f64,
    pub(super) offset: f64,
    /// Remaining difference [rad/s²], and time for which it has been too large [s].
    pub(super) difference: f64,
    pub(super) apart: f64,
}

impl Acceleration {
    fn see(&mut self, velocity: f64, measured: f64, limits: &SafetyLimits<f64>, dt: f64) {
        if !self.started {
            *self = Acceleration { started: true, velocity, measured, offset: measured, ..Acceleration::default() };
        }
        // A low-pass's input less its output, over its lag, is the low-passed derivative.
        let share = self::share(dt, ACCELERATION_LAG);
        self.velocity += share * (velocity - self.velocity);
        self.measured += share * (measured - self.measured);
        let by_tacho = (velocity - self.velocity) / ACCELERATION_LAG;
        let residual = self.measured - by_tacho;
        self.difference = (residual - self.offset).abs();
        self.offset += self::share(dt, OFFSET_TIME) * (residual - self.offset);
        self.apart = if self.difference > limits.acceleration_difference { self.apart + dt } else { 0.0 };
    }
}

/// Share of a deviation that a low-pass with this lag [s] makes up in a time [s].
fn share(dt: f64, lag: f64) -> f64 {
    dt / (lag + dt)
}

impl Monitor {
    /// A cycle of `dt` [s], ticks that were missed before it included.
    pub(super) fn see(&mut self, input: &SafetyInput, limits: &SafetyLimits<f64>, dt: f64) {
        let (angle, tacho) = (input.measured_angle, input.measured_velocity);
        // For a moment this is permitted: the motor may twist the coupling while the screw sticks.
        let moves = input.drive_current.abs() > limits.moving_current || tacho.abs() > limits.moving_velocity;
        self.standing = if moves && self.previous == Some(angle) { self.standing + dt } else { 0.0 };
        let share = self::share(dt, VELOCITY_LAG);
        if tacho.is_finite() {
            self.tacho += share * (tacho - self.tacho);
        }
        if angle.is_finite() {
            self.counted = (angle - self.previous.unwrap_or(angle)) / dt;
            // No mass reaches this speed within a tick.
            if self.counted.abs() > limits.speed && 2.0 * tacho.abs() < self.counted.abs() {
                self.jumped.get_or_insert(self.counted.abs());
            }
            if self.jumped.is_none() {
                self.encoder += share * (self.counted - self.encoder);
            }
            self.previous = Some(angle);
        }
        // An estimated velocity has the encoder as its source.
        let has_tacho = input.acceleration.is_some();
        let apart = has_tacho && (self.tacho - self.encoder).abs() > self.velocity_tolerance(limits);
        self.sensors_apart = if apart { self.sensors_apart + dt } else { 0.0 };
        // A pulse may have come in a tick that was missed.
        let last = self.index.filter(|_| input.missed == 0);
        let between = input.index.zip(last).map_or(0.0, |(now, last)| now - last);
        self.index_deviation = (between - TAU * libm::round(between / TAU)).abs();
        self.index = input.index.or(last);
        if let Some(acceleration) = input.acceleration.filter(|it| it.is_finite() && tacho.is_finite()) {
            self.acceleration.see(tacho, acceleration, limits, dt);
        }
        let difference = input.asked_load_current - input.load_current;
        if difference.is_finite() {
            self.current += self::share(dt, CURRENT_LAG) * (difference - self.current);
        }
        let apart = self.current.abs() > limits.current_difference;
        self.current_apart = if apart { self.current_apart + dt } else { 0.0 };
        let share = self::share(dt, limits.thermal_time);
        for (heat, current) in self.heat.iter_mut().zip([input.drive_current, input.load_current]) {
            *heat += if current.is_finite() { share * (current * current - *heat) } else { 0.0 };
        }
    }

    /// State after a fault that may have spoilt it: only the temperatures of the motors are kept.
    pub(super) fn anew(&self) -> Self {
        Monitor { heat: self.heat, ..Monitor::default() }
    }

    /// Allowed difference of tacho and encoder at the present speed [rad/s].
    fn velocity_tolerance(&self, limits: &SafetyLimits<f64>) -> f64 {
        limits.moving_velocity.max(limits.velocity_share * self.tacho.abs().max(self.encoder.abs()))
    }

    /// Restarts the comparison of the currents after a time in which the amplifier did not control the current.
    pub(super) fn forget_current(&mut self) {
        (self.current, self.current_apart) = (0.0, 0.0);
    }

    /// Reliable velocity for the brake [rad/s], and whether it is that of the tacho. A dead sensor reads too little: if
    /// the two are apart, the faster one counts, unless they show opposite directions.
    pub(super) fn trusted(&self, input: &SafetyInput, limits: &SafetyLimits<f64>) -> Option<(f64, bool)> {
        let tacho = Some(input.measured_velocity).filter(|velocity| velocity.is_finite());
        let encoder = Some(self.encoder).filter(|_| input.measured_angle.is_finite() && self.jumped.is_none());
        let tolerance = self.velocity_tolerance(limits);
        match (tacho, encoder) {
            (Some(tacho), Some(encoder)) if tacho * encoder < 0.0 && tacho.abs().min(encoder.abs()) > tolerance => None,
            (Some(tacho), Some(encoder)) if encoder.abs() > tacho.abs() + tolerance => Some((encoder, false)),
            (Some(tacho), _) => Some((tacho, true)),
            (None, encoder) => encoder.map(|encoder| (encoder, false)),
        }
    }

    /// Whether the drive has had too much current for too long.
    pub(super) fn is_hot(&self, limits: &SafetyLimits<f64>) -> bool {
        self.heat[0] > limits.drive_continuous_current * limits.drive_continuous_current
    }

    /// The larger of the speeds of tacho and encoder [rad/s].
    pub(super) fn speed(&self, input: &SafetyInput) -> f64 {
        input.measured_velocity.abs().max(self.counted.abs())
    }

    /// Checks with and without torque: non-finite measurements and outputs.
    pub(super) fn always(&self, input: &SafetyInput, limits: &SafetyLimits<f64>) -> Result<(), Fault> {
        for (value, measurement) in [
            (input.measured_angle, "screw angle"),
            (input.measured_velocity, "tacho velocity"),
            (input.acceleration.unwrap_or(0.0), "acceleration"),
            (input.load_current, "load current"),
        ] {
            if !value.is_finite() {
                return Err(Fault::NotANumber { measurement });
            }
        }
        if let Some(block) = input.broken {
            return Err(Fault::Computed { block });
        }
        match self.jumped {
            Some(speed) => Err(Fault::EncoderJumped { speed, limit: limits.speed }),
            None => Ok(()),
        }
    }

    /// Checks while there is torque.
    pub(super) fn with_torque(&self, input: &SafetyInput, limits: &SafetyLimits<f64>) -> Result<(), Fault> {
        let (current, velocity, time) = (input.drive_current, input.measured_velocity, self.standing);
        if time >= limits.frozen_time {
            return Err(Fault::EncoderFrozen { current, velocity, time });
        }
        if self.sensors_apart >= limits.frozen_time {
            return Err(Fault::SensorsApart { tacho: self.tacho, encoder: self.encoder });
        }
        if self.acceleration.apart >= limits.acceleration_time {
            let (difference, limit) = (self.acceleration.difference, limits.acceleration_difference);
            return Err(Fault::Accelerometer { difference, limit });
        }
        if self.current_apart >= limits.current_time {
            return Err(Fault::LoadCurrent { difference: self.current, limit: limits.current_difference });
        }
        let motors = [
            ("drive", input.drive_current, limits.drive_current, limits.drive_continuous_current),
            ("load", input.load_current, limits.load_current, limits.load_continuous_current),
        ];
        for ((motor, current, limit, continuous), heat) in motors.into_iter().zip(self.heat) {
            if current.abs() > limit {
                return Err(Fault::Overcurrent { motor, current, limit });
            }
            if heat > continuous * continuous {
                return Err(Fault::Overheated { motor, current: libm::sqrt(heat), limit: continuous });
            }
        }
        Ok(())
    }

    /// Checks of the index pulses while the zero is known: whole revolutions apart, and one in each revolution.
    pub(super) fn index(&self, input: &SafetyInput, limits: &SafetyLimits<f64>) -> Result<(), Fault> {
        let deviation = self.index_deviation;
        if deviation > limits.index_deviation {
            return Err(Fault::CountsLost { deviation, limit: limits.index_deviation });
        }
        let travel = self.index.map_or(0.0, |last| (input.measured_angle - last).abs());
        // The distance between the two edges of a pulse and the motion in a tick are small against 1 rad.
        if travel > TAU + 1.0 { Err(Fault::IndexMissing { travel }) } else { Ok(()) }
    }
}
