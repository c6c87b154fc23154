//! The renderable region: difference torques that load motor, amplifier, loop and observer can render at each speed.
//!
//! Computed from the model of the machine and the settings of the bench; shown in the design, checked before rendering.
//!
//! ```text
//! drive     M_own + M + M_motor + J·Ω̇ ≤ M_max             the drive moves the load against the whole friction
//! current   |M| ≤ K·i_max
//! voltage   ±R·M/K ∓ K·Ω ≤ U                              steady; the back-EMF drives the current up
//! slope     ±R·M/K ∓ K·Ω + (L/K)·|dM/dΩ|·Ω̇ ≤ U            while the drive accelerates by Ω̇ through it
//! response  max |M(Ω ± Ω̇·T) − M(Ω)| + |E[M(|Ω + n|)] − M(Ω)| ≤ ε·M_S
//! speed     Ω ≤ Ω_max of supervision
//! ```
//!
//! T is the delay of the load amplifier and of sampling and current loop, 3·T_s at the magnitude optimum; n is the noise
//! of the estimated velocity. The observer's bandwidth counts by the noise that it lets through: with the accelerometer
//! it has no lag.

mod results;
mod verdict;

use crate::DesignError;
use std::fmt;

use stickslip_core::Fields;
use stickslip_core::drive::Winding;
use stickslip_core::friction::{Friction, Stribeck};
use stickslip_core::render::Law;
pub use verdict::{Feasible, Shortage, Verdict};

use super::{load_current_control, predicted_velocity_noise};
use stickslip_base::Error;
use stickslip_base::preset::{LawChoice, Model, Settings};

/// Steps between the examined speeds, evenly spaced on a logarithmic scale.
const STEPS: usize = 400;
/// Slowest of them over the fastest.
const SLOWEST: f64 = 1e-4;

/// The normal distribution e^(−x²/2) at half standard deviations from 0 to 3.
const NORMAL: [f64; 7] = [
    1.0,
    0.882_496_902_584_595_4,
    0.606_530_659_712_633_4,
    0.324_652_467_358_349_7,
    0.135_335_283_236_612_7,
    0.043_936_933_623_407_42,
    0.011_108_996_538_242_306,
];

/// Remaining share of the way to a limit, of the region or of stability, below which a warning is shown. Chosen: a fifth,
/// as reserve for the error of the bench's model.
pub const CAUTION: f64 = 0.2;

/// Acceleration of the drive along a characteristic under the law, and tolerance of the torque meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Passage<T> {
    /// Acceleration through standstill and along the characteristic; the quick friction plan has 200 rad/s².
    #[field(symbol = "Ω̇", unit = "rad/s^2", range = 0.0..=1e6, default = 200.0)]
    pub acceleration: T,
    /// Largest error of the torque by delay and noise, as a share of the desired breakaway torque.
    #[field(symbol = "ε", unit = "1", range = 1e-4..=1.0, default = 0.1)]
    pub tolerance: T,
}

/// Limits of the difference torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Torque of the drive, which must overcome the desired friction.
    Drive,
    /// The amplifier's current.
    Current,
    /// The amplifier's voltage against back-EMF and resistance.
    Voltage,
    /// The same voltage, mainly for the change of the current.
    Slope,
    /// Delay of the loop and noise of the observer.
    Response,
    /// The speed limit of supervision.
    Speed,
}

impl Limit {
    /// Its name in a summary.
    pub fn name(self) -> &'static str {
        match self {
            Limit::Drive => "drive",
            Limit::Current => "current",
            Limit::Voltage => "voltage",
            Limit::Slope => "slope",
            Limit::Response => "response",
            Limit::Speed => "speed",
        }
    }

    /// SI unit of the required and the available value.
    pub fn unit(self) -> &'static str {
        match self {
            Limit::Drive | Limit::Current | Limit::Response => "N m",
            Limit::Voltage | Limit::Slope => "V",
            Limit::Speed => "rad/s",
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Required and available value of a limit, in its [unit](Limit::unit).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The limit.
    pub limit: Limit,
    /// Required for this difference torque.
    pub needed: f64,
    /// Available at this speed.
    pub available: f64,
}

impl Bound {
    /// Factor of the difference torque at which the limit is reached; infinite if nothing is required, 0 for a value
    /// that is not finite.
    pub fn margin(&self) -> f64 {
        if self.needed <= 0.0 && self.available >= 0.0 {
            f64::INFINITY
        } else if self.needed > 0.0 && self.available > 0.0 {
            self.available / self.needed
        } else {
            0.0
        }
    }
}

/// Steady torques [N m] of the load motor at a speed, against positive motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Lowest and highest torque.
    pub torque: [f64; 2],
    /// Their limits.
    pub limits: [Limit; 2],
}

/// Renderable region of a bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Largest torque of the drive, by controller and servo amplifier [N m].
    pub drive_limit: f64,
    /// Torque of the load motor at the current limit [N m].
    pub torque_limit: f64,
    /// Largest voltage at the load motor [V].
    pub voltage_limit: f64,
    /// Speed limit of supervision [rad/s].
    pub speed_limit: f64,
    /// Delay from the screw's velocity to the load motor's torque, without the part that the law predicts [s].
    pub delay: f64,
    /// Standard deviation of the estimated velocity by the data sheet [rad/s].
    pub velocity_noise: f64,
    /// Passage along characteristics.
    pub passage: Passage<f64>,
    winding: Winding<f64>,
    /// Friction of the drive motor.
    motor_friction: Friction<f64>,
    /// Torque that accelerates the drive along a characteristic [N m].
    accelerating: f64,
}

/// A characteristic compared with the region.
type Difference<'a> = &'a dyn Fn(f64) -> f64;

/// Speed up to which own and desired friction are compared [rad/s]: the range of the figures.
pub const FASTEST: f64 = 80.0;

/// Highest speed at which a desired friction is checked [rad/s], in a sketch, a design and a parameter set.
pub fn fastest(region: &Region) -> f64 {
    FASTEST.min(region.speed_limit)
}

/// Delay of the load amplifier [s]; a law with bristles predicts the motion up to its end.
fn unpredicted_delay(model: &Model<f64>, settings: &Settings<f64>) -> f64 {
    let predicts = matches!(settings.law, LawChoice::Bristle | LawChoice::Residual(_) | LawChoice::Admittance(_));
    if predicts { 0.0 } else { model.load_amplifier.delay }
}

/// Delay of sampling and current control of the load motor [s]; a drive that takes a torque has its own current control.
fn current_delay(model: &Model<f64>, settings: &Settings<f64>) -> f64 {
    let tick = settings.tick_time();
    if settings.torque_amplifier > 0.5 { 1.5 * tick + model.load_amplifier.lag } else { 3.0 * tick }
}

impl Region {
    /// The region for the model of load motor and amplifier, the observer and the rates of a bench.
    ///
    /// # Errors
    /// Errors of the design of observer and current control.
    pub fn of(model: &Model<f64>, settings: &Settings<f64>, passage: Passage<f64>) -> Result<Self, Error> {
        let current = load_current_control(&Law::Off, model, settings)?;
        let amplifier = model.scaling.torque_per_volt * model.scaling.servo_limit;
        Ok(Region {
            drive_limit: settings.controller.torque_limit().min(amplifier),
            torque_limit: current.current_limit * current.torque_constant,
            voltage_limit: current.largest_voltage(),
            speed_limit: settings.safety.speed,
            delay: unpredicted_delay(model, settings) + current_delay(model, settings),
            velocity_noise: predicted_velocity_noise(model, settings)?,
            passage,
            winding: model.load_motor,
            motor_friction: model.motor_friction,
            accelerating: model.drive.inertia() * passage.acceleration,
        })
    }

    /// Largest friction of the load that the drive overcomes at a speed Ω ≥ 0 [rad/s] while it accelerates [N m].
    pub fn drive_capacity(&self, speed: f64) -> f64 {
        // At rest the motor's friction acts as just above it.
        let motor = self.motor_friction.steady_torque(speed.max(f64::MIN_POSITIVE), 0.0, 0.0);
        self.drive_limit - motor - self.accelerating
    }

    /// The steady torques at a speed Ω ≥ 0 [rad/s]; at −Ω the same with the other sign.
    pub fn at(&self, speed: f64) -> Band {
        let Winding { torque_constant, resistance, .. } = self.winding;
        let by = |voltage: f64| torque_constant * (voltage + torque_constant * speed) / resistance;
        let (low, high) = (by(-self.voltage_limit), by(self.voltage_limit));
        let limit = |within: bool| if within { Limit::Voltage } else { Limit::Current };
        Band {
            torque: [low.max(-self.torque_limit), high.min(self.torque_limit)],
            limits: [limit(low > -self.torque_limit), limit(high < self.torque_limit)],
        }
    }

    /// Time [s] of a change of the current's sign at standstill, with the full voltage; infinite for a torque [N m]
    /// that the voltage cannot hold.
    pub fn sign_change_time(&self, torque: f64) -> f64 {
        let Winding { torque_constant, resistance, inductance } = self.winding;
        let drop = if torque == 0.0 { 0.0 } else { resistance * torque.abs() / torque_constant };
        let margin = self.voltage_limit - drop;
        if margin > 0.0 {
            inductance / resistance * libm::log((self.voltage_limit + drop) / margin)
        } else {
            f64::INFINITY
        }
    }

    /// The examined speeds up to the fastest [rad/s], rising.
    pub fn speeds(fastest: f64) -> impl Iterator<Item = f64> + Clone {
        (0..=STEPS).map(move |k| fastest * libm::pow(SLOWEST, 1.0 - k as f64 / STEPS as f64))
    }

    /// The nearest limit for the difference from own to desired friction at a speed [rad/s].
    fn nearest(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, speed: f64) -> Bound {
        let difference: Difference<'_> = &|speed| desired.magnitude(speed) - own.magnitude(speed);
        let breakaway = desired.breakaway_torque;
        let torque = difference(speed);
        // A driving load motor relieves the drive; then only the own friction must be within its torque.
        let left = self.drive_capacity(speed) - own.magnitude(speed);
        let drive = Bound { limit: Limit::Drive, needed: torque.max(0.0), available: left };
        let [voltage, other_voltage] = [1.0, -1.0].map(|side| self.voltage(difference, torque, speed, side));
        let current = Bound { limit: Limit::Current, needed: torque.abs(), available: self.torque_limit };
        let response = Bound {
            limit: Limit::Response,
            needed: self.blur(difference, torque, speed),
            available: self.passage.tolerance * breakaway,
        };
        let fast = Bound { limit: Limit::Speed, needed: speed, available: self.speed_limit };
        // The speed cannot be scaled: it is permitted or not.
        let admitted = (fast.margin() < 1.0).then_some(fast);
        let bounds = [drive, current, voltage, other_voltage, response];
        bounds.into_iter().chain(admitted).min_by(|a, b| a.margin().total_cmp(&b.margin())).expect("limits are listed")
    }

    /// The voltage towards one side, +1 or −1, at a speed [rad/s].
    fn voltage(&self, difference: Difference<'_>, torque: f64, speed: f64, side: f64) -> Bound {
        let Winding { torque_constant, resistance, inductance } = self.winding;
        let step = 1e-4 * speed;
        let slope = (difference(speed + step) - difference(speed - step)) / (2.0 * step);
        // Without a motor the current limit applies, not a voltage.
        let per_torque = if torque_constant > 0.0 { 1.0 / torque_constant } else { 0.0 };
        let change = inductance * per_torque * slope.abs() * self.passage.acceleration;
        let steady = side * resistance * torque * per_torque;
        let limit = if change > steady { Limit::Slope } else { Limit::Voltage };
        let available = self.voltage_limit + side * torque_constant * speed;
        Bound { limit, needed: steady + change, available }
    }

    /// Error of the torque [N m] by delay and by the noise of the estimated velocity.
    fn blur(&self, difference: Difference<'_>, torque: f64, speed: f64) -> f64 {
        let way = self.passage.acceleration * self.delay;
        let late = [way, -way].map(|way| (difference((speed + way).abs()) - torque).abs());
        let (mut mean, mut weights) = (NORMAL[0] * torque, NORMAL[0]);
        for (k, weight) in NORMAL.into_iter().enumerate().skip(1) {
            let deviation = 0.5 * k as f64 * self.velocity_noise;
            weights += 2.0 * weight;
            mean += weight * (difference(speed + deviation) + difference((speed - deviation).abs()));
        }
        late[0].max(late[1]) + (mean / weights - torque).abs()
    }

    /// Whether the difference from own to desired friction can be rendered up to a speed [rad/s]; if not, the speeds,
    /// the limits and the remedies.
    pub fn judge(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Verdict {
        Verdict::of(self, own, desired, fastest)
    }

    /// As [`judge`](Self::judge), without the remedies: fast enough for a dragged curve.
    pub fn glance(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Verdict {
        Verdict::without_remedy(self, own, desired, fastest)
    }

    /// As [`judge`](Self::judge), before rendering on a bench.
    ///
    /// # Errors
    /// [`DesignError::NotRenderable`] with speeds, limits and remedies.
    pub fn admit(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Result<Verdict, Error> {
        let verdict = self.judge(own, desired, fastest);
        if verdict.renderable() { Ok(verdict) } else { Err(DesignError::NotRenderable(Box::new(verdict)).into()) }
    }
}

#[cfg(test)]
mod tests;
