//! Errors and updates: taps, gates, sums, pulses. See docs/TILE.md, 4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{ErrorStep, Squares, Tile, Upd, UpdKind, UpdPhase};
use crate::chip::hardware::PulseCode;
use crate::chip::periphery;
use crate::num::fixed::{DriveBits, rsh, sat};

impl Tile {
    pub(super) fn errors(&mut self, word: i64) {
        if !self.err.busy {
            return;
        }
        self.err.beat += 1;
        if self.err.beat < self.config.more.beat {
            return;
        }
        self.err.beat = 0;
        match self.error_step().expect("it is busy") {
            ErrorStep::Wait => {}
            ErrorStep::Hear { word: k, .. } => self.hear(k, word),
            ErrorStep::Multiply { pixel, turn, group } => {
                for column in self.group(group, self.config.columns) {
                    self.multiply(pixel, turn, column);
                }
            }
        }
        self.err.count += 1;
        let [pixels, each] = self.error_turns();
        if self.err.count == self.config.hops + pixels * each {
            self.err.busy = false;
            self.err.count = 0;
        }
    }

    /// Sets of words of a sample, and the beats of each: its words, then the gates of the positions that hear them.
    fn error_turns(&self) -> [usize; 2] {
        let more = &self.config.more;
        let (pixels, positions) = match more.squares {
            Some(squares) => (squares.pixels.into_iter().product(), squares.size()),
            None => (1, more.positions),
        };
        [pixels, self.config.words + positions * self.groups(self.config.columns)]
    }

    /// What the error unit does in the beat that its count stands for; `None` rests.
    pub(super) fn error_step(&self) -> Option<ErrorStep> {
        if !self.err.busy {
            return None;
        }
        let Some(count) = self.err.count.checked_sub(self.config.hops) else {
            return Some(ErrorStep::Wait);
        };
        let [_, each] = self.error_turns();
        let (pixel, count) = (count / each, count % each);
        let Some(turn) = count.checked_sub(self.config.words) else {
            return Some(ErrorStep::Hear { pixel, word: count });
        };
        let groups = self.groups(self.config.columns);
        Some(ErrorStep::Multiply { pixel, turn: turn / groups, group: turn % groups })
    }

    /// Columns whose tap is word `k` latch it.
    fn hear(&mut self, k: usize, word: i64) {
        self.events.bus_words += 1;
        for column in 0..self.config.columns {
            if let Some(taps) = self.config.more.taps.get(column) {
                let times = taps.iter().filter(|&&tap| tap == k).count();
                self.heard[column] += word * i64::try_from(times).expect("few taps");
            } else if (column + self.config.tap_base) % self.config.words == k {
                self.error[column] = if self.config.negate { -word } else { word };
            }
        }
    }

    /// The gate of a column at one of the positions that hear its word, which is latched at the first.
    fn multiply(&mut self, pixel: usize, turn: usize, column: usize) {
        let bits = self.config.error_bits;
        let taps = self.config.more.taps.get(column);
        if let (Some(taps), 0) = (taps, turn) {
            let mut word = self.heard[column];
            if taps.len() > 1 {
                let (bounded, changed) = sat(rsh(word, self.config.more.tap_shift), bits);
                self.events.saturated_errors += u64::from(changed);
                word = bounded;
            }
            self.error[column] = if self.config.negate { -word } else { word };
            // the next pixel has words of its own
            self.heard[column] = 0;
        }
        let first = self.err.slot * self.config.more.positions;
        let (position, hears) = match self.config.more.squares {
            Some(squares) => {
                let hears = squares.greatest.is_none_or(|bits| {
                    self.greatest(squares, bits, (first, pixel), column) == turn
                });
                (squares.position(pixel, turn), hears)
            }
            None => (turn, true),
        };
        let at = (first + position) * self.size.columns + column;
        let slope = self.slope[at];
        let word = if hears { self.error[column] } else { 0 };
        let (u, saturated) = sat(rsh(word * i64::from(slope), bits), 8);
        self.gate[at] = u;
        self.events.multiplies += 1;
        self.events.saturated_gates += u64::from(saturated);
    }

    /// The place in the square of a pixel whose code was the greatest: the first of several.
    fn greatest(
        &self,
        squares: Squares,
        bits: DriveBits,
        (first, pixel): (usize, usize),
        column: usize,
    ) -> usize {
        let code = |at: usize| {
            let read = first + squares.position(pixel, at);
            periphery::drive(self.value[read * self.size.columns + column], bits)
        };
        let mut best = 0;
        for at in 1..squares.size() {
            if code(at) > code(best) {
                best = at;
            }
        }
        best
    }

    pub(super) fn updates(&mut self, dither: [&[u16]; 2]) {
        if !self.upd.busy {
            return;
        }
        if let Some(slots) = self.config.more.train_slots {
            return self.trains(slots);
        }
        match (self.upd.kind, self.upd.phase) {
            (UpdKind::Add, _) | (_, UpdPhase::Gather) => {
                if self.beat_is_over() {
                    self.add();
                }
            }
            (_, UpdPhase::Look) => {
                if self.beat_is_over() {
                    self.look();
                }
            }
            (_, UpdPhase::Wait | UpdPhase::Gathered) => {}
            (_, UpdPhase::Compute) => {
                if self.beat_is_over() && self.computed() {
                    self.compute(dither);
                }
            }
            (_, UpdPhase::Set | UpdPhase::Reset) => self.pulses(),
            (_, UpdPhase::Turn) => {
                if self.beat_is_over() {
                    self.turn_around();
                }
            }
        }
    }

    const fn beat_is_over(&mut self) -> bool {
        self.upd.beat += 1;
        let over = self.upd.beat == self.config.more.beat;
        if over {
            self.upd.beat = 0;
        }
        over
    }

    /// Products of a cell for a sample.
    pub(super) const fn products(&self) -> usize {
        self.config.more.positions * self.config.more.phases
    }

    /// The driving of the rows whose products are formed, and whether it lies below 0.
    pub(super) const fn learnt_drive(&self) -> (usize, bool) {
        let below = !self.upd.position.is_multiple_of(self.config.more.phases);
        (self.upd.slot * self.products() + self.upd.position, below)
    }

    /// The read whose gates they are formed with.
    const fn learnt(&self) -> usize {
        self.upd.slot * self.config.more.positions + self.upd.position / self.config.more.phases
    }

    /// The product of a row's drive and a column's gate as a bank takes it.
    pub(super) fn outer(&self, bank: usize, column: usize) -> i64 {
        let (driving, below) = self.learnt_drive();
        let drive = i64::from(self.drive[bank][driving * self.size.rows + self.upd.row]);
        if below {
            -drive * self.signed_gate(bank, column)
        } else {
            drive * self.signed_gate(bank, column)
        }
    }

    /// A column's gate as a bank takes it.
    pub(super) fn signed_gate(&self, bank: usize, column: usize) -> i64 {
        let gate = self.gate[self.learnt() * self.size.columns + column];
        let only = self.config.more.potentiation_only;
        match bank {
            0 if only => gate.max(0),
            0 => gate,
            _ if only => -gate.min(0),
            _ => -gate,
        }
    }

    fn add(&mut self) {
        self.add_lines();
        for column in self.group(self.upd.group, self.config.columns) {
            for bank in 0..2 {
                let product = self.outer(bank, column);
                self.sum[bank][self.upd.row * self.size.columns + column] += product;
                self.bank_events[bank].accumulates += 1;
            }
        }
        self.upd.group += 1;
        if self.upd.group < self.groups(self.config.columns) {
            return;
        }
        self.upd.group = 0;
        self.upd.row += 1;
        if self.upd.row < self.config.rows {
            return;
        }
        self.upd.row = 0;
        self.upd.position += 1;
        if self.upd.position < self.products() {
            return;
        }
        let Upd { kind, slot, shift, .. } = self.upd;
        self.upd = Upd { kind, slot, shift, ..Upd::default() };
        if kind == UpdKind::Now {
            (self.upd.busy, self.upd.phase) = (true, UpdPhase::Gathered);
        }
    }

    fn next_row(&mut self) {
        self.upd.row += 1;
        if self.upd.row == self.config.rows {
            let Upd { kind, slot, shift, .. } = self.upd;
            self.upd = Upd { kind, slot, shift, ..Upd::default() };
        }
    }

    /// Rounds and bounds a row.
    fn compute(&mut self, dither: [&[u16]; 2]) {
        self.peak_set = 0;
        self.peak_reset = 0;
        for (bank, draws) in dither.into_iter().enumerate() {
            for column in 0..self.config.columns {
                let at = self.upd.row * self.size.columns + column;
                let sum = match self.upd.kind {
                    UpdKind::Now if self.products() == 1 => {
                        self.bank_events[bank].accumulates += 1;
                        self.outer(bank, column)
                    }
                    _ => {
                        let sum = self.asking(bank, self.upd.row, column);
                        self.sum[bank][at] = 0;
                        sum
                    }
                };
                let word = draws.get(column).copied().unwrap_or(0);
                let pulses = if self.config.more.sign {
                    self.towards(bank, sum, word)
                } else {
                    let request = self.request(bank, at, sum);
                    self.bounded(bank, at, request, word)
                };
                let pulses = self.slots(pulses);
                self.pulse[bank][column] = pulses;
                self.peak_set = self.peak_set.max(pulses);
                self.peak_reset = self.peak_reset.max(-pulses);
            }
        }
        self.upd.phase = if self.peak_set > 0 {
            UpdPhase::Set
        } else if self.peak_reset > 0 {
            UpdPhase::Reset
        } else {
            UpdPhase::Turn
        };
    }

    /// Bounded pulses of a cell, with its remainder if it has one.
    fn bounded(&mut self, bank: usize, at: usize, total: i64, word: u16) -> i64 {
        let max = self.config.increment_max;
        let fraction = self.config.more.residual_bits;
        let rounded = self.rounded(total, word, fraction);
        let (asked, pulses);
        if fraction == 0 {
            asked = rounded;
            pulses = asked.clamp(-max, max);
        } else {
            // level and remainder are clamped as one number: docs/MODEL.md, 8
            let sum = self.residual[bank][at] + rounded;
            asked = sum >> fraction;
            pulses = asked.clamp(-max, max);
            let level = i64::from(self.level[bank][at]);
            let rest = (1 << fraction) - 1;
            let wanted = level + pulses;
            let left = sum - (pulses << fraction);
            // of cells that are not ideal the last pulse says
            let ideal = self.device.is_none();
            self.residual[bank][at] = if ideal && wanted < i64::from(self.config.floor) {
                0
            } else if ideal && wanted > i64::from(self.config.ceiling) {
                rest
            } else {
                left.clamp(0, rest)
            };
        }
        let events = &mut self.bank_events[bank];
        events.delta_computations += 1;
        events.requested += u64::from(asked != 0);
        events.bounded += u64::from(asked != pulses);
        pulses
    }

    /// `SR(total, k)`, `F` bits finer.
    fn rounded(&self, total: i64, word: u16, fraction: u32) -> i64 {
        let dither = self.config.dither_bits;
        let shift = i64::from(self.request_shift() + self.config.more.shift_extra);
        let shift = shift - i64::from(fraction) - i64::from(dither);
        let q = match u32::try_from(shift) {
            Ok(right) => rsh(total, right),
            Err(_) => total << shift.unsigned_abs(),
        };
        let mask = (1i64 << dither) - 1;
        (q + (i64::from(word) & mask)) >> dither
    }

    /// One cycle of the pulses of a polarity.
    fn pulses(&mut self) {
        let verify = self.config.more.verify;
        let reading = if verify { self.config.settle + self.config.conversion() } else { 0 };
        self.upd.count += 1;
        if self.upd.count < self.config.pulse + reading {
            return;
        }
        self.upd.count = 0;
        let set = self.upd.phase == UpdPhase::Set;
        let active = self.active(set);
        let together = self.config.more.active_max.unwrap_or(usize::MAX);
        let first = self.upd.pass * together;
        for &(bank, column) in active.iter().skip(first).take(together) {
            if self.has_arrived(bank, column) {
                continue;
            }
            let by = match self.config.more.pulse_code {
                PulseCode::Unary => 1,
                PulseCode::Amplitude => self.pulse[bank][column].abs(),
            };
            self.move_cell(bank, column, if set { by } else { -by });
        }
        self.events.row_pulses += 1;
        self.upd.pass += 1;
        if active.len() > self.upd.pass.saturating_mul(together) {
            return;
        }
        self.upd.pass = 0;
        self.upd.pulse += 1;
        let peak = if set { self.peak_set } else { self.peak_reset };
        let last = match self.config.more.pulse_code {
            PulseCode::Unary => self.upd.pulse == peak,
            PulseCode::Amplitude => true,
        };
        if last {
            self.upd.pulse = 0;
            self.upd.phase =
                if set && self.peak_reset > 0 { UpdPhase::Reset } else { UpdPhase::Turn };
        }
    }

    /// Cells of the row that get the pulse in progress, bank after bank.
    fn active(&self, set: bool) -> Vec<(usize, usize)> {
        let wanted = |bank: usize, column: usize| {
            let pulses = self.pulse[bank][column];
            (if set { pulses } else { -pulses }) > self.upd.pulse
        };
        let columns = self.config.columns;
        let cells = (0..2).flat_map(|bank| (0..columns).map(move |column| (bank, column)));
        cells.filter(|&(bank, column)| wanted(bank, column)).collect()
    }

    /// A pulse of a cell: one level, or as many as its amplitude says.
    pub(super) fn move_cell(&mut self, bank: usize, column: usize, by: i64) {
        if self.answers(bank, column, by > 0) {
            return;
        }
        let at = self.upd.row * self.size.columns + column;
        let before = i64::from(self.level[bank][at]);
        let (floor, ceiling) = (i64::from(self.config.floor), i64::from(self.config.ceiling));
        let wanted = if by > 0 { (before + by).min(ceiling) } else { (before + by).max(floor) };
        let still = self.pruned[bank][at] || self.stuck[bank][at];
        let after = if still { before } else { wanted };
        self.level[bank][at] = u16::try_from(after).expect("inside the window");
        let events = &mut self.bank_events[bank];
        events.pulses_attempted += by.unsigned_abs();
        events.pulses_effective += (after - before).unsigned_abs();
        events.verify_reads += u64::from(self.config.more.verify);
    }

    fn turn_around(&mut self) {
        if self.config.absorbing {
            for bank in 0..2 {
                for column in 0..self.config.columns {
                    let at = self.upd.row * self.size.columns + column;
                    let rests = i64::from(self.level[bank][at]) == self.ends(bank, at)[0];
                    let rests = rests && !self.stuck[bank][at];
                    if rests && self.pulse[bank][column] != 0 {
                        self.pruned[bank][at] = true;
                    }
                }
            }
        }
        let first = self.upd.row * self.size.columns;
        self.forget_pulses(first..first + self.size.columns);
        self.upd.phase = UpdPhase::Compute;
        self.next_row();
    }
}
