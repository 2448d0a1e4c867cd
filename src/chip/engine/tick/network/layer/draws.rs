//! Draws of a layer's tiles, from the addresses of the logical array: dither of a row, lines that fire in a slot.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::super::super::tile::{TileDevice, TileMemory, differing, laws};
use super::TickLayer;
use crate::chip::hardware::{DitherPattern, Hardware};
use crate::chip::layer::Layer;
use crate::num::draw::{Place, Site};
use crate::num::fixed::rsh;

/// Bits of a word of a layer's writes.
pub(super) fn bits(hardware: &Hardware, layer: &Layer) -> u32 {
    if layer.requests.optimiser.is_sign() { 16 } else { hardware.write.dither_bits.get() }
}

impl TickLayer {
    /// Makes cells of the chip's device, if it has one, that remember what they do.
    pub(super) fn fit(&mut self, hardware: &Hardware) {
        let spec = hardware.answering();
        let laws = spec.as_ref().map(|spec| laws(spec));
        let differing = differing(hardware);
        for tile in 0..self.tiles.len() {
            let (down, across) = (tile / self.grid[1] % self.grid[0], tile % self.grid[1]);
            let (rows, columns) = (self.tile_rows(down), self.tile_columns(across));
            let places = self.codes(self.plane(tile)).map(|pathway| Place {
                layer: self.index,
                pathway,
                ..Place::global(self.seed, Site::Variation, self.writes)
            });
            let first = [rows.start, columns.start];
            let at = (self.rows, first);
            let size = [rows.len(), columns.len()];
            if let (Some(spec), Some(laws)) = (&spec, &laws) {
                let device = TileDevice::new(hardware, (spec, laws), places, at, size);
                self.tiles[tile].set_device(device);
            }
            let memory = TileMemory::of(hardware, &differing, places, at, size);
            self.tiles[tile].set_memory(memory);
        }
    }

    /// The draws of the row that a tile is about to write.
    pub(super) fn draws(&self, tile: usize, bank: usize) -> Vec<u16> {
        let across = tile % self.grid[1];
        let down = tile / self.grid[1] % self.grid[0];
        let row = down * self.tile[0] + self.tiles[tile].dither_row();
        let place = Place {
            seed: self.seed,
            site: Site::WriteDither,
            layer: self.index,
            pathway: self.codes(self.plane(tile))[bank],
            sub: 0,
            count: self.writes,
        };
        let (bits, pattern) = self.dither;
        let word = |place: &Place, rows, row, column| match bits {
            0 => 0,
            8 => {
                let mut bytes = [0; 64];
                place.bytes(rows, column, row / 64, &mut bytes);
                u16::from(bytes[row % 64])
            }
            _ => place.half(rows, row, column),
        };
        let draw = |column| match pattern {
            DitherPattern::PerCell => word(&place, self.rows, row, column),
            DitherPattern::Separable => {
                let down = word(&Place { sub: 1, ..place }, self.rows, row, 0);
                // numbered as one column
                down ^ word(&Place { sub: 2, ..place }, self.columns, column, 0)
            }
        };
        self.tile_columns(across).map(draw).collect()
    }

    /// Which rows and columns of a bank of a tile fire in a slot of a train.
    pub(super) fn firing(&self, tile: usize, bank: usize, slot: u32) -> (Vec<bool>, Vec<bool>) {
        let across = tile % self.grid[1];
        let down = tile / self.grid[1] % self.grid[0];
        let this = &self.tiles[tile];
        let (shift, sample) = this.writing();
        // the probability of a slot is 2^-(k + log2 slots) of drive times gate, half of it each line's
        let total = shift + self.wiring.shift_extra() + self.slots_log2;
        let fires = |site, rows, line: usize, amount: i64, by: u32| {
            let place = Place {
                seed: self.seed,
                site,
                layer: self.index,
                pathway: self.codes(self.plane(tile))[bank],
                sub: slot,
                count: self.writes,
            };
            let chance = rsh(amount << 16, by).min(1 << 16);
            i64::from(place.half(rows, line, 0)) < chance
        };
        let row = |(at, row): (usize, usize)| {
            let amount = i64::from(this.drive(bank, sample, at)) * this.mantissa();
            fires(Site::RowTrain, self.rows, row, amount, total - total / 2)
        };
        let column = |(at, column): (usize, usize)| {
            let amount = this.bank_gate(bank, sample, at).abs();
            fires(Site::ColumnTrain, self.columns, column, amount, total / 2)
        };
        let rows = self.tile_rows(down).enumerate().map(row).collect();
        (rows, self.tile_columns(across).enumerate().map(column).collect())
    }
}
