//! Commands of a tile: docs/TILE.md, 3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

/// A command and its fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command<'a> {
    /// `LOADW`.
    LoadWeights {
        /// Which row.
        row: usize,
        /// Levels of the columns in use, by bank.
        levels: [&'a [u16]; 2],
    },
    /// `LOADX`.
    LoadDrives {
        /// Which row.
        row: usize,
        /// Which sample.
        slot: usize,
        /// Drive code of each bank.
        codes: [u8; 2],
    },
    /// `FWD(rows)`.
    Forward {
        /// Which read; where a sample is read once, which sample.
        slot: usize,
    },
    /// `FWD(columns)`, driven by gates.
    Columns {
        /// Which sample.
        slot: usize,
    },
    /// `ERR`.
    Error {
        /// Which sample.
        slot: usize,
    },
    /// `UPD(now)`.
    Now {
        /// Which sample.
        slot: usize,
        /// k.
        shift: u32,
    },
    /// `UPD(add)`.
    Add {
        /// Which sample.
        slot: usize,
    },
    /// `UPD(write)`.
    Write {
        /// k.
        shift: u32,
    },
}

impl Command<'_> {
    /// As the instruction is written, and the sample it is for.
    #[must_use]
    pub const fn name(&self) -> (&'static str, Option<usize>) {
        match *self {
            Self::LoadWeights { .. } => ("LOADW(row)", None),
            Self::LoadDrives { slot, .. } => ("LOADX(row)", Some(slot)),
            Self::Forward { slot } => ("FWD(rows)", Some(slot)),
            Self::Columns { slot } => ("FWD(columns)", Some(slot)),
            Self::Error { slot } => ("ERR(words)", Some(slot)),
            Self::Now { slot, .. } => ("UPD(now)", Some(slot)),
            Self::Add { slot } => ("UPD(add)", Some(slot)),
            Self::Write { .. } => ("UPD(write)", None),
        }
    }
}
