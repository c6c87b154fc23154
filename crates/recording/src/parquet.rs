//! Recordings as Parquet, of stickslip and of other programs.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use parquet::basic::{LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::{Column, Recording, unreadable};
use stickslip_base::{Error, input};

/// Reads flat columns of numbers and time stamps; other columns are omitted. Empty cells are faults of their column.
pub(super) fn read(path: &Path) -> Result<Recording, Error> {
    let failed = |error: ParquetError| {
        let remedy = "Write it again, uncompressed or with Snappy.";
        unreadable(path, &error.to_string(), remedy)
    };
    let file = input::open(path, input::RECORDING)?;
    let file = SerializedFileReader::new(file).map_err(failed)?;
    let units = units(&file);
    let schema = file.metadata().file_metadata().schema_descr_ptr();
    let mut columns = Vec::new();
    for (index, description) in schema.columns().iter().enumerate() {
        let mut values = Vec::new();
        for group in 0..file.num_row_groups() {
            let rows = file.metadata().row_group(group).num_rows() as usize;
            let reader = file.get_row_group(group).and_then(|g| g.get_column_reader(index)).map_err(failed)?;
            if description.max_rep_level() > 0 {
                break;
            }
            let level = description.max_def_level();
            match reader {
                ColumnReader::DoubleColumnReader(r) => take(r, rows, level, &mut values, |v| v),
                ColumnReader::FloatColumnReader(r) => take(r, rows, level, &mut values, f64::from),
                ColumnReader::Int32ColumnReader(r) => take(r, rows, level, &mut values, f64::from),
                ColumnReader::Int64ColumnReader(r) => take(r, rows, level, &mut values, |v| v as f64),
                ColumnReader::BoolColumnReader(r) => take(r, rows, level, &mut values, |v| f64::from(u8::from(v))),
                _ => break,
            }
            .map_err(failed)?;
        }
        if values.is_empty() {
            continue;
        }
        let name = description.name();
        let mut unit = units.get(name).cloned();
        if let Some(LogicalType::Timestamp(stamp)) = description.logical_type_ref() {
            // Relative to the first stamp: nanoseconds since 1970 exceed the precision of a number.
            let start = values[0];
            values.iter_mut().for_each(|v| *v -= start);
            let name = match stamp.unit {
                TimeUnit::MILLIS => "ms",
                TimeUnit::MICROS => "us",
                TimeUnit::NANOS => "ns",
            };
            unit = Some(name.to_owned());
        }
        columns.push(Column::new(name, values).with_unit(unit));
    }
    Recording::from_table(path, columns)
}

/// Unit of each column: `unit.NAME`, as this program writes it, or a JSON object under `units`.
fn units(file: &SerializedFileReader<File>) -> BTreeMap<String, String> {
    let metadata = file.metadata().file_metadata().key_value_metadata().map_or(&[][..], Vec::as_slice);
    let mut units = BTreeMap::new();
    for entry in metadata {
        let Some(value) = &entry.value else { continue };
        if entry.key == "units" {
            units.extend(serde_json::from_str::<BTreeMap<String, String>>(value).unwrap_or_default());
        } else if let Some(name) = entry.key.strip_prefix("unit.") {
            units.insert(name.to_owned(), value.clone());
        }
    }
    units
}

/// Reads all rows of a group; missing values become NaN.
fn take<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    level: i16,
    values: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
) -> Result<(), ParquetError> {
    let (mut raw, mut levels) = (Vec::new(), Vec::new());
    let mut read = 0;
    while read < rows {
        let (records, _, _) = reader.read_records(rows - read, Some(&mut levels), None, &mut raw)?;
        if records == 0 {
            break;
        }
        read += records;
    }
    if level == 0 {
        values.extend(raw.into_iter().map(number));
    } else {
        let mut raw = raw.into_iter().map(number);
        values.extend(levels.iter().map(|l| if *l == level { raw.next().unwrap_or(f64::NAN) } else { f64::NAN }));
    }
    Ok(())
}
