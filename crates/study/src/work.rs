//! What the cases of a study follow from, so that anybody can run them, here or on another machine.

use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::plan::of_entrant;
use super::step_size::coarsest;
use super::table::{Columns, Row, Writer};
use super::{Axis, Design, Plan};
use crate::benchmark::{Entrant, MANOEUVRES, Manoeuvre, simulated_time};
use stickslip_base::parameters::{self, flatten};
use stickslip_base::preset::{ControllerChoice, Preset};
use stickslip_base::statistics::splitmix;
use stickslip_base::{Error, Watch};
use stickslip_simulate::fast_bench::LANES;

/// Whose results they are: another version may compute otherwise.
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// What messages call a work that came from elsewhere.
const NAME: &str = "work of a study";

/// Fewest and most cases of a part, unless there are more parts than can be listed.
const PART: [u64; 2] = [LANES as u64, 1000];
/// Most parts.
const PARTS: u64 = 1_000_000;
/// Simulated time of a part [s], about a second of a core: an interruption costs little, and so does handing a part to
/// another machine beside running it.
const PART_TIME: f64 = 300.0;

/// Values of an axis that are listed where it is said what rows follow from.
const LISTED: usize = 32;

/// A plan whose controller is tuned. Its cases come in parts, each of which is a function of its number.
#[derive(Clone, Debug)]
pub struct Work {
    pub(super) plan: Plan,
    tuned: Option<ControllerChoice<f64>>,
    pub(super) cases: u64,
    /// Cases of each part but the last.
    size: u64,
    pub(super) columns: Columns,
    /// All that a result follows from: another study's results are not taken for this one's.
    pub(super) follows_from: String,
}

impl Work {
    pub(super) fn new(plan: Plan, tuned: Option<ControllerChoice<f64>>) -> Result<Self, Error> {
        let cases = plan.cases()?;
        let time: f64 = plan.runs().map(|(manoeuvre, _, chance)| simulated_time(manoeuvre, &plan.preset, chance)).sum();
        // A hundredth of all at most; what has no time that could be told is cut as finely as can be.
        let size = (cases / 100).min((PART_TIME / time) as u64).max(cases / PARTS).clamp(PART[0], PART[1]);
        let (columns, follows_from) = (Columns::of(&plan), follows_from(&plan, tuned));
        // Whole vectors, so that no lane of a part but the last is left.
        Ok(Work { plan, tuned, cases, size: size.next_multiple_of(PART[0]), columns, follows_from })
    }

    /// How many parts there are.
    pub fn parts(&self) -> usize {
        // A billion cases at most, of eight at least.
        self.cases.div_ceil(self.size) as usize
    }

    /// The cases of a part, counted from 0; none where there is no such part.
    pub fn part(&self, index: usize) -> Range<u64> {
        let first = (index as u64).saturating_mul(self.size).min(self.cases);
        first..first.saturating_add(self.size).min(self.cases)
    }

    /// Runs the cases of a part on this thread: the bytes of its file, the same wherever they are computed.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::OutOfRange`] for a part that there is not.
    pub fn part_bytes(&self, index: usize, watch: &Watch) -> Result<Vec<u8>, Error> {
        let cases = self.part(index);
        if cases.is_empty() {
            return Err(Error::OutOfRange {
                name: "the part of a study",
                value: index as f64,
                unit: "1",
                minimum: 0.0,
                maximum: (self.parts() - 1) as f64,
                remedy: "Count from 0.",
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
    /// [`Error::Parameters`] where the values do not go together.
    pub(super) fn preset(&self, case: u64, values: &[f64]) -> Result<Preset<f64>, Error> {
        let Plan { axes, entrant, .. } = &self.plan;
        let mut preset = self.plan.preset;
        let apply = |preset: &mut Preset<f64>, takes: &dyn Fn(&str) -> bool| {
            axes.iter().zip(values).for_each(|(axis, value)| axis.apply(*value, preset, takes));
        };
        match entrant {
            None => apply(&mut preset, &|_| true),
            Some(entrant) => {
                // Who holds by the believed breakaway torque holds by a belief that may be changed: after it.
                apply(&mut preset, &|path| !of_entrant(path));
                preset = entrant.on(&preset, self.tuned);
                apply(&mut preset, &of_entrant);
            }
        }
        if self.plan.tolerance.is_some() {
            // A case that needs finer steps than the preset states gets them.
            let coarsest = preset.bench.tick_time() / coarsest(&preset) as f64;
            preset.bench.plant_step = preset.bench.plant_step.min(coarsest);
        }
        parameters::check(&preset, &format!("case {}", case + 1))?;
        Ok(preset)
    }

    /// As a text, for another machine: no file of this one is needed there.
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

    /// From such a text.
    ///
    /// # Errors
    /// [`Error::Document`] for one of another version, or none; what its parameters are refused for.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let refused = |reason, remedy| Error::Document { path: NAME.into(), place: None, reason, remedy };
        let no_work = |error: serde_json::Error| refused(error.to_string(), "Send it as it was made.");
        let Version { version } = serde_json::from_str(text).map_err(no_work)?;
        if version != VERSION {
            let reason = format!("it is of stickslip {version}, and this is stickslip {VERSION}");
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
            manoeuvres: manoeuvres
                .ok_or_else(|| refused("a manoeuvre of it is none".into(), "Send it as it was made."))?,
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

/// A work on its way; presets are the texts of files.
#[derive(Serialize, Deserialize)]
struct Sent {
    version: String,
    title: String,
    machine: String,
    preset: String,
    /// Its name, and what its file states if it has one.
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

/// What any version can be asked for.
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

/// What an axis changes, in a line; of a long list of values their number and what their bits come to, since each part
/// says it.
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
