//! Parameters of a running bench: sets are proposed, checked as a whole, and become active at the start of one cycle.
//!
//! [`Tuning`] has the active set as a commented file, the reference from the start of the run, and the history. A
//! [`Proposal`] is the result of a change: checked values, redesigned observers, and the rendering law with its margin.
//! It changes nothing until [`Tuning::entered`] reports that the bench has accepted it.

mod loaded;
mod sets;
#[cfg(test)]
mod tests;

use crate::BenchError;
use loaded::Chosen;
pub use loaded::Loaded;
pub use loaded::{is_of_it, selector};
pub use sets::Sets;

use stickslip_core::render::{Correction, Law};
use stickslip_software::cycle::Parameters;

use crate::external::{Role, role};
use stickslip_base::parameters::presets::Source;
use stickslip_base::parameters::{self, Difference, Entry};
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{ControllerChoice, Error, Preset};
use stickslip_design::fastest;
use stickslip_design::{self as design, Margin, Passage, Region};

/// Parameters that cannot be changed on a running bench, with remedies.
const FIXED: [(&str, &str); 6] = [
    (
        "plant",
        "It is the machine itself; the controller's model is under `model`. Restart the bench with the new \
        value.",
    ),
    ("model.encoder", "The angle has been counted with it since the start. Restart the bench with the new value."),
    ("bench.tick_rate", "Restart the bench with the new value."),
    ("bench.plant_step", "Restart the bench with the new value."),
    ("bench.observer.kind", "The observer has been running since the start. Restart the bench with the new value."),
    ("bench.torque_amplifier", "It is a property of the machine. Restart the bench with the new value."),
];
/// Remedy for a parameter that cannot be changed while the bench runs; `None` if it can.
pub fn fixed(path: &str) -> Option<&'static str> {
    FIXED.iter().find(|(fixed, _)| parameters::within(path, fixed)).map(|(_, remedy)| *remedy)
}

/// Maximum number of undo steps.
const HISTORY: usize = 1000;

/// The parameter sets of a running bench.
#[derive(Clone, Debug)]
pub struct Tuning {
    /// Set at the start of the run.
    reference: Set,
    /// All sets so far, and the index of the active one.
    history: Vec<Set>,
    now: usize,
    /// Loaded controller, friction or law, if there is one.
    loaded: Option<Loaded>,
}

/// A parameter set.
#[derive(Clone, Debug)]
struct Set {
    source: Source,
    preset: Preset<f64>,
    law: Law<f64>,
    /// Selection and values of the loaded file, if there is one.
    chosen: Option<Chosen>,
}

/// Result of a change of the active set.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Changed values.
    pub differences: Vec<Difference>,
    /// Margin of the rendering law against chatter, if the law changes.
    pub margin: Option<Margin>,
    /// Values of the loaded file, if they change.
    pub loaded: Option<Vec<f64>>,
    set: Set,
    /// Index in the history; `None` for a new set.
    place: Option<usize>,
}

impl Tuning {
    /// For the initial set of a bench.
    ///
    /// # Errors
    /// [`Error::Parameters`]; errors of the design of the rendering law.
    pub fn new(source: Source) -> Result<Self, Error> {
        let preset: Preset<f64> = source.read()?;
        let law = stickslip_simulate::rendering_law(&preset.model, &preset.bench)?;
        let set = Set { source, preset, law, chosen: None };
        Ok(Tuning { reference: set.clone(), history: vec![set], now: 0, loaded: None })
    }

    /// Adds a loaded file, active unless the preset was selected before. It replaces a file loaded before in the same
    /// role and adopts its values as far as they exist.
    ///
    /// # Errors
    /// [`BenchError::FollowsNoFriction`]; errors of the design of the rendering law.
    pub fn bring(&mut self, loaded: Loaded) -> Result<(), Error> {
        for set in self.history.iter_mut().chain([&mut self.reference]) {
            let before = set.acting();
            set.chosen = Some(set.chosen.as_ref().map_or_else(|| loaded.initial(), |chosen| loaded.adopt(chosen)));
            if set.acting() != before {
                set.law = role::law(set.acting(), &set.preset.model, &set.preset.bench)?;
            }
        }
        self.loaded = Some(loaded);
        Ok(())
    }

    /// All active values: those of the preset, then those of the loaded file.
    pub fn entries(&self) -> Vec<Entry> {
        self.entries_of(self.active())
    }

    /// All values at the start of the run.
    pub fn reference_entries(&self) -> Vec<Entry> {
        self.entries_of(&self.reference)
    }

    /// Active values of the loaded file, in order; empty without a loaded file.
    pub fn loaded_values(&self) -> Vec<f64> {
        let values = |(loaded, chosen): (&Loaded, &Chosen)| loaded.values(chosen);
        self.loaded.as_ref().zip(self.active().chosen.as_ref()).map_or(Vec::new(), values)
    }

    fn entries_of(&self, set: &Set) -> Vec<Entry> {
        let mut entries = parameters::flatten(&set.preset);
        entries.extend(self.loaded.iter().zip(&set.chosen).flat_map(|(loaded, chosen)| loaded.entries(chosen)));
        entries
    }

    /// The active set.
    pub fn preset(&self) -> &Preset<f64> {
        &self.active().preset
    }

    /// The set at the start of the run.
    pub fn reference(&self) -> &Preset<f64> {
        &self.reference.preset
    }

    /// The active set as a file with comments.
    pub fn text(&self) -> &str {
        &self.active().source.text
    }

    /// Role of the loaded file if it is in the loop.
    pub fn acting(&self) -> Option<Role> {
        self.active().acting()
    }

    /// The active rendering law.
    pub fn law(&self) -> &Law<f64> {
        &self.active().law
    }

    /// Refuses an active controller that is unstable with the delays of the drives, unless it is loaded.
    ///
    /// # Errors
    /// As [`check_delays`](design::check_delays).
    pub fn check_loop(&self) -> Result<(), Error> {
        self.active().check_loop()
    }

    /// Checks that the active set can be rendered. Returns the margin against chatter for a built-in law.
    ///
    /// # Errors
    /// [`DesignError::NotRenderable`](stickslip_design::DesignError::NotRenderable),
    /// [`DesignError::Chatters`](stickslip_design::DesignError::Chatters); errors of the design functions.
    pub fn renderable(&self) -> Result<Option<Margin>, Error> {
        let set = self.active();
        admit(set.acting(), &set.preset, &set.law)
    }

    /// The rendering law with these changes, and its margin against chatter.
    ///
    /// # Errors
    /// As [`set`](Self::set); a missing margin is returned with the law.
    pub fn margin_with(&self, changes: &[(String, String)]) -> Result<(Law<f64>, Result<Margin, Error>), Error> {
        let Preset { model, bench, .. } = self.preset_with(changes)?;
        let law = stickslip_simulate::rendering_law(&model, &bench)?;
        Ok((law, design::margin(&law, &model, &bench)))
    }

    /// The active parameters with these changes.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`].
    pub fn preset_with(&self, changes: &[(String, String)]) -> Result<Preset<f64>, Error> {
        self.source_with(changes)?.read()
    }

    /// The active file with these changes, except those of the loaded file.
    fn source_with(&self, changes: &[(String, String)]) -> Result<Source, Error> {
        let Source { file, text } = &self.active().source;
        let ours: Vec<_> = changes.iter().filter(|(path, _)| !self.is_loaded(path)).cloned().collect();
        let text = parameters::set_all::<Preset<f64>>(text, file, &ours)?;
        Ok(Source { file: file.clone(), text })
    }

    /// Selection and values of the loaded file with these changes.
    fn chosen_with(&self, changes: &[(String, String)]) -> Result<Option<Chosen>, Error> {
        let Some((loaded, chosen)) = self.loaded.as_ref().zip(self.active().chosen.as_ref()) else { return Ok(None) };
        let own = changes.iter().filter(|(path, _)| is_of_it(path));
        loaded.with(chosen, own.map(|(path, value)| (path.as_str(), value.as_str()))).map(Some)
    }

    fn is_loaded(&self, path: &str) -> bool {
        self.loaded.is_some() && is_of_it(path)
    }

    /// Differences caused by these changes.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`].
    pub fn preview(&self, changes: &[(String, String)]) -> Result<Vec<Difference>, Error> {
        let (preset, chosen) = (self.preset_with(changes)?, self.chosen_with(changes)?);
        Ok(parameters::differences(self.entries(), self.entries_of(&Set { preset, chosen, ..self.active().clone() })))
    }

    /// Differences from the reference.
    pub fn differences(&self) -> Vec<Difference> {
        parameters::differences(self.reference_entries(), self.entries())
    }

    /// Whether undo and redo are possible.
    pub fn can_undo(&self) -> (bool, bool) {
        (self.now > 0, self.now + 1 < self.history.len())
    }

    /// Changes several values together: dotted paths, values as in a file.
    ///
    /// # Errors
    /// [`Error::UnknownParameter`]; [`Error::Parameters`] with all problems; [`BenchError::NotWhileRunning`];
    /// [`DesignError::NotRenderable`](stickslip_design::DesignError::NotRenderable),
    /// [`DesignError::Chatters`](stickslip_design::DesignError::Chatters) if the active set can be rendered and the new
    /// one cannot, unless it switches between preset and loaded file; errors of the design functions.
    pub fn set(&self, changes: &[(String, String)]) -> Result<Proposal, Error> {
        self.propose(self.source_with(changes)?, self.chosen_with(changes)?, None)
    }

    /// Loads a whole set from a file or a named set.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn load(&self, source: Source) -> Result<Proposal, Error> {
        self.propose(source, self.active().chosen.clone(), None)
    }

    /// Loads a whole set, and values of the loaded file by path.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn restore(&self, source: Source, external: &[(String, String)]) -> Result<Proposal, Error> {
        self.propose(source, self.chosen_with(external)?, None)
    }

    /// Restores the reference.
    ///
    /// # Errors
    /// As [`set`](Self::set).
    pub fn reset(&self) -> Result<Proposal, Error> {
        self.propose(self.reference.source.clone(), self.reference.chosen.clone(), None)
    }

    /// Undoes the last change.
    ///
    /// # Errors
    /// [`BenchError::NothingToUndo`]; as [`set`](Self::set).
    pub fn undo(&self) -> Result<Proposal, Error> {
        let place = self.now.checked_sub(1).ok_or(BenchError::NothingToUndo { what: "undo" })?;
        let Set { source, chosen, .. } = self.history[place].clone();
        self.propose(source, chosen, Some(place))
    }

    /// Redoes the last undone change.
    ///
    /// # Errors
    /// As [`undo`](Self::undo).
    pub fn redo(&self) -> Result<Proposal, Error> {
        let place = self.now + 1;
        let set = self.history.get(place).ok_or(BenchError::NothingToUndo { what: "redo" })?;
        self.propose(set.source.clone(), set.chosen.clone(), Some(place))
    }

    /// Reports that the bench has accepted a proposal.
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

    fn active(&self) -> &Set {
        &self.history[self.now]
    }

    fn propose(&self, source: Source, chosen: Option<Chosen>, place: Option<usize>) -> Result<Proposal, Error> {
        let preset: Preset<f64> = source.read()?;
        let before = self.active();
        let mut set = Set { source, preset, law: before.law, chosen };
        let differences = parameters::differences(self.entries(), self.entries_of(&set));
        for difference in &differences {
            if let Some(remedy) = fixed(&difference.path) {
                return Err(BenchError::NotWhileRunning { path: difference.path.clone(), remedy: remedy.into() }.into());
            }
        }
        let mut loaded = None;
        if let (Some(loaded_file), Some(old), Some(new)) = (&self.loaded, &before.chosen, &set.chosen) {
            loaded_file.fixed(old, new, &preset.bench)?;
            let values = loaded_file.values(new);
            loaded = (values != loaded_file.values(old)).then_some(values);
        }
        let acting = set.acting();
        let (law, margin) = if of_law(&preset) == of_law(&before.preset) && acting == before.acting() {
            (before.law, None)
        } else {
            let law = role::law(acting, &preset.model, &preset.bench)?;
            match admit(acting, &preset, &law) {
                Ok(margin) => (law, margin),
                // Permitted if the active set cannot be rendered either, or after a switch of the loaded file, so that
                // a way back exists.
                Err(_) if self.renderable().is_err() || acting != before.acting() => (law, None),
                Err(refusal) => return Err(refusal),
            }
        };
        set.law = law;
        // Permitted from an unstable loop, so that a way back exists.
        set.check_loop().or_else(|refusal| before.check_loop().map_or(Ok(()), |()| Err(refusal)))?;
        Ok(Proposal { differences, margin, loaded, set, place })
    }
}

/// Checks that a law can render the desired friction of a preset. The torque of a loaded friction or law is unknown.
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
    /// Role of the loaded file if it is in the loop.
    fn acting(&self) -> Option<Role> {
        self.chosen.as_ref().and_then(Chosen::acting)
    }

    /// Refuses a controller that is unstable with the delays of the drives. A loaded controller cannot be checked.
    fn check_loop(&self) -> Result<(), Error> {
        if self.acting() == Some(Role::Controller) {
            return Ok(());
        }
        design::check_delays(&self.preset.model, &self.preset.bench)
    }
}

/// All parameters that determine a rendering law.
fn of_law(preset: &Preset<f64>) -> (Model<f64>, Settings<f64>) {
    let Settings { safety, homing, .. } = Settings::default();
    (preset.model, Settings { controller: ControllerChoice::default(), safety, homing, ..preset.bench })
}

impl Proposal {
    /// The proposed set.
    pub fn preset(&self) -> &Preset<f64> {
        &self.set.preset
    }

    /// Settings of the bench, with the substitute for a loaded file in the loop.
    pub fn settings(&self) -> Settings<f64> {
        let bench = self.set.preset.bench;
        self.set.acting().map_or(bench, |role| role::without(role, &bench))
    }

    /// Parameters of the software; the correction of the law is preserved.
    ///
    /// # Errors
    /// Errors of the design of observer and current control.
    pub fn parameters(&self, correction: Correction<f64>) -> Result<Parameters<f64>, Error> {
        let (model, settings) = (&self.set.preset.model, self.settings());
        let mut parameters = design::parameters(model, &settings)?;
        parameters.tick.law = self.set.law;
        parameters.tick.current = design::load_current_control(&self.set.law, model, &settings)?;
        parameters.tick.correction = correction;
        Ok(parameters)
    }
}
