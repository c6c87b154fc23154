//! A controller that was loaded from a file, on a bench that runs: its numbers, how long it takes, and opened again when
//! its file has become another.

use std::path::PathBuf;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use super::axis::Job;
use super::protocol::{Answer, LoadedStatus, MarkKind};
use super::{Live, Shared, lock};
use crate::Error;
use crate::foreign::{BUDGET, Console, ControllerFile, Foreign};
use crate::tuning::Loaded;

/// It says so soon what it says of other values: unless it hangs, in the sample after the next.
const SOON: Duration = Duration::from_secs(3);
/// From look to look at whether it has.
const LOOK: Duration = Duration::from_millis(1);

/// The controller in the loop.
pub(super) struct Controller {
    file: ControllerFile,
    /// Where a library is made that is made of it.
    folder: PathBuf,
    name: String,
    kind: String,
    hash: String,
    console: Console,
}

impl Controller {
    /// Opens it.
    ///
    /// # Errors
    /// As [`ControllerFile::open`].
    pub(super) fn open(file: ControllerFile, folder: PathBuf) -> Result<(Self, Foreign), Error> {
        let foreign = file.open(&folder, &mut |_| {})?;
        Ok(Self::of(foreign, file, folder))
    }

    fn of(mut foreign: Foreign, file: ControllerFile, folder: PathBuf) -> (Self, Foreign) {
        let (description, hash) = (foreign.description(), foreign.hash().to_owned());
        let (name, kind) = (description.name.clone(), description.kind.clone());
        let console = foreign.console();
        (Controller { file, folder, name, kind, hash, console }, foreign)
    }

    /// As a record names it.
    pub(super) fn words(&self) -> String {
        format!("{}, SHA-256 {}", self.name, self.hash)
    }
}

impl Live {
    /// Gives the loaded controller other values.
    pub(super) fn tell_controller(&self, values: &[f64]) -> Result<(), Error> {
        let begin = Instant::now();
        let mut number = None;
        loop {
            {
                // Whoever looks is not kept waiting.
                let mut controller = lock(&self.shared.controller);
                let Some(Controller { name, console, .. }) = controller.as_mut() else { return Ok(()) };
                let number = *number.get_or_insert_with(|| console.put(values));
                match console.verdict(number) {
                    Some(0) => return Ok(()),
                    Some(code) => return Err(Error::ForeignRefuses { name: name.clone(), code }),
                    None if begin.elapsed() < SOON => {}
                    None => return Err(Error::Busy { what: format!("{name}, which does not answer") }),
                }
            }
            thread::sleep(LOOK);
        }
    }

    /// Opens the file of the loaded controller again, which begins at rest.
    pub(super) fn open_controller(&self) -> Result<Answer, Error> {
        let shared = &self.shared;
        let _one = lock(&shared.changing);
        let known =
            lock(&shared.controller).as_ref().map(|controller| (controller.file.clone(), controller.folder.clone()));
        let (file, folder) = known.ok_or(Error::NothingLoaded)?;
        let foreign = file.open_again(&folder, &mut |_| {})?;
        let (controller, mut foreign) = Controller::of(foreign, file, folder);
        let settings = lock(&shared.tuning).preset().bench;
        let loaded = Loaded::new(&foreign, settings.control_period());
        let mut tuning = lock(&shared.tuning).clone();
        tuning.bring(loaded);
        let values = tuning.loaded_values();
        for (index, value) in values.into_iter().enumerate() {
            foreign.begin_with(index, value);
        }
        let (seated, heard) = mpsc::channel();
        let job = Job::Seat { foreign: Box::new(foreign), settings: Box::new(settings), seated };
        self.begin("open the controller", job)?;
        let gone = |_| Error::BenchFault { cycle: 0, reason: "the bench has ended; start it anew".into() };
        heard.recv().map_err(gone)??;
        let words = controller.words();
        *lock(&shared.controller) = Some(controller);
        *lock(&shared.tuning) = tuning;
        shared.mark_now(MarkKind::Change, format!("opened again: {words}"));
        Ok(Answer::Done {})
    }

    pub(super) fn loaded_status(&self) -> Option<LoadedStatus> {
        let mut controller = lock(&self.shared.controller);
        let controller = controller.as_mut()?;
        controller.console.count();
        let (calls, responses, late) = controller.console.durations();
        let seconds = |q: stickslip_rt::Quantiles| [q.p50, q.p99, q.p999, q.max].map(|time| time as f64 * 1e-9);
        Some(LoadedStatus {
            name: controller.name.clone(),
            kind: controller.kind.clone(),
            file: controller.file.path.display().to_string(),
            hash: controller.hash.clone(),
            failed: controller.console.failed(),
            calls: calls.count,
            call: seconds(calls),
            response: (responses.count > 0).then(|| seconds(responses)),
            budget: BUDGET as f64 * 1e-9,
            over_budget: late,
        })
    }
}

impl Shared {
    /// Counts the calls of the loaded controller that were made since.
    pub(super) fn count_calls(&self) {
        // Whoever holds it counts as well.
        if let Ok(mut controller) = self.controller.try_lock() {
            controller.iter_mut().for_each(|controller| controller.console.count());
        }
    }

    /// The loaded controller as a record names it.
    pub(super) fn loaded_words(&self) -> Option<String> {
        lock(&self.controller).as_ref().map(Controller::words)
    }
}
