//! Start of a bench: its parameters, its machine, its services, its threads.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, mpsc};
use std::thread;

use stickslip_rt::ThreadSettings;

use super::implementation::Target;
use super::loaded::OpenFile;
use super::{
    Acquisition, ControllerDesign, Health, Implementation, Links, Live, Measurements, Motion, Operation, Parameters,
    Recorder, Runs, Shared, TargetState, Trials, axis, listener,
};
use stickslip_base::parameters::presets::Source;
use stickslip_base::{Error, Preset};
use stickslip_bench::external::ExternalFile;
use stickslip_bench::remote::Address;
use stickslip_bench::run::{About, RunWriter};
use stickslip_bench::tap::{Stream, tap};
use stickslip_bench::tuning::{Loaded, Tuning};
use stickslip_bench::{Bench as _, ClockedBench, Faulty, InProcess, OpenFieldbus, refusals};

/// Length of the listener's buffer [s]; after a longer delay, cycles are lost.
const ROOM: f64 = 4.0;

/// Default limit of the records of measurements in a project [bytes]; `--record-limit` documents it.
pub const RECORD_LIMIT: u64 = 2_000_000_000;

/// Settings for the start of a live bench.
#[derive(Clone, Debug)]
pub struct Start {
    /// Its parameters.
    pub source: Source,
    /// Address of its machine; `None`: in this process.
    pub io: Option<Address>,
    /// Opens a machine on a fieldbus; `None`: the program has no main device.
    pub fieldbus: Option<OpenFieldbus>,
    /// Seed of the noise of the virtual machine in this process.
    pub seed: u64,
    /// Requested settings of the real-time thread.
    pub thread_settings: ThreadSettings,
    /// Folder of runs and parameter sets.
    pub project: PathBuf,
    /// An external controller, friction or law, in addition to that of the preset; it is selected at the start.
    pub loaded: Option<ExternalFile>,
    /// File into which the run is recorded; it must not exist.
    pub record: Option<PathBuf>,
    /// Limit of the records of measurements in the project [bytes]: the oldest are removed first. 0: none are made.
    pub record_limit: u64,
    /// Timeout of the operator: the running activity stops after this time without a call [s]; `None`: no timeout.
    pub operator_time: Option<f64>,
}

impl Start {
    /// A set of parameters on the virtual machine, with results in a folder and without recording.
    pub fn new(source: Source, project: &Path) -> Self {
        let (thread_settings, project) = (ThreadSettings::default(), project.to_owned());
        let (record_limit, operator_time) = (RECORD_LIMIT, None);
        Start {
            source,
            io: None,
            fieldbus: None,
            seed: 1,
            thread_settings,
            project,
            loaded: None,
            record: None,
            record_limit,
            operator_time,
        }
    }
}

impl Live {
    /// Starts the bench, at rest and without torque.
    ///
    /// # Errors
    /// Invalid parameters; errors of the bench's design; [`BenchError::RealTime`](stickslip_bench::BenchError::RealTime).
    pub fn start(start: Start) -> Result<Self, Error> {
        let operation = Operation::new(start.operator_time)?;
        let mut tuning = Tuning::new(start.source.clone())?;
        let preset = *tuning.preset();
        let loaded = start.loaded.clone().map(|file| OpenFile::open(file, start.project.join("loaded"))).transpose()?;
        let (loaded, external) = loaded.unzip();
        if let Some(external) = &external {
            tuning.bring(Loaded::new(external, &preset.bench))?;
        }
        tuning.check_loop()?;
        let writer = start.record(&preset, loaded.as_ref())?;
        let (mut bench, stream) = start.connect(&preset)?;
        if let Some(external) = external {
            bench.seat(external, &preset.bench)?;
        }
        let sets = start.project.join("sets");
        let parameters = Parameters::new(start.source.file.clone(), &sets, tuning, loaded);
        let live = Self::run(&start, operation, parameters, bench, stream, writer);
        // The rendering law of the parameters is active from the first cycle on.
        let proposal = live.shared.parameters.read(Tuning::reset)?;
        live.enter(&proposal)?;
        live.shared.compare_state();
        Ok(live)
    }

    /// Assembles the services and starts the threads.
    fn run(
        start: &Start,
        operation: Operation,
        parameters: Parameters,
        mut bench: ClockedBench,
        stream: Stream,
        writer: Option<RunWriter>,
    ) -> Self {
        let recorder = Recorder::new(bench.keyframes().expect("taken only here"), start.record_limit > 0);
        let (runs, catalogue_thread) = Runs::start(&start.project, start.record_limit);
        let urgent = bench.urgent().expect("taken only here");
        let machine = start.io.as_ref().map_or_else(|| "virtual".into(), ToString::to_string);
        let target = Target::new(machine, bench.granted());
        let shared = Arc::new(Shared {
            acquisition: Acquisition::new(parameters.rate()),
            parameters,
            state: TargetState::open(&start.project),
            motion: Motion::new(urgent, bench.preload()),
            operation,
            recorder,
            runs,
            measurements: Measurements::new(&start.project.join("runs")),
            trials: Trials::new(&start.project.join("runs")),
            health: Health::new(bench.histograms()),
            implementation: Implementation::new(&start.project.join("build"), target),
            controller: ControllerDesign::default(),
            links: Links::new(start.virtual_seed(), &bench),
            closed: AtomicBool::new(false),
        });
        if let (Some(writer), Some(path)) = (writer, &start.record) {
            shared.recorder.begin_at_start(writer, path);
        }
        let refused = bench.granted().map(refusals).unwrap_or_default();
        let (jobs, jobs_out) = mpsc::channel();
        let (of_listener, of_axis) = (shared.clone(), shared.clone());
        let listener = thread::spawn(move || listener::run(stream, &of_listener));
        let axis = thread::spawn(move || axis::run(bench, &of_axis, &jobs_out));
        Live { shared, jobs, axis, listener, catalogue_thread, refused }
    }
}

impl Start {
    /// Seed of the noise; only for the virtual machine in this process.
    fn virtual_seed(&self) -> Option<u64> {
        self.io.is_none().then_some(self.seed)
    }

    /// Creates the file into which the run is recorded.
    fn record(&self, preset: &Preset<f64>, loaded: Option<&OpenFile>) -> Result<Option<RunWriter>, Error> {
        let Some(path) = &self.record else { return Ok(None) };
        if path.exists() {
            return Err(Error::file(path, "record into", std::io::ErrorKind::AlreadyExists.into()));
        }
        let by = loaded.map_or(String::new(), |loaded| format!(" ({})", loaded.words()));
        let about = About { command: format!("stickslip serve{by}"), preset: *preset, seed: self.virtual_seed() };
        RunWriter::create(path, &about).map(Some)
    }

    /// The bench on its machine, and the stream of its cycles.
    fn connect(&self, preset: &Preset<f64>) -> Result<(ClockedBench, Stream), Error> {
        let (tap, stream) = tap((ROOM * preset.bench.tick_rate) as usize);
        let bench = match &self.io {
            Some(address) => ClockedBench::connect(preset, address, self.fieldbus, self.thread_settings, Some(tap))?,
            None => {
                let (machine, readings) = InProcess::new(preset, self.seed)?;
                let machine = Faulty::new(machine, readings, preset.model.encoder, preset.bench.tick_time());
                ClockedBench::over(preset, machine, readings, self.thread_settings, Some(tap))?
            }
        };
        Ok((bench, stream))
    }
}
