//! The loops that touch every cell. `scalar` is the law; every other back end gives its bits.
//!
//! All sums are `i32`: a read adds at most 33,025 products of two bytes (the plan cuts longer columns into
//! chunks), an update at most 4,096 products of a drive (0..=255) and a gate (-127..=127), times a mantissa
//! of at most 15. A back end is a token that exists only where the processor has the feature.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::layout::{BLOCK_CELLS, BLOCK_ROWS, HALF_CELLS, Layout, PANEL_COLUMNS};
use crate::num::draw::Place;

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod chacha;
mod scalar;
#[cfg(test)]
mod tests;

#[cfg(target_arch = "x86_64")]
pub use self::{avx2::Avx2, avx512::Avx512};

/// Sums, or levels, of a half block. Sums lie row-major, `[64 rows][16 columns]`; levels, residuals
/// and dither words lie as [`super::layout::in_half`] says.
pub type Half<T> = [T; HALF_CELLS];

/// Which loops run. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backend {
    /// Plain loops: the definition.
    Scalar,
    /// 256-bit loops.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// 512-bit loops with 8-bit dot products.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

/// Why a back end cannot be had by its name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnknownBackend {
    /// No back end has this name on any machine.
    #[error("there is no kernel `{name}`; say one of {}", NAMES.join(", "))]
    Name {
        /// What was asked for.
        name: String,
    },
    /// The name is right, but the processor lacks the feature.
    #[error("this processor cannot run the kernel `{name}`; it has {}", there.join(", "))]
    Absent {
        /// What was asked for.
        name: String,
        /// Names of the back ends of this machine.
        there: Vec<&'static str>,
    },
}

/// Names of all back ends of all machines, slowest first.
const NAMES: [&str; 3] = ["scalar", "avx2", "avx512"];

/// Rounding of a sum to pulses.
#[derive(Debug, Clone, Copy)]
pub enum Dither<'a> {
    /// Half-up.
    Nearest,
    /// 8 fractional bits and an 8-bit word a cell, in the order of levels.
    Byte(&'a Half<u8>),
    /// 16 fractional bits and a 16-bit word a cell, in the order of levels.
    Word(&'a Half<u16>),
}

/// How sums become pulses and pulses become levels; the same for every cell of an array in one write.
#[derive(Debug, Clone, Copy)]
pub struct Write {
    /// `k`: one pulse stands for `2^k` units of sum x mantissa.
    pub shift: u32,
    /// Small factor of the rate, 1..=15.
    pub mantissa: i32,
    /// Inhibitory pathways take the negated sum (negated before rounding).
    pub negate: bool,
    /// Bound of pulses, 1..=127.
    pub increment_max: i32,
    /// Least level.
    pub floor: u16,
    /// Greatest level.
    pub ceiling: u16,
    /// `F`: fractional bits of the remainder behind a cell.
    pub residual_bits: u32,
}

/// The state behind the cells of a half block.
#[derive(Debug)]
pub struct Cells<'a> {
    /// Low byte of each level.
    pub low: &'a mut Half<u8>,
    /// High byte, of arrays with more than 8 bits.
    pub high: Option<&'a mut Half<u8>>,
    /// Remainder, of writes with `residual_bits > 0`.
    pub residual: Option<&'a mut Half<u16>>,
    /// Cells gone for good, of absorbing floors: one byte a cell, 0 or 1.
    pub pruned: Option<&'a mut Half<u8>>,
}

/// What one write did, summed over cells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WriteCounts {
    /// Cells whose increment was not 0 before the bound.
    pub requested: u64,
    /// Cells whose increment the bound changed.
    pub bounded: u64,
    /// Pulses after the bound.
    pub attempted: u64,
    /// Levels actually moved.
    pub effective: u64,
}

impl std::ops::AddAssign for WriteCounts {
    fn add_assign(&mut self, other: Self) {
        self.requested += other.requested;
        self.bounded += other.bounded;
        self.attempted += other.attempted;
        self.effective += other.effective;
    }
}

impl Backend {
    /// The back ends this machine has, slowest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        let all = [Self::Scalar].into_iter();
        #[cfg(target_arch = "x86_64")]
        let all = all.chain(Avx2::detect().map(Self::Avx2));
        #[cfg(target_arch = "x86_64")]
        let all = all.chain(Avx512::detect().map(Self::Avx512));
        all.collect()
    }

    /// The fastest back end this machine has.
    #[must_use]
    pub fn best() -> Self {
        *Self::available().last().expect("the scalar law is always there")
    }

    /// The name `--kernel` takes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "avx512",
        }
    }

    /// The back end called `name`.
    ///
    /// # Errors
    /// When no back end has that name, or this processor lacks it.
    pub fn named(name: &str) -> Result<Self, UnknownBackend> {
        let available = Self::available();
        if let Some(backend) = available.iter().find(|backend| backend.name() == name) {
            return Ok(*backend);
        }
        let name = name.to_owned();
        if NAMES.contains(&name.as_str()) {
            let there = available.into_iter().map(Self::name).collect();
            return Err(UnknownBackend::Absent { name, there });
        }
        Err(UnknownBackend::Name { name })
    }

    /// Reads one panel: `out[b][c] = sum of level[r][c] * drives[b][r]` over the rows of `blocks`, for the 32
    /// columns of the panel. `plane` is one byte plane of the panel (`blocks x 2048` bytes), `drives` holds
    /// `stride` bytes a sample, `out` 32 sums a sample.
    pub fn read(
        self,
        plane: &[u8],
        blocks: Range<usize>,
        drives: &[u8],
        stride: usize,
        out: &mut [i32],
    ) {
        assert!(plane.len() >= blocks.end * BLOCK_CELLS, "the panel has the blocks");
        assert!(stride >= blocks.end * BLOCK_ROWS, "every row has a drive");
        assert_eq!(drives.len() / stride * PANEL_COLUMNS, out.len(), "32 sums a sample");
        if out.is_empty() {
            return;
        }
        match self {
            Self::Scalar => scalar::read(plane, blocks, drives, stride, out),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.read(plane, blocks, drives, stride, out),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(avx512) => avx512.read(plane, blocks, drives, stride, out),
        }
    }

    /// Reads a whole array from its columns: `out[b][r] = sum of level[r][c] * gates[b][c]` over all columns.
    /// `plane` is one byte plane of the array, `gates` (0..=127) holds the padded columns a sample, `out` the
    /// padded rows.
    pub fn read_columns(self, plane: &[u8], layout: Layout, gates: &[u8], out: &mut [i32]) {
        let (rows, columns) = (layout.rows_padded(), layout.columns_padded());
        assert_eq!(plane.len(), layout.cells_padded(), "one byte a cell");
        assert!(rows > 0 && columns > 0, "an array has cells");
        assert!(gates.len().is_multiple_of(columns), "one gate a column");
        assert_eq!(gates.len() / columns * rows, out.len(), "one sum a row");
        debug_assert!(gates.iter().all(|gate| *gate < 128), "gates have 7 bits");
        if out.is_empty() {
            return;
        }
        match self {
            Self::Scalar => scalar::read_columns(plane, layout, gates, out),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.read_columns(plane, layout, gates, out),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(avx512) => avx512.read_columns(plane, layout, gates, out),
        }
    }

    /// Sums of a half block: `sums[r][c] = sum over b of drives[r][b] * gates[b][c]`. `drives` holds 64 rows of
    /// `stride` samples (a multiple of 4, padded with 0), `gates` lies `[stride / 4][16 columns][4 samples]`.
    pub fn accumulate(self, drives: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
        assert!(stride > 0 && stride.is_multiple_of(4), "samples are padded to words of four");
        assert!(drives.len() == 64 * stride && gates.len() == 16 * stride, "64 rows, 16 columns");
        match self {
            Self::Scalar => scalar::accumulate(drives, stride, gates, sums),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.accumulate(drives, stride, gates, sums),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(avx512) => avx512.accumulate(drives, stride, gates, sums),
        }
    }

    /// The 8-bit dither words of a half block of a logical array with `rows` rows: columns
    /// `column .. column + 16`, rows `64 * block ..`, in the order of levels.
    pub fn dither(
        self,
        place: &Place,
        rows: usize,
        column: usize,
        block: usize,
        out: &mut Half<u8>,
    ) {
        match self {
            Self::Scalar => scalar::dither(place, rows, column, block, out),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.dither(place, rows, column, block, out),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(avx512) => avx512.dither(place, rows, column, block, out),
        }
    }

    /// Rounds, bounds and programs a half block.
    pub fn program(
        self,
        cells: Cells<'_>,
        sums: &Half<i32>,
        write: &Write,
        dither: Dither<'_>,
    ) -> WriteCounts {
        assert!(write.floor <= write.ceiling, "the window is not empty");
        match self {
            Self::Scalar => scalar::program(cells, sums, write, dither),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(avx2) => avx2.program(cells, sums, write, dither),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(avx512) => avx512.program(cells, sums, write, dither),
        }
    }
}
