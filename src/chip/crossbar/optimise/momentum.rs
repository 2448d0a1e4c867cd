//! `momentum`: a digital accumulator a cell that forgets a share at every write.
//!
//! ```text
//! M += sum - rsh(M, d);   request = M, with k + d           d = 1 ..= 8;  |M| < 2^(32 + d)
//! ```
//!
//! In the end a steady sum is asked for as it would be without: M comes to `2^d` times it. A write of nothing forgets too.
//! See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::rsh;

/// How an accumulator forgets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Momentum {
    /// `d`.
    pub decay: u32,
}

impl Momentum {
    /// The accumulator after a sum.
    #[inline]
    #[must_use]
    pub fn after(self, moment: i64, sum: i64) -> i64 {
        moment - rsh(moment, self.decay) + sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_steady_sum_is_reached_and_the_greatest_is_no_wrap(decay in 1u32..=8, sum in -(1i64 << 31)..1 << 31) {
            let momentum = Momentum { decay };
            let mut moment = 0;
            for _ in 0..40 << decay {
                let next = momentum.after(moment, sum);
                prop_assert!((next - moment) * sum.signum() >= 0, "it only comes nearer");
                prop_assert!(next.abs() < 1 << (32 + decay));
                moment = next;
            }
            // where it rests, what is forgotten is what comes
            prop_assert!((moment - (sum << decay)).abs() <= 1 << decay >> 1);
        }
    }
}
