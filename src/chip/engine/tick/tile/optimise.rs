//! What optimisers and centred updates need of a tile: a pass over its sums, sums of lines, one pulse by chance.
//!
//! Lines are added up in the beats of `UPD(add)`: a column's gate with the first row, a row's code with the first group of
//! columns. Only in networks. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Tile, UpdPhase};
use crate::num::fixed::rsh;

/// What a look at all sums of a layer gives.
#[derive(Debug, Clone, Copy)]
pub(in super::super) enum Said {
    /// The least size of a sum that is asked for a pulse.
    Least(i64),
    /// Mantissa and shift.
    Scale(i64, u32),
    /// That there are none.
    Nothing,
}

/// Registers beside the sums of the cells.
#[derive(Debug, Clone)]
pub(super) struct Kept {
    /// Squares of the sums looked at so far.
    squares: i128,
    /// What the layer said of its sums.
    said: Said,
    /// Beats of the row that have passed.
    beats: u64,
    /// Words of the cells, first and second, by bank.
    words: [[Vec<i64>; 2]; 2],
    /// Whether words begin with this write.
    begins: bool,
    /// Mean codes of the rows, by bank.
    mean: [Vec<i64>; 2],
    /// Codes of the rows and gates of the columns, by bank, over the samples added: gates as the bank takes them.
    codes: [Vec<i64>; 2],
    gates: [Vec<i64>; 2],
}

impl Kept {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        let two = |count: usize| [vec![0; count], vec![0; count]];
        Self {
            squares: 0,
            said: Said::Least(1),
            beats: 0,
            words: [two(rows * columns), two(rows * columns)],
            begins: false,
            mean: two(rows),
            codes: two(rows),
            gates: two(columns),
        }
    }
}

impl Tile {
    /// Adds a sample's lines of the group and row in progress.
    pub(super) fn add_lines(&mut self) {
        let (row, group) = (self.upd.row, self.upd.group);
        let (driving, below) = self.learnt_drive();
        for bank in 0..2 {
            // a gate is added once, with what is above 0
            if row == 0 && !below {
                for column in self.group(group, self.config.columns) {
                    self.kept.gates[bank][column] += self.signed_gate(bank, column);
                }
            }
            if group == 0 {
                let code = i64::from(self.drive[bank][driving * self.size.rows + row]);
                self.kept.codes[bank][row] += if below { -code } else { code };
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
                if !self.config.more.looks.is_some_and(|looks| looks[bank]) {
                    continue;
                }
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
        let least = if let Said::Least(least) = self.kept.said { least } else { 1 };
        let pulse = if lucky && sum.abs() >= least { sum.signum() } else { 0 };
        let events = &mut self.bank_events[bank];
        events.delta_computations += 1;
        events.optimiser_steps += 1;
        events.requested += pulse.unsigned_abs();
        pulse
    }

    /// Whether beats of the row in progress have passed.
    pub(super) const fn has_computed(&self) -> bool {
        self.kept.beats > 0
    }

    /// Whether the beats that a row takes to be computed are over, with the one that has just ended.
    pub(super) const fn computed(&mut self) -> bool {
        self.kept.beats += 1;
        let over = self.kept.beats > self.config.more.beats;
        if over {
            self.kept.beats = 0;
        }
        over
    }

    /// Bits by which a request is finer than a pulse.
    pub(super) fn request_shift(&self) -> u32 {
        let fraction = self.config.more.centred.unwrap_or(0);
        match (self.kept.said, self.config.more.momentum) {
            (Said::Scale(_, shift), _) => shift,
            (_, Some(decay)) => self.upd.shift + fraction + decay,
            _ if self.config.more.adam.is_some() => self.upd.shift,
            _ => self.upd.shift + fraction,
        }
    }

    /// What a cell asks for, scaled by the mantissa.
    pub(super) fn request(&mut self, bank: usize, at: usize, sum: i64) -> i64 {
        let more = &self.config.more;
        let [first, second] = &mut self.kept.words[bank];
        let (first, second) = (&mut first[at], &mut second[at]);
        // words know nothing of polarity
        let polarity = if bank == 0 { 1 } else { -1 };
        let raw = polarity * sum;
        let other = more.momentum.is_some() || more.adam.is_some() || more.looks.is_some();
        self.bank_events[bank].optimiser_steps += u64::from(other);
        if let Some(decay) = more.momentum {
            *first = *first - rsh(*first, decay) + raw;
            return polarity * *first * self.config.mantissa;
        }
        if let Some([a, b]) = more.adam {
            let s = rsh(raw, more.centred.unwrap_or(0));
            *first = if self.kept.begins { s << a } else { *first + s - rsh(*first, a) };
            *second =
                if self.kept.begins { (s * s) << b } else { *second + s * s - (*second >> b) };
            // the greatest root whose square is no more, bit by bit
            let mut root = 0i64;
            for bit in (0..31).rev() {
                let more = root | 1 << bit;
                root = if more * more <= *second >> b { more } else { root };
            }
            let unit = i128::from(root.max(1)) << a;
            let ratio = ((i128::from(*first) << 13) + unit).div_euclid(2 * unit);
            let held = ratio.clamp(-32767, 32767);
            return polarity * i64::try_from(held).expect("16 bits") * self.config.mantissa;
        }
        match self.kept.said {
            Said::Scale(mantissa, _) => sum * mantissa,
            Said::Nothing => 0,
            Said::Least(_) => sum * self.config.mantissa,
        }
    }

    /// Whether the tile waits for the sums of others.
    pub(in super::super) fn waits(&self) -> bool {
        self.upd.busy && self.upd.phase == UpdPhase::Wait
    }

    /// Squares of all its sums.
    pub(in super::super) const fn squares(&self) -> i128 {
        self.kept.squares
    }

    /// The write goes on.
    pub(in super::super) const fn go_on(&mut self, said: Said) {
        self.kept.said = said;
        self.kept.squares = 0;
        self.upd.phase = UpdPhase::Compute;
    }

    /// Whether the products of its reads are added up, and it waits for those of others.
    pub(in super::super) fn has_gathered(&self) -> bool {
        self.upd.busy && self.upd.phase == UpdPhase::Gathered
    }

    /// What was added up is written.
    pub(in super::super) const fn write_gathered(&mut self) {
        self.upd.phase = UpdPhase::Compute;
    }

    /// Whether words of cells begin with the write that comes.
    pub(in super::super) const fn begin(&mut self, begins: bool) {
        self.kept.begins = begins;
    }

    /// A word of a cell.
    pub(in super::super) fn word(
        &self,
        word: usize,
        bank: usize,
        row: usize,
        column: usize,
    ) -> i64 {
        self.kept.words[bank][word][row * self.size.columns + column]
    }

    pub(in super::super) fn set_word(
        &mut self,
        word: usize,
        (bank, row, column): (usize, usize, usize),
        value: i64,
    ) {
        self.kept.words[bank][word][row * self.size.columns + column] = value;
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
