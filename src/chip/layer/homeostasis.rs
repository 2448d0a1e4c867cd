//! What units that keep to a middle of their own remember: a threshold each, and a step of their table.
//!
//! ```text
//! d        = acc - rsh(T, 8)                                    T: threshold of a unit, 8 fractional bits
//! i        = clamp( rsh(d, lsh), -half, half - 1 )              half = 2^(lut_bits - 1);  rsh(v, -s) = v << s
//! T       += rsh( (sum acc << 8) - n T, w + lp )                after the writes of a batch, n = B' P reads
//! V       += rsh( (sum i^2 << 4) - n V, w + lp )                of all units and target streams of a layer, N of them
//! lsh + 1, V >> 2      where V >= N 2^(2 lut_bits - 1)          else
//! lsh - 1, V << 2      where V <  N 3 2^(2 lut_bits - 5)        one step a batch at most
//! ```
//!
//! A standard deviation is meant to be `2^(lut_bits - 3)` indices, 128 of 1,024; `w` is the window, `P` positions of a sample, `lp`
//! `ceil(log2 P)`. Everything reads the state from before. At first, of n reads of some samples:
//!
//! ```text
//! T        = floor( (2 (sum acc << 8) + n) / (2 n) )
//! lsh      = least shift with sum d^2 < n N 2^(2 lut_bits - 5 + 2 lsh),  then + spread, inside -8..=47
//! V        = floor( (sum i^2 << 4) / n )
//! ```
//!
//! The plan proves that `sum acc << 8` and `n T` stay below 2^62. See docs/MODEL.md, 2.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

#[cfg(test)]
mod tests;

use super::{Gain, Homeostasis, LayerSpec};
use crate::chip::population::Stream;
use crate::chip::state::{Piece, Section, StateError, Visitor};
use crate::num::fixed::{LutBits, log2_ceil, rsh};

/// Fractional bits of a threshold.
pub const THRESHOLD_BITS: u32 = 8;
/// Fractional bits of a variance.
const VARIANCE_BITS: u32 = 4;
/// Shifts of a table whose step is found.
pub const STEP_SHIFTS: std::ops::RangeInclusive<i32> = -8..=47;
/// Bound of sums of a batch with their fractional bits.
pub const SUMS_BELOW_LOG2: u32 = 62;

/// What reads of some samples come to, for those who learn a middle from them. Sums, so that no order matters.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Readings {
    /// Reads of each unit.
    pub reads: u64,
    /// Sum of the accumulators of each unit, by target stream.
    pub sums: [Vec<i64>; 2],
    /// Sum of the squares of indices, of all units.
    pub squares: u64,
    /// Sum of the squares of what was left beside thresholds, of all units.
    pub deviations: u128,
}

/// Thresholds and table step of a layer; nothing of a layer whose units have but a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Balance {
    law: Homeostasis,
    lut_bits: u32,
    /// `log2` of the positions of a sample, rounded up.
    positions_log2: u32,
    /// Units of all target streams.
    units: u64,
    /// `T` by target stream and unit; empty without thresholds.
    thresholds: [Vec<i64>; 2],
    /// `lsh`.
    shift: i32,
    /// `V`; kept where the gain tracks.
    variance: i64,
}

impl Balance {
    /// That of a new layer, whose table has a shift of its own: thresholds of 0, and the variance that a table is meant for.
    #[must_use]
    pub(super) fn new(spec: &LayerSpec, lut_bits: LutBits, shift: u32) -> Self {
        let (law, targets) = (spec.homeostasis, spec.wiring.targets());
        let mut thresholds = [vec![], vec![]];
        if law.threshold {
            targets.iter().for_each(|target| thresholds[target.index()] = vec![0; spec.units]);
        }
        let units = (spec.units * targets.len()) as u64;
        Self {
            law,
            lut_bits: lut_bits.get(),
            positions_log2: log2_ceil(spec.positions() as u64),
            units,
            thresholds,
            shift: i32::try_from(shift).expect("at most 30"),
            variance: signed(units) << (2 * lut_bits.get() + VARIANCE_BITS - 6),
        }
    }

    /// What it does.
    #[must_use]
    pub const fn law(&self) -> Homeostasis {
        self.law
    }

    /// Whether the variance of indices moves the step.
    #[must_use]
    pub const fn tracks(&self) -> bool {
        matches!(self.law.gain, Gain::Tracking)
    }

    /// Thresholds of a target stream by unit, 8 fractional bits; empty without thresholds.
    #[must_use]
    pub fn thresholds(&self, target: Stream) -> &[i64] {
        &self.thresholds[target.index()]
    }

    /// `lsh`: accumulator units of a step of the table are `2^lsh`.
    #[must_use]
    pub const fn shift(&self) -> i32 {
        self.shift
    }

    /// `V`: what the squares of the indices of all units add up to in a read, 4 fractional bits.
    #[must_use]
    pub const fn variance(&self) -> i64 {
        self.variance
    }

    /// What is taken off the accumulator of a unit.
    #[must_use]
    pub fn offset(&self, target: Stream, unit: usize) -> i64 {
        self.thresholds(target).get(unit).map_or(0, |&threshold| rsh(threshold, THRESHOLD_BITS))
    }

    /// Thresholds before the first update, of what was read with none.
    pub(crate) fn set_thresholds(&mut self, readings: &Readings) {
        for (thresholds, sums) in self.thresholds.iter_mut().zip(&readings.sums) {
            for (threshold, &sum) in thresholds.iter_mut().zip(sums) {
                *threshold = first_threshold(sum, readings.reads);
            }
        }
    }

    /// The step before the first update, of the squares of what was read beside thresholds.
    pub(crate) fn set_shift(&mut self, readings: &Readings) {
        let spread = match self.law.gain {
            Gain::Table => return,
            Gain::Fixed { spread } => i32::try_from(spread).expect("at most 2"),
            Gain::Tracking => 0,
        };
        let least = first_shift(readings.deviations, readings.reads * self.units, self.lut_bits);
        self.shift = (least + spread).min(*STEP_SHIFTS.end());
    }

    /// The variance before the first update.
    pub(crate) fn set_variance(&mut self, readings: &Readings) {
        if self.tracks() {
            let squares = i64::try_from(readings.squares).expect("the plan proves it");
            self.variance = (squares << VARIANCE_BITS) / signed(readings.reads.max(1));
        }
    }

    /// Writes are done: moves by what the batch was read with.
    pub(crate) fn written(&mut self, readings: &Readings) {
        let (reads, window) = (signed(readings.reads), self.law.window_log2 + self.positions_log2);
        for (thresholds, sums) in self.thresholds.iter_mut().zip(&readings.sums) {
            for (threshold, &sum) in thresholds.iter_mut().zip(sums) {
                *threshold = moved(*threshold, sum << THRESHOLD_BITS, reads, window);
            }
        }
        if self.tracks() {
            let squares = i64::try_from(readings.squares).expect("the plan proves it");
            let variance = moved(self.variance, squares << VARIANCE_BITS, reads, window);
            (self.shift, self.variance) =
                stepped(self.shift, variance, signed(self.units), self.lut_bits);
        }
    }

    /// Shows what is remembered of the layer of this name.
    pub(super) fn visit(
        &mut self,
        layer: &str,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        let below = 1i64 << SUMS_BELOW_LOG2;
        for (thresholds, stream) in self.thresholds.iter_mut().zip(["p", "n"]) {
            if thresholds.is_empty() {
                continue;
            }
            let piece = Piece {
                name: &format!("{layer}.thresholds.{stream}"),
                section: Some(Section::Thresholds),
                within: -below..=below,
            };
            if let Some(new) = visitor.numbers(&piece, thresholds)? {
                *thresholds = new;
            }
        }
        if self.law.gain == Gain::Table {
            return Ok(());
        }
        let piece = Piece {
            name: &format!("{layer}.table_shift"),
            section: Some(Section::TableShifts),
            within: (*STEP_SHIFTS.start()).into()..=(*STEP_SHIFTS.end()).into(),
        };
        if let Some(new) = visitor.numbers(&piece, &[self.shift.into()])? {
            self.shift = i32::try_from(new[0]).expect("a visitor keeps to the range");
        }
        if self.tracks() {
            let piece = Piece {
                name: &format!("{layer}.variance"),
                section: Some(Section::TableShifts),
                within: 0..=below,
            };
            if let Some(new) = visitor.numbers(&piece, &[self.variance])? {
                self.variance = new[0];
            }
        }
        Ok(())
    }
}

/// `rsh(v, shift)`, to the left where the shift is below 0.
#[inline]
#[must_use]
pub fn shifted(v: i64, shift: i32) -> i64 {
    match u32::try_from(shift) {
        Ok(right) => rsh(v, right),
        Err(_) => v << shift.unsigned_abs(),
    }
}

/// A threshold before the first update.
#[must_use]
pub fn first_threshold(sum: i64, reads: u64) -> i64 {
    let n = i128::from(reads.max(1));
    let mean = (2 * (i128::from(sum) << THRESHOLD_BITS) + n).div_euclid(2 * n);
    i64::try_from(mean).expect("a mean is no greater than what it is of")
}

/// The least shift at which the mean square of `count` numbers is below twice that of a deviation.
#[must_use]
pub fn first_shift(squares: u128, count: u64, lut_bits: u32) -> i32 {
    let below = |shift: &i32| {
        let log2 = 2 * (i32::try_from(lut_bits).expect("at most 14") + shift) - 5;
        let count = u128::from(count);
        match u32::try_from(log2) {
            Ok(up) => up > count.leading_zeros() || squares < count << up,
            Err(_) => {
                let up = log2.unsigned_abs();
                up <= squares.leading_zeros() && squares << up < count
            }
        }
    };
    STEP_SHIFTS.clone().find(below).unwrap_or(*STEP_SHIFTS.end())
}

/// A running mean of numbers that add up to `sum` in so many reads, after a window of `2^window_log2` of them.
#[must_use]
pub fn moved(mean: i64, sum: i64, reads: i64, window_log2: u32) -> i64 {
    mean + rsh(sum - reads * mean, window_log2)
}

/// A step and a variance, after they were looked at.
#[must_use]
pub fn stepped(shift: i32, variance: i64, units: i64, lut_bits: u32) -> (i32, i64) {
    let (variance_32nds, scale) = (i128::from(variance) << 5, i128::from(units) << (2 * lut_bits));
    if variance_32nds >= scale << 4 && shift < *STEP_SHIFTS.end() {
        (shift + 1, variance >> 2)
    } else if variance_32nds < 3 * scale && shift > *STEP_SHIFTS.start() {
        (shift - 1, variance << 2)
    } else {
        (shift, variance)
    }
}

/// What sums of a batch of so many reads of a layer lie below, with their fractional bits: accumulators of at most `sum_max`.
#[must_use]
pub fn sums_max(spec: &LayerSpec, lut_bits: LutBits, sum_max: u128, reads: u128) -> u128 {
    let units = (spec.units * spec.wiring.targets().len()) as u128;
    let squares = units << (2 * (lut_bits.get() - 1) + VARIANCE_BITS);
    let of_gain = if spec.homeostasis.gain == Gain::Table { 0 } else { squares };
    reads.saturating_mul(of_gain.max(sum_max << THRESHOLD_BITS))
}

fn signed(count: u64) -> i64 {
    i64::try_from(count).expect("the plan proves it")
}
