//! The catalogue of a bench that runs: entered by a thread of its own, asked by whoever calls.

use std::fs::File;
use std::path::{Component, Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::{self, JoinHandle};

use super::Live;
use super::protocol::Answer;
use crate::catalogue::{Catalogue, Details, Found, Made};
use stickslip_base::{Error, Watch};
use stickslip_recording::export::{self, Part};

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
        Ok(Answer::Run { run: Box::new(run), values, leaves_as: export::KINDS.map(String::from).to_vec() })
    }

    /// Where a file of a run is, by the name that the catalogue has of it.
    ///
    /// # Errors
    /// [`LiveError::NoRun`](crate::LiveError::NoRun), [`LiveError::RunGone`](crate::LiveError::RunGone); [`Error::Unknown`] for a name that is none of its files.
    pub fn run_file(&self, number: i64, name: &str) -> Result<PathBuf, Error> {
        let run = self.shared.catalogue.details(number)?.run;
        let folder = self.shared.catalogue.folder(number)?;
        // Of a record alone the run is the file itself.
        let path = if folder.is_dir() { folder.join(name) } else { folder.with_file_name(name) };
        // A link may lead anywhere, and a name that somebody else has written as well.
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
        // Before it stands in the name of a file.
        export::known(kind)?;
        let to = tempfile::Builder::new().suffix(&format!(".{kind}")).tempfile();
        let to = to.map_err(|source| Error::file(&std::env::temp_dir(), "write into", source))?.into_temp_path();
        export::export(&from, &to, &Part::default(), watch)?;
        File::open(&to).map_err(|source| Error::file(&to, "open", source))
    }

    pub(super) fn edited(&self, edit: impl FnOnce(&Catalogue) -> Result<(), Error>) -> Result<Answer, Error> {
        edit(&self.shared.catalogue).map(|()| Answer::Done {})
    }
}
