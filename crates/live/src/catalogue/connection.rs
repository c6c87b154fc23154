//! The file: opened, brought to this version's form, and its refusals in words.

use crate::LiveError;
use std::path::Path;
use std::time::{Duration, Instant};

use rusqlite::{Connection, ErrorCode, OpenFlags, Transaction, TransactionBehavior};

use super::Catalogue;
use stickslip_base::{Error, output};

/// How long others may be writing.
const PATIENCE: Duration = Duration::from_secs(10);

/// What brings the form of a version to the next one; as many as there are is the version of this program.
pub(super) const MIGRATIONS: [&str; 1] = ["
    CREATE TABLE run (
        number INTEGER PRIMARY KEY AUTOINCREMENT,
        identity TEXT NOT NULL UNIQUE,
        name TEXT NOT NULL,
        kind TEXT NOT NULL,
        begun TEXT NOT NULL,
        duration REAL,
        preset TEXT NOT NULL,
        controller TEXT NOT NULL,
        law TEXT NOT NULL,
        key_name TEXT, key_value REAL, key_unit TEXT,
        tags TEXT NOT NULL,
        note TEXT NOT NULL,
        command TEXT NOT NULL,
        version TEXT NOT NULL,
        folder TEXT NOT NULL,
        files TEXT NOT NULL,
        record TEXT,
        curve TEXT NOT NULL,
        deleted TEXT,
        origin TEXT,
        replaced INTEGER,
        words TEXT NOT NULL
    );
    CREATE INDEX run_folder ON run (folder);
    CREATE TABLE value (
        run INTEGER NOT NULL REFERENCES run ON DELETE CASCADE,
        path TEXT NOT NULL,
        symbol TEXT NOT NULL,
        unit TEXT NOT NULL,
        number REAL,
        text TEXT NOT NULL,
        result INTEGER NOT NULL
    );
    CREATE INDEX value_run ON value (run);
"];

impl Catalogue {
    /// For reading; nothing where there is none yet.
    pub(super) fn look(&self) -> Result<Option<Connection>, Error> {
        if !self.file.exists() {
            return Ok(None);
        }
        match self.open(OpenFlags::SQLITE_OPEN_READ_WRITE, false) {
            // On a disk that takes nothing it can still be read.
            Err(_) if self.file.metadata().is_ok_and(|file| file.is_file()) => self.read_only().map(Some),
            opened => opened.map(Some),
        }
    }

    /// For writing; made where there is none yet.
    pub(super) fn write(&self) -> Result<Connection, Error> {
        if let Some(folder) = self.file.parent() {
            output::create_folder(folder)?;
        }
        self.open(OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE, true)
    }

    fn open(&self, flags: OpenFlags, create: bool) -> Result<Connection, Error> {
        let begun = Instant::now();
        loop {
            match self.try_open(flags, create) {
                // SQLite does not wait for whoever sets up the journal or recovers it, though it was told to.
                Err(error)
                    if matches!(error.of(), Some(LiveError::Catalogue { remedy: BUSY, .. }))
                        && begun.elapsed() < PATIENCE =>
                {
                    std::thread::sleep(Duration::from_millis(5));
                }
                opened => return opened,
            }
        }
    }

    fn try_open(&self, flags: OpenFlags, create: bool) -> Result<Connection, Error> {
        let mut connection =
            Connection::open_with_flags(&self.file, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX).map_err(self.refused())?;
        connection.busy_timeout(PATIENCE).map_err(self.refused())?;
        let version = self.version(&connection)?;
        if version < MIGRATIONS.len() || create {
            // Readers and one writer do not wait for each other.
            connection.pragma_update(None, "journal_mode", "wal").map_err(self.refused())?;
        }
        connection.pragma_update(None, "synchronous", "normal").map_err(self.refused())?;
        connection.pragma_update(None, "foreign_keys", true).map_err(self.refused())?;
        if version < MIGRATIONS.len() {
            self.migrate(&mut connection)?;
        }
        Ok(connection)
    }

    fn read_only(&self) -> Result<Connection, Error> {
        let path = self.file.to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
        // Nobody can change it meanwhile: it needs no files beside it.
        let connection =
            Connection::open_with_flags(format!("file:{path}?immutable=1"), flags).map_err(self.refused())?;
        let version = self.version(&connection)?;
        if version == MIGRATIONS.len() { Ok(connection) } else { Err(self.fault("it has an older form", REBUILD)) }
    }

    /// The version of its form.
    fn version(&self, connection: &Connection) -> Result<usize, Error> {
        let version: i64 =
            connection.pragma_query_value(None, "user_version", |row| row.get(0)).map_err(self.refused())?;
        let version = usize::try_from(version).unwrap_or(usize::MAX);
        if version <= MIGRATIONS.len() {
            return Ok(version);
        }
        let fault = format!("its form is {version}, this program knows {}", MIGRATIONS.len());
        Err(self.fault(&fault, NEWER))
    }

    fn migrate(&self, connection: &mut Connection) -> Result<(), Error> {
        let transaction = self.begin(connection)?;
        // Another process may have been first.
        for (done, step) in MIGRATIONS.iter().enumerate().skip(self.version(&transaction)?) {
            transaction.execute_batch(step).map_err(self.refused())?;
            transaction.pragma_update(None, "user_version", done as i64 + 1).map_err(self.refused())?;
        }
        transaction.commit().map_err(self.refused())
    }

    /// A change, all of it or nothing.
    pub(super) fn begin<'a>(&self, connection: &'a mut Connection) -> Result<Transaction<'a>, Error> {
        connection.transaction_with_behavior(TransactionBehavior::Immediate).map_err(self.refused())
    }

    /// What SQLite said, in words.
    pub(super) fn refused(&self) -> impl Fn(rusqlite::Error) -> Error + '_ {
        |error| {
            let remedy = match error.sqlite_error_code() {
                Some(ErrorCode::NotADatabase | ErrorCode::DatabaseCorrupt) => REBUILD,
                Some(ErrorCode::DiskFull) => "The disk is full: make room.",
                Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::PermissionDenied) => {
                    "Get the right to write it, and its folder."
                }
                Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => BUSY,
                _ => REBUILD,
            };
            self.fault(&error.to_string(), remedy)
        }
    }

    pub(super) fn fault(&self, fault: &str, remedy: &'static str) -> Error {
        LiveError::Catalogue { path: self.file.clone(), fault: fault.into(), remedy }.into()
    }
}

const BUSY: &str = "Another program holds it: try again.";
const NEWER: &str =
    "Use the version of stickslip that made it, or build it again from the folders: `stickslip runs --rebuild`.";
const REBUILD: &str = "Build it again from the folders: `stickslip runs --rebuild`.";

/// Whether building it again is what helps.
pub(super) fn calls_for_rebuild(error: &Error) -> bool {
    matches!(error.of(), Some(LiveError::Catalogue { remedy, .. }) if [NEWER, REBUILD].contains(remedy))
}

/// Moves a file that is no catalogue out of the way, with what SQLite keeps beside it.
pub(super) fn set_aside(file: &Path) -> Result<(), Error> {
    for ending in ["", "-wal", "-shm"] {
        let mut from = file.as_os_str().to_owned();
        from.push(ending);
        let mut to = file.as_os_str().to_owned();
        to.push(".broken");
        to.push(ending);
        match std::fs::rename(&from, &to) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::file(file, "set aside", source));
            }
            _ => {}
        }
    }
    Ok(())
}
