//! Units that keep to a middle of their own: what a read takes off their accumulators, what it learns from them, and how that
//! moves after the writes. The laws are those of `chip::layer::homeostasis`.
//!
//! ```text
//! counted     a threshold subtraction a unit a read;  of training and calibration a sum a unit a read with thresholds, and
//!             another, of squares, where a gain is learnt;  sums are read and stored again, 64 bits a unit each, when they move
//! moved       after the writes of a batch, or of a sample that is written on its own:  beat NG, layers side by side
//! calibrated  layer by layer upward, once the converters of a layer have their ranges: thresholds, then the step, then the
//!             variance, each by another read of the first training samples as the chip reads them
//! ```
//!
//! See docs/MODEL.md, 2.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

#[cfg(test)]
mod tests;

use super::read::{Mode, Reader, Seen};
use super::{BLOCK_ROWS, Engine, Phase};
use crate::chip::crossbar::kernel::{Kernel, LookUp, MiddleOf, OFFSET_MAX};
use crate::chip::crossbar::layout::PANEL_COLUMNS;
use crate::chip::layer::{Gain, Layer, Readings};
use crate::chip::ledger::{During, Event};
use crate::chip::periphery;
use crate::chip::population::Stream;

/// Memory bits of a sum of accumulators that is fetched and stored again.
const SUM_BITS: u64 = 2 * 64;

/// What a read learns beside what it puts out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Notes {
    /// Sums of accumulators.
    sums: bool,
    /// Squares of what is left beside thresholds.
    deviations: bool,
    /// Squares of indices.
    squares: bool,
}

/// What a stream was seen to come to.
#[derive(Debug, Clone, Default)]
pub(super) struct Noted {
    /// Sums of accumulators by unit, padded to whole blocks; empty where nobody learns them.
    sums: Vec<i64>,
    deviations: u128,
    squares: u64,
}

impl Noted {
    pub(super) fn merge(&mut self, other: Self) {
        if self.sums.len() < other.sums.len() {
            self.sums.resize(other.sums.len(), 0);
        }
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, more)| *sum += more);
        self.deviations += other.deviations;
        self.squares += other.squares;
    }
}

/// What the units of a stream do before their table, in one read.
pub(super) struct Middle {
    notes: Notes,
    /// Taken off accumulators, by unit, padded to whole blocks.
    offsets: Vec<i64>,
    /// The same where every difference fits 32 bits, raised or not.
    narrow: Vec<i32>,
    /// Bits that differences are shifted to the left.
    raise: u32,
    /// Entries of half a table.
    half: i64,
}

impl Middle {
    /// That of a layer; `None` where units have but a table.
    pub(super) fn of(
        layer: &Layer,
        target: Stream,
        reader: &Reader<'_>,
        notes: Notes,
    ) -> Option<Self> {
        let balance = &layer.balance;
        if !balance.law().is_on() {
            return None;
        }
        let padded = layer.spec.units.next_multiple_of(BLOCK_ROWS);
        let offsets: Vec<_> = (0..padded).map(|unit| balance.offset(target, unit)).collect();
        let raise = u32::try_from(-balance.shift()).unwrap_or(0);
        let most = OFFSET_MAX >> raise;
        let fits = reader.is_below(most)
            && !notes.deviations
            && balance.shift() <= 30
            && offsets.iter().all(|offset| offset.unsigned_abs() < u64::from(most));
        let narrow = if fits {
            let fit = |&offset| i32::try_from(offset).expect("below 2^30");
            offsets.iter().map(fit).collect()
        } else {
            vec![]
        };
        let half = 1 << (layer.lut.activity.len().ilog2() - 1);
        Some(Self { notes, offsets, narrow, raise, half })
    }

    /// Whether differences fit 32 bits where accumulators do.
    pub(super) const fn is_narrow(&self) -> bool {
        !self.narrow.is_empty()
    }

    /// Takes thresholds off the accumulators of a panel, `[sample][32]`, looks up what is left and notes what it is to note. The
    /// accumulators are not used any more.
    pub(super) fn put_out(
        &self,
        kernel: &Kernel,
        (panel, live): (usize, usize),
        (table, sums): (&LookUp, &mut [i32]),
        out: (&mut [u8], &mut [u8]),
        seen: &mut Seen,
    ) {
        let at = panel * PANEL_COLUMNS;
        let offsets = self.narrow[at..].first_chunk().expect("padded to whole blocks");
        let middle = MiddleOf { offsets, raise: self.raise };
        let mut totals = [0; PANEL_COLUMNS];
        let [squares, saturated] = kernel.put_out(sums, (middle, table), live, &mut totals, out);
        self.note_sums(at, &totals[..live], seen);
        seen.look_ups += saturated;
        if self.notes.squares {
            seen.noted.squares += squares;
        }
    }

    /// Takes thresholds off the accumulators of a panel, `[sample][32]`, and notes what it is to note. What is left is
    /// looked up with `shift`.
    pub(super) fn take_off(
        &self,
        kernel: &Kernel,
        (panel, live): (usize, usize),
        shift: u32,
        sums: &mut [i32],
        seen: &mut Seen,
    ) {
        let at = panel * PANEL_COLUMNS;
        let offsets = self.narrow[at..].first_chunk().expect("padded to whole blocks");
        let mut totals = [0; PANEL_COLUMNS];
        kernel.offset(sums, offsets, self.raise, &mut totals);
        self.note_sums(at, &totals[..live], seen);
        if self.notes.squares {
            let half = i32::try_from(self.half).expect("at most 2^13");
            seen.noted.squares += kernel.index_squares(sums, shift, half, live);
        }
    }

    /// The same of accumulators of any size.
    pub(super) fn take_off_wide(
        &self,
        (panel, live): (usize, usize),
        shift: u32,
        sums: &mut [i64],
        seen: &mut Seen,
    ) {
        let at = panel * PANEL_COLUMNS;
        let mut totals = [0; PANEL_COLUMNS];
        for (place, sum) in sums.iter_mut().enumerate() {
            let column = place % PANEL_COLUMNS;
            if column >= live {
                continue;
            }
            totals[column] += *sum;
            let left = *sum - self.offsets[at + column];
            *sum = left << self.raise;
            if self.notes.deviations {
                seen.noted.deviations += u128::from(left.unsigned_abs()).pow(2);
            }
            if self.notes.squares {
                let (place, _) = periphery::index(*sum, shift, self.half);
                seen.noted.squares += (place as i64 - self.half).unsigned_abs().pow(2);
            }
        }
        self.note_sums(at, &totals[..live], seen);
    }

    fn note_sums(&self, first: usize, totals: &[i64], seen: &mut Seen) {
        if self.notes.sums {
            seen.noted.sums.resize(self.offsets.len(), 0);
            let sums = seen.noted.sums[first..].iter_mut();
            sums.zip(totals).for_each(|(sum, more)| *sum += more);
        }
    }
}

impl Engine {
    /// What a read of a layer learns.
    pub(super) fn notes(&self, layer: usize, mode: Mode) -> Notes {
        let balance = &self.layers[layer].balance;
        match mode {
            Mode::Noting(notes) => notes,
            Mode::Hardware if self.phase == Phase::Training => Notes {
                sums: balance.law().threshold,
                deviations: false,
                squares: balance.tracks(),
            },
            Mode::Hardware | Mode::Probe => Notes::default(),
        }
    }

    /// Keeps what a read of the loaded samples learnt, by target, and charges it.
    pub(super) fn note(&mut self, layer: usize, notes: Notes, seen: &mut [Seen]) {
        let this = &self.layers[layer];
        let law = this.balance.law();
        if !law.is_on() {
            return;
        }
        let (wiring, units) = (this.spec.wiring, this.spec.units);
        let reads = self.reads(layer) as u64;
        if notes != Notes::default() {
            let mut readings = Readings { reads, ..Readings::default() };
            let mut deviations = 0;
            for (&target, seen) in wiring.targets().iter().zip(seen) {
                let mut noted = std::mem::take(&mut seen.noted);
                noted.sums.truncate(units);
                readings.sums[target.index()] = noted.sums;
                readings.squares += noted.squares;
                deviations += noted.deviations;
            }
            readings.deviations = deviations;
            self.registers[layer].readings = readings;
        }
        let each = reads * units as u64;
        let adds = [notes.sums, notes.deviations, notes.squares];
        let adds = adds.map(u64::from).iter().sum::<u64>() * each;
        for &target in wiring.targets() {
            let code = Self::code_of(wiring, target);
            let off = if law.threshold { each } else { 0 };
            self.charge_read(layer, code, Event::ThresholdSubtractions, off);
            self.charge_read(layer, code, Event::StatisticAdds, adds);
        }
    }

    /// Whether thresholds or steps of a layer move after writes.
    pub(super) fn balances(&self, layer: usize) -> bool {
        self.layers[layer].balance.law().moves()
    }

    /// Writes are done: thresholds and steps move by what was read before them.
    pub(super) fn move_balances(&mut self) {
        let moving: Vec<_> = (0..self.layers.len()).filter(|&at| self.balances(at)).collect();
        for &layer in &moving {
            let readings = std::mem::take(&mut self.registers[layer].readings);
            let this = &mut self.layers[layer];
            this.balance.written(&readings);
            let (wiring, units) = (this.spec.wiring, this.spec.units as u64);
            if this.balance.law().threshold {
                // every copy has added up its own reads
                let bits = SUM_BITS * units * self.copies_of(layer);
                for &target in wiring.targets() {
                    let code = Self::code_of(wiring, target);
                    self.charge(layer, code, During::Update, Event::SramBits, bits);
                }
            }
        }
        self.time(|schedule, cycles| schedule.balance(cycles, &moving));
    }

    /// Whether thresholds and steps wait to be found: nothing was written yet.
    pub(super) fn is_to_balance(&self) -> bool {
        let on = self.layers.iter().any(|layer| layer.balance.law().is_on());
        on && self.layers.iter().all(|layer| layer.writes.iter().all(|&writes| writes == 0))
    }

    /// Finds thresholds, step and variance of a layer from the loaded samples, and reads it once more with them.
    pub(super) fn balance(&mut self, layer: usize) {
        let law = self.layers[layer].balance.law();
        if law.threshold {
            let readings = self.noting(layer, Notes { sums: true, ..Notes::default() });
            self.layers[layer].balance.set_thresholds(&readings);
        }
        if law.gain != Gain::Table {
            let readings = self.noting(layer, Notes { deviations: true, ..Notes::default() });
            self.layers[layer].balance.set_shift(&readings);
        }
        if law.gain == Gain::Tracking {
            let readings = self.noting(layer, Notes { squares: true, ..Notes::default() });
            self.layers[layer].balance.set_variance(&readings);
        } else {
            self.forward(layer);
        }
    }

    fn noting(&mut self, layer: usize, notes: Notes) -> Readings {
        self.forward_in(layer, Mode::Noting(notes));
        std::mem::take(&mut self.registers[layer].readings)
    }
}
