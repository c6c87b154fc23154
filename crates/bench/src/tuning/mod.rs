//! The parameters of a bench that runs: sets that are proposed, checked as a whole, and enter at the begin of one cycle.
//!
//! [`Tuning`] holds the set in force as a file that people read, the reference that the run began with, and the way
//! back. A [`Proposal`] is what a change would make of it: values in their ranges, the laws between them, the observers
//! designed anew, the rendering law with its margin. It changes nothing; [`Tuning::entered`] says that the bench took it.

mod loaded;
mod sets;
#[cfg(test)]
mod tests;

use crate::BenchError;
use loaded::Chosen;
pub use loaded::Loaded;
pub use loaded::{is_of_it, selector};
pub use sets::Sets;

use stickslip_core::cycle::Parameters;
use stickslip_core::render::{Correction, Law};

use crate::external::{Role, role};
use stickslip_base::parameters::presets::Source;
use stickslip_base::parameters::{self, Difference, Entry};
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{ControllerChoice, Error, Preset};
use stickslip_design::fastest;
use stickslip_design::{self as design, Margin, Passage, Region};

/// What a bench that runs cannot change, and what to do instead.
const FIXED: [(&str, &str); 4] = [
    ("plant", "It is the machine itself: what is believed of it stands under `model`. Start the bench anew with it."),
    ("model.encoder", "The angle is counted by it since the start: start the bench anew with it."),
    ("bench.tick_rate", "Start the bench anew with it."),
    ("bench.plant_step", "Start the bench anew with it."),
];
/// Why a parameter cannot be changed while the bench runs, and what to do instead; none: it can.
pub fn fixed(path: &str) -> Option<&'static str> {
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
    /// What was loaded of a file beside what the preset has.
    loaded: Option<Loaded>,
}

/// A set in force.
#[derive(Clone, Debug)]
struct Set {
    source: Source,
    preset: Preset<f64>,
    law: Law<f64>,
    /// Of what was loaded, where something was.
    chosen: Option<Chosen>,
}

/// What a change would make of the set in force.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// What becomes another.
    pub differences: Vec<Difference>,
    /// How far the rendering law is from chatter, where it becomes another.
    pub margin: Option<Margin>,
    /// The numbers of what was loaded, where they become others.
    pub loaded: Option<Vec<f64>>,
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
        let law = stickslip_simulate::rendering_law(&preset.model, &preset.bench)?;
        let set = Set { source, preset, law, chosen: None };
        Ok(Tuning { reference: set.clone(), history: vec![set], now: 0, loaded: None })
    }

    /// Something was loaded, which acts unless what the preset has in its place was chosen before. What was loaded before
    /// in the same role goes: its numbers stay as far as this has such.
    ///
    /// # Errors
    /// [`BenchError::FollowsNoFriction`]; what the design of the rendering law refuses.
    pub fn bring(&mut self, loaded: Loaded) -> Result<(), Error> {
        for set in self.history.iter_mut().chain([&mut self.reference]) {
            let before = set.acting();
            set.chosen = Some(set.chosen.as_ref().map_or_else(|| loaded.begun(), |chosen| loaded.taken_over(chosen)));
            if set.acting() != before {
                set.law = role::law(set.acting(), &set.preset.model, &set.preset.bench)?;
            }
        }
        self.loaded = Some(loaded);
        Ok(())
    }

    /// All values in force, those of what was loaded behind those of the preset.
    pub fn entries(&self) -> Vec<Entry> {
        self.entries_of(self.in_force())
    }

    /// All values that the run began with.
    pub fn reference_entries(&self) -> Vec<Entry> {
        self.entries_of(&self.reference)
    }

    /// The numbers in force of what was loaded, in their order; none where nothing was.
    pub fn loaded_values(&self) -> Vec<f64> {
        let values = |(loaded, chosen): (&Loaded, &Chosen)| loaded.values(chosen);
        self.loaded.as_ref().zip(self.in_force().chosen.as_ref()).map_or(Vec::new(), values)
    }

    fn entries_of(&self, set: &Set) -> Vec<Entry> {
        let mut entries = parameters::flatten(&set.preset);
        entries.extend(self.loaded.iter().zip(&set.chosen).flat_map(|(loaded, chosen)| loaded.entries(chosen)));
        entries
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

    /// What was loaded and is in the loop.
    pub fn acting(&self) -> Option<Role> {
        self.in_force().acting()
    }

    /// The rendering law in force.
    pub fn law(&self) -> &Law<f64> {
        &self.in_force().law
    }

    /// Whether the set in force can be rendered: how far the law is from chatter, where it is one of the house.
    ///
    /// # Errors
    /// [`DesignError::NotRenderable`](stickslip_design::DesignError::NotRenderable), [`DesignError::Chatters`](stickslip_design::DesignError::Chatters); what the design functions refuse.
    pub fn renderable(&self) -> Result<Option<Margin>, Error> {
        let set = self.in_force();
        admit(set.acting(), &set.preset, &set.law)
    }

    /// What the rendering law would be with these values changed, and how far it would be from chatter.
    ///
    /// # Errors
    /// As [`set`](Self::set), but for the margin: that it has none is told beside the law.
    pub fn margin_with(&self, changes: &[(String, String)]) -> Result<(Law<f64>, Result<Margin, Error>), Error> {
        let Preset { model, bench, .. } = self.preset_with(changes)?;
        let law = stickslip_simulate::rendering_law(&model, &bench)?;
        Ok((law, design::margin(&law, &model, &bench)))
    }

    /// The parameters in force with these values.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`].
    pub fn preset_with(&self, changes: &[(String, String)]) -> Result<Preset<f64>, Error> {
        self.source_with(changes)?.read()
    }

    /// The file in force with these values, but for those of what was loaded.
    fn source_with(&self, changes: &[(String, String)]) -> Result<Source, Error> {
        let Source { file, text } = &self.in_force().source;
        let ours: Vec<_> = changes.iter().filter(|(path, _)| !self.is_loaded(path)).cloned().collect();
        let text = parameters::set_all::<Preset<f64>>(text, file, &ours)?;
        Ok(Source { file: file.clone(), text })
    }

    /// What is chosen of what was loaded, with these values.
    fn chosen_with(&self, changes: &[(String, String)]) -> Result<Option<Chosen>, Error> {
        let Some((loaded, chosen)) = self.loaded.as_ref().zip(self.in_force().chosen.as_ref()) else { return Ok(None) };
        let its = changes.iter().filter(|(path, _)| is_of_it(path));
        loaded.with(chosen, its.map(|(path, value)| (path.as_str(), value.as_str()))).map(Some)
    }

    fn is_loaded(&self, path: &str) -> bool {
        self.loaded.is_some() && is_of_it(path)
    }

    /// What would be another with these values.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`].
    pub fn preview(&self, changes: &[(String, String)]) -> Result<Vec<Difference>, Error> {
        let (preset, chosen) = (self.preset_with(changes)?, self.chosen_with(changes)?);
        Ok(parameters::differences(self.entries(), self.entries_of(&Set { preset, chosen, ..self.in_force().clone() })))
    }

    /// What is not as in the reference.
    pub fn differences(&self) -> Vec<Difference> {
        parameters::differences(self.reference_entries(), self.entries())
    }

    /// Whether there is something to undo, and something to redo.
    pub fn can_undo(&self) -> (bool, bool) {
        (self.now > 0, self.now + 1 < self.history.len())
    }

    /// These values changed, all of them together: dotted paths, values as in a file.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`] with all that would be wrong; [`BenchError::NotWhileRunning`];
    /// [`DesignError::NotRenderable`](stickslip_design::DesignError::NotRenderable), [`DesignError::Chatters`](stickslip_design::DesignError::Chatters) where the set in force can be rendered and this one could not, unless
    /// it puts the preset in the place of what was loaded, or the other way round; what the design functions refuse.
    pub fn set(&self, changes: &[(String, String)]) -> Result<Proposal, Error> {
        self.propose(self.source_with(changes)?, self.chosen_with(changes)?, None)
    }

    /// A whole set: of a file, or saved under a name.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn load(&self, source: Source) -> Result<Proposal, Error> {
        self.propose(source, self.in_force().chosen.clone(), None)
    }

    /// The reference again.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn reset(&self) -> Result<Proposal, Error> {
        self.propose(self.reference.source.clone(), self.reference.chosen.clone(), None)
    }

    /// The set before the last change.
    ///
    /// # Errors
    /// [`BenchError::NothingToUndo`]; as [`set`](Self::set).
    pub fn undo(&self) -> Result<Proposal, Error> {
        let place = self.now.checked_sub(1).ok_or(BenchError::NothingToUndo { what: "undo" })?;
        let Set { source, chosen, .. } = self.history[place].clone();
        self.propose(source, chosen, Some(place))
    }

    /// The set before the last undo.
    ///
    /// # Errors
    /// As [`undo`](Self::undo).
    pub fn redo(&self) -> Result<Proposal, Error> {
        let place = self.now + 1;
        let set = self.history.get(place).ok_or(BenchError::NothingToUndo { what: "redo" })?;
        self.propose(set.source.clone(), set.chosen.clone(), Some(place))
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

    fn propose(&self, source: Source, chosen: Option<Chosen>, place: Option<usize>) -> Result<Proposal, Error> {
        let preset: Preset<f64> = source.read()?;
        let before = self.in_force();
        let mut set = Set { source, preset, law: before.law, chosen };
        let differences = parameters::differences(self.entries(), self.entries_of(&set));
        for difference in &differences {
            if let Some(remedy) = fixed(&difference.path) {
                return Err(BenchError::NotWhileRunning { path: difference.path.clone(), remedy: remedy.into() }.into());
            }
        }
        let mut loaded = None;
        if let (Some(known), Some(was), Some(becomes)) = (&self.loaded, &before.chosen, &set.chosen) {
            known.fixed(was, becomes, &preset.bench)?;
            let values = known.values(becomes);
            loaded = (values != known.values(was)).then_some(values);
        }
        let acting = set.acting();
        let (law, margin) = if of_law(&preset) == of_law(&before.preset) && acting == before.acting() {
            (before.law, None)
        } else {
            let law = role::law(acting, &preset.model, &preset.bench)?;
            match admit(acting, &preset, &law) {
                Ok(margin) => (law, margin),
                // Nothing renders that could not before, or not in this place: there must be a way back.
                Err(_) if self.renderable().is_err() || acting != before.acting() => (law, None),
                Err(refusal) => return Err(refusal),
            }
        };
        set.law = law;
        Ok(Proposal { differences, margin, loaded, set, place })
    }
}

/// Whether a law can render what a preset desires. Of a friction or a law of a file nobody knows what it will ask for.
fn admit(acting: Option<Role>, preset: &Preset<f64>, law: &Law<f64>) -> Result<Option<Margin>, Error> {
    let (model, settings) = (&preset.model, &preset.bench);
    match acting {
        Some(Role::Law) => return Ok(None),
        Some(Role::Friction) => return design::margin(law, model, &role::without(Role::Friction, settings)).map(Some),
        Some(Role::Controller) | None => {}
    }
    let region = Region::of(model, settings, Passage::default())?;
    region.admit(&model.own, &settings.desired, fastest(&region))?;
    design::margin(law, model, settings).map(Some)
}

impl Set {
    /// What was loaded and is in the loop.
    fn acting(&self) -> Option<Role> {
        self.chosen.as_ref().and_then(Chosen::acting)
    }
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

    /// The settings of the bench: with nothing in the place of what was loaded and is in the loop.
    pub fn settings(&self) -> Settings<f64> {
        let bench = self.set.preset.bench;
        self.set.acting().map_or(bench, |role| role::without(role, &bench))
    }

    /// What the software would compute with; what is added to the law stays.
    ///
    /// # Errors
    /// What the design of observer and current control refuses.
    pub fn parameters(&self, correction: Correction<f64>) -> Result<Parameters<f64>, Error> {
        let (model, settings) = (&self.set.preset.model, self.settings());
        let mut parameters = design::parameters(model, &settings)?;
        parameters.tick.law = self.set.law;
        parameters.tick.current = design::load_current_control(&self.set.law, model, &settings)?;
        parameters.tick.correction = correction;
        Ok(parameters)
    }
}
