//! Identified numbers, each with its uncertainty, and the controller's model updated by them.

use std::f64::consts::TAU;

use stickslip_core::friction::{Bristle as _, Bristles, LuGre};
use stickslip_core::scalar::{Dual, Scalar as _};

use super::fit::Solution;
use super::parameters::{FreeParameter, Index, PARAMETERS, SOUGHT, sloped, start, values};
use super::response::LOAD_VELOCITY;
use super::segment::{LEAD_IN, predict};
use super::uncertainty::Known;
use stickslip_base::preset::{Model, ModelUncertainty};
use stickslip_base::quantity::Estimate;
use stickslip_fit::{PARAMETERS as OWN, StribeckFit};

/// Standard uncertainty over the value beyond which a number is not adopted.
const UNKNOWN: f64 = 0.25;
/// Standard uncertainty up to which a delay is adopted in any case [s]: it may be 0.
const KNOWN_DELAY: f64 = 50e-6;

/// An identified number.
#[derive(Clone, Debug, PartialEq)]
pub struct Identified {
    /// Stable name.
    pub key: &'static str,
    /// Name in words, with its symbol.
    pub words: &'static str,
    /// Unit as in a field.
    pub unit: &'static str,
    /// Value of the model before; NaN if the model has none.
    pub believed: f64,
    /// Estimate.
    pub value: f64,
    /// Standard uncertainty.
    pub standard_uncertainty: f64,
    /// Ends of the 95 % interval.
    pub ci95: [f64; 2],
}

impl Identified {
    pub(super) fn new(
        key: &'static str,
        words: &'static str,
        unit: &'static str,
        assumed: f64,
        value: f64,
        uncertainty: Known,
    ) -> Self {
        let Known { standard, half } = uncertainty;
        let ci95 = [value - half, value + half];
        Identified { key, words, unit, believed: assumed, value, standard_uncertainty: standard, ci95 }
    }

    /// Whether the data determine it.
    pub fn is_determined(&self) -> bool {
        let absolute = if self.key.ends_with("delay") { KNOWN_DELAY } else { 0.0 };
        self.standard_uncertainty <= (UNKNOWN * self.value.abs()).max(absolute) || self.key.ends_with("offset")
    }

    /// With half the width of its interval.
    pub fn estimate(&self) -> Estimate {
        Estimate::new(self.value, self.unit).with_half_width(0.5 * (self.ci95[1] - self.ci95[0]))
    }
}

/// Numbers of the fit of the drive, in the order of [`Index`]; then servo and tacho lag together.
pub(super) fn drive(model: &Model<f64>, solution: &Solution) -> Vec<Identified> {
    let (before, mut now) = (start(model), sloped(&solution.coordinates, solution.setting.amplifiers));
    now[Index::BristleDamping as usize] *= Dual::of(1.0 / unfaded(&model.own_bristles, solution));
    // Numbers that the model does not contain.
    let unstated = [
        Index::ServoLag,
        Index::TachoLag,
        Index::AccelerometerFrequency,
        Index::AccelerometerDamping,
        Index::AccelerometerOffset,
        Index::CurrentOffset,
        Index::SlidingSlope,
    ];
    // A sensor that is faster than the samples has no effect.
    let too_fast = now[Index::AccelerometerFrequency as usize].value * solution.setting.dt > TAU;
    let number = |i: usize| {
        let FreeParameter { key, words, unit, .. } = SOUGHT[i];
        let assumed = if unstated.iter().any(|index| *index as usize == i) { f64::NAN } else { before[i] };
        let ineffective = too_fast && matches!(key, "accelerometer_frequency" | "accelerometer_damping");
        let known = if ineffective { Known::NOTHING } else { solution.known(&now[i]) };
        Identified::new(key, words, unit, assumed, now[i].value, known)
    };
    use Index::{BrushDamping, BrushStiffness, RippleCosine, RippleSine, TachoCosine, TachoSine};
    let hidden = [RippleCosine, RippleSine, BrushStiffness, BrushDamping, TachoSine, TachoCosine];
    let absent = |key: &str| !solution.setting.has_instruments && of_instruments(key);
    let free = |i: &usize| solution.setting.amplifiers.frees(*i);
    let visible = (0..PARAMETERS).filter(free).filter(|i| hidden.iter().all(|index| *index as usize != *i));
    let lag = now[Index::ServoLag as usize] + now[Index::TachoLag as usize];
    let words = "lag of servo and tacho together";
    let both = Identified::new("drive_lag", words, "s", model.drive_lag, lag.value, solution.known(&lag));
    visible.map(number).chain([both]).filter(|number| !absent(number.key)).collect()
}

/// Whether a number is one of accelerometer or tacho.
fn of_instruments(key: &str) -> bool {
    key.starts_with("tacho") || key.starts_with("accelerometer") || key == "drive_lag"
}

/// Share of the bristles' damping at rest that acted while the load was shaken: σ₁ fades with speed, and a linear drive
/// absorbs as much power with the mean of σ₁(Ω) weighted by Ω².
fn unfaded(bristles: &Bristles<f64>, solution: &Solution) -> f64 {
    let unit = LuGre { bristle_damping: 1.0, fading: bristles.fading, ..LuGre::default() };
    let at = values(&solution.coordinates);
    let (mut faded, mut whole) = (0.0, 0.0);
    for segment in solution.segments.iter().filter(|segment| segment.is_stuck()) {
        predict(&at, &segment.own, segment, &solution.setting, |k, state, _| {
            let square = if k < LEAD_IN { 0.0 } else { state[LOAD_VELOCITY] * state[LOAD_VELOCITY] };
            faded += square * unit.damping(state[LOAD_VELOCITY]);
            whole += square;
        });
    }
    if whole > 0.0 { faded / whole } else { 1.0 }
}

/// The Stribeck curve, its torques with at least the uncertainty of the drive torque's scale.
pub(super) fn friction(model: &Model<f64>, own: &StribeckFit, scale: &Identified) -> Vec<Identified> {
    let before = &model.own;
    let before = [before.breakaway_torque, before.kinetic_torque, before.stribeck_velocity, before.viscous_friction];
    let share = scale.standard_uncertainty / scale.value;
    let number = |(k, (key, words, unit)): (usize, &(&'static str, &'static str, &'static str))| {
        let value = own.parameters[k];
        let of_scale = if *unit == "rad/s" { 0.0 } else { share * value };
        let wider = libm::hypot(own.standard_errors[k], of_scale) / own.standard_errors[k];
        Identified {
            key,
            words,
            unit,
            believed: before[k],
            value,
            standard_uncertainty: wider * own.standard_errors[k],
            ci95: own.ci95[k].map(|end| value + wider * (end - value)),
        }
    };
    OWN.iter().enumerate().map(number).collect()
}

/// Experiment that determines a number.
pub(super) fn remedy(key: &str) -> &'static str {
    match key {
        "bristle_stiffness" | "bristle_damping" => {
            "Shake the load at rest longer, or with a larger share of its breakaway torque."
        }
        "accelerometer_frequency" | "accelerometer_damping" => "Excite up to higher frequencies.",
        "coupling_damping" | "coupling_stiffness" => "Excite the drive's resonance more: a larger acceleration.",
        "viscous_friction" | "sliding_slope" => {
            "Increase the swing of the speed, or measure friction at higher speeds."
        }
        _ => "Record longer, or with a larger acceleration.",
    }
}

/// Remaining uncertainty of the model: a standard uncertainty of each number, and the ripple that the characteristic
/// lacks.
fn doubt(before: &ModelUncertainty<f64>, numbers: &[Identified]) -> ModelUncertainty<f64> {
    let find = |key: &str| numbers.iter().find(|number| number.key == key);
    let share = |key: &str, otherwise: f64| {
        find(key)
            .filter(|number| number.is_determined())
            .map_or(otherwise, |number| number.standard_uncertainty / number.value.abs())
    };
    let friction = |key| share(key, before.friction);
    ModelUncertainty {
        drive_torque: share("torque_per_volt", before.drive_torque),
        load_inertia: share("load_inertia", before.load_inertia),
        coupling_stiffness: share("coupling_stiffness", before.coupling_stiffness),
        friction: friction("breakaway_torque").max(friction("kinetic_torque")),
        ripple: find("friction_ripple").map_or(0.0, |number| number.value),
        bristle_stiffness: share("bristle_stiffness", before.bristle_stiffness),
    }
}

/// The model with the identified numbers.
pub(super) fn model(before: &Model<f64>, numbers: &[Identified]) -> Model<f64> {
    let mut model = *before;
    let mut frequency = TAU * model.accelerometer_bandwidth;
    let places: [(&str, &mut f64); 23] = [
        ("torque_per_volt", &mut model.scaling.torque_per_volt),
        ("tacho", &mut model.scaling.tacho),
        ("accelerometer", &mut model.scaling.accelerometer),
        ("motor_inertia", &mut model.drive.motor_inertia),
        ("load_inertia", &mut model.drive.load_inertia),
        ("coupling_stiffness", &mut model.drive.coupling_stiffness),
        ("coupling_damping", &mut model.drive.coupling_damping),
        ("torque_constant", &mut model.load_motor.torque_constant),
        ("resistance", &mut model.load_motor.resistance),
        ("inductance", &mut model.load_motor.inductance),
        ("drive_lag", &mut model.drive_lag),
        ("servo_lag", &mut model.servo_lag),
        ("servo_delay", &mut model.servo_delay),
        ("load_delay", &mut model.load_amplifier.delay),
        ("load_lag", &mut model.load_amplifier.lag),
        ("accelerometer_frequency", &mut frequency),
        ("accelerometer_damping", &mut model.accelerometer_damping),
        ("bristle_stiffness", &mut model.own_bristles.stiffness),
        ("bristle_damping", &mut model.own_bristles.damping),
        ("breakaway_torque", &mut model.own.breakaway_torque),
        ("kinetic_torque", &mut model.own.kinetic_torque),
        ("stribeck_velocity", &mut model.own.stribeck_velocity),
        ("viscous_friction", &mut model.own.viscous_friction),
    ];
    for (key, place) in places {
        if let Some(number) = numbers.iter().find(|number| number.key == key).filter(|number| number.is_determined()) {
            // A delay of 0 has an estimate of either sign.
            *place = if key.ends_with("delay") { number.value.max(0.0) } else { number.value };
        }
    }
    model.accelerometer_bandwidth = frequency / TAU;
    model.doubt = doubt(&before.doubt, numbers);
    model
}
