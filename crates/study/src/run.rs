//! The cases of a study: parts, run anywhere, and the file that combines them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use super::table::{Row, Writer, read_part, rows};
use super::{Outcome, Plan, Work};
use stickslip_base::parallel::map;
use stickslip_base::{Error, Watch, output};
use stickslip_recording::unreadable;
use stickslip_simulate::fast_bench::LANES;

/// Folder of the parts.
const PARTS: &str = "parts";
/// The result.
pub(super) const FILE: &str = "study.parquet";
/// Rows of a group of the result, of which one is in memory at a time: those of whole parts, at least this number.
const GROUP: usize = 8192;

/// Runs a study into a folder, on all threads of its plan. Valid parts in its `parts` are reused; each finished part is
/// written there, so that the same study continues after an interruption. The resulting file, `study.parquet`, does not
/// depend on the machine that ran the parts, nor on interruptions.
///
/// # Errors
/// [`Error::Cancelled`]; errors of tuning; [`Error::File`]. An error of a single case is in its row.
pub fn run_study(plan: &Plan, folder: &Path, watch: &Watch) -> Result<Outcome, Error> {
    let parts = Parts::open(plan, folder, watch)?;
    parts.run(plan.threads, watch)?;
    parts.finish()
}

/// A study in its folder: the finished parts and the missing ones. They run here ([`run`](Self::run)), or elsewhere
/// ([`Work::part_bytes`]) with their results [`put`](Self::put) there.
#[derive(Clone, Debug)]
pub struct Parts {
    work: Work,
    /// Of the study.
    folder: PathBuf,
    missing: Vec<usize>,
}

impl Parts {
    /// Reads the folder, and tunes the controller of the plan if necessary.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; errors of tuning; [`Error::File`].
    pub fn open(plan: &Plan, folder: &Path, watch: &Watch) -> Result<Self, Error> {
        output::create_folder(folder)?;
        let mut parts = Parts { work: plan.ready(folder, watch)?, folder: folder.into(), missing: Vec::new() };
        let is_whole = rows(&parts.file(), &parts.work.columns, &parts.work.follows_from) == Some(parts.work.cases);
        if !is_whole {
            output::create_folder(&folder.join(PARTS))?;
            parts.missing = (0..parts.work.parts()).filter(|&index| !parts.is_there(index)).collect();
        }
        Ok(parts)
    }

    /// Description of the parts, for running them.
    pub fn work(&self) -> &Work {
        &self.work
    }

    /// The missing parts at the time of opening, in their order.
    pub fn missing(&self) -> &[usize] {
        &self.missing
    }

    /// Runs the missing parts on this number of threads.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::File`].
    pub fn run(&self, threads: usize, watch: &Watch) -> Result<(), Error> {
        self.run_by(threads, watch, |cases| self.work.rows(cases, watch))
    }

    /// Stores the bytes of a part.
    ///
    /// # Errors
    /// [`Error::Recording`] where they are not this part of this study; [`Error::File`].
    pub fn put(&self, index: usize, bytes: &[u8]) -> Result<(), Error> {
        let path = self.path(index);
        output::write(&path, bytes)?;
        if self.is_there(index) {
            return Ok(());
        }
        // It would be run again; the file is removed to avoid confusion.
        fs::remove_file(&path).map_err(|source| Error::file(&path, "remove", source))?;
        let fault = format!("the result of part {index} does not belong to this study");
        Err(unreadable(
            &path,
            &fault,
            "Install the same version of stickslip on all machines, and run the study again.",
        ))
    }

    /// Combines all parts into the file of the study.
    ///
    /// # Errors
    /// [`Error::File`], also for a missing part.
    pub fn finish(&self) -> Result<Outcome, Error> {
        let Parts { work, folder, missing } = self;
        let count = |index: &usize| work.part(*index).count() as u64;
        let reused = work.cases - missing.iter().map(count).sum::<u64>();
        let (file, parts) = (self.file(), folder.join(PARTS));
        let outcome = Outcome { plan: work.plan.clone(), file: file.clone(), cases: work.cases, reused };
        if missing.is_empty() && rows(&file, &work.columns, &work.follows_from) == Some(work.cases) {
            return Ok(outcome);
        }
        let missing_part = |path: &Path| io::Error::other(format!("{} is missing or has changed", path.display()));
        output::write_with(&file, |out| {
            let mut writer = Writer::new(out, &work.columns, &work.follows_from)?;
            let mut group = Vec::new();
            for path in (0..work.parts()).map(|index| self.path(index)) {
                let part = read_part(&path, &work.columns, &work.follows_from);
                group.append(&mut part.ok_or_else(|| missing_part(&path))?);
                if group.len() >= GROUP {
                    writer.rows(&group)?;
                    group.clear();
                }
            }
            if !group.is_empty() {
                writer.rows(&group)?;
            }
            writer.close()
        })?;
        // All rows are in the file.
        fs::remove_dir_all(&parts).map_err(|source| Error::file(&parts, "remove", source))?;
        Ok(outcome)
    }

    fn file(&self) -> PathBuf {
        self.folder.join(FILE)
    }

    fn path(&self, index: usize) -> PathBuf {
        self.folder.join(PARTS).join(format!("{index:07}.parquet"))
    }

    fn is_there(&self, index: usize) -> bool {
        let cases = self.work.part(index);
        read_part(&self.path(index), &self.work.columns, &self.work.follows_from)
            .is_some_and(|rows| rows.iter().map(|row| row.case).eq(cases.map(|case| case + 1)) && !rows.is_empty())
    }

    /// Runs the missing parts with `rows`. Threads take one vector of cases after the other across the parts; the
    /// thread with the last rows of a part stores it, so that at most as many parts as threads are in memory.
    pub(super) fn run_by(
        &self,
        threads: usize,
        watch: &Watch,
        rows: impl Fn(Range<u64>) -> Result<Vec<Row>, Error> + Sync,
    ) -> Result<(), Error> {
        let cases = |index: usize| self.work.part(index);
        let count = |cases: &Range<u64>| cases.end - cases.start;
        let total: u64 = self.missing.iter().map(|&index| count(&cases(index))).sum();
        let (next, done) = (AtomicU64::new(0), AtomicU64::new(0));
        let open: Mutex<BTreeMap<usize, Vec<Row>>> = Mutex::default();
        let size = self.missing.first().map_or(1, |&index| count(&cases(index)));
        // No idle threads with few cases. A power of two, which divides every part but the last.
        let threads = threads.max(1);
        let step = 1 << total.div_ceil(threads as u64).clamp(1, LANES as u64).ilog2();
        let work = || -> Result<(), Error> {
            loop {
                let job = next.fetch_add(step, Ordering::Relaxed);
                // Only the last part of a study may be shorter than others.
                let (place, from) = ((job / size) as usize, job % size);
                let Some(&index) = self.missing.get(place).filter(|_| job < total) else { return Ok(()) };
                let part = cases(index);
                let first = part.start + from;
                let taken = first..(first + step).min(part.end);
                let results = rows(taken.clone())?;
                let whole = {
                    let mut open = open.lock().expect("no thread panics with the lock");
                    let rows = open.entry(index).or_default();
                    rows.extend(results);
                    if rows.len() as u64 == count(&part) { open.remove(&index) } else { None }
                };
                if let Some(mut rows) = whole {
                    rows.sort_by_key(|row| row.case);
                    self.put(index, &self.work.bytes(&rows)?)?;
                }
                let done = done.fetch_add(count(&taken), Ordering::Relaxed) + count(&taken);
                watch.stage("run the cases", done as f64 / total as f64)?;
            }
        };
        let each = |(): &()| {
            let ended = work();
            if ended.is_err() {
                // No other thread starts a case.
                next.store(total, Ordering::Relaxed);
            }
            ended
        };
        map(&vec![(); threads], threads, each).map(drop)
    }
}
