//! Fine numbers: what environments compute with, and the few functions that they need of them.
//!
//! ```text
//! Fine         64 bits, 32 of them behind the point; products round down
//! reciprocal   floor((2^64 - 1) / bits)                          within 2^-31 of 1 / x, for x >= 1/4
//! sin, cos     x = k pi/2 + r, |r| <= pi/4: the first terms of their series in r, in units of 2^-30,
//!              z = r^2:   sin r = r (1 - z/3! + z^2/5! - z^3/7! + z^4/9!)       left out: below 2^-29
//!                         cos r = 1 - z/2! + z^2/4! - z^3/6! + z^4/8! - z^5/10!  left out: below 2^-32
//!              within 2^-26 for |x| <= 64, since pi/2 is known to 2^-33 and k <= 41; within 2^-22 for |x| <= 1024
//! turned       x as it is from -pi to pi, else (x + pi) mod 2 pi - pi
//! shown        to the nearest Real, halves up, held at its ends
//! uniform      low + floor((high - low) word / 2^32)             one word, from `low` up to below `high`
//! ```
//!
//! See docs/MODEL.md, 5.4.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use fixed::types::I32F32;

use super::Real;

/// What environments compute with.
pub type Fine = I32F32;

/// Bits behind the point of the series.
const SERIES_BITS: u32 = 30;
const ONE: i64 = 1 << SERIES_BITS;

/// A number of a series times another: both at most 2 in size.
#[inline]
const fn times(a: i64, b: i64) -> i64 {
    (a * b) >> SERIES_BITS
}

/// `1 / x`.
///
/// # Panics
/// In a build with checks, when `x` is below 1/4: nothing here divides by less.
#[inline]
#[must_use]
pub fn reciprocal(x: Fine) -> Fine {
    debug_assert!(x >= Fine::lit("0.25"), "a divisor is at least 1/4");
    let quotient = u64::MAX / x.to_bits().unsigned_abs();
    Fine::from_bits(i64::try_from(quotient).expect("1 / x is at most 4"))
}

/// Sine and cosine of an angle in radians, at most 1024 in size.
#[inline]
#[must_use]
pub fn sin_cos(angle: Fine) -> (Fine, Fine) {
    debug_assert!(angle.abs() <= 1024, "an angle is at most 1024 radians");
    let quarters: i64 = (angle * Fine::FRAC_2_PI).round().to_num();
    let rest = angle.to_bits() - quarters * Fine::FRAC_PI_2.to_bits();
    let r = (rest + 2) >> (Fine::FRAC_NBITS - SERIES_BITS);
    let z = times(r, r);
    let sin = [ONE / 362_880, -ONE / 5_040, ONE / 120, -ONE / 6, ONE];
    let cos = [-ONE / 3_628_800, ONE / 40_320, -ONE / 720, ONE / 24, -ONE / 2, ONE];
    let sin = times(r, sin.into_iter().fold(0, |sum, factor| times(sum, z) + factor));
    let cos = cos.into_iter().fold(0, |sum, factor| times(sum, z) + factor);
    let (sin, cos) = match quarters & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    };
    let fine = |bits: i64| Fine::from_bits(bits << (Fine::FRAC_NBITS - SERIES_BITS));
    (fine(sin), fine(cos))
}

/// Sine alone.
#[inline]
#[must_use]
pub fn sin(angle: Fine) -> Fine {
    sin_cos(angle).0
}

/// Cosine alone.
#[inline]
#[must_use]
pub fn cos(angle: Fine) -> Fine {
    sin_cos(angle).1
}

/// The same direction, from -pi to pi.
#[inline]
#[must_use]
pub fn turned(angle: Fine) -> Fine {
    if angle.abs() <= Fine::PI {
        return angle;
    }
    (angle + Fine::PI).rem_euclid(Fine::TAU) - Fine::PI
}

/// As it is shown: to the nearest, halves up, held at the ends.
#[inline]
#[must_use]
pub fn shown(x: Fine) -> Real {
    const SHIFT: u32 = Fine::FRAC_NBITS - Real::FRAC_NBITS;
    let units = (x.to_bits() >> SHIFT) + (x.to_bits() >> (SHIFT - 1) & 1);
    let held = units.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
    Real::from_bits(i32::try_from(held).expect("it was held to 32 bits"))
}

/// An action's number in fine units, held to -1 ..= 1.
#[inline]
#[must_use]
pub fn taken(action: Real) -> Fine {
    Fine::from_num(action).clamp(Fine::NEG_ONE, Fine::ONE)
}

/// A number from `low` up to below `high`, from one word.
#[inline]
#[must_use]
pub fn uniform(word: u32, low: Fine, high: Fine) -> Fine {
    low + (high - low) * Fine::from_bits(i64::from(word))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `2^-bits`.
    fn small(bits: u32) -> Fine {
        Fine::from_bits(1 << (32 - bits))
    }

    #[test]
    fn quarters_of_a_turn_and_the_angles_everyone_knows() {
        let sixth = Fine::PI / 6;
        assert!((sin(sixth) - Fine::lit("0.5")).abs() < small(26));
        assert!((cos(sixth) - Fine::lit("0.8660254037844386")).abs() < small(26));
        for (quarters, (s, c)) in [(0, 1), (1, 0), (0, -1), (-1, 0), (0, 1)].into_iter().enumerate()
        {
            let angle = Fine::FRAC_PI_2 * Fine::from_num(quarters);
            let (sin, cos) = sin_cos(angle);
            assert!((sin - Fine::from_num(s)).abs() < small(26), "sin {angle}");
            assert!((cos - Fine::from_num(c)).abs() < small(26), "cos {angle}");
        }
    }

    #[test]
    fn a_turn_more_or_less_is_the_same_direction() {
        assert_eq!([Fine::PI, -Fine::PI].map(turned), [Fine::PI, -Fine::PI]);
        // pi and 2 pi are rounded each by itself
        assert!((turned(Fine::PI + Fine::DELTA) + Fine::PI).abs() <= small(31));
        assert!((turned(-Fine::PI - Fine::DELTA) - Fine::PI).abs() <= small(31));
        let direction = Fine::lit("2.5");
        for turns in -9..=9 {
            assert_eq!(turned(direction + Fine::TAU * turns), direction);
        }
    }

    #[test]
    fn what_is_shown_is_the_nearest_and_is_held() {
        let half = Fine::from_bits(1 << 15);
        assert_eq!(shown(half), Real::DELTA);
        assert_eq!(shown(half - Fine::DELTA), Real::ZERO);
        assert_eq!(shown(-half), Real::ZERO);
        assert_eq!(shown(-half - Fine::DELTA), -Real::DELTA);
        assert_eq!((shown(Fine::MAX), shown(Fine::MIN)), (Real::MAX, Real::MIN));
    }

    #[test]
    fn draws_reach_from_low_to_just_below_high() {
        let (low, high) = (Fine::lit("-0.05"), Fine::lit("0.05"));
        assert_eq!(uniform(0, low, high), low);
        assert!(uniform(u32::MAX, low, high) < high);
        assert!(high - uniform(u32::MAX, low, high) < small(30));
        assert!(uniform(1 << 31, low, high).abs() < small(30));
    }

    proptest! {
        /// (sin a cos b + cos a sin b, cos a cos b - sin a sin b) = (sin, cos)(a + b); with a + 0 this fixes the scale.
        #[test]
        fn angles_add(a in -(30_i64 << 32)..30 << 32, b in -(30_i64 << 32)..30 << 32) {
            let (a, b) = (Fine::from_bits(a), Fine::from_bits(b));
            let ((sa, ca), (sb, cb), (s, c)) = (sin_cos(a), sin_cos(b), sin_cos(a + b));
            prop_assert!((sa * cb + ca * sb - s).abs() < small(24), "{a} {b}");
            prop_assert!((ca * cb - sa * sb - c).abs() < small(24), "{a} {b}");
            prop_assert!((sa * sa + ca * ca - Fine::ONE).abs() < small(25), "{a}");
        }

        #[test]
        fn a_reciprocal_times_its_number_is_one(bits in 1_i64 << 30..1 << 40) {
            let x = Fine::from_bits(bits);
            let error = i128::from(reciprocal(x).to_bits()) * i128::from(bits) - (1 << 64);
            prop_assert!(error.abs() <= i128::from(bits), "{x}");
        }
    }
}
