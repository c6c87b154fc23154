//! The thread that writes the run to the disk. A disk may block for seconds; viewers must not wait for it.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::RunWriter;
use crate::tap::{Changed, Sample};
use stickslip_base::Error;

/// Maximum number of cycles that wait for the disk: half a minute at 4 kHz. Memory is used only as needed.
const ROOM: usize = 1 << 17;
/// Polling interval while no cycle comes.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Locks also after a panic of another thread: the amounts are plain numbers.
fn lock(progress: &Mutex<Progress>) -> MutexGuard<'_, Progress> {
    progress.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An item of the record.
#[expect(clippy::large_enum_variant, reason = "nearly all are samples")]
enum Item {
    Sample(Sample),
    Changed(Box<Changed>),
}

/// Amount of written data.
#[derive(Clone, Copy, Debug, Default)]
pub struct Progress {
    /// The first cycle.
    pub from: u64,
    /// Number of written cycles.
    pub rows: u64,
    /// Length of the file.
    pub bytes: u64,
    /// Cycles that are missing in it.
    pub lost: u64,
}

/// The writer of a record, on its own thread.
pub struct Scribe {
    to: Sender<Item>,
    waiting: Arc<AtomicUsize>,
    /// Cycles dropped since the last written one, because the buffer was full.
    unwritten: u64,
    room: usize,
    /// The newest cycle, and whether the scribe is closed.
    last: u64,
    closed: bool,
    thread: JoinHandle<Result<(), Error>>,
}

impl Scribe {
    /// Opens a file and writes cycles and changes, from the cycle that `open` returns. If the file cannot be opened or
    /// written, `failed` gets the error, and the rest is dropped.
    pub fn start(
        open: impl FnOnce() -> Result<(RunWriter, u64), Error> + Send + 'static,
        progress: Arc<Mutex<Progress>>,
        failed: impl FnOnce(&Error) + Send + 'static,
    ) -> Self {
        let (to, from) = channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let taken = waiting.clone();
        let thread = thread::spawn(move || {
            let written = open().and_then(|(writer, begin)| write(writer, begin, &from, &taken, &progress));
            written.inspect_err(failed)
        });
        Scribe { to, waiting, unwritten: 0, room: ROOM, last: 0, closed: false, thread }
    }

    /// Accepts no more cycles; changes of earlier cycles may still come.
    pub fn close(&mut self) {
        self.closed = true;
    }

    /// Whether it accepts no more cycles.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Whether the thread has ended.
    pub fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Adds a cycle. Returns the number of cycles dropped since the last written one.
    pub fn sample(&mut self, sample: &Sample) -> u64 {
        if self.closed {
            return 0;
        }
        self.last = sample.frame.cycle;
        if self.waiting.load(Ordering::Relaxed) >= self.room {
            self.unwritten += 1;
            return self.unwritten;
        }
        let lost = sample.lost + std::mem::take(&mut self.unwritten);
        self.waiting.fetch_add(1, Ordering::Relaxed);
        // After a failure there is no receiver.
        if self.to.send(Item::Sample(Sample { lost, ..*sample })).is_err() {
            self.waiting.store(0, Ordering::Relaxed);
        }
        0
    }

    /// Adds a change.
    pub fn change(&mut self, changed: &Changed) {
        if !(self.closed && changed.cycle > self.last) {
            let _ = self.to.send(Item::Changed(Box::new(*changed)));
        }
    }

    /// Waits until all data are in the file.
    ///
    /// # Errors
    /// As opening or writing the file.
    pub fn finish(self) -> Result<(), Error> {
        drop(self.to);
        self.thread.join().expect("writing a record does not panic")
    }
}

fn write(
    mut writer: RunWriter,
    begin: u64,
    from: &Receiver<Item>,
    waiting: &AtomicUsize,
    progress: &Mutex<Progress>,
) -> Result<(), Error> {
    let mut rows = 0;
    loop {
        match from.recv_timeout(POLL_INTERVAL) {
            Ok(Item::Sample(sample)) => {
                waiting.fetch_sub(1, Ordering::Relaxed);
                if sample.frame.cycle >= begin {
                    // Cycles lost before the start of the record do not count.
                    let lost = if rows == 0 { sample.lost.min(sample.frame.cycle - begin) } else { sample.lost };
                    writer.sample(&Sample { lost, ..sample })?;
                    rows += 1;
                }
            }
            Ok(Item::Changed(changed)) if changed.cycle >= begin => writer.change(&changed)?,
            Ok(Item::Changed(_)) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let recorded = writer.finish()?;
                lock(progress).bytes = recorded.file.bytes;
                return Ok(());
            }
        }
        writer.look()?;
        let (bytes, lost) = writer.written();
        *lock(progress) = Progress { from: begin, rows, bytes, lost };
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::run::{About, Record};
    use crate::{Bench as _, Command, VirtualBench};
    use stickslip_base::parameters::presets;

    #[test]
    fn cycles_dropped_by_a_full_buffer_are_in_the_record_as_lost() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mf4");
        let preset = presets::find("clm-bench").unwrap().read().unwrap();
        let about = About { command: "test".into(), preset, seed: None };
        let (failed, failure) = mpsc::channel();
        let writer = RunWriter::create(&path, &about).unwrap();
        let progress = Arc::new(Mutex::new(Progress::default()));
        let mut scribe = Scribe::start(
            move || Ok((writer, 0)),
            progress.clone(),
            move |error| failed.send(error.to_string()).unwrap(),
        );
        let mut bench = VirtualBench::new(&preset, 1).unwrap();
        let mut give = |scribe: &mut Scribe| {
            let frame = bench.step(Command::default()).unwrap();
            scribe.sample(&Sample { frame, lost: 0, held: 0, waited: 0 })
        };
        assert_eq!((0..10).map(|_| give(&mut scribe)).max(), Some(0));
        scribe.room = 0;
        assert_eq!([give(&mut scribe), give(&mut scribe), give(&mut scribe)], [1, 2, 3]);
        scribe.room = ROOM;
        assert_eq!(give(&mut scribe), 0);
        scribe.finish().unwrap();
        let Progress { rows, lost, bytes, .. } = *lock(&progress);
        assert_eq!((rows, lost, bytes), (11, 3, std::fs::metadata(&path).unwrap().len()));
        assert!(failure.recv().is_err(), "nothing failed");
        let record = Record::read(&path).unwrap();
        let cycles: Vec<u64> = record.cycles.iter().map(|(cycle, _)| *cycle).collect();
        assert_eq!(cycles, [&(0..10).collect::<Vec<_>>()[..], &[13]].concat());
        assert_eq!(record.lost, [(13, 3)]);
    }
}
