//! The desired friction while it is edited: the response of the bench to a hand on the curve.
//!
//! A [`Sketch`] has the input: numbers, reference points, a dragged handle. [`Sketch::draw`] computes all that is
//! shown: the curve, its handles, the renderable region and its limits. It is faster than a frame of the display, so
//! that the curve follows the hand; the remedies are computed after the drag ([`Sketch::thorough`]).

mod drawn;

pub use drawn::{Drawn, Edge, Grip, Loop, NearestLimit, SpeedRange};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_core::block::Block as _;
use stickslip_core::fields::{Field, Fields};
use stickslip_core::friction::{Bristles, Contact, Friction, FrictionElement, FrictionElementState, Stribeck};

use super::design::{Design, Weighted, fastest, through_points};
use stickslip_base::preset::{LawChoice, Settings};
use stickslip_base::{Error, Preset};
use stickslip_design::{CAUTION, Limit, Passage, Region};
use stickslip_fit::{PARAMETERS, values, with_values};

/// Speed of the handle of M_K, in Stribeck velocities; the drop has ended there.
const SETTLED: f64 = 8.0;
/// Speed of the handle of b, as a share of the fastest speed.
const LEVER: f64 = 0.9;
/// Way of a presliding loop, in bristle deflections at breakaway, and number of its steps.
const LOOP: f64 = 3.0;
const STEPS: usize = 60;
/// Time of a step [s], long enough that damping has no effect.
const SLOWLY: f64 = 10.0;
/// Largest number of drawn speeds.
const LARGEST_GRID: usize = 4000;
/// Largest number of reference points.
const MOST_POINTS: usize = 1000;
/// Margin of the nearest curve: outside the zone of caution, and renderable between the speeds as well.
const AIR: f64 = 1.01 / (1.0 - CAUTION);
/// Steps of the search for the nearest curve that can be rendered.
const BISECTIONS: usize = 16;

/// An edited desired friction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sketch {
    /// Breakaway torque [N m], kinetic torque [N m], Stribeck velocity [rad/s], viscous friction [N m s/rad]; default:
    /// the active ones.
    #[serde(default)]
    pub desired: Option<[f64; 4]>,
    /// Bristles: stiffness [N m/rad], damping [N m s/rad], elastic limit as a share; default: the active ones.
    #[serde(default)]
    pub bristles: Option<[f64; 3]>,
    /// Reference points.
    #[serde(default)]
    pub points: Vec<Reference>,
    /// Whether the curve is fitted to the points.
    #[serde(default)]
    pub fit: bool,
    /// The dragged handle.
    #[serde(default)]
    pub drag: Option<Drag>,
    /// Whether the curve is moved to the nearest renderable one.
    #[serde(default)]
    pub nearest: bool,
    /// Whether to compute remedies for a curve that cannot be rendered; takes a hundred times longer.
    #[serde(default)]
    pub thorough: bool,
    /// Speeds at which the curve is evaluated, at least 0 [rad/s].
    pub speeds: Vec<f64>,
}

/// A reference point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Speed, at least 0 [rad/s].
    pub speed: f64,
    /// Torque, above 0 [N m].
    pub torque: f64,
    /// Weight relative to other points.
    #[serde(default = "one")]
    pub weight: f64,
}

fn one() -> f64 {
    1.0
}

/// A dragged handle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Drag {
    /// The handle.
    pub handle: Handle,
    /// Speed at the pointer [rad/s].
    pub speed: f64,
    /// Torque at the pointer [N m].
    pub torque: f64,
    /// Whether the other parameters are fitted to the reference points.
    #[serde(default)]
    pub refit: bool,
}

/// Handles of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Handle {
    /// M_S, at rest: up and down.
    BreakawayTorque,
    /// M_K, behind the drop: up and down.
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

impl Sketch {
    /// Computes the view.
    ///
    /// # Errors
    /// [`Error::CurvePoint`] for an invalid point, pointer or speed; [`Error::OutOfRange`] for numbers outside the
    /// ranges of a desired friction, and for too many points or speeds; errors of the design of observer and current
    /// control.
    pub fn draw(&self, preset: &Preset<f64>) -> Result<Drawn, Error> {
        let Preset { model, bench, .. } = preset;
        check_count("reference points", self.points.len(), MOST_POINTS)?;
        check_count("speeds", self.speeds.len(), LARGEST_GRID)?;
        for (index, &speed) in self.speeds.iter().enumerate() {
            if !(speed.is_finite() && speed >= 0.0) {
                let remedy = "The speed must be at least 0: friction is the same in both directions.";
                return Err(Error::CurvePoint { index, field: "velocity", value: speed, remedy });
            }
        }
        let region = Region::of(model, bench, Passage::default())?;
        let fastest = fastest(&region);
        let mut desired = self.desired.map_or(bench.desired, |numbers| with_values(&bench.desired, numbers));
        check(&desired)?;
        let points: Vec<Weighted> = self.points.iter().map(|p| [p.speed, p.torque, p.weight]).collect();
        if self.fit && !points.is_empty() {
            desired = Stribeck { decay: desired.decay, ..through_points(&points, &desired, None)? };
        }
        if let Some(drag) = self.drag {
            desired = dragged(&desired, drag, fastest)?;
            let held = HANDLES.iter().position(|handle| *handle == drag.handle);
            if drag.refit && held.is_some() && !points.is_empty() {
                desired = Stribeck { decay: desired.decay, ..through_points(&points, &desired, held)? };
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
        let design = Design { own: model.own, desired, points, region };
        let judge = if self.thorough { Region::judge } else { Region::glance };
        let verdict = judge(&region, &design.own, &desired, fastest);
        let evaluated =
            |value: &dyn Fn(f64) -> f64| self.speeds.iter().map(|speed| short(value(*speed))).collect::<Vec<_>>();
        let faded = wheel_below(bench);
        let able = |side: usize| {
            let torque = |speed: f64| if speed < faded { 0.0 } else { region.at(speed).torque[side] };
            evaluated(&|speed| (design.own.magnitude(speed) + torque(speed)).min(region.drive_capacity(speed)))
        };
        let range = |(shortage, reason): (&stickslip_design::Shortage, String)| SpeedRange {
            from: shortage.speeds[0],
            to: shortage.speeds[1],
            limit: shortage.bound.limit.name().into(),
            reason,
        };
        Ok(Drawn {
            desired: values(&desired),
            curve: evaluated(&|speed| desired.magnitude(speed)),
            own: evaluated(&|speed| design.own.magnitude(speed)),
            least: able(0),
            largest: able(1),
            edges: self.edges(&region, &model.own, faded),
            desired_loop: presliding(&bristles.under(desired), way),
            own_loop: presliding(&model.own_bristles.under(design.own), way),
            grips: grips(&desired, fastest),
            renderable: verdict.renderable(),
            margin: Some(verdict.margin).filter(|margin| margin.is_finite()),
            nearest: NearestLimit::of(&verdict),
            strays: design.strays(),
            shortages: verdict.shortages.iter().zip(verdict.reasons()).map(range).collect(),
            remarks: design.remarks_on(&verdict),
            distance: Some(design.distance()).filter(|distance| distance.is_finite()),
        })
    }
}

impl Sketch {
    /// The speed ranges in which one limit bounds an edge.
    fn edges(&self, region: &Region, own: &Stribeck<f64>, faded: f64) -> Vec<Edge> {
        let mut edges: Vec<Edge> = Vec::new();
        for side in [0, 1] {
            for &speed in &self.speeds {
                let largest = side == 1;
                let band = region.at(speed);
                let limit = if speed < faded {
                    WHEEL
                } else if largest && own.magnitude(speed) + band.torque[1] > region.drive_capacity(speed) {
                    Limit::Drive.name()
                } else {
                    band.limits[side].name()
                };
                match edges.last_mut().filter(|edge| edge.largest == largest && edge.limit == limit) {
                    Some(edge) => edge.to = speed,
                    None => edges.push(Edge { largest, from: speed, to: speed, limit: limit.into() }),
                }
            }
        }
        edges
    }
}

/// Limit of an edge where the law renders no torque: friction is that of screw and wheel there.
const WHEEL: &str = "wheel";

/// Speed up to which the active law renders no torque [rad/s].
fn wheel_below(settings: &Settings<f64>) -> f64 {
    if matches!(settings.law, LawChoice::Paper) { settings.fade_velocity } else { 0.0 }
}

/// Rounded to five digits, as many as a figure can show.
fn short(value: f64) -> f64 {
    let place = 4.0 - libm::floor(libm::log10(value.abs()));
    // Not for 0 and numbers without a place.
    if place.is_nan() || place.abs() > EXACT {
        return value;
    }
    // Divided by a power of ten, not multiplied by its inverse: the nearest number to the short decimal.
    let scale = 10f64.powi(place.abs() as i32);
    if place > 0.0 { (value * scale).round() / scale } else { (value / scale).round() * scale }
}

/// Largest power of ten without rounding error.
const EXACT: f64 = 22.0;

fn check_count(name: &'static str, count: usize, most: usize) -> Result<(), Error> {
    if count <= most {
        return Ok(());
    }
    let remedy = "Reduce the number.";
    Err(Error::OutOfRange { name, value: count as f64, unit: "1", minimum: 0.0, maximum: most as f64, remedy })
}

/// Field description of each number.
fn field(parameter: usize) -> &'static Field {
    let name = PARAMETERS[parameter].0;
    let fields = <Stribeck<f64> as Fields<f64>>::SHAPE.fields();
    fields.iter().find(|field| field.name == name).expect("a curve has this parameter")
}

fn check(curve: &Stribeck<f64>) -> Result<(), Error> {
    let mut numbers = values(curve).into_iter().enumerate();
    numbers.try_for_each(|(parameter, value)| in_range(field(parameter), PARAMETERS[parameter].1, value))
}

fn check_bristles(bristles: &Bristles<f64>) -> Result<(), Error> {
    let numbers = [bristles.stiffness, bristles.damping, bristles.elastic_fraction];
    let fields = <Bristles<f64> as Fields<f64>>::SHAPE.fields();
    ["stiffness", "damping", "elastic_fraction"].into_iter().zip(numbers).try_for_each(|(name, value)| {
        let field = fields.iter().find(|field| field.name == name).expect("bristles have this parameter");
        in_range(field, name, value)
    })
}

fn in_range(field: &Field, name: &'static str, value: f64) -> Result<(), Error> {
    let Field { minimum, maximum, unit, .. } = *field;
    if (minimum..=maximum).contains(&value) {
        return Ok(());
    }
    let remedy = "The desired friction must be within the ranges of a parameter file.";
    Err(Error::OutOfRange { name, value, unit, minimum, maximum, remedy })
}

/// From rest to one end of the way [rad], to the other, and back.
pub(crate) fn presliding(friction: &Friction<f64>, way: f64) -> Loop {
    let element = FrictionElement { friction: *friction };
    let mut state = FrictionElementState::default();
    let step = way / STEPS as f64;
    let turns = [(1.0, STEPS), (-1.0, 2 * STEPS), (1.0, 2 * STEPS)];
    let mut angle = 0.0;
    let mut path = Loop { angle: vec![0.0], torque: vec![0.0] };
    for direction in turns.into_iter().flat_map(|(direction, steps)| std::iter::repeat_n(direction, steps)) {
        let contact = Contact { velocity: direction * step / SLOWLY, ..Contact::default() };
        angle += direction * step;
        path.torque.push(short(element.step(&mut state, contact, SLOWLY).torque));
        path.angle.push(short(angle));
    }
    path
}

/// The curve at the dragged position, within the ranges of its parameters.
fn dragged(curve: &Stribeck<f64>, drag: Drag, fastest: f64) -> Result<Stribeck<f64>, Error> {
    let Drag { handle, speed, torque, .. } = drag;
    for (name, value) in [("velocity", speed), ("torque", torque)] {
        if !value.is_finite() {
            let remedy = "The pointer must be within the figure.";
            return Err(Error::CurvePoint { index: 0, field: name, value, remedy });
        }
    }
    let mut numbers = values(curve);
    let [breakaway, kinetic, stribeck, viscous] = numbers;
    match handle {
        Handle::BreakawayTorque => numbers[0] = torque,
        Handle::KineticTorque => {
            let at = SETTLED * stribeck;
            let share = drop(curve, at);
            numbers[1] = (torque - viscous * at - share * breakaway) / (1.0 - share);
        }
        Handle::StribeckVelocity => numbers[2] = speed,
        Handle::ViscousFriction => {
            let at = LEVER * fastest;
            numbers[3] = (torque - curve.level(at)) / at;
        }
        Handle::Line => {
            let up = torque - curve.magnitude(speed.abs());
            // Both together, so that the drop remains: neither leaves its range.
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

/// Remaining share of the drop at a speed [rad/s].
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

/// First renderable curve on the way from the desired to the own friction; the desired one if there is none.
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
