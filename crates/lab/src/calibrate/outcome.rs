//! What a calibration found out, as numbers with their uncertainty, and as what the software is to believe from now on.

use super::fit::{LEAD_IN, Solution};
use super::parameters::{Index, PARAMETERS, SOUGHT, start, values};
use super::response::{CHANNELS, Regime};
use crate::experiment::FrictionCurve;
use crate::fit::{PARAMETERS as OWN, StribeckFit};
use crate::preset::Model;
use crate::quantity::{Estimate, NORMAL95, number};

/// Standard uncertainty over the value beyond which a number is not believed.
const UNKNOWN: f64 = 0.25;
/// Standard uncertainties that a ripple or a difference of directions must have to be told of.
const SIGNIFICANT: f64 = 4.0;
/// How far the simulation may miss the encoder, over what its counts explain.
const EXPLAINED: f64 = 1.2;
/// Time that is drawn [s].
const DRAWN: f64 = 0.06;

/// A number that was identified.
#[derive(Clone, Debug, PartialEq)]
pub struct Identified {
    /// Stable name.
    pub key: &'static str,
    /// In words, with its symbol.
    pub words: &'static str,
    /// Unit as in a field.
    pub unit: &'static str,
    /// What was believed before; NaN where nothing was.
    pub believed: f64,
    /// Estimate.
    pub value: f64,
    /// Standard uncertainty.
    pub standard_uncertainty: f64,
    /// Ends of the 95 % interval.
    pub ci95: [f64; 2],
}

impl Identified {
    /// Whether the data tell it.
    pub fn known(&self) -> bool {
        self.standard_uncertainty <= UNKNOWN * self.value.abs() || self.key.ends_with("offset")
    }

    /// With half the width of its interval.
    pub fn estimate(&self) -> Estimate {
        Estimate::new(self.value, self.unit).with_half_width(0.5 * (self.ci95[1] - self.ci95[0]))
    }
}

/// A piece of a channel: measured, and as the fitted model predicts it.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// What it is.
    pub channel: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Time [s], measured, predicted.
    pub points: Vec<[f64; 3]>,
    /// RMS of what the fit leaves over all segments, in the unit.
    pub rms: f64,
}

/// What the bench found out about itself.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// One a number.
    pub values: Vec<Identified>,
    /// Own friction at constant speeds, in torques of the servo's data sheet.
    pub curve: FrictionCurve,
    /// Its Stribeck curve, in calibrated torques.
    pub own: StribeckFit,
    /// What the software is to believe: what was, with every number that the data tell.
    pub model: Model<f64>,
    /// Measured and predicted, one a channel.
    pub traces: Vec<Trace>,
    /// Periods a revolution of the tacho's ripple; 0 where it has none that shows.
    pub tacho_ripple_order: usize,
    /// What a reader should know.
    pub warnings: Vec<String>,
    /// Bench time [s].
    pub duration: f64,
}

impl Calibration {
    pub(super) fn new(
        believed: &Model<f64>,
        solution: &Solution,
        curve: FrictionCurve,
        own: StribeckFit,
        duration: f64,
    ) -> Self {
        let mut identified = drive(believed, solution);
        identified.extend(friction(believed, &own, &identified[Index::TorquePerVolt as usize]));
        let dropped = curve.dropped().filter_map(|plateau| {
            plateau.dropped.map(|reason| format!("At {} rad/s: {reason}", number(plateau.set_velocity, 2)))
        });
        let mut warnings: Vec<String> = dropped.collect();
        let unknown = identified.iter().filter(|number| !number.known());
        warnings.extend(unknown.map(|number| {
            format!(
                "Not identifiable: {}, known to {:.0} % only; what was believed stays. {}",
                number.words,
                100.0 * number.standard_uncertainty / number.value.abs(),
                remedy(number.key)
            )
        }));
        let traces = traces(solution);
        warnings.extend(unexplained(traces[0].rms, believed.encoder.resolution()));
        let mut calibration = Calibration {
            model: model(believed, &identified),
            values: identified,
            curve,
            own,
            traces,
            tacho_ripple_order: solution.setting.ripple_order,
            warnings,
            duration,
        };
        calibration.tell_ripple(solution);
        calibration.tell_directions(solution);
        calibration
    }

    /// The number of this name.
    pub fn value(&self, key: &str) -> Option<&Identified> {
        self.values.iter().find(|number| number.key == key)
    }

    fn tell_ripple(&mut self, solution: &Solution) {
        let at = values(&solution.coordinates);
        let [cosine, sine] = [Index::RippleCosine as usize, Index::RippleSine as usize];
        let amplitude = libm::hypot(at[cosine], at[sine]);
        let variance = 0.5 * (solution.covariance[(cosine, cosine)] + solution.covariance[(sine, sine)]);
        let uncertainty = variance.sqrt();
        if amplitude > SIGNIFICANT * uncertainty {
            let phase = libm::atan2(at[cosine], at[sine]);
            self.add("friction_ripple", "ripple of friction over a turn, as a share", "1", amplitude, uncertainty);
            self.add("friction_ripple_phase", "its phase at the screw's zero", "rad", phase, uncertainty / amplitude);
        }
    }

    /// Asymmetry and offset of the friction look alike at one speed: half the difference of both levels is told.
    fn tell_directions(&mut self, solution: &Solution) {
        let levels = |positive: bool| -> Vec<f64> {
            let sliding = solution.segments.iter().filter(|segment| segment.regime != Regime::Stuck);
            sliding.map(|segment| segment.friction_level()).filter(|level| (*level > 0.0) == positive).collect()
        };
        let mean = |levels: &[f64]| {
            let n = levels.len() as f64;
            let mean = levels.iter().sum::<f64>() / n;
            (mean, levels.iter().map(|level| (level - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
        };
        let [(up, up_variance), (down, down_variance)] = [true, false].map(|positive| mean(&levels(positive)));
        let uncertainty = 0.5 * (up_variance + down_variance).sqrt();
        let offset = 0.5 * (up + down);
        if offset.abs() > SIGNIFICANT * uncertainty {
            self.add("direction_offset", "friction at high speed, mean of both directions", "N m", offset, uncertainty);
        }
    }

    fn add(&mut self, key: &'static str, words: &'static str, unit: &'static str, value: f64, uncertainty: f64) {
        self.values.push(Identified {
            key,
            words,
            unit,
            believed: f64::NAN,
            value,
            standard_uncertainty: uncertainty,
            ci95: interval(value, uncertainty),
        });
    }
}

fn interval(value: f64, uncertainty: f64) -> [f64; 2] {
    [-NORMAL95, NORMAL95].map(|factor| value + factor * uncertainty)
}

/// Numbers of the fit of the drive, in the order of [`Index`] up to the brushes; then servo and tacho lag together.
fn drive(believed: &Model<f64>, solution: &Solution) -> Vec<Identified> {
    let (before, now) = (start(believed), values(&solution.coordinates));
    // In no data sheet that the software has.
    let unstated = [
        Index::ServoLag,
        Index::TachoLag,
        Index::AccelerometerFrequency,
        Index::AccelerometerDamping,
        Index::AccelerometerOffset,
        Index::CurrentOffset,
        Index::SlidingSlope,
    ];
    let number = |i: usize| {
        let uncertainty = solution.covariance[(i, i)].sqrt();
        Identified {
            key: SOUGHT[i].key,
            words: SOUGHT[i].words,
            unit: SOUGHT[i].unit,
            believed: if unstated.iter().any(|index| *index as usize == i) { f64::NAN } else { before[i] },
            value: now[i],
            standard_uncertainty: uncertainty,
            ci95: interval(now[i], uncertainty),
        }
    };
    let hidden = [Index::RippleCosine, Index::RippleSine, Index::BrushStiffness, Index::BrushDamping];
    let shown = (0..PARAMETERS).filter(|i| hidden.iter().all(|index| *index as usize != *i));
    let [servo, tacho] = [Index::ServoLag as usize, Index::TachoLag as usize];
    let c = &solution.covariance;
    let uncertainty = (c[(servo, servo)] + 2.0 * c[(servo, tacho)] + c[(tacho, tacho)]).sqrt();
    let lag = now[servo] + now[tacho];
    let both = Identified {
        key: "drive_lag",
        words: "lag of servo and tacho together",
        unit: "s",
        believed: believed.drive_lag,
        value: lag,
        standard_uncertainty: uncertainty,
        ci95: interval(lag, uncertainty),
    };
    shown.map(number).chain([both]).collect()
}

/// The Stribeck curve, its torques no surer than the scale of the drive torque.
fn friction(believed: &Model<f64>, own: &StribeckFit, scale: &Identified) -> Vec<Identified> {
    let before = &believed.own;
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

/// What to say where the simulation misses the encoder [rad] by more than its counts explain.
fn unexplained(rms: f64, resolution: f64) -> Option<String> {
    // A count is anywhere within its width: 1/√12 of it.
    let counts = resolution / libm::sqrt(12.0);
    (rms > EXPLAINED * counts).then(|| {
        format!(
            "The simulation misses the encoder by {:.0} % more than its counts explain: the machine is not the two \
             masses that are fitted, or the search ended beside its minimum. Values and intervals do not hold; start \
             from a data sheet that is nearer.",
            100.0 * (rms / counts - 1.0)
        )
    })
}

/// Which experiment would tell a number.
fn remedy(key: &str) -> &'static str {
    match key {
        "bristle_stiffness" | "bristle_damping" => {
            "Shake the load longer at rest, or with more of its breakaway torque."
        }
        "accelerometer_frequency" | "accelerometer_damping" => "Excite to higher frequencies.",
        "coupling_damping" | "coupling_stiffness" => "Excite the drive's resonance more: a larger acceleration.",
        "viscous_friction" | "sliding_slope" => "Let the speed swing more, or measure friction at higher speeds.",
        _ => "Record longer, or with a larger acceleration.",
    }
}

/// What is believed from now on.
fn model(believed: &Model<f64>, numbers: &[Identified]) -> Model<f64> {
    let mut model = *believed;
    let places: [(&str, &mut f64); 17] = [
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
        ("bristle_stiffness", &mut model.own_bristles.stiffness),
        ("bristle_damping", &mut model.own_bristles.damping),
        ("breakaway_torque", &mut model.own.breakaway_torque),
        ("kinetic_torque", &mut model.own.kinetic_torque),
        ("stribeck_velocity", &mut model.own.stribeck_velocity),
        ("viscous_friction", &mut model.own.viscous_friction),
    ];
    for (key, place) in places {
        if let Some(number) = numbers.iter().find(|number| number.key == key).filter(|number| number.known()) {
            *place = number.value;
        }
    }
    model
}

fn traces(solution: &Solution) -> Vec<Trace> {
    const NAMES: [(&str, &str); CHANNELS] =
        [("angle", "rad"), ("tacho", "V"), ("accelerometer", "V"), ("current of the load motor", "A")];
    let at = values(&solution.coordinates);
    let sliding = solution.segments.iter().filter(|segment| segment.regime != Regime::Stuck);
    let left: Vec<_> =
        sliding.map(|segment| (segment, super::fit::residuals(&at, segment, &solution.setting))).collect();
    let dt = solution.setting.dt;
    let drawn = (DRAWN / dt) as usize;
    NAMES
        .iter()
        .enumerate()
        .map(|(c, (channel, unit))| {
            let counted = || left.iter().flat_map(|(_, left)| left[LEAD_IN..].iter().map(|left| left[c]));
            let rms = (counted().map(|left| left * left).sum::<f64>() / counted().count().max(1) as f64).sqrt();
            let points = left.first().map_or_else(Vec::new, |(segment, left)| {
                let pieces = segment.samples.iter().zip(left).enumerate().skip(LEAD_IN).take(drawn);
                pieces
                    .map(|(k, (sample, left))| [k as f64 * dt, sample.measured[c], sample.measured[c] - left[c]])
                    .collect()
            });
            Trace { channel, unit, points, rms }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::unexplained;

    #[test]
    fn a_simulation_that_misses_the_encoder_is_said_not_to_hold() {
        let resolution = std::f64::consts::TAU / 10_000.0;
        assert_eq!(unexplained(0.29 * resolution, resolution), None);
        let said = unexplained(0.5774 * resolution, resolution).unwrap();
        assert!(said.contains("by 100 % more") && said.contains("do not hold"), "{said}");
    }
}
