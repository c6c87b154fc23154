//! The runs of the project: numbers and folders, the catalogue, and replay and simulation of recorded runs.

mod replay;

use std::fs::File;
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

pub use replay::ReplayProgress;

use super::protocol::Answer;
use super::recorder::Ending;
use super::{Live, lock};
use crate::catalogue::{Catalogue, Details, Found, RunOrigin};
use replay::Replay;
use stickslip_base::{Error, Watch, input, output};
use stickslip_bench::run::Stored;
use stickslip_recording::export::{self, Part};

/// The runs of the project.
pub(super) struct Runs {
    folder: PathBuf,
    catalogue: Catalogue,
    entries: Sender<Entry>,
    /// Limit of the automatic records [bytes].
    record_limit: u64,
    /// Why the last run could not be entered.
    not_entered: Arc<Mutex<Option<String>>>,
    /// The next number, if the catalogue cannot be written.
    next: AtomicU64,
    /// The last replay that was requested.
    replay: Mutex<Replay>,
    /// The record of the last simulation.
    opened: Mutex<Option<(i64, Arc<Stored>)>>,
}

/// An item for the catalogue.
enum Entry {
    Run(RunOrigin),
    /// A measurement, whose record may still wait for its last changes.
    Measured(RunOrigin, Option<Ending>),
    End,
}

/// The thread that enters runs, so that no command of the axis waits for a disk.
pub(super) struct CatalogueThread {
    to: Sender<Entry>,
    thread: JoinHandle<()>,
}

impl CatalogueThread {
    /// Waits until all runs are entered.
    pub(super) fn finish(self) {
        let _ = self.to.send(Entry::End);
        let _ = self.thread.join();
    }
}

impl Runs {
    /// With a limit of the automatic records [bytes]. Enters runs that the end of the last program interrupted.
    pub(super) fn start(project: &Path, record_limit: u64) -> (Self, CatalogueThread) {
        let catalogue = Catalogue::of_project(project, Path::new("."));
        let (to, from): (_, Receiver<Entry>) = mpsc::channel();
        let not_entered = Arc::new(Mutex::new(None));
        let (index, failure) = (catalogue.clone(), not_entered.clone());
        let folder = project.join("runs");
        let interrupted = index.enter_interrupted(&folder);
        *lock(&failure) = interrupted.err().map(|error| error.to_string());
        let thread = thread::spawn(move || {
            loop {
                let (origin, ending) = match from.recv() {
                    Ok(Entry::Run(origin)) => (origin, None),
                    Ok(Entry::Measured(origin, ending)) => (origin, ending),
                    Ok(Entry::End) | Err(_) => return,
                };
                let mut entered = index.enter(&origin).map(drop);
                if let Some(ending) = ending {
                    ending.finish();
                    entered = entered.and_then(|()| index.limit_records(record_limit));
                }
                *lock(&failure) = entered.err().map(|error| error.to_string());
            }
        });
        let runs = Runs {
            folder,
            catalogue,
            entries: to.clone(),
            record_limit,
            not_entered,
            next: AtomicU64::new(1),
            replay: Mutex::default(),
            opened: Mutex::default(),
        };
        (runs, CatalogueThread { to, thread })
    }

    /// Passes a finished run to the catalogue thread; if the thread has ended, the run is not entered.
    pub(super) fn enter(&self, origin: RunOrigin) {
        let _ = self.entries.send(Entry::Run(origin));
    }

    /// The same for a measurement, with its recording.
    pub(super) fn enter_measured(&self, origin: RunOrigin, recording: Option<Ending>) {
        let _ = self.entries.send(Entry::Measured(origin, recording));
    }

    /// Enters a capture at once, and removes the oldest automatic files above their limit. Returns its number.
    pub(super) fn enter_now(&self, origin: &RunOrigin) -> Result<i64, Error> {
        let number = self.catalogue.enter(origin)?;
        self.catalogue.limit_records(self.record_limit.max(1))?;
        Ok(number.unwrap_or_default())
    }

    /// Notes why a run could not be saved.
    pub(super) fn report(&self, failure: String) {
        *lock(&self.not_entered) = Some(failure);
    }

    /// Size and limit of the automatic records.
    pub(super) fn records(&self) -> Result<Answer, Error> {
        self.catalogue.records(self.record_limit).map(Answer::Records)
    }

    /// Why the last run could not be entered.
    pub(super) fn not_entered(&self) -> Option<String> {
        lock(&self.not_entered).clone()
    }

    /// Folder of the project.
    pub(super) fn project(&self) -> &Path {
        self.folder.parent().unwrap_or(&self.folder)
    }

    /// A new number and folder for results; the folder does not exist yet.
    pub(super) fn folder(&self, name: &str) -> Result<(u64, PathBuf), Error> {
        output::create_folder(&self.folder)?;
        loop {
            // The number is reserved in the catalogue; if that cannot be written, the next own number is used.
            let reserved = self.catalogue.set_aside().ok().and_then(|number| u64::try_from(number).ok());
            let number = reserved.unwrap_or_else(|| self.next.fetch_add(1, Ordering::Relaxed));
            let begin = format!("{number:04}-");
            if of_run(&self.folder, &begin).is_none() {
                return Ok((number, self.folder.join(begin + name)));
            }
        }
    }

    pub(super) fn find(&self, query: &str, limit: u64) -> Result<Answer, Error> {
        let Found { runs, of, hints } = self.catalogue.runs(query, limit)?;
        Ok(Answer::Runs { runs, of, hints })
    }

    pub(super) fn details(&self, number: i64) -> Result<Answer, Error> {
        let Details { run, values } = self.catalogue.details(number)?;
        Ok(Answer::Run { run: Box::new(run), values, leaves_as: export::KINDS.map(String::from).to_vec() })
    }

    pub(super) fn edit(&self, edit: impl FnOnce(&Catalogue) -> Result<(), Error>) -> Result<Answer, Error> {
        edit(&self.catalogue).map(|()| Answer::Done {})
    }
}

/// The folder of a run, whose name begins with its number.
fn of_run(runs: &Path, begin: &str) -> Option<PathBuf> {
    let is_of_run = |entry: &std::fs::DirEntry| entry.file_name().to_string_lossy().starts_with(begin);
    Some(std::fs::read_dir(runs).ok()?.flatten().find(is_of_run)?.path())
}

impl Live {
    /// Path of a file of a run, by its name in the catalogue.
    ///
    /// # Errors
    /// [`LiveError::NoRun`](crate::LiveError::NoRun), [`LiveError::RunGone`](crate::LiveError::RunGone); [`Error::Unknown`] for an unknown name.
    pub fn run_file(&self, number: i64, name: &str) -> Result<PathBuf, Error> {
        let catalogue = &self.shared.runs.catalogue;
        let run = catalogue.details(number)?.run;
        let folder = catalogue.folder(number)?;
        // A record alone is a run without a folder.
        let path = if folder.is_dir() { folder.join(name) } else { folder.with_file_name(name) };
        // Links and names with other components may lead out of the folder.
        let within = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        let plain = within && path.symlink_metadata().is_ok_and(|about| about.is_file());
        if plain && run.files.iter().any(|file| file == name) {
            return Ok(path);
        }
        let remedy = format!("Available: {}.", run.files.join(", "));
        Err(Error::Unknown { what: "file of the run", name: name.into(), remedy })
    }

    /// The record `name` of a run in another file format (see [`export::export`]); the file is deleted when it is closed.
    ///
    /// # Errors
    /// As [`run_file`](Self::run_file) and [`export::export`].
    pub fn export_run(&self, number: i64, name: &str, kind: &str, watch: &Watch) -> Result<File, Error> {
        let from = self.run_file(number, name)?;
        // Checked before it becomes part of a file name.
        export::check_kind(kind)?;
        let to = tempfile::Builder::new().suffix(&format!(".{kind}")).tempfile();
        let to = to.map_err(|source| Error::file(&std::env::temp_dir(), "write into", source))?.into_temp_path();
        export::export(&from, &to, &Part::default(), watch)?;
        File::open(&to).map_err(|source| Error::file(&to, "open", source))
    }

    /// The page of a run's report.
    ///
    /// # Errors
    /// [`Error::Unknown`] if the run has no report; [`Error::File`] if the system refuses.
    pub fn report_page(&self, run: u64) -> Result<String, Error> {
        let page = of_run(&self.shared.runs.folder, &format!("{run:04}-")).map(|folder| folder.join("report.html"));
        // Links may lead out of the folder.
        let is_plain = |page: &PathBuf| page.symlink_metadata().is_ok_and(|about| about.is_file());
        let page = page.filter(is_plain).ok_or_else(|| Error::Unknown {
            what: "run with a report",
            name: run.to_string(),
            remedy: "The number is the start of a folder name in `runs`.".into(),
        })?;
        input::text(&page, input::RESULT)
    }
}
