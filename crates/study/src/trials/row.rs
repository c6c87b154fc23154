//! What can be tried, and the table of the trials.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ROW;
use super::score::SCORES;
use super::stored::TrialRun;
use crate::benchmark::{HOUSE, MANOEUVRES};
use stickslip_base::Preset;
use stickslip_base::parameters::{Value, flatten};
use stickslip_base::quantity::{Estimate, tied};
use stickslip_core::friction::Stribeck;
use stickslip_experiment::trial::{TrialMotion, travel};

/// The manoeuvres and controllers that can be tried, and the limits of motions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialChoices {
    /// The manoeuvres of the benchmark.
    pub manoeuvres: Vec<ManoeuvreForm>,
    /// The controllers of the benchmark.
    pub controllers: Vec<String>,
    /// The active controller with compensation and hold.
    pub active: String,
    /// The own friction of the axis.
    pub own: String,
    /// The desired friction.
    pub desired: String,
    /// Why the desired friction cannot be rendered; `null` if it can.
    pub not_rendered: Option<String>,
    /// Ends of the travel for motions [rad].
    pub travel: [f64; 2],
    /// Largest speed [rad/s].
    pub speed: f64,
}

/// A manoeuvre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ManoeuvreForm {
    /// Its name, for calls.
    pub name: String,
    /// Its title.
    pub title: String,
    /// Its duration [s].
    pub duration: f64,
    /// Smallest and largest position, from its start [rad].
    pub extent: [f64; 2],
    /// Whether it measures tracking and ranks the controllers.
    pub ranks: bool,
}

/// A trial in the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialRow {
    /// Number of the run.
    pub run: u64,
    /// Title of the motion.
    pub motion: String,
    /// The controller with compensation and hold.
    pub controller: String,
    /// The friction.
    pub friction: String,
    /// Number of completed repetitions.
    pub repetitions: u64,
    /// Whether all repetitions were completed.
    pub complete: bool,
    /// Its scores, the same ones for each trial.
    pub values: Vec<TrialValue>,
}

/// A score of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialValue {
    /// Its title.
    pub title: String,
    /// The unit of the numbers.
    pub unit: String,
    /// Mean over the repetitions; `null` if it is not defined for the motion.
    pub value: Option<f64>,
    /// Half of the 95 % interval of the mean; `null` for one repetition.
    pub half_width: Option<f64>,
}

/// The unit of a table and the factor to it.
pub(super) fn scaled(unit: &str) -> (&'static str, f64) {
    match unit {
        "rad" => ("mrad", 1e3),
        "N m" => ("mN·m", 1e3),
        "s" => ("ms", 1e3),
        _ => ("%", 100.0),
    }
}

impl TrialRow {
    /// The row of a finished trial.
    pub(super) fn of(run: u64, trial: &TrialRun) -> Self {
        let values = SCORES.iter().map(|score| {
            let (unit, factor) = scaled(score.unit);
            let over = score.over(&trial.trial.repetitions);
            TrialValue {
                title: score.title.into(),
                unit: unit.into(),
                value: over.map(|(value, _)| factor * value),
                half_width: over.and_then(|(_, half)| half).map(|half| factor * half),
            }
        });
        TrialRow {
            run,
            motion: trial.motion.title().into(),
            controller: trial.controller.clone(),
            friction: trial.friction.clone(),
            repetitions: trial.trial.repetitions.len() as u64,
            complete: trial.trial.complete,
            values: values.collect(),
        }
    }

    /// The row in the folder of a run; `None` if there is none or it is damaged.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        serde_json::from_str(&std::fs::read_to_string(folder.join(ROW)).ok()?).ok()
    }
}

/// The controller of a preset in words: its kind and its additions.
pub fn controller_words(preset: &Preset<f64>) -> String {
    let entries = flatten(preset);
    let choice = |path: &str| {
        let entry = entries.iter().find(|entry| entry.path == format!("bench.{path}.kind"))?;
        if let Value::Variant(name) = entry.value { (name != "nothing").then_some(name) } else { None }
    };
    ["controller", "compensation", "hold"].into_iter().filter_map(choice).collect::<Vec<_>>().join(" + ")
}

/// The own friction, or the desired one where it is rendered, and the same in words.
pub fn friction_of(preset: &Preset<f64>, render: bool) -> (Stribeck<f64>, String) {
    let (kind, curve) = if render { ("rendered", preset.bench.desired) } else { ("own", preset.model.own) };
    let torque = |value: f64| tied(&Estimate::new(value, "N m"));
    let [breakaway, kinetic] = [curve.breakaway_torque, curve.kinetic_torque].map(torque);
    (curve, format!("{kind}, {breakaway} breakaway, {kinetic} kinetic"))
}

impl TrialChoices {
    /// For these parameters, the active controller in words, and why the desired friction cannot be rendered.
    pub fn of(preset: &Preset<f64>, active: String, not_rendered: Option<String>) -> Self {
        // The extent does not depend on the rate.
        let mut coarse = *preset;
        coarse.bench.tick_rate = 500.0;
        let form = |manoeuvre| {
            let motion = TrialMotion::Manoeuvre(manoeuvre);
            let (extent, _) = motion.extent(&coarse, 0.5);
            let ranks = manoeuvre.measures().iter().any(|measure| measure.ranks);
            let duration = motion.duration(preset, 0.5);
            ManoeuvreForm { name: manoeuvre.name().into(), title: manoeuvre.title().into(), duration, extent, ranks }
        };
        TrialChoices {
            manoeuvres: MANOEUVRES.map(form).to_vec(),
            controllers: HOUSE.map(String::from).to_vec(),
            active,
            own: friction_of(preset, false).1,
            desired: friction_of(preset, true).1,
            not_rendered,
            travel: travel(&preset.bench),
            speed: preset.bench.safety.speed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::parameters::presets;
    use stickslip_base::preset::CompensationChoice;

    #[test]
    fn a_controller_is_named_by_its_kind_and_its_additions() {
        let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        assert_eq!(controller_words(&preset), "cascade");
        preset.bench.compensation = CompensationChoice::Feedforward(Default::default());
        assert_eq!(controller_words(&preset), "cascade + feedforward");
        let friction = friction_of(&preset, false).1;
        assert!(friction.starts_with("own, 0.3") && friction.contains("0.18"), "{friction}");
    }
}
