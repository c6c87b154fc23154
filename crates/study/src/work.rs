//! Inputs of the cases of a study, so that they can run here or on another machine.

use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::plan::{LONGEST_CASE, of_entrant};
use super::step_size::coarsest;
use super::table::{Columns, Row, Writer};
use super::{Axis, Design, Plan};
use crate::benchmark::{Entrant, MANOEUVRES, Manoeuvre};
use stickslip_base::parameters::{self, flatten};
use stickslip_base::preset::{ControllerChoice, Preset};
use stickslip_base::statistics::splitmix;
use stickslip_base::{Error, Watch};
use stickslip_simulate::fast_bench::LANES;

/// Version of the results: another version may compute other numbers.
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Name of a received work in messages.
const NAME: &str = "work of a study";

/// Fewest and most cases of a part, within the limit of parts.
const PART: [u64; 2] = [LANES as u64, 1000];
/// Largest number of parts.
const PARTS: u64 = 1_000_000;
/// Simulated time of a part [s], about a second of a core: an interruption loses little, and handing a part to another
/// machine costs little compared with running it.
const PART_TIME: f64 = 300.0;

/// Largest number of values of an axis that are listed in the inputs of rows.
const LISTED: usize = 32;

/// A plan with its tuned controller. Its cases come in parts, each of which is a function of its number.
#[derive(Clone, Debug)]
pub struct Work {
    pub(super) plan: Plan,
    tuned: Option<ControllerChoice<f64>>,
    pub(super) cases: u64,
    /// Cases of each part but the last.
    size: u64,
    pub(super) columns: Columns,
    /// All inputs of a result: those of another study are not reused.
    pub(super) follows_from: String,
}

impl Work {
    pub(super) fn new(plan: Plan, tuned: Option<ControllerChoice<f64>>) -> Result<Self, Error> {
        let cases = plan.cases()?;
        let time = plan.case_time(&plan.preset);
        // At most a hundredth of all cases; work of unknown duration is divided as finely as possible.
        let size = (cases / 100).min((PART_TIME / time) as u64).max(cases / PARTS).clamp(PART[0], PART[1]);
        let (columns, follows_from) = (Columns::of(&plan), follows_from(&plan, tuned));
        // Whole vectors, so that all lanes of all parts but the last are used.
        Ok(Work { plan, tuned, cases, size: size.next_multiple_of(PART[0]), columns, follows_from })
    }

    /// Number of parts.
    pub fn parts(&self) -> usize {
        // A billion cases at most, with at least eight in a part.
        self.cases.div_ceil(self.size) as usize
    }

    /// The cases of a part, counted from 0; none for an unknown part.
    pub fn part(&self, index: usize) -> Range<u64> {
        let first = (index as u64).saturating_mul(self.size).min(self.cases);
        first..first.saturating_add(self.size).min(self.cases)
    }

    /// Runs the cases of a part on this thread and returns the bytes of its file, which do not depend on the machine.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::OutOfRange`] for an unknown part.
    pub fn part_bytes(&self, index: usize, watch: &Watch) -> Result<Vec<u8>, Error> {
        let cases = self.part(index);
        if cases.is_empty() {
            return Err(Error::OutOfRange {
                name: "the part of a study",
                value: index as f64,
                unit: "1",
                minimum: 0.0,
                maximum: (self.parts() - 1) as f64,
                remedy: "Parts are numbered from 0.",
            });
        }
        let mut rows = Vec::new();
        for first in cases.clone().step_by(LANES) {
            rows.append(&mut self.rows(first..(first + LANES as u64).min(cases.end), watch)?);
        }
        self.bytes(&rows)
    }

    /// The file of a part.
    pub(super) fn bytes(&self, rows: &[Row]) -> Result<Vec<u8>, Error> {
        let write = || {
            let mut bytes = Vec::new();
            let mut writer = Writer::new(&mut bytes, &self.columns, &self.follows_from)?;
            writer.rows(rows)?;
            writer.close()?;
            Ok(bytes)
        };
        write().map_err(|source| Error::file(Path::new(NAME), "write", source))
    }

    /// The preset of a case.
    ///
    /// # Errors
    /// [`Error::Parameters`] for inconsistent values.
    pub(super) fn preset(&self, case: u64, values: &[f64]) -> Result<Preset<f64>, Error> {
        let Plan { axes, entrant, .. } = &self.plan;
        let mut preset = self.plan.preset;
        let apply = |preset: &mut Preset<f64>, takes: &dyn Fn(&str) -> bool| {
            axes.iter().zip(values).for_each(|(axis, value)| axis.apply(*value, preset, takes));
        };
        match entrant {
            None => apply(&mut preset, &|_| true),
            Some(entrant) => {
                // A hold that uses the modelled breakaway torque uses the changed model: after it.
                apply(&mut preset, &|path| !of_entrant(path));
                preset = entrant.on(&preset, self.tuned);
                apply(&mut preset, &of_entrant);
            }
        }
        if self.plan.tolerance.is_some() {
            // A case may have finer steps than the preset.
            let coarsest = preset.bench.tick_time() / coarsest(&preset) as f64;
            preset.bench.plant_step = preset.bench.plant_step.min(coarsest);
        }
        parameters::check(&preset, &format!("case {}", case + 1))?;
        let time = self.plan.case_time(&preset);
        if time.is_nan() || time > LONGEST_CASE {
            let remedy = "Keep the speed and acceleration of the drive away from 0, or use fewer seeds.";
            let (name, unit) = ("the simulated time of a case", "s");
            return Err(Error::OutOfRange { name, value: time, unit, minimum: 0.0, maximum: LONGEST_CASE, remedy });
        }
        Ok(preset)
    }

    /// The work as text, for another machine: no file of this one is required there.
    pub fn to_json(&self) -> String {
        let plan = &self.plan;
        let with = |controller| {
            let mut preset = plan.preset;
            preset.bench.controller = controller;
            parameters::write_commented(&preset)
        };
        let sent = Sent {
            version: VERSION.into(),
            title: plan.title.clone(),
            machine: plan.machine.clone(),
            preset: parameters::write_commented(&plan.preset),
            entrant: plan.entrant.as_ref().map(|it| (it.name.clone(), it.stated().map(parameters::write_commented))),
            tuned: self.tuned.map(with),
            manoeuvres: plan.manoeuvres.iter().map(|manoeuvre| manoeuvre.name().into()).collect(),
            seeds: plan.seeds,
            places: plan.places,
            tolerance: plan.tolerance,
            axes: plan.axes.clone(),
            design: plan.design.clone(),
        };
        serde_json::to_string(&sent).expect("strings and numbers")
    }

    /// A work from such a text.
    ///
    /// # Errors
    /// [`Error::Document`] for another version or an invalid text; errors of its parameters.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let refused = |reason, remedy| Error::Document { path: NAME.into(), place: None, reason, remedy };
        let no_work = |error: serde_json::Error| refused(error.to_string(), "Send the text unchanged.");
        let Version { version } = serde_json::from_str(text).map_err(no_work)?;
        if version != VERSION {
            let reason = format!("it was made by stickslip {version}, but this is stickslip {VERSION}");
            return Err(refused(reason, "Install the same version on all machines."));
        }
        let sent: Sent = serde_json::from_str(text).map_err(no_work)?;
        let preset = |text: &str| parameters::read::<Preset<f64>>(text, NAME);
        let entrant = match sent.entrant {
            Some((name, Some(stated))) => Some(Entrant::of_parameters(name, preset(&stated)?)),
            Some((name, None)) => Some(Entrant::find(&name)?),
            None => None,
        };
        let manoeuvre = |name: &String| MANOEUVRES.into_iter().find(|manoeuvre| manoeuvre.name() == name);
        let manoeuvres: Option<Vec<Manoeuvre>> = sent.manoeuvres.iter().map(manoeuvre).collect();
        let plan = Plan {
            title: sent.title,
            machine: sent.machine,
            preset: preset(&sent.preset)?,
            entrant,
            manoeuvres: manoeuvres.ok_or_else(|| refused("unknown manoeuvre".into(), "Send the text unchanged."))?,
            seeds: sent.seeds,
            places: sent.places,
            tolerance: sent.tolerance,
            axes: sent.axes,
            design: sent.design,
            threads: 1,
        };
        let tuned = sent.tuned.as_deref().map(preset).transpose()?;
        Work::new(plan, tuned.map(|preset| preset.bench.controller))
    }
}

/// A serialized work; presets are the texts of files.
#[derive(Serialize, Deserialize)]
struct Sent {
    version: String,
    title: String,
    machine: String,
    preset: String,
    /// Name, and the contents of its file if it has one.
    entrant: Option<(String, Option<String>)>,
    /// The machine with the tuned controller.
    tuned: Option<String>,
    manoeuvres: Vec<String>,
    seeds: u64,
    places: u64,
    tolerance: Option<f64>,
    axes: Vec<Axis>,
    design: Design,
}

/// The part of the text that is common to all versions.
#[derive(Deserialize)]
struct Version {
    version: String,
}

fn follows_from(plan: &Plan, tuned: Option<ControllerChoice<f64>>) -> String {
    let Plan { preset, entrant, manoeuvres, seeds, places, tolerance, axes, design, .. } = plan;
    let name = entrant.as_ref().map(|entrant| entrant.name.as_str());
    let whole = entrant.as_ref().map_or(*preset, |entrant| entrant.on(preset, tuned));
    let lines = |preset| flatten(&preset).into_iter().map(|entry| format!("{} {:?}\n", entry.path, entry.value));
    let values: String = lines(*preset).chain(lines(whole)).collect();
    let axes: String = axes.iter().map(changed).collect();
    format!("stickslip {VERSION} {name:?} {manoeuvres:?} {seeds} {places} {tolerance:?}\n{axes}{design:?}\n{values}")
}

/// The changes of an axis, in a line; of a long list of values their number and a hash of their bits, since each part
/// repeats it.
fn changed(axis: &Axis) -> String {
    let Axis { name, paths, factor, unit, spread } = axis;
    let values = match spread.listed() {
        Some(values) if values.len() > LISTED => {
            let mut state = 0;
            let bits = values.iter().fold(0, |sum: u64, value| {
                state = sum ^ value.to_bits();
                splitmix(&mut state)
            });
            format!("{} values, {bits:016x}", values.len())
        }
        _ => format!("{spread:?}"),
    };
    format!("{name:?} {paths:?} {factor} {unit} {values}\n")
}
