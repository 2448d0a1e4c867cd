//! Drift of levels between programming and reading, at one moment.
//!
//! ```text
//! g, r    = words of 16 bits of the cell at site 6, sub 0 and 1: a Gaussian, and rounding
//! power   level' = (level f + r) >> 16            f = e_(frac >> 4, rounded) >> int of x = rsh(nu T, 16), nu = max(0, mean + rsh(g sd, 12))
//! log     level' = ((level << 16) + c + r) >> 16  c = mean + rsh(g sd, 12)
//! then    clamp(level', 0, greatest)              also below the floor: the window is one of programming
//! ```
//!
//! Of cells that drift while they learn, tables are those of one doubling of time, and nu, or c, is taken as many times as time has doubled
//! between t0 and what has passed since the cell was written: see docs/MODEL.md, 3.16.
//!
//! Mean and sd are those of the level as it was programmed. Levels are the resolution: a fraction of one is kept with its chance. A
//! function of the place and the moment. See docs/MODEL.md, 3.13.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::Arc;

use crate::num::fixed::rsh;
use crate::num::tables::{DriftPace, DriftRates, DriftTables, Gaussian};

/// How levels drift while others are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ageing {
    /// By which law.
    pub rates: DriftRates,
    /// Doublings of time from the moment that levels are of, to the time a write of an array takes; 16 fractional bits.
    pub since: i64,
    /// Writes of an array from one look to the next.
    pub every: u32,
}

/// The same, ready to be applied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ages {
    pace: DriftPace,
    gaussian: Arc<Gaussian>,
    since: i64,
    /// Writes from one look to the next.
    pub every: u32,
}

impl Ageing {
    /// Doublings of time either way, at most.
    pub const SINCE_MAX: i64 = 100 << 16;
    /// Writes between two looks, at most.
    pub const EVERY_MAX: u32 = 1 << 20;

    /// Made ready for levels up to `greatest` on a chip of that ceiling.
    #[must_use]
    pub fn ready(&self, ends: [u16; 2]) -> Ages {
        let Self { rates, since, every } = *self;
        let gaussian = Arc::new(Gaussian::new());
        Ages { pace: DriftPace::new(&rates, ends), gaussian, since, every }
    }
}

impl Ages {
    /// What a level has become that pulses left so many writes ago, by the words of its cell, in its window.
    #[must_use]
    pub fn after(
        &self,
        (left, writes): (u16, u64),
        words: [u16; 2],
        [floor, ceiling]: [u16; 2],
    ) -> u16 {
        let times = self.since + self.pace.doublings(writes);
        if times <= 0 {
            return left;
        }
        let greatest = u16::MAX;
        let aged = self.pace.tables.aged_for(&self.gaussian, (left, times), words, greatest);
        aged.clamp(floor, ceiling)
    }
}

impl DriftTables {
    /// What a level has become, by the words of its cell.
    #[must_use]
    pub fn aged(&self, gaussian: &Gaussian, level: u16, words: [u16; 2], level_max: u16) -> u16 {
        self.aged_for(gaussian, (level, 1 << 16), words, level_max)
    }

    /// The same, so many times as many doublings of time later, 16 fractional bits.
    fn aged_for(
        &self,
        gaussian: &Gaussian,
        (level, times): (u16, i64),
        [g, r]: [u16; 2],
        level_max: u16,
    ) -> u16 {
        let (old, r) = (i64::from(level), i64::from(r));
        let moved = match self {
            Self::Power { exponents, doublings, powers } => {
                // of a chip with fewer levels, the greatest stands for those above
                let last = exponents.len() - 1;
                let [mean, sd] = exponents[usize::from(level).min(last)];
                let exponent = (mean + rsh(gaussian.of(g) * sd, 12)).max(0);
                let x = rsh(exponent * rsh(doublings * times, 16), 16);
                let (whole, part) = (x >> 16, rsh(x & 0xffff, 4));
                let factor = powers[usize::try_from(part).expect("a fraction")];
                let factor = i64::from(factor) >> whole.min(31);
                (old * factor + r) >> 16
            }
            Self::Log([mean, sd]) => {
                let change = mean + rsh(gaussian.of(g) * sd, 12);
                ((old << 16) + rsh(change * times, 16) + r) >> 16
            }
        };
        u16::try_from(moved.clamp(0, i64::from(level_max))).expect("inside a level")
    }
}
