//! State of the target in the project: active parameters, values of an external file, preload, and the layout of the
//! scope.
//!
//! It is written after each change. After a start the bench has the preset; a stored state that differs is offered, and
//! becomes active only by [`Call::RestoreState`](super::protocol::Call::RestoreState).

mod file;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::time::SystemTime;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::protocol::{Answer, Changed};
use super::{Live, LiveError, Shared, lock};
use file::StateFile;
use stickslip_base::Error;
use stickslip_base::parameters::presets::Source;
use stickslip_base::parameters::{Entry, Value};
use stickslip_bench::tuning::{Proposal, Tuning, is_of_it};

/// Largest layout [bytes].
const LARGEST_LAYOUT: usize = 64 << 10;
/// Name of a state that was not restored, after the next change.
const BEFORE: &str = "target-before.json";

/// State of the target before the start of the program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EarlierState {
    /// Time of its last change, RFC 3339, UTC; `null` if there is none.
    pub saved: Option<String>,
    /// Values that would change: on the target now, and in the earlier state.
    pub differences: Vec<Changed>,
    /// Why it cannot be restored; `null` if it can.
    pub refused: Option<String>,
}

/// The stored state of the target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Stored {
    saved: String,
    /// Name of the preset's file.
    preset: String,
    /// The active parameters, a whole file.
    parameters: String,
    /// Selection and values of an external file, by path.
    external: BTreeMap<String, String>,
    /// Preload of the friction wheel, 0 … 1.
    preload: f64,
}

/// Layout of the scope, as the page describes it.
#[derive(Serialize, Deserialize)]
struct Layout {
    layout: String,
}

/// The stored state.
pub(super) struct TargetState {
    target: StateFile,
    scope: StateFile,
    earlier: Mutex<Earlier>,
    /// Why the last state was not read or written.
    problem: Mutex<Option<String>>,
}

/// The state before the start.
#[derive(Default)]
struct Earlier {
    stored: Option<Stored>,
    /// Number of values that differ from those of the start.
    differing: usize,
    /// Whether the file still has it: the next change preserves it.
    in_file: bool,
}

impl TargetState {
    /// Reads the state of a project. A damaged file is reported; the bench starts without it.
    pub(super) fn open(project: &Path) -> Self {
        let folder = project.join("state");
        let target = StateFile::new(&folder, "target.json", "stickslip.target-state/1");
        let scope = StateFile::new(&folder, "scope.json", "stickslip.scope-layout/1");
        let (stored, problem) = match target.read() {
            Ok(stored) => (stored, None),
            Err(error) => (None, Some(error.to_string())),
        };
        let in_file = stored.is_some() || problem.is_some();
        let earlier = Mutex::new(Earlier { stored, differing: 0, in_file });
        TargetState { target, scope, earlier, problem: Mutex::new(problem) }
    }

    /// Number of values that the offered state would change; `None`: nothing is offered.
    pub(super) fn offered(&self) -> Option<usize> {
        let earlier = lock(&self.earlier);
        earlier.stored.as_ref().map(|_| earlier.differing)
    }

    /// Why the last state was not read or written.
    pub(super) fn problem(&self) -> Option<String> {
        lock(&self.problem).clone()
    }

    /// Writes the active state.
    fn save(&self, stored: Stored) {
        let mut earlier = lock(&self.earlier);
        let aside = if earlier.in_file { self.target.set_aside(BEFORE) } else { Ok(()) };
        let written = aside.and_then(|()| self.target.write(stored));
        earlier.in_file &= written.is_err();
        *lock(&self.problem) = written.err().map(|error| format!("The state of the target is not saved: {error}"));
    }

    /// The stored layout of the scope; empty if there is none.
    pub(super) fn layout(&self) -> Result<Answer, Error> {
        let layout: Option<Layout> = self.scope.read()?;
        Ok(Answer::Text { text: layout.map_or_else(String::new, |layout| layout.layout) })
    }

    /// Stores the layout of the scope.
    pub(super) fn keep_layout(&self, layout: String) -> Result<Answer, Error> {
        if layout.len() > LARGEST_LAYOUT {
            let (value, maximum) = (layout.len() as f64, LARGEST_LAYOUT as f64);
            let (name, remedy) = ("size of the layout", "Remove panes or computed channels.");
            return Err(Error::OutOfRange { name, value, unit: "B", minimum: 0.0, maximum, remedy });
        }
        self.scope.write(Layout { layout }).map(|()| Answer::Done {})
    }
}

impl Shared {
    /// Stores the active state in the project.
    pub(super) fn save_state(&self) {
        let (parameters, external) = self.parameters.read(|tuning| {
            let value = |entry: &Entry| match entry.value {
                Value::Number(value) => (entry.path.clone(), format!("{value:?}")),
                Value::Variant(name) => (entry.path.clone(), name.into()),
            };
            let entries = tuning.entries();
            let external = entries.iter().filter(|entry| is_of_it(&entry.path)).map(value).collect();
            (tuning.text().to_owned(), external)
        });
        let saved = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
        let (preset, preload) = (self.parameters.file(), self.motion.preload());
        self.state.save(Stored { saved, preset, parameters, external, preload });
    }

    /// The change that restores a stored state.
    fn restoring(&self, stored: &Stored, tuning: &Tuning) -> Result<Proposal, Error> {
        let path = self.state.target.path().to_owned();
        let refused = |fault: String| LiveError::State { path: path.clone(), fault };
        if stored.preset != self.parameters.file() {
            let started = self.parameters.file();
            return Err(
                refused(format!("it belongs to {}, the bench was started with {started}", stored.preset)).into()
            );
        }
        let acts = stored.external.values().any(|value| value == "loaded");
        if acts && self.parameters.loaded.status().is_none() {
            let fault = "an external file was active, and the bench was started without it";
            return Err(refused(fault.into()).into());
        }
        let external: Vec<_> = stored.external.clone().into_iter().collect();
        tuning.restore(Source { file: path.display().to_string(), text: stored.parameters.clone() }, &external)
    }

    /// Differences from the active state to a stored one.
    fn differences(&self, stored: &Stored) -> Result<Vec<Changed>, Error> {
        let proposal = self.restoring(stored, &self.parameters.tuning())?;
        let mut differences = Changed::all(&proposal.differences);
        let preload = self.motion.preload();
        if stored.preload != preload {
            differences.push(Changed {
                path: "preload of the friction wheel".into(),
                before: Some(preload.to_string()),
                after: Some(stored.preload.to_string()),
            });
        }
        Ok(differences)
    }

    /// Compares the stored state with that of the start; an equal one is not offered.
    pub(super) fn compare_state(&self) {
        let stored = lock(&self.state.earlier).stored.clone();
        let Some(stored) = stored else { return };
        let differing = self.differences(&stored).map(|differences| differences.len());
        let mut earlier = lock(&self.state.earlier);
        match differing {
            Ok(0) => *earlier = Earlier::default(),
            differing => earlier.differing = differing.unwrap_or(0),
        }
    }
}

impl Live {
    /// The offered state.
    pub(super) fn earlier_state(&self) -> Answer {
        let stored = lock(&self.shared.state.earlier).stored.clone();
        let state = stored.map_or_else(EarlierState::default, |stored| {
            let differences = self.shared.differences(&stored);
            let refused = differences.as_ref().err().map(ToString::to_string);
            EarlierState { saved: Some(stored.saved), differences: differences.unwrap_or_default(), refused }
        });
        Answer::EarlierState(Box::new(state))
    }

    /// Restores the offered state: all of it or nothing.
    pub(super) fn restore_state(&self) -> Result<Answer, Error> {
        let Shared { state, motion, .. } = &*self.shared;
        let stored = lock(&state.earlier).stored.clone();
        let stored = stored.ok_or(LiveError::NothingToEnd { what: "offer of an earlier state" })?;
        // Checked first: the preload is set by the axis, which may be busy.
        if motion.status().0.is_some() && stored.preload != motion.preload() {
            let what = motion.status().0.map(|doing| doing.what).unwrap_or_default();
            return Err(LiveError::Busy { what, remedy: "Wait for its end: the preload changes, too." }.into());
        }
        let answer = self.propose(|tuning| self.shared.restoring(&stored, tuning))?;
        if stored.preload != motion.preload() {
            self.preload(stored.preload)?;
        }
        *lock(&state.earlier) = Earlier::default();
        self.shared.save_state();
        Ok(answer)
    }

    /// Withdraws the offer; the file `target-before.json` preserves the state.
    pub(super) fn discard_state(&self) -> Answer {
        self.shared.save_state();
        *lock(&self.shared.state.earlier) = Earlier::default();
        Answer::Done {}
    }
}
