//! A table as a file: CSV, JSON, Parquet.
//!
//! A missing cell is an empty field, `null`, or a null. Numbers are in their base unit (fractions are 0 to 1, energy is
//! in joules) and are written in the shortest form that reads back the same. A word that a spreadsheet would take for a
//! formula, as its first character is one of `= + - @`, has a `'` in front of it in CSV; numbers have none.

use std::io::Write;
use std::str::FromStr;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::{Table, Values};

/// Rows of a group of a Parquet file.
const GROUP: usize = 1 << 16;

/// How a table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated, names in the first line.
    Csv,
    /// One JSON list of objects.
    Json,
    /// Columns of a Parquet file, not compressed.
    Parquet,
}

impl FromStr for Format {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "csv" => Ok(Self::Csv),
            "json" => Ok(Self::Json),
            "parquet" => Ok(Self::Parquet),
            _ => Err(format!("{name:?} is no format; use csv, json or parquet")),
        }
    }
}

/// Why a table cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// CSV.
    #[error(transparent)]
    Csv(#[from] csv::Error),
    /// JSON, or the system.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// Parquet.
    #[error(transparent)]
    Parquet(#[from] ParquetError),
}

impl Table {
    /// Writes the table.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&self, format: Format, out: impl Write + Send) -> Result<(), WriteError> {
        match format {
            Format::Csv => self.csv(out),
            Format::Json => self.json(out),
            Format::Parquet => self.parquet(out),
        }
    }

    fn csv(&self, out: impl Write) -> Result<(), WriteError> {
        let mut writer = csv::Writer::from_writer(out);
        writer.write_record(self.columns.iter().map(|column| &column.name))?;
        for row in 0..self.len() {
            let cells = self.columns.iter().map(|column| {
                let text = column.values.text(row).unwrap_or_default();
                if column.values.is_text() { as_word(text) } else { text }
            });
            writer.write_record(cells)?;
        }
        Ok(writer.flush()?)
    }

    fn json(&self, mut out: impl Write) -> Result<(), WriteError> {
        out.write_all(b"[")?;
        for row in 0..self.len() {
            let cells =
                self.columns.iter().map(|column| (column.name.clone(), json(&column.values, row)));
            let object: serde_json::Map<_, _> = cells.collect();
            out.write_all(if row == 0 { b"\n" } else { b",\n" })?;
            serde_json::to_writer(&mut out, &object).map_err(std::io::Error::from)?;
        }
        Ok(out.write_all(b"\n]\n")?)
    }

    fn parquet(&self, out: impl Write + Send) -> Result<(), WriteError> {
        let field = |column: &super::Column| {
            let (physical, logical) = match column.values {
                Values::Whole(_) => (Physical::INT64, None),
                Values::Real(_) => (Physical::DOUBLE, None),
                Values::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            };
            let builder = Type::primitive_type_builder(&column.name, physical);
            let builder = builder.with_repetition(Repetition::OPTIONAL).with_logical_type(logical);
            builder.build().map(Arc::new)
        };
        let fields = self.columns.iter().map(field).collect::<Result<_, _>>()?;
        let schema = Arc::new(Type::group_type_builder("table").with_fields(fields).build()?);
        // the name of the program, not its build: the same table makes the same bytes
        let properties = WriterProperties::builder().set_created_by("dalean".into()).build();
        let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
        for start in (0..self.len()).step_by(GROUP) {
            let rows = start..self.len().min(start + GROUP);
            let mut group = writer.next_row_group()?;
            for column in &self.columns {
                let mut into = group.next_column()?.expect("as many columns as the schema has");
                match &column.values {
                    Values::Whole(cells) => {
                        let (there, values) = present(&cells[rows.clone()], |&value| value);
                        into.typed::<Int64Type>().write_batch(&values, Some(&there), None)?;
                    }
                    Values::Real(cells) => {
                        let (there, values) = present(&cells[rows.clone()], |&value| value);
                        into.typed::<DoubleType>().write_batch(&values, Some(&there), None)?;
                    }
                    Values::Text(cells) => {
                        let bytes = |text: &String| ByteArray::from(text.as_str());
                        let (there, values) = present(&cells[rows.clone()], bytes);
                        into.typed::<ByteArrayType>().write_batch(&values, Some(&there), None)?;
                    }
                }
                into.close()?;
            }
            group.close()?;
        }
        writer.close()?;
        Ok(())
    }
}

/// A word that no spreadsheet carries out.
fn as_word(text: String) -> String {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    if formula && text.parse::<f64>().is_err() { format!("'{text}") } else { text }
}

/// Which cells are there (1) and which are not (0), and the values of those that are.
fn present<A, B>(cells: &[Option<A>], value: impl Fn(&A) -> B) -> (Vec<i16>, Vec<B>) {
    let there = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    (there, cells.iter().flatten().map(value).collect())
}

fn json(values: &Values, row: usize) -> serde_json::Value {
    match values {
        Values::Whole(cells) => cells[row].into(),
        Values::Real(cells) => cells[row].into(),
        Values::Text(cells) => cells[row].clone().into(),
    }
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    use super::super::{Column, ColumnUnit, Role};
    use super::*;

    fn table() -> Table {
        let column = |name: &str, values| {
            let (name, label) = (name.to_owned(), name.to_owned());
            Column { name, label, unit: ColumnUnit::Plain, role: Role::Result, values }
        };
        Table {
            columns: vec![
                column("bits", Values::Whole(vec![Some(1), None, Some(i64::MIN)])),
                column("accuracy", Values::Real(vec![Some(0.1), Some(1e-30), None])),
                column("rule", Values::Text(vec![Some("a,\"b\"".into()), None, Some("é".into())])),
            ],
        }
    }

    fn written(format: Format) -> Vec<u8> {
        let mut bytes = Vec::new();
        table().write(format, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn text_formats_are_exact() {
        let csv = String::from_utf8(written(Format::Csv)).unwrap();
        assert_eq!(
            csv,
            "bits,accuracy,rule\n1,0.1,\"a,\"\"b\"\"\"\n,0.000000000000000000000000000001,\n-9223372036854775808,,é\n"
        );
        let json: serde_json::Value = serde_json::from_slice(&written(Format::Json)).unwrap();
        assert_eq!(json[1], serde_json::json!({"bits": null, "accuracy": 1e-30, "rule": null}));
        assert_eq!(json[2]["bits"], i64::MIN);
    }

    #[test]
    fn a_spreadsheet_takes_no_word_for_a_formula() {
        for (text, wanted) in [
            ("=1+1", "'=1+1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("+cmd|' /C calc'!A0", "'+cmd|' /C calc'!A0"),
            ("-x", "'-x"),
            ("-1.5e3", "-1.5e3"),
            ("+4", "+4"),
            ("ed", "ed"),
            ("", ""),
        ] {
            assert_eq!(as_word(text.into()), wanted);
        }
    }

    #[test]
    fn parquet_reads_back() {
        let bytes = bytes::Bytes::from(written(Format::Parquet));
        let reader = SerializedFileReader::new(bytes).unwrap();
        let rows: Vec<Vec<Field>> = reader
            .get_row_iter(None)
            .unwrap()
            .map(|row| row.unwrap().into_columns().into_iter().map(|(_, field)| field).collect())
            .collect();
        assert_eq!(rows[0], [Field::Long(1), Field::Double(0.1), Field::Str("a,\"b\"".into())]);
        assert_eq!(rows[1], [Field::Null, Field::Double(1e-30), Field::Null]);
        assert_eq!(rows[2], [Field::Long(i64::MIN), Field::Null, Field::Str("é".into())]);
    }
}
