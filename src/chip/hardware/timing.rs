//! How long a tile takes for what it does, in cycles of its clock.
//!
//! ```text
//! FWD, samples and holds overlapped   T_A + (NS - 1) max(T_A, conv) + conv + T_tree + NG      conv = S T_C
//! FWD, not overlapped                 NS (T_A + conv) + T_tree + NG                           NG = ceil(C / U)
//! until the next FWD                  max(NS period, NG)            period = max(T_A, conv), or T_A + conv
//! slices that take unequal times      see `read_time`
//! words formed in the error unit       ceil(CE N / U)              of N words, each a sum of CE
//! ERR                                 CE + H + P NG                       P reads a sample: positions of a convolution
//! UPD add                             P rows NG;  of a sample that is written at once, where P > 1, before its write
//! a pool                              NG a position it puts out
//! a look at all sums before a write   rows NG + ceil(log2(tiles))
//! a pulse of a row                    T_W passes, and T_A + conv more when it is verified
//! ```
//!
//! Every accepted command adds one cycle. On a chip whose clock is that of optical symbols, whatever is digital takes
//! `beat` cycles where these formulas say one. See docs/TILE.md and docs/MODEL.md, 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::read_time::SliceTimes;
use super::{HardwareError, between};

/// How the pulses of a row are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PulseCode {
    /// One pulse a level: a row takes as many as its most active cell asks for.
    Unary,
    /// One pulse whose amplitude says how many levels.
    Amplitude,
}

/// Cycles of a tile. All are at least 1 where the formula divides or counts by them.
///
/// ```
/// use dalean::Hardware;
/// use dalean::hardware::{PulseCode, Timing};
///
/// let timing = Timing {
///     clock_khz: 1_000_000,
///     beat: 1,
///     settle: 10,
///     convert: 2,
///     share: 8,
///     overlapped: true,
///     lanes: 4,
///     hops: 3,
///     pulse: 5,
///     pulse_code: PulseCode::Unary,
///     verify: false,
///     active_max: None,
///     slices: None,
/// };
/// assert!(Hardware::reference().with(|parts| parts.timing = Some(timing)).is_ok());
/// let stuck = Timing { lanes: 0, ..timing };
/// assert!(Hardware::reference().with(|parts| parts.timing = Some(stuck)).is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Kilohertz of the clock that counts cycles. Turns cycles into seconds; no schedule reads it.
    pub clock_khz: u64,
    /// Cycles of a digital action (look-up group, bus word, tree level, accumulation, row turn-around): 1, or the
    /// symbols of a digital clock on a chip whose clock is optical.
    pub beat: u64,
    /// `T_A`: cycles to settle and sample, of the first slice.
    pub settle: u64,
    /// `T_C`: cycles of a conversion, of the first slice and of a read that verifies.
    pub convert: u64,
    /// `S`: columns that share a converter.
    pub share: u64,
    /// Whether a slice settles while the one before is converted.
    pub overlapped: bool,
    /// `U`: columns looked up, multiplied or accumulated at a time.
    pub lanes: u64,
    /// `H`: hops of the error bus.
    pub hops: u64,
    /// `T_W`: cycles of a pulse.
    pub pulse: u64,
    /// How pulses are given.
    pub pulse_code: PulseCode,
    /// Whether every pulse is followed by a read of what it did.
    pub verify: bool,
    /// `W`: cells that can be pulsed at a time; `None` is a whole row of both banks.
    pub active_max: Option<u64>,
    /// What each slice takes, where not all take what the first one does.
    pub slices: Option<SliceTimes>,
}

/// Beats between the last square of a sample and its first scaling: division, root and reciprocal.
const ROOT_BEATS: u64 = 32;

/// Most cycles of one action: 0.1 s at 1 GHz.
pub const CYCLES_MAX: u64 = 100_000_000;

impl Timing {
    /// Checks every number against what a chip can have.
    pub(super) fn check(&self) -> Result<(), HardwareError> {
        let Self {
            clock_khz,
            beat,
            settle,
            convert,
            share,
            overlapped: _,
            lanes,
            hops,
            pulse,
            pulse_code: _,
            verify: _,
            active_max,
            slices,
        } = *self;
        between("timing.clock_mhz", clock_khz, [1, 1_000_000_000])?;
        between("timing.beat_cycles", beat, [1, 1_000_000])?;
        // a phase of pulse width takes its slots beside what is given
        between("timing.settle_cycles", settle, [1, 2 * CYCLES_MAX])?;
        between("timing.convert_cycles", convert, [1, CYCLES_MAX])?;
        between("timing.columns_per_adc", share, [1, 32_768])?;
        between("timing.lanes", lanes, [1, 32_768])?;
        between("timing.bus_hops", hops, [0, 1_000_000])?;
        between("timing.pulse_cycles", pulse, [1, CYCLES_MAX])?;
        if let Some(slices) = slices {
            slices.check(settle, convert)?;
        }
        active_max.map_or(Ok(()), |cells| between("timing.write_active_max", cells, [1, 65_536]))
    }

    /// `conv`: cycles until all columns of a bank are converted.
    #[must_use]
    pub(crate) const fn conversion(&self) -> u64 {
        self.share * self.convert
    }

    /// `NG`: turns in which the lanes see all of so many columns.
    #[must_use]
    pub(crate) const fn groups(&self, columns: u64) -> u64 {
        columns.div_ceil(self.lanes)
    }

    /// Busy cycles of `ERR` with so many words, of a sample that was read so many times.
    #[must_use]
    pub(crate) const fn error(&self, words: u64, columns: u64, reads: u64) -> u64 {
        self.beat * (words + self.hops + reads * self.groups(columns))
    }

    /// Busy cycles of `UPD(add)`, a read.
    #[must_use]
    pub(crate) const fn accumulate(&self, rows: u64, columns: u64) -> u64 {
        self.beat * rows * self.groups(columns)
    }

    /// Busy cycles of a pass over the sums of a layer on so many tiles before it is written: all are squared and added.
    #[must_use]
    pub(crate) const fn look(&self, rows: u64, columns: u64, tiles: u64) -> u64 {
        self.accumulate(rows, columns) + self.beat * tree_levels(tiles)
    }

    /// Cycles of the error unit that takes the mean over a batch off every word: `B CE + CE`.
    #[must_use]
    pub(crate) const fn centre(&self, samples: u64, words: u64) -> u64 {
        self.beat * (samples * words + words)
    }

    /// Cycles of the error unit that adds so many terms to form the words of a layer.
    #[must_use]
    pub(crate) const fn form(&self, terms: u64) -> u64 {
        self.beat * terms.div_ceil(self.lanes)
    }

    /// Cycles of the stage that normalises a sample, of so many columns a tile: squares, root, scalings.
    #[must_use]
    pub(crate) const fn normalise(&self, columns: u64) -> u64 {
        self.beat * (2 * self.groups(columns) + ROOT_BEATS)
    }

    /// Cycles of the stage that pools a sample, of so many columns a tile, to so many positions.
    #[must_use]
    pub(crate) const fn pool(&self, columns: u64, positions: u64) -> u64 {
        self.beat * positions * self.groups(columns)
    }

    /// Cycles of one pass of a pulse.
    #[must_use]
    pub(crate) const fn pass(&self) -> u64 {
        self.pulse + if self.verify { self.settle + self.conversion() } else { 0 }
    }

    /// Cycles of rows that take so many passes together: compute, pulses, turn around.
    #[must_use]
    pub(crate) const fn rows(&self, rows: u64, passes: u64) -> u64 {
        2 * self.beat * rows + passes * self.pass()
    }

    /// Cycles of a rank-1 write: levels that rise, then levels that fall.
    #[must_use]
    pub(crate) const fn trains(&self, slots: u64) -> u64 {
        2 * slots * self.pulse
    }

    /// Cycles an accepted command adds.
    #[must_use]
    pub(crate) const fn accept(&self) -> u64 {
        self.beat
    }
}

/// Steps in which a tree adds so many tiles: `ceil(log2(tiles))`.
#[must_use]
pub const fn tree_levels(tiles: u64) -> u64 {
    (u64::BITS - (tiles - 1).leading_zeros()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: Timing = Timing {
        clock_khz: 1_000_000,
        beat: 1,
        settle: 10,
        convert: 2,
        share: 8,
        overlapped: true,
        lanes: 4,
        hops: 3,
        pulse: 5,
        pulse_code: PulseCode::Unary,
        verify: false,
        active_max: None,
        slices: None,
    };

    #[test]
    fn a_verified_pulse_is_read() {
        let verified = Timing { verify: true, ..TIMING };
        assert_eq!((TIMING.rows(1, 3), verified.rows(2, 3)), (2 + 15, 4 + 3 * (5 + 26)));
    }

    #[test]
    fn the_lanes_see_a_normalised_sample_twice() {
        let slow = Timing { beat: 3, ..TIMING };
        assert_eq!((TIMING.normalise(17), slow.normalise(64)), (2 * 5 + 32, 3 * (2 * 16 + 32)));
    }

    #[test]
    fn a_tree_of_one_tile_has_no_levels() {
        assert_eq!([1, 2, 3, 4, 5, 8, 9].map(tree_levels), [0, 1, 2, 2, 3, 3, 4]);
    }
}
