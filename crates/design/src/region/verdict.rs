//! Whether a desired friction lies within the region; if not, where, why, and what would do.

use std::fmt;

use stickslip_core::friction::Stribeck;

use super::{Bound, Limit, Region};
use stickslip_base::quantity::{Estimate, number};
use stickslip_fit::{PARAMETERS, values, with_values};

/// A stretch of speeds in which a limit forbids the difference torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shortage {
    /// From and to [rad/s].
    pub speeds: [f64; 2],
    /// The speed at which most is missing [rad/s].
    pub worst: f64,
    /// What is missing there.
    pub bound: Bound,
}

/// The value nearest to the desired one with which everything could be rendered, the other parameters unchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feasible {
    /// Which parameter, as [`PARAMETERS`] counts them.
    pub parameter: usize,
    /// Its value in the desired friction.
    pub desired: f64,
    /// The one that would do, rounded to the safe side.
    pub value: f64,
}

/// What the region says of a desired friction.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// By what the difference torque may be multiplied until a limit is hit: from 1 on it can be rendered.
    pub margin: f64,
    /// The limit that is nearest, and the speed at which it is [rad/s].
    pub nearest: (Bound, f64),
    /// Where it cannot be rendered.
    pub shortages: Vec<Shortage>,
    /// What would do, each alone; `None` where nobody has looked for it.
    pub feasible: Option<Vec<Feasible>>,
    /// Time [s] that the load motor takes to change its torque's sign behind a reversal, delay included.
    pub sign_change_time: f64,
    /// Speed that the drive has reached meanwhile [rad/s]: below, the sign is still the old one.
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
    /// Without what would do, which takes a hundred times as long.
    pub(super) fn without_remedy(region: &Region, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Self {
        let bounds = || walk(region, own, desired, fastest);
        let tightest = |a: &(Bound, f64), b: &(Bound, f64)| a.0.margin().total_cmp(&b.0.margin());
        let nearest = bounds().min_by(tightest).expect("there are speeds");
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

    /// Where and why it cannot be rendered, a sentence a stretch.
    pub fn reasons(&self) -> Vec<String> {
        self.shortages.iter().map(|shortage| self.reason(shortage)).collect()
    }

    fn reason(&self, shortage: &Shortage) -> String {
        let Shortage { speeds: [from, to], worst, bound } = shortage;
        let speed = |value: &f64| Estimate::new(*value, "rad/s").to_string();
        let of = |value: f64| Estimate::new(value, bound.limit.unit()).to_string();
        let (needed, available) = (of(bound.needed), of(bound.available));
        let acceleration = Estimate::new(self.region.passage.acceleration, "rad/s^2");
        let what = match bound.limit {
            Limit::Current if bound.available == 0.0 => format!("{needed} are needed, and no load motor is mounted"),
            Limit::Current => format!("the load motor needs {needed}, its current limit gives {available}"),
            Limit::Voltage => format!("the amplifier needs {needed}; beside the back-EMF it has {available}"),
            Limit::Slope => format!(
                "the current changes so fast at {acceleration} that the amplifier needs {needed}; beside the \
                 back-EMF it has {available}"
            ),
            Limit::Response => format!(
                "delay ({} at {acceleration}) and noise of the estimated velocity ({}) blur the torque by {needed}, \
                 {available} are tolerated",
                Estimate::new(self.region.delay, "s"),
                Estimate::new(self.region.velocity_noise, "rad/s"),
            ),
            Limit::Speed => format!("the screw may turn at {available} at most"),
        };
        format!("From {} to {}: at {} {what}.", speed(from), speed(to), speed(worst))
    }

    /// What would do, in a sentence; `None` where it can be rendered.
    pub fn remedy(&self) -> Option<String> {
        if self.renderable() {
            return None;
        }
        let one = |feasible: &Feasible| {
            let (_, name, unit) = PARAMETERS[feasible.parameter];
            format!("{name} = {} {}", shortest(feasible.value), unit.replace(' ', "·"))
        };
        let single: Option<Vec<String>> = self.feasible.as_ref().map(|all| all.iter().map(one).collect());
        let share = format!("{} % of the difference torque", number((100.0 * self.margin).floor(), 0));
        Some(match single.as_deref() {
            None => format!("Renderable is {share}."),
            Some([]) => format!("Renderable is {share}; no single parameter mends it."),
            Some(single) => format!("Renderable is {share}, or, alone, {}.", single.join(", or ")),
        })
    }
}

/// As a parameter file has it, so that it can be copied.
fn shortest(value: f64) -> String {
    format!("{value}")
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.remedy() {
            None => write!(
                f,
                "the desired friction can be rendered with {} times the difference torque in hand",
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
    Region::speeds(fastest).map(move |speed| {
        let difference = |speed: f64| desired.magnitude(speed) - own.magnitude(speed);
        (region.nearest(&difference, desired.breakaway_torque, speed), speed)
    })
}

/// The stretches in which one limit forbids.
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

/// For each parameter the nearest value that would do: towards the own friction, or, for the Stribeck velocity, towards
/// a gentler drop.
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
