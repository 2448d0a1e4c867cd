//! Noise of a read: what a conversion finds beside the current of its line.
//!
//! ```text
//! noise = rsh( g sd, 20 )                    in units of current; g a Gaussian of 12 fractional bits, one word a conversion
//! sd    = rsh( sigma ceiling x_max, 8 )      8 fractional bits; sigma of 16: in currents of a cell at the ceiling under x_max,
//!                                            the greatest slice of a drive
//! word  = 16 bits at site 5, layer, pathway of the bank, sub = slice + 2^8 phase + 2^16 ledger phase + 2^20 direction,
//!         count = sample P + position, cell = (row tile, column) of as many rows as there are row tiles
//! ```
//!
//! Samples are counted by ledger phase since the start; a dense layer has P = 1. A difference of banks that is converted once
//! has the word of its excitatory bank. Of a transposed read the cell is (column tile, row). See docs/MODEL.md, 2.6.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::ops::Range;
use std::sync::Arc;

use crate::num::draw::{Place, Site};
use crate::num::fixed::rsh;
use crate::num::tables::Gaussian;

/// How much a conversion is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadNoise {
    /// Standard deviation, in 2^-16 of the current of a cell at the ceiling under the greatest slice.
    pub sigma: u32,
}

impl ReadNoise {
    /// Greatest `sigma`: 16 cells.
    pub const SIGMA_MAX: u32 = 16 << 16;

    /// Standard deviation in units of current, 8 fractional bits.
    #[must_use]
    pub fn sd(self, ceiling: u16, slice_max: u8) -> i64 {
        rsh(i64::from(self.sigma) * i64::from(ceiling) * i64::from(slice_max), 8)
    }
}

/// Which lines are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Columns, while rows are driven.
    Columns,
    /// Rows, while columns are driven.
    Rows,
}

/// What all conversions of the reads of a layer have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Noise {
    table: Arc<Gaussian>,
    sd: i64,
    seed: u64,
    layer: u16,
    /// Number of the ledger phase.
    phase: u32,
    /// Reads of this phase before the first one.
    first: u64,
    direction: Direction,
    /// Tiles whose lines are added up behind their converters.
    tiles: usize,
}

/// A conversion's place in its layer, but for the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoisePlace {
    /// Pathway code of the bank.
    pub pathway: u8,
    /// Slice of the drive.
    pub slice: u32,
    /// Read phase: 1 where what lies below 0 is driven.
    pub phase: u32,
    /// Read, counted from the first one.
    pub read: u64,
    /// Tile among those that are added up.
    pub tile: usize,
}

impl Noise {
    /// The noise of a layer's reads. `sd` is that of [`ReadNoise::sd`], `first` the number of reads of the layer in ledger phase
    /// `phase` before these, `tiles` how many are added up.
    #[must_use]
    pub const fn new(
        table: Arc<Gaussian>,
        sd: i64,
        (seed, layer): (u64, u16),
        (phase, first): (u32, u64),
        (direction, tiles): (Direction, usize),
    ) -> Self {
        Self { table, sd, seed, layer, phase, first, direction, tiles }
    }

    /// The same for reads of which the first is number `read` of these.
    #[must_use]
    pub fn starting_at(&self, read: usize) -> Self {
        Self { first: self.first + read as u64, ..self.clone() }
    }

    fn words(&self, at: NoisePlace) -> Place {
        let direction = match self.direction {
            Direction::Columns => 0,
            Direction::Rows => 1 << 20,
        };
        Place {
            seed: self.seed,
            site: Site::ReadNoise,
            layer: self.layer,
            pathway: at.pathway,
            sub: at.slice | at.phase << 8 | self.phase << 16 | direction,
            count: self.first + at.read,
        }
    }

    /// What a word adds.
    fn of(&self, word: u16) -> i64 {
        rsh(self.table.of(word) * self.sd, 20)
    }

    /// What the conversion of one line adds: the law.
    #[must_use]
    pub fn one(&self, at: NoisePlace, line: usize) -> i64 {
        self.of(self.words(at).half(self.tiles, at.tile, line))
    }

    /// What the conversions of some lines add, handed to `add` one by one with their number among them.
    pub fn each(&self, at: NoisePlace, lines: Range<usize>, mut add: impl FnMut(usize, i64)) {
        const TOGETHER: usize = 32;
        let place = self.words(at);
        let blocks = self.tiles.div_ceil(32);
        if blocks > 1 {
            return lines.enumerate().for_each(|(at_line, line)| add(at_line, self.one(at, line)));
        }
        let mut bytes = [0; TOGETHER * 64];
        for first in lines.clone().step_by(TOGETHER) {
            let some = first..(first + TOGETHER).min(lines.end);
            let bytes = &mut bytes[..some.len() * 64];
            place.columns(self.tiles, some.clone(), 2, bytes);
            for (line, words) in some.zip(bytes.as_chunks::<64>().0) {
                let word = [words[2 * at.tile], words[2 * at.tile + 1]];
                add(line - lines.start, self.of(u16::from_le_bytes(word)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: NoisePlace = NoisePlace { pathway: 2, slice: 3, phase: 1, read: 4, tile: 0 };

    fn noise(sigma: u32, seed: u64, first: u64, tiles: usize) -> Noise {
        let sd = ReadNoise { sigma }.sd(255, 255);
        let table = Arc::new(Gaussian::new());
        Noise::new(table, sd, (seed, 1), (2, first), (Direction::Columns, tiles))
    }

    #[test]
    fn a_sigma_is_in_currents_of_a_full_cell() {
        assert_eq!(ReadNoise { sigma: 1 << 16 }.sd(255, 255), 255 * 255 * 256);
        assert_eq!(ReadNoise { sigma: 1 << 15 }.sd(15, 1), 15 * 128);
        assert_eq!(ReadNoise { sigma: 0 }.sd(4095, 255), 0);
        assert!(ReadNoise { sigma: ReadNoise::SIGMA_MAX }.sd(4095, 255) < 1 << 33);
    }

    #[test]
    fn every_part_of_a_place_has_draws_of_its_own_and_reads_are_counted_on() {
        let of = |noise: &Noise, at: NoisePlace| {
            let mut lines = vec![0; 70];
            noise.each(at, 5..75, |line, more| lines[line] = more);
            let law: Vec<_> = (5..75).map(|line| noise.one(at, line)).collect();
            assert_eq!(lines, law, "line by line");
            lines
        };
        let base = noise(1 << 16, 1, 10, 3);
        let mut all = vec![of(&base, AT)];
        let others = [
            NoisePlace { pathway: 3, ..AT },
            NoisePlace { slice: 2, ..AT },
            NoisePlace { phase: 0, ..AT },
            NoisePlace { read: 5, ..AT },
            NoisePlace { tile: 2, ..AT },
        ];
        all.extend(others.map(|at| of(&base, at)));
        let backwards = Noise { direction: Direction::Rows, ..base.clone() };
        let later = Noise { phase: 0, ..base.clone() };
        all.extend([backwards, later, noise(1 << 16, 2, 10, 3)].map(|noise| of(&noise, AT)));
        for (at, one) in all.iter().enumerate() {
            assert!(all[..at].iter().all(|other| other != one), "{at}");
        }
        let moved = base.starting_at(3);
        assert_eq!(of(&moved, NoisePlace { read: 1, ..AT }), all[0]);
        // more tiles than a block has words
        let tall = noise(1 << 16, 1, 0, 40);
        assert_ne!(
            of(&tall, NoisePlace { tile: 39, ..AT }),
            of(&tall, NoisePlace { tile: 7, ..AT })
        );
    }
}
