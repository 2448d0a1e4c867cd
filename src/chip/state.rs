//! The one list of what a run is: visited by hash, checkpoint, resumption and comparison.
//!
//! Whatever holds state says so once, in [`State::visit`]. A visitor is shown every piece and may hand back another
//! value for it, so that what is hashed, written, read back and compared can never be four different lists.
//!
//! ```text
//! hash   BLAKE3 over  arithmetic version (u32 LE), then sections in rising tag:  tag (u32 LE), bytes (u64 LE), content
//! ```
//!
//! A section that nothing is written into does not exist: what a run does not have leaves no trace in its hash. Tags
//! are never reused. See docs/MODEL.md, 4.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::RangeInclusive;

use bitvec::prelude::*;

/// Which section of the hash a piece of state belongs to. The numbers are tags: append only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Section {
    /// Arrays: size, levels, pruned cells, remainders.
    Arrays = 1,
    /// Words of optimisers.
    Optimiser = 2,
    /// Running centres of errors.
    Centres = 3,
    /// Converter shifts.
    ConverterShifts = 4,
    /// Thresholds of units.
    Thresholds = 5,
    /// Shifts of tables, and the variances they follow.
    TableShifts = 6,
    /// Mean drives of rows.
    RowMeans = 7,
    /// Writes of each array.
    WriteCounts = 8,
    /// Epochs and updates.
    Progress = 9,
    /// Samples counted.
    SampleCounters = 10,
    /// What devices remember beside their level.
    Device = 11,
    /// What a task keeps.
    Task = 12,
    /// What was counted.
    Ledger = 13,
}

/// One piece of state.
#[derive(Debug, Clone)]
pub struct Piece<'a> {
    /// Its name in a checkpoint, such as `layer0.pp.levels`.
    pub name: &'a str,
    /// Where it is hashed; `None` where the hash has it in another form.
    pub section: Option<Section>,
    /// What every number of it must lie in.
    pub within: RangeInclusive<i64>,
}

/// A piece that does not fit what holds it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` {found}")]
pub struct StateError {
    /// Which piece.
    pub name: String,
    /// What is wrong.
    pub found: String,
}

/// What comes back from a look at a piece: other values for it, if it is to be replaced.
pub type Seen<T> = Result<Option<T>, StateError>;

/// Looks at state, piece by piece. What it hands back takes the place of what it was shown, and has the same length;
/// rows of a [`Visitor::rows`] alone may be more or fewer.
pub trait Visitor {
    /// Levels or remainders of an array of so many rows and columns, row-major.
    ///
    /// # Errors
    /// When what would replace them does not fit.
    fn halves(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        values: &dyn Fn() -> Vec<u16>,
    ) -> Seen<Vec<u16>>;

    /// A bit a cell, row-major.
    ///
    /// # Errors
    /// As [`Visitor::halves`].
    fn bits(
        &mut self,
        piece: &Piece<'_>,
        shape: [usize; 2],
        values: &dyn Fn() -> BitVec<u8, Lsb0>,
    ) -> Seen<BitVec<u8, Lsb0>>;

    /// Numbers.
    ///
    /// # Errors
    /// As [`Visitor::halves`].
    fn numbers(&mut self, piece: &Piece<'_>, values: &[i64]) -> Seen<Vec<i64>>;

    /// As many rows of `width` numbers as there is something to say.
    ///
    /// # Errors
    /// As [`Visitor::halves`].
    fn rows(
        &mut self,
        piece: &Piece<'_>,
        width: usize,
        values: &dyn Fn() -> Vec<i64>,
    ) -> Seen<Vec<i64>>;

    /// What the hash has beside the pieces: bytes that follow from them.
    fn derived(&mut self, _section: Section, _bytes: &dyn Fn() -> Vec<u8>) {}
}

/// Holds state.
pub trait State {
    /// Shows every piece to a visitor, in the order of layers, arrays and units, and takes what it hands back.
    ///
    /// # Errors
    /// When a piece does not fit. Part of the state may then be replaced.
    fn visit(&mut self, visitor: &mut dyn Visitor) -> Result<(), StateError>;
}

/// Shows some counts that a checkpoint keeps and the hash holds as they are.
///
/// # Errors
/// When what would replace them does not fit.
pub fn visit_counts<'a>(
    visitor: &mut dyn Visitor,
    name: &str,
    section: Section,
    counts: impl Iterator<Item = &'a mut u64>,
) -> Result<(), StateError> {
    let counts: Vec<&mut u64> = counts.collect();
    let numbers: Vec<i64> = counts.iter().map(|count| signed(**count)).collect();
    let piece = Piece { name, section: Some(section), within: 0..=i64::MAX };
    if let Some(numbers) = visitor.numbers(&piece, &numbers)? {
        counts.into_iter().zip(numbers).for_each(|(count, new)| *count = new.unsigned_abs());
    }
    Ok(())
}

/// A count as files and hashes hold it.
///
/// # Panics
/// Never in a run: it has fewer than 2^63 events.
#[must_use]
pub fn signed(count: u64) -> i64 {
    i64::try_from(count).expect("a run has fewer than 2^63 events")
}
