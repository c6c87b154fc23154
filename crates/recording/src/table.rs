//! Columns of numbers with units, written as Parquet files.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use ::parquet::basic::{Repetition, Type as Physical};
use ::parquet::data_type::DoubleType;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;

use stickslip_base::table::Column;
use stickslip_base::{Error, output};

/// Writes columns of equal length as one Parquet file; units are key-value metadata `unit.NAME`.
///
/// # Errors
/// [`Error::File`].
pub fn write_parquet(path: &Path, columns: &[Column]) -> Result<(), Error> {
    output::write_with(path, |file| {
        let mut bytes = Vec::new();
        encode(columns, &mut bytes)?;
        file.write_all(&bytes)
    })
}

fn encode(columns: &[Column], bytes: &mut Vec<u8>) -> std::io::Result<()> {
    let named = columns.iter().map(|column| (column.name.as_str(), column.unit.as_str()));
    let mut file = ParquetFile::new(bytes, named)?;
    file.rows(columns.iter().map(|column| column.values.as_slice()))?;
    file.close()
}

/// A Parquet file that is written group by group.
pub struct ParquetFile<W: Write + Send>(SerializedFileWriter<W>);

impl<W: Write + Send> ParquetFile<W> {
    /// Starts a file with columns of these names and units.
    pub fn new<'a>(out: W, columns: impl Iterator<Item = (&'a str, &'a str)> + Clone) -> std::io::Result<Self> {
        let field = |(name, _): (&str, &str)| {
            let field = Type::primitive_type_builder(name, Physical::DOUBLE);
            field.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
        };
        let fields = columns.clone().map(field).collect::<Result<Vec<_>, _>>()?;
        let schema = Type::group_type_builder("table").with_fields(fields).build()?;
        let units = columns.map(|(name, unit)| KeyValue::new(format!("unit.{name}"), unit.to_owned())).collect();
        let properties = WriterProperties::builder()
            .set_key_value_metadata(Some(units))
            .set_created_by(concat!("stickslip ", env!("CARGO_PKG_VERSION")).into())
            .build();
        Ok(ParquetFile(SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?))
    }

    /// Writes a group of rows: all columns, of equal length.
    pub fn rows<'a>(&mut self, columns: impl Iterator<Item = &'a [f64]>) -> std::io::Result<()> {
        let mut group = self.0.next_row_group()?;
        for column in columns {
            let Some(mut writer) = group.next_column()? else { break };
            writer.typed::<DoubleType>().write_batch(column, None, None)?;
            writer.close()?;
        }
        group.close()?;
        Ok(())
    }

    /// Ends the file.
    pub fn close(self) -> std::io::Result<()> {
        self.0.close()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::Field;

    use super::*;

    #[test]
    fn a_csv_reads_back_with_its_units_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        let values = [0.1 + 0.2, -1.0 / 3.0, 6.02e23, -4e-19, 0.0];
        let column = Column { name: "torque".into(), unit: "N m".into(), values: values.into() };
        stickslip_base::table::write_csv(&path, &[column]).unwrap();
        let read = crate::Recording::read(&path).unwrap();
        let column = read.column("torque").unwrap();
        assert_eq!((column.unit.as_deref(), &column.values[..]), (Some("N m"), &values[..]));
    }

    #[test]
    fn a_table_reads_back_with_its_units() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        let column = |name: &str, unit: &str, values: &[f64]| Column {
            name: name.into(),
            unit: unit.into(),
            values: values.into(),
        };
        write_parquet(&path, &[column("velocity", "rad/s", &[0.1, -2.0]), column("torque", "N m", &[0.3, f64::NAN])])
            .unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 2);
        assert_eq!(
            rows[1].get_column_iter().next().map(|(name, field)| (name.as_str(), field.clone())),
            Some(("velocity", Field::Double(-2.0)))
        );
        let metadata = reader.metadata().file_metadata().key_value_metadata().unwrap().clone();
        assert!(metadata.contains(&KeyValue::new("unit.torque".into(), "N m".to_string())));
    }
}
