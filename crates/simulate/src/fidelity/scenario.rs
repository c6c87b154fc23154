//! Scenarios of the machines, and their compared measures.

use std::f64::consts::TAU;

use stickslip_core::control::reference::{Constant, Generator, MotionLimits, PointToPoint, Ramp, Reference, Sine};
use stickslip_core::control::{AxisControl, Pid, PositionController};

use super::staircase::Staircase;
use stickslip_base::{Error, Preset};
use stickslip_design as design;

/// Time at rest before each scenario, so that the observer has settled [s].
pub(super) const REST: f64 = 0.5;
/// Step of the set-point at the start of hunting [rad].
const STEP: f64 = 0.5;
/// Speed of the ramp of stick-slip [rad/s].
const RAMP_SPEED: f64 = 0.1;
/// Time in which limit cycles are counted [s].
const COUNTED: f64 = 12.0;
/// Settling time of a limit cycle [s].
const START_UP: f64 = 3.0;
/// Fade-in time of a sine, and duration of the first torque cycle [s].
const FADE_IN: f64 = 1.0;

/// Way from rest at which a load has broken away, for any bristles [rad].
pub(super) const BROKEN_AWAY: f64 = 5e-3;

/// A scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scenario {
    /// Its stable name.
    pub name: &'static str,
    kind: Kind,
    /// The compared measures.
    pub(super) measures: &'static [Measure],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    SlowSine,
    FastSine,
    PointToPoint,
    Hunting,
    StickSlip,
    Breakaway,
    Presliding,
    Curve,
    CorrectedCurve,
}

/// One number of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Measure {
    /// Its stable name, the `scenario` of a row.
    pub(super) name: &'static str,
    pub(super) of: Quantity,
}

/// Quantity of a measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// E, all the time after the fade-in.
    Angle,
    /// E while the set-point moves.
    Moving,
    /// E in the last 100 ms of each dwell.
    End,
    /// Twist of the arm: root mean square of its deviation over its own.
    Twist,
    /// Amplitude of a limit cycle.
    Amplitude,
    /// Time between its breakaways.
    Interval,
    /// Their number.
    Count,
    /// Torque of the drive at breakaway of the load.
    Breakaway,
    /// Area of the loop of felt torque over angle: at 0.9 of the breakaway torque a percent of torque is 23 % of it.
    Area,
    /// Stiffness of that loop, from its one end to the other: a percent of torque is 2 % of it.
    Stiffness,
    /// Distance of the rendered from the desired characteristic.
    Curve,
}

impl Scenario {
    /// Sine of 2 rad at 0.5 Hz, the preset's controller.
    pub const SINE_05HZ: Scenario = scenario(
        "sine_0.5hz",
        Kind::SlowSine,
        &[measure("sine_0.5hz", Quantity::Angle), measure("sine_0.5hz_arm", Quantity::Twist)],
    );
    /// Sine of 2 rad at 2 Hz, the preset's controller.
    pub const SINE_2HZ: Scenario = scenario(
        "sine_2hz",
        Kind::FastSine,
        &[measure("sine_2hz", Quantity::Angle), measure("sine_2hz_arm", Quantity::Twist)],
    );
    /// Moves of 10 rad forth and back at 40 rad/s and 600 rad/s² with dwells, the preset's controller.
    pub const POINT_TO_POINT: Scenario = scenario(
        "point_to_point",
        Kind::PointToPoint,
        &[
            measure("point_to_point", Quantity::Angle),
            measure("point_to_point_moving", Quantity::Moving),
            measure("point_to_point_end", Quantity::End),
            measure("point_to_point_arm", Quantity::Twist),
        ],
    );
    /// A PID controller with a triple pole at 15 rad/s and three times its integral gain, to a set-point.
    pub const HUNTING: Scenario = scenario(
        "hunting",
        Kind::Hunting,
        &[
            measure("hunting_amplitude", Quantity::Amplitude),
            measure("hunting_interval", Quantity::Interval),
            measure("hunting_count", Quantity::Count),
        ],
    );
    /// A PID controller with a triple pole at 20 rad/s along a ramp of 0.1 rad/s.
    pub const STICK_SLIP: Scenario = scenario(
        "stick_slip",
        Kind::StickSlip,
        &[
            measure("stick_slip_amplitude", Quantity::Amplitude),
            measure("stick_slip_interval", Quantity::Interval),
            measure("stick_slip_count", Quantity::Count),
        ],
    );
    /// The drive's torque rises slowly until the load moves; no controller.
    pub const BREAKAWAY: Scenario =
        scenario("breakaway", Kind::Breakaway, &[measure("breakaway", Quantity::Breakaway)]);
    /// The drive's torque cycles below breakaway; no controller.
    pub const PRESLIDING: Scenario = scenario(
        "presliding",
        Kind::Presliding,
        &[measure("presliding_area", Quantity::Area), measure("presliding_stiffness", Quantity::Stiffness)],
    );
    /// Constant speeds of 0.05 to 50 rad/s both ways, held by a separate stiff controller that runs in every tick.
    pub const CURVE: Scenario = scenario("curve", Kind::Curve, &[measure("curve", Quantity::Curve)]);
    /// The same with the correction that the bench makes before: it measures the rendered friction and corrects it at
    /// most twice.
    pub const CURVE_CORRECTED: Scenario =
        scenario("curve_corrected", Kind::CorrectedCurve, &[measure("curve_corrected", Quantity::Curve)]);
}

/// All scenarios.
pub const SCENARIOS: &[Scenario] = &[
    Scenario::SINE_05HZ,
    Scenario::SINE_2HZ,
    Scenario::POINT_TO_POINT,
    Scenario::HUNTING,
    Scenario::STICK_SLIP,
    Scenario::BREAKAWAY,
    Scenario::PRESLIDING,
    Scenario::CURVE,
    Scenario::CURVE_CORRECTED,
];

/// Those in which the controller under test acts.
pub const CLOSED_LOOP: &[Scenario] = SCENARIOS.split_at(5).0;

const fn scenario(name: &'static str, kind: Kind, measures: &'static [Measure]) -> Scenario {
    Scenario { name, kind, measures }
}

const fn measure(name: &'static str, of: Quantity) -> Measure {
    Measure { name, of }
}

/// Course of a run.
pub(super) struct Course {
    pub(super) controller: AxisControl<f64>,
    /// Whether the controller runs in every tick instead of at its own rate.
    pub(super) every_tick: bool,
    pub(super) drive: Drive,
    /// Time at rest before it [s].
    pub(super) rest: f64,
    /// Duration [s].
    pub(super) duration: f64,
}

/// Excitation of the machine.
pub(super) enum Drive {
    /// The position controller along a reference.
    Position(Reference<f64>),
    /// A controller along constant speeds.
    Staircase(Staircase),
    /// A rising torque [N m/s] until the load has moved this far [rad].
    TorqueRamp { rate: f64, travel: f64 },
    /// A cyclic torque of this amplitude [N m] and frequency [Hz].
    TorqueCycles { amplitude: f64, frequency: f64 },
}

impl Drive {
    /// Torque without controller [N m].
    pub(super) fn torque(&self, time: f64) -> f64 {
        match self {
            Drive::Position(_) | Drive::Staircase(_) => 0.0,
            Drive::TorqueRamp { rate, .. } => rate * time,
            Drive::TorqueCycles { amplitude, frequency } => amplitude * libm::sin(TAU * frequency * time),
        }
    }

    /// Whether the position is controlled.
    pub(super) fn controls(&self) -> bool {
        matches!(self, Drive::Position(_) | Drive::Staircase(_))
    }

    /// The set-points of a reference, one for each tick.
    pub(super) fn setpoints(&self, rate: f64) -> Option<Generator<'_>> {
        match self {
            Drive::Position(reference) => Some(Generator::new(*reference, rate)),
            _ => None,
        }
    }

    /// Whether the scenario is complete.
    pub(super) fn is_over(&self, angle: f64) -> bool {
        matches!(self, Drive::TorqueRamp { travel, .. } if angle.abs() > *travel)
    }
}

impl Scenario {
    /// The scenario of a name.
    pub fn find(name: &str) -> Option<Scenario> {
        SCENARIOS.iter().copied().find(|scenario| scenario.name == name)
    }

    /// Whether the bench corrects its law before.
    pub fn is_corrected(&self) -> bool {
        self.kind == Kind::CorrectedCurve
    }

    /// The same without correction, for a machine that does not render.
    pub fn uncorrected(self) -> Scenario {
        if self.is_corrected() { Scenario::CURVE } else { self }
    }

    /// Whether A0 is a part of its comparison: angles are scaled by it.
    pub fn needs_own(&self) -> bool {
        self.measures.iter().any(|measure| matches!(measure.of, Quantity::Angle | Quantity::Moving | Quantity::End))
    }

    /// Whether it has a measure.
    pub fn has(&self, measure: &str) -> bool {
        self.measures.iter().any(|own| own.name == measure)
    }

    /// The course on this bench.
    pub(super) fn course(&self, preset: &Preset<f64>) -> Result<Course, Error> {
        let breakaway = preset.bench.desired.breakaway_torque;
        let limits = MotionLimits { velocity: 40.0, acceleration: 600.0, jerk: 6e6 };
        let moves = PointToPoint { distance: 10.0, limits, dwell_time: 0.5, moves: 4.0 };
        let sine = |frequency| Reference::Sine(Sine { amplitude: 2.0, frequency, fade_time: 1.0 });
        let ramp = Ramp { velocity: RAMP_SPEED, acceleration: 1.0, hold_time: 1e4 };
        let step = Reference::Constant(Constant { position: STEP });
        let (drive, duration) = match self.kind {
            Kind::SlowSine => (Drive::Position(sine(0.5)), FADE_IN + 4.0),
            Kind::FastSine => (Drive::Position(sine(2.0)), FADE_IN + 2.0),
            Kind::PointToPoint => (Drive::Position(Reference::PointToPoint(moves)), moves.duration()),
            Kind::Hunting => (Drive::Position(step), START_UP + COUNTED),
            Kind::StickSlip => (Drive::Position(Reference::Ramp(ramp)), START_UP + COUNTED),
            Kind::Breakaway => (Drive::TorqueRamp { rate: 0.5 * breakaway, travel: BROKEN_AWAY }, 4.0),
            Kind::Presliding => (Drive::TorqueCycles { amplitude: 0.9 * breakaway, frequency: 1.0 }, FADE_IN + 2.0),
            Kind::Curve | Kind::CorrectedCurve => {
                let staircase = Staircase::new();
                let duration = staircase.duration();
                (Drive::Staircase(staircase), duration)
            }
        };
        let controller = match self.kind {
            Kind::Hunting => pid(preset, 15.0, 3.0)?.into(),
            Kind::StickSlip => pid(preset, 20.0, 1.0)?.into(),
            Kind::Curve | Kind::CorrectedCurve => speed_holder(preset)?,
            // With compensation and hold.
            _ => design::axis_control(&preset.model, &preset.bench)?,
        };
        let every_tick = matches!(drive, Drive::Staircase(_));
        Ok(Course { controller, every_tick, drive, rest: REST, duration })
    }

    /// Start of the evaluation [s].
    pub fn evaluated_from(&self) -> f64 {
        REST + match self.kind {
            Kind::SlowSine | Kind::FastSine | Kind::Presliding => FADE_IN,
            Kind::Hunting | Kind::StickSlip => START_UP,
            Kind::PointToPoint | Kind::Breakaway | Kind::Curve | Kind::CorrectedCurve => 0.0,
        }
    }
}

/// A PID controller with a triple pole at this bandwidth [rad/s], its integral gain raised by a factor.
fn pid(preset: &Preset<f64>, bandwidth: f64, factor: f64) -> Result<PositionController<f64>, Error> {
    let base = Pid { torque_limit: preset.bench.controller.torque_limit(), ..Pid::default() };
    let pid = design::pid_by_bandwidth(base, preset.model.drive.inertia(), bandwidth)?;
    Ok(PositionController::Pid(Pid { integral_gain: factor * pid.integral_gain, ..pid }))
}

/// A controller that holds a speed as stiffly as its delays permit.
fn speed_holder(preset: &Preset<f64>) -> Result<AxisControl<f64>, Error> {
    let limit = preset.bench.controller.torque_limit();
    design::speed_holder(limit, &preset.model, preset.bench.tick_time())
}
