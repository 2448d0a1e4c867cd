//! Endurance: a cell takes so many pulses, and then it moves no more.
//!
//! ```text
//! limit   L = clamp( rsh(pulses F, 24), 1, 2^32 - 1 )      F: a log-normal factor of the cell's 32-bit word at site 3, sub 4
//! pulses  of p pulses of a write the first max(0, L - c) move the cell, c those that it was sent before;  c' = c + p
//! worn    c >= L: it stays at its level, or goes to the floor or the ceiling of its own window, and to writes it is as a stuck cell
//! load    counts as a pulse; that which wears a cell out still loads it
//! ```
//!
//! The count is state, the limit a function of the place. See docs/MODEL.md, 3.16.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::{Millionths, rsh};
use crate::num::tables::{FACTOR_BITS, Quantiles, SpreadLaw};

/// Where a cell stays that is worn out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Worn {
    /// Where it is.
    Level,
    /// At its floor.
    Floor,
    /// At its ceiling.
    Ceiling,
}

impl Worn {
    /// The level at which a cell stays that wears out at a level, of a window.
    #[must_use]
    pub const fn level(self, level: u16, [floor, ceiling]: [u16; 2]) -> u16 {
        match self {
            Self::Level => level,
            Self::Floor => floor,
            Self::Ceiling => ceiling,
        }
    }
}

/// How many pulses cells take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Endurance {
    /// Those of the cell in the middle.
    pub pulses: u32,
    /// Standard deviation of the logarithm, from cell to cell.
    pub spread: Millionths,
    /// What becomes of a cell that has taken as many as it does.
    pub worn: Worn,
}

/// Numbers of pulses by the word of a cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    pulses: u32,
    spread: Option<Quantiles>,
}

impl Endurance {
    /// Sub of the words of its cells, beside those of [`Device`](super::Device).
    pub const SUB: u32 = 4;

    /// Its limits.
    #[must_use]
    pub fn limits(&self) -> Limits {
        let spread =
            (self.spread.0 != 0).then(|| Quantiles::new(SpreadLaw::LogNormal, self.spread));
        Limits { pulses: self.pulses, spread }
    }
}

impl Limits {
    /// How many pulses a cell of this word takes.
    #[must_use]
    pub fn of(&self, word: u32) -> u32 {
        let Some(spread) = &self.spread else { return self.pulses.max(1) };
        let limit = rsh(i128::from(self.pulses) * i128::from(spread.factor(word)), FACTOR_BITS);
        u32::try_from(limit.max(1)).unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_log_normal_about_the_middle() {
        let of = |pulses, spread| {
            let spread = Millionths(spread);
            Endurance { pulses, spread, worn: Worn::Level }.limits()
        };
        assert_eq!([0, u32::MAX].map(|word| of(1000, 0).of(word)), [1000; 2]);
        let limits = of(1_000_000, 500_000);
        // 10^6 e^(q / 2), q = PHI^-1 of 1/2, 1/4 and 1/1024: 0, -0.674490, -3.097269
        for (word, want) in [(1u32 << 31, 1_000_000u32), (1 << 30, 713_735), (1 << 22, 212_538)] {
            assert!(limits.of(word).abs_diff(want) <= 2, "{word}: {}", limits.of(word));
        }
        assert_eq!(of(1, 2_000_000).of(0), 1, "a cell takes a pulse");
        assert_eq!(of(u32::MAX, 2_000_000).of(u32::MAX), u32::MAX);
    }
}
