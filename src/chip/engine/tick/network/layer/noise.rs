//! Stuck cells and noisy conversions of a layer's tiles, cell by cell and conversion by conversion from the laws of
//! `chip::device`.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::Arc;

use super::TickLayer;
use crate::chip::device::{Direction, Noise, Programming};
use crate::chip::engine::Phase;
use crate::chip::engine::tick::tile::TileNoise;
use crate::chip::hardware::Hardware;
use crate::num::draw::{Place, Site};
use crate::num::tables::Gaussian;

/// Gaussian numbers, and the standard deviation of a conversion.
pub(super) fn of(hardware: &Hardware) -> Option<(Arc<Gaussian>, i64)> {
    let noise = hardware.read_noise?;
    let bits = hardware.drive.dac_bits.min(hardware.drive.bits.get());
    let slice_max = u8::try_from((1u32 << bits) - 1).expect("at most 8 bits");
    let sd = noise.sd(hardware.cell.window.ceiling(), slice_max);
    Some((Arc::new(Gaussian::new()), sd))
}

/// The law of noisy loads, its Gaussian numbers, and the window.
pub(super) type Loads = (Programming, Gaussian, [u16; 2]);

/// That of a chip, where loads are noisy.
pub(super) fn loads(hardware: &Hardware) -> Option<Loads> {
    let window = hardware.cell.window;
    let ends = [window.floor(), window.ceiling()];
    Some((hardware.programming?, Gaussian::new(), ends))
}

impl TickLayer {
    /// Cells that are stuck hold their levels.
    pub(super) fn stick(&mut self, hardware: &Hardware) {
        let window = [hardware.cell.window.floor(), hardware.cell.window.ceiling()];
        if !hardware.has_stuck_cells() {
            return;
        }
        for (array, pathway) in self.wiring.pathways().iter().enumerate() {
            let place = Place {
                seed: self.seed,
                site: Site::StuckCell,
                layer: self.index,
                pathway: pathway.code,
                sub: 0,
                count: 0,
            };
            for cell in 0..self.rows * self.columns {
                let at = [cell / self.columns, cell % self.columns];
                let drawn = hardware.faults.stuck_at(place, window, self.rows, at);
                let mut listed = hardware.fault_map.of_array((self.index, pathway.code), window);
                let listed =
                    listed.find(|cell| [cell.row, cell.column].map(|at| at as usize) == at);
                if let Some(level) = listed.map(|cell| cell.level).or(drawn) {
                    let (tile, bank, row, column) = self.cell(array, cell);
                    self.tiles[tile].stick(bank, row, column, level);
                }
            }
        }
    }

    /// What a load leaves of a row of levels.
    pub(in super::super) fn programmed(
        &self,
        array: usize,
        row: usize,
        levels: &[u16],
    ) -> Vec<u16> {
        let Some((programming, gaussian, window)) = &self.programming else { return levels.into() };
        let place = Place {
            seed: self.seed,
            site: Site::ProgrammingNoise,
            layer: self.index,
            pathway: self.wiring.pathways()[array].code,
            sub: 0,
            count: 0,
        };
        let left = levels.iter().enumerate().map(|(column, &level)| {
            let words = Programming::words(place, self.rows, [row, column]);
            programming.left(gaussian, level, words, *window)
        });
        left.collect()
    }

    /// Samples are loaded in a phase that had so many before: from there on reads are counted.
    pub(in super::super) fn count_reads(&mut self, phase: Phase, before: u64) {
        let Some((table, sd)) = self.noise.clone() else { return };
        let first = before * self.positions() as u64;
        for tile in 0..self.tiles.len() {
            let [down, across] = [tile / self.grid[1] % self.grid[0], tile % self.grid[1]];
            let way = |direction, tiles| {
                let place = ((self.seed, self.index), (phase as u32, first));
                Noise::new(Arc::clone(&table), sd, place.0, place.1, (direction, tiles))
            };
            let noise = TileNoise {
                ways: [way(Direction::Columns, self.grid[0]), way(Direction::Rows, self.grid[1])],
                codes: self.codes(self.plane(tile)),
                at: [down, across],
                first: [across * self.tile[1], down * self.tile[0]],
            };
            self.tiles[tile].set_noise(Some(noise));
        }
    }
}
