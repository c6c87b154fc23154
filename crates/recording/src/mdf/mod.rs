//! Recordings as MDF 4, the format of measurement tools: written while a bench runs, and recoverable after any
//! interruption.
//!
//! A file is a tree of blocks, each a name of two letters, links (addresses in the file) and data:
//!
//! ```text
//! ID  HD ─┬─ FH                program that wrote it
//!         ├─ MD                comment and properties
//!         ├─ DG ─┬─ CG ─ CN …  the channels: `time` [s], the master; `cycle`; those of the user, all 64 bits wide
//!         │      └─ HL ─ DL ─ DZ, DL ─ DZ, …   the rows, compressed, a block at least each 0.1 s
//!         ├─ EV …              events at a cycle
//!         └─ AT …              attached files
//! ```
//!
//! The [`Writer`] only appends: new blocks are written completely at the end, then one link (8 bytes) is set to them.
//! Until [`Writer::finish`] the file is marked as unfinalised. [`recover`] does not use links that were set later: it
//! reads the file block by block, keeps complete blocks (rows have a checksum) and sets all links again.
//!
//! From files of other programs [`read`] accepts rows of fixed length: sorted, compressed or not, numbers of any width
//! and byte order, conversions that are linear or a quotient of polynomials. Texts and arrays are omitted.
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

use super::unreadable;
use stickslip_base::{Error, input};

/// Description of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Time of cycle 0, UTC, to the nanosecond.
    pub start: SystemTime,
    /// Name of the program that wrote it.
    pub program: String,
    /// Version of the program.
    pub version: String,
    /// Comment.
    pub comment: String,
    /// Properties: names and values.
    pub properties: Vec<(String, String)>,
}

/// A signal, without its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name, unique in its recording.
    pub name: String,
    /// Unit; empty if there is none.
    pub unit: String,
    /// Comment.
    pub comment: String,
}

/// An event at a cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The cycle.
    pub cycle: u64,
    /// Name of the event.
    pub name: String,
    /// Details, or empty.
    pub comment: String,
    /// Cause of the event.
    pub cause: Cause,
}

/// Cause of an event; the numbers are those of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Another cause.
    Other = 0,
    /// An error.
    Error = 1,
    /// The program.
    Tool = 2,
    /// A script.
    Script = 3,
    /// A user.
    User = 4,
}

/// A file within the recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Attachment {
    /// Its name.
    pub name: String,
    /// Media type, such as `application/toml`.
    pub mime: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// Totals of a finished file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Number of rows.
    pub rows: u64,
    /// Length of the file.
    pub bytes: u64,
    /// Bytes of incomplete blocks, which a recovery ignored.
    pub discarded: u64,
}

/// Contents of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// Description.
    pub header: Header,
    /// Groups of signals that were sampled together; a file of stickslip has one.
    pub groups: Vec<Group>,
    /// Events with their times [s]. The cycle of an event of another program is the base of its time.
    pub events: Vec<(f64, Event)>,
    /// Attachments within the file.
    pub attachments: Vec<Attachment>,
    /// False if the writer was interrupted; the contents up to then are here.
    pub finished: bool,
}

/// Signals that were sampled together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Name, name of the source, or comment; may be empty.
    pub name: String,
    /// Index of the signal with the time of the samples.
    pub master: Option<usize>,
    /// Signals of equal length.
    pub signals: Vec<Signal>,
}

/// A channel with its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// The channel.
    pub channel: Channel,
    /// One value per row, in the channel's unit and without the origin; NaN for invalid values.
    pub values: Vec<f64>,
    /// Zero of the values: 0 except for whole numbers that exceed the precision of `f64`.
    pub origin: f64,
    /// The reason why all values are NaN, for an unknown conversion.
    pub(crate) fault: Option<String>,
}

/// Reads a whole file, also of an interrupted writer.
///
/// # Errors
/// A file that cannot be read, is damaged or cut, or is an unsupported kind of MDF.
pub fn read(path: &Path) -> Result<Contents, Error> {
    let bytes = input::read(path, input::RECORDING)?;
    reader::contents(&bytes).map_err(|fault| fault.of(path))
}

/// A file with sequential access to its rows: only the compressed file is in memory.
pub struct Opened {
    path: PathBuf,
    bytes: Vec<u8>,
    head: Contents,
    groups: Vec<reader::Layouts>,
}

impl Opened {
    /// Reads everything except the rows, also of an interrupted writer.
    ///
    /// # Errors
    /// As [`read`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut bytes = input::read(path, input::RECORDING)?;
        let of = |fault: Fault| fault.of(path);
        let (complete, finished) = reader::complete(&bytes).map_err(of)?;
        if let Cow::Owned(repaired) = complete {
            bytes = repaired;
        }
        let (head, groups) = reader::head(&bytes, finished).map_err(of)?;
        Ok(Opened { path: path.to_owned(), bytes, head, groups })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its contents without the groups.
    pub fn head(&self) -> &Contents {
        &self.head
    }

    /// Channels of the first group with numbers.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.groups.first().into_iter().flat_map(|group| group.channels.iter().map(|(channel, _)| channel))
    }

    /// Number of rows of the first group.
    pub fn len(&self) -> usize {
        self.groups.first().map_or(0, |group| group.rows)
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values of the channels of these names in the first group, row by row; `None` if one is missing.
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
    /// The next row; `None` after the last.
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

/// All groups of a file in memory.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Contents, Error> {
    reader::contents(bytes).map_err(|fault| fault.of(path))
}

/// A fault of a file with its remedy.
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
