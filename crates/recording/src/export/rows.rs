//! CSV and Parquet: rows in their order.

use std::io;

use super::{Out, Sink, head};
use crate::mdf::Channel;
use crate::table::ParquetFile;
use stickslip_base::parameters::number::text;

/// Rows per group of a Parquet file.
const GROUP: usize = 1 << 16;

/// A CSV file; its numbers read back bit-identically.
pub(super) struct Csv<'a> {
    out: Out<'a>,
}

impl<'a> Csv<'a> {
    pub(super) fn new(out: Out<'a>, columns: &[&Channel]) -> io::Result<Self> {
        writeln!(out, "{}", columns.iter().map(|channel| head(channel)).collect::<Vec<_>>().join(","))?;
        Ok(Csv { out })
    }
}

impl Sink for Csv<'_> {
    fn row(&mut self, row: &[f64]) -> io::Result<()> {
        for (place, value) in row.iter().enumerate() {
            let comma = if place == 0 { "" } else { "," };
            write!(self.out, "{comma}{}", text(*value))?;
        }
        writeln!(self.out)
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        Ok(())
    }
}

/// A Parquet file, with units as metadata as in all tables of the program.
pub(super) struct Parquet<'a> {
    file: ParquetFile<Out<'a>>,
    columns: Vec<Vec<f64>>,
}

impl<'a> Parquet<'a> {
    pub(super) fn new(out: Out<'a>, columns: &[&Channel]) -> io::Result<Self> {
        let named = columns.iter().map(|channel| (channel.name.as_str(), channel.unit.as_str()));
        Ok(Parquet { file: ParquetFile::new(out, named)?, columns: vec![Vec::with_capacity(GROUP); columns.len()] })
    }

    fn group(&mut self) -> io::Result<()> {
        self.file.rows(self.columns.iter().map(Vec::as_slice))?;
        self.columns.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

impl Sink for Parquet<'_> {
    fn row(&mut self, row: &[f64]) -> io::Result<()> {
        self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(*value));
        if self.columns[0].len() == GROUP { self.group() } else { Ok(()) }
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        if !self.columns[0].is_empty() {
            self.group()?;
        }
        self.file.close()
    }
}
