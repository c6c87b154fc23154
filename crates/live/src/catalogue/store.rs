//! The files of the index: `N.json` for run N, `last` for the largest assigned number, `lock`.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

use super::Catalogue;
use super::entry::{Entry, SCHEMA};
use crate::LiveError;
use stickslip_base::{Error, output};

/// Time limit for the lock.
const LOCK_LIMIT: Duration = Duration::from_secs(10);

const BUSY: &str = "Another program is changing it. Try again.";
const NEWER: &str = "Use the version of stickslip that wrote it, or rebuild the catalogue: `stickslip runs --rebuild`.";
const REBUILD: &str = "Rebuild the catalogue from the folders: `stickslip runs --rebuild`.";

/// The right to change the index; released when dropped, also when the process ends.
pub(super) struct Lock {
    _file: File,
}

impl Catalogue {
    /// Waits until no other thread or process changes the index. Creates its folder.
    pub(super) fn lock(&self) -> Result<Lock, Error> {
        output::create_folder(&self.index)?;
        let path = self.index.join("lock");
        let refused = |source: io::Error| Error::file(&path, "lock", source);
        let file = File::options().create(true).truncate(false).write(true).open(&path).map_err(refused)?;
        let begun = Instant::now();
        loop {
            match file.try_lock() {
                Ok(()) => return Ok(Lock { _file: file }),
                Err(TryLockError::Error(source)) => return Err(refused(source)),
                Err(TryLockError::WouldBlock) if begun.elapsed() < LOCK_LIMIT => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(TryLockError::WouldBlock) => return Err(fault(path, "it is locked", BUSY)),
            }
        }
    }

    /// Numbers of the runs in the index, sorted.
    pub(super) fn numbers(&self) -> Result<Vec<i64>, Error> {
        let entries = match fs::read_dir(&self.index) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries,
        };
        let refused = |source| Error::file(&self.index, "list", source);
        let names =
            entries.and_then(|all| all.map(|entry| entry.map(|it| it.file_name())).collect::<Result<Vec<_>, _>>());
        let number = |name: &std::ffi::OsString| name.to_str()?.strip_suffix(".json")?.parse().ok();
        let mut numbers: Vec<i64> = names.map_err(refused)?.iter().filter_map(number).collect();
        numbers.sort_unstable();
        Ok(numbers)
    }

    /// The entry of a run; `None` if there is none.
    pub(super) fn entry(&self, number: i64) -> Result<Option<Entry>, Error> {
        /// The part of an entry that all versions have.
        #[derive(serde::Deserialize)]
        struct Head {
            schema: String,
        }
        let path = self.path(number);
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            text => text.map_err(|source| Error::file(&path, "read", source))?,
        };
        match serde_json::from_str::<Entry>(&text) {
            Ok(entry) if entry.schema == SCHEMA && entry.label.number == number => Ok(Some(entry)),
            Ok(entry) if entry.schema == SCHEMA => {
                Err(fault(path, &format!("it is the entry of run {}", entry.label.number), REBUILD))
            }
            entry => Err(match (serde_json::from_str::<Head>(&text), entry.err()) {
                (Ok(head), _) if head.schema != SCHEMA => {
                    fault(path, &format!("its format is {}, this version reads {SCHEMA}", head.schema), NEWER)
                }
                (_, error) => fault(path, &error.map(|it| it.to_string()).unwrap_or_default(), REBUILD),
            }),
        }
    }

    /// The entry of an existing run.
    pub(super) fn existing(&self, number: i64) -> Result<Entry, Error> {
        self.entry(number)?.ok_or(LiveError::NoRun { number }.into())
    }

    /// Writes an entry, unless the file is equal.
    pub(super) fn put(&self, _lock: &Lock, entry: &Entry) -> Result<(), Error> {
        let path = self.path(entry.label.number);
        let text = serde_json::to_string(entry).expect("strings and numbers");
        if fs::read(&path).is_ok_and(|old| old == text.as_bytes()) {
            return Ok(());
        }
        output::write(&path, text)
    }

    /// Removes the entry of a run; its number is not reused.
    pub(super) fn forget(&self, lock: &Lock, number: i64) -> Result<(), Error> {
        if self.last_given()? < number {
            self.give(lock, number)?;
        }
        let path = self.path(number);
        fs::remove_file(&path).map_err(|source| Error::file(&path, "remove", source))
    }

    /// A number that no run has or had. It is returned again unless it is used or [assigned](Self::give).
    pub(super) fn next_number(&self, _lock: &Lock) -> Result<i64, Error> {
        let newest = self.numbers()?.last().copied().unwrap_or(0);
        Ok(newest.max(self.last_given()?) + 1)
    }

    /// Assigns a number: no other run gets it.
    pub(super) fn give(&self, _lock: &Lock, number: i64) -> Result<(), Error> {
        output::write(&self.index.join("last"), number.to_string())
    }

    fn last_given(&self) -> Result<i64, Error> {
        let path = self.index.join("last");
        match fs::read_to_string(&path) {
            Ok(text) => text.trim().parse().map_err(|_| fault(path, "it is not a number", REBUILD)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(0),
            Err(source) => Err(Error::file(&path, "read", source)),
        }
    }

    fn path(&self, number: i64) -> PathBuf {
        self.index.join(format!("{number}.json"))
    }
}

fn fault(path: PathBuf, fault: &str, remedy: &'static str) -> Error {
    LiveError::Catalogue { path, fault: fault.into(), remedy }.into()
}

/// A time as RFC 3339 in whole seconds, UTC.
pub(super) fn rfc3339(time: SystemTime) -> String {
    humantime::format_rfc3339_seconds(time).to_string()
}
