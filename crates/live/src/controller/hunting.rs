//! Whether a controller hunts, predicted.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::view::short;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_base::{Error, Preset, Watch};
use stickslip_design::{HuntingPlan, ModelledAxis};

/// Instants of the course that a picture shows, at most.
const INSTANTS: usize = 600;
/// Intervals from slip to slip that it shows.
const SHOWN: f64 = 6.0;
/// What it shows where there are none [s].
const REST: f64 = 2.0;

/// Whether a controller hunts at a set-point that rests: the numbers of `stickslip hunting`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HuntingView {
    /// Of the desired friction, which the load motor renders, instead of the machine's own.
    pub desired: bool,
    /// Whether it hunts.
    pub hunts: bool,
    /// Half the distance between the extremes [rad]; `null` where it comes to rest.
    pub amplitude: Option<f64>,
    /// The same in counts of the encoder.
    pub counts: Option<f64>,
    /// From one slip to the next [s].
    pub interval: Option<f64>,
    /// It in words.
    pub sentence: String,
    /// Instants of the course [s].
    pub time: Vec<f64>,
    /// Deviations from the set-point [mrad].
    pub deviation: Vec<f64>,
}

impl HuntingView {
    /// On the own friction of a preset's model, or on the one that it desires.
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
                "It hunts: ±{} about the set-point, {} counts, a slip every {}.",
                tied(&Estimate::new(it.amplitude, "rad")),
                stickslip_base::quantity::number(it.amplitude / count, 0),
                tied(&Estimate::new(it.interval, "s"))
            ),
            None => "It comes to rest, or moves too slowly to be seen.".into(),
        };
        // Of a limit cycle its last slips, of a course that ends its begin.
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
