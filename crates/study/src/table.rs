//! `study.parquet` and its parts: one row for each case.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::Plan;
use stickslip_base::Error;
use stickslip_recording::unreadable;

/// The number of the case, from 1.
pub(super) const CASE: &str = "case";
/// Step of the virtual machine, where the tolerance selected it.
pub(super) const STEP: &str = "plant_step";
/// Share by which measures moved when the step was last halved.
pub(super) const ERROR: &str = "step_error";
/// Reason for missing numbers; empty otherwise.
pub(super) const FAILURE: &str = "failure";
/// Metadata key of the inputs of the rows of a part.
const FOLLOWS_FROM: &str = "follows_from";

/// Result of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// Its number, from 1.
    pub case: u64,
    /// Values of the axes, in their order and units.
    pub values: Vec<f64>,
    /// Measures in their order, means over the seeds; `None` where missing.
    pub measures: Vec<Option<f64>>,
    /// Step of the virtual machine [s], where the tolerance selected it.
    pub step: Option<f64>,
    /// Largest share by which a measure moved when the step was last halved.
    pub error: Option<f64>,
    /// Reason for missing measures.
    pub failure: Option<String>,
}

impl Row {
    /// Optional columns: the measures, then step and error.
    pub(super) fn optional(&self, index: usize) -> Option<f64> {
        let behind = |index| [self.step, self.error].get(index).copied();
        match index.checked_sub(self.measures.len()) {
            None => self.measures[index],
            Some(index) => behind(index).flatten(),
        }
    }
}

/// Names and units of the columns, and how many of them are axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    axes: Vec<(String, String)>,
    /// Columns that may lack a number: the measures, then step and error where the tolerance selects the step.
    optional: Vec<(String, String)>,
    chosen: bool,
}

impl Columns {
    pub(super) fn of(plan: &Plan) -> Self {
        let chosen = plan.tolerance.is_some();
        let measures = plan.measures().map(|measure| (measure.name, measure.unit));
        let of_step = [(STEP, "s"), (ERROR, "1")].into_iter().filter(|_| chosen);
        Columns {
            axes: plan.axes.iter().map(|axis| (axis.name.clone(), axis.unit.clone())).collect(),
            optional: measures.chain(of_step).map(|(name, unit)| (name.into(), unit.into())).collect(),
            chosen,
        }
    }

    /// Names and units, those of the axes first.
    pub(super) fn named(&self) -> impl Iterator<Item = (&str, &str)> {
        self.axes.iter().chain(&self.optional).map(|(name, unit)| (name.as_str(), unit.as_str()))
    }

    fn schema(&self) -> Result<Arc<Type>, ParquetError> {
        let field = |name: &str, physical, repetition, logical| {
            let field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
            field.with_logical_type(logical).build().map(Arc::new)
        };
        let mut fields = vec![field(CASE, Physical::INT64, Repetition::REQUIRED, None)?];
        for (name, _) in &self.axes {
            fields.push(field(name, Physical::DOUBLE, Repetition::REQUIRED, None)?);
        }
        for (name, _) in &self.optional {
            fields.push(field(name, Physical::DOUBLE, Repetition::OPTIONAL, None)?);
        }
        fields.push(field(FAILURE, Physical::BYTE_ARRAY, Repetition::OPTIONAL, Some(LogicalType::String))?);
        Type::group_type_builder("study").with_fields(fields).build().map(Arc::new)
    }
}

/// Writer of a file of rows, one group after the other.
pub(super) struct Writer<W: Write + Send> {
    file: SerializedFileWriter<W>,
    axes: usize,
    optional: usize,
}

impl<W: Write + Send> Writer<W> {
    /// A file with units and the inputs of the rows in the metadata.
    pub(super) fn new(out: W, columns: &Columns, follows_from: &str) -> io::Result<Self> {
        let unit = |(name, unit): (&str, &str)| KeyValue::new(format!("unit.{name}"), unit.to_owned());
        let mut metadata: Vec<KeyValue> = columns.named().map(unit).collect();
        metadata.push(KeyValue::new(FOLLOWS_FROM.into(), follows_from.to_owned()));
        let properties = WriterProperties::builder()
            .set_key_value_metadata(Some(metadata))
            .set_created_by(concat!("stickslip ", env!("CARGO_PKG_VERSION")).into())
            .build();
        let file = SerializedFileWriter::new(out, columns.schema()?, Arc::new(properties))?;
        Ok(Writer { file, axes: columns.axes.len(), optional: columns.optional.len() })
    }

    /// Writes a group of rows.
    pub(super) fn rows(&mut self, rows: &[Row]) -> io::Result<()> {
        let (axes, optional) = (self.axes, self.optional);
        let mut group = self.file.next_row_group()?;
        let mut column = 0;
        while let Some(mut writer) = group.next_column()? {
            if column == 0 {
                let cases: Vec<i64> = rows.iter().map(|row| row.case as i64).collect();
                writer.typed::<Int64Type>().write_batch(&cases, None, None)?;
            } else if column <= axes {
                let values: Vec<f64> = rows.iter().map(|row| row.values[column - 1]).collect();
                writer.typed::<DoubleType>().write_batch(&values, None, None)?;
            } else if column <= axes + optional {
                let (values, levels) = present(rows.iter().map(|row| row.optional(column - 1 - axes)));
                writer.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            } else {
                let texts = rows.iter().map(|row| row.failure.as_deref().map(ByteArray::from));
                let (values, levels) = present(texts);
                writer.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            }
            writer.close()?;
            column += 1;
        }
        group.close()?;
        Ok(())
    }

    /// Finishes the file.
    pub(super) fn close(self) -> io::Result<()> {
        self.file.close()?;
        Ok(())
    }
}

/// The existing values, and which rows have one.
fn present<T>(values: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let (mut there, mut levels) = (Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(value.is_some()));
        there.extend(value);
    }
    (there, levels)
}

/// A file with these columns and inputs; `None` for any other file.
fn same(path: &Path, columns: &Columns, follows_from: &str) -> Option<SerializedFileReader<File>> {
    let file = SerializedFileReader::new(File::open(path).ok()?).ok()?;
    let metadata = file.metadata().file_metadata();
    let inputs = metadata.key_value_metadata()?.iter().find(|pair| pair.key == FOLLOWS_FROM)?;
    let same = inputs.value.as_deref() == Some(follows_from) && metadata.schema() == &*columns.schema().ok()?;
    same.then_some(file)
}

/// The rows of a part, if it is complete and has these columns and inputs.
pub(super) fn read_part(path: &Path, columns: &Columns, follows_from: &str) -> Option<Vec<Row>> {
    let file = same(path, columns, follows_from).filter(|file| file.num_row_groups() == 1)?;
    group(&file, 0, columns).ok()
}

/// Number of rows of a study's file, if it has these columns and inputs.
pub(super) fn rows(path: &Path, columns: &Columns, follows_from: &str) -> Option<u64> {
    let file = same(path, columns, follows_from)?;
    u64::try_from(file.metadata().file_metadata().num_rows()).ok()
}

/// Calls with the rows of each group of a study's file.
///
/// # Errors
/// [`Error::Recording`] for an invalid file; errors of `take`.
pub(super) fn each(path: &Path, columns: &Columns, mut take: impl FnMut(Vec<Row>)) -> Result<(), Error> {
    let failed = |error: ParquetError| unreadable(path, &error.to_string(), "Run the study again.");
    let file = File::open(path).map_err(|source| Error::file(path, "read", source))?;
    let file = SerializedFileReader::new(file).map_err(failed)?;
    for index in 0..file.num_row_groups() {
        take(group(&file, index, columns).map_err(failed)?);
    }
    Ok(())
}

fn group(file: &SerializedFileReader<File>, index: usize, columns: &Columns) -> Result<Vec<Row>, ParquetError> {
    let group = file.get_row_group(index)?;
    let count = group.metadata().num_rows() as usize;
    let mut rows = vec![Row::default(); count];
    let short = || ParquetError::General("a column is shorter than others".into());
    for column in 0..group.num_columns() {
        let (mut levels, optional) = (Vec::new(), column > columns.axes.len());
        match group.get_column_reader(column)? {
            ColumnReader::Int64ColumnReader(mut reader) => {
                let mut cases = Vec::new();
                reader.read_records(count, None, None, &mut cases)?;
                rows.iter_mut().zip(cases).for_each(|(row, case)| row.case = case as u64);
            }
            ColumnReader::DoubleColumnReader(mut reader) => {
                let mut values = Vec::new();
                reader.read_records(count, optional.then_some(&mut levels), None, &mut values)?;
                let mut values = values.into_iter();
                for (k, row) in rows.iter_mut().enumerate() {
                    if !optional {
                        row.values.push(values.next().ok_or_else(short)?);
                    } else if *levels.get(k).ok_or_else(short)? > 0 {
                        row.measures.push(Some(values.next().ok_or_else(short)?));
                    } else {
                        row.measures.push(None);
                    }
                }
            }
            ColumnReader::ByteArrayColumnReader(mut reader) => {
                let mut values = Vec::new();
                reader.read_records(count, Some(&mut levels), None, &mut values)?;
                let mut values = values.into_iter();
                for (row, _) in rows.iter_mut().zip(levels).filter(|(_, level)| *level > 0) {
                    row.failure = Some(String::from_utf8_lossy(values.next().ok_or_else(short)?.data()).into_owned());
                }
            }
            _ => return Err(ParquetError::General("unknown kind of column".into())),
        }
    }
    for row in rows.iter_mut().filter(|_| columns.chosen) {
        row.error = row.measures.pop().flatten();
        row.step = row.measures.pop().flatten();
    }
    Ok(rows)
}
