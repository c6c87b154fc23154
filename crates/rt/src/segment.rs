//! Memory shared by two processes: a mapped file of 64-bit words, accessed by atomics only.
//!
//! Any contents written by the other side are safe to read. The caller controls access to the file and the number of
//! users on each side.

#![expect(unsafe_code, reason = "a mapping is raw memory; it is exposed as atomic words")]

use std::fs::File;
use std::io::{Error, ErrorKind};
use std::sync::atomic::AtomicU64;
#[cfg(unix)]
use std::sync::atomic::Ordering;
use std::time::Duration;

use memmap2::MmapRaw;

use crate::system;

/// A mapped file.
#[derive(Debug)]
pub struct Segment {
    map: MmapRaw,
    words: usize,
}

impl Segment {
    /// Maps the first words of a file that is open for reading and writing. The mapping outlives the handle.
    ///
    /// # Errors
    /// A file that is too short; errors of the operating system.
    pub fn map(file: &File, words: usize) -> Result<Self, Error> {
        let bytes = words * size_of::<AtomicU64>();
        if file.metadata()?.len() < bytes as u64 {
            return Err(Error::new(ErrorKind::UnexpectedEof, format!("it has less than {bytes} bytes")));
        }
        Ok(Segment { map: MmapRaw::map_raw(file)?, words })
    }

    /// Unnamed memory, all 0, whose file can be passed to another process. On Linux it is sealed against shortening.
    ///
    /// # Errors
    /// Errors of the operating system.
    #[cfg(unix)]
    pub fn anonymous(words: usize) -> Result<(Self, File), Error> {
        let file = unnamed((words * size_of::<AtomicU64>()) as u64)?;
        let segment = Segment::map(&file, words)?;
        // All pages are resident before the deadline matters.
        segment.words().iter().for_each(|word| word.store(0, Ordering::Relaxed));
        Ok((segment, file))
    }

    /// The words, in the order of the file.
    pub fn words(&self) -> &[AtomicU64] {
        // SAFETY: the mapping starts at a page, has `words` words (checked on creation) and lives as long as `self`;
        // every bit pattern is a valid word, and this process accesses it only by these atomics. Shortening the file
        // would end this process by a signal; the file's permissions control who can.
        unsafe { std::slice::from_raw_parts(self.map.as_ptr().cast::<AtomicU64>(), self.words) }
    }

    /// Sleeps until a word is woken, up to `within`. Returns immediately if the lower half of the word differs from
    /// that of `value`. May wake early.
    pub fn sleep(&self, word: usize, value: u64, within: Duration) {
        system::wait_for_word(&self.words()[word], value as u32, within);
    }

    /// Wakes a waiter for a word.
    pub fn wake(&self, word: usize) {
        system::wake_for_word(&self.words()[word]);
    }
}

/// A file in memory with a sealed length.
#[cfg(target_os = "linux")]
fn unnamed(length: u64) -> Result<File, Error> {
    use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, memfd_create};
    let file = File::from(memfd_create("stickslip", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?);
    file.set_len(length)?;
    fcntl_add_seals(&file, SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL)?;
    Ok(file)
}

/// A file whose name is removed. A process that has it open could shorten it.
#[cfg(all(unix, not(target_os = "linux")))]
fn unnamed(length: u64) -> Result<File, Error> {
    use std::os::unix::fs::OpenOptionsExt as _;
    use std::sync::atomic::AtomicUsize;
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let name = format!("stickslip-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let path = std::env::temp_dir().join(name);
    let file = File::options().read(true).write(true).create_new(true).mode(0o600).open(&path)?;
    std::fs::remove_file(path)?;
    file.set_len(length)?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::Ordering;

    #[test]
    #[cfg(target_os = "linux")]
    fn unnamed_memory_is_shared_by_its_file_and_cannot_be_shortened() {
        let (one, file) = Segment::anonymous(8).expect("memory");
        let other = Segment::map(&file, 8).expect("a mapping");
        one.words()[7].store(3, Ordering::Release);
        assert_eq!(other.words()[7].load(Ordering::Acquire), 3);
        for length in [0, 32, 1 << 20] {
            file.set_len(length).expect_err("it is sealed");
        }
        assert_eq!(one.words()[7].load(Ordering::Acquire), 3);
    }

    #[test]
    fn two_mappings_of_a_file_are_one_memory() {
        let file = tempfile::tempfile().expect("a file");
        file.set_len(64).expect("it grows");
        let (one, other) = (Segment::map(&file, 8).expect("a mapping"), Segment::map(&file, 8).expect("another"));
        one.words()[7].store(u64::MAX - 1, Ordering::Release);
        assert_eq!(other.words()[7].load(Ordering::Acquire), u64::MAX - 1);
        assert_eq!(other.words().len(), 8);
    }

    #[test]
    fn a_waiter_is_woken_and_never_waits_for_a_changed_word() {
        let file = tempfile::tempfile().expect("a file");
        file.set_len(64).expect("it grows");
        let (one, other) = (Segment::map(&file, 8).expect("a mapping"), Segment::map(&file, 8).expect("another"));
        // Far longer than a test takes.
        let long = Duration::from_secs(3600);
        let waiting = std::thread::spawn(move || {
            while other.words()[3].load(Ordering::Acquire) == 7 {
                other.sleep(3, 7, long);
            }
        });
        one.words()[3].store(7, Ordering::Release);
        std::thread::sleep(Duration::from_millis(20));
        one.words()[3].store(8, Ordering::Release);
        one.wake(3);
        waiting.join().expect("it wakes");
        one.sleep(3, 7, long);
        one.sleep(3, 8, Duration::from_millis(1));
    }

    #[test]
    fn a_file_that_is_too_short_is_refused() {
        let file = tempfile::tempfile().expect("a file");
        file.set_len(63).expect("it grows");
        assert!(Segment::map(&file, 8).expect_err("a byte is missing").to_string().contains("less than 64 bytes"));
    }
}
