//! Prediction of hunting.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::view::short;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_base::{Error, Preset, Watch};
use stickslip_design::{HuntingPlan, ModelledAxis};

/// Maximum number of instants in a picture.
const INSTANTS: usize = 600;
/// Shown number of intervals between slips.
const SHOWN: f64 = 6.0;
/// Shown time without hunting [s].
const REST: f64 = 2.0;

/// Prediction of hunting at a constant set-point: the numbers of `stickslip hunting`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HuntingView {
    /// Whether it uses the desired friction, which the load motor renders, instead of the machine's own.
    pub desired: bool,
    /// Whether hunting is predicted.
    pub hunts: bool,
    /// Half the distance between the extremes [rad]; `null` without hunting.
    pub amplitude: Option<f64>,
    /// The amplitude in encoder counts.
    pub counts: Option<f64>,
    /// Time from one slip to the next [s].
    pub interval: Option<f64>,
    /// The prediction in a sentence.
    pub sentence: String,
    /// Instants [s].
    pub time: Vec<f64>,
    /// Deviations from the set-point [mrad].
    pub deviation: Vec<f64>,
}

impl HuntingView {
    /// With the own friction of a preset's model, or with its desired friction.
    pub(super) fn of(preset: &Preset<f64>, desired: bool) -> Result<Self, Error> {
        let mut model = preset.model;
        if desired {
            (model.own, model.own_bristles) = (preset.bench.desired, preset.bench.desired_bristles);
        }
        let plan = HuntingPlan::default();
        let axis = ModelledAxis::new(&model, &preset.bench)?;
        let count = TAU / model.encoder.counts_per_revolution;
        let (hunting, deviations) = axis.follow(&plan, count, &Watch::silent())?;
        let hunting = hunting.filter(|it| it.amplitude.is_finite() && it.interval.is_finite());
        let sentence = match &hunting {
            Some(it) => format!(
                "Hunting predicted: ±{} about the set-point, {} counts, one slip every {}.",
                tied(&Estimate::new(it.amplitude, "rad")),
                stickslip_base::quantity::number(it.amplitude / count, 0),
                tied(&Estimate::new(it.interval, "s"))
            ),
            None => "No hunting predicted.".into(),
        };
        // A limit cycle is shown by its last slips, any other course by its start.
        let period = axis.period();
        let (from, span) = match &hunting {
            Some(it) => (plan.duration - (SHOWN * it.interval).min(plan.duration), SHOWN * it.interval),
            None => (0.0, REST),
        };
        let index = |time: f64| ((time / period) as usize).min(deviations.len());
        let part = &deviations[index(from)..index(from + span)];
        let every = part.len().div_ceil(INSTANTS).max(1);
        let course = part.iter().enumerate().step_by(every).filter(|(_, deviation)| deviation.is_finite());
        let (time, deviation) = course.map(|(k, deviation)| (short(k as f64 * period), short(1e3 * deviation))).unzip();
        Ok(HuntingView {
            desired,
            hunts: hunting.is_some(),
            amplitude: hunting.map(|it| it.amplitude),
            counts: hunting.map(|it| it.amplitude / count),
            interval: hunting.map(|it| it.interval),
            sentence,
            time,
            deviation,
        })
    }
}
