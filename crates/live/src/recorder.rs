//! Recordings, started and ended while the bench runs.
//!
//! The scribe is started first: from then on it receives every cycle and every change. Then the loop reports its state at
//! the start of one cycle; the record starts with this cycle, and earlier data are dropped.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, mpsc};
use std::thread;
use std::time::{Duration, SystemTime};

use super::protocol::{Answer, Recorded};
use super::runs::Runs;
use super::scribe::{Progress, Scribe};
use super::{Live, LiveError, Shared, lock};
use crate::catalogue::RunOrigin;
use stickslip_base::{Error, output};
use stickslip_bench::Keyframes;
use stickslip_bench::run::{About, RunWriter};

/// Delay with which changes of the last recorded cycle may arrive: they are reported after they are made.
const CHANGE_DELAY: Duration = Duration::from_millis(500);
/// Name of the file in its folder.
const FILE: &str = "run.mf4";

/// Records the cycles of the bench.
pub(super) struct Recorder {
    recording: Mutex<Option<Recording>>,
    report: Arc<Mutex<Option<Report>>>,
    /// State of the loop on request.
    keyframes: Mutex<Keyframes>,
}

/// A running recording.
pub(super) struct Recording {
    pub(super) scribe: Scribe,
    file: PathBuf,
    /// For the catalogue.
    origin: RunOrigin,
}

/// Status of a recording.
struct Report {
    /// The file, or why it could not be continued.
    text: String,
    progress: Arc<Mutex<Progress>>,
}

impl Recorder {
    pub(super) fn new(keyframes: Keyframes) -> Self {
        Recorder { recording: Mutex::default(), report: Arc::default(), keyframes: Mutex::new(keyframes) }
    }

    /// Starts with the first cycle, into an open file.
    pub(super) fn begin_at_start(&self, writer: RunWriter, file: &Path) {
        let origin = RunOrigin::now(file, SystemTime::now(), None);
        let scribe = self.start(file, move || Ok((writer, 0)));
        *lock(&self.recording) = Some(Recording { scribe, file: file.into(), origin });
    }

    /// Starts a recording into a file. Returns the previous recording, if it broke off.
    fn begin(
        &self,
        file: PathBuf,
        origin: RunOrigin,
        open: impl FnOnce() -> Result<(RunWriter, u64), Error> + Send + 'static,
    ) -> Result<Option<Recording>, Error> {
        let mut recording = lock(&self.recording);
        if let Some(running) = recording.as_ref().filter(|recording| !recording.scribe.has_ended()) {
            let what = format!("a recording into {}", running.file.display());
            return Err(LiveError::Busy { what, remedy: "End it first: `stickslip bench record --stop`." }.into());
        }
        let scribe = self.start(&file, open);
        Ok(recording.replace(Recording { scribe, file, origin }))
    }

    fn start(&self, file: &Path, open: impl FnOnce() -> Result<(RunWriter, u64), Error> + Send + 'static) -> Scribe {
        let progress = Arc::new(Mutex::new(Progress::default()));
        let reported = |text, progress| Some(Report { text, progress });
        *lock(&self.report) = reported(file.display().to_string(), progress.clone());
        let (report, written) = (self.report.clone(), progress.clone());
        // After a failure of the disk the bench continues; the recorded part is kept.
        Scribe::start(open, progress, move |error| *lock(&report) = reported(error.to_string(), written))
    }

    /// The running recording; the listener waits while it is locked.
    pub(super) fn recording(&self) -> MutexGuard<'_, Option<Recording>> {
        lock(&self.recording)
    }

    /// Ends the recording with the last cycle of the bench; the status shows a failure.
    pub(super) fn end(&self, runs: &Runs) {
        let recording = lock(&self.recording).take();
        let _ = recording.map(|recording| recording.finish(runs));
    }

    fn forget(&self) {
        *lock(&self.report) = None;
    }

    /// File or failure, and amount of recorded data at a tick rate.
    pub(super) fn status(&self, rate: f64) -> (Option<String>, Option<Recorded>) {
        let report = lock(&self.report);
        let recorded = report.as_ref().map(|report| {
            let Progress { from, rows, bytes, lost } = *lock(&report.progress);
            Recorded { from, length: rows as f64 / rate, bytes, lost }
        });
        (report.as_ref().map(|report| report.text.clone()), recorded)
    }
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
            let writer = open(&shared, &path);
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
        let failed = recorder.recording().take();
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
        match recorder.recording().as_mut() {
            Some(recording) => recording.scribe.close(),
            None => return Err(LiveError::NothingToEnd { what: "recording" }.into()),
        }
        motion.wait_for_change();
        thread::sleep(CHANGE_DELAY);
        let Some(recording) = recorder.recording().take() else { return Ok(Answer::Done {}) };
        recording.finish(runs)?;
        recorder.forget();
        Ok(Answer::Done {})
    }
}

/// Creates the file. Returns its writer and its first cycle.
fn open(shared: &Shared, file: &Path) -> Result<(RunWriter, u64), Error> {
    if let Some(folder) = file.parent() {
        output::create_folder(folder)?;
    }
    // A change in between would be active but missing in the recorded preset, or vice versa.
    let _one = shared.parameters.changing();
    let preset = shared.parameters.preset();
    let by = shared.parameters.loaded.words().map_or(String::new(), |words| format!(" ({words})"));
    let about = About { command: format!("stickslip bench record{by}"), preset, seed: shared.links.seed };
    let keyframe = lock(&shared.recorder.keyframes).take()?;
    let writer = RunWriter::create_from(file, &about, &keyframe)?;
    Ok((writer, keyframe.cycle))
}
