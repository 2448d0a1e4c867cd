//! The numbers of policies: what each is, how many bits it has, and how many of them lie behind the point.
//!
//! ```text
//! IaFb: a signed number of a + b bits, b behind the point, from -2^(a-1) to 2^(a-1) - 2^-b;     UaFb: 0 to 2^a - 2^-b
//! ```
//!
//! What is multiplied or divided is rounded once, halves toward plus infinity
//! ([`rsh`](crate::num::fixed::rsh)), and saturates where its type ends; where a bound is less than that, it is said.
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use fixed::types::{I5F11, I5F27, I6F26, I12F20, I38F26, U1F31, U2F30, U5F27, U6F26};

pub use crate::task::environment::Real;

/// A number of an observation in units of its standard deviation, from -8 to 8.
pub type Observed = I5F11;
/// What a state is worth: the sum of rewards to come, each discounted by how far it is off.
pub type Value = I12F20;
/// How much better an action was than expected.
pub type Advantage = I12F20;
/// An output of an actor: a logit, or the mean of a Gaussian. Also what is tried of a Gaussian, before its `tanh`.
pub type Logit = I12F20;
/// The logarithm of a standard deviation, from -4 to 1.
pub type LogDeviation = I12F20;
/// A standard deviation.
pub type Deviation = U2F30;
/// One over a standard deviation.
pub type Precision = U6F26;
/// An entropy, in nats.
pub type Entropy = I12F20;
/// A distance from the mean in standard deviations, from -16 to 16.
pub type Normal = I5F27;
/// The logarithm of a probability, or of a density without its constant.
pub type LogProbability = I38F26;
/// The logarithm of the ratio of two probabilities, from -2.77 to 2.77.
pub type LogRatio = I6F26;
/// The ratio of two probabilities, from 1/16 to 16.
pub type Ratio = U5F27;
/// A probability, a discount or another share; 1 has a number of its own.
pub type Probability = U1F31;
/// What an output should have been more, from -4 to 4.
pub type OutputError = I12F20;

/// The greatest error of an output, in 2^-20; the least is its negative.
const ERROR_BOUND: i64 = 4 << 20;

/// `error`, in 2^-20, within -4 to 4.
#[inline]
#[must_use]
pub fn bounded(error: i64) -> OutputError {
    OutputError::from_bits(error.clamp(-ERROR_BOUND, ERROR_BOUND) as i32)
}

/// A number in 2^-20 as the type has it, saturating.
#[inline]
#[must_use]
pub fn saturated(number: i64) -> I12F20 {
    I12F20::from_bits(number.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_and_numbers_end_where_they_say() {
        let four = OutputError::from_num(4);
        assert_eq!([-4 << 20, (-4 << 20) - 1, i64::MIN].map(bounded), [-four; 3]);
        assert_eq!([4 << 20, (4 << 20) + 1, i64::MAX].map(bounded), [four; 3]);
        assert_eq!(bounded(-5), OutputError::from_bits(-5));
        let (min, max) = (i64::from(i32::MIN), i64::from(i32::MAX));
        assert_eq!([min, min - 1, i64::MIN].map(saturated), [I12F20::MIN; 3]);
        assert_eq!([max, max + 1, i64::MAX].map(saturated), [I12F20::MAX; 3]);
        assert_eq!(saturated(7), I12F20::from_bits(7));
    }
}
