//! `FWD(columns)`: the transposed read. Gates drive the columns, positive phase then negative phase.
//!
//! ```text
//! d[row] = (E - I) u+  -  (E - I) u-  =  (E - I) u           sums are exact: two phases are one signed product
//! ```
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Engine;
use super::error::stride_of;
use crate::chip::crossbar::kernel::{Drives, Kernel};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS};
use crate::chip::ledger::{During, Event};
use crate::chip::population::Stream;

/// Bits of an error word in memory.
pub(super) const WORD_BITS: u64 = 16;

impl Engine {
    pub(super) fn forward_columns(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let (layout, wiring) = (this.layout, this.spec.wiring);
        assert!(
            self.hardware.tile.transposed_read,
            "only tiles with column drivers are read backwards"
        );
        let samples = self.samples;
        let mut backward = std::mem::take(&mut self.registers[layer].backward);
        backward.clear();
        if samples > 0 {
            let gates = unpack(&self.registers[layer].gates[Stream::P.index()], samples);
            let gates = Drives::new(&gates, samples);
            let kernel = Kernel::start(self.backend);
            let [pair] = wiring.pairs(Stream::P) else {
                unreachable!("rows that several pairs of a target share are not read backwards")
            };
            let [e, i] = pair.map(|at| this.arrays[at].read_columns(&kernel, gates));
            let stride = layout.rows_padded();
            for (e, i) in e.chunks_exact(stride).zip(i.chunks_exact(stride)) {
                let rows = e.iter().zip(i).take(this.spec.inputs);
                backward.extend(rows.map(|(e, i)| e - i));
            }
        }
        self.registers[layer].backward = backward;
        self.charge_columns(layer);
        self.time(|schedule, cycles| schedule.columns(cycles, layer, samples));
    }

    fn charge_columns(&mut self, layer: usize) {
        let this = &self.layers[layer];
        let [down, across] = this.tiles(&self.hardware).map(|n| n as u64);
        let (rows, columns) = (this.layout.rows as u64, this.layout.columns as u64);
        let reads = 2 * u64::from(self.hardware.slices()) * self.samples as u64;
        let (wiring, inputs) = (this.spec.wiring, this.spec.inputs as u64);
        let dac_bits = u64::from(self.hardware.drive.dac_bits);
        for &at in wiring.banks(Stream::P) {
            let code = wiring.pathways()[at].code;
            let during = During::ForwardColumns;
            let driven = columns * down * reads;
            self.charge(layer, code, during, Event::DacSlices, driven);
            self.charge(layer, code, during, Event::SramBits, driven * dac_bits);
            self.charge(layer, code, during, Event::CellReads, rows * columns * reads);
            self.charge(layer, code, during, Event::Holds, rows * across * reads);
            self.charge(layer, code, during, Event::Conversions, rows * across * reads);
            self.charge(layer, code, during, Event::ShiftAdds, rows * across * reads);
        }
        // what is handed down is kept as error words until it is heard
        let code = Self::code_of(wiring, Stream::P);
        let kept = WORD_BITS * inputs * self.samples as u64;
        self.charge(layer, code, During::ForwardColumns, Event::SramBits, kept);
    }
}

/// Packed gates as drives lie: `[block][sample][64]`.
fn unpack(packed: &[i8], samples: usize) -> Vec<u8> {
    let stride = stride_of(samples);
    let blocks = packed.len() / (stride * BLOCK_ROWS);
    let mut out = vec![0; blocks * samples * BLOCK_ROWS];
    let halves = packed.chunks_exact(HALF_COLUMNS * stride);
    for (half, packed) in halves.enumerate() {
        let (block, from) = (half / 4, half % 4 * HALF_COLUMNS);
        for (quad, packed) in packed.as_chunks::<64>().0.iter().enumerate() {
            for s in 0..4.min(samples.saturating_sub(quad * 4)) {
                let at = (block * samples + quad * 4 + s) * BLOCK_ROWS + from;
                let to: &mut [u8; HALF_COLUMNS] =
                    out[at..].first_chunk_mut().expect("16 columns a half");
                *to = std::array::from_fn(|c| packed[c * 4 + s].cast_unsigned());
            }
        }
    }
    out
}
