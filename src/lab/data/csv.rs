//! CSV: one example a line, integers 0 to 255, one column of which is the label.
//!
//! Fields are separated by commas and may be quoted. A first line none of whose fields is a number is a
//! header; so is the first line whenever the label column is given by name. Lines are counted from 1.

use std::{fmt, str::FromStr};

/// Which column holds the label.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LabelColumn {
    /// The first.
    First,
    /// The last.
    Last,
    /// The one with this number, counted from 0.
    Number(usize),
    /// The one with this name in the header.
    Named(String),
}

impl FromStr for LabelColumn {
    type Err = std::convert::Infallible;

    /// `first`, `last`, a number counted from 0, or else a name.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match (text, text.parse()) {
            ("first", _) => Self::First,
            ("last", _) => Self::Last,
            (_, Ok(number)) => Self::Number(number),
            (name, Err(_)) => Self::Named(name.to_owned()),
        })
    }
}

impl fmt::Display for LabelColumn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::First => f.write_str("first"),
            Self::Last => f.write_str("last"),
            Self::Number(number) => number.fmt(f),
            Self::Named(name) => f.write_str(name),
        }
    }
}

/// Why bytes are not a table of examples.
#[derive(Debug, thiserror::Error)]
pub enum CsvError {
    /// No line of values.
    #[error("holds no line of values; an example is one line of integers 0 to 255")]
    Empty,
    /// A line with a single field.
    #[error(
        "line {line} has the single field `{found}`, but needs a label and at least one value; \
         separate them by commas"
    )]
    Narrow {
        /// Line, counted from 1.
        line: u64,
        /// Start of the field.
        found: String,
    },
    /// A line of another length than the first.
    #[error(
        "line {line} has {found} fields, but the lines before it have {wanted}; complete the line"
    )]
    Ragged {
        /// Line, counted from 1.
        line: u64,
        /// Fields found.
        found: usize,
        /// Fields of the first line.
        wanted: usize,
    },
    /// A field that is not a number from 0 to 255.
    #[error(
        "line {line}, column {column} (counted from 0) holds `{found}`, allowed are the integers 0 to \
         255; {advice}"
    )]
    Field {
        /// Line, counted from 1.
        line: u64,
        /// Column, counted from 0.
        column: usize,
        /// Start of the field.
        found: String,
        /// What to try.
        advice: &'static str,
    },
    /// A label column that is not there.
    #[error("has no column `{wanted}` for the label; {there}")]
    Column {
        /// Column asked for.
        wanted: LabelColumn,
        /// What there is instead.
        there: String,
    },
    /// A line that the CSV reader refuses.
    #[error("is not CSV: {0}")]
    Format(#[from] ::csv::Error),
}

/// Examples as they stand in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CsvTable {
    /// Values of an example: the columns but the label, in order.
    pub features: usize,
    /// Example after example.
    pub values: Vec<u8>,
    /// One an example.
    pub labels: Vec<u8>,
}

/// Reads a table whose label stands in `label`.
///
/// # Errors
/// When a line is not made of at least two integers 0 to 255, when lines differ in length, or when the
/// label column is missing.
pub fn read(bytes: &[u8], label: &LabelColumn) -> Result<CsvTable, CsvError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = ::csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(::csv::Trim::All)
        .from_reader(bytes);
    let mut record = ::csv::ByteRecord::new();
    let mut table = CsvTable { features: 0, values: Vec::new(), labels: Vec::new() };
    let mut shape: Option<(usize, usize)> = None;
    while lines.read_byte_record(&mut record)? {
        let line = record.position().map_or(0, ::csv::Position::line);
        let (columns, label_at) = match shape {
            Some(known) => known,
            None => {
                if record.len() < 2 {
                    return Err(CsvError::Narrow { line, found: shown(&record[0]) });
                }
                let found = (record.len(), find_label(&record, label)?);
                shape = Some(found);
                table.features = record.len() - 1;
                if is_header(&record, label) {
                    continue;
                }
                found
            }
        };
        if record.len() != columns {
            return Err(CsvError::Ragged { line, found: record.len(), wanted: columns });
        }
        for (column, field) in record.iter().enumerate() {
            let value = number(field).ok_or_else(|| CsvError::Field {
                line,
                column,
                found: shown(field),
                advice: advice(line, column == label_at),
            })?;
            let to = if column == label_at { &mut table.labels } else { &mut table.values };
            to.push(value);
        }
    }
    if table.labels.is_empty() { Err(CsvError::Empty) } else { Ok(table) }
}

fn number(field: &[u8]) -> Option<u8> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

fn advice(line: u64, label: bool) -> &'static str {
    if line == 1 {
        "if the line is a header, give the label column by its name"
    } else if label {
        "number the classes from 0, or name another label column"
    } else {
        "scale the values to bytes, or save floats as NPZ"
    }
}

fn is_header(first: &::csv::ByteRecord, label: &LabelColumn) -> bool {
    let any_number = |field: &[u8]| field.first().is_some_and(|c| c.is_ascii_digit() || *c == b'-');
    matches!(label, LabelColumn::Named(_)) || !first.iter().any(any_number)
}

fn find_label(first: &::csv::ByteRecord, label: &LabelColumn) -> Result<usize, CsvError> {
    let columns = first.len();
    let (at, there) = match label {
        LabelColumn::First => (Some(0), String::new()),
        LabelColumn::Last => (Some(columns - 1), String::new()),
        LabelColumn::Number(at) => {
            (Some(*at).filter(|&at| at < columns), format!("there are 0 to {}", columns - 1))
        }
        LabelColumn::Named(name) => {
            let names: Vec<_> = first.iter().take(8).map(shown).collect();
            let at = first.iter().position(|field| field == name.as_bytes());
            (at, format!("the header starts with {}", names.join(", ")))
        }
    };
    at.ok_or_else(|| CsvError::Column { wanted: label.clone(), there })
}

/// The start of a field, printable.
fn shown(field: &[u8]) -> String {
    let start = &field[..field.len().min(24)];
    let dots = if start.len() < field.len() { ".." } else { "" };
    format!("{}{dots}", start.escape_ascii())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn table(text: &str, label: &str) -> Result<(usize, Vec<u8>, Vec<u8>), String> {
        let label = label.parse().unwrap();
        let table = read(text.as_bytes(), &label).map_err(|e| e.to_string())?;
        Ok((table.features, table.values, table.labels))
    }

    #[test]
    fn the_label_column_is_found_by_place_number_and_name() {
        let all = Ok((2, vec![10, 20, 30, 40], vec![1, 0]));
        assert_eq!(table("1,10,20\n0,30,40\n", "first"), all);
        assert_eq!(table("10,20,1\r\n30,40,0", "last"), all);
        assert_eq!(table("\u{feff}10, 1 ,20\n30,\"0\",40\n", "1"), all);
        assert_eq!(table("a,b,class\n10,20,1\n30,40,0\n", "class"), all);
        assert_eq!(table("0,class,1\n10,1,20\n30,0,40\n", "class"), all);
        assert_eq!(table("a,b,c\n10,20,1\n30,40,0\n", "last"), all);
    }

    #[test]
    fn every_kind_of_damage_says_where() {
        let cases = [
            ("", "last", "no line of values"),
            ("a,b\n", "last", "no line of values"),
            ("1;2;3\n", "last", "line 1 has the single field `1;2;3`"),
            ("1,2\n1,2,3\n", "last", "line 2 has 3 fields, but the lines before it have 2"),
            ("1,2\n256,2\n", "last", "line 2, column 0 (counted from 0) holds `256`"),
            ("1,2\n-1,2\n", "last", "holds `-1`"),
            ("1,2\n0.5,2\n", "last", "holds `0.5`"),
            ("1,2\n,2\n", "last", "holds ``"),
            ("1,2\n1,cat\n", "last", "number the classes from 0"),
            ("a,7\n1,2\n", "last", "if the line is a header, give the label column by its name"),
            ("1,2\n", "2", "no column `2` for the label; there are 0 to 1"),
            ("a,b\n1,2\n", "c", "no column `c` for the label; the header starts with a, b"),
        ];
        for (text, label, wanted) in cases {
            let found = table(text, label).unwrap_err();
            assert!(found.contains(wanted), "{text:?}: {found}");
        }
    }

    #[test]
    fn a_label_column_prints_as_it_is_read() {
        for text in ["first", "last", "3", "digit"] {
            assert_eq!(text.parse::<LabelColumn>().unwrap().to_string(), text);
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_table_or_an_error(text in "[0-9,\n\"ax. ]{0,60}", tail: Vec<u8>) {
            let bytes = [text.as_bytes(), &tail].concat();
            for label in ["first", "last", "1", "a"] {
                if let Ok(table) = read(&bytes, &label.parse().unwrap()) {
                    prop_assert_eq!(table.values.len(), table.features * table.labels.len());
                }
            }
        }
    }
}
