//! What units put out and hold, for whoever drives the chip from outside: registers of dense layers, unit by unit.
//!
//! Units lie in blocks of 64 in registers; here they lie `[sample][unit]`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Engine;
use super::error::{packed_at, stride_of};
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::population::Stream;

impl Engine {
    /// Units by block of 64, `[block][sample][64]`, as `[sample][unit]`; what a layer does not have is empty.
    fn unit_by_unit(&self, layer: usize, blocks: &[u8]) -> Vec<u8> {
        let (units, samples) = (self.layers[layer].spec.units, self.samples);
        let mut out = Vec::with_capacity(units * samples);
        if blocks.len() < units.div_ceil(BLOCK_ROWS) * samples * BLOCK_ROWS {
            return out;
        }
        for sample in 0..samples {
            for first in (0..units).step_by(BLOCK_ROWS) {
                let at = (first + sample * BLOCK_ROWS) + first * (samples - 1);
                out.extend_from_slice(&blocks[at..at + BLOCK_ROWS.min(units - first)]);
            }
        }
        out
    }

    /// What units of a dense layer put out: the drive codes of the layer above or, of the last layer, activities.
    #[must_use]
    pub fn unit_codes(&self, layer: usize, target: Stream) -> Vec<u8> {
        let at = target.index();
        let blocks = match self.registers.get(layer + 1) {
            Some(above) => &above.drives[at][..],
            None => &self.registers[layer].activities[at],
        };
        self.unit_by_unit(layer, blocks)
    }

    /// Derivatives of units of a dense layer; the peak of a function is 255.
    #[must_use]
    pub fn unit_slopes(&self, layer: usize, target: Stream) -> Vec<u8> {
        self.unit_by_unit(layer, &self.registers[layer].derivatives[target.index()])
    }

    /// Gates of units of a dense layer: what an update multiplies drives by. Empty before error words came.
    #[must_use]
    pub fn unit_gates(&self, layer: usize, target: Stream) -> Vec<i8> {
        let (units, samples) = (self.layers[layer].spec.units, self.samples);
        let (gates, stride) =
            (&self.registers[layer].gates[target.index()], stride_of(self.samples));
        if gates.len() < units.div_ceil(BLOCK_ROWS) * BLOCK_ROWS * stride {
            return vec![];
        }
        let of = |sample| (0..units).map(move |unit| gates[packed_at(stride, sample, unit)]);
        (0..samples).flat_map(of).collect()
    }
}
