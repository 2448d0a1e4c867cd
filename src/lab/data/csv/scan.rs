//! The first pass over a table: what every column holds, in memory that does not grow with its rows.

use std::collections::BTreeSet;

use super::{CsvError, shown};

/// Different fields remembered of a column.
pub(super) const DISTINCT_MAX: usize = 4096;

/// Most columns: each takes some hundred bytes.
const COLUMNS_MAX: usize = 1 << 18;

/// What a field is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Field {
    /// A number, and whether it is written as a float.
    Number(f64, bool),
    /// Nothing, or a word for nothing.
    Missing,
    /// Anything else.
    Text,
}

/// Reads a field; `comma` says that numbers may have a decimal comma.
pub(super) fn field(bytes: &[u8], comma: bool) -> Field {
    // most fields of most tables
    if let 1..=3 = bytes.len()
        && bytes.iter().all(u8::is_ascii_digit)
    {
        let number = bytes.iter().fold(0u32, |all, b| all * 10 + u32::from(b - b'0'));
        return Field::Number(number.into(), false);
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return Field::Text };
    let missing = ["", "nan", "na", "n/a", "null", "inf", "-inf", "+inf", "infinity", "-infinity"];
    if missing.iter().any(|word| text.eq_ignore_ascii_case(word)) {
        return Field::Missing;
    }
    let float = |text: &str| text.contains(['.', 'e', 'E']);
    if let Ok(x) = text.parse::<f64>() {
        return if x.is_finite() { Field::Number(x, float(text)) } else { Field::Missing };
    }
    if comma && text.matches(',').count() == 1 && !text.contains('.') {
        let point = text.replace(',', ".");
        if let Some(x) = point.parse::<f64>().ok().filter(|x| x.is_finite()) {
            return Field::Number(x, true);
        }
    }
    Field::Text
}

/// What a column holds below the first line, or from it on.
#[derive(Debug, Clone)]
pub(super) struct Column {
    /// Least and greatest number.
    pub(super) ends: [f64; 2],
    /// Whether a number is written as a float.
    pub(super) floats: bool,
    /// Whether a number has a fraction, and the first line of one.
    pub(super) fraction: Option<(u64, String)>,
    /// The first field that is no number.
    pub(super) text: Option<(u64, String)>,
    /// The first field that is missing.
    pub(super) missing: Option<(u64, String)>,
    /// Fields that are not missing.
    pub(super) present: u64,
    /// Whether the field of the first line comes again.
    pub(super) again: bool,
    /// Whether every number is one more than the one before.
    pub(super) steady: bool,
    /// Its first number.
    pub(super) start: Option<f64>,
    previous: f64,
    /// Different fields, of columns that may be labels; at most [`DISTINCT_MAX`].
    pub(super) distinct: Option<BTreeSet<Vec<u8>>>,
}

impl Column {
    fn new() -> Self {
        Self {
            ends: [f64::INFINITY, f64::NEG_INFINITY],
            floats: false,
            fraction: None,
            text: None,
            missing: None,
            present: 0,
            again: false,
            steady: true,
            start: None,
            previous: f64::NAN,
            distinct: None,
        }
    }

    /// Whether it holds numbers alone.
    pub(super) const fn numeric(&self) -> bool {
        self.text.is_none() && self.missing.is_none() && self.present > 0
    }

    fn see(&mut self, line: u64, bytes: &[u8], comma: bool) {
        let place = || (line, shown(bytes));
        match field(bytes, comma) {
            Field::Number(x, float) => {
                self.ends = [self.ends[0].min(x), self.ends[1].max(x)];
                self.floats |= float;
                if x.fract() != 0.0 && self.fraction.is_none() {
                    self.fraction = Some(place());
                }
                self.steady &= self.start.is_none() || x == self.previous + 1.0;
                self.start.get_or_insert(x);
                self.previous = x;
                self.present += 1;
            }
            Field::Missing => {
                self.missing.get_or_insert_with(place);
                self.steady = false;
            }
            Field::Text => {
                self.text.get_or_insert_with(place);
                self.steady = false;
                self.present += 1;
            }
        }
        if let Some(known) = &mut self.distinct
            && known.len() < DISTINCT_MAX
            && !known.contains(bytes)
        {
            known.insert(bytes.to_vec());
        }
    }

    /// Puts the field of the first line before the others.
    fn see_first(&mut self, line: u64, bytes: &[u8], comma: bool) {
        let (start, steady, text) = (self.start, self.steady, self.text.take());
        let (fraction, missing) = (self.fraction.take(), self.missing.take());
        self.see(line, bytes, comma);
        self.text = self.text.take().or(text);
        self.fraction = self.fraction.take().or(fraction);
        self.missing = self.missing.take().or(missing);
        let first = match field(bytes, comma) {
            Field::Number(x, _) => Some(x),
            _ => None,
        };
        self.steady = steady && first.is_some_and(|x| start.is_none_or(|start| start == x + 1.0));
        self.start = first;
    }
}

/// What a table holds.
#[derive(Debug)]
pub(super) struct Scan {
    /// Fields of the first line.
    pub(super) first: Vec<Vec<u8>>,
    first_line: u64,
    /// Lines below the first, or from it on.
    pub(super) rows: u64,
    /// Columns.
    pub(super) columns: Vec<Column>,
}

/// A reader of the fields of a text.
pub(crate) fn reader(text: &[u8], separator: u8) -> ::csv::Reader<&[u8]> {
    ::csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(separator)
        .trim(::csv::Trim::All)
        .from_reader(text)
}

/// Looks at every field.
pub(super) fn scan(text: &[u8], separator: u8) -> Result<Scan, CsvError> {
    let comma = separator != b',';
    let mut lines = reader(text, separator);
    let mut record = ::csv::ByteRecord::new();
    if !lines.read_byte_record(&mut record)? {
        return Err(CsvError::Empty);
    }
    let line = |record: &::csv::ByteRecord| record.position().map_or(0, ::csv::Position::line);
    let first_line = line(&record);
    if record.len() < 2 {
        return Err(CsvError::Narrow { line: first_line, found: shown(&record[0]) });
    }
    if record.len() > COLUMNS_MAX {
        return Err(CsvError::Wide { found: record.len(), limit: COLUMNS_MAX });
    }
    let first: Vec<Vec<u8>> = record.iter().map(<[u8]>::to_vec).collect();
    let columns = vec![Column::new(); first.len()];
    let mut scan = Scan { first, first_line, rows: 0, columns };
    let last = scan.columns.len() - 1;
    while lines.read_byte_record(&mut record)? {
        let line = line(&record);
        if record.len() != scan.columns.len() {
            let (found, wanted) = (record.len(), scan.columns.len());
            return Err(CsvError::Ragged { line, found, wanted });
        }
        for (at, (column, bytes)) in scan.columns.iter_mut().zip(record.iter()).enumerate() {
            if scan.rows == 0 {
                let unnamed = scan.first[at].is_empty() || scan.first[at].starts_with(b"Unnamed");
                let number = matches!(field(bytes, comma), Field::Number(..));
                if at < 2 || at == last || unnamed || !number {
                    column.distinct = Some(BTreeSet::new());
                }
            }
            column.again |= *scan.first[at] == *bytes;
            column.see(line, bytes, comma);
        }
        scan.rows += 1;
    }
    Ok(scan)
}

impl Scan {
    /// Takes the first line as an example.
    pub(super) fn take_first(&mut self, comma: bool) {
        for (column, bytes) in self.columns.iter_mut().zip(&self.first) {
            column.see_first(self.first_line, bytes, comma);
        }
        self.rows += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_a_number_missing_or_text() {
        for (text, comma, wanted) in [
            ("0", false, Field::Number(0.0, false)),
            ("255", false, Field::Number(255.0, false)),
            ("-1", false, Field::Number(-1.0, false)),
            ("3.0", false, Field::Number(3.0, true)),
            ("1e3", false, Field::Number(1000.0, true)),
            ("0,5", true, Field::Number(0.5, true)),
            ("0,5", false, Field::Text),
            ("1,234,5", true, Field::Text),
            ("", false, Field::Missing),
            ("NaN", false, Field::Missing),
            ("inf", false, Field::Missing),
            ("1e999", false, Field::Missing),
            ("?", false, Field::Text),
            ("cat", true, Field::Text),
        ] {
            assert_eq!(field(text.as_bytes(), comma), wanted, "{text}");
        }
        assert_eq!(field(b"\xff", false), Field::Text);
    }

    #[test]
    fn columns_are_seen_with_and_without_their_first_line() {
        let mut seen = scan(b"0,5,a\n1,5,b\n2,7.5,b\n", b',').unwrap();
        let ends: Vec<_> = seen.columns.iter().map(|c| c.ends).collect();
        assert_eq!((seen.rows, &ends[..2]), (2, &[[1.0, 2.0], [5.0, 7.5]][..]));
        assert!(seen.columns[0].steady && seen.columns[1].again && !seen.columns[1].steady);
        seen.take_first(false);
        assert_eq!(
            (seen.rows, seen.columns[0].ends, seen.columns[0].start),
            (3, [0.0, 2.0], Some(0.0))
        );
        assert!(seen.columns[0].steady && seen.columns[2].text == Some((1, "a".into())));
    }
}
