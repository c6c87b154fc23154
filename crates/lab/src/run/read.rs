//! A record back from its file.

use std::path::Path;

use stickslip_core::cycle::Change;

use super::Record;
use super::change::parse;
use super::recorder::{BEGIN, CHANGED, LOST, PRESET, SCHEMA};
use super::signals::{Signals, channels};
use crate::Error;
use crate::bench::tap::{Changed, What};
use crate::parameters::presets::Source;
use crate::recording::mdf::{self, Contents, Group};
use crate::recording::unreadable;

impl Record {
    /// Reads a run's file; what was recorded also where the recorder did not come to its end.
    ///
    /// # Errors
    /// A file that cannot be read, is no record of a run, or one of another version of the program: that can replay it.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let contents = mdf::read(path)?;
        let property = |name: &str| {
            contents.header.properties.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
        };
        let no_record = |what: &str| {
            unreadable(
                path,
                &format!("it is no record of a run: {what}"),
                "Take the run.mf4 that a command of stickslip left.",
            )
        };
        if property("schema") != Some(SCHEMA) {
            return Err(no_record("its properties do not say so"));
        }
        let (theirs, ours) = (&contents.header.version, env!("CARGO_PKG_VERSION"));
        if theirs != ours {
            let fault = format!("it was recorded by stickslip {theirs}, this is {ours}");
            return Err(unreadable(path, &fault, &format!("Replay it with stickslip {theirs}.")));
        }
        let attached = contents.attachments.iter().find(|file| file.name == PRESET);
        let text = attached.and_then(|file| String::from_utf8(file.bytes.clone()).ok());
        let text = text.ok_or_else(|| no_record("its parameters are missing"))?;
        let preset = Source { file: format!("{}: {PRESET}", path.display()), text }.read()?;
        let mut events = Events::default();
        for (_, event) in &contents.events {
            let line = event.comment.lines().next().unwrap_or_default();
            let known = match event.name.as_str() {
                BEGIN => match parse(line) {
                    Some(What::Software(Change::Parameters(parameters), _)) => {
                        events.initial = Some(parameters);
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
            if !known {
                return Err(no_record(&format!("the event {} at cycle {} is not understood", event.name, event.cycle)));
            }
        }
        Ok(Record {
            preset,
            seed: property("seed").and_then(|seed| seed.parse().ok()),
            initial: events.initial.ok_or_else(|| no_record("its begin is missing"))?,
            cycles: in_order(cycles(&contents).ok_or_else(|| no_record("its signals are others"))?)
                .ok_or_else(|| no_record("its cycles are not in their order"))?,
            changes: events.changes,
            lost: events.lost,
        })
    }
}

#[derive(Default)]
struct Events {
    initial: Option<stickslip_core::cycle::Parameters<f64>>,
    changes: Vec<Changed>,
    lost: Vec<(u64, u64)>,
}

/// More cycles in a row than this are not held: a replay would count through whatever a file claims.
const LONGEST_GAP: u64 = 1 << 24;

/// The same, unless a cycle does not come after the one before, or long after it.
fn in_order(cycles: Vec<(u64, Signals<f64>)>) -> Option<Vec<(u64, Signals<f64>)>> {
    let mut next = 0;
    for (cycle, _) in &cycles {
        if *cycle < next || *cycle - next > LONGEST_GAP {
            return None;
        }
        next = cycle.checked_add(1)?;
    }
    Some(cycles)
}

/// The rows; none where a channel is missing.
fn cycles(contents: &Contents) -> Option<Vec<(u64, Signals<f64>)>> {
    let Group { signals, .. } = contents.groups.first()?;
    let column = |name: &str| signals.iter().find(|signal| signal.channel.name == name).map(|signal| &signal.values);
    let numbers = column("cycle")?;
    let columns = channels().iter().map(|entry| column(&entry.path)).collect::<Option<Vec<_>>>()?;
    let row = |k: usize| {
        let values: Vec<f64> = columns.iter().map(|column| column[k]).collect();
        Some((numbers[k] as u64, Signals::from_row(&values)?))
    };
    (0..numbers.len()).map(row).collect()
}
