//! What cells remember beside their level, as the law of a chip: how many pulses they take, what stands beside what a write
//! left, how they forget.
//!
//! ```text
//! write noise    after a write, of every cell that was sent a pulse and is free:
//! level  = clamp( ((left << 20) + g sd + (r << 4)) >> 20, floor, ceiling )      of the cell's own window
//! sd     = floor(2^8 N share + 1/2), N = ceiling - floor of the chip's window
//! g, r   : 16-bit words at site 18, sub 0 and 1, count as at site 0;  g with 12 fractional bits
//! ```
//!
//! `left` is what pulses left: the next pulse begins there, reads see `level`. See docs/MODEL.md, 3.16.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::sync::Arc;

use super::{Ages, Leaks, Limits, Worn};
use crate::num::fixed::Millionths;
use crate::num::tables::Gaussian;

/// Noise that a write leaves beside a level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WriteNoise {
    gaussian: Arc<Gaussian>,
    /// Standard deviation in levels, 8 fractional bits.
    sd: i64,
}

impl WriteNoise {
    /// Of a share of a window of so many levels.
    #[must_use]
    pub fn new(gaussian: Arc<Gaussian>, share: Millionths, span: u16) -> Self {
        let sd = (share.0 * (i64::from(span) << 8) + 500_000) / 1_000_000;
        Self { gaussian, sd }
    }

    /// What stands where pulses left a level, by the words of the cell.
    #[must_use]
    pub fn beside(&self, left: u16, [g, r]: [u16; 2], [floor, ceiling]: [u16; 2]) -> u16 {
        let off = self.gaussian.of(g) * self.sd + (i64::from(r) << 4);
        let level = ((i64::from(left) << 20) + off) >> 20;
        u16::try_from(level.clamp(floor.into(), ceiling.into())).expect("inside the window")
    }
}

/// What the cells of a chip remember.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MemoryLaw {
    /// How many pulses they take, and where they stay then.
    pub endurance: Option<(Worn, Limits)>,
    /// What writes leave beside a level.
    pub write_noise: Option<WriteNoise>,
    /// How they forget.
    pub leakage: Option<Leaks>,
    /// How they drift since they were written.
    pub ageing: Option<Ages>,
}

impl MemoryLaw {
    /// Whether they remember nothing.
    #[must_use]
    pub const fn is_nothing(&self) -> bool {
        let quiet = self.write_noise.is_none() && self.leakage.is_none();
        quiet && self.endurance.is_none() && self.ageing.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The moments are looked at in tests/it/memory.rs.
    #[test]
    fn what_stands_beside_a_level_lies_about_it_and_inside_the_window() {
        let noise = WriteNoise::new(Arc::new(Gaussian::new()), Millionths(20_000), 1000);
        // the middle of a Gaussian is nearly 0, and what is left of it is rounded by the word
        assert_eq!([0, 0xf000].map(|r| noise.beside(500, [0, r], [0, 1000])), [500; 2]);
        let far = [0xfffe, 0xffff].map(|g| noise.beside(500, [g, 0], [0, 1000]));
        assert!((572..=577).contains(&far[0]) && (422..=428).contains(&far[1]), "{far:?}");
        assert_eq!(noise.beside(2, [0xffff, 0], [1, 1000]), 1);
        assert_eq!(noise.beside(999, [0xfffe, 0], [1, 1000]), 1000);
    }
}
