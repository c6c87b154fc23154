//! Comparison of controllers: each follows the same manoeuvres on the same friction, and the benchmark ranks them.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::SystemTime;

use stickslip_software::cycle::{Change, Parameters};

use super::run::{check_repetitions, manoeuvre, ready_at, unknown};
use crate::axis::Job;
use crate::catalogue::RunOrigin;
use crate::protocol::Answer;
use crate::{Live, Shared, lock};
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{Error, Preset, Watch};
use stickslip_bench::{Bench as _, ClockedBench, Command};
use stickslip_design as design;
use stickslip_experiment::trial::TrialMotion;
use stickslip_simulate::manoeuvre::Course;
use stickslip_study::benchmark::{Entrant, EntrantOnBench, Manoeuvre, Plan, run_on_bench};
use stickslip_study::trials::{Comparison, PreparedTrial, Ranking, friction_of};

/// Name of the controller that is active at the start.
const ACTIVE: &str = "active";

/// The parameters that were active before.
struct Former {
    model: Model<f64>,
    settings: Settings<f64>,
    parameters: Parameters<f64>,
}

/// What is compared.
struct Task {
    plan: Plan,
    active: String,
    friction: String,
    render: bool,
    run: u64,
    folder: PathBuf,
    tuned: PathBuf,
}

impl Live {
    /// Starts a comparison.
    pub(crate) fn compare(
        &self,
        controllers: &[String],
        manoeuvres: &[String],
        repetitions: u64,
        render: bool,
    ) -> Result<Answer, Error> {
        check_repetitions(repetitions, 2)?;
        self.renderable(render)?;
        let shared = &self.shared;
        let preset = shared.parameters.preset();
        let manoeuvres = manoeuvres.iter().map(|name| manoeuvre(name)).collect::<Result<Vec<_>, _>>()?;
        let refused = |question: &str, answer: usize, remedy: &str| {
            Err(Error::Answer { question: question.into(), answer: answer.to_string(), remedy: remedy.into() })
        };
        let mut distinct = controllers.to_vec();
        distinct.sort_unstable();
        distinct.dedup();
        if distinct.len() < 2 || distinct.len() != controllers.len() {
            return refused("the number of controllers", distinct.len(), "Choose at least two, each once.");
        }
        if manoeuvres.is_empty() {
            return refused("the number of manoeuvres", 0, "Choose at least one.");
        }
        for manoeuvre in &manoeuvres {
            shared.check_start(&TrialMotion::Manoeuvre(*manoeuvre), &preset)?;
        }
        let entrant = |name: &String| match name.as_str() {
            ACTIVE => Ok(Entrant::of_parameters(ACTIVE.into(), preset)),
            name if name.ends_with(".toml") => Err(unknown("controller", name, &[ACTIVE])),
            name => Entrant::find(name),
        };
        let entrants = controllers.iter().map(entrant).collect::<Result<Vec<_>, _>>()?;
        let (curve, friction) = friction_of(&preset, render);
        let mut plan = Plan::on_bench(shared.parameters.file(), preset, entrants, &curve, manoeuvres, repetitions);
        // The tuning leaves a processor to the loop.
        plan.threads = plan.threads.saturating_sub(1).max(1);
        let (run, folder) = shared.runs.folder("comparison")?;
        let tuned = shared.runs.project().join("tuned");
        let active = shared.active_controller(&preset);
        let task = Task { plan, active, friction, render, run, folder: folder.clone(), tuned };
        let of_work = shared.clone();
        let work = move |bench: &mut ClockedBench, watch: &Watch| task.run(&of_work, bench, watch);
        self.begin("compare controllers", Job::run("compare controllers".into(), folder, work))
    }
}

impl Task {
    /// Compares, and restores the former controller in any case.
    fn run(&self, shared: &Arc<Shared>, bench: &mut ClockedBench, watch: &Watch) -> Result<(), Error> {
        let former = Former { model: *bench.model(), settings: *bench.settings(), parameters: *bench.parameters() };
        let begun = Comparison {
            run: self.run,
            running: true,
            friction: self.friction.clone(),
            repetitions: self.plan.seeds,
            remarks: vec!["The controllers are tuned on the identified model; the axis rests.".into()],
            ..Comparison::default()
        };
        *lock(&shared.trials.comparison) = Some(begun);
        let compared = self.compare(&former, shared, bench, watch);
        let restored = former.restore(shared, bench);
        if let Some(comparison) = lock(&shared.trials.comparison).as_mut() {
            comparison.running = false;
            if let Err(error) = &compared {
                comparison.remarks.push(format!("Ended early: {error}"));
            }
        }
        compared.and(restored)
    }

    fn compare(
        &self,
        former: &Former,
        shared: &Arc<Shared>,
        bench: &mut ClockedBench,
        watch: &Watch,
    ) -> Result<(), Error> {
        let origin = ready_at(bench, watch)?;
        let mut trials: Vec<Vec<u64>> = vec![Vec::new(); self.plan.entrants.len()];
        let total = (self.plan.entrants.len() * self.plan.manoeuvres.len()) as f64;
        let mut follow = |entrant: &EntrantOnBench<'_>, manoeuvre: Manoeuvre| {
            // The parameters are set while the axis rests between two trials.
            former.activate(entrant, bench)?;
            let done = trials.iter().map(Vec::len).sum::<usize>() as f64;
            let (name, count) = (entrant.name.to_owned(), self.plan.entrants.len());
            let stage = format!("{name}, {} of {count}", entrant.index + 1);
            let report = watch.clone();
            let part = Watch::new(shared.motion.halt_flag(), move |step, fraction| {
                // A cancellation is checked by the trial itself.
                let _ = report.stage(&format!("{stage}: {step}"), (done + fraction) / total);
            });
            let (run, courses) = self.follow(entrant, manoeuvre, origin, shared, bench, &part)?;
            trials[entrant.index].push(run);
            Ok(courses)
        };
        let (outcome, error) = run_on_bench(&self.plan, &self.tuned, watch, &mut follow)?;
        let view = Ranking { run: self.run, friction: &self.friction, active: (ACTIVE, &self.active), trials: &trials }
            .of(&outcome);
        outcome.write(&self.folder, "stickslip serve, compare controllers")?;
        view.write(&self.folder)?;
        *lock(&shared.trials.comparison) = Some(Comparison { running: true, ..view });
        error.map_or(Ok(()), Err)
    }

    /// A controller follows a manoeuvre; the result is a run of its own.
    fn follow(
        &self,
        entrant: &EntrantOnBench<'_>,
        manoeuvre: Manoeuvre,
        origin: f64,
        shared: &Arc<Shared>,
        bench: &mut ClockedBench,
        watch: &Watch,
    ) -> Result<(u64, Vec<Option<Course>>), Error> {
        let begun = SystemTime::now();
        let (run, folder) = shared.runs.folder(&format!("test-{}", manoeuvre.name()))?;
        let prepared = PreparedTrial {
            preset: *entrant.preset,
            motion: TrialMotion::Manoeuvre(manoeuvre),
            controller: self.words(entrant),
            friction: self.friction.clone(),
            repetitions: self.plan.seeds,
            render: self.render,
        };
        let done = prepared.run(origin, run, &folder, bench, watch);
        if folder.is_dir() {
            let origin = RunOrigin::now(&folder, begun, Some(shared.parameters.file()));
            shared.runs.enter(RunOrigin { number: i64::try_from(run).ok(), ..origin });
        }
        let trial = done?.trial;
        if !trial.complete {
            return Err(Error::Cancelled);
        }
        Ok((run, trial.repetitions.into_iter().map(|repetition| Some(repetition.course)).collect()))
    }

    fn words(&self, entrant: &EntrantOnBench<'_>) -> String {
        if entrant.name == ACTIVE { self.active.clone() } else { entrant.name.replace('+', " + ") }
    }
}

impl Former {
    /// Activates the position control of an entrant; everything else stays.
    fn activate(&self, entrant: &EntrantOnBench<'_>, bench: &mut ClockedBench) -> Result<(), Error> {
        let mut parameters = self.parameters;
        if entrant.name != ACTIVE {
            let Preset { model, bench: settings, .. } = entrant.preset;
            design::check_delays(model, settings)?;
            parameters.tick.control = design::parameters(model, settings)?.tick.control;
            parameters.tick.control_period = settings.control_period();
        }
        bench.change(Change::Parameters(parameters))
    }

    /// Restores the former controller, also in a fault and before the queued commands.
    fn restore(&self, shared: &Shared, bench: &mut ClockedBench) -> Result<(), Error> {
        // A queued change of an entrant must not become active later: this one follows it, and the step waits for both.
        let _ = bench.change(Change::Parameters(self.parameters)).and_then(|()| bench.step(Command::default()));
        let restored = shared.motion.change(Change::Parameters(self.parameters));
        bench.adopt(&self.model, &self.settings, &self.parameters);
        restored.map(drop)
    }
}
