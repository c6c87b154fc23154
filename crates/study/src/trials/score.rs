//! The scores of a trial.

use stickslip_base::statistics::{bootstrap, mean};
use stickslip_experiment::trial::Repetition;
use stickslip_simulate::manoeuvre::Scores;

/// A score of a trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct Score {
    /// Stable name.
    pub(super) name: &'static str,
    /// Title in a table.
    pub(super) title: &'static str,
    /// SI unit.
    pub(super) unit: &'static str,
    of: fn(&Scores) -> Option<f64>,
}

const fn score(name: &'static str, title: &'static str, unit: &'static str, of: fn(&Scores) -> Option<f64>) -> Score {
    Score { name, title, unit, of }
}

/// All scores, in the order of a table.
pub(super) const SCORES: [Score; 8] = [
    score("tracking_rms", "tracking, RMS", "rad", |scores| Some(scores.tracking_rms)),
    score("tracking_peak", "tracking, peak", "rad", |scores| Some(scores.tracking_peak)),
    score("reversal_peak", "reversal, peak", "rad", |scores| scores.reversal_peak),
    score("settling", "settling", "s", |scores| scores.settling),
    score("unsettled", "not settled", "1", |scores| scores.unsettled),
    score("hunting_amplitude", "hunting, amplitude", "rad", |scores| scores.hunting.map(|it| it.amplitude)),
    score("hunting_interval", "hunting, interval", "s", |scores| scores.hunting.map(|it| it.interval)),
    score("torque_noise", "torque noise", "N m", |scores| Some(scores.torque_noise)),
];

impl Score {
    /// Its value for a repetition; `None` if it is not defined for the motion.
    pub(super) fn value(&self, repetition: &Repetition) -> Option<f64> {
        (self.of)(&repetition.scores)
    }

    /// Mean over the repetitions that have it, and half of its 95 % interval for at least two.
    pub(super) fn over(&self, repetitions: &[Repetition]) -> Option<(f64, Option<f64>)> {
        let values: Vec<f64> = repetitions.iter().filter_map(|repetition| self.value(repetition)).collect();
        let all = (!values.is_empty()).then(|| mean(values.iter().copied()))?;
        let half = (values.len() > 1).then(|| {
            let [low, high] = bootstrap(values.len(), |drawn| mean(drawn.iter().map(|&k| values[k])));
            0.5 * (high - low)
        });
        Some((all, half))
    }
}
