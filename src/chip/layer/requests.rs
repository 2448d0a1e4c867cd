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
//! A is the mean drive of a row of a set of drives, with 4 fractional bits, 0 ..= 16 x 255, or -16 x 255 ..= 16 x 255 where
//! drives have a sign. Of differential pairs, each
//! cell takes the sign of its own polarity, with `k + 1`. State: A. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::borrow::Cow;

use crate::chip::crossbar::kernel::MEAN_BITS;
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_CELLS, HALF_COLUMNS, Layout};
use crate::chip::layer::{DrivenBy, LayerSpec};
use crate::chip::population::{Stream, Wiring};
use crate::chip::state::{Piece, Section, StateError, Visitor};
use crate::num::fixed::rsh;

mod rms;

pub use rms::Followed;

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
    /// The sum, scaled so that the layer's root mean square asks for a given number of levels.
    Rms,
    /// An accumulator a cell, which forgets `2^-decay` of itself at a write.
    Momentum {
        /// 1..=8.
        decay: u32,
    },
    /// The mean of a cell's sums in units of the root of the mean of their squares.
    AdamFx {
        /// The mean of sums forgets `2^-first_decay` of itself at a write: 1..=8.
        first_decay: u32,
        /// The mean of squares forgets `2^-second_decay`: 1..=8.
        second_decay: u32,
    },
}

impl Optimiser {
    /// Greatest decay.
    pub const DECAY_MAX: u32 = 8;

    /// Whether it asks for a whole number of pulses by itself, so that nothing is rounded.
    #[must_use]
    pub const fn is_sign(self) -> bool {
        matches!(self, Self::Sign { .. })
    }

    /// Whether it looks at the sums of a whole layer before it asks for anything.
    #[must_use]
    pub const fn looks_at_layer(self) -> bool {
        matches!(self, Self::Sign { dead_zone: true } | Self::Rms)
    }

    /// Whether it looks at those of pathways that inhibit, too.
    #[must_use]
    pub const fn looks_at_all(self) -> bool {
        matches!(self, Self::Sign { dead_zone: true })
    }

    /// Words that it keeps of every cell, and the bits of both together.
    #[must_use]
    pub const fn memory(self) -> (usize, u32) {
        match self {
            Self::Plain | Self::Sign { .. } | Self::Rms => (0, 0),
            Self::Momentum { decay } => (1, 33 + decay),
            Self::AdamFx { first_decay, second_decay } => (2, 29 + first_decay + 55 + second_decay),
        }
    }

    /// Beats that a row of cells takes beyond the one in which its increments are computed: a root and a division.
    #[must_use]
    pub const fn beats(self) -> u64 {
        if matches!(self, Self::AdamFx { .. }) { 32 } else { 0 }
    }
}

/// The optimiser of a layer, and what it and centring remember.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Requests {
    /// What makes requests of sums.
    pub optimiser: Optimiser,
    /// `w`, where updates are centred: that many samples, as a power of two, move a mean by what it is off.
    pub window_log2: Option<u32>,
    /// `A` by set of drives and row, padded, or channel of what a window moves over, the constant row behind; empty where
    /// updates are not centred.
    pub(crate) means: [Vec<i32>; 2],
    /// Whether codes, and so their means, have a sign.
    signed: bool,
    /// The scale of the layer, of `rms`.
    pub(crate) followed: Followed,
    /// Words of each array, first and second, one a cell where sums lie (`crossbar::optimise`), padded.
    pub(crate) words: Vec<[Vec<i64>; 2]>,
}

impl Requests {
    /// Sums as they are.
    pub(super) const PLAIN: Self = Self {
        optimiser: Optimiser::Plain,
        window_log2: None,
        means: [vec![], vec![]],
        signed: false,
        followed: Followed::NOTHING,
        words: vec![],
    };

    /// Whether sums are asked for as they are, all at once.
    #[must_use]
    pub fn are_plain(&self) -> bool {
        self.optimiser == Optimiser::Plain && self.window_log2.is_none()
    }

    /// Requests by an optimiser, over arrays of a layout. What was remembered is forgotten.
    pub(crate) fn set_optimiser(&mut self, optimiser: Optimiser, wiring: Wiring, layout: Layout) {
        self.optimiser = optimiser;
        self.followed = Followed::NOTHING;
        let kept = optimiser.memory().0;
        let plane = |word| if word < kept { vec![0; layout.cells_padded()] } else { vec![] };
        self.words = wiring.pathways().iter().map(|_| [plane(0), plane(1)]).collect();
    }

    /// Centres updates with a window, of a layer of so many padded rows.
    pub(crate) fn set_window(&mut self, window_log2: Option<u32>, spec: &LayerSpec, rows: usize) {
        self.window_log2 = window_log2;
        self.signed = spec.driven_by == DrivenBy::Signed;
        self.means = [vec![], vec![]];
        let channels = spec.convolution.map(|s| s.channels + usize::from(spec.constant_row));
        if window_log2.is_some() {
            let means = vec![0; channels.unwrap_or(rows)];
            spec.drive_sets().iter().for_each(|set| self.means[set.index()] = means.clone());
        }
    }

    /// The mean drive of each row, padded, by set of drives; nothing where updates are not centred.
    pub(crate) fn by_row(&self, spec: &LayerSpec, rows: usize) -> [Cow<'_, [i32]>; 2] {
        self.means.each_ref().map(|means| match spec.convolution {
            Some(shape) if !means.is_empty() => {
                let windows = means[..shape.channels].iter().cycle().take(spec.inputs);
                let mut by_row: Vec<_> = windows.chain(&means[shape.channels..]).copied().collect();
                by_row.resize(rows, 0);
                Cow::Owned(by_row)
            }
            _ => Cow::Borrowed(&means[..]),
        })
    }

    /// Mean drives of the rows of a set, with 4 fractional bits, of a convolution those of the channels below it; empty where
    /// updates are not centred. Rows that do not exist have 0.
    #[must_use]
    pub fn means(&self, set: Stream) -> &[i32] {
        &self.means[set.index()]
    }

    /// The scale of the layer, of `rms`.
    #[must_use]
    pub const fn followed(&self) -> Followed {
        self.followed
    }

    /// A word, 0 or 1, of every cell of an array, row-major; empty where there is none.
    #[must_use]
    pub fn words(&self, array: usize, word: usize, layout: Layout) -> Vec<i64> {
        match self.words.get(array) {
            Some(words) if !words[word].is_empty() => {
                places(layout).map(|at| words[word][at]).collect()
            }
            _ => vec![],
        }
    }

    /// Shows what is remembered of a layer whose arrays have these names.
    pub(super) fn visit(
        &mut self,
        layer: &str,
        (wiring, layout): (Wiring, Layout),
        visitor: &mut dyn Visitor,
    ) -> Result<(), StateError> {
        if self.optimiser == Optimiser::Rms {
            let piece = Piece {
                name: &format!("{layer}.rms"),
                section: Some(Section::Optimiser),
                within: -1..=i64::MAX,
            };
            if let Some(new) =
                visitor.numbers(&piece, &[self.followed.power, self.followed.ends])?
            {
                // squares are below 2^128
                self.followed = Followed { power: new[0].min(128 << 8), ends: new[1].max(0) };
            }
        }
        for (array, pathway) in wiring.pathways().iter().enumerate() {
            for (word, name) in ["moment", "square"].into_iter().enumerate() {
                let now = self.words(array, word, layout);
                if now.is_empty() {
                    continue;
                }
                // a moment is below 2^(32 + 8), a mean square below 2^(55 + 8)
                let within = [-(1 << 40)..=1 << 40, 0..=i64::MAX][word].clone();
                let piece = Piece {
                    name: &format!("{layer}.{}.{name}", pathway.name),
                    section: Some(Section::Optimiser),
                    within,
                };
                if let Some(new) = visitor.numbers(&piece, &now)? {
                    let cells = &mut self.words[array][word];
                    places(layout).zip(new).for_each(|(at, new)| cells[at] = new);
                }
            }
        }
        for (means, set) in self.means.iter_mut().zip(["p", "n"]) {
            let most = 255 << MEAN_BITS;
            // padded where they are of rows
            let kept = means.len().min(layout.rows);
            let Some(means) = means.get_mut(..kept).filter(|means| !means.is_empty()) else {
                continue;
            };
            let piece = Piece {
                name: &format!("{layer}.row_means.{set}"),
                section: Some(Section::RowMeans),
                within: if self.signed { -most..=most } else { 0..=most },
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

/// Places of the cells of an array, row-major, among its kept sums.
fn places(layout: Layout) -> impl Iterator<Item = usize> {
    let cells = (0..layout.rows).flat_map(move |r| (0..layout.columns).map(move |c| (r, c)));
    cells.map(move |(row, column)| {
        let half = layout.index(row, column) / HALF_CELLS;
        half * HALF_CELLS + row % BLOCK_ROWS * HALF_COLUMNS + column % HALF_COLUMNS
    })
}

/// A mean before the first write: that of `samples` samples whose codes add up to `codes`.
#[must_use]
pub fn first_mean(codes: i64, samples: i64) -> i64 {
    (2 * (codes << MEAN_BITS) + samples).div_euclid((2 * samples).max(1))
}

/// A mean after a write of `samples` samples whose codes add up to `codes`.
#[must_use]
pub fn next_mean(mean: i64, codes: i64, samples: i64, window_log2: u32) -> i64 {
    mean + rsh((codes << MEAN_BITS) - samples * mean, window_log2)
}

/// `t`: the least integer of at least 0 with `squares < cells 2^(2t+1)`.
#[must_use]
pub fn dead_zone(squares: u128, cells: u64) -> u32 {
    // sums are below 2^36
    (0..40).find(|t| squares < u128::from(cells) << (2 * t + 1)).unwrap_or(40)
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
