//! The runs of the project: their numbers and folders, the catalogue, and recorded runs once more.

mod replay;

use std::fs::File;
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

pub use replay::ReplayProgress;

use super::protocol::Answer;
use super::{Live, lock};
use crate::catalogue::{Catalogue, Details, Found, RunOrigin};
use replay::Replay;
use stickslip_base::{Error, Watch, output};
use stickslip_bench::run::Stored;
use stickslip_recording::export::{self, Part};

/// The runs of the project.
pub(super) struct Runs {
    folder: PathBuf,
    catalogue: Catalogue,
    clerk: Sender<Option<RunOrigin>>,
    /// Why the last run could not be entered.
    not_entered: Arc<Mutex<Option<String>>>,
    /// The next number, if the catalogue cannot be written.
    next: AtomicU64,
    /// The last replay that was requested.
    replay: Mutex<Replay>,
    /// The record of the last simulation.
    opened: Mutex<Option<(i64, Arc<Stored>)>>,
}

/// The thread that enters runs, so that no command of the axis waits for a disk.
pub(super) struct CatalogueThread {
    /// Runs that have ended; `None` ends the thread.
    to: Sender<Option<RunOrigin>>,
    thread: JoinHandle<()>,
}

impl CatalogueThread {
    /// Waits until all runs are entered.
    pub(super) fn finish(self) {
        let _ = self.to.send(None);
        let _ = self.thread.join();
    }
}

impl Runs {
    pub(super) fn start(project: &Path) -> (Self, CatalogueThread) {
        let catalogue = Catalogue::of_project(project, Path::new("."));
        let (to, from): (_, Receiver<Option<RunOrigin>>) = mpsc::channel();
        let not_entered = Arc::new(Mutex::new(None));
        let (index, failure) = (catalogue.clone(), not_entered.clone());
        let thread = thread::spawn(move || {
            while let Ok(Some(made)) = from.recv() {
                let entered = index.enter(&made);
                *lock(&failure) = entered.err().map(|error| error.to_string());
            }
        });
        let runs = Runs {
            folder: project.join("runs"),
            catalogue,
            clerk: to.clone(),
            not_entered,
            next: AtomicU64::new(1),
            replay: Mutex::default(),
            opened: Mutex::default(),
        };
        (runs, CatalogueThread { to, thread })
    }

    /// Has a run entered that has ended. A clerk that has gone has reported why.
    pub(super) fn enter(&self, made: RunOrigin) {
        let _ = self.clerk.send(Some(made));
    }

    /// Why the last run could not be entered.
    pub(super) fn not_entered(&self) -> Option<String> {
        lock(&self.not_entered).clone()
    }

    /// Number and folder for results, which does not exist yet.
    pub(super) fn folder(&self, name: &str) -> Result<(u64, PathBuf), Error> {
        output::create_folder(&self.folder)?;
        loop {
            // Its number in the catalogue as well; if that cannot be written, the next one.
            let aside = self.catalogue.set_aside().ok().and_then(|number| u64::try_from(number).ok());
            let number = aside.unwrap_or_else(|| self.next.fetch_add(1, Ordering::Relaxed));
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
    /// Where a file of a run is, by the name that the catalogue has of it.
    ///
    /// # Errors
    /// [`LiveError::NoRun`](crate::LiveError::NoRun), [`LiveError::RunGone`](crate::LiveError::RunGone); [`Error::Unknown`] for a name that is none of its files.
    pub fn run_file(&self, number: i64, name: &str) -> Result<PathBuf, Error> {
        let catalogue = &self.shared.runs.catalogue;
        let run = catalogue.details(number)?.run;
        let folder = catalogue.folder(number)?;
        // Of a record alone the run is the file itself.
        let path = if folder.is_dir() { folder.join(name) } else { folder.with_file_name(name) };
        // A link or a external name may lead anywhere.
        let within = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        let plain = within && path.symlink_metadata().is_ok_and(|about| about.is_file());
        if plain && run.files.iter().any(|file| file == name) {
            return Ok(path);
        }
        Err(Error::Unknown { what: "file of the run", name: name.into(), remedy: run.files.join(", ") })
    }

    /// The record `name` of a run as another kind of file (see [`export::export`]), gone as soon as it is closed.
    ///
    /// # Errors
    /// As [`run_file`](Self::run_file) and [`export::export`].
    pub fn export_run(&self, number: i64, name: &str, kind: &str, watch: &Watch) -> Result<File, Error> {
        let from = self.run_file(number, name)?;
        // Before it is part of a file name.
        export::known(kind)?;
        let to = tempfile::Builder::new().suffix(&format!(".{kind}")).tempfile();
        let to = to.map_err(|source| Error::file(&std::env::temp_dir(), "write into", source))?.into_temp_path();
        export::export(&from, &to, &Part::default(), watch)?;
        File::open(&to).map_err(|source| Error::file(&to, "open", source))
    }

    /// The page of a run's report.
    ///
    /// # Errors
    /// [`Error::Unknown`] where the run has none; [`Error::File`] if the system refuses.
    pub fn report_page(&self, run: u64) -> Result<String, Error> {
        let page = of_run(&self.shared.runs.folder, &format!("{run:04}-")).map(|folder| folder.join("report.html"));
        // A link may lead anywhere.
        let is_plain = |page: &PathBuf| page.symlink_metadata().is_ok_and(|about| about.is_file());
        let page = page.filter(is_plain).ok_or_else(|| Error::Unknown {
            what: "run with a report",
            name: run.to_string(),
            remedy: "Its number is the begin of a folder's name in `runs`.".into(),
        })?;
        std::fs::read_to_string(&page).map_err(|source| Error::file(&page, "read", source))
    }
}
