//! What units put out and hold, for whoever drives the chip from outside or looks into it: registers, unit by unit.
//!
//! Units lie in blocks of 64 in registers; here they lie `[read][unit]`. A read is a sample; of a convolution, a position
//! of one.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Engine;
use super::error::{packed_at, stride_of};
use crate::chip::crossbar::layout::BLOCK_ROWS;
use crate::chip::population::Stream;

impl Engine {
    /// Lines by block of 64, `[block][read][64]`, as `[read][line]`; what a layer does not have is empty.
    fn line_by_line(units: usize, samples: usize, blocks: &[u8]) -> Vec<u8> {
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
        Self::line_by_line(self.layers[layer].spec.units, self.samples, blocks)
    }

    /// Derivatives of units; the peak of a function is 255.
    #[must_use]
    pub fn unit_slopes(&self, layer: usize, target: Stream) -> Vec<u8> {
        let slopes = &self.registers[layer].derivatives[target.index()];
        Self::line_by_line(self.layers[layer].spec.units, self.reads(layer), slopes)
    }

    /// Codes of units in front of a pool; empty where nothing lies between them and what they drive.
    #[must_use]
    pub fn unit_maps(&self, layer: usize, target: Stream) -> Vec<u8> {
        let maps = &self.registers[layer].maps[target.index()];
        Self::line_by_line(self.layers[layer].spec.units, self.reads(layer), maps)
    }

    /// Codes of a set of drives, `[sample][code]` without a constant row: of a convolution those of its image without the
    /// border, in the order y, x, channel.
    #[must_use]
    pub fn drive_codes(&self, layer: usize, set: Stream) -> Vec<u8> {
        let (spec, registers) = (&self.layers[layer].spec, &self.registers[layer]);
        let Some(shape) = spec.convolution else {
            return Self::line_by_line(
                spec.sample_inputs(),
                self.samples,
                &registers.drives[set.index()],
            );
        };
        let line = shape.width * shape.channels;
        let [_, across] = shape.padded();
        let image = &registers.images[set.index()];
        let rows = |sample: usize| {
            (0..shape.height).flat_map(move |y| {
                let first = sample * shape.pixels() + (y + shape.pad) * across + shape.pad;
                &image[first * shape.channels..first * shape.channels + line]
            })
        };
        (0..self.samples).flat_map(rows).copied().collect()
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
