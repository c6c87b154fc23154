//! The renderable region: which difference torques load motor, amplifier, loop and observer can give at which speed.
//!
//! From what is believed of the machine and how the bench runs alone; drawn in the design, asked before a render.
//!
//! ```text
//! current   |M| ≤ K·i_max
//! voltage   ±R·M/K ∓ K·Ω ≤ U                              steady; the back-EMF drives the current up
//! slope     ±R·M/K ∓ K·Ω + (L/K)·|dM/dΩ|·Ω̇ ≤ U            while the drive accelerates by Ω̇ through it
//! response  max |M(Ω ± Ω̇·T) − M(Ω)| + |E[M(|Ω + n|)] − M(Ω)| ≤ ε·M_S
//! speed     Ω ≤ Ω_max of supervision
//! ```
//!
//! T = 3·T_s is the delay of sampling and current loop at the magnitude optimum, n the noise of the estimated velocity.
//! The observer's bandwidth counts by the noise that it lets through: with the accelerometer it has no lag.

mod results;
mod verdict;

use crate::DesignError;
use std::fmt;

use stickslip_core::Fields;
use stickslip_core::drive::Winding;
use stickslip_core::friction::Stribeck;
pub use verdict::{Feasible, Shortage, Verdict};

use super::{predicted_velocity_noise, software};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// Steps between the speeds that are looked at, evenly spaced on a logarithmic scale.
const STEPS: usize = 400;
/// Slowest of them over the fastest.
const SLOWEST: f64 = 1e-4;

/// How fast the drive may pass through a characteristic under the law, and how far off the torque may be meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Passage<T> {
    /// Acceleration through standstill and along the characteristic; the quick friction plan has 200 rad/s².
    #[field(symbol = "Ω̇", unit = "rad/s^2", range = 0.0..=1e6, default = 200.0)]
    pub acceleration: T,
    /// Largest error of the torque by delay and noise, as a share of the desired breakaway torque.
    #[field(symbol = "ε", unit = "1", range = 1e-4..=1.0, default = 0.1)]
    pub tolerance: T,
}

/// What bounds the difference torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// The amplifier's current.
    Current,
    /// The amplifier's voltage against back-EMF and resistance.
    Voltage,
    /// The same voltage, most of it for the change of the current.
    Slope,
    /// Delay of the loop and noise of the observer.
    Response,
    /// The highest speed that supervision admits.
    Speed,
}

impl Limit {
    /// Its name in a summary.
    pub fn name(self) -> &'static str {
        match self {
            Limit::Current => "current",
            Limit::Voltage => "voltage",
            Limit::Slope => "slope",
            Limit::Response => "response",
            Limit::Speed => "speed",
        }
    }

    /// SI unit of what is needed and what there is.
    pub fn unit(self) -> &'static str {
        match self {
            Limit::Current | Limit::Response => "N m",
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

/// What a limit asks for and grants, in its [unit](Limit::unit).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Which limit.
    pub limit: Limit,
    /// For this difference torque.
    pub needed: f64,
    /// At this speed.
    pub available: f64,
}

impl Bound {
    /// By what the difference torque may be multiplied until the limit is hit; infinite where nothing is needed, 0 where
    /// a number is none.
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

/// Steady torques [N m] that the load motor can give at a speed, against positive motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Lowest and highest.
    pub torque: [f64; 2],
    /// What binds them.
    pub limits: [Limit; 2],
}

/// What a bench can render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Torque of the load motor at the current limit [N m].
    pub torque_limit: f64,
    /// Largest voltage at the load motor [V].
    pub voltage_limit: f64,
    /// Highest speed that supervision admits [rad/s].
    pub speed_limit: f64,
    /// Delay from the screw's velocity to the load motor's torque [s].
    pub delay: f64,
    /// Standard deviation of the estimated velocity by the data sheet [rad/s].
    pub velocity_noise: f64,
    /// How fast characteristics are passed through.
    pub passage: Passage<f64>,
    winding: Winding<f64>,
}

/// A characteristic against the region.
type Difference<'a> = &'a dyn Fn(f64) -> f64;

/// Speed up to which own and desired friction are compared [rad/s]: the range of the figures.
pub const FASTEST: f64 = 80.0;

/// Speed up to which a desired friction is judged [rad/s], in a sketch, a design and a parameter set alike.
pub fn fastest(region: &Region) -> f64 {
    FASTEST.min(region.speed_limit)
}

impl Region {
    /// Of the load motor, its amplifier, the observer and the rates of a bench, as they are believed.
    ///
    /// # Errors
    /// What the design of observer and current control refuses.
    pub fn of(model: &Model<f64>, settings: &Settings<f64>, passage: Passage<f64>) -> Result<Self, Error> {
        let current = software(model, settings)?.current;
        Ok(Region {
            torque_limit: current.current_limit * current.torque_constant,
            voltage_limit: current.largest_voltage(),
            speed_limit: settings.safety.speed,
            delay: 3.0 * settings.tick_time(),
            velocity_noise: predicted_velocity_noise(model, settings)?,
            passage,
            winding: model.load_motor,
        })
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

    /// Time [s] that the current takes from one sign to the other at standstill, with the whole voltage; infinite for
    /// a torque [N m] that the voltage does not hold.
    pub fn sign_change_time(&self, torque: f64) -> f64 {
        let Winding { torque_constant, resistance, inductance } = self.winding;
        let drop = if torque == 0.0 { 0.0 } else { resistance * torque.abs() / torque_constant };
        let left = self.voltage_limit - drop;
        if left > 0.0 { inductance / resistance * libm::log((self.voltage_limit + drop) / left) } else { f64::INFINITY }
    }

    /// The speeds that are looked at up to the fastest [rad/s], rising.
    pub fn speeds(fastest: f64) -> impl Iterator<Item = f64> + Clone {
        (0..=STEPS).map(move |k| fastest * libm::pow(SLOWEST, 1.0 - k as f64 / STEPS as f64))
    }

    /// The limit that is nearest for a difference torque at a speed [rad/s]; `breakaway` [N m] is the desired one.
    fn nearest(&self, difference: Difference<'_>, breakaway: f64, speed: f64) -> Bound {
        let torque = difference(speed);
        let [voltage, other_voltage] = [1.0, -1.0].map(|side| self.voltage(difference, torque, speed, side));
        let current = Bound { limit: Limit::Current, needed: torque.abs(), available: self.torque_limit };
        let response = Bound {
            limit: Limit::Response,
            needed: self.blur(difference, torque, speed),
            available: self.passage.tolerance * breakaway,
        };
        let fast = Bound { limit: Limit::Speed, needed: speed, available: self.speed_limit };
        // The speed cannot be scaled: it is admitted or not.
        let admitted = (fast.margin() < 1.0).then_some(fast);
        let bounds = [current, voltage, other_voltage, response];
        bounds.into_iter().chain(admitted).min_by(|a, b| a.margin().total_cmp(&b.margin())).expect("there are limits")
    }

    /// The voltage towards one side, +1 or −1, at a speed [rad/s].
    fn voltage(&self, difference: Difference<'_>, torque: f64, speed: f64, side: f64) -> Bound {
        let Winding { torque_constant, resistance, inductance } = self.winding;
        let step = 1e-4 * speed;
        let slope = (difference(speed + step) - difference(speed - step)) / (2.0 * step);
        // Without a motor the current limit refuses, not a voltage.
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
        // The normal distribution at half standard deviations up to 3.
        let (mut mean, mut weights) = (0.0, 0.0);
        for k in -6..=6 {
            let deviation = 0.5 * f64::from(k);
            let weight = libm::exp(-0.5 * deviation * deviation);
            weights += weight;
            mean += weight * difference((speed + deviation * self.velocity_noise).abs());
        }
        late[0].max(late[1]) + (mean / weights - torque).abs()
    }

    /// Whether the difference from own to desired friction can be rendered up to a speed [rad/s]; if not, where, why,
    /// and what would do.
    pub fn judge(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Verdict {
        Verdict::of(self, own, desired, fastest)
    }

    /// As [`judge`](Self::judge), but for what would do instead: fast enough for a curve that is being dragged.
    pub fn glance(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Verdict {
        Verdict::without_remedy(self, own, desired, fastest)
    }

    /// As [`judge`](Self::judge), for a bench that is about to render.
    ///
    /// # Errors
    /// [`DesignError::NotRenderable`] with where, why and what would do.
    pub fn admit(&self, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Result<Verdict, Error> {
        let verdict = self.judge(own, desired, fastest);
        if verdict.renderable() { Ok(verdict) } else { Err(DesignError::NotRenderable(Box::new(verdict)).into()) }
    }
}

#[cfg(test)]
mod tests;
