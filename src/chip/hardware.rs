//! What a chip is, as checked numbers. A hardware model file becomes one of these at the door.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::{
    AdcBits, DriveBits, ErrorBits, IncrementMax, LevelBits, LutBits, OutOfRange, ResidualBits,
};

pub mod timing;

pub use timing::{PulseCode, Timing};

/// The programming window of a cell: `floor < ceiling <= level_max`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    floor: u16,
    ceiling: u16,
}

impl Window {
    /// Checks the two ends against the width of a level and against each other.
    ///
    /// # Errors
    /// When `ceiling` does not fit `bits` or `floor` is not below it.
    pub fn new(floor: i64, ceiling: i64, bits: LevelBits) -> Result<Self, OutOfRange> {
        let max = i64::from(bits.level_max());
        let outside = |name, found, min, max| OutOfRange { name, found, min, max };
        let ceiling = u16::try_from(ceiling)
            .ok()
            .filter(|&c| c >= 1 && i64::from(c) <= max)
            .ok_or_else(|| outside("ceiling", ceiling, 1, max))?;
        let floor = u16::try_from(floor)
            .ok()
            .filter(|&f| f < ceiling)
            .ok_or_else(|| outside("floor", floor, 0, i64::from(ceiling) - 1))?;
        Ok(Self { floor, ceiling })
    }

    /// Least level.
    #[must_use]
    pub const fn floor(self) -> u16 {
        self.floor
    }

    /// Greatest level.
    #[must_use]
    pub const fn ceiling(self) -> u16 {
        self.ceiling
    }
}

/// What happens to a cell on the floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FloorKind {
    /// Positive pulses lift it.
    Recoverable,
    /// A cell that received pulses in a write and lies on the floor after it stays there for good.
    Absorbing,
}

/// Where a column's current becomes a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Adc {
    /// Lossless.
    Ideal,
    /// `bits` wide, one step is `2^ash` units of current.
    Finite {
        /// Resolution.
        bits: AdcBits,
        /// Whether banks are converted each, or their difference.
        subtract: Subtract,
        /// Where `ash` comes from.
        range: AdcRange,
    },
}

/// Where the inhibitory bank is subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subtract {
    /// Each bank is converted; codes are subtracted.
    Digital,
    /// Currents are subtracted; the difference is converted once.
    Current,
}

/// Where the shift of a converter's step comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdcRange {
    /// Given.
    Shift(u32),
    /// The worst case never saturates.
    Full,
    /// From the first 256 training samples, read with ideal converters.
    Calibrated {
        /// Shift added to the one found.
        headroom: u32,
        /// Whether it is found again before each epoch.
        every_epoch: bool,
    },
}

/// Fractional random bits of a rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DitherBits {
    /// Half-up, no draw.
    Zero,
    /// One byte a cell.
    Eight,
    /// Two bytes a cell.
    Sixteen,
}

impl DitherBits {
    /// The number of bits.
    #[must_use]
    pub const fn get(self) -> u32 {
        match self {
            Self::Zero => 0,
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }
}

/// Where a cell's dither word comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DitherPattern {
    /// Its own word.
    PerCell,
    /// Word of the row XOR word of the column.
    Separable,
}

/// How a write turns sums into pulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteScheme {
    /// Sums are rounded with a draw and bounded.
    Rounded,
    /// Rank 1, one sample at a time: rows and columns fire random trains, and a cell is pulsed where both fire.
    Trains {
        /// `log2` of the slots of a train.
        slots_log2: u32,
    },
}

impl WriteScheme {
    /// Slots of a train, at most.
    pub const SLOTS_MAX: u32 = 64;
}

/// A chip. Lengths are in cells, widths in bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hardware {
    /// Bits of a stored level.
    pub level_bits: LevelBits,
    /// Programming window.
    pub window: Window,
    /// What the floor does.
    pub floor_kind: FloorKind,
    /// Rows of a physical tile.
    pub tile_rows: usize,
    /// Columns of a physical tile.
    pub tile_columns: usize,
    /// Tiles the chip has; `None` is as many as it takes.
    pub tiles_max: Option<usize>,
    /// Whether a tile can be read from its columns.
    pub transposed_read: bool,
    /// Bits of a drive code.
    pub drive_bits: DriveBits,
    /// Bits a row DAC puts on a row at a time.
    pub dac_bits: u32,
    /// Column converters.
    pub adc: Adc,
    /// Bits of the activation table's index.
    pub lut_bits: LutBits,
    /// Bits of an error word.
    pub error_bits: ErrorBits,
    /// Bound of the pulses a write gives a cell.
    pub increment_max: IncrementMax,
    /// Dither of stochastic rounding.
    pub dither_bits: DitherBits,
    /// Where dither words come from.
    pub dither_pattern: DitherPattern,
    /// Fractional bits of the digital remainder behind a cell.
    pub residual_bits: ResidualBits,
    /// How sums become pulses.
    pub scheme: WriteScheme,
    /// Cycles of what a tile does; `None`: no cycles are counted.
    pub timing: Option<Timing>,
}

impl Hardware {
    /// `NS`: slices a drive code is read in.
    #[must_use]
    pub const fn slices(&self) -> u32 {
        self.drive_bits.get().div_ceil(self.dac_bits)
    }

    /// The shift at which no current of a tile can saturate a converter of `bits`.
    #[must_use]
    pub fn full_shift(&self, bits: AdcBits, subtract: Subtract, rows: usize) -> u32 {
        let slice_max = (1i64 << self.dac_bits.min(self.drive_bits.get())) - 1;
        let worst = rows as i64 * i64::from(self.window.ceiling()) * slice_max;
        let rail = match subtract {
            Subtract::Digital => (1i64 << bits.get()) - 1,
            Subtract::Current => (1i64 << (bits.get() - 1)) - 1,
        };
        (0..).find(|&shift| crate::num::fixed::rsh(worst, shift) <= rail).expect("rsh ends at 0")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_keeps_floor_below_ceiling_inside_the_level() {
        let bits = LevelBits::new(4).unwrap();
        assert!(Window::new(0, 15, bits).is_ok() && Window::new(14, 15, bits).is_ok());
        for (floor, ceiling) in [(0, 16), (15, 15), (-1, 15), (0, 0), (3, 2)] {
            assert!(Window::new(floor, ceiling, bits).is_err(), "{floor}..={ceiling}");
        }
    }
}
