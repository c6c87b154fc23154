//! Measurements at rest, breakaway and presliding: the running one and those of earlier runs, as figures of the report.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue;
use super::curve::{number, of};
use super::measurements::Measurements;
use super::protocol::Quantity;
use super::rendered::{KeyEstimate, Picture};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::preset::Model;
use stickslip_base::report::{Cell, Report, Section};
use stickslip_base::{Error, input};
use stickslip_experiment::Part;
use stickslip_experiment::workflow::measure::Outcome;
use stickslip_experiment::workflow::measure::breakaway::{RATE, REST, TORQUE};
use stickslip_experiment::{Breakaway, BreakawayPlan, Loop, Plateau, Presliding};
use stickslip_recording::Recording;

/// Results of the own friction, and the corresponding parameters.
const OWN: [(&str, &str); 3] = [
    ("measure.breakaway_torque", "model.own.breakaway_torque"),
    ("measure.bristle_stiffness", "model.own_bristles.stiffness"),
    ("measure.bristle_damping", "model.own_bristles.damping"),
];

/// A measurement of breakaway or presliding, complete or running.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BreakawayMeasurement {
    /// Number of the run; `null` during the measurement and if there is none.
    pub run: Option<u64>,
    /// Whether the measurement is running.
    pub measuring: bool,
    /// The results.
    pub keys: Vec<KeyEstimate>,
    /// Figures: that of the measurement first, then comparisons with earlier runs.
    pub figures: Vec<Picture>,
    /// Warnings, each with a remedy.
    pub notes: Vec<String>,
    /// Values to adopt it as own friction, by path, as for `set`.
    pub own: BTreeMap<String, String>,
    /// Runs of the same measurement, the newest first.
    pub runs: Vec<u64>,
}

/// The running measurement at rest, with its parts so far.
#[derive(Clone, Debug, Default)]
pub(super) enum BreakawayProgress {
    /// No measurement.
    #[default]
    Nothing,
    /// Ramps.
    Breakaway(Breakaway),
    /// The friction before the loops, and the loops.
    Presliding(Vec<Plateau>, Vec<Loop>),
}

impl BreakawayProgress {
    pub(super) fn breakaway(plan: &BreakawayPlan<f64>, model: &Model<f64>) -> Self {
        let (rate, rest_time, lag) = (plan.rate, plan.rest_time, plan.lag(model));
        BreakawayProgress::Breakaway(Breakaway {
            ramps: Vec::new(),
            rate,
            rest_time,
            lag,
            duration: 0.0,
            complete: true,
        })
    }

    fn quantity(&self) -> Option<Quantity> {
        match self {
            BreakawayProgress::Nothing => None,
            BreakawayProgress::Breakaway(_) => Some(Quantity::Breakaway),
            BreakawayProgress::Presliding(..) => Some(Quantity::Presliding),
        }
    }

    pub(super) fn add(&mut self, part: Part<'_>) {
        match (self, part) {
            (BreakawayProgress::Breakaway(breakaway), Part::Ramp(ramp)) => breakaway.ramps.push(*ramp),
            (BreakawayProgress::Presliding(plateaus, _), Part::Plateau(plateau)) => plateaus.push(plateau.clone()),
            (BreakawayProgress::Presliding(_, loops), Part::Loop(one)) => {
                match loops.iter_mut().find(|other| other.frequency == one.frequency) {
                    Some(other) => *other = one.clone(),
                    None => loops.push(one.clone()),
                }
            }
            _ => {}
        }
    }

    fn shown(&self) -> BreakawayMeasurement {
        let picture = |(figure, caption)| vec![Picture { figure, caption }];
        let (keys, figures) = match self {
            BreakawayProgress::Nothing => (Vec::new(), Vec::new()),
            BreakawayProgress::Breakaway(breakaway) => {
                let keys = breakaway.lines().map(|(name, estimate)| KeyEstimate::of(name, &estimate)).collect();
                (keys, picture(breakaway.figure()))
            }
            // The friction is measured first: the loops need its breakaway torque.
            BreakawayProgress::Presliding(plateaus, loops) if loops.is_empty() => {
                (Vec::new(), picture(of(plateaus.clone()).figure()))
            }
            BreakawayProgress::Presliding(_, loops) => {
                (Vec::new(), picture(Presliding::of_loops(loops.clone()).figure()))
            }
        };
        BreakawayMeasurement { measuring: true, keys, figures, ..BreakawayMeasurement::default() }
    }
}

impl Measurements {
    /// The results of a run of this measurement; default: the running or newest one.
    pub(super) fn at_rest(&self, what: Quantity, run: Option<u64>) -> Result<BreakawayMeasurement, Error> {
        let kind = match what {
            Quantity::Friction => {
                let remedy = "Use the call `curve`.".into();
                return Err(Error::Unknown { what: "measurement at rest", name: "friction".into(), remedy });
            }
            Quantity::Breakaway => "measure-breakaway",
            Quantity::Presliding => "measure-presliding",
        };
        let folders = self.folders(kind);
        let runs = folders.iter().map(|(run, _)| *run).collect();
        let so_far = self.current_at_rest();
        if run.is_none() && so_far.quantity() == Some(what) {
            return Ok(BreakawayMeasurement { runs, ..so_far.shown() });
        }
        let folder = match run {
            None => match folders.first() {
                Some(newest) => newest,
                None => return Ok(BreakawayMeasurement::default()),
            },
            Some(run) => folders.iter().find(|(number, _)| *number == run).ok_or_else(|| Error::Unknown {
                what: "run of this measurement",
                name: run.to_string(),
                remedy: "The field `runs` of the newest one lists them all.".into(),
            })?,
        };
        let mut measurement = of_folder(&folder.1)?;
        measurement.notes.extend(catalogue::incomplete(&folder.1));
        if what == Quantity::Breakaway {
            measurement.figures.extend(over_runs(folder.0, &folders));
        }
        Ok(BreakawayMeasurement { run: Some(folder.0), runs, ..measurement })
    }

    /// Number and folder of each run of a kind with a report, the newest first.
    fn folders(&self, kind: &str) -> Vec<(u64, PathBuf)> {
        let mut folders: Vec<_> = std::fs::read_dir(&self.folder)
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| path.join("report.json").exists())
            .filter_map(|path| {
                let name = path.file_name()?.to_str()?;
                name.ends_with(kind).then(|| number(name)).flatten().map(|number| (number, path))
            })
            .collect();
        folders.sort_by_key(|(number, _)| std::cmp::Reverse(*number));
        folders
    }
}

/// The measurement in the folder of a run.
fn of_folder(folder: &Path) -> Result<BreakawayMeasurement, Error> {
    let mut measurement = BreakawayMeasurement::default();
    for section in Report::read(folder)?.sections() {
        match section {
            Section::Figure { figure, caption } => {
                measurement.figures.push(Picture { figure: (**figure).clone(), caption: caption.clone() });
            }
            Section::Table(table) => {
                measurement.keys.extend(table.rows().iter().filter_map(|row| match row.as_slice() {
                    [Cell::Text(name), Cell::Estimate(estimate)] => Some(KeyEstimate::of(name, estimate)),
                    _ => None,
                }))
            }
            Section::List(notes) => measurement.notes.extend(notes.clone()),
            _ => {}
        }
    }
    let file = folder.join("summary.json");
    let text = input::text(&file, input::RESULT)?;
    // An invalid summary has no results.
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    for (result, path) in OWN {
        if let Some(value) = summary["results"][result]["value"].as_f64() {
            measurement.own.insert(path.into(), format!("{value:?}"));
        }
    }
    Ok(measurement)
}

/// Mean breakaway torque of each run over the conditions that differ between runs: rate of the ramps, time at rest.
fn over_runs(shown: u64, folders: &[(u64, PathBuf)]) -> Vec<Picture> {
    let runs: Vec<(u64, [f64; 4])> =
        folders.iter().filter_map(|(run, folder)| Some((*run, mean_of(&folder.join("ramps.csv"))?))).collect();
    let axes = [(2, "rate of the ramp", "N m/s"), (3, "time at rest", "s")];
    let figure = |(column, name, unit): (usize, &str, &str)| {
        let mut values: Vec<f64> = runs.iter().map(|(_, row)| row[column]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        if values.len() < 2 {
            return None;
        }
        let of = |own: bool| {
            let runs = runs.iter().filter(move |(run, _)| (*run == shown) == own);
            runs.map(move |(_, row)| (row[column], row[0], row[1])).collect::<Vec<_>>()
        };
        let figure = Figure::new(format!("Breakaway torque over the {name}"))
            .x(Axis::new(name, unit))
            .y(Axis::new("breakaway torque", "N m"))
            .series(Series::bars(Role::Reference, "other runs", of(false)))
            .series(Series::bars(Role::Measured, "this run", of(true)));
        let caption = format!("Means of {} runs; the bars are the standard deviation of one ramp.", runs.len());
        Some(Picture { figure, caption })
    };
    axes.into_iter().filter_map(figure).collect()
}

/// Mean and standard deviation of the torques, rate and time at rest of a table of ramps.
fn mean_of(file: &Path) -> Option<[f64; 4]> {
    let table = Recording::read(file).ok()?;
    let column = |name| table.column(name).ok().map(|column| column.values.as_slice());
    let torques = column(TORQUE)?;
    let n = torques.len() as f64;
    let mean = torques.iter().sum::<f64>() / n;
    let spread = (torques.iter().map(|torque| (torque - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
    Some([mean, spread, *column(RATE)?.first()?, *column(REST)?.first()?])
}
