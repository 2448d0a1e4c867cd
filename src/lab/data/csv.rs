//! CSV: one example a line, numbers and one column that is the label.
//!
//! A table is read twice: once to see what its columns hold (`csv/scan.rs`), then to take values and labels. What the
//! first line is, which column is the label and what separates fields is stated or told from the table
//! (`csv/columns.rs`, `csv/text.rs`). Another part's table is read as the training part's was: by the names of its
//! columns where both have them, else by their places. Lines are counted from 1, columns from 0.

mod columns;
mod error;
mod scan;
mod text;

use std::{borrow::Cow, fmt, str::FromStr};

pub use self::error::CsvError;
pub(crate) use self::scan::reader;

use self::columns::Told;
use self::scan::{Field, Scan, field};
use super::labels::{Label, Labels};
use super::numbers::{self, NumberKind, NumberRange};

/// Names told in a message.
const NAMES: usize = 8;

/// How a column is named.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnKey {
    /// The first.
    First,
    /// The last.
    Last,
    /// The one with this number, counted from 0.
    Number(usize),
    /// The one with this name in the header.
    Named(String),
}

impl FromStr for ColumnKey {
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

impl fmt::Display for ColumnKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::First => f.write_str("first"),
            Self::Last => f.write_str("last"),
            Self::Number(number) => number.fmt(f),
            Self::Named(name) => f.write_str(name),
        }
    }
}

/// What is stated of a table.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Reading {
    /// The label column.
    pub label: Option<ColumnKey>,
    /// Columns that are left out.
    pub ignore: Option<Vec<ColumnKey>>,
    /// Whether the first line names the columns.
    pub header: Option<bool>,
    /// What separates fields.
    pub separator: Option<u8>,
}

/// What a table turned out to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableLayout {
    /// What separates fields.
    pub separator: u8,
    /// Names of all columns; empty without a header.
    pub names: Vec<String>,
    /// Columns in all.
    pub columns: usize,
    /// The label column.
    pub label: usize,
    /// Columns left out, in rising order.
    pub ignored: Vec<usize>,
    /// Columns of values, in the order of the training part.
    pub values: Vec<usize>,
    /// Names to be left out that this table does not have.
    pub absent: Vec<String>,
}

impl TableLayout {
    /// A column as a key names it: by its name where that is one column's alone and no number.
    #[must_use]
    pub fn key(&self, at: usize) -> String {
        let alone = |name: &&String| self.names.iter().filter(|other| other == name).count() == 1;
        let plain =
            |name: &&String| !name.is_empty() && matches!(name.parse(), Ok(ColumnKey::Named(_)));
        self.names.get(at).filter(alone).filter(plain).map_or_else(|| at.to_string(), Clone::clone)
    }

    fn column(&self, at: usize) -> String {
        match self.names.get(at) {
            Some(name) if !name.is_empty() => format!("{at} (`{name}`)"),
            _ => at.to_string(),
        }
    }
}

/// Examples as they stand in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct CsvTable {
    /// Values of an example: the columns but the label, in order.
    pub features: usize,
    /// Example after example.
    pub values: Vec<u8>,
    /// One an example.
    pub labels: Labels,
    /// What the numbers were.
    pub range: NumberRange,
    /// Their kind.
    pub kind: NumberKind,
    /// How the table was read.
    pub layout: TableLayout,
    /// What was told from the table and not stated.
    pub said: Vec<String>,
}

/// The text of a table of any kind, of at most `limit` bytes, and what separates its fields.
///
/// # Errors
/// When it is no text.
pub(crate) fn text_of(bytes: &[u8], limit: u64) -> Result<(Cow<'_, [u8]>, u8), CsvError> {
    let text = text::decode(bytes, limit)?;
    let separator = text::separator(&text);
    Ok((text, separator))
}

/// The number of a field, where it is one; decimal commas are numbers where commas do not separate.
pub(crate) fn number_of(bytes: &[u8], separator: u8) -> Option<f64> {
    match field(bytes, separator != b',') {
        Field::Number(number, _) => Some(number),
        Field::Missing | Field::Text => None,
    }
}

/// Reads a table; `like` is the layout of the training part for every other part. Fractions reach `full_scale`; a packed
/// table has at most `limit` bytes.
///
/// # Errors
/// When lines differ in length, a field is no number, or the table cannot be told apart.
pub fn read(
    bytes: &[u8],
    reading: &Reading,
    like: Option<&TableLayout>,
    full_scale: u8,
    limit: u64,
) -> Result<CsvTable, CsvError> {
    let text = text::decode(bytes, limit)?;
    let separator = reading.separator.unwrap_or_else(|| text::separator(&text));
    let comma = separator != b',';
    let mut said = Vec::new();
    if reading.separator.is_none() && separator != b',' {
        said.push(format!("fields are separated by {}", separator_name(separator)));
    }
    let mut scan = scan::scan(&text, separator)?;
    let (header, worth) = columns::header(&scan, reading, like, comma)?;
    if worth {
        let start = list(scan.first.iter().map(|field| shown(field)));
        said.push(format!("the first line ({start}) is read as names of the columns"));
    }
    let names: Vec<String> = match header {
        true => scan.first.iter().map(|f| String::from_utf8_lossy(f).into_owned()).collect(),
        false => {
            scan.take_first(comma);
            vec![]
        }
    };
    if scan.rows == 0 {
        return Err(CsvError::Empty);
    }
    let layout = match like.filter(|like| !like.names.is_empty() && header) {
        Some(like) => by_names(&scan, reading, like, names, separator, &mut said)?,
        None => by_places(&scan, reading, like, names, separator, &mut said)?,
    };
    let range = range(&scan, &layout, reading, header)?;
    let kind = range.kind()?;
    if comma && has_decimal_commas(&text, separator, &layout, header) {
        said.push("numbers have decimal commas".into());
    }
    let label = &scan.columns[layout.label];
    let words = label.text.is_some();
    let of_label = |found: &(u64, String)| (found.0, layout.column(layout.label), found.1.clone());
    if let Some((line, column, found)) = label.missing.as_ref().map(of_label) {
        return Err(CsvError::Missing { line, column, found, trailing: false });
    }
    if let Some((line, column, found)) = label.fraction.as_ref().map(of_label).filter(|_| !words) {
        return Err(CsvError::Fraction { line, column, found });
    }
    let mut values = Vec::new();
    let mut labels = Vec::new();
    let mut lines = scan::reader(&text, separator);
    let mut record = ::csv::ByteRecord::new();
    let mut skip = header;
    while lines.read_byte_record(&mut record)? {
        if std::mem::take(&mut skip) {
            continue;
        }
        for &at in &layout.values {
            let Field::Number(x, _) = field(&record[at], comma) else {
                unreachable!("the first pass saw numbers alone")
            };
            values.push(numbers::value(x, kind, full_scale));
        }
        let bytes = &record[layout.label];
        let number = match field(bytes, comma) {
            Field::Number(x, _) if !words => Label::of_float(x),
            _ => None,
        };
        labels.push(match number {
            Some(label) => label,
            None => Label::Text(String::from_utf8_lossy(bytes).into_owned()),
        });
    }
    let labels = labels.into_iter().collect();
    Ok(CsvTable { features: layout.values.len(), values, labels, range, kind, layout, said })
}

/// The layout of a table whose columns are told by their places, or of the training part.
fn by_places(
    scan: &Scan,
    reading: &Reading,
    like: Option<&TableLayout>,
    names: Vec<String>,
    separator: u8,
    said: &mut Vec<String>,
) -> Result<TableLayout, CsvError> {
    let columns = scan.columns.len();
    let (ignored, absent, label) = match like {
        Some(like) if like.columns != columns => {
            return Err(CsvError::Width { found: columns, wanted: like.columns });
        }
        Some(like) => {
            if like.names.is_empty() != names.is_empty() {
                said.push(
                    "its columns are told by their places: not every part has a header".into(),
                );
            }
            (like.ignored.clone(), vec![], like.label)
        }
        None => {
            let keys = reading.ignore.as_deref().unwrap_or_default();
            let (mut ignored, absent) = columns::places(keys, columns, &names)?;
            if reading.ignore.as_ref().is_none_or(|keys| !keys.is_empty()) {
                leave_out(&mut ignored, scan, &names, said)?;
            }
            let label = match &reading.label {
                Some(key) => columns::place(key, columns, &names)?,
                None => {
                    let (at, told) = columns::label(scan, &names, &ignored)?;
                    let name =
                        names.get(at).map_or_else(|| at.to_string(), |name| format!("`{name}`"));
                    let place = match at {
                        0 => format!("the first of {columns}"),
                        at if at + 1 == columns => format!("the last of {columns}"),
                        at => format!("number {at} of 0 to {}", columns - 1),
                    };
                    let why = match told {
                        Told::Name => "by its name",
                        Told::Text => "the only one of text",
                        Told::End => "it alone of both ends looks like one",
                    };
                    said.push(format!("label column {name}, {place} ({why})"));
                    at
                }
            };
            (ignored, absent, label)
        }
    };
    let kept = |at: &usize| *at != label && ignored.binary_search(at).is_err();
    let values: Vec<usize> = (0..columns).filter(kept).collect();
    Ok(TableLayout { separator, names, columns, label, ignored, values, absent })
}

/// Leaves out columns without a name that number the rows or are empty.
fn leave_out(
    ignored: &mut Vec<usize>,
    scan: &Scan,
    names: &[String],
    said: &mut Vec<String>,
) -> Result<(), CsvError> {
    for at in columns::unnamed(scan, names, ignored)? {
        let what = if scan.columns[at].present == 0 { "is empty" } else { "numbers the rows" };
        said.push(format!("column {at} has no name and {what}: it is left out"));
        ignored.push(at);
    }
    ignored.sort_unstable();
    ignored.dedup();
    Ok(())
}

/// The layout of a table that has the names of the training part.
fn by_names(
    scan: &Scan,
    reading: &Reading,
    like: &TableLayout,
    names: Vec<String>,
    separator: u8,
    said: &mut Vec<String>,
) -> Result<TableLayout, CsvError> {
    let columns = scan.columns.len();
    let same = names == like.names;
    let place = |at: usize, label: bool| {
        let name = like.names[at].clone();
        if same {
            return Ok(at);
        }
        let mut found = names.iter().enumerate().filter(|(_, other)| **other == name);
        match (found.next(), found.next()) {
            (Some((at, _)), None) if like.names.iter().filter(|n| **n == name).count() == 1 => {
                Ok(at)
            }
            (None, _) => Err(CsvError::Lacks { name, label }),
            _ => Err(CsvError::Twice { name }),
        }
    };
    let label = place(like.label, true)?;
    let values = like.values.iter().map(|&at| place(at, false)).collect::<Result<Vec<_>, _>>()?;
    // numbers count the columns of the training part
    let named = |key: &&ColumnKey| matches!(key, ColumnKey::Named(_));
    let keys: Vec<_> = reading.ignore.iter().flatten().filter(named).cloned().collect();
    let (mut ignored, absent) = columns::places(&keys, columns, &names)?;
    let left_out = |at: &usize| like.ignored.iter().any(|&there| like.names[there] == names[*at]);
    ignored.extend((0..columns).filter(left_out));
    leave_out(&mut ignored, scan, &names, said)?;
    let extra = (0..columns)
        .find(|at| *at != label && !values.contains(at) && ignored.binary_search(at).is_err());
    if let Some(at) = extra {
        return Err(CsvError::Extra { name: names[at].clone() });
    }
    Ok(TableLayout { separator, names, columns, label, ignored, values, absent })
}

/// What the columns of values hold together.
fn range(
    scan: &Scan,
    layout: &TableLayout,
    reading: &Reading,
    header: bool,
) -> Result<NumberRange, CsvError> {
    if layout.values.is_empty() {
        return Err(CsvError::NoValues);
    }
    let columns = || layout.values.iter().map(|&at| (at, &scan.columns[at]));
    let first = |found: fn(&scan::Column) -> Option<&(u64, String)>| {
        columns()
            .filter_map(move |(at, column)| Some((at, found(column)?)))
            .min_by_key(|(_, f)| f.0)
    };
    if let Some((at, (line, found))) = first(|column| column.text.as_ref()) {
        let key = layout.key(at);
        let advice = if layout.separator == b',' && found.contains(',') {
            "for decimal commas separate the fields by semicolons".into()
        } else if *line == 1 && !header {
            "if the first line names the columns, say data.header = true".into()
        } else {
            format!(
                "write numbers, or leave the column out with data.ignore_columns = [\"{key}\"]; if it is the label, \
                 say data.label_column = \"{key}\""
            )
        };
        let (line, column, found) = (*line, layout.column(at), found.clone());
        return Err(CsvError::Field { line, column, found, advice });
    }
    if let Some((at, (line, found))) = first(|column| column.missing.as_ref()) {
        let trailing = at + 1 == layout.columns && scan.columns[at].present == 0;
        let (line, column, found) = (*line, layout.column(at), found.clone());
        return Err(CsvError::Missing { line, column, found, trailing });
    }
    if reading.ignore.is_none()
        && let Some(at) = columns::row_number(scan, &layout.values)
    {
        return Err(CsvError::RowNumber { column: layout.column(at), key: layout.key(at) });
    }
    let mut range = NumberRange::new(false);
    for (_, column) in columns() {
        let [least, greatest] = column.ends;
        range.see_column(least, greatest, column.floats, column.fraction.is_some());
    }
    Ok(range)
}

/// Whether a number of the first examples is written with a decimal comma.
fn has_decimal_commas(text: &[u8], separator: u8, layout: &TableLayout, header: bool) -> bool {
    let mut lines = scan::reader(text, separator);
    let rows = lines.byte_records().filter_map(Result::ok).skip(usize::from(header)).take(1000);
    let comma = |row: &::csv::ByteRecord| layout.values.iter().any(|&at| row[at].contains(&b','));
    rows.into_iter().any(|row| row.len() == layout.columns && comma(&row))
}

/// A separator as keys spell it.
#[must_use]
pub fn separator_key(separator: u8) -> &'static str {
    match separator {
        b'\t' => "tab",
        b';' => ";",
        b'|' => "|",
        _ => ",",
    }
}

/// What a key says of a separator.
#[must_use]
pub fn separator_of(key: &str) -> Option<u8> {
    match key {
        "," | "comma" => Some(b','),
        ";" | "semicolon" => Some(b';'),
        "tab" | "\t" => Some(b'\t'),
        "|" | "bar" => Some(b'|'),
        _ => None,
    }
}

fn separator_name(separator: u8) -> &'static str {
    match separator {
        b'\t' => "tabs",
        b';' => "semicolons",
        b'|' => "bars",
        _ => "commas",
    }
}

/// The first names of some.
fn list(names: impl Iterator<Item = String>) -> String {
    let mut names: Vec<String> = names.take(NAMES + 1).collect();
    if names.len() > NAMES {
        names.truncate(NAMES);
        names.push("...".into());
    }
    names.join(", ")
}

/// The start of a field, printable.
pub(crate) fn shown(field: &[u8]) -> String {
    let start = &field[..field.len().min(24)];
    let dots = if start.len() < field.len() { ".." } else { "" };
    match std::str::from_utf8(start) {
        Ok(text) if !text.chars().any(char::is_control) => format!("{text}{dots}"),
        _ => format!("{}{dots}", start.escape_ascii()),
    }
}

#[cfg(test)]
#[path = "csv_tests.rs"]
mod tests;
