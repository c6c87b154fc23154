//! The benchmark on a bench: its entrants follow the manoeuvres on the friction of the bench, and are scored and ranked
//! as in simulation. The repetitions replace the seeds of noise.

use std::path::Path;

use stickslip_core::friction::Stribeck;

use super::study::{judged, tune_all};
use super::{CellResult, Entrant, FrictionCase, Manoeuvre, Outcome, Plan, VARIATIONS};
use stickslip_base::preset::Preset;
use stickslip_base::{Error, Watch, output};
use stickslip_simulate::manoeuvre::Course;

/// Name of the friction of a bench.
pub const BENCH: &str = "bench";

impl Plan {
    /// A plan for a bench: the entrants follow the manoeuvres on one friction, so often each.
    pub fn on_bench(
        machine: impl Into<String>,
        preset: Preset<f64>,
        entrants: Vec<Entrant>,
        friction: &Stribeck<f64>,
        manoeuvres: Vec<Manoeuvre>,
        repetitions: u64,
    ) -> Self {
        let frictions = vec![FrictionCase::of_curve(BENCH, friction, preset.bench.controller.torque_limit())];
        let (seeds, places) = (repetitions, repetitions);
        Plan { frictions, variations: Vec::new(), manoeuvres, seeds, places, ..Plan::new(machine, preset, entrants) }
    }
}

/// An entrant whose turn it is.
#[derive(Clone, Copy, Debug)]
pub struct EntrantOnBench<'a> {
    /// Its position in the plan.
    pub index: usize,
    /// Its name.
    pub name: &'a str,
    /// The parameters with its controller; the modelled friction is that of the plan.
    pub preset: &'a Preset<f64>,
}

/// Lets an entrant follow a manoeuvre: one course for each repetition, `None` where it failed.
pub type Follow<'a> = dyn FnMut(&EntrantOnBench<'_>, Manoeuvre) -> Result<Vec<Option<Course>>, Error> + 'a;

/// Runs a plan of [`Plan::on_bench`]. The built-in controllers are tuned first; results of the tuning are stored in
/// `folder`. After a cancellation or a fault, the outcome holds the finished entrants.
///
/// # Errors
/// Errors of tuning and of `run`, both before the first entrant has finished.
pub fn run_on_bench(
    plan: &Plan,
    folder: &Path,
    watch: &Watch,
    run: &mut Follow<'_>,
) -> Result<(Outcome, Option<Error>), Error> {
    output::create_folder(folder)?;
    let friction = plan.frictions[0];
    let tuned = tune_all(plan, &friction, folder, watch)?;
    let mut outcome = Outcome { plan: plan.clone(), cells: Vec::new(), tuned, courses: Vec::new(), complete: true };
    let modelled = friction.on(&plan.preset);
    for (index, entrant) in plan.entrants.iter().enumerate() {
        let controller = entrant
            .tuned_as()
            .and_then(|name| outcome.tuned.iter().find(|(other, _)| *other == name).map(|(_, controller)| *controller));
        let preset = entrant.on(&modelled, controller);
        let mut courses = Vec::new();
        let entrant = EntrantOnBench { index, name: &entrant.name, preset: &preset };
        let mut follow = |entrant: &EntrantOnBench<'_>, manoeuvre| {
            let followed = run(entrant, manoeuvre)?;
            let first = followed.iter().flatten().next().cloned();
            courses.extend(first.map(|course| (entrant.name.to_owned(), manoeuvre, course)));
            Ok(followed)
        };
        let cell = cell(plan, &entrant, &mut follow);
        outcome.courses.extend(courses);
        match cell {
            Ok(cell) => outcome.cells.push(cell),
            Err(error) if outcome.cells.is_empty() => return Err(error),
            Err(error) => {
                outcome.complete = false;
                return Ok((outcome, Some(error)));
            }
        }
    }
    Ok((outcome, None))
}

/// All manoeuvres of an entrant.
fn cell(plan: &Plan, entrant: &EntrantOnBench<'_>, run: &mut Follow<'_>) -> Result<CellResult, Error> {
    let mut runs = Vec::new();
    for manoeuvre in &plan.manoeuvres {
        for (k, course) in run(entrant, *manoeuvre)?.into_iter().enumerate() {
            let chance = Plan::chance(k as u64, plan.seeds);
            let numbers = course.map(|course| judged(*manoeuvre, &course, entrant.preset, chance));
            runs.push((manoeuvre.name().to_owned(), numbers));
        }
    }
    let (friction, variation) = (BENCH.to_owned(), VARIATIONS[0].name.to_owned());
    Ok(CellResult { entrant: entrant.name.into(), friction, variation, runs, follows_from: String::new() })
}

#[cfg(test)]
mod tests {
    use super::super::rank;
    use super::*;
    use stickslip_base::parameters::presets::find;

    fn plan(folder: &Path) -> Plan {
        let preset: Preset<f64> = find("clm-bench").unwrap().read().unwrap();
        let mut other = preset;
        other.bench.hold = Default::default();
        let path = folder.join("other.toml");
        std::fs::write(&path, stickslip_base::parameters::write_commented(&other)).unwrap();
        let entrants =
            vec![Entrant::of_parameters("active".into(), preset), Entrant::find(path.to_str().unwrap()).unwrap()];
        Plan::on_bench("bench", preset, entrants, &preset.model.own, vec![Manoeuvre::FastSine], 3)
    }

    /// A course with a constant deviation.
    fn course(preset: &Preset<f64>, deviation: f64) -> Course {
        let samples = (Manoeuvre::FastSine.reference(preset, 0.5).1 / preset.bench.control_period()).round() as usize;
        let all = |value: f64| vec![value; samples];
        Course {
            period: preset.bench.control_period(),
            deviation: all(deviation),
            velocity: all(0.0),
            torque: all(0.0),
        }
    }

    #[test]
    fn the_factor_is_the_ratio_of_the_deviations_with_its_interval_over_the_repetitions() {
        let folder = tempfile::tempdir().unwrap();
        let plan = plan(folder.path());
        let (outcome, error) = run_on_bench(&plan, folder.path(), &Watch::silent(), &mut |entrant, _| {
            let deviation = |k: f64| (2.0 - entrant.index as f64) * (0.01 + 1e-4 * k);
            Ok((0..3).map(|k| Some(course(entrant.preset, deviation(f64::from(k))))).collect())
        })
        .unwrap();
        assert!(outcome.complete && error.is_none());
        let ranks = rank(&outcome, BENCH);
        assert_eq!(ranks.iter().map(|it| it.place).collect::<Vec<_>>(), [Some([1, 1]), Some([2, 2])]);
        assert!(ranks[0].entrant.ends_with("other.toml") && (ranks[0].factor - 2.0).abs() < 1e-9, "{ranks:?}");
        assert!(outcome.summary().to_json().contains("other.toml"));
        assert!(outcome.report("test").is_ok());
    }

    #[test]
    fn after_a_fault_the_finished_entrants_remain() {
        let folder = tempfile::tempdir().unwrap();
        let plan = plan(folder.path());
        let fault = || Error::BenchFault { cycle: 7, reason: "encoder stuck".into() };
        let mut run = |entrant: &EntrantOnBench<'_>, _: Manoeuvre| match entrant.index {
            0 => Ok((0..3).map(|_| Some(course(entrant.preset, 0.01))).collect()),
            _ => Err(fault()),
        };
        let (outcome, error) = run_on_bench(&plan, folder.path(), &Watch::silent(), &mut run).unwrap();
        assert!(!outcome.complete && outcome.cells.len() == 1 && error.unwrap().to_string().contains("encoder stuck"));
        let failed = run_on_bench(&plan, folder.path(), &Watch::silent(), &mut |_, _| Err(fault()));
        assert!(failed.is_err());
    }
}
