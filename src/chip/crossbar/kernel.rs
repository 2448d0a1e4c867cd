//! The loops that touch every cell. [`scalar`] is the law; every other back end gives its bits.
//!
//! All sums are `i32`: a read adds at most 33,025 products of two bytes (the plan cuts longer columns into
//! chunks), an update at most 4,096 products of a drive (0..=255) and a gate (-127..=127), times a mantissa
//! of at most 15. A back end is a token that exists only where the processor has the feature.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::layout::{HALF_CELLS, Layout};
use crate::num::draw::Place;

mod scalar;

/// Sums, or levels, of a half block. Sums lie row-major, `[64 rows][16 columns]`; levels, residuals
/// and dither words lie as [`super::layout::in_half`] says.
pub type Half<T> = [T; HALF_CELLS];

/// Which loops run. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backend {
    /// Plain loops: the definition.
    Scalar,
}

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
        vec![Self::Scalar]
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
        }
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
        assert!(
            plane.len() >= blocks.end * super::layout::BLOCK_CELLS && stride >= blocks.end * 64
        );
        assert_eq!(drives.len() / stride * 32, out.len(), "32 sums a sample");
        match self {
            Self::Scalar => scalar::read(plane, blocks, drives, stride, out),
        }
    }

    /// The transposed read: `out[b][r] = sum over c of level[r][c] * gates[b][c]`, gates 0..=127, over a whole
    /// plane. `gates` holds `columns_padded` gates a sample, `out` `rows_padded` sums.
    pub fn read_columns(self, plane: &[u8], layout: Layout, gates: &[u8], out: &mut [i32]) {
        assert_eq!(plane.len(), layout.cells_padded());
        assert_eq!(gates.len() / layout.columns_padded() * layout.rows_padded(), out.len());
        match self {
            Self::Scalar => scalar::read_columns(plane, layout, gates, out),
        }
    }

    /// Sums of a half block: `sums[r][c] = sum over b of drives[r][b] * gates[b][c]`. `drives` holds 64 rows of
    /// `stride` samples (a multiple of 4, padded with 0), `gates` lies `[stride / 4][16 columns][4 samples]`.
    pub fn accumulate(self, drives: &[u8], stride: usize, gates: &[i8], sums: &mut Half<i32>) {
        assert!(
            stride.is_multiple_of(4) && drives.len() == 64 * stride && gates.len() == 16 * stride
        );
        match self {
            Self::Scalar => scalar::accumulate(drives, stride, gates, sums),
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
        match self {
            Self::Scalar => scalar::program(cells, sums, write, dither),
        }
    }
}
