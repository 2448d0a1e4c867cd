//! The ratio of the probabilities of an action after and before an update, where it is clipped, and what it says of both.
//!
//! ```text
//! d        = clamp(ln p' - ln p, -2.77, 2.77)               exact, in 2^-26
//! r        = exp d                                          relative error < 2^-21;   1/16 < r < 16
//! clipped  = A > 0 and r > 1 + epsilon,  or  A < 0 and r < 1 - epsilon
//! push     = 0 if clipped, else r A                         error <= 2^-21 beside that of r
//! gain     = min(r A, clamp(r, 1 - epsilon, 1 + epsilon) A)
//! KL      ~= mean of (r - 1) - d,   clip fraction = share of r outside 1 - epsilon ..= 1 + epsilon
//! ```
//!
//! `push` is the gradient of the gain by `d`: how hard an action is pushed, and which way. See docs/MODEL.md, 5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::function;
use super::number::{Advantage, LogProbability, LogRatio, Ratio, saturated};
use crate::num::fixed::rsh;
use crate::num::tables::PolicyTables;

/// The greatest logarithm of a ratio, 2.77 in 2^-26; the least is its negative.
const LOG_BOUND: i64 = 185_891_553;

/// The logarithm of the ratio of a probability to that before.
#[inline]
#[must_use]
pub fn log_ratio(now: LogProbability, before: LogProbability) -> LogRatio {
    let d = now.to_bits().saturating_sub(before.to_bits());
    LogRatio::from_bits(d.clamp(-LOG_BOUND, LOG_BOUND) as i32)
}

/// The ratio of which `d` is the logarithm; exactly 1 at 0.
#[inline]
#[must_use]
pub fn ratio(tables: &PolicyTables, d: LogRatio) -> Ratio {
    let d = i64::from(d.to_bits()).clamp(-LOG_BOUND, LOG_BOUND);
    Ratio::from_bits(function::exp(tables, d, 27) as u32)
}

/// How far an update may move a probability.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clip {
    /// At most 1.
    pub epsilon: Ratio,
}

impl Clip {
    /// Whether the action has moved far enough the way its advantage asks, so that it teaches nothing.
    #[inline]
    #[must_use]
    pub fn clips(self, ratio: Ratio, advantage: Advantage) -> bool {
        advantage > 0 && ratio > self.most() || advantage < 0 && ratio < self.least()
    }

    /// What the errors of a policy are multiples of: `r A`, or 0 where it is clipped. Saturates.
    #[inline]
    #[must_use]
    pub fn push(self, ratio: Ratio, advantage: Advantage) -> Advantage {
        if self.clips(ratio, advantage) { Advantage::ZERO } else { product(ratio, advantage) }
    }

    /// What is maximised. Saturates.
    #[inline]
    #[must_use]
    pub fn gain(self, ratio: Ratio, advantage: Advantage) -> Advantage {
        let held = ratio.clamp(self.least(), self.most());
        product(ratio, advantage).min(product(held, advantage))
    }

    /// Whether the ratio lies outside of what an update may do.
    #[inline]
    #[must_use]
    pub fn outside(self, ratio: Ratio) -> bool {
        !(self.least()..=self.most()).contains(&ratio)
    }

    fn least(self) -> Ratio {
        Ratio::ONE.saturating_sub(self.epsilon)
    }

    fn most(self) -> Ratio {
        Ratio::ONE.saturating_add(self.epsilon)
    }
}

fn product(ratio: Ratio, advantage: Advantage) -> Advantage {
    saturated(rsh(i64::from(ratio.to_bits()) * i64::from(advantage.to_bits()), 27))
}

/// What an action says of how far an update moved the policy: `(r - 1) - d`, in 2^-27.
#[inline]
#[must_use]
pub fn divergence(ratio: Ratio, d: LogRatio) -> i64 {
    let above = i64::from(ratio.to_bits()) - i64::from(Ratio::ONE.to_bits());
    above - 2 * i64::from(d.to_bits())
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::prelude::*;

    use super::*;
    use crate::num::tables::precise::{self, BITS};

    static TABLES: LazyLock<PolicyTables> = LazyLock::new(PolicyTables::build);

    const FIFTH: Clip = Clip { epsilon: Ratio::from_bits(26_843_546) };

    #[test]
    fn a_ratio_lies_between_a_sixteenth_and_sixteen() {
        let log = |now, before| {
            log_ratio(LogProbability::from_bits(now), LogProbability::from_bits(before))
        };
        let bound = LogRatio::from_bits(185_891_553);
        assert_eq!(
            [log(i64::MAX, i64::MIN), log(185_891_554, 0), log(0, -185_891_553)],
            [bound; 3]
        );
        assert_eq!(
            [log(i64::MIN, i64::MAX), log(-185_891_554, 0), log(-185_891_552, 1)],
            [-bound; 3]
        );
        assert_eq!((log(7, 5).to_bits(), log(-3, 5).to_bits()), (2, -8));
        assert_eq!(ratio(&TABLES, LogRatio::ZERO), Ratio::ONE);
        assert!(ratio(&TABLES, bound) < 16 && ratio(&TABLES, -bound) * 16 > 1);
        assert_eq!(ratio(&TABLES, LogRatio::MAX), ratio(&TABLES, bound));
        assert_eq!(ratio(&TABLES, LogRatio::MIN), ratio(&TABLES, -bound));
    }

    #[test]
    fn what_went_far_enough_its_way_is_clipped_and_nothing_else() {
        let (most, least) = ((1 << 27) + 26_843_546, (1 << 27) - 26_843_546);
        let at = |ratio, advantage| {
            let (ratio, advantage) = (Ratio::from_bits(ratio), Advantage::from_num(advantage));
            let (clips, push) = (FIFTH.clips(ratio, advantage), FIFTH.push(ratio, advantage));
            assert_eq!(clips, push == 0 && advantage != 0);
            clips
        };
        assert_eq!(
            [(most, 1), (most + 1, 1), (least - 1, 1)].map(|(r, a)| at(r, a)),
            [false, true, false]
        );
        assert_eq!(
            [(least, -1), (least - 1, -1), (most + 1, -1)].map(|(r, a)| at(r, a)),
            [false, true, false]
        );
        assert_eq!(
            [(most + 1, 0), (least - 1, 0), (1 << 27, 0)].map(|(r, a)| at(r, a)),
            [false; 3]
        );
        let outside = |r| FIFTH.outside(Ratio::from_bits(r));
        assert_eq!([most, most + 1, least, least - 1].map(outside), [false, true, false, true]);
        let all = Clip { epsilon: Ratio::MAX };
        assert!(!all.outside(Ratio::MAX) && !all.outside(Ratio::ZERO));
    }

    #[test]
    fn a_clip_takes_the_lower_of_two_gains() {
        let gain = |r: i32, a| FIFTH.gain(Ratio::from_num(r), Advantage::from_num(a));
        let near = |x: Advantage, tenths: i32| {
            (x * 10 - Advantage::from_num(tenths)).abs() < Advantage::from_bits(64)
        };
        assert!(near(gain(2, 5), 60) && near(gain(0, -5), -40));
        assert_eq!(
            (gain(2, -5), gain(0, 5), gain(1, 5)),
            (Advantage::from_num(-10), Advantage::ZERO, Advantage::from_num(5))
        );
        assert_eq!(FIFTH.push(Ratio::from_num(16), Advantage::MIN), Advantage::MIN);
    }

    #[test]
    fn what_moved_diverges_either_way() {
        let at = |d| {
            let d = LogRatio::from_bits(d);
            divergence(ratio(&TABLES, d), d)
        };
        // sqrt(e) - 1 - 1/2 = 0.1487212707 and exp(-1/2) - 1 + 1/2 = 0.1065306597
        assert_eq!(at(0), 0);
        assert!((at(1 << 25) - 19_961_031).abs() < 64 && (at(-1 << 25) - 14_298_303).abs() < 64);
    }

    proptest! {
        #[test]
        fn a_ratio_is_within_its_bound(d in -LOG_BOUND..=LOG_BOUND) {
            let got = ratio(&TABLES, LogRatio::from_bits(d as i32));
            let exact = precise::exp(i128::from(d) << (BITS - 26));
            let off = (i128::from(got.to_bits()) << (BITS - 27)) - exact;
            prop_assert!(off.abs() < exact >> 21, "{off}");
        }

        #[test]
        fn a_push_is_the_product_or_nothing(ratio: u32, advantage in -8i32 << 20..=8 << 20) {
            let (r, a) = (Ratio::from_bits(ratio), Advantage::from_bits(advantage));
            let twice = 2 * i64::from(ratio) * i64::from(advantage);
            let push = i64::from(FIFTH.push(r, a).to_bits()) << 28;
            prop_assert!(FIFTH.clips(r, a) || (push - twice).abs() <= 1 << 27);
            // the gain follows the ratio where the push is not 0
            let product = (twice + (1 << 27)) >> 28;
            let gain = i64::from(FIFTH.gain(r, a).to_bits());
            let follows = if FIFTH.clips(r, a) { gain <= product } else { gain == product };
            prop_assert!(follows);
        }
    }
}
