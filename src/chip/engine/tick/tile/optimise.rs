//! What optimisers and centred updates need of a tile: a pass over its sums, sums of lines, one pulse by chance.
//!
//! Lines are added up in the beats of `UPD(add)`: a column's gate with the first row, a row's code with the first group of
//! columns. Only in networks. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Tile, UpdPhase};

/// Registers beside the sums of the cells.
#[derive(Debug, Clone, Default)]
pub(super) struct Kept {
    /// Squares of the sums looked at so far.
    squares: i128,
    /// Least size of a sum that is asked for a pulse.
    least: i64,
    /// Mean codes of the rows, by bank.
    mean: [Vec<i64>; 2],
    /// Codes of the rows and gates of the columns, by bank, over the samples added: gates as the bank takes them.
    codes: [Vec<i64>; 2],
    gates: [Vec<i64>; 2],
}

impl Kept {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        let two = |count: usize| [vec![0; count], vec![0; count]];
        Self { least: 1, mean: two(rows), codes: two(rows), gates: two(columns), squares: 0 }
    }
}

impl Tile {
    /// Adds a sample's lines of the group and row in progress.
    pub(super) fn add_lines(&mut self) {
        let (row, group) = (self.upd.row, self.upd.group);
        for bank in 0..2 {
            if row == 0 {
                for column in self.group(group, self.config.columns) {
                    self.kept.gates[bank][column] += self.signed_gate(bank, column);
                }
            }
            if group == 0 {
                let code = self.drive[bank][self.upd.slot * self.size.rows + row];
                self.kept.codes[bank][row] += i64::from(code);
            }
        }
    }

    /// What a request is made of: the sum of a cell, without the mean of its row.
    pub(super) fn asking(&self, bank: usize, row: usize, column: usize) -> i64 {
        let sum = self.sum[bank][row * self.size.columns + column];
        let fraction = self.config.more.centred;
        fraction.map_or(sum, |bits| {
            (sum << bits) - self.kept.mean[bank][row] * self.kept.gates[bank][column]
        })
    }

    /// A beat of the look at all sums.
    pub(super) fn look(&mut self) {
        for column in self.group(self.upd.group, self.config.columns) {
            for bank in 0..2 {
                let sum = i128::from(self.asking(bank, self.upd.row, column));
                self.kept.squares += sum * sum;
                self.bank_events[bank].sum_squares += 1;
            }
        }
        self.upd.group += 1;
        if self.upd.group < self.groups(self.config.columns) {
            return;
        }
        self.upd.group = 0;
        self.upd.row += 1;
        if self.upd.row == self.config.rows {
            self.upd.row = 0;
            self.upd.phase = UpdPhase::Wait;
        }
    }

    /// A pulse towards a sum, if it is great enough and the word says so.
    pub(super) fn towards(&mut self, bank: usize, sum: i64, word: u16) -> i64 {
        let shift = self.upd.shift + self.config.more.shift_extra;
        let lucky = shift <= 16 && u64::from(word) << shift < 1 << 16;
        let pulse = if lucky && sum.abs() >= self.kept.least { sum.signum() } else { 0 };
        let events = &mut self.bank_events[bank];
        events.delta_computations += 1;
        events.optimiser_steps += 1;
        events.requested += pulse.unsigned_abs();
        pulse
    }

    /// Whether the tile waits for the sums of others.
    pub(in super::super) fn waits(&self) -> bool {
        self.upd.busy && self.upd.phase == UpdPhase::Wait
    }

    /// Squares of all its sums.
    pub(in super::super) const fn squares(&self) -> i128 {
        self.kept.squares
    }

    /// The write goes on, with pulses for sums of at least that size.
    pub(in super::super) const fn go_on(&mut self, least: i64) {
        self.kept.least = least;
        self.kept.squares = 0;
        self.upd.phase = UpdPhase::Compute;
    }

    pub(in super::super) fn set_mean(&mut self, bank: usize, row: usize, mean: i64) {
        self.kept.mean[bank][row] = mean;
    }

    /// Codes of a row over the samples added.
    pub(in super::super) fn codes(&self, bank: usize, row: usize) -> i64 {
        self.kept.codes[bank][row]
    }

    /// Sums of lines begin anew.
    pub(in super::super) fn clear_lines(&mut self) {
        let lines = self.kept.codes.iter_mut().chain(&mut self.kept.gates);
        lines.for_each(|line| line.fill(0));
    }
}
