//! Sizes and configuration registers of a tile: docs/TILE.md, 1.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::TileBalance;
use crate::chip::device::{Conducting, Noise};
use crate::chip::hardware::{PulseCode, SliceTime};
use crate::num::fixed::DriveBits;

/// Sizes a tile is built with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TileSize {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Reads it remembers.
    pub slots: usize,
    /// Stages of the adder tree there are registers for.
    pub tree_max: usize,
}

/// What converts a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TileAdc {
    /// Lossless.
    Ideal,
    /// Each bank on its own.
    Digital {
        /// Width of a code.
        bits: u32,
        /// `ash`, by slice.
        shift: u32,
    },
    /// The difference of the banks.
    Current {
        /// Width of a code.
        bits: u32,
        /// `ash`, by slice.
        shift: u32,
    },
}

/// What becomes of an accumulator in the lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TileUnits {
    /// It is looked up.
    Table,
    /// It is kept, with slope 1.
    Kept,
    /// It is kept for a stage outside that normalises the layer.
    Normalised,
}

/// Configuration registers. What docs/TILE.md lists comes first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TileConfig {
    /// Rows in use.
    pub rows: usize,
    /// Columns in use.
    pub columns: usize,
    /// `T_A`.
    pub settle: u64,
    /// `T_C`.
    pub convert: u64,
    /// `S`.
    pub share: usize,
    /// Whether a slice settles while the one before is converted.
    pub overlap: bool,
    /// `NS`.
    pub slices: u32,
    /// Bits of a slice.
    pub dac_bits: u32,
    /// `T_tree`.
    pub tree: usize,
    /// `U`.
    pub lanes: usize,
    /// `H`.
    pub hops: usize,
    /// `CE`.
    pub words: usize,
    /// Word of the first column.
    pub tap_base: usize,
    /// `T_W`.
    pub pulse: u64,
    /// Converters; a slice may have a shift of its own, see `adc_shifts`.
    pub adc: TileAdc,
    /// Width of the table's index.
    pub lut_bits: u32,
    /// `lsh`.
    pub lut_shift: u32,
    /// Width of an error word.
    pub error_bits: u32,
    /// Whether units are of stream n and latch the negated word.
    pub negate: bool,
    /// Rate mantissa.
    pub mantissa: i64,
    /// D.
    pub dither_bits: u32,
    /// Bound of the pulses.
    pub increment_max: i64,
    /// Least level.
    pub floor: u16,
    /// Greatest level.
    pub ceiling: u16,
    /// Floor kind.
    pub absorbing: bool,
    /// What only networks of tiles have.
    pub more: More,
}

/// What a tile of a network has beyond docs/TILE.md; the default is none of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct More {
    /// Shift of each slice; empty: the converter's own.
    pub adc_shifts: Vec<u32>,
    /// Times of each slice; empty: all take `settle` and `convert`.
    pub slice_times: Vec<SliceTime>,
    /// Whether accumulators leave the tile for a tree outside.
    pub tree_outside: bool,
    /// What the lanes do.
    pub units: TileUnits,
    /// What units that keep to a middle have in registers; `lut_shift` is not theirs.
    pub balance: Option<TileBalance>,
    /// Words a column adds; empty: the modulo tap.
    pub taps: Vec<Vec<usize>>,
    /// Shift of the sum of more than one word.
    pub tap_shift: u32,
    /// Cycles of a digital action.
    pub beat: u64,
    /// Whether only potentiating gates count: positive ones in bank e, negative ones in bank i.
    pub potentiation_only: bool,
    /// Added to the shift of a write.
    pub shift_extra: u32,
    /// Fractional bits of the remainder behind a cell.
    pub residual_bits: u32,
    /// Whether each pulse is followed by a read.
    pub verify: bool,
    /// Cells that can be pulsed at a time.
    pub active_max: Option<usize>,
    /// How pulses are given.
    pub pulse_code: PulseCode,
    /// Whether sums are asked for one pulse each, with a chance of `2^-k`.
    pub sign: bool,
    /// Whether all sums are squared and added before the first row is written, and which banks' sums are.
    pub looks: Option<[bool; 2]>,
    /// Beats of computing a row beyond the first.
    pub beats: u64,
    /// `d`, where sums go into an accumulator of the cell.
    pub momentum: Option<u32>,
    /// `a` and `b`, where they go into two means of the cell.
    pub adam: Option<[u32; 2]>,
    /// Fractional bits of the means that are taken off the rows, if they are.
    pub centred: Option<u32>,
    /// Slots of a train, where writes are coincidences of trains.
    pub train_slots: Option<u64>,
    /// Reads of a sample, one after the other in the slots: positions of a window.
    pub positions: usize,
    /// Times that rows are driven for a read: 2 where drives have a sign. Their slots lie one behind the other, what is below
    /// 0 behind what is above.
    pub phases: usize,
    /// How words come pixel by pixel; `None`: a sample has one set of words, which all its positions hear.
    pub squares: Option<Squares>,
    /// What conversions are off by.
    pub noise: Option<TileNoise>,
    /// What cells conduct, if not their level.
    pub conducting: Option<Conducting>,
}

/// Noise of the conversions of a tile, through rows and through columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TileNoise {
    /// Through the columns while rows are driven, and the other way.
    pub ways: [Noise; 2],
    /// Pathway codes of both banks.
    pub codes: [u8; 2],
    /// Number of the tile among those that are added up, each way.
    pub at: [usize; 2],
    /// First line of the logical array that a line of the tile is, each way.
    pub first: [usize; 2],
}

/// Squares of positions, each of which hears the words of the pixel that a pool makes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Squares {
    /// Positions of a square, down and across.
    pub side: usize,
    /// Pixels down and across.
    pub pixels: [usize; 2],
    /// Whether only the position with the greatest code hears it, the first of several; codes have so many bits.
    pub greatest: Option<DriveBits>,
}

impl Squares {
    /// The position that stands at place `at` of the square of a pixel.
    pub(super) const fn position(&self, pixel: usize, at: usize) -> usize {
        let across = self.pixels[1] * self.side;
        let (y, x) = (pixel / self.pixels[1] * self.side, pixel % self.pixels[1] * self.side);
        (y + at / self.side) * across + x + at % self.side
    }

    /// Positions of a square.
    pub(super) const fn size(&self) -> usize {
        self.side * self.side
    }
}

impl Default for More {
    fn default() -> Self {
        Self {
            adc_shifts: vec![],
            slice_times: vec![],
            tree_outside: false,
            units: TileUnits::Table,
            balance: None,
            taps: vec![],
            tap_shift: 0,
            beat: 1,
            potentiation_only: false,
            shift_extra: 0,
            residual_bits: 0,
            verify: false,
            active_max: None,
            pulse_code: PulseCode::Unary,
            sign: false,
            looks: None,
            beats: 0,
            momentum: None,
            adam: None,
            centred: None,
            train_slots: None,
            positions: 1,
            phases: 1,
            squares: None,
            noise: None,
            conducting: None,
        }
    }
}

impl TileConfig {
    /// `conv`.
    pub(super) const fn conversion(&self) -> u64 {
        self.share as u64 * self.convert
    }

    /// `T_A` of a slice; reads from the columns, and of drives with a sign, go through all of them twice.
    pub(super) fn settle_of(&self, slice: u32) -> u64 {
        let own = self.more.slice_times.get((slice % self.slices) as usize);
        own.map_or(self.settle, |own| own.settle)
    }

    /// `T_C` of a slice.
    pub(super) fn convert_of(&self, slice: u32) -> u64 {
        let own = self.more.slice_times.get((slice % self.slices) as usize);
        own.map_or(self.convert, |own| own.convert)
    }

    /// Cycles of a slice: it settles, and its successor is not sampled before its own conversions are done.
    pub(super) fn period(&self, slice: u32) -> u64 {
        let conversion = self.share as u64 * self.convert_of(slice);
        let done = self.settle_of(slice) + conversion;
        if self.overlap {
            let early = self.settle_of(slice + 1).min(conversion);
            done - early
        } else {
            done
        }
    }
}
