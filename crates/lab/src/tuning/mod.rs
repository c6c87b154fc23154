//! The parameters of a bench that runs: sets that are proposed, checked as a whole, and enter at the begin of one cycle.
//!
//! [`Tuning`] holds the set in force as a file that people read, the reference that the run began with, and the way
//! back. A [`Proposal`] is what a change would make of it: values in their ranges, the laws between them, the observers
//! designed anew, the rendering law with its margin. It changes nothing; [`Tuning::entered`] says that the bench took it.

mod sets;
#[cfg(test)]
mod tests;

pub use sets::Sets;

use stickslip_core::cycle::Parameters;
use stickslip_core::render::{Correction, Law};

use crate::design::{self, Margin, Passage, Region};
use crate::parameters::presets::Source;
use crate::parameters::{self, Difference};
use crate::preset::{Model, Settings};
use crate::workflow::design::fastest;
use crate::{ControllerChoice, Error, Preset};

/// What a bench that runs cannot change, and what to do instead.
const FIXED: [(&str, &str); 4] = [
    ("plant", "It is the machine itself: what is believed of it stands under `model`. Start the bench anew with it."),
    ("model.encoder", "The angle is counted by it since the start: start the bench anew with it."),
    ("bench.tick_rate", "Start the bench anew with it."),
    ("bench.plant_step", "Start the bench anew with it."),
];
/// Why a parameter cannot be changed while the bench runs, and what to do instead; none: it can.
pub(crate) fn fixed(path: &str) -> Option<&'static str> {
    FIXED.iter().find(|(fixed, _)| parameters::within(path, fixed)).map(|(_, remedy)| *remedy)
}

/// Steps back that are kept.
const HISTORY: usize = 1000;

/// The parameter sets of a bench that runs.
#[derive(Clone, Debug)]
pub struct Tuning {
    /// As it was when the run began.
    reference: Set,
    /// Every set that was in force, and which of them is.
    history: Vec<Set>,
    now: usize,
}

/// A set in force.
#[derive(Clone, Debug)]
struct Set {
    source: Source,
    preset: Preset<f64>,
    law: Law<f64>,
}

/// What a change would make of the set in force.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// What becomes another.
    pub differences: Vec<Difference>,
    /// How far the rendering law is from chatter, where it becomes another.
    pub margin: Option<Margin>,
    set: Set,
    /// Where it stands in the history; none: behind all.
    place: Option<usize>,
}

impl Tuning {
    /// For the set that a bench begins with.
    ///
    /// # Errors
    /// [`Error::Parameters`]; what the design of the rendering law refuses.
    pub fn new(source: Source) -> Result<Self, Error> {
        let preset: Preset<f64> = source.read()?;
        let law = design::rendering_law(&preset.model, &preset.bench)?;
        let set = Set { source, preset, law };
        Ok(Tuning { reference: set.clone(), history: vec![set], now: 0 })
    }

    /// The set in force.
    pub fn preset(&self) -> &Preset<f64> {
        &self.in_force().preset
    }

    /// The set that the run began with.
    pub fn reference(&self) -> &Preset<f64> {
        &self.reference.preset
    }

    /// The set in force as a file, with its comments.
    pub fn text(&self) -> &str {
        &self.in_force().source.text
    }

    /// The rendering law in force.
    pub fn law(&self) -> &Law<f64> {
        &self.in_force().law
    }

    /// Whether the set in force can be rendered: how far the law is from chatter.
    ///
    /// # Errors
    /// [`Error::NotRenderable`], [`Error::Chatters`]; what the design functions refuse.
    pub fn renderable(&self) -> Result<Margin, Error> {
        let Set { preset, law, .. } = self.in_force();
        admit(preset, law)
    }

    /// What the rendering law would be with these values changed, and how far it would be from chatter.
    ///
    /// # Errors
    /// As [`set`](Self::set), but for the margin: that it has none is told beside the law.
    pub fn margin_with(&self, changes: &[(String, String)]) -> Result<(Law<f64>, Result<Margin, Error>), Error> {
        let Preset { model, bench, .. } = self.preset_with(changes)?;
        let law = design::rendering_law(&model, &bench)?;
        Ok((law, design::margin(&law, &model, &bench)))
    }

    /// The parameters in force with these values.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`].
    pub fn preset_with(&self, changes: &[(String, String)]) -> Result<Preset<f64>, Error> {
        let Source { file, text } = &self.in_force().source;
        let text = parameters::set_all::<Preset<f64>>(text, file, changes)?;
        Ok(parameters::read::<Preset<f64>>(&text, file)?)
    }

    /// What would be another with these values.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`].
    pub fn preview(&self, changes: &[(String, String)]) -> Result<Vec<Difference>, Error> {
        Ok(parameters::diff(self.preset(), &self.preset_with(changes)?))
    }

    /// What is not as in the reference.
    pub fn differences(&self) -> Vec<Difference> {
        parameters::diff(&self.reference.preset, self.preset())
    }

    /// Whether there is something to undo, and something to redo.
    pub fn can_undo(&self) -> (bool, bool) {
        (self.now > 0, self.now + 1 < self.history.len())
    }

    /// These values changed, all of them together: dotted paths, values as in a file.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`] with all that would be wrong; [`Error::NotWhileRunning`];
    /// [`Error::NotRenderable`], [`Error::Chatters`] where the set in force can be rendered and this one could not; what
    /// the design functions refuse.
    pub fn set(&self, changes: &[(String, String)]) -> Result<Proposal, Error> {
        let Source { file, text } = &self.in_force().source;
        let text = parameters::set_all::<Preset<f64>>(text, file, changes)?;
        self.propose(Source { file: file.clone(), text }, None)
    }

    /// A whole set: of a file, or saved under a name.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn load(&self, source: Source) -> Result<Proposal, Error> {
        self.propose(source, None)
    }

    /// The reference again.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn reset(&self) -> Result<Proposal, Error> {
        self.propose(self.reference.source.clone(), None)
    }

    /// The set before the last change.
    ///
    /// # Errors
    /// [`Error::NothingToUndo`]; as [`set`](Self::set).
    pub fn undo(&self) -> Result<Proposal, Error> {
        let place = self.now.checked_sub(1).ok_or(Error::NothingToUndo { what: "undo" })?;
        self.propose(self.history[place].source.clone(), Some(place))
    }

    /// The set before the last undo.
    ///
    /// # Errors
    /// As [`undo`](Self::undo).
    pub fn redo(&self) -> Result<Proposal, Error> {
        let place = self.now + 1;
        let set = self.history.get(place).ok_or(Error::NothingToUndo { what: "redo" })?;
        self.propose(set.source.clone(), Some(place))
    }

    /// The bench took a proposal.
    pub fn entered(&mut self, proposal: Proposal) {
        match proposal.place {
            Some(place) => self.now = place,
            None if proposal.differences.is_empty() && proposal.set.source.text == self.text() => {}
            None => {
                self.history.truncate(self.now + 1);
                self.history.push(proposal.set);
                let beyond = self.history.len().saturating_sub(HISTORY);
                self.history.drain(..beyond);
                self.now = self.history.len() - 1;
            }
        }
    }

    fn in_force(&self) -> &Set {
        &self.history[self.now]
    }

    fn propose(&self, source: Source, place: Option<usize>) -> Result<Proposal, Error> {
        let preset: Preset<f64> = source.read()?;
        let differences = parameters::diff(self.preset(), &preset);
        for difference in &differences {
            if let Some(remedy) = fixed(&difference.path) {
                return Err(Error::NotWhileRunning { path: difference.path.clone(), remedy });
            }
        }
        let before = self.in_force();
        let (law, margin) = if of_law(&preset) == of_law(&before.preset) {
            (before.law, None)
        } else {
            let law = design::rendering_law(&preset.model, &preset.bench)?;
            match admit(&preset, &law) {
                Ok(margin) => (law, Some(margin)),
                // Nothing renders that could not before: there must be a way back.
                Err(_) if self.renderable().is_err() => (law, None),
                Err(refusal) => return Err(refusal),
            }
        };
        Ok(Proposal { differences, margin, set: Set { source, preset, law }, place })
    }
}

/// Whether a law can render what a preset desires.
fn admit(preset: &Preset<f64>, law: &Law<f64>) -> Result<Margin, Error> {
    let (model, settings) = (&preset.model, &preset.bench);
    let region = Region::of(model, settings, Passage::default())?;
    region.admit(&model.own, &settings.desired, fastest(&region))?;
    design::margin(law, model, settings)
}

/// All that a rendering law follows from.
fn of_law(preset: &Preset<f64>) -> (Model<f64>, Settings<f64>) {
    let Settings { safety, homing, .. } = Settings::default();
    (preset.model, Settings { controller: ControllerChoice::default(), safety, homing, ..preset.bench })
}

impl Proposal {
    /// The set.
    pub fn preset(&self) -> &Preset<f64> {
        &self.set.preset
    }

    /// What the software would compute with; what is added to the law stays.
    ///
    /// # Errors
    /// What the design of observer and current control refuses.
    pub fn parameters(&self, correction: Correction<f64>) -> Result<Parameters<f64>, Error> {
        let Preset { model, bench, .. } = &self.set.preset;
        let mut parameters = design::parameters(model, bench)?;
        parameters.tick.law = self.set.law;
        parameters.tick.current = design::load_current_control(&self.set.law, model, bench)?;
        parameters.tick.correction = correction;
        Ok(parameters)
    }
}
