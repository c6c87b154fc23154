//! The desired friction while it is being drawn: what a hand on the curve means, and what the bench says to it.
//!
//! A [`Sketch`] is what the hand holds: numbers, reference points, a handle that is dragged. [`Sketch::draw`] gives all
//! that is to be seen: the curve, where its handles are, what can be rendered and why not more. It takes less time than
//! a picture lasts, so that the curve follows the hand; what would do instead comes when the hand rests
//! ([`Sketch::thorough`]).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::block::Block as _;
use stickslip_core::fields::{Field, Fields};
use stickslip_core::friction::{Bristles, Contact, Friction, FrictionElement, FrictionElementState, Stribeck};

use super::design::{Design, fastest, through_weighted};
use stickslip_base::preset::{LawChoice, Settings};
use stickslip_base::{Error, Preset};
use stickslip_design::{Passage, Region};
use stickslip_fit::{PARAMETERS, values, with_values};

/// The handle of M_K lies at so many Stribeck velocities: the drop is over there.
const SETTLED: f64 = 8.0;
/// The lever of b lies at this share of the fastest speed.
const LEVER: f64 = 0.9;
/// A presliding loop goes so many times as far as bristles bend before they slide, in so many steps.
const LOOP: f64 = 3.0;
const STEPS: usize = 60;
/// The time of a step [s]: so slow that damping does not count.
const SLOWLY: f64 = 10.0;
/// Speeds that are drawn, at most.
const LARGEST_GRID: usize = 4000;
/// Reference points, at most.
const MOST_POINTS: usize = 1000;
/// What the nearest curve has in hand: whoever looks at other speeds finds it renderable as well.
const AIR: f64 = 1.02;
/// Steps of the search for the nearest curve that can be rendered.
const BISECTIONS: usize = 16;

/// A desired friction that is being drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sketch {
    /// Breakaway torque [N m], kinetic torque [N m], Stribeck velocity [rad/s], viscous friction [N m s/rad]; those in
    /// force where there are none.
    #[serde(default)]
    pub desired: Option<[f64; 4]>,
    /// Bristles: stiffness [N m/rad], damping [N m s/rad], elastic limit as a share; those in force where there are none.
    #[serde(default)]
    pub bristles: Option<[f64; 3]>,
    /// Reference points.
    #[serde(default)]
    pub points: Vec<Reference>,
    /// Whether the curve shall be laid through the points.
    #[serde(default)]
    pub fit: bool,
    /// What the hand drags.
    #[serde(default)]
    pub drag: Option<Drag>,
    /// Whether the curve shall be moved to the nearest that can be rendered.
    #[serde(default)]
    pub nearest: bool,
    /// Whether to say what would do instead, where it cannot be rendered: a hundred times the time.
    #[serde(default)]
    pub thorough: bool,
    /// Speeds at which the curve is to be seen, from 0 on [rad/s].
    pub speeds: Vec<f64>,
}

/// A reference point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// From 0 on [rad/s].
    pub speed: f64,
    /// Above 0 [N m].
    pub torque: f64,
    /// How much it counts beside others.
    #[serde(default = "one")]
    pub weight: f64,
}

fn one() -> f64 {
    1.0
}

/// A hand on a handle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Drag {
    /// Which.
    pub handle: Handle,
    /// Where the hand is [rad/s].
    pub speed: f64,
    /// Where the hand is [N m].
    pub torque: f64,
    /// Whether the other parameters follow the reference points.
    #[serde(default)]
    pub refit: bool,
}

/// What a curve is held by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Handle {
    /// M_S, at rest: up and down.
    BreakawayTorque,
    /// M_K, where the drop is over: up and down.
    KineticTorque,
    /// Ω_Strib, on the curve: left and right.
    StribeckVelocity,
    /// b, near the right end: up and down.
    ViscousFriction,
    /// The curve itself: up and down, M_S and M_K together.
    Line,
}

/// The handles of single parameters, in the order of [`PARAMETERS`].
const HANDLES: [Handle; 4] =
    [Handle::BreakawayTorque, Handle::KineticTorque, Handle::StribeckVelocity, Handle::ViscousFriction];

/// What is to be seen of a sketch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Drawn {
    /// As [`Sketch::desired`].
    pub desired: [f64; 4],
    /// Desired friction at each speed [N m].
    pub curve: Vec<f64>,
    /// Own friction at each speed [N m].
    pub own: Vec<f64>,
    /// The least friction that could be rendered steadily at each speed [N m].
    pub least: Vec<f64>,
    /// The largest [N m].
    pub largest: Vec<f64>,
    /// The presliding loop of the desired friction.
    pub desired_loop: Loop,
    /// The presliding loop of the own friction, over the same way.
    pub own_loop: Loop,
    /// Handles of the single parameters.
    pub grips: Vec<Grip>,
    /// Whether it can be rendered.
    pub renderable: bool,
    /// By what the difference torque may be multiplied until a limit is hit; `null`: by anything.
    pub margin: Option<f64>,
    /// What bounds the least and the largest friction.
    pub edges: Vec<Edge>,
    /// Where it cannot be rendered.
    pub shortages: Vec<SpeedRange>,
    /// What a reader should know, in sentences.
    pub remarks: Vec<String>,
    /// RMS distance from the reference points [N m]; `null` without any.
    pub distance: Option<f64>,
}

/// What slow motion back and forth feels, from rest on: the bristles alone, without their damping.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Loop {
    /// Way from the begin [rad].
    pub angle: Vec<f64>,
    /// Friction torque there [N m].
    pub torque: Vec<f64>,
}

/// A handle on the curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Grip {
    /// Which.
    pub handle: Handle,
    /// As in an equation.
    pub symbol: String,
    /// Its value.
    pub value: f64,
    /// In this SI unit.
    pub unit: String,
    /// Least and largest value.
    pub range: [f64; 2],
    /// Where it lies [rad/s].
    pub speed: f64,
    /// Where it lies [N m].
    pub torque: f64,
}

/// A stretch of speeds in which a limit forbids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SpeedRange {
    /// From [rad/s].
    pub from: f64,
    /// To [rad/s].
    pub to: f64,
    /// `current`, `voltage`, `slope`, `response`, `speed`.
    pub limit: String,
    /// Why, in a sentence.
    pub reason: String,
}

/// A part of an edge of what can be rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Edge {
    /// Of the largest friction; else of the least.
    pub largest: bool,
    /// From [rad/s].
    pub from: f64,
    /// To [rad/s].
    pub to: f64,
    /// `current`, `voltage`; `wheel` where the law renders nothing and the friction wheel alone tells.
    pub limit: String,
}

impl Sketch {
    /// What is to be seen.
    ///
    /// # Errors
    /// [`Error::CurvePoint`] for a point, a hand or a speed that is none; [`Error::OutOfRange`] for numbers that a desired
    /// friction cannot have, and for too many of anything; what the design of observer and current control refuses.
    pub fn draw(&self, preset: &Preset<f64>) -> Result<Drawn, Error> {
        let Preset { model, bench, .. } = preset;
        check_count("reference points", self.points.len(), MOST_POINTS)?;
        check_count("speeds", self.speeds.len(), LARGEST_GRID)?;
        for (index, &speed) in self.speeds.iter().enumerate() {
            if !(speed.is_finite() && speed >= 0.0) {
                let remedy = "A speed is from 0 on: friction is the same in both directions.";
                return Err(Error::CurvePoint { index, field: "velocity", value: speed, remedy });
            }
        }
        let region = Region::of(model, bench, Passage::default())?;
        let fastest = fastest(&region);
        let mut desired = self.desired.map_or(bench.desired, |numbers| with_values(&bench.desired, numbers));
        check(&desired)?;
        let points: Vec<_> = self.points.iter().map(|p| [p.speed, p.torque, p.weight]).collect();
        if self.fit && !points.is_empty() {
            desired = Stribeck { decay: desired.decay, ..through_weighted(&points, &desired, None)? };
        }
        if let Some(drag) = self.drag {
            desired = dragged(&desired, drag, fastest)?;
            let held = HANDLES.iter().position(|handle| *handle == drag.handle);
            if drag.refit && held.is_some() && !points.is_empty() {
                desired = Stribeck { decay: desired.decay, ..through_weighted(&points, &desired, held)? };
            }
        }
        if self.nearest {
            desired = nearest(&region, &model.own, &desired, fastest);
        }
        let bristles = match self.bristles {
            Some([stiffness, damping, elastic_fraction]) => {
                let bristles = Bristles { stiffness, damping, elastic_fraction, ..bench.desired_bristles };
                check_bristles(&bristles)?;
                bristles
            }
            None => bench.desired_bristles,
        };
        let way = LOOP
            * (desired.breakaway_torque / bristles.stiffness)
                .max(model.own.breakaway_torque / model.own_bristles.stiffness);
        let points = self.points.iter().map(|point| [point.speed, point.torque]).collect();
        let design = Design { own: model.own, desired, points, region };
        let judge = if self.thorough { Region::judge } else { Region::glance };
        let verdict = judge(&region, &design.own, &desired, fastest);
        let seen =
            |value: &dyn Fn(f64) -> f64| self.speeds.iter().map(|speed| short(value(*speed))).collect::<Vec<_>>();
        let faded = wheel_below(bench);
        let able = |side: usize| {
            let torque = |speed: f64| if speed < faded { 0.0 } else { region.at(speed).torque[side] };
            seen(&|speed| design.own.magnitude(speed) + torque(speed))
        };
        let stretch = |(shortage, reason): (&stickslip_design::Shortage, String)| SpeedRange {
            from: shortage.speeds[0],
            to: shortage.speeds[1],
            limit: shortage.bound.limit.name().into(),
            reason,
        };
        Ok(Drawn {
            desired: values(&desired),
            curve: seen(&|speed| desired.magnitude(speed)),
            own: seen(&|speed| design.own.magnitude(speed)),
            least: able(0),
            largest: able(1),
            edges: self.edges(&region, faded),
            desired_loop: presliding(&bristles.under(desired), way),
            own_loop: presliding(&model.own_bristles.under(design.own), way),
            grips: grips(&desired, fastest),
            renderable: verdict.renderable(),
            margin: Some(verdict.margin).filter(|margin| margin.is_finite()),
            shortages: verdict.shortages.iter().zip(verdict.reasons()).map(stretch).collect(),
            remarks: design.remarks_on(&verdict),
            distance: Some(design.distance()).filter(|distance| distance.is_finite()),
        })
    }
}

impl Sketch {
    /// The stretches in which one limit bounds an edge.
    fn edges(&self, region: &Region, faded: f64) -> Vec<Edge> {
        let mut edges: Vec<Edge> = Vec::new();
        for side in [0, 1] {
            for &speed in &self.speeds {
                let limit = if speed < faded { WHEEL } else { region.at(speed).limits[side].name() };
                let largest = side == 1;
                match edges.last_mut().filter(|edge| edge.largest == largest && edge.limit == limit) {
                    Some(edge) => edge.to = speed,
                    None => edges.push(Edge { largest, from: speed, to: speed, limit: limit.into() }),
                }
            }
        }
        edges
    }
}

/// What bounds an edge where the law renders nothing: friction there is that of screw and wheel.
const WHEEL: &str = "wheel";

/// Speed up to which the law in force renders nothing [rad/s].
fn wheel_below(settings: &Settings<f64>) -> f64 {
    if matches!(settings.law, LawChoice::Paper) { settings.fade_velocity } else { 0.0 }
}

/// In as many digits as a picture can show.
fn short(value: f64) -> f64 {
    // A number in scientific notation always parses.
    format!("{value:.4e}").parse().unwrap_or(value)
}

fn check_count(name: &'static str, count: usize, most: usize) -> Result<(), Error> {
    if count <= most {
        return Ok(());
    }
    let remedy = "A picture has fewer.";
    Err(Error::OutOfRange { name, value: count as f64, unit: "1", minimum: 0.0, maximum: most as f64, remedy })
}

/// What the table of parameters says of each number.
fn field(parameter: usize) -> &'static Field {
    let name = PARAMETERS[parameter].0;
    let fields = <Stribeck<f64> as Fields<f64>>::SHAPE.fields();
    fields.iter().find(|field| field.name == name).expect("a curve has its parameters")
}

fn check(curve: &Stribeck<f64>) -> Result<(), Error> {
    let mut numbers = values(curve).into_iter().enumerate();
    numbers.try_for_each(|(parameter, value)| in_range(field(parameter), PARAMETERS[parameter].1, value))
}

fn check_bristles(bristles: &Bristles<f64>) -> Result<(), Error> {
    let numbers = [bristles.stiffness, bristles.damping, bristles.elastic_fraction];
    let fields = <Bristles<f64> as Fields<f64>>::SHAPE.fields();
    ["stiffness", "damping", "elastic_fraction"].into_iter().zip(numbers).try_for_each(|(name, value)| {
        let field = fields.iter().find(|field| field.name == name).expect("bristles have their parameters");
        in_range(field, name, value)
    })
}

fn in_range(field: &Field, name: &'static str, value: f64) -> Result<(), Error> {
    let Field { minimum, maximum, unit, .. } = *field;
    if (minimum..=maximum).contains(&value) {
        return Ok(());
    }
    let remedy = "A desired friction that can be written into a parameter file keeps to it.";
    Err(Error::OutOfRange { name, value, unit, minimum, maximum, remedy })
}

/// From rest to one end of the way [rad], to the other, and back.
pub(crate) fn presliding(friction: &Friction<f64>, way: f64) -> Loop {
    let element = FrictionElement { friction: *friction };
    let mut state = FrictionElementState::default();
    let step = way / STEPS as f64;
    let turns = [(1.0, STEPS), (-1.0, 2 * STEPS), (1.0, 2 * STEPS)];
    let mut angle = 0.0;
    let mut seen = Loop { angle: vec![0.0], torque: vec![0.0] };
    for direction in turns.into_iter().flat_map(|(direction, steps)| std::iter::repeat_n(direction, steps)) {
        let contact = Contact { velocity: direction * step / SLOWLY, ..Contact::default() };
        angle += direction * step;
        seen.torque.push(short(element.step(&mut state, contact, SLOWLY).torque));
        seen.angle.push(short(angle));
    }
    seen
}

/// The curve as the hand wants it, within the ranges of its parameters.
fn dragged(curve: &Stribeck<f64>, drag: Drag, fastest: f64) -> Result<Stribeck<f64>, Error> {
    let Drag { handle, speed, torque, .. } = drag;
    for (name, value) in [("velocity", speed), ("torque", torque)] {
        if !value.is_finite() {
            let remedy = "A hand is somewhere in the picture.";
            return Err(Error::CurvePoint { index: 0, field: name, value, remedy });
        }
    }
    let mut numbers = values(curve);
    let [breakaway, kinetic, stribeck, viscous] = numbers;
    match handle {
        Handle::BreakawayTorque => numbers[0] = torque,
        Handle::KineticTorque => {
            let at = SETTLED * stribeck;
            let left = drop(curve, at);
            numbers[1] = (torque - viscous * at - left * breakaway) / (1.0 - left);
        }
        Handle::StribeckVelocity => numbers[2] = speed,
        Handle::ViscousFriction => {
            let at = LEVER * fastest;
            numbers[3] = (torque - curve.level(at)) / at;
        }
        Handle::Line => {
            let up = torque - curve.magnitude(speed.abs());
            // Both at once, so that the drop stays: neither leaves its range.
            let lowest = field(0).minimum.max(field(1).minimum) - breakaway.min(kinetic);
            let highest = field(0).maximum.min(field(1).maximum) - breakaway.max(kinetic);
            let up = up.clamp(lowest, highest);
            (numbers[0], numbers[1]) = (breakaway + up, kinetic + up);
        }
    }
    for (parameter, number) in numbers.iter_mut().enumerate() {
        *number = number.clamp(field(parameter).minimum, field(parameter).maximum);
    }
    Ok(with_values(curve, numbers))
}

/// The share of the drop that is left at a speed [rad/s].
fn drop(curve: &Stribeck<f64>, speed: f64) -> f64 {
    with_values(curve, [1.0, 0.0, curve.stribeck_velocity, 0.0]).level(speed)
}

fn grips(curve: &Stribeck<f64>, fastest: f64) -> Vec<Grip> {
    let speeds = [0.0, SETTLED * curve.stribeck_velocity, curve.stribeck_velocity, LEVER * fastest];
    let grip = |(parameter, (value, speed)): (usize, (f64, f64))| Grip {
        handle: HANDLES[parameter],
        symbol: field(parameter).symbol.into(),
        value,
        unit: field(parameter).unit.into(),
        range: [field(parameter).minimum, field(parameter).maximum],
        speed,
        torque: curve.magnitude(speed),
    };
    values(curve).into_iter().zip(speeds).enumerate().map(grip).collect()
}

/// On the way from the desired to the own friction the first curve that can be rendered; the desired one where none can.
fn nearest(region: &Region, own: &Stribeck<f64>, desired: &Stribeck<f64>, fastest: f64) -> Stribeck<f64> {
    let does = |curve: &Stribeck<f64>| region.glance(own, curve, fastest).margin >= AIR;
    let (from, to) = (values(desired), values(own));
    let between = |share: f64| {
        let mut numbers = [0.0; 4];
        for (parameter, number) in numbers.iter_mut().enumerate() {
            *number = from[parameter] + share * (to[parameter] - from[parameter]);
        }
        with_values(desired, numbers)
    };
    if does(desired) || !does(&between(1.0)) {
        return *desired;
    }
    let (mut refused, mut admitted) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (refused + admitted);
        if does(&between(middle)) { admitted = middle } else { refused = middle }
    }
    between(admitted)
}

#[cfg(test)]
mod tests;
