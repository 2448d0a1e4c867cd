//! Volatile cells: with every so many writes of their array they lose a part of what sets them apart from a level of rest.
//!
//! ```text
//! look    after every write of an array whose number, counted from 1, is a multiple of `every`
//! rest    R = floor + rsh(rest (ceiling - floor), 16)                 of the cell's own window;  rest with 16 fractional bits
//! lost    l = min( rsh(lost F, 24), 2^32 - 1 )                        in 2^-32;  F: a normal factor of the cell's word at site 3, sub 5
//! level'  = level - (((level - R) l + w) >> 32)                       w: its 32-bit word at site 19, count that of the write
//! ```
//!
//! A fraction of a level is lost with its chance. Cells that are stuck, worn out or gone stay. See docs/MODEL.md, 3.16.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::{Millionths, narrow, rsh};
use crate::num::tables::{FACTOR_BITS, Quantiles, SpreadLaw};

/// How cells forget.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leakage {
    /// What is lost of the distance to the level of rest at a look, in 2^-32.
    pub lost: u32,
    /// Writes of an array from one look to the next.
    pub every: u32,
    /// Where cells come to rest, as a share of their window.
    pub rest: Millionths,
    /// Standard deviation of what is lost, from cell to cell.
    pub spread: Millionths,
}

/// The same, ready to be applied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leaks {
    lost: u32,
    /// Writes from one look to the next.
    pub every: u32,
    rest: i64,
    spread: Option<Quantiles>,
}

impl Leakage {
    /// Sub of the words of its cells, beside those of [`Device`](super::Device).
    pub const SUB: u32 = 5;
    /// Writes between two looks, at most.
    pub const EVERY_MAX: u32 = 1 << 20;

    /// Made ready.
    #[must_use]
    pub fn ready(&self) -> Leaks {
        let spread = (self.spread.0 != 0).then(|| Quantiles::new(SpreadLaw::Normal, self.spread));
        let rest = (self.rest.0 * (1 << 16) + 500_000) / 1_000_000;
        Leaks { lost: self.lost, every: self.every, rest, spread }
    }
}

impl Leaks {
    /// Whether cells differ in what they lose.
    #[must_use]
    pub const fn differs(&self) -> bool {
        self.spread.is_some()
    }

    /// What a cell of this word loses at a look.
    #[must_use]
    pub fn lost(&self, word: u32) -> u32 {
        let Some(spread) = &self.spread else { return self.lost };
        let lost = rsh(i128::from(self.lost) * i128::from(spread.factor(word)), FACTOR_BITS);
        u32::try_from(lost).unwrap_or(u32::MAX)
    }

    /// What a level becomes at a look of a cell that loses so much, by its word.
    #[must_use]
    pub fn after(&self, level: u16, [floor, ceiling]: [u16; 2], lost: u32, word: u32) -> u16 {
        let (level, floor) = (i64::from(level), i64::from(floor));
        let rest = floor + rsh(self.rest * (i64::from(ceiling) - floor), 16);
        let gone = ((level - rest) * i64::from(lost) + i64::from(word)) >> 32;
        narrow(level - gone, "between where it was and where it rests")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaks(lost: u32, rest: i64) -> Leaks {
        let (rest, spread) = (Millionths(rest), Millionths(0));
        Leakage { lost, every: 1, rest, spread }.ready()
    }

    /// Fails when a fraction of a level is lost always or never, when cells pass by their level of rest, or leave the window.
    #[test]
    fn cells_come_to_rest_and_lose_fractions_by_chance() {
        let law = leaks(1 << 30, 500_000);
        let window = [10, 110];
        assert_eq!(
            [0, 1 << 31, u32::MAX].map(|word| law.after(60, window, 1 << 30, word)),
            [60; 3]
        );
        // 40 above: 10 a look
        assert_eq!([0, u32::MAX].map(|word| law.after(100, window, 1 << 30, word)), [90; 2]);
        assert_eq!([0, u32::MAX].map(|word| law.after(20, window, 1 << 30, word)), [30; 2]);
        // 1 above: a quarter of a level
        let kept = |level: u16| {
            let stays = |i: &u32| law.after(level, window, 1 << 30, i << 26) == level;
            (0..64u32).filter(stays).count()
        };
        assert_eq!((kept(61), kept(59)), (48, 48));
        for level in 10..=110 {
            for (lost, word) in [(u32::MAX, 0), (u32::MAX, u32::MAX), (1, 0), (1, u32::MAX)] {
                let after = law.after(level, window, lost, word);
                let between = level.min(60)..=level.max(60);
                assert!(between.contains(&after), "{level} {lost} {word}: {after}");
            }
        }
        assert_eq!(leaks(u32::MAX, 0).after(200, [0, 255], u32::MAX, 1 << 31), 0);
    }

    #[test]
    fn losses_spread_about_the_mean() {
        let (rest, spread) = (Millionths(0), Millionths(300_000));
        let law = Leakage { lost: 1_000_000, every: 1, rest, spread }.ready();
        assert!(law.lost(1 << 31).abs_diff(1_000_000) <= 1);
        assert!(law.lost(1 << 30).abs_diff(797_653) <= 30, "1 - 0.3 x 0.67449");
        assert_eq!(
            Leakage { lost: u32::MAX, every: 1, rest, spread }.ready().lost(u32::MAX),
            u32::MAX
        );
    }
}
