//! Which preload of the friction wheel a desired friction needs, and why.

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

/// Preloads that differ by less tell no line.
const APART: f64 = 0.05;
/// A breakaway torque that is off by less than this share needs no other preload: linings scatter by more.
const NEAR: f64 = 0.02;
/// Curves that are looked at, the newest first.
const CURVES: usize = 12;

/// A preload that is advised.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AdvisedPreload {
    /// Whether the desired friction needs another preload than the one that is set.
    pub needed: bool,
    /// The one that it needs, 0 … 1; `null` where that is not known, or any will do.
    pub preload: Option<f64>,
    /// Whether somebody has to press the linings on by hand.
    pub by_hand: bool,
    /// Why, and what to do.
    pub sentence: String,
}

impl Live {
    /// The preload that a desired friction needs, with some values changed.
    pub(super) fn advise_preload(&self, values: BTreeMap<String, String>) -> Result<Answer, Error> {
        let Shared { parameters, motion, measurements, links, .. } = &*self.shared;
        let preset = parameters.tuning().preset_with(&values.into_iter().collect::<Vec<_>>())?;
        let advised = advised(&preset, motion.preload(), &measurements.pressed())?;
        Ok(Answer::AdvisedPreload(AdvisedPreload { by_hand: links.counts().is_some(), ..advised }))
    }
}

impl Measurements {
    /// Breakaway torques of the own friction, the newest first, each at another preload than the one before.
    fn pressed(&self) -> Vec<Pressed> {
        let own = self.curves().into_iter().filter(|name| !name.rendered).take(CURVES);
        let mut pressed: Vec<Pressed> = Vec::new();
        for name in own {
            let Ok(fits) = fit_file(&self.folder.join(&name.name), &CurveColumns::default(), false) else { continue };
            let (Some(preload), Some(fitted)) = (fits.preload, fits.fits.first()) else { continue };
            if pressed.iter().all(|known| (known.preload - preload).abs() > APART) {
                pressed.push(Pressed { preload, breakaway_torque: fitted.fit.parameters[0] });
            }
        }
        pressed
    }
}

/// The advice for parameters, with the linings as they are set, from what was measured at other preloads.
fn advised(preset: &Preset<f64>, set: f64, pressed: &[Pressed]) -> Result<AdvisedPreload, Error> {
    let Preset { model, bench, .. } = preset;
    let torque = |value: f64| tied(&Estimate::new(value, "N m"));
    let (desired, own) = (bench.desired.breakaway_torque, model.own.breakaway_torque);
    let lacking = desired - own;
    let [least, largest] = Region::of(model, bench, Passage::default())?.at(0.0).torque;
    let fade = faded_below(bench);
    let why = if fade > 0.0 {
        format!(
            "Below {} this law renders nothing: what is felt at rest is the own friction, and the friction wheel has to \
             bring it from {} to {}.",
            tied(&Estimate::new(fade, "rad/s")),
            torque(own),
            torque(desired)
        )
    } else if !(least..=largest).contains(&lacking) {
        format!(
            "At rest the load motor gives at most {}, and {} lack: the friction wheel has to bring the rest.",
            torque(largest),
            torque(lacking.abs())
        )
    } else {
        let sentence = "This law renders at rest as well: any preload will do that the own friction was measured at.";
        return Ok(AdvisedPreload { sentence: sentence.into(), ..AdvisedPreload::default() });
    };
    if lacking.abs() <= NEAR * desired {
        let sentence = format!("The breakaway torque at preload {set} is the desired one.");
        return Ok(AdvisedPreload { preload: Some(set), sentence, ..AdvisedPreload::default() });
    }
    let known = match pressed {
        [newest, other, ..] => advise_preload_from(desired, [*newest, *other]),
        _ => None,
    };
    let Some(PreloadAdvice { preload, wanted, breakaway_torque }) = known else {
        let other = if set > 0.5 { 0 } else { 1 };
        let sentence = format!(
            "{why} What the wheel adds is known from friction curves at two preloads: set {other}, measure the own \
             friction there, and the advice stands here."
        );
        return Ok(AdvisedPreload { needed: true, sentence, ..AdvisedPreload::default() });
    };
    // In steps that a hand can set.
    let preload = (100.0 * preload).round() / 100.0;
    let reach = if (0.0..=1.0).contains(&wanted) {
        format!("Preload {preload} brings it there.")
    } else {
        format!("The wheel cannot: preload {preload} comes nearest, with {}.", torque(breakaway_torque))
    };
    let then = "Then measure the own friction again: it is another one.";
    Ok(AdvisedPreload {
        needed: (preload - set).abs() > 0.005,
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
    fn a_law_that_fades_out_needs_the_wheel_and_two_curves_tell_how_far() {
        let faded = preset(LawChoice::Paper);
        let at = |preload, breakaway_torque| Pressed { preload, breakaway_torque };
        let unknown = advised(&faded, 1.0, &[at(1.0, 0.3)]).unwrap();
        assert!(unknown.needed && unknown.preload.is_none() && unknown.sentence.contains("set 0"), "{unknown:?}");
        let known = advised(&faded, 1.0, &[at(1.0, 0.3), at(0.0, 0.06)]).unwrap();
        assert!(known.needed && known.preload == Some(0.5) && known.sentence.contains("Preload 0.5"), "{known:?}");
        let beyond = advised(&faded, 1.0, &[at(1.0, 0.3), at(0.0, 0.2)]).unwrap();
        assert!(beyond.preload == Some(0.0) && beyond.sentence.contains("cannot"), "{beyond:?}");
    }

    #[test]
    fn a_law_that_renders_at_rest_needs_no_wheel_unless_the_motor_is_too_weak() {
        let enough = preset(LawChoice::Bristle);
        assert!(!advised(&enough, 1.0, &[]).unwrap().needed);
        let mut strong = enough;
        strong.bench.desired.breakaway_torque = 20.0;
        let weak = advised(&strong, 1.0, &[]).unwrap();
        assert!(weak.needed && weak.sentence.contains("at most"), "{weak:?}");
        let mut same = preset(LawChoice::Paper);
        same.bench.desired.breakaway_torque = 0.3;
        assert!(!advised(&same, 0.4, &[]).unwrap().needed);
    }
}
