//! What tiles of a layer do together for optimisers and centred updates: squares of all sums, means of rows.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::super::super::tile::{Said, Tile};
use super::TickLayer;
use crate::chip::hardware::Timing;
use crate::chip::hardware::timing::tree_levels;
use crate::chip::layer::{DrivenBy, Layer, Optimiser};
use crate::chip::population::{Pathway, Polarity, Stream};
use crate::num::fixed::rsh;
use crate::num::tables::Scales;

/// Registers of a layer for requests of a whole batch.
#[derive(Debug)]
pub(super) struct Batch {
    /// Samples added and not yet written.
    pub(super) added: i64,
    /// Cycles until squares of all tiles are added up, and those left while they are.
    joining: u64,
    left: Option<u64>,
    /// That of the write in progress.
    shift: u32,
    /// Cells of the layer.
    cells: i128,
    optimiser: Optimiser,
    /// What `rms` follows, and how often its factor was held.
    followed: [i64; 2],
    scales: Scales,
    /// Window of the means, if rows are centred.
    window_log2: Option<u32>,
    /// Mean codes by set of drives and row; by channel of what a window moves over, the constant row behind.
    means: [Vec<i64>; 2],
}

impl Batch {
    pub(super) fn new(timing: Timing, layer: &Layer, grid: [usize; 2]) -> Self {
        let wiring = layer.spec.wiring;
        let (spec, rows) = (&layer.spec, layer.layout.rows);
        let kept = spec.convolution.map_or(rows, |s| s.channels + usize::from(spec.constant_row));
        let tiles = wiring.planes().count() * grid[0] * grid[1];
        let means = [Stream::P, Stream::N].map(|set| {
            let means = layer.requests.means(set).iter().take(kept);
            means.map(|&mean| i64::from(mean)).collect()
        });
        Self {
            added: 0,
            joining: timing.beat * tree_levels(tiles as u64),
            left: None,
            shift: 0,
            cells: (layer.layout.cells() * wiring.pathways().len()) as i128,
            optimiser: layer.requests.optimiser,
            followed: [layer.requests.followed().power, layer.requests.followed().ends],
            scales: Scales::new(),
            window_log2: layer.requests.window_log2,
            means,
        }
    }
}

impl TickLayer {
    /// The set of drives that a bank of a plane takes.
    fn set(&self, plane: usize, bank: usize) -> usize {
        match self.driven_by {
            DrivenBy::Shared | DrivenBy::Signed => Stream::P.index(),
            DrivenBy::Streams | DrivenBy::Normalised => self.source(plane, bank).index(),
        }
    }

    /// Mean codes of the rows of a set of drives, with 4 fractional bits.
    pub(in super::super) fn row_means(&self, set: Stream) -> &[i64] {
        &self.batch.means[set.index()]
    }

    /// Codes of every row, or channel, over the samples added, by set of drives; and over how many samples, or pixels.
    fn codes_added(&self) -> ([Vec<i64>; 2], i64) {
        let mut codes = [vec![], vec![]];
        let samples = usize::try_from(self.batch.added).expect("few");
        let mut count = self.batch.added;
        for plane in 0..self.planes.len() {
            for bank in 0..2 {
                let set = self.set(plane, bank);
                if let Some((sums, pixels)) = self.channel_codes(set, samples) {
                    (codes[set], count) = (sums, pixels);
                    continue;
                }
                let row = |row: usize| {
                    let tile = self.at(plane, row / self.tile[0], 0);
                    self.tiles[tile].codes(bank, row % self.tile[0])
                };
                codes[set] = (0..self.rows).map(row).collect();
            }
        }
        (codes, count)
    }

    /// Before a write: means are those of the batch if there are none yet, and tiles are told.
    pub(super) fn begin_write(&mut self, shift: u32) {
        self.batch.shift = shift;
        let begins = self.writes == 0;
        self.tiles.iter_mut().for_each(|tile| tile.begin(begins));
        if self.batch.window_log2.is_none() {
            return;
        }
        if self.writes == 0 && self.batch.added > 0 {
            let (codes, count) = self.codes_added();
            // halves up
            let mean = |code: &i64| (32 * code + count).div_euclid(2 * count);
            for (means, codes) in self.batch.means.iter_mut().zip(&codes) {
                *means = codes.iter().map(mean).collect();
            }
        }
        for tile in 0..self.tiles.len() {
            let first = tile / self.grid[1] % self.grid[0] * self.tile[0];
            for bank in 0..2 {
                let set = self.set(self.plane(tile), bank);
                for row in first..self.rows.min(first + self.tile[0]) {
                    let mean = self.batch.means[set][self.mean_at(row)];
                    self.tiles[tile].set_mean(bank, row - first, mean);
                }
            }
        }
    }

    /// After a write.
    pub(super) fn move_means(&mut self) {
        if let (Some(window), true) = (self.batch.window_log2, self.writes > 0) {
            let (codes, count) = self.codes_added();
            let window = window + self.pixels_log2();
            for (means, codes) in self.batch.means.iter_mut().zip(codes) {
                for (mean, codes) in means.iter_mut().zip(codes) {
                    *mean += rsh(16 * codes - count * *mean, window);
                }
            }
        }
        self.batch.added = 0;
        self.tiles.iter_mut().for_each(Tile::clear_lines);
    }

    /// Once all tiles have looked at their sums, those are added up, and the write goes on.
    pub(super) fn join_squares(&mut self) {
        if !self.tiles.iter().all(Tile::waits) {
            return;
        }
        let left = self.batch.left.map_or(self.batch.joining, |left| left - 1);
        self.batch.left = Some(left);
        if left > 0 {
            return;
        }
        self.batch.left = None;
        let squares: i128 = self.tiles.iter().map(Tile::squares).sum();
        let said = match self.batch.optimiser {
            Optimiser::Rms => self.follow(squares),
            _ => {
                let mut least = 1;
                // 2^(2t+1) = 2 (2^t)^2
                while squares >= self.batch.cells * 2 * least * least {
                    least *= 2;
                }
                Said::Least(i64::try_from(least).expect("a sum has 32 bits"))
            }
        };
        self.tiles.iter_mut().for_each(|tile| tile.go_on(said));
    }

    /// The scale of a layer whose squares add up to so much.
    fn follow(&mut self, squares: i128) -> Said {
        if squares == 0 {
            return Said::Nothing;
        }
        // the place of the leading bit
        let mut place = 0;
        while squares >> (place + 1) > 0 {
            place += 1;
        }
        let [power, ends] = &mut self.batch.followed;
        *power = if *power < 0 { 256 * place } else { *power + rsh(256 * place - *power, 4) };
        let factor =
            self.batch.scales.at(((*power + 128) >> 1) + i64::from(self.batch.shift) - 16_384);
        *ends += i64::from(factor.held);
        Said::Scale(factor.mantissa.into(), factor.shift)
    }

    /// What `rms` follows, and how often its factor was held.
    pub(in super::super) const fn followed(&self) -> [i64; 2] {
        self.batch.followed
    }

    /// A word of every cell of an array, row by row.
    pub(in super::super) fn words(&self, array: usize, word: usize) -> Vec<i64> {
        self.cells(array, |tile, bank, row, column| tile.word(word, bank, row, column))
    }

    /// Takes over the words of all cells.
    pub(super) fn load_words(&mut self, layer: &Layer) {
        for array in 0..layer.arrays.len() {
            for word in 0..2 {
                let words = layer.requests.words(array, word, layer.layout);
                for (cell, value) in words.into_iter().enumerate() {
                    let (tile, bank, row, column) = self.cell(array, cell);
                    self.tiles[tile].set_word(word, (bank, row, column), value);
                }
            }
        }
    }

    /// Bits of a mean of a row.
    pub(in super::super) const fn mean_bits(&self) -> u64 {
        if self.driven_by.phases() > 1 { 13 } else { 12 }
    }

    /// How often means were used and kept at a write, by pathway.
    pub(in super::super) fn mean_counts(&self) -> Vec<(u8, u64)> {
        if self.batch.window_log2.is_none() {
            return vec![];
        }
        let (rows, pathways) = (self.rows as u64, self.wiring.pathways());
        let kept = self.batch.means[Stream::P.index()].len() as u64;
        let mut seen = vec![];
        let count = |pathway: &Pathway| {
            let set = if self.driven_by.is_shared() { Stream::P } else { pathway.source };
            let first = !seen.contains(&set);
            seen.push(set);
            let looks = match self.batch.optimiser {
                Optimiser::Sign { dead_zone } => dead_zone,
                Optimiser::Rms => pathway.polarity == Polarity::Excites,
                _ => false,
            };
            (pathway.code, rows * (1 + u64::from(looks)) + kept * u64::from(first))
        };
        pathways.iter().map(count).collect()
    }
}
