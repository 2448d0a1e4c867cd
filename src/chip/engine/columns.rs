//! `FWD(columns)`: the transposed read. Gates drive the columns, positive phase then negative phase; of a convolution
//! position by position.
//!
//! ```text
//! d[row] = (E - I) u+  -  (E - I) u-  =  (E - I) u           sums are exact: two phases are one signed product
//! ```
//!
//! Its conversions lose nothing; where reads are noisy, what they are off by is added to the sums. Row sums of all positions
//! are added to the pixels that drove the rows. See docs/MODEL.md, 3.8.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;

use super::conducting::{Letting, rows_through};
use super::each::each;
use super::error::{packed_at, stride_of};
use super::noise::disturb_rows;
use super::update::SUM_BITS;
use super::{Engine, window};
use crate::chip::crossbar::kernel::Drives;
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS};
use crate::chip::device::Direction;
use crate::chip::ledger::{During, Event};
use crate::chip::population::Stream;

/// Bits of an error word in memory.
pub(super) const WORD_BITS: u64 = 16;
/// Reads whose row sums are kept before they are added up.
const READS_TOGETHER: usize = 256;
/// Reads that are worth a thread: levels are turned anew for each part.
const READS_A_PART: usize = 64;

impl Engine {
    pub(super) fn forward_columns(&mut self, layer: usize) {
        self.look_through(layer);
        let this = &self.layers[layer];
        let (layout, spec) = (this.layout, &this.spec);
        assert!(
            self.hardware.tile.transposed_read,
            "only tiles with column drivers are read backwards"
        );
        let [pair] = spec.wiring.pairs(Stream::P) else {
            unreachable!("rows that several pairs of a target share are not read backwards")
        };
        let arrays = pair.map(|at| &this.arrays[at]);
        let (samples, reads) = (self.samples, self.reads(layer));
        let (positions, inputs) = (spec.positions(), spec.sample_sums());
        let noise = self.noise(layer, Direction::Rows);
        // what every cell conducts beside its level cancels between banks that the same gates drive
        let through = match self.letting(layer) {
            Some(Letting::Own(all)) => Some(all),
            _ => None,
        };
        let through = through.as_ref().map(|all| pair.map(|at| &all[at]));
        let codes = pair.map(|at| spec.wiring.pathways()[at].code);
        let ([_, across], hardware) = (this.tiles(&self.hardware), &self.hardware);
        let mut backward = std::mem::take(&mut self.registers[layer].backward);
        backward.clear();
        backward.resize(samples * inputs, 0);
        let packed = &self.registers[layer].gates[Stream::P.index()];
        let apart = samples.div_ceil(self.team.threads()).max(READS_A_PART.div_ceil(positions));
        let parts = backward.chunks_mut(apart * inputs).enumerate();
        let parts = parts.map(|(at, sums)| (at * apart, (at * apart, sums))).collect();
        each(
            &mut self.team,
            2 * reads * layout.cells(),
            samples,
            parts,
            |kernel, (first, sums)| {
                let mut gates = Vec::new();
                let mut row_sums = Vec::new();
                let first = first * positions;
                let end = first + sums.len() / inputs * positions;
                for from in (first..end).step_by(READS_TOGETHER) {
                    let group = from..(from + READS_TOGETHER).min(end);
                    unpack(packed, reads, &group, &mut gates);
                    let driven = &gates[..];
                    let gates = Drives::new(driven, group.len());
                    for (at, read) in group.clone().enumerate().filter(|_| through.is_some()) {
                        let gate = |column: usize| {
                            let block = column / BLOCK_ROWS * group.len() + at;
                            driven[block * BLOCK_ROWS + column % BLOCK_ROWS].cast_signed().into()
                        };
                        let at = (read - first) / positions * inputs;
                        let (of, pixels) = (through.expect("looked"), &mut sums[at..at + inputs]);
                        let layer = (hardware, spec, [layout.rows, layout.columns]);
                        rows_through(of, layer, gate, read % positions, pixels);
                    }
                    let banks = arrays.iter().zip([false, true]);
                    for (array, negate) in banks.filter(|_| through.is_none()) {
                        array.read_columns(kernel, gates, &mut row_sums, |rows, shift| {
                            for (read, rows) in
                                group.clone().zip(rows.chunks_exact(layout.rows_padded()))
                            {
                                let at = (read - first) / positions * inputs;
                                let pixels = &mut sums[at..at + inputs];
                                window::fold(spec, rows, read % positions, (shift, negate), pixels);
                            }
                        });
                    }
                    for read in group.filter(|_| noise.is_some()) {
                        let at = (read - first) / positions * inputs;
                        let (noise, pixels) = (noise.as_ref(), &mut sums[at..at + inputs]);
                        let of = (hardware, spec, layout.rows);
                        disturb_rows(noise.expect("looked"), codes, of, (read, across), pixels);
                    }
                }
            },
        );
        self.registers[layer].backward = backward;
        self.charge_columns(layer);
        self.time(|schedule, cycles| schedule.columns(cycles, layer, samples));
    }

    fn charge_columns(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let [down, across] = this.tiles(&self.hardware).map(|n| n as u64);
        let (rows, columns) = (this.layout.rows as u64, this.layout.columns as u64);
        let reads = 2 * u64::from(self.hardware.slices()) * self.reads(layer) as u64;
        let (wiring, inputs) = (this.spec.wiring, this.spec.sample_sums() as u64);
        let folded = (self.samples * window::folded(&this.spec)) as u64;
        let dac_bits = u64::from(self.hardware.drive.dac_bits);
        let during = During::ForwardColumns;
        for &at in wiring.banks(Stream::P) {
            let code = wiring.pathways()[at].code;
            let driven = columns * down * reads;
            self.charge(layer, code, during, Event::DacSlices, driven);
            self.charge(layer, code, during, Event::SramBits, driven * dac_bits);
            self.charge(layer, code, during, Event::CellReads, rows * columns * reads);
            self.charge(layer, code, during, Event::Holds, rows * across * reads);
            self.charge(layer, code, during, Event::Conversions, rows * across * reads);
            self.charge(layer, code, during, Event::ShiftAdds, rows * across * reads);
        }
        let code = Self::code_of(wiring, Stream::P);
        // the sum of a pixel is read and stored where a row is added to it
        self.charge(layer, code, during, Event::ShiftAdds, folded);
        self.charge(layer, code, during, Event::SramBits, 2 * SUM_BITS * folded);
        // what is handed down is kept as error words until it is heard
        let kept = WORD_BITS * inputs * self.samples as u64;
        self.charge(layer, code, during, Event::SramBits, kept);
    }
}

/// Packed gates of some reads of `all` as drives lie: `[block][read][64]`.
fn unpack(packed: &[i8], all: usize, reads: &Range<usize>, out: &mut Vec<u8>) {
    let stride = stride_of(all);
    let blocks = packed.len() / (stride * BLOCK_ROWS);
    out.resize(blocks * reads.len() * BLOCK_ROWS, 0);
    let halves = out.chunks_exact_mut(reads.len() * BLOCK_ROWS).enumerate();
    for (block, out) in halves {
        for (read, out) in reads.clone().zip(out.chunks_exact_mut(BLOCK_ROWS)) {
            for (half, out) in out.as_chunks_mut::<HALF_COLUMNS>().0.iter_mut().enumerate() {
                let from = packed_at(stride, read, block * BLOCK_ROWS + half * HALF_COLUMNS);
                let gates: &[i8] = &packed[from..];
                *out = std::array::from_fn(|c| gates[c * 4].cast_unsigned());
            }
        }
    }
}
