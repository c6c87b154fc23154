//! Scores of any motion, for a table: those of the benchmark where the manoeuvre has them.

use super::{COUNTS, Course, Manoeuvre};
use std::f64::consts::TAU;
use stickslip_base::preset::Preset;
use stickslip_design::Hunting;

/// Scores of a motion; `None` where they are not defined for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scores {
    /// RMS of the deviation [rad].
    pub tracking_rms: f64,
    /// Largest deviation [rad].
    pub tracking_peak: f64,
    /// Largest deviation about a reversal, mean over the reversals [rad].
    pub reversal_peak: Option<f64>,
    /// Mean settling time of the moves that settle [s].
    pub settling: Option<f64>,
    /// Share of the moves that do not settle.
    pub unsettled: Option<f64>,
    /// The limit cycle at a constant set-point.
    pub hunting: Option<Hunting>,
    /// Standard deviation of the noise in the torque [N m].
    pub torque_noise: f64,
}

impl Scores {
    /// The scores of a course; `chance` is the place of the manoeuvre, which is `None` for another motion.
    pub fn of(manoeuvre: Option<Manoeuvre>, course: &Course, preset: &Preset<f64>, chance: f64) -> Self {
        let judged = manoeuvre.map_or(Vec::new(), |manoeuvre| manoeuvre.judge(course, preset, chance));
        let measures = manoeuvre.map_or(&[][..], Manoeuvre::measures);
        let of = |end: &str| {
            let index = measures.iter().position(|measure| measure.name.ends_with(end))?;
            judged.get(index).copied().filter(|value| value.is_finite())
        };
        let from = manoeuvre.map_or(0.0, Manoeuvre::evaluated_from);
        let from = ((from / course.period).round() as usize).min(course.deviation.len());
        let deviation = &course.deviation[from..];
        let count = TAU / preset.model.encoder.counts_per_revolution;
        Scores {
            tracking_rms: rms(deviation),
            tracking_peak: deviation.iter().fold(0.0, |most: f64, it| most.max(it.abs())),
            reversal_peak: of("reversal_peak"),
            settling: of("_settling"),
            unsettled: of("_failures"),
            hunting: (manoeuvre == Some(Manoeuvre::Hold))
                .then(|| Hunting::find(deviation, course.period, COUNTS * count))
                .flatten(),
            torque_noise: noise(&course.torque[from.min(course.torque.len())..]),
        }
    }
}

pub(super) fn rms(values: &[f64]) -> f64 {
    libm::sqrt(values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64)
}

/// Standard deviation of white noise in a slowly changing torque [N m].
pub(super) fn noise(torque: &[f64]) -> f64 {
    let bends = torque.windows(3).map(|three| three[1] - 0.5 * (three[0] + three[2]));
    let square: f64 = bends.map(|bend| bend * bend).sum();
    libm::sqrt(square / 1.5 / (torque.len() as f64 - 2.0).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::super::MANOEUVRES;
    use super::*;
    use stickslip_base::parameters::presets;

    #[test]
    fn scores_of_a_manoeuvre_are_those_of_the_benchmark() {
        let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        let period = preset.bench.control_period();
        for manoeuvre in MANOEUVRES {
            let samples = (manoeuvre.reference(&preset, 0.5).1 / period).round() as usize;
            // A limit cycle of 1 rad and 0.5 s, with a torque that alternates from sample to sample.
            let wave = |k: usize| libm::sin(TAU * 2.0 * k as f64 * period);
            let course = Course {
                period,
                deviation: (0..samples).map(wave).collect(),
                velocity: vec![0.0; samples],
                torque: (0..samples).map(|k| if k % 2 == 0 { 0.01 } else { -0.01 }).collect(),
            };
            let (scores, judged) =
                (Scores::of(Some(manoeuvre), &course, &preset, 0.5), manoeuvre.judge(&course, &preset, 0.5));
            match manoeuvre {
                Manoeuvre::Reversal => assert_eq!(scores.reversal_peak, Some(judged[0])),
                Manoeuvre::SlowSine => assert_eq!([scores.tracking_rms, scores.torque_noise], [judged[0], judged[1]]),
                Manoeuvre::FastSine => assert_eq!(scores.tracking_rms, judged[0]),
                Manoeuvre::Steps | Manoeuvre::PointToPoint | Manoeuvre::Strokes => {
                    assert_eq!((scores.settling, scores.unsettled), (None, Some(1.0)), "{manoeuvre:?}");
                }
                Manoeuvre::Hold => {
                    let hunting = scores.hunting.unwrap();
                    assert!((hunting.amplitude - 1.0).abs() < 0.01 && (hunting.interval - 0.25).abs() < 0.01);
                }
                Manoeuvre::Creep => assert!(scores.settling.is_none() && scores.hunting.is_none()),
            }
            assert!((scores.tracking_peak - 1.0).abs() < 1e-3);
        }
        let other = Course { period, deviation: vec![1.0, -3.0], velocity: vec![0.0; 2], torque: vec![0.0; 2] };
        let scores = Scores::of(None, &other, &preset, 0.5);
        assert!(scores.tracking_peak == 3.0 && scores.reversal_peak.is_none() && scores.unsettled.is_none());
    }
}
