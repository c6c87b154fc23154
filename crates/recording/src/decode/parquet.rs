//! Recordings as Parquet, of stickslip and of other programs.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, Int96};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::group::{Group, Table, list};
use crate::column::{Column, Integers};
use crate::unreadable;
use stickslip_base::{Error, input};

/// Reads flat columns of numbers and time stamps; other columns are omitted. Empty cells are faults of their column.
pub(super) fn read(path: &Path) -> Result<Table, Error> {
    let failed = |error: ParquetError| {
        let remedy = "Write it again, uncompressed or with Snappy.";
        unreadable(path, &error.to_string(), remedy)
    };
    let file = input::open(path, input::RECORDING)?;
    let file = SerializedFileReader::new(file).map_err(failed)?;
    let units = units(&file);
    let schema = file.metadata().file_metadata().schema_descr_ptr();
    let (mut columns, mut omitted) = (Vec::new(), Vec::new());
    for (index, description) in schema.columns().iter().enumerate() {
        let name = description.path().string();
        match values(&file, index, description).map_err(failed)? {
            Some(values) => {
                let unit = unit_of_stamps(description).map(str::to_owned).or_else(|| units.get(&name).cloned());
                columns.push(values.column(&name).with_unit(unit));
            }
            None => omitted.push(name),
        }
    }
    let mut notes = Vec::new();
    if !omitted.is_empty() && !columns.is_empty() {
        let names = list(omitted.iter().map(String::as_str));
        notes.push(format!("Columns of texts, lists or other types were not read: {names}."));
    }
    Ok(Table { groups: vec![Group::new("", None, columns)], notes })
}

/// Numbers of a column.
enum Values {
    Floats(Vec<f64>),
    /// Whole numbers and the value of one.
    Integers(Integers, f64),
}

impl Values {
    fn column(self, name: &str) -> Column {
        match self {
            Values::Floats(values) => Column::new(name, values),
            Values::Integers(integers, scale) => integers.column(name, scale),
        }
    }
}

/// The values of all groups of rows; `None` for a column that has no numbers.
fn values(
    file: &SerializedFileReader<File>,
    index: usize,
    description: &ColumnDescriptor,
) -> Result<Option<Values>, ParquetError> {
    if description.max_rep_level() > 0 {
        return Ok(None);
    }
    let unsigned = is_unsigned(description);
    // Stamps are differences from the first one.
    let relative = unit_of_stamps(description).is_some();
    let (mut floats, mut integers) = (Vec::new(), Integers { relative, ..Integers::default() });
    let level = description.max_def_level();
    for group in 0..file.num_row_groups() {
        let rows = file.metadata().row_group(group).num_rows() as usize;
        let mut float = |value: Option<f64>| floats.push(value.unwrap_or(f64::NAN));
        let mut whole = |value: Option<i128>| integers.push(value);
        match file.get_row_group(group)?.get_column_reader(index)? {
            ColumnReader::DoubleColumnReader(r) => take(r, rows, level, &mut float)?,
            ColumnReader::FloatColumnReader(r) => take(r, rows, level, |v| float(v.map(f64::from)))?,
            ColumnReader::BoolColumnReader(r) => take(r, rows, level, |v| float(v.map(|v| u8::from(v).into())))?,
            ColumnReader::Int32ColumnReader(r) if unsigned => {
                take(r, rows, level, |v| whole(v.map(|v| i128::from(v as u32))))?;
            }
            ColumnReader::Int64ColumnReader(r) if unsigned => {
                take(r, rows, level, |v| whole(v.map(|v| i128::from(v as u64))))?;
            }
            ColumnReader::Int32ColumnReader(r) => take(r, rows, level, |v| whole(v.map(i128::from)))?,
            ColumnReader::Int64ColumnReader(r) => take(r, rows, level, |v| whole(v.map(i128::from)))?,
            ColumnReader::Int96ColumnReader(r) => take(r, rows, level, |v| whole(v.map(|v| nanoseconds(&v))))?,
            ColumnReader::ByteArrayColumnReader(r) if is_decimal(description) => {
                take(r, rows, level, |v| whole(v.map(|v| big_endian(v.data()))))?;
            }
            ColumnReader::FixedLenByteArrayColumnReader(r) if is_decimal(description) => {
                take(r, rows, level, |v| whole(v.map(|v| big_endian(v.data()))))?;
            }
            _ => return Ok(None),
        }
    }
    if integers.values.is_empty() {
        return Ok(Some(Values::Floats(floats)));
    }
    Ok(Some(Values::Integers(integers, scale(description))))
}

/// Whether whole numbers are unsigned, in either notation of the type.
fn is_unsigned(description: &ColumnDescriptor) -> bool {
    let logical = matches!(description.logical_type_ref(), Some(LogicalType::Integer(integer)) if !integer.is_signed);
    let unsigned = [ConvertedType::UINT_8, ConvertedType::UINT_16, ConvertedType::UINT_32, ConvertedType::UINT_64];
    logical || unsigned.contains(&description.converted_type())
}

/// Whether numbers are decimal fractions, stored as whole numbers.
fn is_decimal(description: &ColumnDescriptor) -> bool {
    description.converted_type() == ConvertedType::DECIMAL
        || matches!(description.logical_type_ref(), Some(LogicalType::Decimal(_)))
}

/// A signed number of any width up to 16 bytes; wider ones are cut, as their upper bytes are signs in practice.
fn big_endian(bytes: &[u8]) -> i128 {
    let negative = bytes.first().is_some_and(|byte| byte & 0x80 != 0);
    bytes.iter().fold(if negative { -1 } else { 0 }, |number, byte| number << 8 | i128::from(*byte))
}

/// Value of one unit of a decimal number.
fn scale(description: &ColumnDescriptor) -> f64 {
    if is_decimal(description) { 10f64.powi(-description.type_scale()) } else { 1.0 }
}

/// Unit of a column of time stamps or times of day.
fn unit_of_stamps(description: &ColumnDescriptor) -> Option<&'static str> {
    let name = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => "ms",
        TimeUnit::MICROS => "us",
        TimeUnit::NANOS => "ns",
    };
    match (description.logical_type_ref(), description.converted_type()) {
        (Some(LogicalType::Timestamp(stamp)), _) => Some(name(&stamp.unit)),
        (Some(LogicalType::Time(time)), _) => Some(name(&time.unit)),
        (_, ConvertedType::TIMESTAMP_MILLIS | ConvertedType::TIME_MILLIS) => Some("ms"),
        (_, ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS) => Some("us"),
        _ if description.physical_type() == parquet::basic::Type::INT96 => Some("ns"),
        _ => None,
    }
}

/// Nanoseconds since 1970: nanoseconds of the day, then the Julian day.
fn nanoseconds(stamp: &Int96) -> i128 {
    const DAY_OF_1970: i128 = 2_440_588;
    const DAY: i128 = 86_400_000_000_000;
    let words = stamp.data();
    let of_day = i128::from(words[0]) | i128::from(words[1]) << 32;
    (i128::from(words[2]) - DAY_OF_1970) * DAY + of_day
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

/// Hands over all values of a group, `None` for missing ones.
fn take<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    level: i16,
    mut value: impl FnMut(Option<T::T>),
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
    let mut raw = raw.into_iter();
    if level == 0 {
        raw.for_each(|number| value(Some(number)));
    } else {
        levels.iter().for_each(|l| value(if *l == level { raw.next() } else { None }));
    }
    Ok(())
}
