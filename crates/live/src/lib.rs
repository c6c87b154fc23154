//! A bench that runs in real time and is operated by terminals, scripts and browsers at the same time.
//!
//! All clients use [`Live::call`] with the calls of [`protocol`], whose types are also the schema. The doors are in
//! `crates/app/src/serve`: HTTP, WebSocket, token and page. [`xcp`] serves the same bench to measurement and calibration
//! tools.
//!
//! Threads: the real-time loop of `stickslip_bench` does not know this crate and never waits for it. One thread commands
//! the axis (`axis.rs`), one takes every cycle from the tap and feeds captures and recordings (`listener.rs`), one writes
//! the record to the disk (`scribe.rs`). Everything else, including the design of parameters, runs on the thread of the
//! caller. Slow readers lose rows; the loss is counted.
#![forbid(unsafe_code)]

mod again;
mod at_rest;
mod axis;
pub mod capture_report;
mod captures;
pub mod catalogue;
mod controller;
mod curve;
mod error;
mod form;
mod implementation;
mod listener;
mod loaded;
mod losses;
mod machine;
mod marks;
mod operator;
mod orders;
mod preload;
pub mod protocol;
pub mod realtime;
mod record;
mod rendered;
mod runs;
mod scribe;
mod seen;
mod signals;
mod status;
#[cfg(test)]
mod tests;
pub mod xcp;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use at_rest::SoFar;
use axis::Job;
use captures::Captures;
use controller::Tuner;
use curve::Measured;
use implementation::{Builder, Target};
use listener::Newest;
use losses::Losses;
use marks::Marks;
use operator::Operator;
use orders::parse_reference;
use protocol::{Answer, Call, Changed, Doing, Ended, Item, Machine, PlanForm, Quantity, ToChatter, XcpStatus};
use record::Recording;
use runs::Clerk;
use scribe::Progress;
use stickslip_core::cycle::Change;
use stickslip_core::supervise::Request;
use stickslip_rt::{Histograms, Wishes};

use crate::catalogue::Catalogue;
use stickslip_base::parameters::presets::Source;
use stickslip_base::{Error, Watch};
use stickslip_bench::foreign::ForeignFile;
use stickslip_bench::remote::{Address, Traffic};
use stickslip_bench::run::{About, RunWriter};
use stickslip_bench::tap::tap;
use stickslip_bench::tuning::{Loaded, Sets, Tuning};
use stickslip_bench::{Bench as _, Clocked, ClockedBench, Faulty, InProcess, Keyframes, Urgent, refusals};
use stickslip_experiment::{BreakawayPlan, FrictionPlan, Part, PreslidingPlan};

/// How long whoever watches may sleep before cycles are lost [s].
const ROOM: f64 = 4.0;

/// What a live bench is started with.
#[derive(Clone, Debug)]
pub struct Start {
    /// Its parameters.
    pub source: Source,
    /// Where its machine is; in this process where it is `None`.
    pub io: Option<Address>,
    /// Seed of the noise of the virtual machine in this process.
    pub seed: u64,
    /// What is asked of the system.
    pub wishes: Wishes,
    /// Folder of runs and parameter sets.
    pub project: PathBuf,
    /// A controller, a friction or a law that is in the loop beside what the preset has, and acts first.
    pub loaded: Option<ForeignFile>,
    /// File that the run is recorded into; it must not be there yet.
    pub record: Option<PathBuf>,
    /// Without a sign of life of the operator for so long, what runs is stopped [s]; never where `None`.
    pub operator_time: Option<f64>,
}

impl Start {
    /// A set of parameters on the virtual machine, with results in a folder; nothing is recorded.
    pub fn new(source: Source, project: &Path) -> Self {
        let (wishes, project) = (Wishes::default(), project.to_owned());
        Start { source, io: None, seed: 1, wishes, project, loaded: None, record: None, operator_time: None }
    }
}

/// A bench that runs.
pub struct Live {
    shared: Arc<Shared>,
    jobs: mpsc::Sender<Job>,
    axis: JoinHandle<Option<Clocked>>,
    listener: JoinHandle<()>,
    clerk: Clerk,
    refused: Vec<String>,
}

/// What all threads know.
struct Shared {
    preset: String,
    project: PathBuf,
    sets: Sets,
    tuning: Mutex<Tuning>,
    /// What is loaded of a file.
    loaded: Mutex<Option<loaded::Opened>>,
    /// Held by who changes parameters: two who change at once do so one after the other.
    changing: Mutex<()>,
    urgent: Mutex<Urgent>,
    operator: Mutex<Operator>,
    captures: Mutex<Captures>,
    newest: Mutex<Newest>,
    marks: Mutex<Marks>,
    doing: Mutex<Option<Doing>>,
    last: Mutex<Option<Ended>>,
    preload: Mutex<f64>,
    /// What runs shall end.
    halt: Arc<AtomicBool>,
    /// How long an operator may be silent while something runs, and whether one was.
    operator_time: Option<Duration>,
    abandoned: AtomicBool,
    /// Whether faults can be injected: into the virtual machine of this process.
    faults: bool,
    histograms: Arc<Mutex<Histograms>>,
    traffic: Option<Arc<Traffic>>,
    /// The file that is recorded into, or why not any more.
    recording: Mutex<Option<String>>,
    /// Who writes it, and how much there is.
    recorder: Mutex<Option<Recording>>,
    progress: Mutex<Arc<Mutex<Progress>>>,
    /// The way to the whole state of the loop.
    keyframes: Mutex<Keyframes>,
    /// Seed of the machine, where it is in this process.
    seed: Option<u64>,
    /// The catalogue of runs, who enters them, and why the last one could not be.
    catalogue: Catalogue,
    clerk: mpsc::Sender<runs::Entry>,
    not_entered: Arc<Mutex<Option<String>>>,
    runs: AtomicU64,
    measured: Mutex<Measured>,
    at_rest: Mutex<SoFar>,
    losses: Mutex<Losses>,
    waits: Mutex<Losses>,
    /// The replay that was asked for last.
    again: Mutex<again::Current>,
    /// The record that is simulated.
    opened: Mutex<Option<(i64, Arc<stickslip_bench::run::Stored>)>>,
    /// The program, and what the system granted it.
    target: Target,
    builder: Mutex<Builder>,
    /// The tuning of a controller that was asked for last.
    tuner: Mutex<Tuner>,
    /// Code and diagram of the software in force.
    generated: Mutex<implementation::Made>,
    /// Where measurement and calibration tools may come in, and who has.
    xcp: Mutex<Vec<XcpStatus>>,
}

/// A thread that panicked has left what it held as it was.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Live {
    /// Switches it on, at rest and without torque.
    ///
    /// # Errors
    /// What is wrong with the parameters, what the design of the bench refuses; [`BenchError::RealTime`](stickslip_bench::BenchError::RealTime).
    pub fn start(start: Start) -> Result<Self, Error> {
        let Start { source, seed, io, wishes, project, loaded, record, operator_time } = start;
        let operator_time = operator_time.map(checked_time).transpose()?;
        let file = source.file.clone();
        let mut tuning = Tuning::new(source)?;
        let preset = *tuning.preset();
        let loaded = loaded.map(|file| loaded::Opened::open(file, project.join("loaded"))).transpose()?;
        let (loaded, foreign) = loaded.unzip();
        let writer = match &record {
            Some(path) if path.exists() => {
                return Err(Error::file(path, "record into", std::io::ErrorKind::AlreadyExists.into()));
            }
            Some(path) => {
                let by = loaded.as_ref().map_or(String::new(), |loaded| format!(" ({})", loaded.words()));
                let about =
                    About { command: format!("stickslip serve{by}"), preset, seed: io.is_none().then_some(seed) };
                Some(RunWriter::create(path, &about)?)
            }
            None => None,
        };
        let machine = io.as_ref().map_or_else(|| "virtual".into(), ToString::to_string);
        let seed_here = io.is_none().then_some(seed);
        let (tap, stream) = tap((ROOM * preset.bench.tick_rate) as usize);
        let faults = io.is_none();
        let mut bench = match io {
            Some(address) => ClockedBench::connect(&preset, &address, wishes, Some(tap))?,
            None => {
                let (machine, readings) = InProcess::new(&preset, seed)?;
                let machine = Faulty::new(machine, readings, preset.model.encoder, preset.bench.tick_time());
                ClockedBench::over(&preset, machine, readings, wishes, Some(tap))?
            }
        };
        if let Some(foreign) = foreign {
            tuning.bring(Loaded::new(&foreign, &preset.bench))?;
            bench.seat(foreign, &preset.bench)?;
        }
        let keyframes = Mutex::new(bench.keyframes().expect("nobody else has taken it"));
        let catalogue = runs::catalogue(&project);
        let not_entered = Arc::new(Mutex::new(None));
        let told = not_entered.clone();
        let clerk = Clerk::start(catalogue.clone(), move |fault| *lock(&told) = fault);
        let urgent = Mutex::new(bench.urgent().expect("nobody else has taken it"));
        let shared = Arc::new(Shared {
            preset: file,
            sets: Sets::new(&project.join("sets")),
            project,
            tuning: Mutex::new(tuning),
            loaded: Mutex::new(loaded),
            changing: Mutex::default(),
            urgent,
            operator: Mutex::default(),
            captures: Mutex::new(Captures::new()),
            newest: Mutex::new(Newest { state: "off", ..Newest::default() }),
            marks: Mutex::default(),
            doing: Mutex::default(),
            last: Mutex::default(),
            preload: Mutex::new(bench.preload()),
            halt: Arc::default(),
            operator_time,
            abandoned: AtomicBool::new(false),
            faults,
            histograms: bench.histograms(),
            traffic: bench.traffic(),
            recording: Mutex::default(),
            recorder: Mutex::default(),
            progress: Mutex::default(),
            keyframes,
            seed: seed_here,
            catalogue,
            clerk: clerk.to.clone(),
            not_entered,
            runs: AtomicU64::new(1),
            measured: Mutex::default(),
            at_rest: Mutex::default(),
            losses: Mutex::default(),
            waits: Mutex::default(),
            again: Mutex::default(),
            opened: Mutex::default(),
            target: Target::new(machine, bench.granted()),
            builder: Mutex::default(),
            tuner: Mutex::default(),
            generated: Mutex::default(),
            xcp: Mutex::default(),
        });
        if let (Some(writer), Some(path)) = (writer, &record) {
            *lock(&shared.recorder) = Some(Recording::from_start(&shared, writer, path));
        }
        let (jobs, jobs_out) = mpsc::channel();
        let (known, known_too) = (shared.clone(), shared.clone());
        let live = Live {
            refused: bench.granted().map(refusals).unwrap_or_default(),
            shared,
            jobs,
            listener: thread::spawn(move || listener::run(stream, &known)),
            axis: thread::spawn(move || axis::run(bench, &known_too, &jobs_out)),
            clerk,
        };
        // The rendering law that the parameters ask for is in force from the begin.
        let proposal = lock(&live.shared.tuning).reset()?;
        live.enter(&proposal)?;
        Ok(live)
    }

    /// What the system refused when it was asked for a thread of its own, each with what it costs and how to mend it.
    pub fn refused(&self) -> Vec<String> {
        self.refused.clone()
    }

    /// Ends it: what runs comes to rest; how the clock was kept.
    pub fn stop(self) -> Option<Clocked> {
        self.shared.halt.store(true, Ordering::Relaxed);
        lock(&self.shared.again).cancel();
        lock(&self.shared.builder).cancel();
        lock(&self.shared.tuner).cancel();
        // Where the axis has ended already there is nobody to tell.
        let _ = self.jobs.send(Job::End);
        let clocked = self.axis.join().ok().flatten();
        let _ = self.listener.join();
        self.clerk.finish();
        clocked
    }

    /// Asks or orders something.
    ///
    /// # Errors
    /// [`LiveError::Operated`] where somebody else operates; [`LiveError::Busy`] where something runs that it does not go with;
    /// [`Error::Refused`] by supervision; whatever is wrong with the call.
    pub fn call(&self, client: &str, call: Call) -> Result<Answer, Error> {
        let now = Instant::now();
        lock(&self.shared.operator).seen(client, now);
        if call.changes() {
            lock(&self.shared.operator).claim(client, now).map_err(|by| LiveError::Operated { by })?;
        }
        match call {
            Call::Status {} => Ok(Answer::Status(Box::new(self.status()))),
            Call::Operate {} => {
                lock(&self.shared.operator).take(client, now);
                Ok(Answer::Done {})
            }
            Call::Home {} => self.begin("home", Job::home()),
            Call::Start {} => self.request(Request::Start),
            Call::Arm {} => self.request(Request::Arm),
            Call::Stop {} => {
                self.shared.halt.store(true, Ordering::Relaxed);
                self.request(Request::Stop)
            }
            Call::Off {} => {
                self.shared.halt.store(true, Ordering::Relaxed);
                self.request(Request::Off)
            }
            Call::Acknowledge {} => self.request(Request::Acknowledge),
            Call::Halt {} => {
                self.shared.halt.store(true, Ordering::Relaxed);
                Ok(Answer::Done {})
            }
            Call::Move { reference, values, render } => {
                let parsed = parse_reference(&reference, values.iter().map(|(name, value)| (name.as_str(), *value)))?;
                if render {
                    // A margin takes a moment: nobody waits for it who only looks.
                    let tuning = lock(&self.shared.tuning).clone();
                    tuning.renderable()?;
                }
                let job = Job::Move { name: reference.clone(), reference: Box::new(parsed), render };
                self.begin(&reference, job)
            }
            Call::Inject { fault } => self.inject(&fault),
            Call::Preload { preload } => {
                stickslip_bench::io::check_preload(preload)?;
                self.begin("preload", Job::Preload(preload))?;
                *lock(&self.shared.preload) = preload;
                Ok(Answer::Done {})
            }
            Call::Measure { what: Quantity::Friction, plan, render: true } => self.measure_rendered(&plan),
            Call::Measure { what, render: true, .. } => {
                let remedy = "Only the friction curve is measured while the load motor renders.".into();
                Err(Error::Unknown { what: "measurement under the law", name: format!("{what:?}"), remedy })
            }
            Call::Measure { what, plan, .. } => match what {
                Quantity::Friction => {
                    self.measure::<FrictionPlan<f64>>(&plan, |_, _, number| Job::begins_curve(number, None))
                }
                Quantity::Breakaway => self.measure::<BreakawayPlan<f64>>(&plan, |plan, preset, _| {
                    Job::begins_at_rest(SoFar::breakaway(plan, &preset.model))
                }),
                Quantity::Presliding => self.measure::<PreslidingPlan<f64>>(&plan, |_, _, _| {
                    Job::begins_at_rest(SoFar::Presliding(Vec::new(), Vec::new()))
                }),
            },
            Call::Set { values } => {
                let changes: Vec<_> = values.into_iter().collect();
                self.propose(|tuning| tuning.set(&changes))
            }
            Call::Undo {} => self.propose(Tuning::undo),
            Call::Redo {} => self.propose(Tuning::redo),
            Call::Reset {} => self.propose(Tuning::reset),
            Call::Load { name } => {
                let source = self.shared.sets.find(&name)?;
                self.propose(|tuning| tuning.load(source))
            }
            Call::Save { name } => {
                let text = lock(&self.shared.tuning).text().to_owned();
                self.shared.sets.save(&name, &text).map(|()| Answer::Done {})
            }
            Call::Sets {} => Ok(Answer::Names { names: self.shared.sets.names() }),
            Call::Parameters {} => Ok(Answer::Text { text: lock(&self.shared.tuning).text().to_owned() }),
            Call::Differences {} => {
                let differences = Changed::all(&lock(&self.shared.tuning).differences());
                Ok(Answer::Differences { differences })
            }
            Call::Items {} => Ok(Answer::Items { items: Item::list(lock(&self.shared.tuning).entries()) }),
            Call::Preview { values } => {
                let tuning = lock(&self.shared.tuning).clone();
                let changes: Vec<_> = values.into_iter().collect();
                Ok(Answer::Differences { differences: Changed::all(&tuning.preview(&changes)?) })
            }
            Call::Machine {} => {
                let preset = *lock(&self.shared.tuning).preset();
                Ok(Answer::Machine(Box::new(Machine::of(&preset, *lock(&self.shared.preload)))))
            }
            Call::Flow {} => self.flow(),
            Call::DiagramPage { page } => self.diagram_page(&page),
            Call::Timing {} => Ok(self.timing()),
            Call::Target {} => Ok(self.target()),
            Call::Build {} => self.build(),
            Call::Built {} => Ok(self.built()),
            Call::EndBuild {} => Ok(self.end_build()),
            Call::Plan { what, thorough, plan } => {
                let preset = *lock(&self.shared.tuning).preset();
                Ok(Answer::Plan(Box::new(PlanForm::of(what, thorough, &plan, &preset)?)))
            }
            Call::Curve { run } => Ok(Answer::Curve(Box::new(self.curve(run)?))),
            Call::Curves {} => Ok(Answer::Curves { curves: self.curves() }),
            Call::AtRest { what, run } => Ok(Answer::AtRest(Box::new(self.at_rest(what, run)?))),
            Call::AdvisePreload { values } => {
                let values: Vec<_> = values.into_iter().collect();
                Ok(Answer::AdvisedPreload(self.advise_preload(&values)?))
            }
            Call::Losses {} => {
                let [lost, held] = self.losses();
                Ok(Answer::Losses { lost, held })
            }
            Call::Rendered { run } => Ok(Answer::Rendered(Box::new(self.rendered(run)?))),
            Call::SaveReport {} => self.save_report(),
            Call::Ask {} => {
                lock(&self.shared.operator).ask(client, now);
                Ok(Answer::Done {})
            }
            Call::HandOver { grant } => {
                lock(&self.shared.operator).hand_over(grant, now);
                Ok(Answer::Done {})
            }
            Call::Sketch(sketch) => {
                let preset = *lock(&self.shared.tuning).preset();
                Ok(Answer::Drawn(Box::new(sketch.draw(&preset)?)))
            }
            Call::Margin { values } => {
                let tuning = lock(&self.shared.tuning).clone();
                let changes: Vec<_> = values.into_iter().collect();
                let (law, margin) = tuning.margin_with(&changes)?;
                Ok(Answer::Margin(ToChatter::of(&law, margin)?))
            }
            Call::Loop(draft) => self.draft_loop(&draft),
            Call::Hunting { draft, desired } => self.draft_hunting(&draft, desired),
            Call::Tune(draft) => self.begin_tuning(client, &draft),
            Call::Tuned {} => Ok(self.tuned()),
            Call::EndTuning {} => self.end_tuning(client),
            Call::OpenAgain {} => self.open_again(),
            Call::Signals {} => Ok(signals::all()),
            Call::Capture { signals, trigger, before, after, decimation } => {
                let rate = lock(&self.shared.tuning).preset().bench.tick_rate;
                lock(&self.shared.captures).begin(signals, &trigger, [before, after], decimation, rate)
            }
            Call::Fetch { capture } => lock(&self.shared.captures).fetch(capture),
            Call::Stream { signals, every } => {
                let rate = lock(&self.shared.tuning).preset().bench.tick_rate;
                lock(&self.shared.captures).watch(&signals, every, rate)
            }
            Call::Points { capture } => lock(&self.shared.captures).points(capture),
            Call::Samples { signals } => {
                let rate = lock(&self.shared.tuning).preset().bench.tick_rate;
                lock(&self.shared.captures).sample(&signals, rate)
            }
            Call::Marks {} => Ok(Answer::Marks { marks: lock(&self.shared.marks).all() }),
            Call::Drop { capture } => lock(&self.shared.captures).end(capture).map(|()| Answer::Done {}),
            Call::Record { name } => self.record(&name),
            Call::EndRecord {} => self.end_record(),
            Call::Runs { query, limit } => self.runs(&query, limit),
            Call::Run { number } => self.run(number),
            Call::Replay { number } => self.again(number),
            Call::EndReplay {} => Ok(self.end_again()),
            Call::Simulate { number, values, signals, length, parts } => {
                self.simulate(number, values, &signals, length, parts)
            }
            Call::Story { number } => self.story(number),
            Call::Courses { numbers, signal, align, from, to, parts } => {
                self.courses(&numbers, &signal, &align, from.zip(to), parts)
            }
            Call::RenameRun { number, name } => self.edited(|catalogue| catalogue.rename(number, &name)),
            Call::TagRun { number, add, remove } => self.edited(|catalogue| catalogue.tag(number, &add, &remove)),
            Call::NoteRun { number, note } => self.edited(|catalogue| catalogue.note(number, &note)),
            Call::DeleteRun { number } => self.edited(|catalogue| catalogue.delete(number)),
            Call::RestoreRun { number } => self.edited(|catalogue| catalogue.restore(number).map(drop)),
        }
    }
}

impl Shared {
    fn doing(&self, doing: Option<Doing>) {
        *lock(&self.doing) = doing;
    }

    /// Stops what runs where the operator is silent for too long.
    fn watch_operator(&self) {
        let Some(limit) = self.operator_time else { return };
        let silent = lock(&self.operator).silent(Instant::now()).is_some_and(|silent| silent > limit);
        if silent && lock(&self.doing).is_some() && !self.abandoned.swap(true, Ordering::Relaxed) {
            self.halt.store(true, Ordering::Relaxed);
            // Refused where it stops already; a loop that has ended needs no stop.
            drop(lock(&self.urgent).change(Change::Request(Request::Stop)));
        }
    }

    /// Where the set-point rests, or the axis is [rad].
    fn held(&self) -> f64 {
        let newest = lock(&self.newest);
        if newest.signals.control > 0.5 { newest.signals.setpoint.position } else { newest.signals.angle }
    }

    /// Hears how far something is, and cancels it.
    fn watch(self: &Arc<Self>, what: &str) -> Watch {
        let (shared, what) = (self.clone(), what.to_owned());
        let hears = self.clone();
        Watch::new(self.halt.clone(), move |stage, fraction| {
            shared.doing(Some(Doing { what: what.clone(), stage: stage.into(), fraction }));
        })
        .with_parts(move |part| Part::of(part).into_iter().for_each(|part| hears.part(part)))
    }
}

/// A time that can be waited for.
fn checked_time(seconds: f64) -> Result<Duration, Error> {
    let [minimum, maximum] = [0.1, 3600.0];
    if (minimum..=maximum).contains(&seconds) {
        return Ok(Duration::from_secs_f64(seconds));
    }
    let remedy = "A client that polls is heard ten times a second.";
    Err(Error::OutOfRange { name: "the operator's time", value: seconds, unit: "s", minimum, maximum, remedy })
}

pub use error::LiveError;
