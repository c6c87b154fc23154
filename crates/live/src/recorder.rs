//! Recordings of the bench: one on request, or from the start on, and one of each measurement.
//!
//! The recording is started first: from then on it receives every cycle and every change. Then the loop reports its state
//! at the start of one cycle; the record starts with this cycle, and earlier data are dropped.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, mpsc};
use std::thread;
use std::time::{Duration, SystemTime};

use super::protocol::{Answer, Recorded};
use super::runs::Runs;
use super::{Live, LiveError, Shared, lock};
use crate::catalogue::RunOrigin;
use stickslip_base::{Error, output};
use stickslip_bench::Keyframes;
use stickslip_bench::run::{About, Progress, RunWriter, Scribe};

/// Delay with which changes of the last recorded cycle may arrive: they are reported after they are made.
const CHANGE_DELAY: Duration = Duration::from_millis(500);
/// Name of the file in its folder.
pub(super) const FILE: &str = "run.mf4";

/// Records the cycles of the bench.
pub(super) struct Recorder {
    recordings: Arc<Mutex<Recordings>>,
    report: Arc<Mutex<Option<Report>>>,
    /// State of the loop on request.
    keyframes: Mutex<Keyframes>,
    /// Whether measurements are recorded.
    automatic: bool,
    /// Why the last recording of a measurement is not complete.
    failure: Arc<Mutex<Option<String>>>,
}

/// The running recordings.
#[derive(Default)]
pub(super) struct Recordings {
    requested: Option<Recording>,
    /// Those of measurements: the present one, and ended ones that wait for their last changes.
    measurements: Vec<Recording>,
}

/// A running recording.
pub(super) struct Recording {
    pub(super) scribe: Scribe,
    file: PathBuf,
    /// For the catalogue.
    origin: RunOrigin,
    progress: Arc<Mutex<Progress>>,
}

/// Status of a recording.
struct Report {
    /// The file, or why it could not be continued.
    text: String,
    progress: Arc<Mutex<Progress>>,
}

/// An ended recording of a measurement, to be completed on another thread.
pub(super) struct Ending {
    recordings: Arc<Mutex<Recordings>>,
    file: PathBuf,
}

impl Recordings {
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Recording> {
        self.requested.iter_mut().chain(&mut self.measurements)
    }
}

impl Recorder {
    /// With recordings of measurements or without.
    pub(super) fn new(keyframes: Keyframes, automatic: bool) -> Self {
        let keyframes = Mutex::new(keyframes);
        Recorder { recordings: Arc::default(), report: Arc::default(), keyframes, automatic, failure: Arc::default() }
    }

    /// Starts with the first cycle, into an open file.
    pub(super) fn begin_at_start(&self, writer: RunWriter, file: &Path) {
        let origin = RunOrigin::now(file, SystemTime::now(), None);
        let recording = self.requested(file.into(), origin, move || Ok((writer, 0)));
        lock(&self.recordings).requested = Some(recording);
    }

    /// Starts a recording into a file. Returns the previous recording, if it broke off.
    fn begin(
        &self,
        file: PathBuf,
        origin: RunOrigin,
        open: impl FnOnce() -> Result<(RunWriter, u64), Error> + Send + 'static,
    ) -> Result<Option<Recording>, Error> {
        let mut recordings = lock(&self.recordings);
        if let Some(running) = recordings.requested.as_ref().filter(|recording| !recording.scribe.has_ended()) {
            let what = format!("a recording into {}", running.file.display());
            return Err(LiveError::Busy { what, remedy: "End it first: `stickslip bench record --stop`." }.into());
        }
        let recording = self.requested(file, origin, open);
        Ok(recordings.requested.replace(recording))
    }

    /// A recording on request, which the status reports.
    fn requested(
        &self,
        file: PathBuf,
        origin: RunOrigin,
        open: impl FnOnce() -> Result<(RunWriter, u64), Error> + Send + 'static,
    ) -> Recording {
        let progress = Arc::new(Mutex::new(Progress::default()));
        let reported = |text, progress| Some(Report { text, progress });
        *lock(&self.report) = reported(file.display().to_string(), progress.clone());
        let (report, written) = (self.report.clone(), progress.clone());
        // After a failure of the disk the bench continues; the recorded part is kept.
        let failed = move |error: &Error| *lock(&report) = reported(error.to_string(), written);
        Recording { scribe: Scribe::start(open, progress.clone(), failed), file, origin, progress }
    }

    /// The running recordings; the listener waits while they are locked.
    pub(super) fn recordings(&self) -> MutexGuard<'_, Recordings> {
        lock(&self.recordings)
    }

    /// Ends the recording on request with the last cycle of the bench; the status shows a failure.
    pub(super) fn end(&self, runs: &Runs) {
        let recording = lock(&self.recordings).requested.take();
        let _ = recording.map(|recording| recording.finish(runs));
    }

    fn forget(&self) {
        *lock(&self.report) = None;
    }

    /// File or failure, and amount of recorded data at a tick rate.
    pub(super) fn status(&self, rate: f64) -> (Option<String>, Option<Recorded>) {
        let report = lock(&self.report);
        let recorded = report.as_ref().map(|report| recorded(&report.progress, rate));
        (report.as_ref().map(|report| report.text.clone()), recorded)
    }

    /// Amount of recorded data of the running measurement.
    pub(super) fn measurement(&self, rate: f64) -> Option<Recorded> {
        let recordings = lock(&self.recordings);
        let running = recordings.measurements.iter().find(|recording| !recording.scribe.is_closed())?;
        Some(recorded(&running.progress, rate))
    }

    /// Why the last recording of a measurement is not complete.
    pub(super) fn failure(&self) -> Option<String> {
        lock(&self.failure).clone()
    }
}

fn recorded(progress: &Mutex<Progress>, rate: f64) -> Recorded {
    let Progress { from, rows, bytes, lost } = *lock(progress);
    Recorded { from, length: rows as f64 / rate, bytes, lost }
}

impl Recording {
    /// Waits until all data are in the file, and enters the run into the catalogue.
    fn finish(self, runs: &Runs) -> Result<(), Error> {
        let Recording { scribe, mut origin, .. } = self;
        let ended = scribe.finish();
        origin.duration = origin.begun.elapsed().unwrap_or_default().as_secs_f64();
        // Also a record that broke off: its recorded part is complete.
        runs.enter(origin);
        ended
    }
}

impl Ending {
    /// Waits for the last changes, and until all data are in the file.
    pub(super) fn finish(self) {
        thread::sleep(CHANGE_DELAY);
        let recording = {
            let all = &mut lock(&self.recordings).measurements;
            all.iter().position(|recording| recording.file == self.file).map(|at| all.remove(at))
        };
        // A failure was reported when it occurred.
        let _ = recording.map(|recording| recording.scribe.finish());
    }
}

impl Shared {
    /// Starts the recording of a measurement into its folder. A failure does not prevent the measurement: it is reported.
    pub(super) fn record_measurement(self: &Arc<Self>, folder: &Path, origin: &RunOrigin) {
        if !self.recorder.automatic {
            return;
        }
        let file = folder.join(FILE);
        let (opened, result) = mpsc::channel();
        let (shared, path) = (self.clone(), file.clone());
        let open = move || {
            let writer = open(&shared, &path, "stickslip serve, measure");
            // Without a receiver the recording continues.
            let _ = opened.send(());
            writer
        };
        *lock(&self.recorder.failure) = None;
        let failure = self.recorder.failure.clone();
        let failed = move |error: &Error| {
            *lock(&failure) = Some(format!("The measurement is not recorded completely: {error}"));
        };
        let progress = Arc::new(Mutex::new(Progress::default()));
        {
            // No cycle arrives between the start of the scribe and its entry.
            let mut recordings = lock(&self.recorder.recordings);
            let scribe = Scribe::start(open, progress.clone(), failed);
            recordings.measurements.push(Recording { scribe, file, origin: origin.clone(), progress });
        }
        // The first cycles of the measurement belong to the record.
        let _ = result.recv();
    }

    /// Ends the recording of the measurement in a folder with the present cycle.
    pub(super) fn end_measurement(&self, folder: &Path) -> Option<Ending> {
        let file = folder.join(FILE);
        let mut recordings = self.recorder.recordings();
        recordings.measurements.iter_mut().find(|recording| recording.file == file)?.scribe.close();
        Some(Ending { recordings: self.recorder.recordings.clone(), file })
    }
}

impl Live {
    /// Starts a recording with one of the next cycles.
    pub(super) fn record(&self, name: &str) -> Result<Answer, Error> {
        if name.is_empty() || !name.chars().all(|letter| letter.is_ascii_alphanumeric() || "-_".contains(letter)) {
            let remedy = "The name of a recording has letters, digits, - and _.";
            return Err(LiveError::RunText { text: name.into(), remedy }.into());
        }
        let Shared { recorder, runs, parameters, .. } = &*self.shared;
        let (number, folder) = runs.folder(name)?;
        let file = folder.join(FILE);
        let (opened, result) = mpsc::channel();
        let (shared, path) = (self.shared.clone(), file.clone());
        let open = move || {
            let writer = open(&shared, &path, "stickslip bench record");
            // Without a receiver the recording continues.
            let _ = opened.send(writer.is_ok());
            writer
        };
        let number = i64::try_from(number).ok();
        let origin = RunOrigin::now(&folder, SystemTime::now(), Some(parameters.file()));
        if let Some(broken) =
            recorder.begin(file, RunOrigin { words: Some(name.to_owned()), number, ..origin }, open)?
        {
            // The status showed why it broke off.
            let _ = broken.finish(runs);
        }
        if let Ok(true) = result.recv() {
            return Ok(Answer::Done {});
        }
        let failed = recorder.recordings().requested.take();
        let failure = failed.map(|failed| failed.scribe.finish());
        recorder.forget();
        // Fails if a file was put into it meanwhile.
        let _ = std::fs::remove_dir(&folder);
        match failure {
            Some(Err(error)) => Err(error),
            _ => Err(Error::BenchFault { cycle: 0, reason: "the recording did not start; try again".into() }),
        }
    }

    /// Ends the recording.
    pub(super) fn end_record(&self) -> Result<Answer, Error> {
        let Shared { recorder, runs, motion, .. } = &*self.shared;
        match recorder.recordings().requested.as_mut() {
            Some(recording) => recording.scribe.close(),
            None => return Err(LiveError::NothingToEnd { what: "recording" }.into()),
        }
        motion.wait_for_change();
        thread::sleep(CHANGE_DELAY);
        let Some(recording) = recorder.recordings().requested.take() else { return Ok(Answer::Done {}) };
        recording.finish(runs)?;
        recorder.forget();
        Ok(Answer::Done {})
    }
}

/// Creates the file. Returns its writer and its first cycle.
fn open(shared: &Shared, file: &Path, command: &str) -> Result<(RunWriter, u64), Error> {
    if let Some(folder) = file.parent() {
        output::create_folder(folder)?;
    }
    // A change in between would be active but missing in the recorded preset, or vice versa.
    let _one = shared.parameters.changing();
    let preset = shared.parameters.preset();
    let by = shared.parameters.loaded.words().map_or(String::new(), |words| format!(" ({words})"));
    let about = About { command: format!("{command}{by}"), preset, seed: shared.links.seed };
    let keyframe = lock(&shared.recorder.keyframes).take()?;
    let writer = RunWriter::create_from(file, &about, &keyframe)?;
    Ok((writer, keyframe.cycle))
}
