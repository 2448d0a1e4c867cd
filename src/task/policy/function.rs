//! Functions that policies need, from tables: exponential, logarithm, inverse normal distribution, hyperbolic tangent.
//!
//! ```text
//! exp x      = 2^k exp2[f],            k + f = x log2(e), in 2^-30        relative error < 2^-22, |x| <= 32; below: as -32
//! ln m       = ln(2) (n + log2[f]),    m = 2^n (1 + f)                     error < 2^-22
//! normal(w)  = Phi^-1((w + 1/2) / 2^32)                                    error < 2^-16, at most 6.35 away from 0
//! tanh u     = sign(u) tanh[|u|],      |u| < 8 or taken as it              error < 2^-16
//! ```
//!
//! Tables are read along straight lines ([`PolicyTables`]). `exp 0` is exactly 1 and `ln 1` exactly 0; both functions, and
//! `tanh`, never fall where they should rise. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::number::{Logit, Normal, Real};
use crate::num::fixed::{narrow, rsh};
use crate::num::tables::PolicyTables;

/// `log2(e)` in 2^-31.
const LOG2_E: i64 = 3_098_164_009;
/// `ln(2)` in 2^-32.
const LN_2: i128 = 2_977_044_472;
/// The least number, in 2^-26, that `exp` tells from those below it.
const EXP_MIN: i64 = -32 << 26;

/// `exp x` with `bits` bits behind the point, at most 31. `x` is in 2^-26.
///
/// # Panics
/// When `x` is much greater than 4.
#[inline]
#[must_use]
pub fn exp(tables: &PolicyTables, x: i64, bits: u32) -> i64 {
    let octaves = rsh(x.max(EXP_MIN) * LOG2_E, 27);
    let share = (octaves & ((1 << 30) - 1)).unsigned_abs();
    let mantissa = PolicyTables::between(&tables.exp2[..], share, 20);
    // at most five whole octaves: so many bits of room make every shift one to the right
    let shift = 36 - i64::from(bits) - (octaves >> 30);
    rsh(mantissa << 6, narrow(shift, "nothing greater than exp(4) is asked for"))
}

/// `ln m` in 2^-26. `m` has `bits` bits behind the point, at most 63, and is above 0.
#[inline]
#[must_use]
pub fn ln(tables: &PolicyTables, m: u64, bits: u32) -> i64 {
    let zeros = m.leading_zeros();
    // without the leading bit: 10 bits of an entry, 24 of a share
    let share = (m << zeros << 1) >> 30;
    let whole = 63 - i64::from(zeros) - i64::from(bits);
    let log2 = (whole << 30) + PolicyTables::between(&tables.log2[..], share, 24);
    rsh(i128::from(log2) * LN_2, 36) as i64
}

/// The number below which a share of `(word + 1/2) / 2^32` of the normal distribution lies.
#[inline]
#[must_use]
pub fn normal(tables: &PolicyTables, word: u32) -> Normal {
    let below = word >> 31 == 0;
    let mass = 2 * if below { word } else { !word } + 1;
    let octave = mass.leading_zeros();
    let at = (u64::from(31 - octave) << 31) + u64::from((mass << octave) & 0x7fff_ffff);
    let z = PolicyTables::between(&tables.normal[..], at, 24) as i32;
    Normal::from_bits(if below { -z } else { z })
}

/// `tanh u`, from -1 to 1.
#[inline]
#[must_use]
pub fn tanh(tables: &PolicyTables, u: Logit) -> Real {
    let u = u.to_bits();
    let at = u64::from(u.unsigned_abs()).min((8 << 20) - 1);
    let size = rsh(PolicyTables::between(&tables.tanh[..], at, 13), 14) as i32;
    Real::from_bits(u.signum() * size)
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::prelude::*;

    use super::*;
    use crate::num::tables::precise::{self, BITS, ONE};

    static TABLES: LazyLock<PolicyTables> = LazyLock::new(PolicyTables::build);

    /// A number with `bits` bits behind the point, as the reference has it.
    fn wide(x: i64, bits: u32) -> i128 {
        i128::from(x) << (BITS - bits)
    }

    #[test]
    fn constants_are_the_nearest_integers() {
        let ln2 = precise::ln(2 * ONE);
        assert_eq!(LN_2, (ln2 + (1 << 23)) >> 24);
        assert_eq!(i128::from(LOG2_E), (precise::div(ONE, ln2) + (1 << 24)) >> 25);
    }

    #[test]
    fn where_functions_are_exact() {
        for bits in [20, 27, 31] {
            assert_eq!((exp(&TABLES, 0, bits), ln(&TABLES, 1 << bits, bits)), (1 << bits, 0));
        }
        assert_eq!(exp(&TABLES, i64::MIN, 31), 0);
        assert_eq!(tanh(&TABLES, Logit::ZERO), Real::ZERO);
        assert_eq!([Logit::MAX, Logit::MIN].map(|u| tanh(&TABLES, u)), [Real::ONE, -Real::ONE]);
    }

    #[test]
    fn the_ends_of_the_words_are_the_ends_of_the_distribution() {
        let all = [0, 1, (1 << 31) - 1, 1 << 31, u32::MAX].map(|w| normal(&TABLES, w));
        assert!(all.is_sorted());
        assert_eq!((all[0], all[2]), (-all[4], -all[3]));
        assert!(all[4] > Normal::from_num(6) && all[4] < Normal::from_num(7));
        assert!(all[3] >= 0 && all[3].to_bits() < 16);
    }

    proptest! {
        #[test]
        fn exp_is_within_its_bound(x in EXP_MIN..=4 << 26, bits in 20u32..=31) {
            let exact = precise::exp(wide(x, 26));
            let off = (wide(exp(&TABLES, x, bits), bits) - exact).abs();
            prop_assert!(off <= (exact >> 22) + (1 << (BITS - bits - 1)), "{off}");
        }

        #[test]
        fn ln_is_within_its_bound(m in 1u64.., zeros in 0u32..64, bits in 0u32..=63) {
            let m = (m >> zeros).max(1);
            // in two steps, so that the reference has room
            let top = m.leading_zeros();
            let mantissa = i128::from(m << top) >> (63 - BITS);
            let octaves = 63 - i128::from(top) - i128::from(bits);
            let exact = precise::ln(mantissa) + octaves * precise::ln(2 * ONE);
            let off = (wide(ln(&TABLES, m, bits), 26) - exact).abs();
            prop_assert!(off < ONE >> 22, "{off}");
        }

        #[test]
        fn normal_is_within_its_bound(word: u32, zeros in 0u32..32, flip: bool) {
            let word = if flip { !(word >> zeros) } else { word >> zeros };
            let z = wide(i64::from(normal(&TABLES, word).to_bits()), 27);
            let above = ONE - wide(2 * i64::from(word) + 1, 33);
            let (slack, bound) = (4, ONE >> 16);
            prop_assert!(precise::tail(z - bound) + slack >= above);
            prop_assert!(precise::tail(z + bound) <= above + slack);
        }

        #[test]
        fn tanh_is_within_its_bound_and_odd(u in -(9i32 << 20)..=9 << 20) {
            let got = tanh(&TABLES, Logit::from_bits(u));
            let off = wide(got.to_bits().into(), 16) - precise::tanh(wide(u.into(), 20));
            prop_assert!(off.abs() < ONE >> 16, "{off}");
            prop_assert_eq!(tanh(&TABLES, Logit::from_bits(-u)), -got);
        }

        #[test]
        fn nothing_falls_where_it_should_rise(x in EXP_MIN..4 << 26, m in 1u64..u64::MAX, w in 0..u32::MAX, u in i32::MIN..i32::MAX) {
            prop_assert!(exp(&TABLES, x, 26) <= exp(&TABLES, x + 1, 26));
            prop_assert!(ln(&TABLES, m, 40) <= ln(&TABLES, m + 1, 40));
            prop_assert!(normal(&TABLES, w) <= normal(&TABLES, w + 1));
            prop_assert!(tanh(&TABLES, Logit::from_bits(u)) <= tanh(&TABLES, Logit::from_bits(u + 1)));
        }
    }
}
