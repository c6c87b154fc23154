//! The cases of a study: on all threads, part after part, and the file that is made of the parts.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use super::plan::Ready;
use super::table::{Columns, Row, Writer, read_part, rows};
use super::{Outcome, Plan};
use crate::judged::ABREAST;
use crate::parallel::map;
use crate::{Error, Watch, output};

/// Folder of the parts.
const PARTS: &str = "parts";
/// The result.
pub(super) const FILE: &str = "study.parquet";
/// Cases of a part: a hundredth of all, so that little is lost, and few enough that a part takes no memory.
const PART: [u64; 2] = [ABREAST as u64, 1000];

/// The part of a study that a file holds.
#[derive(Clone, Debug)]
struct Part {
    path: PathBuf,
    /// Its first case, from 0.
    first: u64,
    count: u64,
}

impl Ready<'_> {
    fn parts(&self, folder: &Path) -> Vec<Part> {
        // Whole vectors, so that no lane of a part but the last is left.
        let size = (self.cases / 100).clamp(PART[0], PART[1]).next_multiple_of(ABREAST as u64);
        let part = |index: u64| Part {
            path: folder.join(format!("{index:07}.parquet")),
            first: index * size,
            count: size.min(self.cases - index * size),
        };
        (0..self.cases.div_ceil(size)).map(part).collect()
    }
}

/// Runs a study into a folder. What lies in its `parts` and follows from the same is taken from there; each part that is
/// finished is put there, so that the same study goes on after an interruption. The file that is made at the end,
/// `study.parquet`, is the same whatever the threads, and however often it was interrupted.
///
/// # Errors
/// [`Error::Cancelled`]; what tuning refuses; [`Error::File`]. What a single case refuses is no error, but said in its row.
pub fn run_study(plan: &Plan, folder: &Path, watch: &Watch) -> Result<Outcome, Error> {
    output::create_folder(folder)?;
    let ready = plan.ready(folder, watch)?;
    let columns = Columns::of(plan);
    let follows_from = ready.follows_from();
    let file = folder.join(FILE);
    let outcome = |kept: u64| Outcome { plan: plan.clone(), file: file.clone(), cases: ready.cases, kept };
    if rows(&file, &columns, &follows_from) == Some(ready.cases) {
        return Ok(outcome(ready.cases));
    }
    let parts_folder = folder.join(PARTS);
    output::create_folder(&parts_folder)?;
    let parts = ready.parts(&parts_folder);
    let missing: Vec<&Part> = parts.iter().filter(|part| !is_there(part, &columns, &follows_from)).collect();
    run_parts(&ready, &missing, &columns, &follows_from, watch)?;

    // The rows, group after group: the file never lies in memory.
    let gone = |part: &Part| io::Error::other(format!("{} was changed while the study ran", part.path.display()));
    output::write_with(&file, |out| {
        let mut writer = Writer::new(out, &columns, &follows_from)?;
        for part in &parts {
            writer.rows(&read_part(&part.path, &columns, &follows_from).ok_or_else(|| gone(part))?)?;
        }
        writer.close()
    })?;
    // All of it is in the file.
    fs::remove_dir_all(&parts_folder).map_err(|source| Error::file(&parts_folder, "remove", source))?;
    Ok(outcome(kept(&parts, &missing)))
}

/// Cases that were not run again.
fn kept(parts: &[Part], missing: &[&Part]) -> u64 {
    let count = |parts: &mut dyn Iterator<Item = &Part>| parts.map(|part| part.count).sum::<u64>();
    count(&mut parts.iter()) - count(&mut missing.iter().copied())
}

fn is_there(part: &Part, columns: &Columns, follows_from: &str) -> bool {
    read_part(&part.path, columns, follows_from).is_some_and(|rows| {
        rows.len() as u64 == part.count && rows.first().is_some_and(|row| row.case == part.first + 1)
    })
}

/// Runs what is missing. Threads take a vector of cases after the other across the parts; who brings the last rows of a
/// part writes it, so that as many parts as there are threads are in memory at most.
fn run_parts(
    ready: &Ready<'_>,
    missing: &[&Part],
    columns: &Columns,
    follows_from: &str,
    watch: &Watch,
) -> Result<(), Error> {
    let total: u64 = missing.iter().map(|part| part.count).sum();
    let (next, done) = (AtomicU64::new(0), AtomicU64::new(0));
    let open: Mutex<BTreeMap<usize, Vec<Row>>> = Mutex::default();
    let size = missing.first().map_or(1, |part| part.count);
    // No thread without work where cases are few. A power of two, which divides every part but the last.
    let threads = ready.plan.threads.max(1);
    let step = 1 << total.div_ceil(threads as u64).clamp(1, ABREAST as u64).ilog2();
    let work = || -> Result<(), Error> {
        loop {
            let job = next.fetch_add(step, Ordering::Relaxed);
            // Only the last part of a study may be shorter than others.
            let (index, from) = ((job / size) as usize, job % size);
            let Some(part) = missing.get(index).filter(|_| job < total) else { return Ok(()) };
            let count = step.min(part.count - from);
            let found = ready.rows(part.first + from, count, watch)?;
            let whole = {
                let mut open = open.lock().expect("no thread panics with the lock");
                let rows = open.entry(index).or_default();
                rows.extend(found);
                if rows.len() as u64 == part.count { open.remove(&index) } else { None }
            };
            if let Some(mut rows) = whole {
                rows.sort_by_key(|row| row.case);
                output::write_with(&part.path, |out| {
                    let mut writer = Writer::new(out, columns, follows_from)?;
                    writer.rows(&rows)?;
                    writer.close()
                })?;
            }
            let done = done.fetch_add(count, Ordering::Relaxed) + count;
            watch.stage("run the cases", done as f64 / total as f64)?;
        }
    };
    let each = |(): &()| {
        let ended = work();
        if ended.is_err() {
            // No other thread begins a case.
            next.store(total, Ordering::Relaxed);
        }
        ended
    };
    map(&vec![(); threads], threads, each).map(drop)
}
