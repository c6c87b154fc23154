//! Columns of numbers with units, as CSV files. Parquet files: `stickslip_recording::table`.

use std::path::Path;

use crate::parameters::number::text;
use crate::{Error, output};

/// A named column in an SI unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// As in the file.
    pub name: String,
    /// SI unit; in the file's metadata as `unit.NAME`.
    pub unit: String,
    /// One value per row.
    pub values: Vec<f64>,
}

/// Writes columns of equal length as CSV, units in square brackets behind the names; a number reads back to its bits.
///
/// # Errors
/// [`Error::File`].
pub fn write_csv(path: &Path, columns: &[Column]) -> Result<(), Error> {
    let line = |cells: &mut dyn Iterator<Item = String>| cells.collect::<Vec<_>>().join(",");
    output::write_with(path, |file| {
        writeln!(file, "{}", line(&mut columns.iter().map(|column| format!("{} [{}]", column.name, column.unit))))?;
        let rows = columns.iter().map(|column| column.values.len()).min().unwrap_or(0);
        for row in 0..rows {
            writeln!(file, "{}", line(&mut columns.iter().map(|column| text(column.values[row]))))?;
        }
        Ok(())
    })
}
