//! A loaded external on a running bench: its parameters, its execution times, and reopening of a changed file.

use crate::LiveError;
use std::path::PathBuf;
use std::sync::{Mutex, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use super::axis::Job;
use super::protocol::{Answer, LoadedStatus, MarkKind};
use super::{Live, lock};
use stickslip_base::Error;
use stickslip_bench::external::{BUDGET, External, ExternalFile, OperatorSide};
use stickslip_bench::tuning::{Loaded, selector};

/// Time limit for the answer to new values; normally it comes in the sample after the next.
const ANSWER_LIMIT: Duration = Duration::from_secs(3);
/// Polling interval of the answer.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// An open external file.
pub(super) struct OpenFile {
    file: ExternalFile,
    /// Folder of a library that is built from the file.
    folder: PathBuf,
    name: String,
    kind: String,
    hash: String,
    words: String,
    console: OperatorSide,
}

impl OpenFile {
    /// Opens a file.
    ///
    /// # Errors
    /// As [`ExternalFile::open`].
    pub(super) fn open(file: ExternalFile, folder: PathBuf) -> Result<(Self, External), Error> {
        let external = file.open(&folder, &mut |_| {})?;
        Ok(Self::of(external, file, folder))
    }

    fn of(mut external: External, file: ExternalFile, folder: PathBuf) -> (Self, External) {
        let (description, hash, words) = (external.description(), external.hash().to_owned(), external.words());
        let (name, kind) = (description.name.clone(), description.kind.clone());
        let console = external.console();
        (OpenFile { file, folder, name, kind, hash, words, console }, external)
    }

    /// Its description in a record.
    pub(super) fn words(&self) -> &str {
        &self.words
    }
}

/// The loaded file, if there is one.
pub(super) struct LoadedFile(Mutex<Option<OpenFile>>);

impl LoadedFile {
    pub(super) fn new(opened: Option<OpenFile>) -> Self {
        LoadedFile(Mutex::new(opened))
    }

    pub(super) fn replace(&self, opened: OpenFile) {
        *lock(&self.0) = Some(opened);
    }

    /// Passes new values to it, and waits until it accepts them.
    pub(super) fn put(&self, values: &[f64]) -> Result<(), Error> {
        let begin = Instant::now();
        let mut number = None;
        loop {
            {
                // Locked only for a moment: status and counts do not wait.
                let mut loaded = lock(&self.0);
                let Some(OpenFile { name, console, .. }) = loaded.as_mut() else { return Ok(()) };
                let number = *number.get_or_insert_with(|| console.put(values));
                match console.verdict(number) {
                    Some(0) => return Ok(()),
                    Some(code) => return Err(LiveError::ForeignRefuses { name: name.clone(), code }.into()),
                    None if begin.elapsed() < ANSWER_LIMIT => {}
                    None => {
                        let what = format!("a change of the parameters of {name} (no answer for 3 s)");
                        return Err(LiveError::Busy { what, remedy: "Try again, or start the bench again." }.into());
                    }
                }
            }
            thread::sleep(POLL_INTERVAL);
        }
    }

    pub(super) fn status(&self) -> Option<LoadedStatus> {
        let mut loaded = lock(&self.0);
        let loaded = loaded.as_mut()?;
        loaded.console.count();
        let (calls, responses, over_budget) = loaded.console.durations();
        let seconds = |q: stickslip_rt::Quantiles| [q.p50, q.p99, q.p999, q.max].map(|time| time as f64 * 1e-9);
        Some(LoadedStatus {
            role: loaded.file.role.name().into(),
            selector: selector(loaded.file.role).into(),
            name: loaded.name.clone(),
            kind: loaded.kind.clone(),
            file: loaded.file.path.display().to_string(),
            hash: loaded.hash.clone(),
            failed: loaded.console.failed(),
            calls: calls.count,
            call: seconds(calls),
            response: (responses.count > 0).then(|| seconds(responses)),
            budget: BUDGET as f64 * 1e-9,
            over_budget,
            late: loaded.console.late(),
        })
    }

    /// Collects the counts of its calls.
    pub(super) fn count_calls(&self) {
        // Another thread that holds the lock collects them as well.
        if let Ok(mut loaded) = self.0.try_lock() {
            loaded.iter_mut().for_each(|loaded| loaded.console.count());
        }
    }

    /// Its description in a record.
    pub(super) fn words(&self) -> Option<String> {
        lock(&self.0).as_ref().map(|loaded| loaded.words.clone())
    }

    /// The file, and the folder of a library built from it.
    fn origin(&self) -> Option<(ExternalFile, PathBuf)> {
        lock(&self.0).as_ref().map(|loaded| (loaded.file.clone(), loaded.folder.clone()))
    }
}

impl Live {
    /// Opens the file again; it starts at rest.
    pub(super) fn open_again(&self) -> Result<Answer, Error> {
        let parameters = &self.shared.parameters;
        let _one = parameters.changing();
        let (file, folder) = parameters.loaded.origin().ok_or(LiveError::NothingLoaded)?;
        let external = file.open_again(&folder, &mut |_| {})?;
        let (loaded, mut external) = OpenFile::of(external, file, folder);
        let mut tuning = parameters.tuning();
        let settings = tuning.preset().bench;
        tuning.bring(Loaded::new(&external, &settings))?;
        let values = tuning.loaded_values();
        for (index, value) in values.into_iter().enumerate() {
            external.begin_with(index, value);
        }
        let (seated, result) = mpsc::channel();
        let job = Job::Seat { external: Box::new(external), settings: Box::new(settings), seated };
        self.begin("open the file", job)?;
        let gone = |_| Error::BenchFault { cycle: 0, reason: "the bench has ended; start it again".into() };
        result.recv().map_err(gone)??;
        self.shared.acquisition.mark_now(MarkKind::Change, format!("opened again: {}", loaded.words()));
        parameters.replace_loaded(loaded, tuning);
        self.shared.save_state();
        Ok(Answer::Done {})
    }
}
