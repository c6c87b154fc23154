//! Recordings as MDF 4, the format of measurement tools: written while a bench runs, whole after any interruption.
//!
//! A file is a tree of blocks, each a name of two letters, links (addresses in the file) and data:
//!
//! ```text
//! ID  HD ─┬─ FH                which program wrote it
//!         ├─ MD                comment and properties
//!         ├─ DG ─┬─ CG ─ CN …  the channels: `time` [s], the master; `cycle`; those of the user, all 64 bits wide
//!         │      └─ HL ─ DL ─ DZ, DL ─ DZ, …   the rows, compressed, a block at least each 0.1 s
//!         ├─ EV …              events at a cycle
//!         └─ AT …              attached files
//! ```
//!
//! The [`Writer`] only appends: what is new is written whole behind the end, then one link (8 bytes) is set to it.
//! Until [`Writer::finish`] the file is marked as unfinalised. [`recover`] needs no link that was set later: it goes
//! through the file from block to block, keeps what is whole (rows carry a checksum) and sets all links again.
//!
//! Of others' files [`read`] takes rows of fixed length: sorted, compressed or not, numbers of any width and byte
//! order, conversions that are linear or a quotient of polynomials. Texts and arrays are left out.
//!
//! ASAM MDF 4.1.0, "Measurement Data Format", programmer's guide.

mod block;
mod channel;
mod data;
mod head;
mod reader;
mod recovery;
#[cfg(test)]
mod tests;
mod writer;

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

pub use recovery::recover;
pub use writer::Writer;

use super::{Column, Recording, unreadable};
use stickslip_base::Error;

/// What a recording says of itself as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// When cycle 0 was, UTC, to the nanosecond.
    pub start: SystemTime,
    /// Which program wrote it.
    pub program: String,
    /// That program's version.
    pub version: String,
    /// In words.
    pub comment: String,
    /// Names and values.
    pub properties: Vec<(String, String)>,
}

/// A signal, without its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Unique in its recording.
    pub name: String,
    /// Empty where there is none.
    pub unit: String,
    /// In words.
    pub comment: String,
}

/// Something that happened at a cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// In which cycle.
    pub cycle: u64,
    /// In a few words.
    pub name: String,
    /// More of it, or empty.
    pub comment: String,
    /// Who caused it.
    pub cause: Cause,
}

/// Who caused an event; the numbers are those of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// None of those below.
    Other = 0,
    /// Something went wrong.
    Error = 1,
    /// The program by itself.
    Tool = 2,
    /// A recipe.
    Script = 3,
    /// A person.
    User = 4,
}

/// A file within the recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Attachment {
    /// Its name.
    pub name: String,
    /// What it is, as `application/toml`.
    pub mime: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// What stands in a file in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Number of rows.
    pub rows: u64,
    /// Length of the file.
    pub bytes: u64,
    /// Bytes of no whole block, which a recovery left aside.
    pub discarded: u64,
}

/// A whole file.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// Of the whole.
    pub header: Header,
    /// Signals that were sampled together; a file of ours has one.
    pub groups: Vec<Group>,
    /// With their times [s]. The cycle of an event that another program wrote is the base of its time.
    pub events: Vec<(f64, Event)>,
    /// Those that lie within the file.
    pub attachments: Vec<Attachment>,
    /// False where the writer did not come to its end: what it had written is here.
    pub finished: bool,
}

/// Signals that were sampled together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Or empty.
    pub name: String,
    /// All of one length.
    pub signals: Vec<Signal>,
}

/// A channel with its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// What it is.
    pub channel: Channel,
    /// One a row, in the channel's unit; NaN where the file says that there is none.
    pub values: Vec<f64>,
    /// Why all values are NaN, where a conversion is not known.
    fault: Option<String>,
}

/// Reads a whole file; what was recorded also where the writer did not come to its end.
///
/// # Errors
/// A file that cannot be read, is damaged or cut, or is a kind of MDF that is not read.
pub fn read(path: &Path) -> Result<Contents, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::file(path, "read", source))?;
    reader::contents(&bytes).map_err(|fault| fault.of(path))
}

/// A file whose rows are taken one after the other: of a long recording only the file itself, compressed, is in memory.
pub struct Opened {
    path: PathBuf,
    bytes: Vec<u8>,
    head: Contents,
    groups: Vec<reader::Layouts>,
}

impl Opened {
    /// Reads all but the rows; of a file whose writer did not come to its end what it had written.
    ///
    /// # Errors
    /// As [`read`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut bytes = std::fs::read(path).map_err(|source| Error::file(path, "read", source))?;
        let of = |fault: Fault| fault.of(path);
        let (whole, finished) = reader::whole(&bytes).map_err(of)?;
        if let Cow::Owned(repaired) = whole {
            bytes = repaired;
        }
        let (head, groups) = reader::head(&bytes, finished).map_err(of)?;
        Ok(Opened { path: path.to_owned(), bytes, head, groups })
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All but the groups.
    pub fn head(&self) -> &Contents {
        &self.head
    }

    /// Channels of the first group that hold numbers.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.groups.first().into_iter().flat_map(|group| group.channels.iter().map(|(channel, _)| channel))
    }

    /// Rows of the first group.
    pub fn len(&self) -> usize {
        self.groups.first().map_or(0, |group| group.rows)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values of the channels of these names in the first group, row after row; none where one is missing.
    pub fn rows(&self, names: &[&str]) -> Option<Rows<'_>> {
        let group = self.groups.first()?;
        let layout = |name: &&str| group.channels.iter().find(|(channel, _)| channel.name == *name);
        let layouts: Vec<_> = names.iter().map(|name| layout(name).map(|(_, layout)| layout)).collect::<Option<_>>()?;
        let values = vec![0.0; layouts.len()];
        Some(Rows { path: &self.path, rows: group.rows(&self.bytes), layouts, values })
    }
}

/// Rows of a file, one after the other.
pub struct Rows<'a> {
    path: &'a Path,
    rows: reader::Rows<'a>,
    layouts: Vec<&'a channel::Layout>,
    values: Vec<f64>,
}

impl Rows<'_> {
    /// The next one; none behind the last.
    ///
    /// # Errors
    /// A file that is damaged or cut.
    pub fn take(&mut self) -> Result<Option<&[f64]>, Error> {
        let Some((row, record)) = self.rows.take().map_err(|fault| fault.of(self.path))? else { return Ok(None) };
        let values = self.values.iter_mut().zip(&self.layouts);
        values.for_each(|(value, layout)| *value = layout.value(row, record));
        Ok(Some(&self.values))
    }
}

/// Whether the bytes are an MDF file of any version.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MDF  ") || bytes.starts_with(block::UNFINISHED)
}

/// The group that has most signals, as columns.
pub(super) fn table(path: &Path, bytes: &[u8]) -> Result<Recording, Error> {
    let contents = reader::contents(bytes).map_err(|fault| fault.of(path))?;
    let size = |group: &Group| (group.signals.len(), group.signals.first().map_or(0, |s| s.values.len()));
    let signals = contents.groups.into_iter().max_by_key(size).map(|group| group.signals).unwrap_or_default();
    let column = |signal: Signal| {
        let unit = Some(signal.channel.unit).filter(|unit| !unit.is_empty());
        let mut column = Column::new(&signal.channel.name, signal.values).with_unit(unit);
        column.fault = signal.fault.map(|fault| (0, fault)).or(column.fault);
        column
    };
    Recording::from_table(path, signals.into_iter().map(column).collect())
}

/// What is wrong with a file, and what to do.
#[derive(Debug, PartialEq)]
struct Fault {
    fault: String,
    remedy: &'static str,
}

impl Fault {
    fn new(fault: impl Into<String>, remedy: &'static str) -> Self {
        Fault { fault: fault.into(), remedy }
    }

    fn of(self, path: &Path) -> Error {
        unreadable(path, &self.fault, self.remedy)
    }
}
