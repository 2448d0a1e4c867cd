//! What the columns of a table mean: whether the first line names them, which holds the label, which are left out.
//!
//! Names count before places. What the user states is taken; what is left is told from the table where one answer alone
//! fits, and said; where none or several fit, it is asked for.

use std::collections::BTreeSet;

use super::scan::{Column, DISTINCT_MAX, Field, Scan, field};
use super::{ColumnKey, CsvError, Reading, TableLayout};

/// Names that say label.
const LABEL_NAMES: [&str; 9] =
    ["label", "labels", "class", "classes", "target", "targets", "species", "category", "y"];
/// Most values of a column that is told to be the label.
const CLASSES_MAX: usize = 256;
/// Numbers in a row that make a header.
const COUNTED: usize = 4;
/// Rows from which on a column that counts them is taken for their number.
const ROWS_COUNTED: u64 = 8;

fn is_label_name(name: &[u8]) -> bool {
    LABEL_NAMES.iter().any(|known| name.eq_ignore_ascii_case(known.as_bytes()))
}

/// Whether the first line is a header, and whether that is worth a word.
pub(super) fn header(
    scan: &Scan,
    reading: &Reading,
    like: Option<&TableLayout>,
    comma: bool,
) -> Result<(bool, bool), CsvError> {
    let named = |key: &ColumnKey| matches!(key, ColumnKey::Named(_));
    let ignored = reading.ignore.iter().flatten();
    if let Some(stated) = reading.header {
        return Ok((stated, false));
    }
    if reading.label.iter().chain(ignored).any(named) {
        return Ok((true, false));
    }
    let first = &scan.first;
    if let Some(like) = like.filter(|like| !like.names.is_empty()) {
        let known = |field: &&Vec<u8>| like.names.iter().any(|name| name.as_bytes() == **field);
        if first.iter().filter(known).count() * 2 >= first.len() {
            return Ok((true, false));
        }
    }
    let kinds: Vec<Field> = first.iter().map(|bytes| field(bytes, comma)).collect();
    let numbers: Vec<f64> = kinds
        .iter()
        .filter_map(|kind| if let Field::Number(x, false) = kind { Some(*x) } else { None })
        .collect();
    let number = |kind: &Field| matches!(kind, Field::Number(..));
    if !kinds.iter().any(number) {
        return Ok((true, false));
    }
    let label = |(bytes, column): (&Vec<u8>, &Column)| is_label_name(bytes) && !column.again;
    if first.iter().zip(&scan.columns).any(label) {
        return Ok((true, false));
    }
    let whole = !kinds.iter().any(|kind| matches!(kind, Field::Number(_, true)));
    let counts = whole
        && numbers.first().is_some_and(|&x| x == 0.0 || x == 1.0)
        && numbers.windows(2).all(|pair| pair[1] == pair[0] + 1.0);
    if counts && numbers.len() >= COUNTED {
        return Ok((true, true));
    }
    // a word over numbers names them, or stands for a number that is missing
    let word_over_numbers =
        kinds.iter().zip(&scan.columns).any(|(kind, column)| !number(kind) && column.numeric());
    let alone = counts && numbers.len() == first.len() && like.is_none();
    match (word_over_numbers, counts) {
        (true, true) => Ok((true, true)),
        (false, _) if !alone => Ok((false, false)),
        _ => Err(CsvError::Doubt { found: super::list(first.iter().map(|f| super::shown(f))) }),
    }
}

/// Places of the columns that `keys` name; names that are not there are given back.
pub(super) fn places(
    keys: &[ColumnKey],
    columns: usize,
    names: &[String],
) -> Result<(Vec<usize>, Vec<String>), CsvError> {
    let (mut found, mut absent) = (Vec::new(), Vec::new());
    for key in keys {
        match (place(key, columns, names), key) {
            (Ok(at), _) => found.push(at),
            (Err(CsvError::Column { .. }), ColumnKey::Named(name)) => absent.push(name.clone()),
            (Err(error), _) => return Err(error),
        }
    }
    found.sort_unstable();
    found.dedup();
    Ok((found, absent))
}

/// The place of the column that `key` names.
pub(super) fn place(key: &ColumnKey, columns: usize, names: &[String]) -> Result<usize, CsvError> {
    let missing = |there| CsvError::Column { wanted: key.clone(), there };
    match key {
        ColumnKey::First => Ok(0),
        ColumnKey::Last => Ok(columns - 1),
        ColumnKey::Number(at) => {
            let named = names.iter().position(|name| *name == at.to_string());
            match named {
                Some(named) if named != *at => Err(CsvError::TwoMeanings { number: *at, named }),
                _ if *at < columns => Ok(*at),
                _ => Err(missing(format!("there are 0 to {}", columns - 1))),
            }
        }
        ColumnKey::Named(name) => {
            let mut found = names.iter().enumerate().filter(|(_, there)| *there == name);
            match (found.next(), found.next()) {
                (Some((at, _)), None) => Ok(at),
                (Some(_), Some(_)) => Err(CsvError::Twice { name: name.clone() }),
                _ if names.is_empty() => Err(missing("the file has no header".into())),
                _ => Err(missing(format!("the header has {}", super::list(names.iter().cloned())))),
            }
        }
    }
}

/// Columns without a name that number the rows or hold nothing.
/// Those `known` to be left out are passed over.
pub(super) fn unnamed(
    scan: &Scan,
    names: &[String],
    known: &[usize],
) -> Result<Vec<usize>, CsvError> {
    let mut found = Vec::new();
    for (at, (name, column)) in names.iter().zip(&scan.columns).enumerate() {
        let named = !(name.is_empty() || name.starts_with("Unnamed"));
        if named || known.contains(&at) {
            continue;
        }
        let rows = usize::try_from(scan.rows).unwrap_or(usize::MAX).min(DISTINCT_MAX);
        let different = column.distinct.as_ref().is_some_and(|known| known.len() == rows);
        let index = column.numeric() && column.fraction.is_none() && different;
        if index || column.present == 0 {
            found.push(at);
        } else {
            return Err(CsvError::Unnamed { column: at });
        }
    }
    Ok(found)
}

/// How a label column was told.
pub(super) enum Told {
    /// By its name.
    Name,
    /// As the only column of text.
    Text,
    /// As the one end of a line that can be a label.
    End,
}

/// The label column, where nobody has said it.
pub(super) fn label(
    scan: &Scan,
    names: &[String],
    ignored: &[usize],
) -> Result<(usize, Told), CsvError> {
    let kept: Vec<usize> =
        (0..scan.columns.len()).filter(|at| ignored.binary_search(at).is_err()).collect();
    let word = |at: &usize| match names.get(*at) {
        Some(name) if !name.is_empty() => format!("`{name}`"),
        _ => format!("column {at}"),
    };
    let several = |found: &[usize]| CsvError::Several {
        found: super::list(found.iter().map(word)),
        example: found.first().map(word).unwrap_or_default(),
    };
    let lower = |at: &usize| names.get(*at).map(|name| name.to_ascii_lowercase());
    let called: Vec<usize> = kept
        .iter()
        .copied()
        .filter(|at| lower(at).is_some_and(|name| is_label_name(name.as_bytes())))
        .collect();
    // `y` beside another such name, or beside an `x`, is a coordinate
    let weak = |at: &usize| lower(at).is_some_and(|name| name == "y");
    let strong: Vec<usize> = called.iter().copied().filter(|at| !weak(at)).collect();
    let coordinates = kept.iter().any(|at| lower(at).is_some_and(|name| name == "x"));
    let called = if strong.is_empty() && !coordinates { called } else { strong };
    match called[..] {
        [at] => return Ok((at, Told::Name)),
        [_, _, ..] => return Err(several(&called)),
        [] => {}
    }
    let text: Vec<usize> =
        kept.iter().copied().filter(|&at| scan.columns[at].text.is_some()).collect();
    match text[..] {
        [at] => return Ok((at, Told::Text)),
        [_, _, ..] => return Err(several(&text)),
        [] => {}
    }
    let (Some(&first), Some(&last)) = (kept.first(), kept.last()) else {
        return Err(CsvError::Empty);
    };
    let fits = |at: usize| fits(&scan.columns[at], scan.rows);
    let (of_first, of_last) = (fits(first), fits(last));
    match (of_first, of_last) {
        (Fit::Well, Fit::Well) | (Fit::Somehow, Fit::Somehow) if first != last => {
            Err(several(&[first, last]))
        }
        (Fit::Not, Fit::Not) => Err(CsvError::NoLabel {
            first: describe(&scan.columns[first]),
            last: describe(&scan.columns[last]),
        }),
        (Fit::Well, _) | (_, Fit::Not) => Ok((first, Told::End)),
        _ => Ok((last, Told::End)),
    }
}

/// How well a column of numbers would do as a label.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fit {
    /// Its values are 0, 1, 2, ... or 1, 2, 3, ...: a few of them, each several times.
    Well,
    /// Whole numbers, a few, each several times.
    Somehow,
    /// One value, fractions, or hardly one value twice.
    Not,
}

fn fits(column: &Column, rows: u64) -> Fit {
    let known = column.distinct.as_ref().map_or(0, BTreeSet::len);
    let few = (2..=CLASSES_MAX).contains(&known) && (known as u64 * 2 <= rows || known == 2);
    if !few || column.fraction.is_some() || !column.numeric() {
        return Fit::Not;
    }
    let [least, greatest] = column.ends;
    let gapless = greatest - least + 1.0 == known as f64;
    if gapless && (least == 0.0 || least == 1.0) { Fit::Well } else { Fit::Somehow }
}

fn describe(column: &Column) -> String {
    let known = column.distinct.as_ref().map_or(0, BTreeSet::len);
    let [least, greatest] = column.ends;
    match (known, &column.fraction) {
        (1, _) => format!("{least} alone"),
        (_, Some((_, fraction))) => format!("fractions such as {fraction}"),
        (DISTINCT_MAX.., _) => format!("{DISTINCT_MAX} different values or more"),
        _ => format!("{known} different values, {least} to {greatest}"),
    }
}

/// A column of values that does nothing but number the rows.
pub(super) fn row_number(scan: &Scan, values: &[usize]) -> Option<usize> {
    if scan.rows < ROWS_COUNTED {
        return None;
    }
    values.iter().copied().find(|&at| {
        let column = &scan.columns[at];
        column.numeric() && column.steady && column.start.is_some_and(|x| x == 0.0 || x == 1.0)
    })
}
