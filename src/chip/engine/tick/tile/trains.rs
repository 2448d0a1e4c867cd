//! Rank-1 writes: all rows and columns fire in every slot, first to raise levels, then to lower them.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Tile, UpdPhase};

impl Tile {
    /// The slot that ends in this cycle, if one does: lines fire then.
    pub(in super::super) fn slot_ends(&self) -> Option<u32> {
        let slots = self.config.more.train_slots?;
        let ends = self.upd.busy && self.upd.count + 1 == self.config.pulse;
        let slot = u64::try_from(self.upd.pulse).expect("counted from 0");
        assert!(slot < slots, "a phase has its slots");
        ends.then(|| u32::try_from(slot).expect("few slots"))
    }

    /// Which rows and columns of a bank fire in the slot that ends.
    pub(in super::super) fn fire(&mut self, bank: usize, rows: Vec<bool>, columns: Vec<bool>) {
        self.firing[bank] = (rows, columns);
    }

    /// k and sample of the write in progress.
    pub(in super::super) const fn writing(&self) -> (u32, usize) {
        (self.upd.shift, self.upd.slot)
    }

    pub(in super::super) fn drive(&self, bank: usize, slot: usize, row: usize) -> u8 {
        self.drive[bank][slot * self.size.rows + row]
    }

    /// A gate as a bank takes it.
    pub(in super::super) fn bank_gate(&self, bank: usize, slot: usize, column: usize) -> i64 {
        let gate = self.gate[slot * self.size.columns + column];
        match bank {
            _ if !self.config.more.potentiation_only => gate,
            0 => gate.max(0),
            _ => gate.min(0),
        }
    }

    /// One cycle of a write by trains.
    pub(super) fn trains(&mut self, slots: u64) {
        self.upd.count += 1;
        if self.upd.count < self.config.pulse {
            return;
        }
        self.upd.count = 0;
        let set = self.upd.phase == UpdPhase::Set;
        for bank in 0..2 {
            let (rows, columns) = std::mem::take(&mut self.firing[bank]);
            for row in (0..self.config.rows).filter(|&row| rows[row]) {
                self.events.row_pulses += 1;
                for column in (0..self.config.columns).filter(|&column| columns[column]) {
                    let gate = self.bank_gate(bank, self.upd.slot, column);
                    let rises = (gate > 0) == (bank == 0);
                    if rises == set {
                        self.upd.row = row;
                        self.move_cell(bank, column, if set { 1 } else { -1 });
                        let at = row * self.size.columns + column;
                        self.bank_events[bank].requested += u64::from(!self.trained[bank][at]);
                        self.trained[bank][at] = true;
                    }
                }
            }
        }
        self.upd.row = 0;
        self.upd.pulse += 1;
        if self.upd.pulse.unsigned_abs() < slots {
            return;
        }
        self.upd.pulse = 0;
        if set {
            self.upd.phase = UpdPhase::Reset;
        } else {
            self.settle_floor();
            self.upd = super::Upd::default();
        }
    }

    /// With an absorbing floor, cells that were pulsed and lie on it stay there.
    fn settle_floor(&mut self) {
        for bank in 0..2 {
            for at in 0..self.trained[bank].len() {
                let pulsed = std::mem::take(&mut self.trained[bank][at]);
                let rests = i64::from(self.level[bank][at]) == self.ends(bank, at)[0];
                let rests = rests && !self.stuck[bank][at];
                self.pruned[bank][at] |= self.config.absorbing && pulsed && rests;
            }
        }
        self.forget_pulses(0..self.trained[0].len());
    }
}
