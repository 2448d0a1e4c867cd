//! Rank-1 writes of one sample by stochastic pulse trains.
//!
//! ```text
//! T = k + log2(BL),  b = T div 2,  a = T - b                                           BL slots
//! p_row    = min( 2^16, rsh( x m 2^16, a ) ),   p_column = min( 2^16, rsh( |u| 2^16, b ) )
//! a line fires in slot s when its 16-bit word there is below p         sites 12 and 13, sub s, numbered as one column
//! pulses   of a cell: slots in which its row and its column fire; their mean is BL p_row p_column / 2^32 = x u m / 2^k
//! time     2 BL T_W: levels that rise, then levels that fall
//! ```
//!
//! Every slot fires all rows and columns of a tile at once: that is what makes it fast, and why there is nothing to
//! verify and no remainder to keep. See docs/MODEL.md, 3.9.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Engine;
use crate::chip::crossbar::ColumnTrain;
use crate::chip::ledger::{During, Event};
use crate::chip::population::{Polarity, Stream};
use crate::num::draw::{Place, Site};
use crate::num::fixed::rsh;

/// Chances of `2^16` with which a row and a column fire, given the drive times the mantissa and the gate.
pub(super) fn chances(scaled_drive: i64, gate: i64, shift: u32, slots_log2: u32) -> [u32; 2] {
    let total = shift + slots_log2;
    let column = total / 2;
    let chance = |amount: i64, by: u32| {
        u32::try_from(rsh(amount << 16, by).min(1 << 16)).expect("amounts are not negative")
    };
    [chance(scaled_drive, total - column), chance(gate.abs(), column)]
}

/// Trains of lines that fire with these chances.
fn trains(place: Place, chances: &[u32], slots: u32) -> Vec<u64> {
    let mut trains = vec![0; chances.len()];
    for slot in 0..slots {
        let place = Place { sub: slot, ..place };
        for (group, (trains, chances)) in trains.chunks_mut(32).zip(chances.chunks(32)).enumerate()
        {
            if chances.iter().all(|&chance| chance == 0) {
                continue;
            }
            let words = place.halves(0, 0, group);
            for ((train, &chance), word) in trains.iter_mut().zip(chances).zip(words) {
                *train |= u64::from(u32::from(word) < chance) << slot;
            }
        }
    }
    trains
}

impl Engine {
    /// Writes one sample into all arrays of a layer.
    pub(super) fn write_trains(
        &mut self,
        layer: usize,
        sample: usize,
        shift: u32,
        slots_log2: u32,
    ) {
        let this = &self.layers[layer];
        let (wiring, index) = (this.spec.wiring, this.index);
        let shift = shift + wiring.shift_extra();
        let slots = 1 << slots_log2;
        let [_, across] = this.tiles(&self.hardware).map(|tiles| tiles as u64);
        let mut fired = [0; 2];
        for (at, pathway) in wiring.pathways().iter().enumerate() {
            let place = |site| Place {
                seed: self.seed,
                site,
                layer: index,
                pathway: pathway.code,
                sub: 0,
                count: self.layers[layer].writes[at],
            };
            let chance = |drive: i64, gate: i64| chances(drive, gate, shift, slots_log2);
            let drives = self.sample_drives(layer, pathway.source, sample);
            let mantissa = i64::from(self.mantissas[layer]);
            let rows = drives.into_iter().map(|x| chance(i64::from(x) * mantissa, 0)[0]);
            let rows = trains(place(Site::RowTrain), &rows.collect::<Vec<_>>(), slots);
            let gates: Vec<i64> =
                self.sample_gates(layer, pathway.target, sample, pathway.polarity);
            let columns: Vec<_> = gates.iter().map(|&u| chance(0, u)[1]).collect();
            let columns = trains(place(Site::ColumnTrain), &columns, slots);
            let excites = pathway.polarity == Polarity::Excites;
            let columns: Vec<_> = columns
                .into_iter()
                .zip(gates)
                .map(|(slots, u)| ColumnTrain { slots, rises: (u > 0) == excites })
                .collect();
            let written = place(Site::RowTrain);
            let counts = self.layers[layer].arrays[at].coincide(&rows, &columns, written);
            self.layers[layer].arrays[at].end_write();
            // a row is pulsed in both phases, in every column of tiles
            let pulses: u64 = rows.iter().map(|train| u64::from(train.count_ones())).sum();
            fired[pathway.target.index()] += 2 * across * pulses;
            for (event, count) in [
                (Event::Requested, counts.requested),
                (Event::PulsesAttempted, counts.attempted),
                (Event::PulsesEffective, counts.effective),
            ] {
                self.charge(layer, pathway.code, During::Update, event, count);
            }
        }
        self.end_writes(layer);
        if let Some(timing) = self.hardware.timing {
            for &target in wiring.targets() {
                let code = Self::code_of(wiring, target);
                self.charge(layer, code, During::Update, Event::RowPulses, fired[target.index()]);
            }
            let busy = timing.trains(slots.into());
            self.time(|schedule, cycles| {
                let (now, samples) = (super::Write::Now, sample..sample + 1);
                schedule.program(cycles, layer, now, &samples, (false, busy));
            });
        }
    }

    /// Drive codes of the rows for one sample.
    fn sample_drives(&self, layer: usize, source: Stream, sample: usize) -> Vec<u8> {
        let rows = self.layers[layer].layout.rows;
        let drives = self.drives(layer, source);
        (0..rows).map(|row| drives[self.register_at(sample, row)]).collect()
    }

    /// Gates of the units for one sample, as the writes of a polarity take them.
    fn sample_gates(
        &self,
        layer: usize,
        target: Stream,
        sample: usize,
        polarity: Polarity,
    ) -> Vec<i64> {
        let stride = super::error::stride_of(self.samples);
        let gates = &self.registers[layer].gates[target.index()];
        let only = self.potentiation_only;
        let gate = |unit| {
            let gate = i64::from(gates[super::error::packed_at(stride, sample, unit)]);
            match polarity {
                Polarity::Excites if only => gate.max(0),
                Polarity::Inhibits if only => gate.min(0),
                _ => gate,
            }
        };
        (0..self.layers[layer].layout.columns).map(gate).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_multiply_to_the_increment_and_stop_at_certainty() {
        // k = 10, 4 slots: T = 12; x m = 64, u = -32: 64 x 32 / 2^12 of a slot, 4 slots: 2 = 64 x 32 / 2^10
        let [row, column] = chances(64, -32, 10, 2);
        assert_eq!((row, column), (65_536, 32_768));
        assert_eq!(chances(63, 0, 10, 2), [64_512, 0]);
        assert_eq!(chances(255, 127, 0, 0), [65_536, 65_536]);
    }

    #[test]
    fn lines_fire_as_often_as_their_chance_says() {
        let place = Place { site: Site::RowTrain, ..Place::global(1, Site::RowTrain, 0) };
        let fires = |chance| -> u32 {
            trains(place, &[chance; 2000], 64).iter().map(|train| train.count_ones()).sum()
        };
        assert_eq!((fires(0), fires(1 << 16)), (0, 128_000));
        let half = fires(1 << 15);
        assert!((63_000..65_000).contains(&half), "{half}");
    }
}
