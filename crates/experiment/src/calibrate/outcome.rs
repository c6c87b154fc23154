//! What a calibration found out, as numbers with their uncertainty, and as what the software is to believe from now on.

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

/// Standard uncertainties that a ripple or a difference of directions must have to be told of.
const SIGNIFICANT: f64 = 4.0;
/// How far the simulation may miss the encoder, over what its counts explain.
const EXPLAINED: f64 = 1.2;
/// Time that is drawn [s].
const DRAWN: f64 = 0.06;

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

/// Amplitude of the tacho's ripple, as a share; 0 where none stands out.
fn tacho_ripple(solution: &Solution) -> f64 {
    let at = values(&solution.coordinates);
    if solution.setting.ripple_order == 0 {
        return 0.0;
    }
    libm::hypot(at[Index::TachoSine as usize], at[Index::TachoCosine as usize])
}

impl Calibration {
    pub(super) fn new(
        believed: &Model<f64>,
        solution: &Solution,
        curve: FrictionCurve,
        own: StribeckFit,
        duration: f64,
    ) -> Self {
        let mut values = identified::drive(believed, solution);
        values.extend(identified::friction(believed, &own, &values[Index::TorquePerVolt as usize]));
        let dropped = curve.dropped().filter_map(|plateau| {
            plateau.dropped.map(|reason| format!("At {} rad/s: {reason}", number(plateau.set_velocity, 2)))
        });
        let mut warnings: Vec<String> = dropped.collect();
        let unknown = values.iter().filter(|number| !number.known());
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
            model: *believed,
            values,
            curve,
            own,
            traces,
            tacho_ripple_order: solution.setting.ripple_order,
            warnings,
            duration,
        };
        calibration.tell_ripple(solution);
        calibration.tell_directions(solution);
        calibration.model = identified::model(believed, &calibration.values);
        calibration.model.tacho_ripple = tacho_ripple(solution);
        calibration
    }

    /// The number of this name.
    pub fn value(&self, key: &str) -> Option<&Identified> {
        self.values.iter().find(|number| number.key == key)
    }

    fn tell_ripple(&mut self, solution: &Solution) {
        let at = sloped(&solution.coordinates);
        let [cosine, sine] = [at[Index::RippleCosine as usize], at[Index::RippleSine as usize]];
        let amplitude = libm::hypot(cosine.value, sine.value);
        let [known, other] = [cosine, sine].map(|part| solution.known(&part));
        let known = if known.half > other.half { known } else { other };
        if amplitude > SIGNIFICANT * known.standard {
            let phase = libm::atan2(cosine.value, sine.value);
            let of_phase = Known { standard: known.standard / amplitude, half: known.half / amplitude };
            self.add("friction_ripple", "ripple of friction over a turn, as a share", "1", amplitude, known);
            self.add("friction_ripple_phase", "its phase at the screw's zero", "rad", phase, of_phase);
        }
    }

    /// Asymmetry and offset of the friction look alike at one speed: half the difference of both levels is told.
    fn tell_directions(&mut self, solution: &Solution) {
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
            let known = Known { standard: uncertainty, half: uncertainty * student_t95(freedom) };
            self.add("direction_offset", "friction at high speed, mean of both directions", "N m", offset, known);
        }
    }

    fn add(&mut self, key: &'static str, words: &'static str, unit: &'static str, value: f64, known: Known) {
        self.values.push(Identified::new(key, words, unit, f64::NAN, value, known));
    }
}

/// What to say where the simulation misses the encoder [rad] by more than its counts explain.
fn unexplained(rms: f64, resolution: f64) -> Option<String> {
    // A count is anywhere within its width: 1/√12 of it.
    let counts = resolution / libm::sqrt(12.0);
    (rms > EXPLAINED * counts).then(|| {
        format!(
            "The simulation misses the encoder by {:.0} % more than its counts explain: the machine has more \
             than the two masses that are fitted (ripple of a motor, play, a third mass), or the search ended beside \
             its minimum. Intervals do not hold, and values only as far as that does not matter.",
            100.0 * (rms / counts - 1.0)
        )
    })
}

fn traces(solution: &Solution) -> Vec<Trace> {
    const NAMES: [(&str, &str); CHANNELS] =
        [("angle", "rad"), ("tacho", "V"), ("accelerometer", "V"), ("current of the load motor", "A")];
    let at = values(&solution.coordinates);
    let sliding = solution.segments.iter().filter(|segment| !segment.is_stuck());
    let left: Vec<_> = sliding.map(|segment| (segment, residuals(&at, segment, &solution.setting))).collect();
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
