//! The catalogue of a bench that runs: entered by a thread of its own, asked by whoever calls.

use std::path::{Component, Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::{self, JoinHandle};

use super::Live;
use super::protocol::Answer;
use crate::Error;
use crate::catalogue::{Catalogue, Details, Found, Made};

/// What is entered next; none: nothing comes any more.
pub(super) type Entry = Option<Made>;

/// Enters runs, so that nobody who commands an axis waits for a disk.
pub(super) struct Clerk {
    pub(super) to: Sender<Entry>,
    thread: JoinHandle<()>,
}

impl Clerk {
    /// `failed` hears why a run could not be entered, and nothing where the next one could.
    pub(super) fn start(catalogue: Catalogue, failed: impl Fn(Option<String>) + Send + 'static) -> Self {
        let (to, from): (_, Receiver<Entry>) = mpsc::channel();
        let thread = thread::spawn(move || {
            while let Ok(Some(made)) = from.recv() {
                failed(catalogue.enter(&made).err().map(|error| error.to_string()));
            }
        });
        Clerk { to, thread }
    }

    /// Waits until all is entered.
    pub(super) fn finish(self) {
        let _ = self.to.send(None);
        let _ = self.thread.join();
    }
}

/// Of a project.
pub(super) fn catalogue(project: &Path) -> Catalogue {
    Catalogue::of_project(project, Path::new("."))
}

impl Live {
    pub(super) fn runs(&self, query: &str, limit: u64) -> Result<Answer, Error> {
        let Found { runs, of, hints } = self.shared.catalogue.runs(query, limit)?;
        Ok(Answer::Runs { runs, of, hints })
    }

    pub(super) fn run(&self, number: i64) -> Result<Answer, Error> {
        let Details { run, values } = self.shared.catalogue.details(number)?;
        Ok(Answer::Run { run: Box::new(run), values })
    }

    /// Where a file of a run is, by the name that the catalogue has of it.
    ///
    /// # Errors
    /// [`Error::NoRun`], [`Error::RunGone`]; [`Error::Unknown`] for a name that is none of its files.
    pub fn run_file(&self, number: i64, name: &str) -> Result<PathBuf, Error> {
        let run = self.shared.catalogue.details(number)?.run;
        let path = self.shared.catalogue.folder(number)?.join(name);
        // A link may lead anywhere, and a name that somebody else has written as well.
        let within = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        let plain = within && path.symlink_metadata().is_ok_and(|about| about.is_file());
        if plain && run.files.iter().any(|file| file == name) {
            return Ok(path);
        }
        Err(Error::Unknown { what: "file of the run", name: name.into(), remedy: run.files.join(", ") })
    }

    pub(super) fn edited(&self, edit: impl FnOnce(&Catalogue) -> Result<(), Error>) -> Result<Answer, Error> {
        edit(&self.shared.catalogue).map(|()| Answer::Done {})
    }
}
