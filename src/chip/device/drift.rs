//! Drift of levels between programming and reading, at one moment.
//!
//! ```text
//! g, r    = words of 16 bits of the cell at site 6, sub 0 and 1: a Gaussian, and rounding
//! power   level' = (level f + r) >> 16            f = e_(frac >> 4, rounded) >> int of x = rsh(nu T, 16), nu = max(0, mean + rsh(g sd, 12))
//! log     level' = ((level << 16) + c + r) >> 16  c = mean + rsh(g sd, 12)
//! then    clamp(level', 0, level_max)             also below the floor: the window is one of programming
//! ```
//!
//! Mean and sd are those of the level as it was programmed. Levels are the resolution: a fraction of one is kept with its chance. A
//! function of the place and the moment. See docs/MODEL.md, 3.13.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::rsh;
use crate::num::tables::{DriftTables, Gaussian};

impl DriftTables {
    /// What a level has become, by the words of its cell.
    #[must_use]
    pub fn aged(&self, gaussian: &Gaussian, level: u16, [g, r]: [u16; 2], level_max: u16) -> u16 {
        let (old, r) = (i64::from(level), i64::from(r));
        let moved = match self {
            Self::Power { exponents, doublings, powers } => {
                let [mean, sd] = exponents[usize::from(level)];
                let exponent = (mean + rsh(gaussian.of(g) * sd, 12)).max(0);
                let x = rsh(exponent * doublings, 16);
                let (whole, part) = (x >> 16, rsh(x & 0xffff, 4));
                let factor = powers[usize::try_from(part).expect("a fraction")];
                let factor = i64::from(factor) >> whole.min(31);
                (old * factor + r) >> 16
            }
            Self::Log([mean, sd]) => ((old << 16) + mean + rsh(gaussian.of(g) * sd, 12) + r) >> 16,
        };
        u16::try_from(moved.clamp(0, i64::from(level_max))).expect("inside a level")
    }
}
