//! What was loaded from a file, on a bench that runs: its numbers, how long it takes, and opened again when
//! its file has become another.

use crate::LiveError;
use std::path::PathBuf;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use super::axis::Job;
use super::protocol::{Answer, LoadedStatus, MarkKind};
use super::{Live, Shared, lock};
use stickslip_base::Error;
use stickslip_bench::foreign::{BUDGET, Console, Foreign, ForeignFile};
use stickslip_bench::tuning::{Loaded, selector};

/// It says so soon what it says of other values: unless it hangs, in the sample after the next.
const SOON: Duration = Duration::from_secs(3);
/// From look to look at whether it has.
const LOOK: Duration = Duration::from_millis(1);

/// What is in the loop.
pub(super) struct Opened {
    file: ForeignFile,
    /// Where a library is made that is made of it.
    folder: PathBuf,
    name: String,
    kind: String,
    hash: String,
    words: String,
    console: Console,
}

impl Opened {
    /// Opens it.
    ///
    /// # Errors
    /// As [`ForeignFile::open`].
    pub(super) fn open(file: ForeignFile, folder: PathBuf) -> Result<(Self, Foreign), Error> {
        let foreign = file.open(&folder, &mut |_| {})?;
        Ok(Self::of(foreign, file, folder))
    }

    fn of(mut foreign: Foreign, file: ForeignFile, folder: PathBuf) -> (Self, Foreign) {
        let (description, hash, words) = (foreign.description(), foreign.hash().to_owned(), foreign.words());
        let (name, kind) = (description.name.clone(), description.kind.clone());
        let console = foreign.console();
        (Opened { file, folder, name, kind, hash, words, console }, foreign)
    }

    /// As a record names it.
    pub(super) fn words(&self) -> &str {
        &self.words
    }
}

impl Live {
    /// Gives it other values.
    pub(super) fn tell_loaded(&self, values: &[f64]) -> Result<(), Error> {
        let begin = Instant::now();
        let mut number = None;
        loop {
            {
                // Whoever looks is not kept waiting.
                let mut loaded = lock(&self.shared.loaded);
                let Some(Opened { name, console, .. }) = loaded.as_mut() else { return Ok(()) };
                let number = *number.get_or_insert_with(|| console.put(values));
                match console.verdict(number) {
                    Some(0) => return Ok(()),
                    Some(code) => return Err(LiveError::ForeignRefuses { name: name.clone(), code }.into()),
                    None if begin.elapsed() < SOON => {}
                    None => return Err(LiveError::Busy { what: format!("{name}, which does not answer") }.into()),
                }
            }
            thread::sleep(LOOK);
        }
    }

    /// Opens its file again, which begins at rest.
    pub(super) fn open_again(&self) -> Result<Answer, Error> {
        let shared = &self.shared;
        let _one = lock(&shared.changing);
        let known = lock(&shared.loaded).as_ref().map(|loaded| (loaded.file.clone(), loaded.folder.clone()));
        let (file, folder) = known.ok_or(LiveError::NothingLoaded)?;
        let foreign = file.open_again(&folder, &mut |_| {})?;
        let (loaded, mut foreign) = Opened::of(foreign, file, folder);
        let settings = lock(&shared.tuning).preset().bench;
        let mut tuning = lock(&shared.tuning).clone();
        tuning.bring(Loaded::new(&foreign, &settings))?;
        let values = tuning.loaded_values();
        for (index, value) in values.into_iter().enumerate() {
            foreign.begin_with(index, value);
        }
        let (seated, heard) = mpsc::channel();
        let job = Job::Seat { foreign: Box::new(foreign), settings: Box::new(settings), seated };
        self.begin("open the file", job)?;
        let gone = |_| Error::BenchFault { cycle: 0, reason: "the bench has ended; start it anew".into() };
        heard.recv().map_err(gone)??;
        shared.mark_now(MarkKind::Change, format!("opened again: {}", loaded.words()));
        *lock(&shared.loaded) = Some(loaded);
        *lock(&shared.tuning) = tuning;
        Ok(Answer::Done {})
    }

    pub(super) fn loaded_status(&self) -> Option<LoadedStatus> {
        let mut loaded = lock(&self.shared.loaded);
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
}

impl Shared {
    /// Counts its calls that were made since.
    pub(super) fn count_calls(&self) {
        // Whoever holds it counts as well.
        if let Ok(mut loaded) = self.loaded.try_lock() {
            loaded.iter_mut().for_each(|loaded| loaded.console.count());
        }
    }

    /// What is loaded, as a record names it.
    pub(super) fn loaded_words(&self) -> Option<String> {
        lock(&self.loaded).as_ref().map(|loaded| loaded.words.clone())
    }
}
