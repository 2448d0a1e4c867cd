//! The levels of a fresh array, drawn by place.
//!
//! ```text
//! uniform      level = clamp( (u G + (r << 16)) >> 32, floor, ceiling )            u, r: 16-bit words at sub 0 and sub 1
//! Gaussian     level = clamp( (h_(u >> 4) G + (r << 12)) >> 28, floor, ceiling )   h: an absolute Gaussian, 12 fractional bits
//! G          = floor( 2^16 gain 2^level_bits / (weight_max sqrt(fan_in)) + 1/2 )   gain n / d, times 1 / sqrt 2 of a Gaussian
//! ```
//!
//! `G` is exact, by integer square root. See docs/MODEL.md, 3.6.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::Window;
use super::layout::Layout;
use crate::num::draw::{Place, Site};

/// How the words of a cell become its level.
#[derive(Debug, Clone, Copy)]
pub enum InitialLaw<'a> {
    /// Evenly, with `G`.
    Uniform(u64),
    /// The absolute value of a Gaussian, with `G` and the table of `h`.
    AbsGaussian(u64, &'a [u16]),
}

impl InitialLaw<'_> {
    /// What a cell of words `u` and `r` wants to be.
    fn level(self, u: u16, r: u16) -> u64 {
        match self {
            Self::Uniform(scale) => (u64::from(u) * scale + (u64::from(r) << 16)) >> 32,
            Self::AbsGaussian(scale, half) => {
                let h = u64::from(half[usize::from(u >> 4)]);
                (h * scale + (u64::from(r) << 12)) >> 28
            }
        }
    }
}

/// The levels of a fresh array. Calls `row` with each row of levels.
///
/// # Panics
/// When the table of a Gaussian has not 4,096 entries.
pub fn initial_levels(
    layout: Layout,
    window: Window,
    law: InitialLaw<'_>,
    place: Place,
    mut row: impl FnMut(usize, &[u16]),
) {
    debug_assert!(place.site == Site::InitialLevels && place.count == 0);
    let words = |sub: u32, column, group| Place { sub, ..place }.halves(layout.rows, column, group);
    let mut levels = vec![0; 32 * layout.columns];
    for group in 0..layout.rows.div_ceil(32) {
        for column in 0..layout.columns {
            let (u, r) = (words(0, column, group), words(1, column, group));
            for i in 0..32 {
                let ceiling = u64::from(window.ceiling());
                let held = law.level(u[i], r[i]).clamp(u64::from(window.floor()), ceiling);
                levels[i * layout.columns + column] = u16::try_from(held).expect("in the window");
            }
        }
        for (i, levels) in levels.chunks(layout.columns).enumerate() {
            if group * 32 + i < layout.rows {
                row(group * 32 + i, levels);
            }
        }
    }
}

/// `G` for a gain of `n / d`; `halved` takes `1 / sqrt 2` of it.
///
/// # Panics
/// When the gain has no denominator.
#[must_use]
pub fn initial_scale(
    [n, d]: [u32; 2],
    halved: bool,
    level_bits: u32,
    weight_max_log2: i32,
    fan_in: usize,
) -> u64 {
    // y = floor(2 A / sqrt(f)) with A = 2^16 gain 2^level_bits / weight_max; G = floor((y + 1) / 2)
    let exponent =
        2 * (17 + i64::from(level_bits) - i64::from(weight_max_log2)) - i64::from(halved);
    let divisor = u128::from(d).pow(2) * fan_in as u128;
    let exponent = u32::try_from(exponent).expect("weight_max is at most 256");
    let y = ((u128::from(n).pow(2) << exponent) / divisor).isqrt();
    u64::try_from(y.div_ceil(2)).expect("at most 2^47")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_initial_scale_is_rounded_to_nearest() {
        let uniform =
            |gain, bits, log2, fan_in| initial_scale([gain, 64], false, bits, log2, fan_in);
        // gain 3/2, 8 bits, weight_max 4, fan_in 784: 65536 * 1.5 * 64 / 28 = 224694.857
        assert_eq!(uniform(96, 8, 2, 784), 224_695);
        // gain 1, 8 bits, weight_max 2, fan_in 4: 65536 * 128 / 2
        assert_eq!(uniform(64, 8, 1, 4), 65536 * 64);
        // 65536 * 256 / sqrt(2) = 11863283.2
        assert_eq!(uniform(64, 8, 0, 2), 11_863_283);
        // a tenth of 1 / sqrt 2, weight_max 1/4, fan_in 64: 65536 * 1024 / (10 sqrt 2 8) = 593164.2
        assert_eq!(initial_scale([1, 10], true, 8, -2, 64), 593_164);
        assert_eq!(initial_scale([1, 1], true, 8, 0, 1), uniform(64, 8, 0, 2));
    }

    proptest! {
        /// `G - 1/2 <= A / sqrt(f) < G + 1/2`, squared and without fractions.
        #[test]
        fn the_initial_scale_is_the_nearest_integer(
            n in 1u32..=1024, d in 1u32..=1024, halved: bool,
            level_bits in 1u32..=12, log2 in -8i32..=8, fan_in in 1usize..=65_535,
        ) {
            let g = u128::from(initial_scale([n, d], halved, level_bits, log2, fan_in));
            let twice = 2 * (17 + i64::from(level_bits) - i64::from(log2)) - i64::from(halved);
            let square = u128::from(n).pow(2) << twice;
            let of = |half: u128| half.pow(2) * u128::from(d).pow(2) * fan_in as u128;
            prop_assert!(square < of(2 * g + 1));
            prop_assert!(g == 0 || square >= of(2 * g - 1));
        }

        #[test]
        fn a_gaussian_level_is_its_mean_with_a_dither(u: u16, r: u16, scale in 1u64..1 << 34) {
            let table: Vec<u16> = (0..4096).map(|i| i * 3).collect();
            let level = InitialLaw::AbsGaussian(scale, &table).level(u, r);
            let exact = u128::from(table[usize::from(u) / 16]) * u128::from(scale);
            prop_assert_eq!(u128::from(level), (exact + (u128::from(r) << 12)) / (1 << 28));
        }
    }
}
