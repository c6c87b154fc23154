//! A recording that is begun and ended while the bench runs.
//!
//! The scribe is there first: from then on it gets every cycle and every change. Then the loop gives its state at the
//! begin of one cycle; the record begins with it, and what came before is left out.

use crate::LiveError;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, mpsc};
use std::thread;
use std::time::{Duration, SystemTime};

use super::protocol::Answer;
use super::scribe::{Progress, Scribe};
use super::{Live, Shared, lock};
use crate::catalogue::Made;
use stickslip_base::{Error, output};
use stickslip_bench::run::{About, RunWriter};

/// After the last cycle of a record its changes may still come for so long: whoever made one hears of it, and tells it.
const CHANGES: Duration = Duration::from_millis(500);
/// Name of the file in its folder.
const FILE: &str = "run.mf4";

/// A recording under way.
pub(super) struct Recording {
    pub(super) scribe: Scribe,
    file: PathBuf,
    /// What the catalogue gets.
    made: Made,
}

impl Recording {
    /// From the first cycle on, into a file that was asked for.
    pub(super) fn from_start(shared: &Arc<Shared>, writer: RunWriter, file: &Path) -> Self {
        let made = Made::now(file, SystemTime::now(), None);
        let scribe = start(shared, file, move || Ok((writer, 0)));
        Recording { scribe, file: file.into(), made }
    }

    /// Waits until all is in the file, and has it entered.
    pub(super) fn finish(self, shared: &Shared) -> Result<(), Error> {
        let Recording { scribe, mut made, .. } = self;
        let ended = scribe.finish();
        made.duration = made.begun.elapsed().unwrap_or_default().as_secs_f64();
        // Also of a record that broke off: what was recorded is there.
        let _ = shared.clerk.send(Some(made));
        ended
    }
}

fn start(
    shared: &Arc<Shared>,
    file: &Path,
    open: impl FnOnce() -> Result<(RunWriter, u64), Error> + Send + 'static,
) -> Scribe {
    let progress = Arc::new(Mutex::new(Progress::default()));
    *lock(&shared.recording) = Some(file.display().to_string());
    *lock(&shared.progress) = progress.clone();
    let told = shared.clone();
    // Where the disk takes no more the bench goes on; what was recorded is kept.
    Scribe::start(open, progress, move |error| *lock(&told.recording) = Some(error.to_string()))
}

impl Live {
    /// Begins a recording with one of the next cycles.
    pub(super) fn record(&self, name: &str) -> Result<Answer, Error> {
        if name.is_empty() || !name.chars().all(|letter| letter.is_ascii_alphanumeric() || "-_".contains(letter)) {
            return Err(LiveError::RunText {
                text: name.into(),
                remedy: "A recording is named by letters, digits, - and _.",
            }
            .into());
        }
        let shared = &self.shared;
        let (number, folder) = self.folder(name)?;
        let file = folder.join(FILE);
        let (opened, heard) = mpsc::channel();
        {
            let mut recording = lock(&shared.recorder);
            if let Some(under_way) = recording.as_ref().filter(|recording| !recording.scribe.has_ended()) {
                return Err(LiveError::Busy { what: format!("a recording into {}", under_way.file.display()) }.into());
            }
            // One that broke off.
            let broken = recording.take();
            let (known, path) = (shared.clone(), file.clone());
            let open = move || {
                let begun = open(&known, &path);
                // Whoever asked has gone: what is recorded stays.
                let _ = opened.send(begun.as_ref().err().map(ToString::to_string));
                begun
            };
            let scribe = start(shared, &file, open);
            let words = Some(name.to_owned());
            let number = i64::try_from(number).ok();
            let made = Made { words, number, ..Made::now(&folder, SystemTime::now(), Some(shared.preset.clone())) };
            *recording = Some(Recording { scribe, file, made });
            drop(recording);
            if let Some(broken) = broken {
                // Told when it broke off.
                let _ = broken.finish(shared);
            }
        }
        match heard.recv() {
            Ok(None) => Ok(Answer::Done {}),
            Ok(Some(_)) | Err(_) => {
                let failed = lock(&shared.recorder).take();
                let failure = failed.map(|failed| failed.scribe.finish());
                *lock(&shared.recording) = None;
                // Empty, unless a person was quick.
                let _ = std::fs::remove_dir(&folder);
                match failure {
                    Some(Err(error)) => Err(error),
                    _ => Err(Error::BenchFault { cycle: 0, reason: "the recording did not begin; try again".into() }),
                }
            }
        }
    }

    /// Ends the recording.
    pub(super) fn end_record(&self) -> Result<Answer, Error> {
        let shared = &self.shared;
        match lock(&shared.recorder).as_mut() {
            Some(recording) => recording.scribe.close(),
            None => return Err(LiveError::NothingToEnd { what: "recording" }.into()),
        }
        // Whoever changes something by the urgent way has told it before he lets go of it.
        drop(lock(&shared.urgent));
        thread::sleep(CHANGES);
        let Some(recording) = lock(&shared.recorder).take() else { return Ok(Answer::Done {}) };
        let ended = recording.finish(shared);
        if ended.is_ok() {
            *lock(&shared.recording) = None;
        }
        ended.map(|()| Answer::Done {})
    }

    /// How much is recorded.
    pub(super) fn recorded(&self, rate: f64) -> Option<super::protocol::Recorded> {
        lock(&self.shared.recording).as_ref()?;
        let progress = lock(&self.shared.progress).clone();
        let Progress { from, rows, bytes, lost } = *lock(&progress);
        Some(super::protocol::Recorded { from, length: rows as f64 / rate, bytes, lost })
    }
}

/// The file, from a cycle on.
fn open(shared: &Shared, file: &Path) -> Result<(RunWriter, u64), Error> {
    if let Some(folder) = file.parent() {
        output::create_folder(folder)?;
    }
    // Parameters that enter meanwhile would be in force and not in the preset, or the other way round.
    let _one = lock(&shared.changing);
    let preset = *lock(&shared.tuning).preset();
    let by = shared.loaded_words().map_or(String::new(), |words| format!(" ({words})"));
    let about = About { command: format!("stickslip bench record{by}"), preset, seed: shared.seed };
    let keyframe = lock(&shared.keyframes).take()?;
    let writer = RunWriter::create_from(file, &about, &keyframe)?;
    Ok((writer, keyframe.cycle))
}
