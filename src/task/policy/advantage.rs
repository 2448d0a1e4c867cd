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
//! 2^-19 of the exact quotient ([`Moments`]); advantages that are all alike become 0.
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
    for (environment, &last) in last.iter().enumerate() {
        let mut later = 0;
        let mut next = wide(last);
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Bits behind the point of the reference.
    const BITS: u32 = 56;

    fn number(x: i32) -> Value {
        Value::from_bits(x)
    }

    /// One step of one environment: reward, values of the state and of what was reached, how it ended.
    fn step() -> impl Strategy<Value = (i32, i32, i32, u8)> {
        let value = -100i32 << 20..100 << 20;
        (-64i32 << 16..64 << 16, value.clone(), value, 0u8..6)
    }

    /// `sum of (gamma lambda)^k delta[t + k]` to the end of the episode, and what its roundings may come to.
    fn forward(happened: &Happened<'_>, horizon: Horizon, at: usize) -> [i128; 2] {
        let environments = happened.last.len();
        let wide = |x: i32, bits: u32| i128::from(x) << (BITS - bits);
        let part = |p: Probability, x: i128| (i128::from(p.to_bits()) * x) >> 31;
        let (mut sum, mut bound) = (0, 0);
        let (mut at, mut weight) = (at, 1i128 << BITS);
        while at < happened.rewards.len() {
            let (over, stopped) = (happened.terminated[at], happened.truncated[at]);
            let next = if over {
                0
            } else if stopped {
                wide(happened.reached[at].to_bits(), 20)
            } else if at + environments < happened.rewards.len() {
                wide(happened.values[at + environments].to_bits(), 20)
            } else {
                wide(happened.last[at % environments].to_bits(), 20)
            };
            let reward = wide(happened.rewards[at].to_bits(), 16);
            let delta =
                reward + part(horizon.discount, next) - wide(happened.values[at].to_bits(), 20);
            sum += ((delta >> 8) * (weight >> 8)) >> (BITS - 16);
            bound += weight >> 20;
            if over || stopped {
                break;
            }
            weight = part(horizon.discount, part(horizon.trace, weight));
            at += environments;
        }
        [sum, bound]
    }

    #[test]
    fn an_episode_that_ended_is_worth_what_its_end_says() {
        // one environment: the task is over, a limit of time, and two steps that go on
        let value = [8, 16, 24, 32].map(|x| number(x << 20));
        let happened = Happened {
            rewards: &[1, 2, 3, 4].map(|x| Real::from_bits(x << 16)),
            values: &value,
            reached: &[800, 40, 800, 800].map(|x| number(x << 20)),
            terminated: &[true, false, false, false],
            truncated: &[false, true, false, false],
            last: &[number(48 << 20)],
        };
        let half = Probability::from_bits(1 << 30);
        let (mut advantage, mut target) = (vec![number(7)], vec![number(7); 9]);
        advantages(&happened, Horizon { discount: half, trace: half }, &mut advantage, &mut target);
        // 1 - 8;  2 + 40/2 - 16;  3 + (32 - 4/2)/2 - 24, which the last step makes lower;  4 + 48/2 - 32
        assert_eq!(advantage, [-7, 6, -6, -4].map(|x| number(x << 20)));
        assert_eq!(target, [1, 22, 18, 28].map(|x| number(x << 20)));
    }

    #[test]
    fn what_is_too_great_saturates() {
        let happened = Happened {
            rewards: &[Real::MAX, Real::MIN],
            values: &[Value::MIN, Value::MAX],
            reached: &[Value::ZERO; 2],
            terminated: &[false; 2],
            truncated: &[false; 2],
            last: &[Value::MAX, Value::MIN],
        };
        let (mut advantage, mut target) = (vec![], vec![]);
        let all = Horizon { discount: Probability::ONE, trace: Probability::ONE };
        advantages(&happened, all, &mut advantage, &mut target);
        assert_eq!(advantage, [Value::MAX, Value::MIN]);
        assert_eq!(target, [Value::MAX, Value::MIN]);
    }

    #[test]
    #[should_panic(expected = "all environments take all steps")]
    fn half_a_step_is_refused() {
        let happened = Happened {
            rewards: &[Real::ZERO; 3],
            values: &[Value::ZERO; 3],
            reached: &[Value::ZERO; 3],
            terminated: &[false; 3],
            truncated: &[false; 3],
            last: &[Value::ZERO; 2],
        };
        let all = Horizon { discount: Probability::ONE, trace: Probability::ONE };
        advantages(&happened, all, &mut vec![], &mut vec![]);
    }

    #[test]
    fn advantages_that_are_alike_say_nothing_and_great_ones_are_held() {
        let mut alike = [number(5 << 20); 3];
        normalise(&mut alike);
        assert_eq!(alike, [Value::ZERO; 3]);
        normalise(&mut []);
        let mut one = [number(0); 100];
        (one[0], one[1]) = (number(1 << 20), number(-1 << 20));
        normalise(&mut one);
        // 1 / sqrt(2 / 100) = 7.07
        assert_eq!((one[0].to_num::<i32>(), one[0], one[2]), (7, -one[1], number(0)));
        let mut far = [number(0); 200];
        (far[0], far[1]) = (number(1 << 20), number(-1 << 20));
        normalise(&mut far);
        assert_eq!((far[0], far[1]), (number(8 << 20), number(-8 << 20)));
    }

    proptest! {
        #[test]
        fn advantages_are_within_their_bound(
            steps in 1usize..12, environments in 1usize..4,
            all in prop::collection::vec(step(), 48),
            last in prop::collection::vec(-100i32 << 20..100 << 20, 4),
            discount in prop_oneof![Just(1u32 << 31), 0u32..=1 << 31], trace in prop_oneof![Just(1u32 << 31), 0u32..=1 << 31],
        ) {
            let all = &all[..steps * environments];
            let last: Vec<_> = last[..environments].iter().map(|&x| number(x)).collect();
            let happened = Happened {
                rewards: &all.iter().map(|step| Real::from_bits(step.0)).collect::<Vec<_>>(),
                values: &all.iter().map(|step| number(step.1)).collect::<Vec<_>>(),
                reached: &all.iter().map(|step| number(step.2)).collect::<Vec<_>>(),
                terminated: &all.iter().map(|step| step.3 == 0).collect::<Vec<_>>(),
                truncated: &all.iter().map(|step| step.3 == 1).collect::<Vec<_>>(),
                last: &last,
            };
            let horizon = Horizon {
                discount: Probability::from_bits(discount), trace: Probability::from_bits(trace),
            };
            let (mut advantage, mut target) = (vec![], vec![]);
            advantages(&happened, horizon, &mut advantage, &mut target);
            prop_assert_eq!((advantage.len(), target.len()), (all.len(), all.len()));
            for at in 0..all.len() {
                let [exact, bound] = forward(&happened, horizon, at);
                let wide = |x: Value| i128::from(x.to_bits()) << (BITS - 20);
                let off = (wide(advantage[at]) - exact).abs();
                prop_assert!(off <= bound + (1 << 20), "{off} {bound}");
                prop_assert_eq!(wide(target[at]), wide(advantage[at]) + wide(happened.values[at]));
            }
        }

        #[test]
        fn normalised_advantages_are_within_their_bound(
            numbers in prop::collection::vec(-1i32 << 28..1 << 28, 3..200), scale in 0u32..20,
        ) {
            let numbers: Vec<i32> = numbers.iter().map(|x| x >> scale).collect();
            let mut normal: Vec<_> = numbers.iter().map(|&x| number(x)).collect();
            normalise(&mut normal);
            let n = numbers.len() as i128;
            let sum: i128 = numbers.iter().map(|&x| i128::from(x)).sum();
            let apart = n * numbers.iter().map(|&x| i128::from(x).pow(2)).sum::<i128>() - sum * sum;
            prop_assume!(apart >= 256 * n * n);
            let root = (apart << 40).isqrt(); // 2^-20
            for (&x, normal) in numbers.iter().zip(normal) {
                let exact = (((n * i128::from(x) - sum) << 50) / root).clamp(-8 << 30, 8 << 30);
                let off = (i128::from(normal.to_bits()) << 10) - exact;
                prop_assert!(off.abs() <= 1 << 11, "{off}");
            }
        }
    }
}
