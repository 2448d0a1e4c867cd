//! `rms`: one scale a layer, which follows the size of its sums.
//!
//! ```text
//! Z    sum of sum^2 over the cells of the layer's excitatory pathways, of both streams; inhibitory ones use the same scale
//! R    floor(log2 Z) << 8 at the first Z above 0, later  R += rsh( (floor(log2 Z) << 8) - R, 4 );   Z = 0 leaves it
//! X    ((R + 128) >> 1) + (what UPD has in the place of k) - 2^14        256ths of a doubling
//! request = sum m, k = e + s      of X as `Scales` has them;  none where Z = 0
//! ```
//!
//! No logarithm and no division: the place of the leading bit, and a table. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::rsh;
use crate::num::tables::{Factor, Scales};

/// What `rms` remembers of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Followed {
    /// `R`, 8 fractional bits; -1 before the first sum that is not 0.
    pub power: i64,
    /// Writes whose factor lay outside what mantissas and shifts can give.
    pub ends: i64,
}

impl Followed {
    pub(super) const NOTHING: Self = Self { power: -1, ends: 0 };

    /// Follows the squares of a write. The factor of its sums, or none where there are no sums.
    pub(crate) fn follow(&mut self, squares: u128, shift: u32, scales: &Scales) -> Option<Factor> {
        let now = i64::from(squares.checked_ilog2()?) << 8;
        self.power = if self.power < 0 { now } else { self.power + rsh(now - self.power, 4) };
        let scale = scales.at(((self.power + 128) >> 1) + i64::from(shift) - (1 << 14));
        self.ends += i64::from(scale.held);
        Some(scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_follows_a_sixteenth_of_the_way_and_keeps_through_silence() {
        let (mut state, scales) = (Followed::NOTHING, Scales::new());
        assert_eq!(state.follow(0, 0, &scales), None);
        assert_eq!(state, Followed::NOTHING);
        // 2^20: 10 doublings of a root, and half of one for the floor's half
        let scale = state.follow((1 << 20) + 5, 1 << 14, &scales).unwrap();
        assert_eq!((state.power, scale), (20 << 8, scales.at(10 * 256 + 64)));
        assert_eq!(state.follow(0, 0, &scales), None);
        state.follow(1 << 36, 1 << 14, &scales);
        assert_eq!((state.power, state.ends), (21 << 8, 0));
        // the end of shifts: 2^14 more
        assert!(state.follow(1 << 21, 1 << 15, &scales).unwrap().held);
        assert_eq!(state.ends, 1);
    }
}
