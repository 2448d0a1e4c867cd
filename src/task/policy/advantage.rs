//! Advantages: how much better than expected things went, and what states turned out to be worth.
//!
//! ```text
//! next   = 0 where terminated,  V(reached) where truncated,  V(s[t+1]) else                    gamma: discount
//! m[t]   = next + lambda A[t+1],   lambda A[t+1] = 0 where an episode ended                    lambda: trace
//! A[t]   = r[t] + gamma m[t] - V(s[t]),   backward in time, of 64 bits with 20 behind the point
//! target = A[t] + V(s[t])
//! ```
//!
//! Two products are rounded a step, each by at most 2^-21, so `A` is off by less than `2^-20 / (1 - gamma lambda)`, and by
//! less than 2^-20 a step left. `gamma` and `lambda` themselves, numbers with 31 bits behind the point, are not rounded
//! together. What leaves saturates at +-2048. See docs/MODEL.md, 5.
//!
//! [`normalise`] brings the advantages of a rollout to mean 0 and deviation 1, clamped to +-8: within
//! 2^-18 of the exact quotient ([`Moments`]); advantages that are all alike become 0.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::moments::Moments;
use super::number::{Advantage, Probability, Real, Value, saturated};
use crate::num::fixed::rsh;

/// The greatest normalised advantage, in 2^-20.
const BOUND: i64 = 8 << 20;

/// What happened in some environments, `[step][environment]`.
#[derive(Debug, Clone, Copy)]
pub struct Happened<'a> {
    /// Rewards.
    pub rewards: &'a [Real],
    /// What the states were worth in which the actions were taken.
    pub values: &'a [Value],
    /// What the states were worth that were reached; read where truncated alone.
    pub reached: &'a [Value],
    /// Where a task was over.
    pub terminated: &'a [bool],
    /// Where it was stopped.
    pub truncated: &'a [bool],
    /// What the states are worth that are shown now, an entry an environment.
    pub last: &'a [Value],
}

/// How far ahead one looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Horizon {
    /// What a reward one step later is worth, at most 1.
    pub discount: Probability,
    /// How much of what came later is believed, rather than what was expected; at most 1.
    pub trace: Probability,
}

/// Generalised advantage estimates and value targets, `[step][environment]`, in place of what was in the vectors.
///
/// # Panics
/// When the slices do not belong together.
pub fn advantages(
    happened: &Happened<'_>,
    horizon: Horizon,
    advantages: &mut Vec<Advantage>,
    targets: &mut Vec<Value>,
) {
    let Happened { rewards, values, reached, terminated, truncated, last } = *happened;
    let (all, environments) = (rewards.len(), last.len());
    let lengths = [values.len(), reached.len(), terminated.len(), truncated.len()];
    assert!(lengths == [all; 4], "there is one entry a step and environment");
    assert!(all.is_multiple_of(environments), "all environments take all steps");
    for out in [&mut *advantages, targets] {
        out.clear();
        out.resize(all, Advantage::ZERO);
    }
    for environment in 0..environments {
        let mut later = 0;
        let mut next = wide(last[environment]);
        for at in (environment..all).step_by(environments).rev() {
            if terminated[at] || truncated[at] {
                later = 0;
                next = if terminated[at] { 0 } else { wide(reached[at]) };
            }
            let value = wide(values[at]);
            let reward = i64::from(rewards[at].to_bits()) << 4;
            let to_come = next + share(horizon.trace, later);
            later = reward + share(horizon.discount, to_come) - value;
            next = value;
            advantages[at] = saturated(later);
            targets[at] = saturated(later + value);
        }
    }
}

fn wide(value: Value) -> i64 {
    i64::from(value.to_bits())
}

fn share(part: Probability, of: i64) -> i64 {
    rsh(i128::from(part.to_bits()) * i128::from(of), 31) as i64
}

/// Brings advantages to mean 0 and deviation 1, clamped to +-8.
pub fn normalise(advantages: &mut [Advantage]) {
    let spread = Moments::of(advantages.iter().map(|a| a.to_bits())).spread();
    for advantage in advantages {
        let standard = spread.standard(advantage.to_bits(), 20);
        *advantage = Advantage::from_bits(standard.clamp(-BOUND, BOUND) as i32);
    }
}
