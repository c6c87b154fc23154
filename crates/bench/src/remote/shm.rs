//! Frames through a memory that two processes share.
//!
//! A file of 4096 bytes, mapped: a ring of 8 frames in each direction, with a count of what was ever written, which the
//! writer alone raises behind the frame, and a count of what was taken, which the reader alone raises behind its copy.
//! So each frame comes whole, once and in order, and where a ring is full the next is lost, as a datagram would be.
//! `docs/src/frame.md` has every byte.
//!
//! The machine makes the file, for its user alone, and holds a lock on it while it lives; the software holds one on the
//! file `.bench` beside it. The system ends the locks of a process that was killed, so that nobody mistakes what it left
//! for a machine. Whoever begins passes over what stands in his ring: it was meant for the one before.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use stickslip_rt::Segment;

use super::Address;
use super::frame::LONGEST;

/// The first word: `SSHM`, version 1, 8 frames.
const MARK: u64 = u64::from_le_bytes(*b"SSHM\x01\x00\x08\x00");
/// Words of the file.
const WORDS: usize = 512;
/// Frames of a ring, and words of each: its length in bytes, its bytes.
const FRAMES: u64 = 8;
const FRAME: usize = 16;
/// Words at which a count of its own cache line stands: written by the software, taken by the machine; the other way.
const COUNTS: [[usize; 2]; 2] = [[8, 16], [24, 32]];
/// Words at which the rings begin.
const RINGS: [usize; 2] = [64, 64 + FRAMES as usize * FRAME];

/// Whose end it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Software,
    Machine,
}

/// An end of the shared memory, the only one on its side.
#[derive(Debug)]
pub(super) struct Mailbox {
    segment: Segment,
    path: PathBuf,
    /// Which ring it writes; it reads the other.
    own: usize,
    /// Says that this side lives.
    lock: File,
}

impl Mailbox {
    /// Takes a side; the machine's makes the memory.
    pub(super) fn open(name: &str, side: Side) -> Result<Self, Error> {
        let path = Address::file(name);
        let (file, lock, own) = match side {
            Side::Machine => {
                let file = locked(&path, "another process serves a machine there")?;
                if file.metadata()?.len() < 8 * WORDS as u64 {
                    file.set_len(8 * WORDS as u64)?;
                }
                (file.try_clone()?, file, 1)
            }
            Side::Software => {
                let file = opened(&path, false)?;
                if file.try_lock_shared().is_ok() {
                    return Err(Error::new(ErrorKind::NotFound, "the machine that served there has ended"));
                }
                (file, locked(&beside(&path), "another bench has the machine")?, 0)
            }
        };
        let segment = Segment::map(&file, WORDS)?;
        let mailbox = Mailbox { segment, path, own, lock };
        let mark = mailbox.word(0);
        if side == Side::Machine && mark.load(Ordering::Acquire) != MARK {
            mailbox.segment.words().iter().for_each(|word| word.store(0, Ordering::Relaxed));
            mark.store(MARK, Ordering::Release);
        }
        if mark.load(Ordering::Acquire) != MARK {
            return Err(Error::new(ErrorKind::InvalidData, "it is no shared memory of version 1"));
        }
        mailbox.pass_over();
        Ok(mailbox)
    }

    fn word(&self, index: usize) -> &AtomicU64 {
        &self.segment.words()[index]
    }

    /// Counts of what was written into a ring and taken from it.
    fn counts(&self, ring: usize) -> [&AtomicU64; 2] {
        COUNTS[ring].map(|index| self.word(index))
    }

    /// The words of a frame in a ring.
    fn frame(&self, ring: usize, count: u64) -> &[AtomicU64] {
        let begin = RINGS[ring] + (count % FRAMES) as usize * FRAME;
        &self.segment.words()[begin..begin + FRAME]
    }

    /// Leaves what stands in the ring that it reads.
    fn pass_over(&self) {
        let [written, taken] = self.counts(1 - self.own);
        taken.store(written.load(Ordering::Acquire), Ordering::Release);
    }

    /// Puts a frame into its ring.
    pub(super) fn send(&mut self, frame: &[u8]) -> Result<(), Error> {
        let [written, taken] = self.counts(self.own);
        let count = written.load(Ordering::Relaxed);
        // Nonsense that somebody left is no room either; the reader passes over it when it begins.
        if count.wrapping_sub(taken.load(Ordering::Acquire)) >= FRAMES || frame.len() > LONGEST {
            return Err(ErrorKind::WouldBlock.into());
        }
        let (length, words) = self.frame(self.own, count).split_first().expect("a frame has words");
        length.store(frame.len() as u64, Ordering::Relaxed);
        for (word, bytes) in words.iter().zip(frame.chunks(8)) {
            let mut eight = [0; 8];
            eight[..bytes.len()].copy_from_slice(bytes);
            word.store(u64::from_le_bytes(eight), Ordering::Relaxed);
        }
        written.store(count.wrapping_add(1), Ordering::Release);
        self.segment.wake(COUNTS[self.own][0]);
        Ok(())
    }

    /// Sleeps until a frame may have come, for so long at most.
    pub(super) fn sleep(&self, within: Duration) {
        let [written, taken] = self.counts(1 - self.own);
        let seen = written.load(Ordering::Acquire);
        if seen == taken.load(Ordering::Relaxed) {
            self.segment.sleep(COUNTS[1 - self.own][0], seen, within);
        }
    }

    /// Takes the next frame.
    pub(super) fn receive(&mut self, into: &mut [u8; LONGEST]) -> Result<usize, Error> {
        let [written, taken] = self.counts(1 - self.own);
        let count = taken.load(Ordering::Relaxed);
        match written.load(Ordering::Acquire).wrapping_sub(count) {
            0 => return Err(ErrorKind::WouldBlock.into()),
            1..=FRAMES => {}
            // More than there is room for: nonsense.
            _ => {
                self.pass_over();
                return Err(ErrorKind::WouldBlock.into());
            }
        }
        let (length, words) = self.frame(1 - self.own, count).split_first().expect("a frame has words");
        let length = length.load(Ordering::Relaxed).min(LONGEST as u64) as usize;
        for (bytes, word) in into.chunks_mut(8).zip(words) {
            bytes.copy_from_slice(&word.load(Ordering::Relaxed).to_le_bytes());
        }
        taken.store(count.wrapping_add(1), Ordering::Release);
        Ok(length)
    }
}

impl Drop for Mailbox {
    fn drop(&mut self) {
        // First this side ends, then it looks for the other: of two that end at once the later one sees neither.
        let _ = self.lock.unlock();
        sweep(&self.path);
    }
}

/// Takes the files away where nobody is left. The memory stays where a bench waits for its next machine.
fn sweep(path: &Path) {
    let beside = beside(path);
    let free = |path: &Path| File::open(path).is_ok_and(|file| file.try_lock().is_ok());
    // Held while the files go: whoever comes takes another one.
    let Ok(memory) = File::open(path) else { return };
    if memory.try_lock().is_ok() && (free(&beside) || !beside.exists()) {
        let _ = std::fs::remove_file(&beside);
        let _ = std::fs::remove_file(path);
    }
}

/// The file whose lock says that a bench has the machine.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".bench");
    name.into()
}

/// A file of this user alone.
fn opened(path: &Path, create: bool) -> Result<File, Error> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(create);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path)?;
    #[cfg(unix)]
    if std::os::unix::fs::PermissionsExt::mode(&file.metadata()?.permissions()) & 0o077 != 0 {
        let reason = format!("others may open {}; take that from them (chmod 600), or remove it", path.display());
        return Err(Error::new(ErrorKind::PermissionDenied, reason));
    }
    Ok(file)
}

/// The file with this process's lock on it.
fn locked(path: &Path, taken: &str) -> Result<File, Error> {
    for _ in 0..20 {
        let file = opened(path, true)?;
        match file.try_lock() {
            // Whoever ended meanwhile may have taken the file away: then it is another one that bears the name.
            Ok(()) if is_at(&file, path) => return Ok(file),
            // Somebody looks whether one lives, or ends.
            Ok(()) | Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(5)),
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
    Err(Error::new(ErrorKind::AddrInUse, taken))
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let number = |metadata: &std::fs::Metadata| (metadata.dev(), metadata.ino());
    matches!((file.metadata(), path.metadata()), (Ok(one), Ok(other)) if number(&one) == number(&other))
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests;
