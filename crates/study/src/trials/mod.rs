//! Trials of a bench that are stored as runs: their table, two of them over each other, the ranking of a comparison.

mod comparison;
mod figures;
mod pair;
mod row;
mod score;
mod stored;
mod task;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub(crate) use figures::over_time;

pub use comparison::{Comparison, RankColumn, RankRow, Ranking};
pub use pair::{PairRow, TrialCourse, TrialPair, TrialSignal, TrialTrace};
pub use row::{ManoeuvreForm, TrialChoices, TrialRow, TrialValue, controller_words, friction_of};
pub use stored::TrialRun;
pub use task::PreparedTrial;

use pair::Samples;
use stickslip_base::Error;

/// Number of trials whose samples stay in memory.
const OPENED: usize = 6;
/// Name of a trial's row in its folder.
const ROW: &str = "trial.json";
/// Name of a comparison's result in its folder.
const COMPARISON: &str = "comparison.json";

/// Samples of trials, by the number of their run.
type Opened = Vec<(u64, Arc<Samples>)>;

/// The trials of a project.
pub struct TrialStore {
    /// Folder of the runs.
    folder: PathBuf,
    /// Samples of the trials that were shown last.
    opened: Mutex<Opened>,
}

impl TrialStore {
    /// Those in a folder of runs.
    pub fn new(folder: &Path) -> Self {
        TrialStore { folder: folder.into(), opened: Mutex::default() }
    }

    /// The newest trials, and the number of all.
    pub fn rows(&self, limit: u64) -> (Vec<TrialRow>, u64) {
        let folders = self.folders(ROW);
        let of = folders.len() as u64;
        let rows = folders.into_iter().take(usize::try_from(limit).unwrap_or(usize::MAX));
        (rows.filter_map(|(run, folder)| Some(TrialRow { run, ..TrialRow::read(&folder)? })).collect(), of)
    }

    /// The newest comparison, or that of a run.
    pub fn comparison(&self, run: Option<u64>) -> Option<Comparison> {
        let folders = self.folders(COMPARISON);
        let (_, folder) = folders.into_iter().find(|(number, _)| run.is_none_or(|run| run == *number))?;
        serde_json::from_str(&std::fs::read_to_string(folder.join(COMPARISON)).ok()?).ok()
    }

    /// Folders of the runs that contain a file, with their numbers, the newest first.
    fn folders(&self, file: &str) -> Vec<(u64, PathBuf)> {
        let number = |name: &str| name.split_once('-')?.0.parse().ok();
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut folders: Vec<_> = entries
            .filter_map(|entry| Some((number(entry.file_name().to_str()?)?, entry.path())))
            .filter(|(_, path)| path.join(file).is_file())
            .collect();
        folders.sort_by_key(|(number, _)| std::cmp::Reverse(*number));
        folders
    }

    /// The samples of a trial.
    fn samples(&self, run: u64) -> Result<Arc<Samples>, Error> {
        if let Some((_, samples)) = self.opened().iter().find(|(number, _)| *number == run) {
            return Ok(samples.clone());
        }
        let found = self.folders(ROW).into_iter().find(|(number, _)| *number == run);
        let (_, folder) = found.ok_or_else(|| Error::Unknown {
            what: "trial",
            name: run.to_string(),
            remedy: "The call `trials` lists them.".into(),
        })?;
        let samples = Arc::new(Samples::read(&folder)?);
        let mut opened = self.opened();
        opened.insert(0, (run, samples.clone()));
        opened.truncate(OPENED);
        Ok(samples)
    }

    /// Locks it, also after a panic of another thread: the samples are complete.
    fn opened(&self) -> MutexGuard<'_, Opened> {
        self.opened.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
