//! How the sums of a layer become requests: its optimiser, whether its updates are centred, and what both remember.
//!
//! ```text
//! plain     request = sum                                                       rounded with 2^-k, mantissa and a word
//! sign      one pulse towards the sum where the cell's 16-bit word r < 2^(16-k);  none for a sum of 0, none for k > 16
//! dead zone t = least integer >= 0 with Z < n 2^(2t+1),  Z = sum of sum^2 over the n cells of the layer;
//!           no pulse where |sum| < 2^t
//! centred   sum' = (sum << 4) - A_r U_c              U_c = sum over the batch of gates of the column;  2^-(k+4) where k counts
//!           A += rsh( (sum of the row's drive codes << 4) - B' A, w )          after the write;  B' samples, B' <= 2^w
//!           A  = floor( (2 (sum of codes << 4) + B') / (2 B') )                before the first write of the layer
//! ```
//!
//! A is the mean drive of a row of a set of drives, with 4 fractional bits, 0 ..= 16 x 255. Of differential pairs, each
//! cell takes the sign of its own polarity, with `k + 1`. State: A. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::crossbar::kernel::MEAN_BITS;
use crate::chip::population::Stream;
use crate::chip::state::{Piece, Section, StateError, Visitor};
use crate::num::fixed::rsh;

/// What makes requests of sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Optimiser {
    /// The sum itself, scaled.
    Plain,
    /// A pulse towards the sum, with a chance of `2^-k`.
    Sign {
        /// Whether sums below the layer's root mean square, as a power of two, give none.
        dead_zone: bool,
    },
}

impl Optimiser {
    /// Whether it asks for a whole number of pulses by itself, so that nothing is rounded.
    #[must_use]
    pub const fn is_sign(self) -> bool {
        matches!(self, Self::Sign { .. })
    }

    /// Whether it looks at the sums of a whole layer before it asks for anything.
    #[must_use]
    pub const fn looks_at_layer(self) -> bool {
        matches!(self, Self::Sign { dead_zone: true })
    }
}

/// The optimiser of a layer, and what it and centring remember.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Requests {
    /// What makes requests of sums.
    pub optimiser: Optimiser,
    /// `w`, where updates are centred: that many samples, as a power of two, move a mean by what it is off.
    pub window_log2: Option<u32>,
    /// `A` by set of drives and row, padded; empty where updates are not centred.
    pub(crate) means: [Vec<i32>; 2],
}

impl Requests {
    /// Sums as they are.
    pub(super) const PLAIN: Self =
        Self { optimiser: Optimiser::Plain, window_log2: None, means: [vec![], vec![]] };

    /// Whether sums are asked for as they are, all at once.
    #[must_use]
    pub fn are_plain(&self) -> bool {
        self.optimiser == Optimiser::Plain && self.window_log2.is_none()
    }

    /// Centres updates with a window, over so many padded rows of these sets of drives.
    pub(crate) fn set_window(&mut self, window_log2: Option<u32>, sets: &[Stream], rows: usize) {
        self.window_log2 = window_log2;
        self.means = [vec![], vec![]];
        if window_log2.is_some() {
            sets.iter().for_each(|set| self.means[set.index()] = vec![0; rows]);
        }
    }

    /// Mean drives of the rows of a set, with 4 fractional bits; empty where updates are not centred. Rows that do not
    /// exist have 0.
    #[must_use]
    pub fn means(&self, set: Stream) -> &[i32] {
        &self.means[set.index()]
    }

    /// Shows the means of the `rows` rows that exist.
    pub(super) fn visit(
        &mut self,
        layer: &str,
        rows: usize,
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        for (means, set) in self.means.iter_mut().zip(["p", "n"]) {
            let Some(means) = means.get_mut(..rows) else { continue };
            let piece = Piece {
                name: &format!("{layer}.row_means.{set}"),
                section: Some(Section::RowMeans),
                within: 0..=255 << MEAN_BITS,
            };
            let now: Vec<i64> = means.iter().map(|&mean| mean.into()).collect();
            if let Some(new) = visitor.numbers(&piece, &now)? {
                means.iter_mut().zip(new).for_each(|(mean, new)| {
                    *mean = i32::try_from(new).expect("a visitor keeps to the range");
                });
            }
        }
        Ok(())
    }
}

/// A mean before the first write: that of `samples` samples whose codes add up to `codes`.
#[must_use]
pub fn first_mean(codes: i64, samples: i64) -> i64 {
    (2 * (codes << MEAN_BITS) + samples) / (2 * samples).max(1)
}

/// A mean after a write of `samples` samples whose codes add up to `codes`.
#[must_use]
pub fn next_mean(mean: i64, codes: i64, samples: i64, window_log2: u32) -> i64 {
    mean + rsh((codes << MEAN_BITS) - samples * mean, window_log2)
}

/// `t`: the least integer of at least 0 with `squares < cells 2^(2t+1)`.
#[must_use]
pub fn dead_zone(squares: u128, cells: u64) -> u32 {
    // squares are at most cells 2^62
    (0..32).find(|t| squares < u128::from(cells) << (2 * t + 1)).unwrap_or(32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_dead_zone_is_the_root_mean_square_to_the_nearest_power_of_two() {
        // one cell: 2^t lies within a factor of sqrt 2 of its size, and is never below 1
        let of = |sum: u128| dead_zone(sum * sum, 1);
        assert_eq!([0, 1, 2, 3, 5, 6, 11, 12].map(of), [0, 0, 1, 2, 2, 3, 3, 4]);
        // 4 cells of 0, 0, 0, 8: the root mean square is 4
        assert_eq!(dead_zone(64, 4), 2);
        assert_eq!(dead_zone(31, 4), 1, "4 x 2^3 is 32");
        assert_eq!(dead_zone(32, 4), 2);
        assert_eq!(dead_zone((1 << 62) * 9, 9), 31);
    }

    proptest! {
        #[test]
        fn a_dead_zone_brackets_the_mean_square(squares in 0u128..1 << 80, cells in 1u64..1 << 20) {
            prop_assume!(squares < u128::from(cells) << 62);
            let t = dead_zone(squares, cells);
            prop_assert!(squares < u128::from(cells) << (2 * t + 1));
            prop_assert!(t == 0 || squares >= u128::from(cells) << (2 * t - 1));
        }

        #[test]
        fn a_mean_stays_among_codes_and_comes_nearer(
            mean in 0i64..=4080, codes in prop::collection::vec(0i64..=255, 1..40), spare in 0u32..4,
        ) {
            let (sum, samples) = (codes.iter().sum::<i64>(), codes.len() as i64);
            let window = crate::num::fixed::log2_ceil(samples as u64) + spare;
            let next = next_mean(mean, sum, samples, window);
            let off = |mean: i64| (mean * samples - (sum << MEAN_BITS)).abs();
            prop_assert!((0..=4080).contains(&next));
            prop_assert!(off(next) <= off(mean) || off(next) * 2 <= samples, "{mean} {next}");
            let first = first_mean(sum, samples);
            prop_assert!((0..=4080).contains(&first) && off(first) * 2 <= samples);
        }
    }

    #[test]
    fn a_mean_of_nothing_is_0_and_stays() {
        assert_eq!((first_mean(0, 0), next_mean(77, 0, 0, 5)), (0, 77));
    }
}
