//! The thread that commands the axis: motions and measurements, one at a time.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::time::{Duration, Instant, SystemTime};

use stickslip_core::control::reference::Reference;
use stickslip_core::render::Correction;
use stickslip_software::cycle::Parameters;
use stickslip_software::supervise::{Request, SafetyState};

use super::Shared;
use super::breakaway::BreakawayProgress;
use super::following::Following;
use super::measurements::Measurements;
use super::motion::MOVING;
use super::protocol::{Ended, MarkKind};
use crate::catalogue::{self, RunOrigin};
use stickslip_base::figure::Series;
use stickslip_base::preset::{Model, Settings};
use stickslip_base::{Error, Watch};
use stickslip_bench::external::External;
use stickslip_bench::{Bench, Change, ClockedBench, Injection, TimingReport};
use stickslip_experiment::workflow::correct::{Corrected, Iteration, Stopped, render_corrected};
use stickslip_experiment::workflow::measure::{Measurement, Outcome as _, Plan, measure_homed};
use stickslip_experiment::workflow::render::{RenderRun, Rendering};
use stickslip_experiment::{Part, home};

/// Polling interval while nothing runs.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// A job of the axis.
pub(super) enum Job {
    /// Adopt parameters that have become active.
    Adopt(Box<(Model<f64>, Settings<f64>, Parameters<f64>)>),
    /// Set the preload of the friction wheel.
    Preload(f64),
    /// Replace the loaded external, for these settings.
    Seat { external: Box<External>, settings: Box<Settings<f64>>, seated: Sender<Result<(), Error>> },
    /// Inject a fault.
    Inject(Injection),
    /// Follow a reference.
    Move { name: String, reference: Box<Reference<f64>>, render: bool },
    /// Move at the speed of the held button.
    Jog { render: bool },
    /// Run work to its end: results, if any, go into this folder; `begins` announces the measurement.
    Run { what: String, folder: Option<PathBuf>, begins: Box<Begins>, work: Box<Work> },
    /// End.
    End,
}

/// Announces the measurement at its start.
pub(super) type Begins = dyn FnOnce(&Measurements) + Send;

/// Work that runs to its end; whether it was completed. The measurements have the parts so far.
type Work = dyn FnOnce(&mut ClockedBench, &Watch, &Measurements) -> Result<bool, Error> + Send;
/// The result from the parts so far of a measurement, after this bench time [s]; `None` without data.
pub(super) type SoFar<P> = fn(&Measurements, f64) -> Option<<P as Plan>::Outcome>;

impl Job {
    pub(super) fn home() -> Self {
        let begins = Box::new(|_: &Measurements| {});
        Job::Run {
            what: "home".into(),
            folder: None,
            begins,
            work: Box::new(|bench, watch, _| home(bench, watch).map(|()| true)),
        }
    }

    /// Work with results in a folder.
    pub(super) fn run(
        what: String,
        folder: PathBuf,
        work: impl FnOnce(&mut ClockedBench, &Watch) -> Result<(), Error> + Send + 'static,
    ) -> Self {
        Job::Run {
            what,
            folder: Some(folder),
            begins: Box::new(|_| {}),
            work: Box::new(|bench, watch, _| work(bench, watch).map(|()| true)),
        }
    }

    /// Announces a friction curve of this number, with the rendering during it.
    pub(super) fn begins_curve(number: u64, planned: Option<Box<Rendering>>) -> Box<Begins> {
        Box::new(move |measurements| measurements.begin_curve(number, planned))
    }

    /// Announces a measurement at rest.
    pub(super) fn begins_at_rest(so_far: BreakawayProgress) -> Box<Begins> {
        Box::new(move |measurements| measurements.begin_at_rest(so_far))
    }

    /// Homes if necessary, measures, writes results into a folder; after a fault those so far.
    pub(super) fn measure<P: Plan + Send + 'static>(
        plan: P,
        preset: stickslip_base::Preset<f64>,
        begins: Box<Begins>,
        so_far: SoFar<P>,
        folder: PathBuf,
    ) -> Self {
        let to = folder.clone();
        let command = format!("stickslip serve, measure {}", P::KIND);
        let work = move |bench: &mut ClockedBench, watch: &Watch, measurements: &Measurements| {
            make_ready(bench, watch)?;
            let begun = Instant::now();
            match measure_homed(plan, &preset, bench, watch) {
                Ok(measured) => measured.write(&to, &command).map(|_| measured.outcome.complete()),
                Err(error) => {
                    if let Some(outcome) = so_far(measurements, begun.elapsed().as_secs_f64()) {
                        let stopped = Some(error.to_string());
                        let measured = Measurement { preset, seed: None, plan, outcome, clocked: None, stopped };
                        measured.write(&to, &command)?;
                    }
                    Err(error)
                }
            }
        };
        Job::Run { what: format!("measure {}", P::KIND), folder: Some(folder), begins, work: Box::new(work) }
    }

    /// The same for the friction that the load motor renders; `own` is the friction measured without rendering.
    pub(super) fn measure_rendered(
        planned: Rendering,
        preset: stickslip_base::Preset<f64>,
        own: Option<Series>,
        number: u64,
        folder: PathBuf,
    ) -> Self {
        let (to, plan) = (folder.clone(), planned.plan);
        let begins = Self::begins_curve(number, Some(Box::new(planned.clone())));
        let work = move |bench: &mut ClockedBench, watch: &Watch, measurements: &Measurements| {
            make_ready(bench, watch)?;
            let ended = render_corrected(&plan, &preset.bench.desired, 0, bench, watch);
            let (corrected, failure) = match ended {
                Ok(corrected) => (corrected, None),
                Err(error) => match rendered_so_far(planned, measurements, &error) {
                    Some(corrected) => (corrected, Some(error)),
                    None => return Err(error),
                },
            };
            let mut preset = preset;
            preset.plant.wheel.preload = bench.preload();
            let run = RenderRun { preset, seed: None, own, corrected };
            run.write(&to, "stickslip serve, measure friction --render")?;
            failure.map_or_else(|| Ok(run.complete()), Err)
        };
        Job::Run { what: "measure friction".into(), folder: Some(folder), begins, work: Box::new(work) }
    }
}

/// The rendered friction up to a fault; `None` without data.
fn rendered_so_far(planned: Rendering, measurements: &Measurements, error: &Error) -> Option<Corrected<Rendering>> {
    let plateaus = measurements.current_curve().plateaus;
    if plateaus.is_empty() {
        return None;
    }
    let measured = Rendering { curve: super::curve::of(plateaus), ..planned };
    let (correction, error_so_far) = (Correction::Nothing, measured.error_outside_fade());
    let iteration = Iteration { correction, error: error_so_far, uncertainty: f64::NAN, measured };
    Some(Corrected { iterations: vec![iteration], best_index: 0, stopped: Stopped::Fault(error.to_string()) })
}

/// Homes and enables the torque if necessary.
pub(super) fn make_ready(bench: &mut ClockedBench, watch: &Watch) -> Result<(), Error> {
    match (bench.safety(), bench.zero()) {
        (SafetyState::Running, Some(_)) => Ok(()),
        (SafetyState::Ready, Some(_)) => bench.change(Change::Request(Request::Start)),
        _ => home(bench, watch),
    }
}

/// Runs until [`Job::End`]. Returns the timing report.
pub(super) fn run(mut bench: ClockedBench, shared: &Arc<Shared>, jobs: &Receiver<Job>) -> Option<TimingReport> {
    let mut following: Option<Following> = None;
    loop {
        let job = if following.is_some() {
            match jobs.try_recv() {
                Ok(job) => Some(job),
                Err(TryRecvError::Empty) => None,
                Err(TryRecvError::Disconnected) => break,
            }
        } else {
            match jobs.recv_timeout(POLL_INTERVAL) {
                Ok(job) => Some(job),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => break,
            }
        };
        shared.parameters.loaded.count_calls();
        match job {
            Some(Job::End) => break,
            Some(Job::Adopt(adopted)) => bench.adopt(&adopted.0, &adopted.1, &adopted.2),
            Some(Job::Preload(preload)) => {
                let pressed = bench.set_preload(preload);
                shared.ended("preload", pressed.map(|()| None));
            }
            Some(Job::Seat { external, settings, seated }) => {
                let done = bench.seat(*external, &settings);
                shared.motion.idle();
                // The caller waits for it.
                let _ = seated.send(done);
            }
            // If the loop has ended, the status shows it.
            Some(Job::Inject(injection)) => drop(bench.inject(injection)),
            Some(Job::Move { name, reference, render }) => {
                shared.motion.progress(&name, MOVING, 0.0);
                following = Some(Following::reference(&bench, shared, name, &reference, render));
            }
            Some(Job::Jog { render }) => following = Some(Following::jog(shared, render)),
            Some(Job::Run { what, folder, begins, work }) => run_job(&mut bench, shared, &what, folder, begins, work),
            None => {}
        }
        match &mut following {
            Some(moving) => match moving.slice(&mut bench, shared) {
                Ok(true) => {}
                ended => {
                    shared.ended(moving.name(), ended.map(|_| None));
                    following = None;
                }
            },
            None => {
                // The stream shows faults; only this thread gets the reason for the end of the loop.
                if let Err(error) = bench.refresh()
                    && bench.granted().is_none()
                {
                    shared.acquisition.fail(error.to_string());
                }
            }
        }
    }
    bench.stop()
}

/// Runs work to its end, records its cycles and enters its results into the catalogue.
fn run_job(
    bench: &mut ClockedBench,
    shared: &Arc<Shared>,
    what: &str,
    folder: Option<PathBuf>,
    begins: Box<Begins>,
    work: Box<Work>,
) {
    let number = folder.as_ref().and_then(|folder| super::curve::number(folder.file_name()?.to_str()?));
    let number = number.and_then(|number| i64::try_from(number).ok());
    let preset = Some(shared.parameters.file());
    let origin =
        folder.as_ref().map(|folder| RunOrigin { number, ..RunOrigin::now(folder, SystemTime::now(), preset) });
    if let Some(origin) = &origin {
        shared.record_measurement(&origin.path, origin);
    }
    begins(&shared.measurements);
    let ended = work(bench, &shared.watch(what), &shared.measurements);
    shared.measurements.end();
    if let Some(origin) = origin {
        shared.enter_measurement(what, origin, &ended);
    }
    shared.ended(what, ended.map(|_| folder));
}

impl Shared {
    /// Enters a measurement with its record, also one that was stopped.
    fn enter_measurement(&self, what: &str, origin: RunOrigin, ended: &Result<bool, Error>) {
        let incomplete = match ended {
            Ok(true) => None,
            _ if self.motion.was_abandoned() => Some(self.operation.silence()),
            Ok(false) | Err(Error::Cancelled) => Some("stopped by the operator".to_owned()),
            Err(error) => Some(error.to_string()),
        };
        let recording = self.end_measurement(&origin.path);
        if incomplete.is_some() && recording.is_some() {
            let kind = if origin.path.to_string_lossy().ends_with("-render") { "render" } else { what };
            // Without a result there is only the record. If it cannot be written, the catalogue reports it.
            let _ = catalogue::write_incomplete(&origin.path, kind);
        }
        let duration = origin.begun.elapsed().unwrap_or_default().as_secs_f64();
        let automatic = recording.is_some();
        self.runs.enter_measured(RunOrigin { duration, incomplete, automatic, ..origin }, recording);
    }

    /// Reports the progress of a job, collects its parts, and cancels it.
    fn watch(self: &Arc<Self>, what: &str) -> Watch {
        let (shared, what, receiver) = (self.clone(), what.to_owned(), self.clone());
        Watch::new(self.motion.halt_flag(), move |stage, fraction| shared.motion.progress(&what, stage, fraction))
            .with_parts(move |part| Part::of(part).into_iter().for_each(|part| receiver.measurements.add(part)))
    }

    /// Notes the end of a job: the folder of its results, or its error.
    fn ended(&self, what: &str, ended: Result<Option<PathBuf>, Error>) {
        let abandoned = self.motion.take_abandoned();
        let (error, folder) = match ended {
            Err(_) if abandoned => (Some(self.operation.silence()), None),
            Ok(folder) => (None, folder.map(|folder| folder.display().to_string())),
            Err(error) => (Some(error.to_string()), None),
        };
        let text = error.as_ref().map_or_else(|| what.to_owned(), |error| format!("{what}: {error}"));
        self.acquisition.mark_now(MarkKind::End, text);
        self.motion.end(Ended { what: what.into(), error, folder });
    }
}
