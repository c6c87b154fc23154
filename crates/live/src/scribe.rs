//! The thread that writes the run to the disk: a disk may let a writer wait for seconds, viewers must not.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::lock;
use stickslip_base::Error;
use stickslip_bench::run::RunWriter;
use stickslip_bench::tap::{Changed, Sample};

/// Cycles that may wait for the disk: half a minute at 4 kHz, and no more memory than they take.
const ROOM: usize = 1 << 17;
/// From look to look where nothing comes.
const LOOK: Duration = Duration::from_millis(20);

/// What is written.
#[expect(clippy::large_enum_variant, reason = "nearly all are samples")]
enum Item {
    Sample(Sample),
    Changed(Box<Changed>),
}

/// How much is written.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Progress {
    /// The first cycle.
    pub(super) from: u64,
    pub(super) rows: u64,
    pub(super) bytes: u64,
    pub(super) lost: u64,
}

/// Who writes.
pub(super) struct Scribe {
    to: Sender<Item>,
    waiting: Arc<AtomicUsize>,
    /// Cycles that found no room since the last one that did.
    unwritten: u64,
    room: usize,
    /// The newest cycle, and whether no more are taken.
    last: u64,
    closed: bool,
    thread: JoinHandle<Result<(), Error>>,
}

impl Scribe {
    /// Opens a file and writes what it is given, from the cycle on that comes with the file; where that cannot be or the
    /// disk takes no more, `failed` hears why, and the rest is left out.
    pub(super) fn start(
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

    /// Takes no more cycles; changes that belong to those it has may still come.
    pub(super) fn close(&mut self) {
        self.closed = true;
    }

    /// Whether it writes no more.
    pub(super) fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// A cycle; how many cycles found no room since the last that did.
    pub(super) fn sample(&mut self, sample: &Sample) -> u64 {
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

    /// A change.
    pub(super) fn change(&mut self, changed: Changed) {
        if !(self.closed && changed.cycle > self.last) {
            let _ = self.to.send(Item::Changed(Box::new(changed)));
        }
    }

    /// Waits until all is in the file; why it is not.
    pub(super) fn finish(self) -> Result<(), Error> {
        drop(self.to);
        self.thread.join().expect("what is recorded is data: nothing in it panics")
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
        match from.recv_timeout(LOOK) {
            Ok(Item::Sample(sample)) => {
                waiting.fetch_sub(1, Ordering::Relaxed);
                if sample.frame.cycle >= begin {
                    // What was lost before the begin is not missing.
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
    use stickslip_base::parameters::presets;
    use stickslip_bench::run::{About, Record};
    use stickslip_bench::{Bench as _, Command, VirtualBench};

    #[test]
    fn what_finds_no_room_is_in_the_record_as_lost() {
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
