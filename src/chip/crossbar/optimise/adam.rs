//! `adam_fx`: the mean of a cell's sums, in units of the root of the mean of their squares, all in integers.
//!
//! ```text
//! s    sum, or rsh(sum', 4) of a centred one                                     |s| < 2^27
//! M    s << a at the first write, later  M += s - rsh(M, a)                      |M| < 2^(28 + a)
//! V    s^2 << b at the first write, later  V += s^2 - (V >> b)                   V < 2^(55 + b)
//! D    max(1, isqrt(V >> b)) << a
//! q    clamp( floor( (2^13 M + D) / (2 D) ), -(2^15 - 1), 2^15 - 1 )             the request: 12 fractional bits
//! ```
//!
//! a, b = 1 ..= 8. Both means begin with the first write, so that none has to be corrected for its beginning; the root is exact.
//! A request of `2^12` is a step of the rate. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::rsh;

/// Fractional bits of a request.
const FRACTION: u32 = 12;

/// How the means of a cell move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Adam {
    /// `a`.
    pub first_decay: u32,
    /// `b`.
    pub second_decay: u32,
    /// Whether means begin with this write.
    pub begins: bool,
    /// Fractional bits of the sums.
    pub fraction: u32,
}

impl Adam {
    /// Moves both means of a cell by a sum. Gives its request.
    #[inline]
    #[must_use]
    pub fn request(self, [first, second]: [&mut i64; 2], sum: i64) -> i64 {
        let s = rsh(sum, self.fraction);
        if self.begins {
            (*first, *second) = (s << self.first_decay, (s * s) << self.second_decay);
        } else {
            *first += s - rsh(*first, self.first_decay);
            *second += s * s - (*second >> self.second_decay);
        }
        let root = (*second >> self.second_decay).isqrt().max(1) << self.first_decay;
        let ratio = ((*first << (FRACTION + 1)) + root).div_euclid(2 * root);
        let rail = i64::from(i16::MAX);
        ratio.clamp(-rail, rail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn steady_sums_of_any_size_ask_for_one_step(
            first_decay in 1u32..=8, second_decay in 1u32..=8, sum in 1000i64..1 << 27, sign: bool,
        ) {
            let sum = if sign { -sum } else { sum };
            let mut means = [0, 0];
            for write in 0..50 {
                let adam = Adam { first_decay, second_decay, begins: write == 0, fraction: 0 };
                let request = adam.request(means.each_mut(), sum);
                prop_assert!((request * sum.signum() - 4096).abs() <= 8, "{request}");
            }
        }

        #[test]
        fn means_keep_to_their_widths_and_a_request_to_its_definition(
            first_decay in 1u32..=8, second_decay in 1u32..=8,
            sums in prop::collection::vec(prop_oneof![
                Just(4096i64 * 255 * 127), Just(-4096i64 * 255 * 127), Just(0), -1000i64..1000,
            ], 1..300),
        ) {
            let mut means = [0, 0];
            for (write, &sum) in sums.iter().enumerate() {
                let adam = Adam { first_decay, second_decay, begins: write == 0, fraction: 0 };
                let request = i128::from(adam.request(means.each_mut(), sum));
                prop_assert!(means[0].abs() < 1 << (28 + first_decay));
                prop_assert!((0..1 << (55 + second_decay)).contains(&i128::from(means[1])));
                // q is the nearest whole number to 2^12 M / D, halves up, inside its rail
                let (m, v) = (i128::from(means[0]), means[1] >> second_decay);
                let root = (0..64).rev().fold(0i64, |root, bit| {
                    let more = root | 1i64.checked_shl(bit).filter(|_| bit < 31).unwrap_or(0);
                    if more * more <= v { more } else { root }
                });
                let d = i128::from(root.max(1)) << first_decay;
                prop_assert!(request == 32767 || (m << 13) < (2 * request + 1) * d);
                prop_assert!(request == -32767 || (m << 13) >= (2 * request - 1) * d);
                prop_assert!(request.abs() <= 32767);
            }
        }
    }

    #[test]
    fn a_cell_that_never_heard_anything_asks_for_nothing() {
        let adam = Adam { first_decay: 3, second_decay: 8, begins: true, fraction: 4 };
        let mut means = [7, 9];
        assert_eq!((adam.request(means.each_mut(), 7), means), (0, [0, 0]));
        assert_eq!(adam.request(means.each_mut(), 8), 4096, "8 sixteenths round to 1");
    }
}
