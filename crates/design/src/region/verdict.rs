//! Whether a desired friction is within the region; if not, the speeds, the limits and the remedies.

use std::fmt;

use stickslip_core::friction::Stribeck;

use super::{Bound, Limit, Region};
use stickslip_base::quantity::{Estimate, number};
use stickslip_fit::{PARAMETERS, values, with_values};

/// A speed range in which a limit is exceeded by the difference torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shortage {
    /// Ends of the range [rad/s].
    pub speeds: [f64; 2],
    /// Speed of the largest shortage [rad/s].
    pub worst: f64,
    /// Required and available value there.
    pub bound: Bound,
}

/// The value nearest to the desired one that can be rendered, with the other parameters unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feasible {
    /// Index of the parameter in [`PARAMETERS`].
    pub parameter: usize,
    /// Its value in the desired friction.
    pub desired: f64,
    /// The feasible value, rounded to the safe side.
    pub value: f64,
}

/// Result of a check of a desired friction.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Factor of the difference torque at which a limit is reached; at least 1 if it can be rendered.
    pub margin: f64,
    /// The nearest limit, and its speed [rad/s].
    pub nearest: (Bound, f64),
    /// Speed ranges in which it cannot be rendered.
    pub shortages: Vec<Shortage>,
    /// Feasible values of single parameters; `None` if they were not computed.
    pub feasible: Option<Vec<Feasible>>,
    /// Time [s] for the change of the load motor torque's sign after a reversal, delay included.
    pub sign_change_time: f64,
    /// Speed reached by the drive meanwhile [rad/s]: below, the sign is still the old one.
    pub sign_change_speed: f64,
    region: Region,
}

/// The curve with another value of one of them.
fn with(curve: &Stribeck<f64>, parameter: usize, value: f64) -> Stribeck<f64> {
    let mut numbers = values(curve);
    numbers[parameter] = value;
    with_values(curve, numbers)
}

impl Verdict {
    /// Without remedies, which take a hundred times longer.
    pub(super) fn without_remedy(region: &Region, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Self {
        let bounds = || walk(region, own, desired, fastest);
        let tightest = |a: &(Bound, f64), b: &(Bound, f64)| a.0.margin().total_cmp(&b.0.margin());
        let nearest = bounds().min_by(tightest).expect("the list of speeds is not empty");
        let margin = nearest.0.margin();
        let delay = region.delay + region.sign_change_time(desired.breakaway_torque - own.breakaway_torque);
        Verdict {
            margin,
            nearest,
            shortages: shortages(bounds()),
            feasible: None,
            sign_change_time: delay,
            sign_change_speed: delay * region.passage.acceleration,
            region: *region,
        }
    }

    pub(super) fn of(region: &Region, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Self {
        let verdict = Self::without_remedy(region, own, desired, fastest);
        let feasible = if verdict.renderable() { Vec::new() } else { feasible(region, own, desired, fastest) };
        Verdict { feasible: Some(feasible), ..verdict }
    }

    /// Whether the whole difference can be rendered.
    pub fn renderable(&self) -> bool {
        self.margin >= 1.0
    }

    /// Reasons for which it cannot be rendered, one sentence for each speed range.
    pub fn reasons(&self) -> Vec<String> {
        self.shortages.iter().map(|shortage| self.reason(shortage)).collect()
    }

    fn reason(&self, shortage: &Shortage) -> String {
        let Shortage { speeds: [from, to], worst, bound } = shortage;
        let speed = |value: &f64| Estimate::new(*value, "rad/s").to_string();
        let of = |value: f64| Estimate::new(value, bound.limit.unit()).to_string();
        let (needed, available) = (of(bound.needed), of(bound.available));
        let acceleration = Estimate::new(self.region.passage.acceleration, "rad/s^2");
        let reason = match bound.limit {
            Limit::Drive => format!(
                "the load motor adds {needed}; own friction, motor friction and acceleration at {acceleration} leave \
                 {available} of the {} of the drive motor",
                of(self.region.drive_limit)
            ),
            Limit::Current if bound.available == 0.0 => format!("{needed} required, but no load motor is mounted"),
            Limit::Current => format!("the load motor requires {needed}; its current limit permits {available}"),
            Limit::Voltage => format!("the amplifier requires {needed}; the back-EMF leaves {available}"),
            Limit::Slope => format!(
                "the current changes so fast at {acceleration} that the amplifier requires {needed}; the back-EMF leaves \
                 {available}"
            ),
            Limit::Response => format!(
                "delay ({} at {acceleration}) and noise of the estimated velocity ({}) blur the torque by {needed}, \
                 tolerance {available}",
                Estimate::new(self.region.delay, "s"),
                Estimate::new(self.region.velocity_noise, "rad/s"),
            ),
            Limit::Speed => format!("the speed limit of the screw is {available}"),
        };
        format!("From {} to {}: at {} {reason}.", speed(from), speed(to), speed(worst))
    }

    /// The remedy, in a sentence; `None` if it can be rendered.
    pub fn remedy(&self) -> Option<String> {
        if self.renderable() {
            return None;
        }
        let one = |feasible: &Feasible| {
            let (_, name, unit) = PARAMETERS[feasible.parameter];
            format!("{name} = {} {}", shortest(feasible.value), unit.replace(' ', "·"))
        };
        let single: Option<Vec<String>> = self.feasible.as_ref().map(|all| all.iter().map(one).collect());
        let share = format!("Reduce the difference torque to {} %", number((100.0 * self.margin).floor(), 0));
        Some(match single.as_deref() {
            None => format!("{share}."),
            Some([]) => format!("{share}; no single parameter is sufficient."),
            Some(single) => format!("{share}, or change only one parameter: {}.", single.join(", or ")),
        })
    }
}

/// In the notation of a parameter file, so that it can be copied.
fn shortest(value: f64) -> String {
    format!("{value}")
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.remedy() {
            None => write!(
                f,
                "the desired friction can be rendered, up to {} times the difference torque",
                number(self.margin, 2)
            ),
            Some(remedy) => {
                write!(f, "the desired friction cannot be rendered. {} {remedy}", self.reasons().join(" "))
            }
        }
    }
}

/// The nearest limit at every speed.
pub(super) fn walk(
    region: &Region,
    own: &Stribeck<f64>,
    desired: &Stribeck<f64>,
    fastest: f64,
) -> impl Iterator<Item = (Bound, f64)> {
    Region::speeds(fastest).map(move |speed| (region.nearest(own, desired, speed), speed))
}

/// The speed ranges in which one limit is exceeded.
fn shortages(bounds: impl Iterator<Item = (Bound, f64)>) -> Vec<Shortage> {
    let mut shortages: Vec<Shortage> = Vec::new();
    let mut before = None;
    for (bound, speed) in bounds {
        let short = (bound.margin() < 1.0).then_some(bound.limit);
        match shortages.last_mut().filter(|_| before == short) {
            _ if short.is_none() => {}
            Some(last) => {
                last.speeds[1] = speed;
                if bound.margin() < last.bound.margin() {
                    (last.worst, last.bound) = (speed, bound);
                }
            }
            None => shortages.push(Shortage { speeds: [speed; 2], worst: speed, bound }),
        }
        before = short;
    }
    shortages
}

/// For each parameter the nearest feasible value: towards the own friction, or, for the Stribeck velocity, towards a
/// gentler drop.
fn feasible(region: &Region, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Vec<Feasible> {
    let does = |parameter: usize, value: f64| {
        walk(region, own, &with(desired, parameter, value), fastest).all(|(bound, _)| bound.margin() >= 1.0)
    };
    let nearest = |parameter: usize| {
        let start = values(desired)[parameter];
        let gentle = (parameter == 2).then_some(1e3);
        let mut targets = gentle.into_iter().chain([values(own)[parameter]]);
        let target = targets.find(|target| does(parameter, *target))?;
        let (mut refused, mut admitted) = (start, target);
        for _ in 0..24 {
            let middle = 0.5 * (refused + admitted);
            if does(parameter, middle) { admitted = middle } else { refused = middle }
        }
        let value = Some(rounded(admitted, target > start)).filter(|value| does(parameter, *value)).unwrap_or(admitted);
        Some(Feasible { parameter, desired: start, value })
    };
    (0..PARAMETERS.len()).filter_map(nearest).collect()
}

/// Three digits, up or down.
fn rounded(value: f64, up: bool) -> f64 {
    if value == 0.0 {
        return value;
    }
    let place = libm::floor(libm::log10(value.abs())) as i32 - 2;
    // Divided, not multiplied by a negative power: 0.457 and not 0.45700000000000002.
    let scale = |value: f64, place: i32| if place < 0 { value * 10f64.powi(-place) } else { value / 10f64.powi(place) };
    let digits = scale(value, place);
    scale(if up { digits.ceil() } else { digits.floor() }, -place)
}
