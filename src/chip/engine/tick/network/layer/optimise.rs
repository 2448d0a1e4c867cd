//! What tiles of a layer do together for optimisers and centred updates: squares of all sums, means of rows.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::TickLayer;
use crate::chip::hardware::Timing;
use crate::chip::hardware::timing::tree_levels;
use crate::chip::layer::{DrivenBy, Layer};
use crate::chip::population::Stream;
use crate::num::fixed::rsh;

/// Registers of a layer for requests of a whole batch.
#[derive(Debug)]
pub(super) struct Batch {
    /// Samples added and not yet written.
    pub(super) added: i64,
    /// Cycles until squares of all tiles are added up, and those left while they are.
    joining: u64,
    left: Option<u64>,
    /// Cells of the layer.
    cells: i128,
    dead_zone: bool,
    /// Window of the means, if rows are centred.
    window_log2: Option<u32>,
    /// Mean codes by set of drives and row.
    means: [Vec<i64>; 2],
}

impl Batch {
    pub(super) fn new(timing: Timing, layer: &Layer, grid: [usize; 2]) -> Self {
        let wiring = layer.spec.wiring;
        let tiles = wiring.planes().count() * grid[0] * grid[1];
        let means = [Stream::P, Stream::N].map(|set| {
            let rows = layer.requests.means(set).iter().take(layer.layout.rows);
            rows.map(|&mean| i64::from(mean)).collect()
        });
        Self {
            added: 0,
            joining: timing.beat * tree_levels(tiles as u64),
            left: None,
            cells: (layer.layout.cells() * wiring.pathways().len()) as i128,
            dead_zone: layer.requests.optimiser.looks_at_layer(),
            window_log2: layer.requests.window_log2,
            means,
        }
    }
}

impl TickLayer {
    /// The set of drives that a bank of a plane takes.
    fn set(&self, plane: usize, bank: usize) -> usize {
        match self.driven_by {
            DrivenBy::Shared => Stream::P.index(),
            DrivenBy::Streams | DrivenBy::Normalised => self.source(plane, bank).index(),
        }
    }

    /// Mean codes of the rows of a set of drives, with 4 fractional bits.
    pub(in super::super) fn row_means(&self, set: Stream) -> &[i64] {
        &self.batch.means[set.index()]
    }

    /// Codes of every row over the samples added, by set of drives.
    fn row_codes(&self) -> [Vec<i64>; 2] {
        let mut codes = [vec![], vec![]];
        for plane in 0..self.planes.len() {
            for bank in 0..2 {
                let row = |row: usize| {
                    let tile = self.at(plane, row / self.tile[0], 0);
                    self.tiles[tile].codes(bank, row % self.tile[0])
                };
                codes[self.set(plane, bank)] = (0..self.rows).map(row).collect();
            }
        }
        codes
    }

    /// Before a write: means are those of the batch if there are none yet, and tiles are told.
    pub(super) fn begin_write(&mut self) {
        if self.batch.window_log2.is_none() {
            return;
        }
        let samples = self.batch.added;
        if self.writes == 0 && samples > 0 {
            // halves up
            let mean = |code: &i64| (32 * code + samples).div_euclid(2 * samples);
            let codes = self.row_codes();
            for (means, codes) in self.batch.means.iter_mut().zip(&codes) {
                *means = codes.iter().map(mean).collect();
            }
        }
        for tile in 0..self.tiles.len() {
            let first = tile / self.grid[1] % self.grid[0] * self.tile[0];
            for bank in 0..2 {
                let set = self.set(self.plane(tile), bank);
                for row in first..self.rows.min(first + self.tile[0]) {
                    let mean = self.batch.means[set][row];
                    self.tiles[tile].set_mean(bank, row - first, mean);
                }
            }
        }
    }

    /// After a write.
    pub(super) fn move_means(&mut self) {
        let samples = std::mem::take(&mut self.batch.added);
        if let (Some(window), true) = (self.batch.window_log2, self.writes > 0) {
            let codes = self.row_codes();
            for (means, codes) in self.batch.means.iter_mut().zip(codes) {
                for (mean, codes) in means.iter_mut().zip(codes) {
                    *mean += rsh(16 * codes - samples * *mean, window);
                }
            }
        }
        self.tiles.iter_mut().for_each(super::Tile::clear_lines);
    }

    /// Once all tiles have looked at their sums, those are added up, and the write goes on.
    pub(super) fn join_squares(&mut self) {
        if !self.tiles.iter().all(super::Tile::waits) {
            return;
        }
        let left = self.batch.left.map_or(self.batch.joining, |left| left - 1);
        self.batch.left = Some(left);
        if left > 0 {
            return;
        }
        self.batch.left = None;
        let squares: i128 = self.tiles.iter().map(super::Tile::squares).sum();
        let mut least = 1;
        // 2^(2t+1) = 2 (2^t)^2
        while self.batch.dead_zone && squares >= self.batch.cells * 2 * least * least {
            least *= 2;
        }
        let least = i64::try_from(least).expect("a sum has 32 bits");
        self.tiles.iter_mut().for_each(|tile| tile.go_on(least));
    }

    /// How often means were used and kept at a write, by pathway.
    pub(in super::super) fn mean_counts(&self) -> Vec<(u8, u64)> {
        if self.batch.window_log2.is_none() {
            return vec![];
        }
        let (rows, pathways) = (self.rows as u64, self.wiring.pathways());
        let passes = if self.batch.dead_zone { 2 } else { 1 };
        let mut seen = vec![];
        let count = |pathway: &crate::chip::population::Pathway| {
            let set = if self.driven_by == DrivenBy::Shared { Stream::P } else { pathway.source };
            let first = !seen.contains(&set);
            seen.push(set);
            (pathway.code, rows * (passes + u64::from(first)))
        };
        pathways.iter().map(count).collect()
    }
}
