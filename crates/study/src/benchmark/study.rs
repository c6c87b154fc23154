//! The whole benchmark: cell after cell, the runs of each on all threads.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};

use super::{Entrant, FRICTIONS, FrictionCase, MANOEUVRES, Manoeuvre, PROGRAM, VARIATIONS, Variation};
use stickslip_base::parallel::map;
use stickslip_base::preset::{ControllerChoice, Preset};
use stickslip_base::{Error, Watch, output, parameters};
use stickslip_simulate::manoeuvre::Course;

/// Plan of a benchmark.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Name of the machine and its preset.
    pub machine: String,
    /// The machine; its friction is replaced.
    pub preset: Preset<f64>,
    /// Entrants; the first is the reference of the others.
    pub entrants: Vec<Entrant>,
    /// Frictions.
    pub frictions: Vec<FrictionCase>,
    /// Differences between machine and model, besides none: only the reversal is run there.
    pub variations: Vec<Variation>,
    /// Manoeuvres.
    pub manoeuvres: Vec<Manoeuvre>,
    /// Seeds of noise.
    pub seeds: u64,
    /// Number of set-points at which it rests.
    pub places: u64,
    /// Threads.
    pub threads: usize,
}

impl Plan {
    /// A plan with all frictions, variations and manoeuvres.
    pub fn new(machine: impl Into<String>, preset: Preset<f64>, entrants: Vec<Entrant>) -> Self {
        Plan {
            machine: machine.into(),
            preset,
            entrants,
            frictions: FRICTIONS.to_vec(),
            variations: VARIATIONS[1..].to_vec(),
            manoeuvres: MANOEUVRES.into_iter().filter(|manoeuvre| manoeuvre.is_usual()).collect(),
            seeds: 6,
            places: 12,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
        }
    }

    /// A quick plan: two frictions, two seeds, four places, and friction modelled 30 % off.
    pub fn quick(self) -> Self {
        let frictions = self.frictions.into_iter().filter(|friction| friction.name != "mild").collect();
        let variations = VARIATIONS[1..3].to_vec();
        Plan { frictions, variations, seeds: 2, places: 4, ..self }
    }

    /// Place of a repetition: as even as possible, none on a count.
    pub(super) fn chance(repetition: u64, count: u64) -> f64 {
        (repetition as f64 + 0.5) / count as f64
    }

    /// Runs of a cell: manoeuvre, seed, and the place between two counts.
    fn runs(&self, cell: &Cell) -> Vec<(Manoeuvre, u64, f64)> {
        let whole = cell.variation.name == VARIATIONS[0].name;
        let chosen = self.manoeuvres.iter().filter(|manoeuvre| whole || **manoeuvre == Manoeuvre::Reversal);
        let repeats = |manoeuvre: &Manoeuvre| if manoeuvre.has_places() { self.places } else { self.seeds };
        let of = |manoeuvre: &Manoeuvre| {
            let (manoeuvre, count) = (*manoeuvre, repeats(manoeuvre));
            (0..count).map(move |k| (manoeuvre, k + 1, Plan::chance(k, count)))
        };
        chosen.flat_map(of).collect()
    }

    /// All cells, those of an entrant and a friction together.
    fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for friction in &self.frictions {
            for entrant in 0..self.entrants.len() {
                for variation in VARIATIONS[..1].iter().chain(&self.variations) {
                    cells.push(Cell { friction: *friction, entrant, variation: *variation });
                }
            }
        }
        cells
    }
}

/// An entrant on a friction and a variation.
#[derive(Clone, Copy, Debug)]
struct Cell {
    friction: FrictionCase,
    entrant: usize,
    variation: Variation,
}

/// Result of a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellResult {
    /// Name of the entrant.
    pub entrant: String,
    /// Name of the friction.
    pub friction: String,
    /// Name of the variation.
    pub variation: String,
    /// For each run: name of the manoeuvre, and its numbers in the order of its measures; none where it failed.
    pub runs: Vec<(String, Option<Vec<Option<f64>>>)>,
    /// All inputs: results of another benchmark are not reused.
    pub(super) follows_from: String,
}

impl CellResult {
    /// All values of a measure, one for each run; NaN where it failed.
    pub fn values(&self, manoeuvre: Manoeuvre, measure: usize) -> Vec<f64> {
        let of = self.runs.iter().filter(|(name, _)| name == manoeuvre.name());
        of.map(|(_, values)| values.as_ref().and_then(|all| *all.get(measure)?).unwrap_or(f64::NAN)).collect()
    }

    /// Failed runs.
    pub fn failures(&self) -> usize {
        self.runs.iter().filter(|(_, values)| values.is_none()).count()
    }
}

/// Outcome of a benchmark.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The plan.
    pub plan: Plan,
    /// The finished cells.
    pub cells: Vec<CellResult>,
    /// The tuned controllers.
    pub tuned: Vec<(&'static str, ControllerChoice<f64>)>,
    /// On a bench, the first course of each entrant and manoeuvre.
    pub courses: Vec<(String, Manoeuvre, Course)>,
    /// Whether all cells are finished.
    pub complete: bool,
}

/// Runs the benchmark. Cells in `folder` with the same inputs are reused; each finished cell is written there. After a
/// cancellation the outcome holds the finished cells.
///
/// # Errors
/// [`Error::Cancelled`] before the first cell is finished; [`Error::Parameters`] where the parameters of a file do not
/// fit the machine; errors of tuning and design; [`Error::File`].
pub fn run_plan(plan: &Plan, folder: &Path, watch: &Watch) -> Result<Outcome, Error> {
    // A file was written for its own bench: matrices for another sampling time would run with wrong results.
    for entrant in plan.entrants.iter().filter(|entrant| entrant.tuned_as().is_none()) {
        let text = parameters::write_commented(&entrant.on(&plan.preset, None));
        parameters::read::<Preset<f64>>(&text, &format!("{} on {}", entrant.name, plan.machine))?;
    }
    output::create_folder(folder)?;
    // All frictions share machine and bristles; the controllers are tuned for the nominal friction.
    let tuned = tune_all(plan, &FRICTIONS[1], folder, watch)?;
    let mut outcome = Outcome { plan: plan.clone(), cells: Vec::new(), tuned, courses: Vec::new(), complete: true };
    let cells = plan.cells();
    let total: usize = cells.iter().map(|cell| plan.runs(cell).len()).sum();
    let done = AtomicUsize::new(0);
    for cell in &cells {
        match result(plan, cell, &outcome.tuned, folder, (&done, total), watch) {
            Ok(result) => outcome.cells.push(result),
            Err(Error::Cancelled) if !outcome.cells.is_empty() => {
                outcome.complete = false;
                break;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(outcome)
}

/// Tunes the built-in controllers of the plan on the machine with this friction.
pub(super) fn tune_all(
    plan: &Plan,
    friction: &FrictionCase,
    folder: &Path,
    watch: &Watch,
) -> Result<Vec<(&'static str, ControllerChoice<f64>)>, Error> {
    let mut names: Vec<&'static str> = plan.entrants.iter().filter_map(Entrant::tuned_as).collect();
    names.sort_unstable();
    names.dedup();
    let preset = friction.on(&plan.preset);
    let tune = |name: &&'static str| Ok((*name, Entrant::tuned(name, &preset, folder, watch)?));
    map(&names, plan.threads, tune)
}

/// A cell's result, from its file or from its runs.
fn result(
    plan: &Plan,
    cell: &Cell,
    tuned: &[(&'static str, ControllerChoice<f64>)],
    folder: &Path,
    (done, total): (&AtomicUsize, usize),
    watch: &Watch,
) -> Result<CellResult, Error> {
    let entrant = &plan.entrants[cell.entrant];
    let of = |name| tuned.iter().find(|(other, _)| *other == name).map(|(_, controller)| *controller);
    let controller = entrant.tuned_as().and_then(of);
    // A hold that uses the modelled breakaway torque uses the varied model.
    let preset = entrant.on(&cell.variation.of(&cell.friction.on(&plan.preset)), controller);
    let runs = plan.runs(cell);
    let follows_from =
        format!("{PROGRAM}\n{runs:?}\n{}{}", entrant.follows_from(), parameters::write_commented(&preset));
    let path = folder.join(file_name(&format!("{} {} {}", entrant.name, cell.friction.name, cell.variation.name)));
    let stage = format!("{}, {} friction, {}", entrant.name, cell.friction.name, cell.variation.name);
    if let Some(result) = read_result(&path, &follows_from) {
        done.fetch_add(runs.len(), Ordering::Relaxed);
        return Ok(result);
    }
    let values = map(&runs, plan.threads, |&(manoeuvre, seed, chance)| {
        let course = entrant.run(&preset, manoeuvre, seed, chance, watch)?;
        watch.stage(&stage, (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / total as f64)?;
        Ok((manoeuvre.name().to_owned(), course.map(|course| judged(manoeuvre, &course, &preset, chance))))
    })?;
    let result = CellResult {
        entrant: entrant.name.clone(),
        friction: cell.friction.name.into(),
        variation: cell.variation.name.into(),
        runs: values,
        follows_from,
    };
    let text = serde_json::to_string(&result).expect("strings and numbers");
    output::write(&path, text)?;
    Ok(result)
}

/// The numbers of a run; none where a number is undefined.
pub(super) fn judged(manoeuvre: Manoeuvre, course: &Course, preset: &Preset<f64>, chance: f64) -> Vec<Option<f64>> {
    let finite = |value: f64| value.is_finite().then_some(value);
    manoeuvre.judge(course, preset, chance).into_iter().map(finite).collect()
}

fn read_result(path: &Path, follows_from: &str) -> Option<CellResult> {
    let result: CellResult = serde_json::from_str(&fs::read_to_string(path).ok()?).ok()?;
    (result.follows_from == follows_from).then_some(result)
}

/// A file name that every file system accepts.
fn file_name(name: &str) -> PathBuf {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' || c == '+' { c } else { '_' };
    let signed = name.replace('−', "minus ").replace('%', "percent");
    format!("{}.json", signed.chars().map(plain).collect::<String>()).into()
}
