//! Ranks of returns, for evolution strategies: how good each was beside the others, whatever returns are worth.
//!
//! ```text
//! rank = (returns below it) - (returns above it)          from -(n - 1) to n - 1, equal returns alike; the sum is 0
//! ```
//!
//! See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use crate::num::fixed::narrow;

/// The centred rank of each of some returns.
#[must_use]
pub fn centred_ranks(returns: &[i64]) -> Vec<i32> {
    let mut sorted = returns.to_vec();
    sorted.sort_unstable();
    let rank = |of: &i64| {
        let below = sorted.partition_point(|other| other < of);
        let above = sorted.len() - sorted.partition_point(|other| other <= of);
        narrow::<i32>(below, "a count of returns") - narrow::<i32>(above, "a count of returns")
    };
    returns.iter().map(rank).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn equal_returns_have_equal_ranks() {
        assert_eq!(centred_ranks(&[30, -5, 30, 7, i64::MIN]), [3, -2, 3, 0, -4]);
        assert_eq!(
            (centred_ranks(&[]), centred_ranks(&[9]), centred_ranks(&[2; 3])),
            (vec![], vec![0], vec![0; 3])
        );
    }

    proptest! {
        #[test]
        fn a_rank_counts_who_is_below_and_who_above(returns in prop::collection::vec(-4i64..4, 0..20)) {
            let ranks = centred_ranks(&returns);
            prop_assert_eq!(ranks.iter().sum::<i32>(), 0);
            for (of, rank) in returns.iter().zip(ranks) {
                let counted: i32 = returns.iter().map(|other| i32::from(other < of) - i32::from(other > of)).sum();
                prop_assert_eq!(rank, counted);
            }
        }
    }
}
