//! Reading a record from its file.

use std::path::Path;

use stickslip_software::cycle::Change;

use super::Record;
use super::change::parse;
use super::recorder::{BEGIN, CHANGED, LOST, PRESET, SCHEMA, STATE};
use super::replay::{Replayed, replayed};
use super::signals::{Signals, channels};
use crate::tap::{ChangeKind, Changed};
use stickslip_base::parameters::presets::Source;
use stickslip_base::{Error, Watch};
use stickslip_recording::mdf::{Opened, Rows};
use stickslip_recording::unreadable;

impl Record {
    /// Reads a whole run into memory.
    ///
    /// # Errors
    /// As [`Stored::open`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let mut stored = Stored::open(path)?;
        stored.record.cycles = stored.cycles()?.collect::<Result<_, _>>()?;
        Ok(stored.record)
    }
}

/// A run in its file, whose cycles are read one after the other, so that it may exceed the memory.
pub struct Stored {
    /// The run without its cycles.
    pub(super) record: Record,
    file: Opened,
    /// First cycle.
    begin: u64,
}

impl Stored {
    /// Opens the file of a run, also an incomplete one.
    ///
    /// # Errors
    /// An unreadable file, a file without a run, or a record of another program version.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = Opened::open(path)?;
        let contents = file.head();
        let property = |name: &str| {
            contents.header.properties.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
        };
        let invalid_record = |what: &str| invalid_record(path, what);
        if property("schema") != Some(SCHEMA) {
            return Err(invalid_record("its schema property is missing or unknown"));
        }
        let (theirs, ours) = (&contents.header.version, env!("CARGO_PKG_VERSION"));
        if theirs != ours {
            let fault = format!("it was recorded by stickslip {theirs}, this is {ours}");
            return Err(unreadable(path, &fault, &format!("Replay it with stickslip {theirs}.")));
        }
        let attached = contents.attachments.iter().find(|file| file.name == PRESET);
        let text = attached.and_then(|file| String::from_utf8(file.bytes.clone()).ok());
        let text = text.ok_or_else(|| invalid_record("its parameters are missing"))?;
        let preset = Source { file: format!("{}: {PRESET}", path.display()), text }.read()?;
        let state = contents.attachments.iter().find(|file| file.name == STATE);
        let state = state.map(|file| row(&file.bytes).ok_or_else(|| invalid_record("its initial state is invalid")));
        let mut events = Events::default();
        for (_, event) in &contents.events {
            let line = event.comment.lines().next().unwrap_or_default();
            let valid = match event.name.as_str() {
                BEGIN => match parse(line) {
                    Some(ChangeKind::Software(Change::Parameters(parameters), _)) => {
                        events.initial = Some(parameters);
                        events.begin = event.cycle;
                        true
                    }
                    _ => false,
                },
                LOST => line.parse().map(|lost| events.lost.push((event.cycle, lost))).is_ok(),
                name if CHANGED.contains(&name) => {
                    parse(line).map(|what| events.changes.push(Changed { cycle: event.cycle, what })).is_some()
                }
                _ => true,
            };
            if !valid && event.name == BEGIN {
                let fault = "its set of parameters is not that of this build of stickslip";
                return Err(unreadable(path, fault, "Replay it with the build that recorded it."));
            }
            if !valid {
                return Err(invalid_record(&format!("the event {} at cycle {} is unknown", event.name, event.cycle)));
            }
        }
        let record = Record {
            preset,
            seed: property("seed").and_then(|seed| seed.parse().ok()),
            state: state.transpose()?,
            initial: events.initial.ok_or_else(|| invalid_record("its start event is missing"))?,
            cycles: Vec::new(),
            changes: events.changes,
            lost: events.lost,
        };
        Ok(Stored { record, file, begin: events.begin })
    }

    /// Replays the run.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; a damaged file; errors of the virtual machine of the record.
    pub fn replay(&self, watch: &Watch) -> Result<Replayed, Error> {
        replayed(&self.record, self.cycles()?, self.file.len() as u64, watch)
    }

    /// Number of cycles.
    pub(super) fn len(&self) -> usize {
        self.file.len()
    }

    /// The cycles, in order.
    pub(super) fn cycles(&self) -> Result<Cycles<'_>, Error> {
        let channels = channels();
        let names: Vec<_> = ["cycle"].into_iter().chain(channels.iter().map(|entry| entry.path.as_str())).collect();
        let rows = self.file.rows(&names).ok_or_else(|| invalid_record(self.file.path(), OTHERS))?;
        Ok(Cycles { path: self.file.path(), rows, next: self.begin })
    }
}

/// The cycles of a run in its file.
pub(super) struct Cycles<'a> {
    path: &'a Path,
    rows: Rows<'a>,
    next: u64,
}

impl Cycles<'_> {
    fn take(&mut self) -> Result<Option<(u64, Signals<f64>)>, Error> {
        let Some(row) = self.rows.take()? else { return Ok(None) };
        let cycle = row[0] as u64;
        // Large gaps are refused, since a replay counts through them.
        if cycle < self.next || cycle - self.next > LONGEST_GAP {
            return Err(invalid_record(self.path, "its cycles are not in order"));
        }
        self.next = cycle + 1;
        let signals = Signals::from_row(&row[1..]).ok_or_else(|| invalid_record(self.path, OTHERS))?;
        Ok(Some((cycle, signals)))
    }
}

impl Iterator for Cycles<'_> {
    type Item = Result<(u64, Signals<f64>), Error>;

    fn next(&mut self) -> Option<Self::Item> {
        self.take().transpose()
    }
}

#[derive(Default)]
struct Events {
    initial: Option<stickslip_software::cycle::Parameters<f64>>,
    begin: u64,
    changes: Vec<Changed>,
    lost: Vec<(u64, u64)>,
}

/// The numbers of a state.
fn row(bytes: &[u8]) -> Option<Vec<f64>> {
    std::str::from_utf8(bytes).ok()?.lines().map(|line| line.parse().ok()).collect()
}

/// Maximum number of consecutive held cycles.
const LONGEST_GAP: u64 = 1 << 24;

const OTHERS: &str = "its signals differ from those of this version";

fn invalid_record(path: &Path, what: &str) -> Error {
    unreadable(path, &format!("not a record of a run: {what}"), "Use a run.mf4 written by a stickslip command.")
}
