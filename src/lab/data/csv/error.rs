//! Why a table is none: where, what was found, what to try.

use super::ColumnKey;
use crate::lab::data::numbers::NumbersError;

/// Why bytes are not a table of examples.
#[derive(Debug, thiserror::Error)]
pub enum CsvError {
    /// No line of values.
    #[error("holds no line of values; an example is one line of numbers and a label")]
    Empty,
    /// A line with a single field.
    #[error(
        "line {line} has the single field `{found}`, but needs a label and at least one value; separate them by \
         commas, semicolons, tabs or bars"
    )]
    Narrow {
        /// Line, counted from 1.
        line: u64,
        /// Start of the field.
        found: String,
    },
    /// More fields than any example has values.
    #[error(
        "has {found} columns, at most {limit} are read; leave some out before the table is saved"
    )]
    Wide {
        /// Columns.
        found: usize,
        /// Most columns.
        limit: usize,
    },
    /// A line of another length than the first.
    #[error(
        "line {line} has {found} fields, but the lines before it have {wanted}; complete the line (a header that \
         leaves out the column of row names: write the table without them, index=False or row.names=FALSE)"
    )]
    Ragged {
        /// Line.
        line: u64,
        /// Fields found.
        found: usize,
        /// Fields of the first.
        wanted: usize,
    },
    /// A value that is no number.
    #[error("line {line}, column {column} holds `{found}`, which is no number; {advice}")]
    Field {
        /// Line.
        line: u64,

        /// Column, by name or number.
        column: String,

        /// Start of the field.
        found: String,

        /// What to try.
        advice: String,
    },
    /// A value or label that is missing.
    #[error(
        "line {line}, column {column} holds `{found}`: a missing value; fill the gap, or take the line out{}",
        if *.trailing { " (a separator at the end of every line makes an empty column)" } else { "" }
    )]
    Missing {
        /// Line.
        line: u64,

        /// Column.
        column: String,

        /// What stands there.
        found: String,

        /// Whether the column is the last and empty.
        trailing: bool,
    },
    /// A label with a fraction.
    #[error(
        "line {line}, column {column} holds the label `{found}`: a class is a whole number or a word; if this is a \
         measurement, name another column with data.label_column"
    )]
    Fraction {
        /// Line.
        line: u64,
        /// Column.
        column: String,
        /// The label.
        found: String,
    },
    /// A column that is not there.
    #[error("has no column `{wanted}`; {there}")]
    Column {
        /// Column asked for.
        wanted: ColumnKey,
        /// What there is instead.
        there: String,
    },
    /// A number that is a name elsewhere.
    #[error(
        "column `{number}` may mean column {number} or the one that is called `{number}`, column {named}; give the \
         header other names"
    )]
    TwoMeanings {
        /// The number.
        number: usize,
        /// Column of that name.
        named: usize,
    },
    /// A name that two columns have.
    #[error("has two columns `{name}`; give them different names")]
    Twice {
        /// The name.
        name: String,
    },
    /// A column without a name that is no index.
    #[error(
        "column {column} has no name and does not number the rows; name it in the first line, or leave it out with \
         data.ignore_columns = [\"{column}\"]"
    )]
    Unnamed {
        /// The column.
        column: usize,
    },
    /// Several columns that may be the label.
    #[error("{found} may each be the label; say which with data.label_column, such as data.label_column = \"{}\"",
        .example.trim_start_matches("column ").trim_matches('`'))]
    Several {
        /// The columns.
        found: String,
        /// The first of them.
        example: String,
    },
    /// No column that may be the label.
    #[error(
        "no column is called label, class or target, and neither the first ({first}) nor the last ({last}) looks like \
         one; say which is the label with data.label_column"
    )]
    NoLabel {
        /// What the first holds.
        first: String,
        /// What the last holds.
        last: String,
    },
    /// A first line that may be a header or an example.
    #[error(
        "the first line ({found}) may be a header or an example; say data.header = true or data.header = false"
    )]
    Doubt {
        /// The line.
        found: String,
    },
    /// A column that numbers the rows.
    #[error(
        "column {column} numbers the rows, which is no value to learn from; leave it out with \
         data.ignore_columns = [\"{key}\"], or keep it with data.ignore_columns = []"
    )]
    RowNumber {
        /// The column.
        column: String,
        /// Its name.
        key: String,
    },
    /// A column of the training part that this part lacks.
    #[error(
        "has no column `{name}`, which the training part {}; all parts need the same columns, in any order",
        if *.label { "has as label (a part without labels cannot be scored)" } else { "has" }
    )]
    Lacks {
        /// The column.
        name: String,
        /// Whether it is the label.
        label: bool,
    },
    /// A column that the training part lacks.
    #[error(
        "has the column `{name}`, which the training part lacks; leave it out with data.ignore_columns = [\"{name}\"]"
    )]
    Extra {
        /// The column.
        name: String,
    },
    /// Another number of columns than the training part, and no names to tell them by.
    #[error(
        "has {found} columns, but the training part has {wanted}, and not both have a header to tell them by; \
        write all parts alike"
    )]
    Width {
        /// Columns.
        found: usize,
        /// Of the training part.
        wanted: usize,
    },
    /// Every column is left out or the label.
    #[error("has no column of values beside the label; nothing is left to learn from")]
    NoValues,
    /// Numbers that are no values.
    #[error("has values that {0}")]
    Numbers(#[from] NumbersError),
    /// A text that cannot be read.
    #[error("is UTF-16 that breaks off or is damaged; save it as UTF-8")]
    Utf16,
    /// Another encoding.
    #[error(
        "line {line} is not UTF-8 (Latin-1, or a code page of Windows?); save the file as UTF-8"
    )]
    Encoding {
        /// Line, counted from 1.
        line: usize,
    },
    /// No text.
    #[error("holds zero bytes, so it is no text, or UTF-16 without a mark; save it as UTF-8")]
    Binary,
    /// A zip archive.
    #[error(
        "is a zip archive, such as a spreadsheet (.xlsx); save it as CSV in UTF-8, or with data.format = \"npz\" \
        if it holds arrays"
    )]
    Spreadsheet,
    /// A broken gzip file.
    #[error("{0} while unpacking; the file is cut short or corrupt, so get it again")]
    Gzip(std::io::Error),
    /// A gzip file of too much.
    #[error("unpacks to more than the {limit} bytes allowed; cut it into parts")]
    Large {
        /// Most bytes.
        limit: u64,
    },
    /// A line that the CSV reader refuses.
    #[error("is not CSV: {0}")]
    Format(#[from] ::csv::Error),
}
