//! All registers of docs/TILE.md, in its order: what RTL and this tile are compared by.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::{Tile, UpdKind, UpdPhase};

/// Bank counters of the page, used and unused.
const BANK_COUNTERS: usize = 15;

fn wide<T: Copy + Into<i64>>(numbers: &[T], most: usize) -> Vec<i64> {
    if numbers.len() > most {
        return vec![];
    }
    numbers.iter().map(|&number| number.into()).collect()
}

fn count(number: u64) -> i64 {
    i64::try_from(number).expect("counts stay far below 2^63")
}

fn place(number: usize) -> i64 {
    i64::try_from(number).expect("sizes are small")
}

impl Tile {
    /// Name and numbers of every register, arrays row by row, bank e before bank i.
    #[must_use]
    pub fn registers(&self) -> Vec<(&'static str, Vec<i64>)> {
        self.registers_within(usize::MAX)
    }

    /// The same, but registers of more numbers than `most` are given empty.
    #[must_use]
    pub fn registers_within(&self, most: usize) -> Vec<(&'static str, Vec<i64>)> {
        let (front, conv, lane) = (&self.front, &self.conv, &self.lane);
        let (err, upd) = (&self.err, &self.upd);
        let [e, i] = &self.lines[0].hold;
        let tree =
            |of: &dyn Fn(&super::TreeStage) -> Vec<i64>| self.tree.iter().flat_map(of).collect();
        let kind = match upd.kind {
            UpdKind::Now => 0,
            UpdKind::Add => 1,
            UpdKind::Write => 2,
        };
        let phase = match upd.phase {
            UpdPhase::Compute => 0,
            UpdPhase::Set => 1,
            UpdPhase::Reset => 2,
            UpdPhase::Turn => 3,
            // only in networks
            UpdPhase::Look => 4,
            UpdPhase::Wait => 5,
            UpdPhase::Gather => 6,
            UpdPhase::Gathered => 7,
        };
        vec![
            ("level_e", wide(&self.level[0], most)),
            ("level_i", wide(&self.level[1], most)),
            ("pruned_e", wide(&self.pruned[0], most)),
            ("pruned_i", wide(&self.pruned[1], most)),
            ("drive_e", wide(&self.drive[0], most)),
            ("drive_i", wide(&self.drive[1], most)),
            ("hold_e", e.clone()),
            ("hold_i", i.clone()),
            ("acc", self.lines[0].acc.clone()),
            ("tree", tree(&|stage| stage.sums.clone())),
            ("tree_valid", tree(&|stage| vec![stage.valid.into()])),
            ("tree_slot", tree(&|stage| vec![place(stage.slot)])),
            ("out", self.lines[0].out.clone()),
            ("value", wide(&self.value, most)),
            ("slope", wide(&self.slope, most)),
            ("error", self.error.clone()),
            ("gate", wide(&self.gate, most)),
            ("sum_e", wide(&self.sum[0], most)),
            ("sum_i", wide(&self.sum[1], most)),
            ("pulse_e", self.pulse[0].clone()),
            ("pulse_i", self.pulse[1].clone()),
            ("peak_set", vec![self.peak_set]),
            ("peak_reset", vec![self.peak_reset]),
            ("front_busy", vec![front.busy.into()]),
            ("front_slice", vec![front.slice.into()]),
            ("front_phase", vec![count(front.phase)]),
            ("front_slot", vec![place(front.slot)]),
            ("conv_busy", vec![conv.busy.into()]),
            ("conv_slice", vec![conv.slice.into()]),
            ("conv_step", vec![place(conv.step)]),
            ("conv_count", vec![count(conv.count)]),
            ("conv_slot", vec![place(conv.slot)]),
            ("lane_busy", vec![lane.busy.into()]),
            ("lane_group", vec![place(lane.group)]),
            ("lane_slot", vec![place(lane.slot)]),
            ("err_busy", vec![err.busy.into()]),
            ("err_count", vec![place(err.count)]),
            ("err_slot", vec![place(err.slot)]),
            ("upd_busy", vec![upd.busy.into()]),
            ("upd_kind", vec![kind]),
            ("upd_row", vec![place(upd.row)]),
            ("upd_group", vec![place(upd.group)]),
            ("upd_phase", vec![phase]),
            ("upd_pulse", vec![upd.pulse]),
            ("upd_count", vec![count(upd.count)]),
            ("upd_slot", vec![place(upd.slot)]),
            ("upd_shift", vec![upd.shift.into()]),
            ("events_e", self.bank_counters(0)),
            ("events_i", self.bank_counters(1)),
            ("events", self.counters()),
        ]
    }

    fn bank_counters(&self, bank: usize) -> Vec<i64> {
        let e = &self.bank_events[bank];
        let mut counters = [
            e.cell_loads,
            e.dac_slices,
            e.cell_reads,
            e.holds,
            e.conversions,
            e.shift_adds,
            e.accumulates,
            e.delta_computations,
            e.requested,
            e.bounded,
            e.pulses_attempted,
            e.pulses_effective,
            e.saturated_conversions,
        ]
        .map(count)
        .to_vec();
        counters.resize(BANK_COUNTERS, 0);
        counters
    }

    fn counters(&self) -> Vec<i64> {
        let e = &self.events;
        [
            e.look_ups,
            e.saturated_look_ups,
            e.bus_words,
            e.multiplies,
            e.saturated_gates,
            e.row_pulses,
        ]
        .map(count)
        .to_vec()
    }
}
