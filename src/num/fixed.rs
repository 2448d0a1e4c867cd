//! Rounding, saturation and checked widths.
//!
//! ```text
//! rsh(v, s) = (v + 2^(s-1)) >> s     arithmetic shift, halves toward +infinity;  rsh(v, 0) = v
//! sat_n(v)  = clamp(v, -(2^(n-1)-1), 2^(n-1)-1)     symmetric: -2^(n-1) never occurs
//! ```
//!
//! [`rsh`] and [`sat`] are the same law at every signed width; callers [`narrow`] where their plan proves the width. See
//! docs/MODEL.md, 0.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::fmt;

use num_traits::{PrimInt, Signed};

/// Arithmetic shift right by `shift`, halves toward plus infinity. Exact for every `v`: nothing is
/// added to `v` itself, so the rounding constant cannot wrap.
#[inline]
#[must_use]
pub fn rsh<T: PrimInt + Signed>(v: T, shift: u32) -> T {
    if shift == 0 {
        v
    } else if shift >= T::zero().count_zeros() {
        T::zero()
    } else {
        v.signed_shr(shift) + (v.signed_shr(shift - 1) & T::one())
    }
}

/// The same number in another width.
///
/// # Panics
/// When it does not fit: `why` says why it does.
#[inline]
#[must_use]
pub fn narrow<T: PrimInt>(v: impl PrimInt, why: &str) -> T {
    T::from(v).expect(why)
}

/// The largest magnitude that `bits` hold symmetrically: `2^(bits-1) - 1`.
#[inline]
#[must_use]
pub const fn rail(bits: u32) -> i64 {
    (1 << (bits - 1)) - 1
}

/// Clamps to the symmetric range of `bits`, at most those of `T`, and says whether that changed the value.
#[inline]
#[must_use]
pub fn sat<T: PrimInt + Signed>(v: T, bits: u32) -> (T, bool) {
    let rail = T::max_value().unsigned_shr(T::zero().count_zeros() - bits);
    let held = v.max(-rail).min(rail);
    (held, held != v)
}

/// `ceil(log2(n))`, 0 for 0 and 1.
#[must_use]
pub const fn log2_ceil(n: u64) -> u32 {
    if n <= 1 { 0 } else { 64 - (n - 1).leading_zeros() }
}

/// A number outside the range its name allows.
///
/// ```
/// use dalean::hardware::AdcBits;
///
/// assert_eq!(AdcBits::new(6)?.get(), 6);
/// assert_eq!(AdcBits::new(17).unwrap_err().to_string(), "`adc_bits` is 17, but must lie in 2..=16");
/// # Ok::<(), dalean::hardware::OutOfRange>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct OutOfRange {
    /// What the number is called in a configuration.
    pub name: &'static str,
    /// What was found.
    pub found: i64,
    /// Least allowed value.
    pub min: i64,
    /// Greatest allowed value.
    pub max: i64,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, found, min, max } = self;
        write!(f, "`{name}` is {found}, but must lie in {min}..={max}")
    }
}

impl std::error::Error for OutOfRange {}

/// A decimal number with six places behind the point, as files give it: an integer of millionths.
///
/// ```
/// use dalean::hardware::Millionths;
///
/// assert_eq!(Millionths(-1_790_000).to_string(), "-1.79");
/// assert_eq!(Millionths(3_000_000).to_string(), "3");
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Millionths(pub i64);

impl Millionths {
    /// One.
    pub const ONE: Self = Self(1_000_000);
}

impl fmt::Display for Millionths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sign, size) = (if self.0 < 0 { "-" } else { "" }, self.0.unsigned_abs());
        let text = format!("{sign}{}.{:06}", size / 1_000_000, size % 1_000_000);
        write!(f, "{}", text.trim_end_matches('0').trim_end_matches('.'))
    }
}

macro_rules! bounded {
    ($($(#[$doc:meta])* $name:ident = $key:literal in $min:literal ..= $max:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub struct $name(u32);

        impl $name {
            /// Least allowed value.
            pub const MIN: u32 = $min;
            /// Greatest allowed value.
            pub const MAX: u32 = $max;

            /// Checks `value` against the allowed range.
            ///
            /// # Errors
            /// When `value` lies outside `MIN..=MAX`.
            pub fn new(value: i64) -> Result<Self, OutOfRange> {
                match u32::try_from(value) {
                    Ok(v) if ($min..=$max).contains(&v) => Ok(Self(v)),
                    _ => Err(OutOfRange { name: $key, found: value, min: $min, max: $max }),
                }
            }

            /// The plain number.
            #[inline]
            #[must_use]
            pub const fn get(self) -> u32 {
                self.0
            }
        }
    )*};
}

bounded! {
    /// Bits of a stored level; one level stands for `weight_max / 2^bits`.
    LevelBits = "level_bits" in 1 ..= 12;
    /// Bits of a drive code, the number a row is driven with.
    DriveBits = "drive_bits" in 1 ..= 8;
    /// Bits of a converter on a column.
    AdcBits = "adc_bits" in 2 ..= 16;
    /// Bits of a table index; the table has `2^bits` entries.
    LutBits = "lut_bits" in 2 ..= 14;
    /// Bits of an error word, sign included.
    ErrorBits = "error_bits" in 2 ..= 9;
    /// Largest number of pulses one write gives a cell.
    IncrementMax = "increment_max" in 1 ..= 127;
    /// Fractional bits of the persistent remainder behind a cell.
    ResidualBits = "residual_bits" in 0 ..= 15;
    /// Small factor of the rate beside the shift.
    RateMantissa = "rate_mantissa" in 1 ..= 15;
    /// Samples in one update; bounded so that 32-bit sums are exact (see `chip::layer`).
    Batch = "batch" in 1 ..= 4096;
}

impl LevelBits {
    /// The greatest level, `2^bits - 1`.
    #[must_use]
    pub const fn level_max(self) -> u16 {
        ((1u32 << self.0) - 1) as u16
    }
}

impl DriveBits {
    /// The greatest drive code, `2^bits - 1`.
    #[must_use]
    pub const fn code_max(self) -> u8 {
        ((1u32 << self.0) - 1) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn halves_go_up_on_both_sides_of_zero() {
        assert_eq!([-3, -2, -1, 0, 1, 2, 3].map(|v| rsh(v, 1)), [-1, -1, 0, 0, 1, 1, 2]);
        assert_eq!([-6, -5, 5, 6].map(|v| rsh(v, 2)), [-1, -1, 1, 2]);
        assert_eq!(rsh(-7, 0), -7);
        assert_eq!((rsh(i64::MAX, 1), rsh(i64::MIN, 63)), (1 << 62, -1));
        assert_eq!((rsh(i32::MAX, 1), rsh(i32::MIN, 31), rsh(i32::MIN, 32)), (1 << 30, -1, 0));
        assert_eq!((rsh(i128::MAX, 1), rsh(i128::MIN, 127), rsh(3i8, 1)), (1 << 126, -1, 2));
        assert_eq!((rsh(i64::MAX, 63), rsh(i64::MIN, 64), rsh(i64::MAX, 64)), (1, 0, 0));
    }

    #[test]
    fn saturation_is_symmetric_and_says_when_it_changed_something() {
        assert_eq!(
            [-128, -127, 127, 128].map(|v| sat(v, 8)),
            [(-127, true), (-127, false), (127, false), (127, true)]
        );
        assert_eq!(
            [-2, -1, 1, 2].map(|v| sat(v, 2)),
            [(-1, true), (-1, false), (1, false), (1, true)]
        );
    }

    #[test]
    fn a_rail_is_the_same_at_every_width() {
        for bits in 1..=8 {
            let rail = rail(bits);
            assert_eq!([sat(i64::MAX, bits).0, sat(i64::MIN, bits).0], [rail, -rail]);
            assert_eq!(i64::from(sat(i8::MIN, bits).0), -rail);
            assert_eq!(i128::from(rail), sat(i128::MAX, bits).0);
        }
        assert_eq!((sat(i64::MIN, 64), sat(i64::MAX, 64)), ((-i64::MAX, true), (i64::MAX, false)));
    }

    #[test]
    #[should_panic(expected = "a byte holds it")]
    fn what_does_not_fit_is_never_wrapped() {
        assert_eq!(narrow::<u8>(255i64, "it fits"), 255);
        let _: u8 = narrow(-1i64, "a byte holds it");
    }

    #[test]
    fn log2_ceil_at_powers_and_beside_them() {
        assert_eq!([0, 1, 2, 3, 4, 5, 8, 9].map(log2_ceil), [0, 0, 1, 2, 2, 3, 3, 4]);
    }

    #[test]
    fn widths_are_refused_one_beyond_each_end() {
        assert!(LevelBits::new(0).is_err() && LevelBits::new(13).is_err());
        assert_eq!(LevelBits::new(1).unwrap().level_max(), 1);
        assert_eq!(LevelBits::new(12).unwrap().level_max(), 4095);
        assert_eq!(DriveBits::new(8).unwrap().code_max(), 255);
        let error = ErrorBits::new(10).unwrap_err();
        assert_eq!(error.to_string(), "`error_bits` is 10, but must lie in 2..=9");
    }

    proptest! {
        #[test]
        fn rsh_is_the_equation(v in -(1i64 << 60)..(1i64 << 60), s in 1u32..60) {
            let equation = (i128::from(v) + (1i128 << (s - 1))) >> s;
            prop_assert_eq!((i128::from(rsh(v, s)), rsh(i128::from(v), s)), (equation, equation));
        }
    }
}
