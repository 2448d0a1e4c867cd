//! The ratio of the probabilities of an action after and before an update, where it is clipped, and what it says of both.
//!
//! ```text
//! d        = clamp(ln p' - ln p, -2.77, 2.77)               exact, in 2^-26
//! r        = exp d                                          relative error < 2^-21;   1/16 < r < 16
//! clipped  = A > 0 and r > 1 + epsilon,  or  A < 0 and r < 1 - epsilon
//! weight   = 0 if clipped, else r A                         error <= 2^-21 beside that of r
//! gain     = min(r A, clamp(r, 1 - epsilon, 1 + epsilon) A)
//! KL      ~= mean of (r - 1) - d,   clip fraction = share of r outside 1 - epsilon ..= 1 + epsilon
//! ```
//!
//! `weight` is what the gradient of the gain by `d` is. See docs/MODEL.md, 5.
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
    pub fn weight(self, ratio: Ratio, advantage: Advantage) -> Advantage {
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

/// How far updates have moved a policy: sums that reports divide.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moved {
    /// Actions looked at.
    pub actions: u64,
    /// Those whose ratio lay outside of the clip.
    pub outside: u64,
    /// Sum of `(r - 1) - d`, in 2^-27.
    pub divergence: i64,
}

impl Moved {
    /// Looks at one more action.
    #[inline]
    pub fn add(&mut self, clip: Clip, d: LogRatio, ratio: Ratio) {
        self.actions += 1;
        self.outside += u64::from(clip.outside(ratio));
        let above = i64::from(ratio.to_bits()) - i64::from(Ratio::ONE.to_bits());
        self.divergence += above - 2 * i64::from(d.to_bits());
    }
}
