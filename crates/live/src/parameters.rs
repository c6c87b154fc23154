//! The parameters of the bench: the preset, saved sets, the history of changes, and the loaded file.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, MutexGuard};

use super::loaded::{LoadedFile, OpenFile};
use super::lock;
use super::protocol::{Answer, Changed, ChatterMargin, Item, Machine, PlanForm, Quantity};
use stickslip_base::parameters::flatten;
use stickslip_base::parameters::presets::Source;
use stickslip_base::{Error, Preset};
use stickslip_bench::tuning::{Proposal, Sets, Tuning, is_of_it};

/// The parameters.
pub(super) struct Parameters {
    /// Name of the preset's file.
    file: String,
    sets: Sets,
    tuning: Mutex<Tuning>,
    pub(super) loaded: LoadedFile,
    /// Held during a change: changes enter one after the other.
    changing: Mutex<()>,
}

impl Parameters {
    pub(super) fn new(file: String, sets: &Path, tuning: Tuning, loaded: Option<OpenFile>) -> Self {
        let (sets, tuning, loaded) = (Sets::new(sets), Mutex::new(tuning), LoadedFile::new(loaded));
        Parameters { file, sets, tuning, loaded, changing: Mutex::default() }
    }

    /// Name of the preset's file.
    pub(super) fn file(&self) -> String {
        self.file.clone()
    }

    /// Reads the active parameters and their history; only briefly, as readers wait for each other.
    pub(super) fn read<R>(&self, read: impl FnOnce(&Tuning) -> R) -> R {
        read(&lock(&self.tuning))
    }

    /// A copy, for designs that take long.
    pub(super) fn tuning(&self) -> Tuning {
        self.read(Tuning::clone)
    }

    /// The active parameters.
    pub(super) fn preset(&self) -> Preset<f64> {
        self.read(|tuning| *tuning.preset())
    }

    /// Tick rate [Hz].
    pub(super) fn rate(&self) -> f64 {
        self.read(|tuning| tuning.preset().bench.tick_rate)
    }

    /// No other change begins while this is held.
    pub(super) fn changing(&self) -> MutexGuard<'_, ()> {
        lock(&self.changing)
    }

    /// Notes that a proposal is active on the bench.
    pub(super) fn entered(&self, proposal: Proposal) {
        lock(&self.tuning).entered(proposal);
    }

    /// Notes that another file is in the loop, with its values.
    pub(super) fn replace_loaded(&self, loaded: OpenFile, tuning: Tuning) {
        self.loaded.replace(loaded);
        *lock(&self.tuning) = tuning;
    }

    pub(super) fn text(&self) -> Answer {
        Answer::Text { text: self.read(|tuning| tuning.text().to_owned()) }
    }

    pub(super) fn differences(&self) -> Answer {
        Answer::Differences { differences: Changed::all(&self.read(Tuning::differences)) }
    }

    pub(super) fn items(&self, values: BTreeMap<String, String>) -> Result<Answer, Error> {
        let tuning = self.tuning();
        let mut entries = tuning.entries();
        if !values.is_empty() {
            let preset = tuning.preset_with(&values.into_iter().collect::<Vec<_>>())?;
            // Those of a loaded file are not part of the preset.
            entries.retain(|entry| is_of_it(&entry.path));
            entries.splice(..0, flatten(&preset));
        }
        Ok(Answer::Items { items: Item::list(entries) })
    }

    /// The machine, with its preload.
    pub(super) fn machine(&self, preload: f64) -> Answer {
        Answer::Machine(Box::new(Machine::of(&self.preset(), preload)))
    }

    /// The differences that some values would make.
    pub(super) fn preview(&self, values: BTreeMap<String, String>) -> Result<Answer, Error> {
        let differences = self.tuning().preview(&values.into_iter().collect::<Vec<_>>())?;
        Ok(Answer::Differences { differences: Changed::all(&differences) })
    }

    /// Margin of the rendering law against chatter with some values.
    pub(super) fn margin(&self, values: BTreeMap<String, String>) -> Result<Answer, Error> {
        let (law, margin) = self.tuning().margin_with(&values.into_iter().collect::<Vec<_>>())?;
        Ok(Answer::Margin(ChatterMargin::of(&law, margin)?))
    }

    /// The plan of a measurement, with some of its values.
    pub(super) fn plan(
        &self,
        what: Quantity,
        thorough: bool,
        values: &BTreeMap<String, String>,
    ) -> Result<Answer, Error> {
        Ok(Answer::Plan(Box::new(PlanForm::of(what, thorough, values, &self.preset())?)))
    }

    /// Saves the active parameters under a name.
    pub(super) fn save(&self, name: &str) -> Result<Answer, Error> {
        let text = self.read(|tuning| tuning.text().to_owned());
        self.sets.save(name, &text).map(|()| Answer::Done {})
    }

    /// The names of saved sets.
    pub(super) fn names(&self) -> Answer {
        Answer::Names { names: self.sets.names() }
    }

    /// The differences that a saved set would make.
    pub(super) fn preview_set(&self, name: &str) -> Result<Answer, Error> {
        let proposal = self.tuning().load(self.saved(name)?)?;
        Ok(Answer::Differences { differences: Changed::all(&proposal.differences) })
    }

    /// A saved set.
    pub(super) fn saved(&self, name: &str) -> Result<Source, Error> {
        self.sets.find(name)
    }
}
