//! Frames through shared memory of two processes.
//!
//! A mapped file of 4096 bytes has a ring of 8 frames in each direction. The writer increments the count of written
//! frames after each frame, the reader the count of taken frames after each copy. Each frame therefore arrives
//! complete, once and in order; if a ring is full, the next frame is lost, like a datagram. `docs/src/frame.md` lists
//! every byte.
//!
//! The machine creates the file, accessible only for its user, and locks it while it runs; the software locks the
//! adjacent file `.bench`. The system releases the locks of a killed process, so that its files are not mistaken for a
//! running machine. A starting side skips the frames in its ring, which were sent to its predecessor.

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
/// Words of the counts, each in a separate cache line: written by the software, taken by the machine; then the reverse
/// direction.
const COUNTS: [[usize; 2]; 2] = [[8, 16], [24, 32]];
/// First words of the rings.
const RINGS: [usize; 2] = [64, 64 + FRAMES as usize * FRAME];

/// Side of an end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Software,
    Machine,
}

/// An end of the shared memory; only one exists on each side.
#[derive(Debug)]
pub(super) struct Mailbox {
    segment: Segment,
    path: PathBuf,
    /// Index of the written ring; the other one is read.
    own: usize,
    /// Lock while this side runs.
    lock: File,
}

impl Mailbox {
    /// Opens a side; that of the machine creates the memory.
    pub(super) fn open(name: &str, side: Side) -> Result<Self, Error> {
        let path = Address::file(name);
        let (file, lock, own) = match side {
            Side::Machine => {
                let file = locked(&path, "another process serves a machine at this address")?;
                if file.metadata()?.len() < 8 * WORDS as u64 {
                    file.set_len(8 * WORDS as u64)?;
                }
                (file.try_clone()?, file, 1)
            }
            Side::Software => {
                let file = open_private(&path, false)?;
                if file.try_lock_shared().is_ok() {
                    return Err(Error::new(ErrorKind::NotFound, "the machine at this address has ended"));
                }
                (file, locked(&bench_file(&path), "another bench uses the machine")?, 0)
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
            return Err(Error::new(ErrorKind::InvalidData, "not a shared memory of version 1"));
        }
        mailbox.pass_over();
        Ok(mailbox)
    }

    fn word(&self, index: usize) -> &AtomicU64 {
        &self.segment.words()[index]
    }

    /// Counts of written and taken frames of a ring.
    fn counts(&self, ring: usize) -> [&AtomicU64; 2] {
        COUNTS[ring].map(|index| self.word(index))
    }

    /// The words of a frame in a ring.
    fn frame(&self, ring: usize, count: u64) -> &[AtomicU64] {
        let begin = RINGS[ring] + (count % FRAMES) as usize * FRAME;
        &self.segment.words()[begin..begin + FRAME]
    }

    /// Skips the frames in the ring that it reads.
    fn pass_over(&self) {
        let [written, taken] = self.counts(1 - self.own);
        taken.store(written.load(Ordering::Acquire), Ordering::Release);
    }

    /// Writes a frame to its ring.
    pub(super) fn send(&mut self, frame: &[u8]) -> Result<(), Error> {
        let [written, taken] = self.counts(self.own);
        let count = written.load(Ordering::Relaxed);
        // Invalid counts also mean no room; the reader skips them when it starts.
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

    /// Sleeps until a frame may have arrived, up to `within`.
    pub(super) fn sleep(&self, within: Duration) {
        let [written, taken] = self.counts(1 - self.own);
        let count = written.load(Ordering::Acquire);
        if count == taken.load(Ordering::Relaxed) {
            self.segment.sleep(COUNTS[1 - self.own][0], count, within);
        }
    }

    /// Takes the next frame.
    pub(super) fn receive(&mut self, into: &mut [u8; LONGEST]) -> Result<usize, Error> {
        let [written, taken] = self.counts(1 - self.own);
        let count = taken.load(Ordering::Relaxed);
        match written.load(Ordering::Acquire).wrapping_sub(count) {
            0 => return Err(ErrorKind::WouldBlock.into()),
            1..=FRAMES => {}
            // More than the capacity: invalid.
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
        // The lock is released before the other side is checked: if both end at once, the later one finds no lock.
        let _ = self.lock.unlock();
        sweep(&self.path);
    }
}

/// Removes the files if neither side is left. The memory remains while a bench waits for its next machine.
fn sweep(path: &Path) {
    let bench = bench_file(path);
    let free = |path: &Path| File::open(path).is_ok_and(|file| file.try_lock().is_ok());
    // Locked during the removal: a starting side creates new files.
    let Ok(memory) = File::open(path) else { return };
    if memory.try_lock().is_ok() && (free(&bench) || !bench.exists()) {
        let _ = std::fs::remove_file(&bench);
        let _ = std::fs::remove_file(path);
    }
}

/// The file that a bench locks while it uses the machine.
fn bench_file(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".bench");
    name.into()
}

/// A file accessible only for this user.
fn open_private(path: &Path, create: bool) -> Result<File, Error> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(create);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path)?;
    #[cfg(unix)]
    if std::os::unix::fs::PermissionsExt::mode(&file.metadata()?.permissions()) & 0o077 != 0 {
        let reason =
            format!("other users have access to {}; restrict it (chmod 600), or remove the file", path.display());
        return Err(Error::new(ErrorKind::PermissionDenied, reason));
    }
    Ok(file)
}

/// The file with this process's lock on it.
fn locked(path: &Path, refusal: &str) -> Result<File, Error> {
    for _ in 0..20 {
        let file = open_private(path, true)?;
        match file.try_lock() {
            // A side that ended meanwhile may have removed the file; the name then belongs to another file.
            Ok(()) if is_at(&file, path) => return Ok(file),
            // Another process checks for a running side, or ends.
            Ok(()) | Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(5)),
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
    Err(Error::new(ErrorKind::AddrInUse, refusal))
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
