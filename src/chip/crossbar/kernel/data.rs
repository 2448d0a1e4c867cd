//! What kernels take and give: plain data, the same for every back end.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::chacha::Draws;
use super::respond::{Answering, Remembered};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, PANEL_COLUMNS};

/// Sums, or levels, of a half block. Sums lie row-major, `[64 rows][16 columns]`; levels, residuals
/// and dither words lie as [`in_half`](crate::chip::crossbar::layout::in_half) says.
pub type Half<T> = [T; HALF_CELLS];

/// Drive codes of a batch as kernels take them: `[block of 64 rows][sample][64 rows]`, one byte a code. Rows that
/// do not exist are driven with 0.
#[derive(Debug, Clone, Copy)]
pub struct Drives<'a> {
    codes: &'a [u8],
    samples: usize,
    greatest: Greatest,
    /// What the drives of each sample add up to, where that is known.
    sums: Option<&'a [i32]>,
    /// Words of four rows of the last block beyond which nothing is driven.
    last_quads: usize,
}

/// What a read meets at most: where both are small, sums of pairs fit narrower lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Greatest {
    /// Of the levels of the plane that is read.
    pub level: u8,
    /// Of the drive codes.
    pub code: u8,
}

impl<'a> Drives<'a> {
    /// Codes of `samples` samples, whole blocks of rows.
    ///
    /// # Panics
    /// When the codes are not whole blocks.
    #[must_use]
    pub const fn new(codes: &'a [u8], samples: usize) -> Self {
        assert!(
            samples > 0 && codes.len().is_multiple_of(samples * BLOCK_ROWS),
            "drives come in whole blocks"
        );
        let greatest = Greatest { level: u8::MAX, code: u8::MAX };
        Self { codes, samples, greatest, sums: None, last_quads: BLOCK_ROWS / 4 }
    }

    /// The same, of which the last block has so many rows. A back end may pass over all others.
    ///
    /// # Panics
    /// When a block has no such rows.
    #[must_use]
    pub const fn with_last_rows(self, rows: usize) -> Self {
        assert!(rows > 0 && rows <= BLOCK_ROWS, "a block has rows");
        Self { last_quads: rows.div_ceil(4), ..self }
    }

    /// The same, with what [`Kernel::drive_sums`](super::Kernel::drive_sums) gave for them.
    ///
    /// # Panics
    /// When there is not a sum a sample.
    #[must_use]
    pub const fn with_sums(self, sums: &'a [i32]) -> Self {
        assert!(sums.len() == self.samples, "a sum a sample");
        Self { sums: Some(sums), ..self }
    }

    /// What the drives of each sample add up to, where that is known.
    #[must_use]
    pub const fn sums(self) -> Option<&'a [i32]> {
        self.sums
    }

    /// Words of four rows of the last block that may be driven.
    #[must_use]
    pub const fn last_quads(self) -> usize {
        self.last_quads
    }

    /// The same, where levels and codes are known to stay within their greatest. A back end may rely on it.
    #[must_use]
    pub const fn within(self, greatest: Greatest) -> Self {
        Self { greatest, ..self }
    }

    /// What the read meets at most.
    #[must_use]
    pub const fn greatest(self) -> Greatest {
        self.greatest
    }

    /// All codes.
    #[must_use]
    pub const fn codes(self) -> &'a [u8] {
        self.codes
    }

    /// Samples of the batch.
    #[must_use]
    pub const fn samples(self) -> usize {
        self.samples
    }

    /// Blocks of 64 rows.
    #[must_use]
    pub const fn blocks(self) -> usize {
        self.codes.len() / (self.samples * BLOCK_ROWS)
    }

    /// The drives of some of the blocks.
    #[must_use]
    pub fn of_blocks(self, blocks: std::ops::Range<usize>) -> Self {
        let (size, all) = (self.samples * BLOCK_ROWS, blocks.len() == self.blocks());
        let last_quads = if blocks.end == self.blocks() { self.last_quads } else { BLOCK_ROWS / 4 };
        let codes = &self.codes[blocks.start * size..blocks.end * size];
        Self { codes, last_quads, sums: self.sums.filter(|_| all), ..self }
    }

    /// The 64 codes of a block and sample.
    #[must_use]
    pub fn row(self, block: usize, sample: usize) -> &'a [u8; BLOCK_ROWS] {
        let at = (block * self.samples + sample) * BLOCK_ROWS;
        self.codes[at..at + BLOCK_ROWS].try_into().expect("64 codes")
    }
}

/// Converters on the columns of one bank: `code = min( rsh(current, shift), max )`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conversion {
    /// Step, as a shift of the current; at most [`Conversion::SHIFT_MAX`].
    pub shift: u32,
    /// Greatest code.
    pub max: u16,
}

impl Conversion {
    /// Greatest shift kernels take: half a step is then added to a current without a carry.
    pub const SHIFT_MAX: u32 = 30;
}

/// Conversions of two banks that met an end of their range.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Rails {
    /// Codes that the end changed, by bank.
    pub saturated: [u64; 2],
    /// Codes that lie on the end, changed or not, of both banks.
    pub reached: u64,
}

impl std::ops::AddAssign for Rails {
    fn add_assign(&mut self, more: Self) {
        self.saturated.iter_mut().zip(more.saturated).for_each(|(sum, count)| *sum += count);
        self.reached += more.reached;
    }
}

/// Two banks read by converters, panel by panel.
#[derive(Debug, Clone, Copy)]
pub struct Banks<'a> {
    /// Levels of the excitatory and the inhibitory panel.
    pub cells: [&'a [u8]; 2],
    /// What drives each.
    pub drives: [Drives<'a>; 2],
    /// Blocks of 64 rows of a physical tile; the last tile may be shorter.
    pub tile_blocks: usize,
    /// The converters.
    pub conversion: Conversion,
    /// Columns of the panel that exist.
    pub live: usize,
}

/// Samples that are read together, so that their sums stay close to the processor.
pub const TOGETHER: usize = 32;

/// Currents of two banks of a panel for [`TOGETHER`] samples, where matrix tiles are stored fastest.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct Scratch {
    /// `[sample][32]` by bank.
    pub currents: [[i32; Self::SUMS]; 2],
}

impl Scratch {
    /// Sums of a panel for [`TOGETHER`] samples.
    pub const SUMS: usize = TOGETHER * PANEL_COLUMNS;

    /// Zeros.
    #[must_use]
    pub const fn new() -> Self {
        Self { currents: [[0; Self::SUMS]; 2] }
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new()
    }
}

/// Codes and saturation counts of a panel for [`TOGETHER`] samples, in the order in which 512-bit vectors are packed.
#[cfg(target_arch = "x86_64")]
#[derive(Debug)]
#[repr(C, align(64))]
pub(super) struct Packed {
    pub(super) codes: [i16; Scratch::SUMS],
    pub(super) saturated: [[i16; PANEL_COLUMNS]; 2],
    /// Codes on the rail.
    pub(super) reached: [[i16; PANEL_COLUMNS]; 2],
}

/// A unit's table: `index = clamp( rsh(acc, shift), -half, half - 1 ) + half`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LookUp {
    /// `value | derivative << 8` by index; `value` is what the unit hands on.
    pub entries: Vec<u32>,
    /// Accumulator units of one step, as a shift.
    pub shift: u32,
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
pub struct WriteLaw {
    /// `k`: one pulse stands for `2^k` units of sum x mantissa.
    pub shift: u32,
    /// Small factor of the rate, 1..=15.
    pub mantissa: i32,
    /// Inhibitory pathways take the negated sum (negated before rounding).
    pub negate: bool,
    /// Bound of pulses, 1..=127.
    pub increment_max: i32,
    /// Groups of four rows with a sum that may move a cell; all others change nothing and may be passed over.
    pub groups: u16,
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
    /// Cells gone for good, of absorbing floors: [`Cells::GONE`], or 0.
    pub pruned: Option<&'a mut Half<u8>>,
    /// Where bounded pulses go, if they are wanted. Groups that are passed over put nothing there.
    pub pulses: Option<Pulsed<'a>>,
    /// What cells answer to pulses with, if they are not ideal.
    pub answering: Option<Answering<'a>>,
    /// What such cells remember beside their level, if anything.
    pub remembered: Option<Remembered<'a>>,
}

impl Cells<'_> {
    /// Says that a cell is gone for good.
    pub const GONE: u8 = u8::MAX;

    /// The window, where there is nothing but levels of 8 bits.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn plain_window(&self, write: &WriteLaw) -> Option<(u8, u8)> {
        if self.high.is_some() || self.residual.is_some() || self.pruned.is_some() {
            return None;
        }
        Some((u8::try_from(write.floor).ok()?, u8::try_from(write.ceiling).ok()?))
    }
}

/// The ends of levels, and how fine what lies behind them is.
#[derive(Debug, Clone, Copy)]
pub struct Ends {
    /// Least level.
    pub floor: u16,
    /// Greatest level.
    pub ceiling: u16,
    /// Fractional bits of the remainder behind a cell.
    pub residual_bits: u32,
}

impl Ends {
    /// The greatest remainder.
    #[inline(always)]
    pub(super) const fn most_left(self) -> u16 {
        (1 << self.residual_bits) - 1
    }
}

impl WriteLaw {
    /// Where levels end.
    #[must_use]
    pub const fn ends(&self) -> Ends {
        Ends { floor: self.floor, ceiling: self.ceiling, residual_bits: self.residual_bits }
    }
}

/// A strip of panels that is written for one sample, with 8-bit words of every cell.
#[derive(Debug)]
pub struct OneSample<'a> {
    /// Levels of whole panels.
    pub low: &'a mut [u8],
    /// Blocks of a panel.
    pub blocks: usize,
    /// Drives by block, `[64 rows][4]`, in the first of four places; `None` where all are 0.
    pub turned: &'a [Option<&'a [u8]>],
    /// Gates, `[half][16 columns][4]`, in the first of four places.
    pub gates: &'a [i8],
    /// First column of the strip.
    pub column: usize,
    /// Words of the array.
    pub draws: &'a Draws,
    /// Rounding, bound and window.
    pub write: &'a WriteLaw,
    /// Peaks of all rows over the columns of the strip, where they are asked for; 0 before.
    pub peaks: Option<&'a mut [[u8; 2]]>,
}

/// How a sum of one product becomes pulses that need no bound: `(rsh(sum, right) + word) >> 8`.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub(super) struct OneProduct {
    /// 1..=15.
    pub(super) right: u32,
    /// Floor and ceiling.
    pub(super) window: (u8, u8),
    /// At most one pulse, and a window of all levels, where the addition saturates.
    pub(super) usual: bool,
}

#[cfg(target_arch = "x86_64")]
impl OneSample<'_> {
    /// Half blocks side by side of the widest strip taken.
    pub(super) const HALVES: usize = 8;

    /// How its sums become pulses, if they are of the kind that is written at once.
    pub(super) fn one_product(&self) -> Option<OneProduct> {
        let write = self.write;
        let window = (u8::try_from(write.floor).ok()?, u8::try_from(write.ceiling).ok()?);
        let halves = self.gates.len() / (4 * HALF_CELLS / BLOCK_ROWS);
        if write.mantissa != 1 || !(9..=23).contains(&write.shift) || halves > Self::HALVES {
            return None;
        }
        let right = write.shift - 8;
        let reach = (((255 * 127 + (1 << right >> 1)) >> right) + 255) >> 8;
        let usual = reach <= 1 && window == (0, 255);
        (reach <= write.increment_max.min(15)).then_some(OneProduct { right, window, usual })
    }
}

/// Where bounded pulses go.
#[derive(Debug)]
pub enum Pulsed<'a> {
    /// All are kept, in the order of levels.
    Every(&'a mut Half<i8>),
    /// The extremes are kept.
    Most(&'a mut Extremes),
}

/// Most positive and most negative pulses over half blocks side by side, cell by cell, in the order of levels.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct Extremes {
    /// At least 0.
    pub most: Half<i8>,
    /// At most 0.
    pub least: Half<i8>,
}

impl Extremes {
    /// No pulses.
    #[must_use]
    pub const fn new() -> Self {
        Self { most: [0; HALF_CELLS], least: [0; HALF_CELLS] }
    }

    /// Takes the pulses of some cells along.
    #[inline(always)]
    pub fn take(&mut self, from: usize, pulses: &[i8]) {
        let most = self.most[from..from + pulses.len()].iter_mut();
        most.zip(pulses).for_each(|(most, &pulses)| *most = (*most).max(pulses));
        let least = self.least[from..from + pulses.len()].iter_mut();
        least.zip(pulses).for_each(|(least, &pulses)| *least = (*least).min(pulses));
    }
}

impl Default for Extremes {
    fn default() -> Self {
        Self::new()
    }
}

impl Pulsed<'_> {
    /// Puts the pulses of some cells there.
    #[inline(always)]
    pub fn take(&mut self, from: usize, pulses: &[i8]) {
        match self {
            Self::Every(plane) => plane[from..from + pulses.len()].copy_from_slice(pulses),
            Self::Most(extremes) => extremes.take(from, pulses),
        }
    }
}

/// Sizes of the most positive and the most negative pulses of each row of a block.
pub type Peaks = [[u8; 2]; BLOCK_ROWS];

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

/// Whether some drives or gates are not 0, looked at many at a time.
#[must_use]
pub fn is_driven<T: Copy + Default + std::ops::BitOr<Output = T> + PartialEq>(codes: &[T]) -> bool {
    let any = |part: &[T]| part.iter().fold(T::default(), |all, &code| all | code) != T::default();
    codes.chunks(256).any(any)
}
