//! Export of a recorded run for other tools: CSV, Parquet, MAT, MCAP.
//!
//! Rows are written one after the other, so that a run may be larger than the memory; only a MAT file, whose variables
//! are columns, is collected in memory. A file is written completely or not at all.

mod mat;
mod mcap;
mod rows;
#[cfg(test)]
mod tests;

use std::io::{self, Write};
use std::path::Path;

use super::mdf::{Channel, Opened};
use super::unreadable;
use stickslip_base::parameters::schema::nearest;
use stickslip_base::{Error, Watch, output};

/// The exported part of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Names of the signals in addition to `time`; empty for all.
    pub signals: Vec<String>,
    /// Start of the part [s], inclusive.
    pub from: f64,
    /// End of the part [s], exclusive.
    pub until: f64,
    /// Decimation: one of `every` rows is exported.
    pub every: u64,
}

impl Default for Part {
    /// The whole run.
    fn default() -> Self {
        Part { signals: Vec::new(), from: f64::NEG_INFINITY, until: f64::INFINITY, every: 1 }
    }
}

/// Result of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exported {
    /// Number of written rows.
    pub rows: u64,
    /// Number of columns, including `time`.
    pub columns: usize,
}

/// Destination of rows.
trait Sink {
    /// One row, `time` first.
    fn row(&mut self, row: &[f64]) -> io::Result<()>;
    /// Ends the file.
    fn finish(self: Box<Self>) -> io::Result<()>;
}

/// Kinds of files by the extensions of their names.
pub const KINDS: [&str; 4] = ["csv", "parquet", "mat", "mcap"];
/// Name of the master channel.
const TIME: &str = "time";
/// Rows between two checks for cancellation.
const LOOK: u64 = 16_384;

/// Checks that the extension of a file name is a known kind.
///
/// # Errors
/// [`Error::Unknown`] with the known kinds.
pub fn check_kind(kind: &str) -> Result<(), Error> {
    if KINDS.contains(&kind) { Ok(()) } else { Err(unknown(kind.to_owned())) }
}

fn unknown(name: String) -> Error {
    let remedy = format!("Valid extensions: {}.", KINDS.map(|kind| format!(".{kind}")).join(", "));
    Error::Unknown { what: "kind of file", name, remedy }
}

/// Exports a part of the run in the MDF file `from`; the extension of `to` selects the kind of file.
///
/// # Errors
/// A file that cannot be read or written, or is of an unknown kind; an unknown signal; [`Error::Cancelled`].
pub fn export(from: &Path, to: &Path, part: &Part, watch: &Watch) -> Result<Exported, Error> {
    let kind = to.extension().and_then(|kind| kind.to_str()).unwrap_or_default().to_ascii_lowercase();
    if check_kind(&kind).is_err() {
        return Err(unknown(to.display().to_string()));
    }
    let file = Opened::open(from)?;
    let columns = columns(&file, from, &part.signals)?;
    let names: Vec<&str> = columns.iter().map(|channel| channel.name.as_str()).collect();
    let mut exported = Exported { rows: 0, columns: columns.len() };
    let mut ended = Ok(());
    output::write_with(to, |out| {
        let mut sink: Box<dyn Sink + '_> = match kind.as_str() {
            "csv" => Box::new(rows::Csv::new(out, &columns)?),
            "parquet" => Box::new(rows::Parquet::new(out, &columns)?),
            "mat" => Box::new(mat::Mat::new(out, &columns)),
            _ => Box::new(mcap::Mcap::new(out, &columns, &file.head().header)?),
        };
        ended = each(&file, &names, part, watch, |row| {
            exported.rows += 1;
            sink.row(row)
        });
        if ended.is_err() {
            // Nothing is written; the reason is returned below.
            return Err(io::ErrorKind::Interrupted.into());
        }
        sink.finish()
    })
    .or_else(|error| ended.and(Err(error)))?;
    Ok(exported)
}

/// Calls `take` with each row of a part.
fn each(
    file: &Opened,
    names: &[&str],
    part: &Part,
    watch: &Watch,
    mut take: impl FnMut(&[f64]) -> io::Result<()>,
) -> Result<(), Error> {
    let of = file.len().max(1) as f64;
    let mut rows = file.rows(names).unwrap_or_else(|| unreachable!("all names are of channels"));
    let (mut number, mut within) = (0_u64, 0_u64);
    while let Some(row) = rows.take()? {
        if number.is_multiple_of(LOOK) {
            watch.stage("export", number as f64 / of)?;
        }
        number += 1;
        if row[0] >= part.until {
            break;
        }
        if row[0] >= part.from {
            if within.is_multiple_of(part.every.max(1)) {
                take(row).map_err(|source| Error::file(file.path(), "export", source))?;
            }
            within += 1;
        }
    }
    Ok(())
}

/// `time`, and the channels of these names or all.
fn columns<'a>(file: &'a Opened, path: &Path, signals: &[String]) -> Result<Vec<&'a Channel>, Error> {
    let known: Vec<&Channel> = file.channels().collect();
    let find = |name: &str| known.iter().find(|channel| channel.name == name).copied();
    let time = find(TIME)
        .ok_or_else(|| unreadable(path, "missing channel `time`", "Use the run.mf4 of a stickslip command."))?;
    let others = if signals.is_empty() {
        known.iter().filter(|channel| channel.name != TIME).copied().collect()
    } else {
        let channel = |name: &String| {
            find(name).ok_or_else(|| Error::Unknown {
                what: "signal",
                name: name.clone(),
                remedy: match nearest(name, known.iter().map(|channel| channel.name.as_str())) {
                    Some(nearest) => format!("Did you mean {nearest}?"),
                    None => format!("Signals: {}.", known.iter().map(|c| &*c.name).collect::<Vec<_>>().join(", ")),
                },
            })
        };
        signals.iter().map(channel).collect::<Result<Vec<_>, _>>()?
    };
    Ok([time].into_iter().chain(others).collect())
}

/// Heading of a column: name and unit.
fn head(channel: &Channel) -> String {
    if channel.unit.is_empty() { channel.name.clone() } else { format!("{} [{}]", channel.name, channel.unit) }
}

/// A writer to any destination.
type Out<'a> = &'a mut (dyn Write + Send);
