//! The identified numbers: names, units, and start values.

use stickslip_core::scalar::{Dual, Scalar};

use stickslip_base::preset::{Model, Settings};

/// Number of free parameters of the fit.
pub(super) const PARAMETERS: usize = 28;

/// Their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub(super) enum Index {
    TorquePerVolt,
    MotorInertia,
    LoadInertia,
    CouplingStiffness,
    CouplingDamping,
    ServoLag,
    TachoScale,
    TachoLag,
    AccelerometerScale,
    AccelerometerFrequency,
    AccelerometerDamping,
    AccelerometerOffset,
    TorqueConstant,
    Resistance,
    Inductance,
    CurrentOffset,
    SlidingSlope,
    RippleCosine,
    RippleSine,
    BristleStiffness,
    BristleDamping,
    BrushStiffness,
    BrushDamping,
    TachoSine,
    TachoCosine,
    ServoDelay,
    LoadDelay,
    LoadLag,
}

/// A free parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FreeParameter {
    /// Key of the result.
    pub(super) key: &'static str,
    /// Name in words.
    pub(super) words: &'static str,
    /// Unit as in a field.
    pub(super) unit: &'static str,
    /// 0 for a positive number, searched by its logarithm; else the scale of a number of either sign.
    pub(super) scale: f64,
}

const fn positive(key: &'static str, words: &'static str, unit: &'static str) -> FreeParameter {
    FreeParameter { key, words, unit, scale: 0.0 }
}

const fn signed(key: &'static str, words: &'static str, unit: &'static str, scale: f64) -> FreeParameter {
    FreeParameter { key, words, unit, scale }
}

/// In the order of [`Index`].
pub(super) const SOUGHT: [FreeParameter; PARAMETERS] = [
    positive("torque_per_volt", "torque per volt of the servo k_u", "N m/V"),
    positive("motor_inertia", "motor inertia J_M", "kg m^2"),
    positive("load_inertia", "load inertia J_L", "kg m^2"),
    positive("coupling_stiffness", "coupling stiffness c", "N m/rad"),
    positive("coupling_damping", "coupling damping d", "N m s/rad"),
    positive("servo_lag", "lag of the servo amplifier", "s"),
    positive("tacho", "tacho constant K_T", "V s/rad"),
    positive("tacho_lag", "lag of the tacho", "s"),
    positive("accelerometer", "accelerometer sensitivity S_a", "V/(m/s^2)"),
    positive("accelerometer_frequency", "natural frequency of the accelerometer", "rad/s"),
    positive("accelerometer_damping", "damping ratio of the accelerometer", "1"),
    signed("accelerometer_offset", "accelerometer offset a_0", "m/s^2", 0.1),
    positive("torque_constant", "torque constant of the load motor K_L", "N m/A"),
    positive("resistance", "resistance of the load motor R", "Ω"),
    positive("inductance", "inductance of the load motor L", "H"),
    signed("current_offset", "offset of the current sensor", "A", 0.01),
    signed("sliding_slope", "slope of friction at high speed", "N m s/rad", 1e-4),
    signed("ripple_cosine", "ripple of friction over the turn, cosine", "1", 0.01),
    signed("ripple_sine", "ripple of friction over the turn, sine", "1", 0.01),
    positive("bristle_stiffness", "bristle stiffness σ₀", "N m/rad"),
    positive("bristle_damping", "bristle damping σ₁", "N m s/rad"),
    // Positive, since a negative stiffness would let the motor swing by itself; 0 (no bristles) is the limit of the
    // logarithm.
    positive("brush_stiffness", "bristle stiffness of the brushes", "N m/rad"),
    positive("brush_damping", "damping of the brushes at rest", "N m s/rad"),
    signed("tacho_sine", "ripple of the tacho, sine", "1", 0.01),
    signed("tacho_cosine", "ripple of the tacho, cosine", "1", 0.01),
    signed("servo_delay", "delay of the servo amplifier", "s", 1e-4),
    signed("load_delay", "delay of the load amplifier", "s", 1e-4),
    positive("load_lag", "lag of the load amplifier", "s"),
];

impl Index {
    /// Whether the data determine it poorly at first and no other parameter depends on it: its steps are limited alone.
    pub(super) fn is_loose(index: usize) -> bool {
        use Index::{AccelerometerDamping, AccelerometerFrequency, BristleDamping, BristleStiffness};
        use Index::{BrushDamping, BrushStiffness};
        let instrument = [AccelerometerDamping, AccelerometerFrequency];
        let bristles = [BristleDamping, BristleStiffness, BrushDamping, BrushStiffness];
        instrument.iter().chain(&bristles).any(|other| *other as usize == index)
    }
}

/// Start values: the data sheet, and usual values for the numbers that it lacks.
pub(super) fn start(model: &Model<f64>) -> [f64; PARAMETERS] {
    let scaling = &model.scaling;
    let lag = model.drive_lag.max(1e-4);
    [
        scaling.torque_per_volt,
        model.drive.motor_inertia,
        model.drive.load_inertia,
        model.drive.coupling_stiffness,
        model.drive.coupling_damping.max(1e-4),
        0.4 * lag,
        scaling.tacho,
        0.6 * lag,
        scaling.accelerometer,
        std::f64::consts::TAU * 1000.0,
        0.7,
        0.0,
        model.load_motor.torque_constant,
        model.load_motor.resistance,
        model.load_motor.inductance,
        0.0,
        model.own.viscous_friction,
        0.0,
        0.0,
        model.own_bristles.stiffness,
        model.own_bristles.damping.max(1e-3),
        1.0,
        0.01,
        0.0,
        0.0,
        model.servo_delay,
        model.load_amplifier.delay,
        model.load_amplifier.lag,
    ]
}

/// From coordinates of the search to values.
///
/// Sums of inertias and the resonance, which the data determine best, are coordinates of their own: in the inertias
/// themselves the way to the minimum would be a narrow bend.
pub(super) fn values<T: Scalar>(coordinates: &[T; PARAMETERS]) -> [T; PARAMETERS] {
    let mut values: [T; PARAMETERS] = std::array::from_fn(|i| match SOUGHT[i].scale {
        0.0 => coordinates[i].exp(),
        scale => coordinates[i] * T::of(scale),
    });
    let [ratio, inertia] = [values[Index::MotorInertia as usize], values[Index::LoadInertia as usize]];
    let share = ratio / (T::of(1.0) + ratio);
    let reduced = inertia * share * (T::of(1.0) - share);
    values[Index::MotorInertia as usize] = inertia * share;
    values[Index::LoadInertia as usize] = inertia * (T::of(1.0) - share);
    for index in [Index::CouplingStiffness, Index::CouplingDamping] {
        values[index as usize] *= reduced;
    }
    values
}

/// From values to coordinates of the search.
pub(super) fn coordinates(values: &[f64; PARAMETERS]) -> [f64; PARAMETERS] {
    let mut plain = *values;
    let [motor, load] = [values[Index::MotorInertia as usize], values[Index::LoadInertia as usize]];
    plain[Index::MotorInertia as usize] = motor / load;
    plain[Index::LoadInertia as usize] = motor + load;
    for index in [Index::CouplingStiffness, Index::CouplingDamping] {
        plain[index as usize] *= (motor + load) / (motor * load);
    }
    std::array::from_fn(|i| match SOUGHT[i].scale {
        0.0 => libm::log(plain[i]),
        scale => plain[i] / scale,
    })
}

/// The values with their slopes over the coordinates; those that are not free have no slope.
pub(super) fn sloped(at: &[f64; PARAMETERS], amplifiers: Amplifiers) -> [Dual<PARAMETERS>; PARAMETERS] {
    values(&std::array::from_fn(|i| if amplifiers.frees(i) { Dual::variable(at[i], i) } else { Dual::of(at[i]) }))
}

/// Kind and lateness of both amplifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Amplifiers {
    /// Whether that of the load motor takes a torque, the scale of all torques then; else it takes a voltage.
    pub(super) take_torque: bool,
    /// Whether they have delays of their own, besides the software's tick.
    pub(super) are_late: bool,
}

impl Amplifiers {
    /// Those of a bench: amplifiers that take a torque are behind a fieldbus.
    pub(super) fn new(model: &Model<f64>, settings: &Settings<f64>) -> Self {
        let take_torque = settings.torque_amplifier > 0.5;
        let are_late = take_torque || model.servo_delay > 0.0 || model.load_amplifier.delay > 0.0;
        Amplifiers { take_torque, are_late }
    }

    /// Whether the search varies a parameter.
    pub(super) fn frees(self, index: usize) -> bool {
        let is = |indices: &[Index]| indices.iter().any(|other| *other as usize == index);
        if is(&[Index::ServoDelay, Index::LoadDelay]) {
            self.are_late
        } else if is(&[Index::TorqueConstant, Index::Resistance, Index::Inductance]) {
            !self.take_torque
        } else {
            self.take_torque || !is(&[Index::LoadLag])
        }
    }
}
