//! Lanes of units that keep to a middle: thresholds, steps that a shift of either sign gives, and what is learnt meanwhile.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Tile;

/// Registers of units that keep to a middle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TileBalance {
    /// `T` of each column, 8 fractional bits; empty where there are none.
    pub thresholds: Vec<i64>,
    /// `lsh`.
    pub shift: i32,
    /// Whether squares of indices are added up.
    pub tracks: bool,
}

/// What lanes have added up since they began to.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct TileReadings {
    on: bool,
    /// By column.
    sums: Vec<i64>,
    pub(in super::super) squares: u64,
    pub(in super::super) reads: i64,
}

impl Tile {
    /// Where a column is looked up, counted from the least entry, and whether that is an end.
    pub(super) fn balanced(&mut self, column: usize, sum: i64, half: i64) -> (usize, bool) {
        let balance = self.config.more.balance.as_ref().expect("units keep to a middle");
        let mut left = sum;
        if let Some(&threshold) = balance.thresholds.get(column) {
            left -= (threshold + 128) >> 8;
            self.events.threshold_subtractions += 1;
        }
        let steps = match balance.shift {
            0 => left,
            up @ ..0 => left << -up,
            down => (left + (1 << (down - 1))) >> down,
        };
        let place = steps.max(-half).min(half - 1);
        let readings = &mut self.readings;
        if readings.on {
            readings.reads += i64::from(column == 0);
            if !balance.thresholds.is_empty() {
                readings.sums[column] += sum;
                self.events.statistic_adds += 1;
            }
            if balance.tracks {
                readings.squares += (place * place).unsigned_abs();
                self.events.statistic_adds += 1;
            }
        }
        (usize::try_from(place + half).expect("an index"), place != steps)
    }

    /// Begins to add up, or does not in the reads that come.
    pub(in super::super) fn note(&mut self, on: bool) {
        self.readings.on = on;
        if on {
            let sums = vec![0; self.config.columns];
            self.readings = TileReadings { on, sums, ..TileReadings::default() };
        }
    }

    /// Takes what another copy has added up.
    pub(in super::super) fn take_readings(&mut self, other: &mut Self) {
        let more = std::mem::take(&mut other.readings);
        let sums = self.readings.sums.iter_mut().zip(more.sums);
        sums.for_each(|(sum, more)| *sum += more);
        self.readings.squares += more.squares;
        self.readings.reads += more.reads;
    }

    pub(in super::super) const fn readings(&self) -> &TileReadings {
        &self.readings
    }

    pub(in super::super) fn balance(&self) -> Option<&TileBalance> {
        self.config.more.balance.as_ref()
    }

    /// Whether the lanes have columns of a group.
    pub(in super::super) fn has_group(&self, group: usize) -> bool {
        !self.group(group, self.config.columns).is_empty()
    }

    /// Thresholds of a group of the lanes move, in a window of so many reads as a power of two.
    pub(in super::super) fn move_thresholds(&mut self, group: usize, window_log2: u32) {
        let columns = self.group(group, self.config.columns);
        let Some(balance) = &mut self.config.more.balance else { return };
        for column in columns {
            if let Some(threshold) = balance.thresholds.get_mut(column) {
                let off = (self.readings.sums[column] << 8) - self.readings.reads * *threshold;
                let half = (1 << window_log2) >> 1;
                *threshold += (off + half) >> window_log2;
            }
        }
    }

    /// Another step of the table; what was added up is done with.
    pub(in super::super) fn set_step(&mut self, shift: i32) {
        if let Some(balance) = &mut self.config.more.balance {
            balance.shift = shift;
        }
        self.readings.sums.fill(0);
        (self.readings.squares, self.readings.reads) = (0, 0);
    }
}
