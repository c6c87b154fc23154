//! Preload of the friction wheel that a desired friction requires, with the reason.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measurements::Measurements;
use super::protocol::Answer;
use super::{Live, Shared};
use stickslip_base::quantity::{Estimate, tied};
use stickslip_base::{Error, Preset};
use stickslip_design::{Passage, Region};
use stickslip_experiment::workflow::fit::fit_file;
use stickslip_experiment::workflow::render::faded_below;
use stickslip_experiment::{PreloadAdvice, Pressed, advise_preload_from};
use stickslip_identify::curve_file::CurveColumns;

/// Smallest difference of two preloads that determines a line.
const DISTANCE: f64 = 0.05;
/// Tolerance of the breakaway torque, as a share: linings scatter by more.
const TOLERANCE: f64 = 0.02;
/// Maximum number of evaluated curves, the newest first.
const CURVES: usize = 12;

/// Advice on the preload of the friction wheel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AdvisedPreload {
    /// Whether the desired friction requires another preload than the present one.
    pub needed: bool,
    /// The required preload, 0 … 1; `null` if unknown, or if any is suitable.
    pub preload: Option<f64>,
    /// Whether the preload must be set by hand.
    pub by_hand: bool,
    /// Reason and action.
    pub sentence: String,
}

impl Live {
    /// The preload that the desired friction requires, with some values changed.
    pub(super) fn advise_preload(&self, values: BTreeMap<String, String>) -> Result<Answer, Error> {
        let Shared { parameters, motion, measurements, links, .. } = &*self.shared;
        let preset = parameters.tuning().preset_with(&values.into_iter().collect::<Vec<_>>())?;
        let advice = advice(&preset, motion.preload(), &measurements.pressed())?;
        Ok(Answer::AdvisedPreload(AdvisedPreload { by_hand: links.counts().is_some(), ..advice }))
    }
}

impl Measurements {
    /// Breakaway torques of the own friction at different preloads, the newest first.
    fn pressed(&self) -> Vec<Pressed> {
        let own = self.curves().into_iter().filter(|name| !name.rendered).take(CURVES);
        let mut pressed: Vec<Pressed> = Vec::new();
        for name in own {
            let Ok(fits) = fit_file(&self.folder.join(&name.name), &CurveColumns::default(), false) else { continue };
            let (Some(preload), Some(fitted)) = (fits.preload, fits.fits.first()) else { continue };
            if pressed.iter().all(|other| (other.preload - preload).abs() > DISTANCE) {
                pressed.push(Pressed { preload, breakaway_torque: fitted.fit.parameters[0] });
            }
        }
        pressed
    }
}

/// The advice for parameters at the present preload, from breakaway torques measured at different preloads.
fn advice(preset: &Preset<f64>, present: f64, pressed: &[Pressed]) -> Result<AdvisedPreload, Error> {
    let Preset { model, bench, .. } = preset;
    let torque = |value: f64| tied(&Estimate::new(value, "N m"));
    let (desired, own) = (bench.desired.breakaway_torque, model.own.breakaway_torque);
    let lacking = desired - own;
    let [least, largest] = Region::of(model, bench, Passage::default())?.at(0.0).torque;
    let fade = faded_below(bench);
    let why = if fade > 0.0 {
        format!(
            "Below {} this law renders nothing: the axis has its own friction at rest. The friction wheel must change its \
             breakaway torque from {} to {}.",
            tied(&Estimate::new(fade, "rad/s")),
            torque(own),
            torque(desired)
        )
    } else if !(least..=largest).contains(&lacking) {
        format!(
            "At rest the load motor provides at most {}, but {} are required: the friction wheel must provide the rest.",
            torque(largest),
            torque(lacking.abs())
        )
    } else {
        let sentence = "This law also renders at rest: any preload at which the own friction was measured is suitable.";
        return Ok(AdvisedPreload { sentence: sentence.into(), ..AdvisedPreload::default() });
    };
    if lacking.abs() <= TOLERANCE * desired {
        let sentence = format!("The breakaway torque at preload {present} is the desired one.");
        return Ok(AdvisedPreload { preload: Some(present), sentence, ..AdvisedPreload::default() });
    }
    let line = match pressed {
        [newest, other, ..] => advise_preload_from(desired, [*newest, *other]),
        _ => None,
    };
    let Some(PreloadAdvice { preload, wanted, breakaway_torque }) = line else {
        let other = if present > 0.5 { 0 } else { 1 };
        let sentence = format!(
            "{why} The required preload follows from friction curves at two preloads: set {other} and measure the own \
             friction there."
        );
        return Ok(AdvisedPreload { needed: true, sentence, ..AdvisedPreload::default() });
    };
    // In steps that can be set by hand.
    let preload = (100.0 * preload).round() / 100.0;
    let reach = if (0.0..=1.0).contains(&wanted) {
        format!("Set preload {preload}.")
    } else {
        format!("The wheel cannot reach it: preload {preload} is nearest, with {}.", torque(breakaway_torque))
    };
    let then = "Then measure the own friction again: it has changed.";
    Ok(AdvisedPreload {
        needed: (preload - present).abs() > 0.005,
        preload: Some(preload),
        by_hand: false,
        sentence: format!("{why} {reach} {then}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::preset::LawChoice;

    fn preset(law: LawChoice<f64>) -> Preset<f64> {
        let mut preset = Preset::<f64>::default();
        preset.bench.law = law;
        preset.bench.desired.breakaway_torque = 0.18;
        preset.model.own.breakaway_torque = 0.3;
        preset
    }

    #[test]
    fn a_law_that_fades_out_needs_the_wheel_and_two_curves_determine_the_preload() {
        let faded = preset(LawChoice::Paper);
        let at = |preload, breakaway_torque| Pressed { preload, breakaway_torque };
        let unknown = advice(&faded, 1.0, &[at(1.0, 0.3)]).unwrap();
        assert!(unknown.needed && unknown.preload.is_none() && unknown.sentence.contains("set 0"), "{unknown:?}");
        let within = advice(&faded, 1.0, &[at(1.0, 0.3), at(0.0, 0.06)]).unwrap();
        assert!(within.needed && within.preload == Some(0.5) && within.sentence.contains("preload 0.5"), "{within:?}");
        let beyond = advice(&faded, 1.0, &[at(1.0, 0.3), at(0.0, 0.2)]).unwrap();
        assert!(beyond.preload == Some(0.0) && beyond.sentence.contains("cannot"), "{beyond:?}");
    }

    #[test]
    fn a_law_that_renders_at_rest_needs_no_wheel_unless_the_motor_is_too_weak() {
        let enough = preset(LawChoice::Bristle);
        assert!(!advice(&enough, 1.0, &[]).unwrap().needed);
        let mut strong = enough;
        strong.bench.desired.breakaway_torque = 20.0;
        let weak = advice(&strong, 1.0, &[]).unwrap();
        assert!(weak.needed && weak.sentence.contains("at most"), "{weak:?}");
        let mut same = preset(LawChoice::Paper);
        same.bench.desired.breakaway_torque = 0.3;
        assert!(!advice(&same, 0.4, &[]).unwrap().needed);
    }
}
