//! What a network of tiles asks of one: state from outside, state to compare, parts at work, counts.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{BankEvents, ErrorStep, Tile, TileEvents, TileNoise, UpdKind, UpdPhase, Way};

impl Tile {
    const fn place(&self, row: usize, column: usize) -> usize {
        row * self.size.columns + column
    }

    pub(in super::super) fn load_level(
        &mut self,
        bank: usize,
        row: usize,
        column: usize,
        level: u16,
    ) {
        let at = self.place(row, column);
        if !self.stuck[bank][at] && !self.is_worn(bank, at) {
            self.level[bank][at] = self.taken(bank, at, level);
        }
        self.leaves(bank, at);
    }

    /// A cell holds this level from now on.
    pub(in super::super) fn stick(&mut self, bank: usize, row: usize, column: usize, level: u16) {
        let at = self.place(row, column);
        (self.level[bank][at], self.stuck[bank][at]) = (level, true);
    }

    /// What conversions are off by from the next read on.
    pub(in super::super) fn set_noise(&mut self, noise: Option<TileNoise>) {
        self.config.more.noise = noise;
    }

    pub(in super::super) fn restore(
        &mut self,
        bank: usize,
        row: usize,
        column: usize,
        pruned: bool,
        residual: i64,
    ) {
        let at = self.place(row, column);
        self.pruned[bank][at] = pruned;
        self.residual[bank][at] = residual;
    }

    pub(in super::super) fn load_drive(&mut self, bank: usize, slot: usize, row: usize, code: u8) {
        self.drive[bank][slot * self.size.rows + row] = code;
    }

    pub(in super::super) const fn set_learning(&mut self, mantissa: i64, potentiation_only: bool) {
        self.config.mantissa = mantissa;
        self.config.more.potentiation_only = potentiation_only;
    }

    pub(in super::super) const fn mantissa(&self) -> i64 {
        self.config.mantissa
    }

    pub(in super::super) fn set_adc_shifts(&mut self, shifts: &[u32]) {
        self.config.more.adc_shifts = shifts.to_vec();
    }

    pub(in super::super) fn level(&self, bank: usize, row: usize, column: usize) -> u16 {
        self.level[bank][self.place(row, column)]
    }

    pub(in super::super) fn is_pruned(&self, bank: usize, row: usize, column: usize) -> bool {
        let at = self.place(row, column);
        self.pruned[bank][at] && !self.is_worn(bank, at)
    }

    pub(in super::super) fn residual(&self, bank: usize, row: usize, column: usize) -> i64 {
        self.residual[bank][self.place(row, column)]
    }

    pub(in super::super) fn value(&self, slot: usize, column: usize) -> u8 {
        self.value[slot * self.size.columns + column]
    }

    /// What a stage outside made of a unit: activity and derivative.
    pub(in super::super) fn set_unit(&mut self, slot: usize, column: usize, unit: (u8, u8)) {
        let at = slot * self.size.columns + column;
        (self.value[at], self.slope[at]) = unit;
    }

    pub(in super::super) fn out(&self, column: usize) -> i64 {
        self.lines[Way::Rows as usize].out[column]
    }

    pub(in super::super) fn backward_sum(&self, row: usize) -> i64 {
        self.backward[row]
    }

    pub(in super::super) fn gates(&self, slot: usize) -> &[i64] {
        &self.gate[slot * self.size.columns..][..self.size.columns]
    }

    pub(in super::super) fn set_gates(&mut self, slot: usize, gates: &[i64]) {
        self.gate[slot * self.size.columns..][..gates.len()].copy_from_slice(gates);
    }

    /// Registers that say how to read, and by which numbers to write, are those of another copy.
    pub(in super::super) fn set_up(&mut self, first: &Self) {
        self.config.clone_from(&first.config);
    }

    /// Whether its first row is about to be computed, of a write.
    pub(in super::super) fn begins_to_write(&self) -> bool {
        let computes = self.upd.phase == UpdPhase::Compute && self.upd.kind != UpdKind::Add;
        self.upd.busy && computes && self.upd.row == 0 && self.upd.beat == 0 && !self.has_computed()
    }

    /// Begins the write that the first copy begins: what is asked of its cells is what is asked of those.
    pub(in super::super) fn write_as(&mut self, first: &Self) {
        self.set_up(first);
        self.sum.clone_from(&first.sum);
        self.kept.clone_from(&first.kept);
        self.upd.clone_from(&first.upd);
    }

    /// Takes over what lanes of another copy have looked up of a read.
    pub(in super::super) fn take_units(&mut self, other: &Self, slot: usize) {
        let read = slot * self.size.columns..(slot + 1) * self.size.columns;
        self.value[read.clone()].copy_from_slice(&other.value[read.clone()]);
        self.slope[read.clone()].copy_from_slice(&other.slope[read]);
    }

    /// Whether its cells and their remainders are those of another copy.
    pub(in super::super) fn is_like(&self, first: &Self) -> bool {
        (&self.level, &self.pruned, &self.residual)
            == (&first.level, &first.pruned, &first.residual)
    }

    /// Whether the last group of a sample was looked up in the cycle that has just ended.
    pub(in super::super) const fn looked_up(&self) -> bool {
        self.looked_up
    }

    pub(in super::super) const fn front_is_busy(&self) -> bool {
        self.front.busy
    }

    pub(in super::super) const fn errors_are_busy(&self) -> bool {
        self.err.busy
    }

    pub(in super::super) const fn update_is_busy(&self) -> bool {
        self.upd.busy
    }

    pub(in super::super) fn is_writing(&self) -> bool {
        use UpdPhase::{Gather, Gathered, Look, Wait};
        let other = matches!(self.upd.phase, Look | Wait | Gather | Gathered);
        self.upd.busy && self.upd.kind != UpdKind::Add && !other
    }

    /// Whether the sums of its cells are added to, or looked at.
    fn is_adding(&self) -> bool {
        let adds = matches!(self.upd.phase, UpdPhase::Look | UpdPhase::Gather);
        self.upd.busy && (self.upd.kind == UpdKind::Add || adds)
    }

    /// Array, converters, lanes, bus, multipliers, accumulators in the cycle that begins.
    pub(in super::super) fn at_work(&self) -> [bool; 6] {
        let front = &self.front;
        let in_slice = front.slice < self.read_slices(front.way);
        [
            front.busy && in_slice && front.phase < self.config.settle_of(front.slice),
            self.conv.busy,
            self.lane.busy,
            self.bus_wanted(),
            matches!(self.error_step(), Some(ErrorStep::Multiply { .. })),
            self.is_adding(),
        ]
    }

    /// What those parts and the writers are at, in the cycle that begins: the sample and the slice, where there are such.
    /// `None` rests.
    pub(in super::super) fn doing(&self) -> [Option<[Option<usize>; 2]>; 7] {
        let [arrays, converters, lanes, bus, multipliers, accumulators] = self.at_work();
        let sample = |slot| slot / self.config.more.positions;
        let sliced = |slot, slice: u32| [Some(sample(slot)), usize::try_from(slice).ok()];
        let (front, conv) = (&self.front, &self.conv);
        let written = (self.upd.kind == UpdKind::Now).then_some(self.upd.slot);
        let added = (self.upd.kind != UpdKind::Write).then_some(self.upd.slot);
        [
            arrays.then(|| sliced(front.slot, front.slice)),
            converters.then(|| sliced(conv.slot, conv.slice)),
            lanes.then_some([Some(sample(self.lane.slot)), None]),
            bus.then_some([Some(self.err.slot), None]),
            multipliers.then_some([Some(self.err.slot), None]),
            accumulators.then_some([added, None]),
            self.is_writing().then_some([written, None]),
        ]
    }

    /// Codes on the rail and all codes since the last call, by slice, of reads through the rows.
    pub(in super::super) fn take_rails(&mut self) -> Vec<[u64; 2]> {
        let none = vec![[0; 2]; self.rails.len()];
        std::mem::replace(&mut self.rails, none)
    }

    /// Counts since the last call.
    pub(in super::super) fn take_events(&mut self) -> ([BankEvents; 2], TileEvents) {
        (std::mem::take(&mut self.bank_events), std::mem::take(&mut self.events))
    }
}
