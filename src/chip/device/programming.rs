//! Programming noise: what a load leaves in a cell beside the level that was asked for.
//!
//! ```text
//! level' = clamp( ((level << 20) + g sd + (r << 4)) >> 20, floor, ceiling )       g, r: 16-bit words at site 17, sub 0 and 1
//! sd     = levels, 8 fractional bits: rsh(max(0, s) ceiling, 16),  s = c0 + c1 x + c2 x^2 + c3 x^3 with 24 fractional bits
//! x      = level / ceiling, the conductance as a share of the greatest; each product is rsh(. level / ceiling)
//! ```
//!
//! A function of the place: loading the same levels again gives the same cells. See docs/MODEL.md, 3.13.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::draw::{Place, Site};
use crate::num::fixed::rsh;
use crate::num::tables::Gaussian;

/// Standard deviation of what a load leaves, by the conductance that was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Programming {
    /// Coefficients of a polynomial in the share of the greatest conductance, in 2^-24 of that.
    pub coefficients: [i64; 4],
}

impl Programming {
    /// Greatest size of a coefficient: four times the greatest conductance.
    pub const COEFFICIENT_MAX: i64 = 4 << 24;

    /// Standard deviation at a level, in levels with 8 fractional bits.
    #[must_use]
    pub fn sd(self, level: u16, ceiling: u16) -> i64 {
        let (level, ceiling) = (i64::from(level), i64::from(ceiling));
        let [c0, rest @ ..] = self.coefficients;
        let share = |sum: i64| (2 * sum * level + ceiling).div_euclid(2 * ceiling);
        let sum = rest.into_iter().rev().fold(0, |sum, c| share(sum + c));
        rsh((c0 + sum).max(0) * ceiling, 16)
    }

    /// What a load leaves, by the words of the cell.
    #[must_use]
    pub fn left(
        self,
        gaussian: &Gaussian,
        level: u16,
        [g, r]: [u16; 2],
        [floor, ceiling]: [u16; 2],
    ) -> u16 {
        let off = gaussian.of(g) * self.sd(level, ceiling) + (i64::from(r) << 4);
        let left = ((i64::from(level) << 20) + off) >> 20;
        u16::try_from(left.clamp(floor.into(), ceiling.into())).expect("inside the window")
    }

    /// Words of a cell of an array of so many rows: the law.
    #[must_use]
    pub fn words(place: Place, rows: usize, [row, column]: [usize; 2]) -> [u16; 2] {
        let of = |sub| Place { site: Site::ProgrammingNoise, sub, count: 0, ..place };
        [0, 1].map(|sub| of(sub).half(rows, row, column))
    }
}

/// Pairs of 16-bit words of all cells of an array at a site, sub 0 and 1, row by row.
#[must_use]
pub fn cell_words(place: Place, [rows, columns]: [usize; 2]) -> Vec<[u16; 2]> {
    let mut all = vec![[0; 2]; rows * columns];
    let mut bytes = vec![0; rows.div_ceil(32) * 64];
    for sub in 0..2 {
        let place = Place { sub, count: 0, ..place };
        for column in 0..columns {
            place.columns(rows, column..column + 1, 2, &mut bytes);
            for (row, word) in bytes.as_chunks::<2>().0.iter().take(rows).enumerate() {
                all[row * columns + column][sub as usize] = u16::from_le_bytes(*word);
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> Place {
        Place { seed: 3, site: Site::ProgrammingNoise, layer: 1, pathway: 2, sub: 0, count: 0 }
    }

    #[test]
    fn all_words_are_those_of_the_law_for_one_and_a_cell_without_noise_is_exact() {
        for size in [[1, 1], [31, 3], [32, 2], [33, 5], [70, 4]] {
            let all = cell_words(place(), size);
            for (at, words) in all.iter().enumerate() {
                let cell = [at / size[1], at % size[1]];
                assert_eq!(*words, Programming::words(place(), size[0], cell), "{size:?} {cell:?}");
            }
        }
        let none = Programming { coefficients: [0; 4] };
        let gaussian = Gaussian::new();
        for word in [0, 1, 40_000, u16::MAX] {
            assert_eq!(none.left(&gaussian, 7, [word, word], [0, 15]), 7);
        }
        let wild = Programming { coefficients: [4 << 24, 0, 0, 0] };
        let ends = [0, u16::MAX].map(|g| wild.left(&gaussian, 3, [g | 0xfff0, 0], [2, 15]));
        assert!(ends.iter().all(|level| (2..=15).contains(level)));
    }
}
