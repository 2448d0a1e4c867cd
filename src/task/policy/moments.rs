//! Mean and standard deviation from exact sums, and numbers in units of them.
//!
//! ```text
//! n, S, Q    = count, sum, sum of squares                      exact: no order of adding, no thread, changes them
//! mean       = S / n                                           in 2^-16 steps of the numbers, halves up
//! deviation  = sqrt(n Q - S^2) / n                             in 2^-24 steps, down; at least 16 steps, or 0 where n Q = S^2
//! reciprocal = 1 / deviation                                   in 2^-56, down; 0 where the deviation is 0
//! standard   = rsh((x 2^16 - mean) reciprocal, 72 - bits)
//! ```
//!
//! A step is the last bit of the numbers, wherever their point lies: a standard number has no unit. It is off by less than
//! half of its last bit `+ |standard| 2^-24 + 2^-20`. What never moved has deviation 0 and standard numbers 0, whatever comes
//! later: a constant input is never blown up. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::chip::state::signed;
use crate::num::fixed::{narrow, rsh};

/// Numbers that one [`Moments`] takes, at most: so many that `n Q` has room.
pub const COUNT_MAX: u64 = 1 << 32;
/// The least deviation but 0, in 2^-24 steps.
const DEVIATION_MIN: u64 = 16 << 24;

/// What is kept of some numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moments {
    /// How many, at most [`COUNT_MAX`].
    pub count: u64,
    /// Their sum, in steps.
    pub sum: i128,
    /// The sum of their squares, in steps.
    pub squares: u128,
}

impl Moments {
    /// Those of some numbers.
    pub fn of(numbers: impl Iterator<Item = i32>) -> Self {
        let mut moments = Self::default();
        numbers.for_each(|number| moments.add(number));
        moments
    }

    /// Takes one more number.
    #[inline]
    pub fn add(&mut self, number: i32) {
        self.count += 1;
        self.sum += i128::from(number);
        self.squares += u128::from(i64::from(number).pow(2).unsigned_abs());
    }

    /// As a checkpoint holds them: the count, then sum and sum of squares in two pieces each.
    #[must_use]
    pub fn numbers(&self) -> [i64; 5] {
        let [sum, squares] = [self.sum, narrow(self.squares, "squares have room")].map(pieces);
        [signed(self.count), sum[0], sum[1], squares[0], squares[1]]
    }

    /// What [`Self::numbers`] gave; `None` of what no numbers have.
    #[must_use]
    pub fn from_numbers([count, sum_high, sum, squares_high, squares]: [i64; 5]) -> Option<Self> {
        let count = u64::try_from(count).ok().filter(|&count| count <= COUNT_MAX)?;
        let sum = whole([sum_high, sum])?;
        let squares = u128::try_from(whole([squares_high, squares])?).ok()?;
        // no number is wider than its type, and no mean greater than the root of the mean square
        let widest = u128::from(count) << 62;
        let fits = squares <= widest && sum.unsigned_abs() <= u128::from(count) << 31;
        let possible = fits && sum.unsigned_abs().pow(2) <= u128::from(count) * squares;
        possible.then_some(Self { count, sum, squares })
    }

    /// Their mean, in 2^-16 steps; 0 of none.
    #[must_use]
    pub fn mean(&self) -> i64 {
        let count = i128::from(self.count.max(1));
        let mean = ((self.sum << 17) + count).div_euclid(2 * count);
        narrow(mean, "a mean lies between the least and the greatest number")
    }

    /// What takes numbers to units of these.
    #[must_use]
    pub fn spread(&self) -> Spread {
        let squares = self.squares * u128::from(self.count);
        let apart = squares.saturating_sub(self.sum.unsigned_abs().pow(2));
        Spread::new(self.mean(), apart, self.count)
    }
}

/// The upper part of a number and its 63 lower bits.
#[must_use]
pub fn pieces(number: i128) -> [i64; 2] {
    let low = number & i128::from(i64::MAX);
    [narrow(number >> 63, "a number of less than 126 bits"), narrow(low, "63 bits")]
}

/// What [`pieces`] gave; `None` where the lower bits are negative.
#[must_use]
pub fn whole([high, low]: [i64; 2]) -> Option<i128> {
    (low >= 0).then(|| (i128::from(high) << 63) + i128::from(low))
}

/// A mean and a standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spread {
    /// In 2^-16 steps.
    pub mean: i64,
    /// In 2^-24 steps; 0 of what never moved.
    pub deviation: u64,
    /// One over it, in 2^-56 of one over a step; 0 of what never moved.
    pub reciprocal: u64,
}

impl Spread {
    /// With `deviation = sqrt(apart) / count` steps.
    #[must_use]
    pub fn new(mean: i64, apart: u128, count: u64) -> Self {
        if apart == 0 {
            return Self { mean, deviation: 0, reciprocal: 0 };
        }
        let room = (apart.leading_zeros() / 2).min(24);
        let root = (apart << (2 * room)).isqrt() / u128::from(count);
        let deviation: u64 = narrow(root << (24 - room), "a deviation is less than 2^32 steps");
        let deviation = deviation.max(DEVIATION_MIN);
        let reciprocal = narrow((1u128 << 80) / u128::from(deviation), "it is at least 16 steps");
        Self { mean, deviation, reciprocal }
    }

    /// A number in units of the deviation, with `bits` bits behind the point, at most 20.
    #[inline]
    #[must_use]
    pub fn standard(&self, number: i32, bits: u32) -> i64 {
        let apart = (i64::from(number) << 16) - self.mean;
        rsh(i128::from(apart) * i128::from(self.reciprocal), 72 - bits) as i64
    }

    /// The number of steps, halves up, that is `standard` deviations above the mean, with 20 bits behind the point.
    #[inline]
    #[must_use]
    pub fn number(&self, standard: i32) -> i64 {
        let apart = i128::from(standard) * i128::from(self.deviation);
        rsh((i128::from(self.mean) << 28) + apart, 44) as i64
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `floor(2^bits sqrt(x))`.
    fn root(x: u128, bits: u32) -> i128 {
        narrow((x << (2 * bits)).isqrt(), "a root")
    }

    #[test]
    fn what_never_moved_has_no_deviation() {
        let spread = Moments::of([-7; 5].into_iter()).spread();
        assert_eq!(spread, Spread { mean: -7 << 16, deviation: 0, reciprocal: 0 });
        assert_eq!((spread.standard(i32::MAX, 20), spread.number(i32::MAX)), (0, -7));
        assert_eq!(Moments::default().spread(), Spread { mean: 0, deviation: 0, reciprocal: 0 });
    }

    #[test]
    fn less_than_sixteen_steps_of_deviation_count_as_sixteen() {
        let spread = |far: i32| Moments::of([-far, far].into_iter()).spread();
        for (far, steps) in [(1, 16), (15, 16), (16, 16), (17, 17), (i32::MAX, i32::MAX)] {
            assert_eq!(spread(far).deviation, (steps as u64) << 24, "{far}");
        }
        assert_eq!((spread(16).standard(8, 11), spread(16).number(1 << 19)), (1 << 10, 8));
        assert_eq!(spread(1).reciprocal, 1 << 52);
    }

    #[test]
    fn a_mean_is_rounded_half_up_on_both_sides_of_zero() {
        let mean = |sum, count| Moments { count, sum, squares: 0 }.mean();
        // halves of 2^-16 steps: one step in 2^17
        assert_eq!((mean(1, 1 << 17), mean(-1, 1 << 17), mean(-3, 1 << 17)), (1, 0, -1));
        assert_eq!((mean(-5, 2), mean(5, 2)), (-5 << 15, 5 << 15));
    }

    #[test]
    fn the_widest_and_longest_sums_have_room() {
        let least = i128::from(i32::MIN);
        let squares = least.pow(2).unsigned_abs() * u128::from(COUNT_MAX);
        let moments = Moments { count: COUNT_MAX, sum: 0, squares };
        assert_eq!(moments.spread().deviation, 1 << 55);
        assert_eq!(
            (moments.spread().standard(i32::MIN, 20), moments.spread().number(-1 << 20)),
            (-1 << 20, least as i64)
        );
        let moments = Moments { sum: least * i128::from(COUNT_MAX), ..moments };
        assert_eq!(
            moments.spread(),
            Spread { mean: i64::from(i32::MIN) << 16, deviation: 0, reciprocal: 0 }
        );
    }

    #[test]
    fn what_no_numbers_have_is_refused() {
        let least = Moments::of([i32::MIN; 3].into_iter());
        assert_eq!(Moments::from_numbers(least.numbers()), Some(least));
        let changed = |at: usize, by: i64| {
            let mut numbers = Moments::of([i32::MIN, 5].into_iter()).numbers();
            numbers[at] += by;
            Moments::from_numbers(numbers)
        };
        assert!(changed(0, 0).is_some());
        // fewer numbers, more numbers than counted, a sum or squares beyond the types, a part of more than 63 bits
        assert!(changed(0, -3).is_none() && changed(0, -1).is_none());
        assert!(
            changed(1, 1).is_none() && changed(1, -1).is_none() && changed(3, 1 << 40).is_none()
        );
        assert!(changed(3, -1).is_none() && changed(2, i64::MIN).is_none());
        assert!(Moments::from_numbers([1, 0, 1 << 31, 1, 0]).is_none());
        assert!(Moments::from_numbers([1, 0, 3, 0, 8]).is_none());
        assert!(Moments::from_numbers([1, 0, 3, 0, 9]).is_some());
        assert!(Moments::from_numbers([2, 0, 0, 0, -1]).is_none());
        let most = signed(COUNT_MAX);
        assert!(Moments::from_numbers([most, 0, 0, 0, 0]).is_some());
        assert!(Moments::from_numbers([most + 1, 0, 0, 0, 0]).is_none());
    }

    proptest! {
        #[test]
        fn numbers_of_a_checkpoint_give_the_moments_again(
            numbers in prop::collection::vec(any::<i32>(), 0..9),
        ) {
            let moments = Moments::of(numbers.into_iter());
            prop_assert_eq!(Moments::from_numbers(moments.numbers()), Some(moments));
        }

        #[test]
        fn standard_numbers_are_within_their_bound(
            numbers in prop::collection::vec(any::<i32>(), 2..40), scale in 0u32..18, offset in -1i32 << 24..1 << 24,
            bits in 8u32..=20, more: i32,
        ) {
            let numbers: Vec<i32> = numbers.iter().map(|x| (x >> 7 >> scale) + offset).collect();
            let n = numbers.len() as i128;
            let sum: i128 = numbers.iter().map(|&x| i128::from(x)).sum();
            let squares: i128 = numbers.iter().map(|&x| i128::from(x).pow(2)).sum();
            let apart = (n * squares - sum * sum).unsigned_abs();
            prop_assume!(apart >= 256 * (n * n).unsigned_abs());
            let spread = Moments::of(numbers.iter().copied()).spread();
            for x in [numbers[0], numbers[1], (more >> 7 >> scale) + offset] {
                // exact = (n x - sum) / sqrt(apart);  both sides times sqrt(apart) 2^40
                let got = i128::from(spread.standard(x, bits));
                let root = root(apart, 20);
                let off = (got << (20 - bits)) * root - ((n * i128::from(x) - sum) << 40);
                let size = got.abs() << (20 - bits);
                // half a bit, 2^-24 of itself, 2^-20; and the rounding of this root
                let bound = (root << (19 - bits.min(19))) + ((root * size) >> 24) + root + size + (1 << 20);
                prop_assert!(off.abs() <= bound, "{off} {bound}");
                // and back
                let back = i128::from(spread.number(narrow((got << (20 - bits)).clamp(-1 << 31, (1 << 31) - 1), "a word")));
                if size < 1 << 24 {
                    let bound = ((root / n) >> (bits + 20)) + 3 + ((root / n) >> 38);
                    prop_assert!((back - i128::from(x)).abs() <= bound, "{back} {x} {bound}");
                }
            }
        }
    }
}
