//! Result of a calibration: numbers with their uncertainty, and the updated model of the controller.

use super::fit::Solution;
use super::identified::{self, Identified, remedy};
use super::parameters::{Index, sloped, values};
use super::response::CHANNELS;
use super::segment::{LEAD_IN, residuals};
use super::uncertainty::Known;
use crate::FrictionCurve;
use stickslip_base::preset::Model;
use stickslip_base::quantity::number;
use stickslip_fit::{StribeckFit, student_t95};

/// Size of a ripple or a difference of directions, in standard uncertainties, from which it is reported.
const SIGNIFICANT: f64 = 4.0;
/// Largest residual of the encoder, over that of its quantisation.
const EXPLAINED: f64 = 1.2;
/// Time shown in figures [s].
const DRAWN: f64 = 0.06;

/// A piece of a channel: measured, and as the fitted model predicts it.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Name of the channel.
    pub channel: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Time [s], measured, predicted.
    pub points: Vec<[f64; 3]>,
    /// RMS of the residuals over all segments, in the unit.
    pub rms: f64,
}

/// Result of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The identified numbers.
    pub values: Vec<Identified>,
    /// Own friction at constant speeds, in torques of the servo's data sheet.
    pub curve: FrictionCurve,
    /// Its Stribeck curve, in calibrated torques.
    pub own: StribeckFit,
    /// The controller's model, with every number that the data determine.
    pub model: Model<f64>,
    /// Measured and predicted course of each channel.
    pub traces: Vec<Trace>,
    /// Periods a revolution of the tacho's ripple; 0 if none is significant.
    pub tacho_ripple_order: usize,
    /// Warnings for the report.
    pub warnings: Vec<String>,
    /// Bench time [s].
    pub duration: f64,
}

/// Amplitude of the tacho's ripple, as a share; 0 if none is significant.
fn tacho_ripple(solution: &Solution) -> f64 {
    let at = values(&solution.coordinates);
    if solution.setting.ripple_order == 0 {
        return 0.0;
    }
    libm::hypot(at[Index::TachoSine as usize], at[Index::TachoCosine as usize])
}

impl Calibration {
    pub(super) fn new(
        model: &Model<f64>,
        solution: &Solution,
        curve: FrictionCurve,
        own: StribeckFit,
        duration: f64,
    ) -> Self {
        let mut values = identified::drive(model, solution);
        values.extend(identified::friction(model, &own, &values[Index::TorquePerVolt as usize]));
        let dropped = curve.dropped().filter_map(|plateau| {
            plateau.dropped.map(|reason| format!("At {} rad/s: {reason}", number(plateau.set_velocity, 2)))
        });
        let mut warnings: Vec<String> = dropped.collect();
        let unknown = values.iter().filter(|number| !number.is_determined());
        warnings.extend(unknown.map(|number| {
            let uncertainty = number.standard_uncertainty;
            let how = if uncertainty.is_finite() {
                format!("standard uncertainty {:.0} %", 100.0 * uncertainty / number.value.abs())
            } else {
                "it has no effect above the noise".into()
            };
            format!("Not identifiable: {}, {how}; the model keeps its value. {}", number.words, remedy(number.key))
        }));
        let (disturbed, fitted) = (solution.disturbed, solution.segments.len());
        warnings.extend((disturbed > 0).then(|| {
            format!(
                "{disturbed} of {} segments deviate from the simulation more than five times as much as the best ones and \
                 are left out: late ticks (stickslip doctor), or a disturbance.",
                disturbed + fitted
            )
        }));
        let traces = traces(solution);
        warnings.extend(unexplained(traces[0].rms, model.encoder.resolution()));
        let mut calibration = Calibration {
            model: *model,
            values,
            curve,
            own,
            traces,
            tacho_ripple_order: solution.setting.ripple_order,
            warnings,
            duration,
        };
        calibration.add_ripple(solution);
        calibration.add_directions(solution);
        calibration.model = identified::model(model, &calibration.values);
        calibration.model.tacho_ripple = tacho_ripple(solution);
        calibration
    }

    /// The number of this name.
    pub fn value(&self, key: &str) -> Option<&Identified> {
        self.values.iter().find(|number| number.key == key)
    }

    fn add_ripple(&mut self, solution: &Solution) {
        let at = sloped(&solution.coordinates, solution.setting.amplifiers);
        let [cosine, sine] = [at[Index::RippleCosine as usize], at[Index::RippleSine as usize]];
        let amplitude = libm::hypot(cosine.value, sine.value);
        let [uncertainty, other] = [cosine, sine].map(|part| solution.known(&part));
        let uncertainty = if uncertainty.half > other.half { uncertainty } else { other };
        if amplitude > SIGNIFICANT * uncertainty.standard {
            let phase = libm::atan2(cosine.value, sine.value);
            let of_phase = Known { standard: uncertainty.standard / amplitude, half: uncertainty.half / amplitude };
            self.add("friction_ripple", "ripple of friction over a turn, as a share", "1", amplitude, uncertainty);
            self.add("friction_ripple_phase", "its phase at the screw's zero", "rad", phase, of_phase);
        }
    }

    /// Asymmetry and offset of the friction cannot be distinguished at one speed: half the difference of both levels is
    /// reported.
    fn add_directions(&mut self, solution: &Solution) {
        let levels = |positive: bool| -> Vec<f64> {
            let sliding = solution.segments.iter().filter(|segment| !segment.is_stuck());
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
            let freedom =
                (solution.segments.iter().filter(|segment| !segment.is_stuck()).count() as f64 - 2.0).max(1.0);
            let interval = Known { standard: uncertainty, half: uncertainty * student_t95(freedom) };
            self.add("direction_offset", "friction at high speed, mean of both directions", "N m", offset, interval);
        }
    }

    fn add(&mut self, key: &'static str, words: &'static str, unit: &'static str, value: f64, uncertainty: Known) {
        self.values.push(Identified::new(key, words, unit, f64::NAN, value, uncertainty));
    }
}

/// Warning if the residual of the encoder [rad] is larger than its quantisation.
fn unexplained(rms: f64, resolution: f64) -> Option<String> {
    // A count is anywhere within its width: 1/√12 of it.
    let counts = resolution / libm::sqrt(12.0);
    (rms > EXPLAINED * counts).then(|| {
        format!(
            "The simulation deviates from the encoder by {:.0} % more than its quantisation: the machine has more \
             than the two masses that are fitted (ripple of a motor, play, a third mass), or the search ended near \
             its minimum. The intervals are not valid, and the values only approximate.",
            100.0 * (rms / counts - 1.0)
        )
    })
}

fn traces(solution: &Solution) -> Vec<Trace> {
    const NAMES: [(&str, &str); CHANNELS] =
        [("angle", "rad"), ("tacho", "V"), ("accelerometer", "V"), ("current of the load motor", "A")];
    let at = values(&solution.coordinates);
    let sliding = solution.segments.iter().filter(|segment| !segment.is_stuck());
    let pieces: Vec<_> = sliding.map(|segment| (segment, residuals(&at, segment, &solution.setting))).collect();
    let dt = solution.setting.dt;
    let points_shown = (DRAWN / dt) as usize;
    NAMES
        .iter()
        .enumerate()
        .filter(|(c, _)| solution.setting.has_instruments || ![1, 2].contains(c))
        .map(|(c, (channel, unit))| {
            let counted = || pieces.iter().flat_map(|(_, residual)| residual[LEAD_IN..].iter().map(|it| it[c]));
            let rms = (counted().map(|it| it * it).sum::<f64>() / counted().count().max(1) as f64).sqrt();
            let points = pieces.first().map_or_else(Vec::new, |(segment, residual)| {
                let shown = segment.samples.iter().zip(residual).enumerate().skip(LEAD_IN).take(points_shown);
                shown
                    .map(|(k, (sample, residual))| {
                        [k as f64 * dt, sample.measured[c], sample.measured[c] - residual[c]]
                    })
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
    fn a_simulation_that_deviates_from_the_encoder_gives_a_warning() {
        let resolution = std::f64::consts::TAU / 10_000.0;
        assert_eq!(unexplained(0.29 * resolution, resolution), None);
        let warning = unexplained(0.5774 * resolution, resolution).unwrap();
        assert!(warning.contains("by 100 % more") && warning.contains("not valid"), "{warning}");
    }
}
