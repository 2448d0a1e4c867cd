//! Many runs as one table: a row a run, columns with names, units and roles. Plain data; `lab::report` draws it.
//!
//! A column is an axis of the sweep, the seed, a result, or a name (keys, hashes, links). Cells may be missing: a run
//! that is not finished has axes and no results.

mod write;

pub use write::{Format, WriteError};

/// What a column's numbers are measured in; says how to print them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnUnit {
    /// A plain number or a word.
    Plain,
    /// Part of a whole, 0 to 1; printed as percent.
    Fraction,
    /// How often something happened.
    Count,
    /// Cycles of the chip's clock.
    Cycles,
    /// Seconds on the chip.
    Seconds,
    /// Joules.
    Joules,
    /// Square millimetres.
    SquareMillimetres,
}

impl ColumnUnit {
    /// Its sign, empty for plain numbers.
    #[must_use]
    pub const fn sign(self) -> &'static str {
        match self {
            Self::Plain | Self::Count => "",
            Self::Fraction => "%",
            Self::Cycles => "cycles",
            Self::Seconds => "s",
            Self::Joules => "J",
            Self::SquareMillimetres => "mm2",
        }
    }
}

/// What a column is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Chosen by the sweep.
    Axis,
    /// The seed: rows that differ in it alone are repetitions.
    Seed,
    /// Came out of the run.
    Result,
    /// Names the run: key, hashes, place.
    Name,
}

/// Cells of a column, one a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Whole numbers.
    Whole(Vec<Option<i64>>),
    /// Numbers.
    Real(Vec<Option<f64>>),
    /// Words.
    Text(Vec<Option<String>>),
}

impl Values {
    /// Cells.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Whole(values) => values.len(),
            Self::Real(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A cell as a number, if it is one.
    #[must_use]
    pub fn number(&self, row: usize) -> Option<f64> {
        match self {
            Self::Whole(values) => values[row].map(|value| value as f64),
            Self::Real(values) => values[row],
            Self::Text(_) => None,
        }
    }

    /// A cell as text: shortest form that reads back as the same number.
    #[must_use]
    pub fn text(&self, row: usize) -> Option<String> {
        match self {
            Self::Whole(values) => values[row].map(|value| value.to_string()),
            Self::Real(values) => values[row].map(|value| value.to_string()),
            Self::Text(values) => values[row].clone(),
        }
    }

    /// Whether the cells are words.
    #[must_use]
    pub const fn is_text(&self) -> bool {
        matches!(self, Self::Text(_))
    }
}

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name in exports, such as `test_accuracy`.
    pub name: String,
    /// Words for people, such as `test accuracy`.
    pub label: String,
    /// What numbers are measured in.
    pub unit: ColumnUnit,
    /// What it is for.
    pub role: Role,
    /// Cells.
    pub values: Values,
}

/// A table; all columns have the same number of cells.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Columns: axes, seed, results, names.
    pub columns: Vec<Column>,
}

impl Table {
    /// Rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The column of that name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Columns with a role.
    pub fn with_role(&self, role: Role) -> impl Iterator<Item = &Column> {
        self.columns.iter().filter(move |column| column.role == role)
    }
}
