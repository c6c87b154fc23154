//! One soak test: all clients for a time, and its results.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use stickslip::bench::ThreadSettings;
use stickslip::run::{Replayed, Stored};
use stickslip::{Error, Watch};

use super::crowd::{Crowd, Results};

/// Parts of its duration; memory is sampled at the end of each.
pub(crate) const PARTS: u32 = 20;

/// Results of a soak test.
pub(crate) struct Soaked {
    /// Results of the clients.
    pub(crate) results: Results,
    /// The record, replayed: rows, and whether every bit is the same.
    pub(crate) replayed: Replayed,
    /// Bytes of the record's file.
    pub(crate) bytes: u64,
    /// Cycles lost by full buffers on the way to recorder and viewers, counted by the bench.
    pub(crate) lost: u64,
    /// Memory of the process at the end of each part [bytes]; empty if the system does not report it.
    pub(crate) memory: Vec<u64>,
}

/// Runs a soak test for a time; the record is stored in the folder.
pub(crate) fn soak(rate: f64, seconds: f64, thread_settings: ThreadSettings, folder: &Path) -> Result<Soaked, Error> {
    let file = folder.join("run.mf4");
    let crowd = Crowd::gather("clm-bench", rate, thread_settings, &folder.join("project"), file.clone())?;
    let start = Instant::now();
    let mut memory = Vec::new();
    let mut lost = 0;
    for part in 1..=PARTS {
        let end = Duration::from_secs_f64(seconds * f64::from(part) / f64::from(PARTS));
        thread::sleep(end.saturating_sub(start.elapsed()));
        memory.extend(resident());
        let status = crowd.status()?;
        lost = status.clock.lost;
        eprintln!(
            "{:.0} s: {} {} lost {lost} memory {:?}",
            end.as_secs_f64(),
            status.state,
            status.cycle,
            memory.last()
        );
    }
    let results = crowd.leave()?;
    let bytes = std::fs::metadata(&file).map_err(|source| Error::file(&file, "read", source))?.len();
    let replayed = Stored::open(&file)?.replay(&Watch::silent())?;
    Ok(Soaked { results, replayed, bytes, lost, memory })
}

/// Memory of this process [bytes].
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}
