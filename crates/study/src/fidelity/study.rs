//! The whole benchmark: cell after cell, the runs of each on all threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use stickslip_core::plant::Plant;

use super::plan::observer_name;
use super::{Cell, Group, LAWS, Mismatch, Pick, Plan, Role, Runs, Scenario, Score, TestBed, Trace, pick_law, scores};
use stickslip_base::preset::ObserverChoice;
use stickslip_base::{Error, Watch};
use stickslip_simulate::fidelity::law::{AUTO, PAPER, best_width, has_width, search_references, search_runs, with_law};
use stickslip_simulate::fidelity::machine;
use stickslip_simulate::fidelity::scenario::CLOSED_LOOP;

/// One number of the benchmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the preset.
    pub preset: String,
    /// Name of the law.
    pub law: &'static str,
    /// Whether the friction wheel is pressed on.
    pub wheel: bool,
    /// Tick rate [Hz].
    pub rate: f64,
    /// Name of the mismatch.
    pub mismatch: &'static str,
    /// Name of the observer.
    pub observer: &'static str,
    /// Whether the bench selected this law automatically.
    pub auto: bool,
    /// Difference that the bench predicts before the run; NaN for laws outside the selection and for measures that are
    /// not in closed loop.
    pub predicted: f64,
    /// Best half width of the fade-out for the law [rad/s]; NaN for laws without one.
    pub fade_velocity: f64,
    /// The numbers.
    pub score: Score,
}

/// Outcome of the benchmark.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The plan.
    pub plan: Plan,
    /// All numbers, cell by cell.
    pub rows: Vec<Row>,
    /// Example runs of one machine with and without its wheel.
    pub examples: Vec<Example>,
    /// Whether all cells are finished.
    pub complete: bool,
}

/// The same scenario on A, A0 and under laws, with the first seed.
#[derive(Clone, Debug)]
pub struct Example {
    /// The cells.
    pub group: Group,
    /// Scenario of the traces.
    pub scenario: Scenario,
    /// On A.
    pub a: Trace,
    /// On A0.
    pub a0: Trace,
    /// On B by law.
    pub b: Vec<(&'static str, Trace)>,
}

/// Runs the benchmark. After a cancellation the outcome holds the finished laws.
///
/// # Errors
/// [`Error::Cancelled`] before the first law is finished; errors of the design functions.
pub fn run_plan(plan: &Plan, watch: &Watch) -> Result<Outcome, Error> {
    let mut outcome = Outcome { plan: plan.clone(), rows: Vec::new(), examples: Vec::new(), complete: true };
    let mut work = Work { plan, watch, done: AtomicUsize::new(0), desired: None, picked: Vec::new() };
    let shown = example(plan);
    for group in &plan.groups {
        let keeps = shown.is_some_and(|shown| shown.is_beside(group));
        match work.group(group, keeps, &mut outcome) {
            Ok(()) => {}
            Err(Error::Cancelled) if !outcome.rows.is_empty() => {
                outcome.complete = false;
                break;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(outcome)
}

/// The example machine and rate: with the errors that identification leaves, at 4 kHz if available.
fn example(plan: &Plan) -> Option<&Group> {
    plan.groups.iter().max_by_key(|group| {
        let real = group.mismatch.name == Mismatch::REAL.name;
        // The first of equal ones: max_by_key returns the last.
        (
            real,
            group.rate == 4000.0,
            std::cmp::Reverse(plan.groups.iter().position(|other| std::ptr::eq(other, *group))),
        )
    })
}

impl Group {
    /// Whether the other group differs only by the wheel.
    fn is_beside(&self, other: &Group) -> bool {
        (&self.preset, self.rate, self.mismatch.name, self.observer)
            == (&other.preset, other.rate, other.mismatch.name, other.observer)
    }

    /// Whether the bench has accelerometer and tacho.
    pub(super) fn has_accelerometer(&self) -> bool {
        self.observer == ObserverChoice::Accelerometer
    }

    /// The laws by their own names, each once, the selected one in its place.
    fn resolved(&self, auto: &str) -> Vec<&'static str> {
        LAWS.iter().map(|(name, _)| *name).filter(|name| is_selected(&self.laws, name, auto)).collect()
    }

    /// The scenarios of a machine: A and A0 (no law) have nothing to correct; A0 is the scale of angles and an example.
    fn scenarios(&self, all: &[Scenario], role: Role, law: &str, auto: &str) -> Vec<Scenario> {
        let mut scenarios: Vec<Scenario> = match role {
            Role::Desired => all.iter().map(|scenario| scenario.uncorrected()).collect(),
            Role::Own => {
                all.iter().copied().filter(|scenario| scenario.needs_own() || SHOWN.contains(scenario)).collect()
            }
            Role::Rendered => {
                let corrected = is_selected(&self.corrected, law, auto);
                all.iter().copied().filter(|scenario| corrected || !scenario.is_corrected()).collect()
            }
        };
        scenarios.dedup();
        scenarios
    }
}

/// Whether a law is selected, by its name or as the automatic one.
fn is_selected(laws: &[String], name: &str, auto: &str) -> bool {
    laws.iter().any(|law| law == name || law == AUTO && name == auto)
}

struct Work<'a> {
    plan: &'a Plan,
    watch: &'a Watch,
    done: AtomicUsize,
    /// The previous group, its A and its runs.
    desired: Option<(Group, Plant<f64>, Runs)>,
    /// Selected laws by preset, wheel and rate; the model is the same for all mismatches.
    picked: Vec<(Group, Pick)>,
}

impl Work<'_> {
    /// Largest number of runs of a group.
    fn runs(&self, group: &Group) -> usize {
        let Plan { scenarios, seeds, .. } = self.plan;
        let widths = group.laws.iter().filter(|law| has_width(law)).count();
        let search = if widths > 0 { 2 * CLOSED_LOOP.len() + widths * search_runs() } else { 0 };
        let of = |role, law: &str| group.scenarios(scenarios, role, law, AUTO).len();
        let laws: usize = group.laws.iter().map(|law| of(Role::Rendered, law)).sum();
        seeds.len() * (of(Role::Desired, "") + of(Role::Own, "") + laws) + search
    }

    /// The law that the bench selects from its model of the machine; none if no law `auto` is requested.
    fn picked(&mut self, group: &Group, cell: &Cell) -> Result<Option<Pick>, Error> {
        if !group.laws.iter().any(|law| law == AUTO) {
            return Ok(None);
        }
        let alike = |(other, _): &&(Group, _)| {
            (&other.preset, other.wheel, other.rate, other.observer)
                == (&group.preset, group.wheel, group.rate, group.observer)
        };
        if let Some((_, pick)) = self.picked.iter().find(alike) {
            return Ok(Some(pick.clone()));
        }
        let pick = pick_law(&cell.preset.model, &cell.preset.bench)?;
        self.picked.push((group.clone(), pick.clone()));
        Ok(Some(pick))
    }

    fn group(&mut self, group: &Group, keeps: bool, outcome: &mut Outcome) -> Result<(), Error> {
        let Plan { scenarios, seeds, threads, .. } = self.plan;
        let total: usize = self.plan.groups.iter().map(|group| self.runs(group)).sum();
        let before: usize = self
            .plan
            .groups
            .iter()
            .take_while(|other| !std::ptr::eq(*other, group))
            .map(|other| self.runs(other))
            .sum();
        let mut cell = TestBed::find(&group.preset)?.cell(group.wheel, group.rate, group.mismatch);
        cell.preset.bench.observer = group.observer;
        let picked = self.picked(group, &cell)?;
        let auto = picked.as_ref().map_or("", |pick| pick.name);
        // Shared runs count as done.
        self.done.store(before, Ordering::Relaxed);
        let wheel = if group.wheel { "with wheel" } else { "without wheel" };
        let (kilohertz, observer) = (group.rate / 1000.0, observer_name(&group.observer));
        let stage = format!("{} {wheel}, {kilohertz:.0} kHz, {}, {observer}", group.preset, group.mismatch.name);
        let (watch, done) = (self.watch, &self.done);
        let done = move || watch.stage(&stage, (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / total as f64);

        let run = |cell: &Cell, role, law: &str| {
            let scenarios = group.scenarios(scenarios, role, law, auto);
            Runs::counted(cell, role, &scenarios, seeds, *threads, &done)
        };
        let truth = machine(&cell, Role::Desired);
        // A does not depend on wheel, law or own friction.
        let a = match self.desired.take() {
            Some((last, machine, runs))
                if (&last.preset, last.rate, last.observer, machine)
                    == (&group.preset, group.rate, group.observer, truth) =>
            {
                runs
            }
            _ => run(&cell, Role::Desired, "")?,
        };
        let a0 = run(&cell, Role::Own, "")?;
        let mut examples: Vec<Example> = Vec::new();
        if keeps {
            examples = shown(group, &a, &a0);
        }
        let mut references = None;
        for name in group.resolved(auto) {
            let search = |cell: &Cell| {
                if references.is_none() {
                    references = Some(search_references(cell, *threads, &done)?);
                }
                references.as_ref().map_or(Ok(f64::NAN), |references| best_width(cell, references, *threads, &done))
            };
            let cell = with_law(&cell, name, search)?;
            let b = run(&cell, Role::Rendered, name)?;
            let picked_this = name == auto;
            let prediction = picked.as_ref().and_then(|pick| pick.predicted.iter().find(|other| other.law == name));
            for example in &mut examples {
                if let (true, Some(trace)) = (picked_this || name == PAPER, b.of(example.scenario).first()) {
                    example.b.push((name, trace.clone()));
                }
            }
            let fade_velocity = if has_width(name) { cell.preset.bench.fade_velocity } else { f64::NAN };
            outcome.rows.extend(scores(&b, &a, &a0).into_iter().map(|score| Row {
                preset: group.preset.clone(),
                law: name,
                wheel: group.wheel,
                rate: group.rate,
                mismatch: group.mismatch.name,
                observer,
                auto: picked_this,
                predicted: prediction.map_or(f64::NAN, |prediction| prediction.difference(score.measure)),
                fade_velocity,
                score,
            }));
        }
        outcome.examples.append(&mut examples);
        self.desired = Some((group.clone(), truth, a));
        Ok(())
    }
}

/// Scenarios of the examples.
const SHOWN: [Scenario; 2] = [Scenario::SINE_2HZ, Scenario::HUNTING];

/// Examples of A and A0.
fn shown(group: &Group, a: &Runs, a0: &Runs) -> Vec<Example> {
    let of = |scenario| {
        let (a, a0) = (a.of(scenario).first()?.clone(), a0.of(scenario).first()?.clone());
        Some(Example { group: group.clone(), scenario, a, a0, b: Vec::new() })
    };
    SHOWN.into_iter().filter_map(of).collect()
}
