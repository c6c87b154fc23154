//! The thread that writes the run to the disk: a disk may let a writer wait for seconds, viewers must not.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::Error;
use crate::bench::tap::{Changed, Sample};
use crate::run::RunWriter;

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

/// Who writes.
pub(super) struct Scribe {
    to: Sender<Item>,
    waiting: Arc<AtomicUsize>,
    /// Cycles that found no room since the last one that did.
    unwritten: u64,
    room: usize,
    thread: JoinHandle<()>,
}

impl Scribe {
    /// Writes what it is given; where the disk takes no more, `failed` hears why, and the rest is left out.
    pub(super) fn start(writer: RunWriter, failed: impl FnOnce(Error) + Send + 'static) -> Self {
        let (to, from) = channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let taken = waiting.clone();
        let thread = thread::spawn(move || {
            if let Err(error) = write(writer, &from, &taken) {
                failed(error);
            }
        });
        Scribe { to, waiting, unwritten: 0, room: ROOM, thread }
    }

    /// A cycle; how many cycles found no room since the last that did.
    pub(super) fn sample(&mut self, sample: &Sample) -> u64 {
        if self.waiting.load(Ordering::Relaxed) >= self.room {
            self.unwritten += 1;
            return self.unwritten;
        }
        let lost = sample.lost + std::mem::take(&mut self.unwritten);
        self.waiting.fetch_add(1, Ordering::Relaxed);
        // Where writing has failed there is nobody.
        if self.to.send(Item::Sample(Sample { lost, ..*sample })).is_err() {
            self.waiting.store(0, Ordering::Relaxed);
        }
        0
    }

    /// A change.
    pub(super) fn change(&mut self, changed: Changed) {
        let _ = self.to.send(Item::Changed(Box::new(changed)));
    }

    /// Waits until all is in the file.
    pub(super) fn finish(self) {
        drop(self.to);
        let _ = self.thread.join();
    }
}

fn write(mut writer: RunWriter, from: &Receiver<Item>, waiting: &AtomicUsize) -> Result<(), Error> {
    loop {
        match from.recv_timeout(LOOK) {
            Ok(Item::Sample(sample)) => {
                waiting.fetch_sub(1, Ordering::Relaxed);
                writer.sample(&sample)?;
            }
            Ok(Item::Changed(changed)) => writer.change(&changed)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return writer.finish().map(drop),
        }
        writer.look()?;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::bench::{Bench as _, Command, VirtualBench};
    use crate::parameters::presets;
    use crate::run::{About, Record};

    #[test]
    fn what_finds_no_room_is_in_the_record_as_lost() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mf4");
        let preset = presets::find("clm-bench").unwrap().read().unwrap();
        let about = About { command: "test".into(), preset, seed: None };
        let (failed, failure) = mpsc::channel();
        let writer = RunWriter::create(&path, &about).unwrap();
        let mut scribe = Scribe::start(writer, move |error| failed.send(error).unwrap());
        let mut bench = VirtualBench::new(&preset, 1).unwrap();
        let mut give = |scribe: &mut Scribe| {
            let frame = bench.step(Command::default()).unwrap();
            scribe.sample(&Sample { frame, lost: 0, held: 0 })
        };
        assert_eq!((0..10).map(|_| give(&mut scribe)).max(), Some(0));
        scribe.room = 0;
        assert_eq!([give(&mut scribe), give(&mut scribe), give(&mut scribe)], [1, 2, 3]);
        scribe.room = ROOM;
        assert_eq!(give(&mut scribe), 0);
        scribe.finish();
        assert!(failure.recv().is_err(), "nothing failed");
        let record = Record::read(&path).unwrap();
        let cycles: Vec<u64> = record.cycles.iter().map(|(cycle, _)| *cycle).collect();
        assert_eq!(cycles, [&(0..10).collect::<Vec<_>>()[..], &[13]].concat());
        assert_eq!(record.lost, [(13, 3)]);
    }
}
