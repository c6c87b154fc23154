//! The whole benchmark: the runs of all cells, those of an entrant side by side.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};

use super::{Entrant, FRICTIONS, FrictionCase, MANOEUVRES, Manoeuvre, PROGRAM, VARIATIONS, Variation};
use super::{Lane, simulated_time};
use stickslip_base::parallel::map;
use stickslip_base::preset::{ControllerChoice, Preset};
use stickslip_base::{Error, Watch, output, parameters};
use stickslip_design::check_delays;
use stickslip_simulate::fast_bench::LANES;
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
        let preset = entrant.on(&plan.preset, None);
        let text = parameters::write_commented(&preset);
        parameters::read::<Preset<f64>>(&text, &format!("{} on {}", entrant.name, plan.machine))?;
        if entrant.stated().is_some() {
            check_delays(&preset.model, &preset.bench)?;
        }
    }
    output::create_folder(folder)?;
    // All frictions share machine and bristles; the controllers are tuned for the nominal friction.
    let tuned = tune_all(plan, &FRICTIONS[1], folder, watch)?;
    let cells: Vec<Open> = plan.cells().iter().map(|cell| Open::new(plan, cell, &tuned, folder)).collect();
    let total: usize = cells.iter().map(|cell| cell.runs.len()).sum();
    let reused: usize = cells.iter().filter(|cell| cell.is_finished()).map(|cell| cell.runs.len()).sum();
    let (done, open) = (AtomicUsize::new(reused), Mutex::new(cells.clone()));
    let run = |vector: &Vec<(usize, usize)>| -> Result<(), Error> {
        let lane = |&(cell, run): &(usize, usize)| cells[cell].lane(run);
        let (lanes, entrant) =
            (vector.iter().map(lane).collect::<Vec<_>>(), &plan.entrants[cells[vector[0].0].cell.entrant]);
        let courses = entrant.run(&lanes, watch)?;
        for ((&(cell, run), lane), course) in vector.iter().zip(&lanes).zip(courses) {
            let values = course.map(|course| judged(lane.manoeuvre, &course, lane.preset, lane.chance));
            let finished = {
                let mut open = open.lock().expect("no thread panics with the lock");
                open[cell].values[run] = Some(values);
                open[cell].is_finished().then(|| open[cell].clone())
            };
            finished.map_or(Ok(()), |cell| cell.write(plan))?;
        }
        let done = done.fetch_add(vector.len(), Ordering::Relaxed) + vector.len();
        watch.stage(&format!("{}, {}", entrant.name, lanes[0].manoeuvre.name()), done as f64 / total as f64)
    };
    let ended = map(&vectors(plan, &cells), plan.threads, run);
    let cells: Vec<CellResult> = open
        .into_inner()
        .expect("all threads have ended")
        .iter()
        .filter(|cell| cell.is_finished())
        .map(|cell| cell.result(plan))
        .collect();
    let complete = ended.is_ok();
    match ended {
        Err(error) if cells.is_empty() || !matches!(error, Error::Cancelled) => Err(error),
        _ => Ok(Outcome { plan: plan.clone(), cells, tuned, courses: Vec::new(), complete }),
    }
}

/// The missing runs, as cell and run: those of an entrant together, as many as run side by side, similar durations in a
/// vector.
fn vectors(plan: &Plan, cells: &[Open]) -> Vec<Vec<(usize, usize)>> {
    let mut vectors = Vec::new();
    let missing = |&(cell, run): &(usize, usize)| cells[cell].values[run].is_none();
    let of = |cell: usize| (0..cells[cell].runs.len()).map(move |run| (cell, run)).filter(missing);
    let total = (0..cells.len()).flat_map(of).count();
    // No idle threads with few runs.
    let most = total.div_ceil(plan.threads.max(1)).clamp(1, LANES);
    for entrant in 0..plan.entrants.len() {
        let mut runs: Vec<_> =
            (0..cells.len()).filter(|&cell| cells[cell].cell.entrant == entrant).flat_map(of).collect();
        let order = |&(cell, run): &(usize, usize)| {
            let Lane { preset, manoeuvre, seed, chance, .. } = cells[cell].lane(run);
            // The longest first; neighbours of the same seed share their noise.
            (std::cmp::Reverse((simulated_time(manoeuvre, preset, chance) * 1e3) as u64), seed)
        };
        runs.sort_by_cached_key(order);
        vectors.extend(runs.chunks(most).map(<[_]>::to_vec));
    }
    vectors
}

/// Values of a run; `None` where it failed.
type Values = Option<Vec<Option<f64>>>;

/// A cell in progress.
#[derive(Clone)]
struct Open {
    cell: Cell,
    preset: Preset<f64>,
    runs: Vec<(Manoeuvre, u64, f64)>,
    /// For each run its values; `None` before.
    values: Vec<Option<Values>>,
    follows_from: String,
    path: PathBuf,
}

impl Open {
    /// A cell with the results of its file, if any.
    fn new(plan: &Plan, cell: &Cell, tuned: &[(&'static str, ControllerChoice<f64>)], folder: &Path) -> Self {
        let entrant = &plan.entrants[cell.entrant];
        let of = |name| tuned.iter().find(|(other, _)| *other == name).map(|(_, controller)| *controller);
        let controller = entrant.tuned_as().and_then(of);
        // A hold that uses the modelled breakaway torque uses the varied model.
        let preset = entrant.on(&cell.variation.of(&cell.friction.on(&plan.preset)), controller);
        let runs = plan.runs(cell);
        let follows_from =
            format!("{PROGRAM}\n{runs:?}\n{}{}", entrant.follows_from(), parameters::write_commented(&preset));
        let path = folder.join(file_name(&format!("{} {} {}", entrant.name, cell.friction.name, cell.variation.name)));
        let values = match read_result(&path, &follows_from) {
            Some(result) => result.runs.into_iter().map(|(_, values)| Some(values)).collect(),
            None => vec![None; runs.len()],
        };
        Open { cell: *cell, preset, runs, values, follows_from, path }
    }

    fn lane(&self, run: usize) -> Lane<'_> {
        let (manoeuvre, seed, chance) = self.runs[run];
        Lane { preset: &self.preset, manoeuvre, seed, chance, long_steps: false }
    }

    fn is_finished(&self) -> bool {
        self.values.iter().all(Option::is_some)
    }

    /// The result of a finished cell.
    fn result(&self, plan: &Plan) -> CellResult {
        let values = self.values.iter().map(|values| values.clone().flatten());
        CellResult {
            entrant: plan.entrants[self.cell.entrant].name.clone(),
            friction: self.cell.friction.name.into(),
            variation: self.cell.variation.name.into(),
            runs: self.runs.iter().map(|(manoeuvre, ..)| manoeuvre.name().to_owned()).zip(values).collect(),
            follows_from: self.follows_from.clone(),
        }
    }

    fn write(&self, plan: &Plan) -> Result<(), Error> {
        output::write(&self.path, serde_json::to_string(&self.result(plan)).expect("strings and numbers"))
    }
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
